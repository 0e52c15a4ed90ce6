//! Recordings that `dockhil run` made: they carry what they were made from, and can be made again to the last bit. Recordings that
//! a replay left carry the model of that replay, and no more: they are replayed as any other recording.

use super::REPLAY_RECORD;
use crate::error::Error;
use crate::files::sha256_hex;
use crate::recording::Luggage;
use crate::scenario::Source;
use crate::scenario::run::{MODEL_FILE, RECORD, SCENARIO_FILE};
use std::path::Path;

/// What a recording of ours was made from.
#[derive(Debug, Clone, PartialEq)]
pub struct Own {
    /// Scenario and model.
    pub source: Source,
    /// Fingerprint of the run that made it.
    pub fingerprint: String,
    /// Version of the program that made it.
    pub version: String,
    /// SHA-256 of the model.
    pub model_sha256: String,
}

impl Own {
    /// Looks for the record of a run, and for the files that belong to it.
    ///
    /// # Errors
    /// When the record is there and its files are not, or are not the ones that it names.
    pub fn find(recording: &Path, luggage: &Luggage) -> Result<Option<Self>, Error> {
        let Some((_, record)) = luggage.metadata.iter().find(|(name, _)| name == RECORD) else { return Ok(None) };
        let broken = |what: String| {
            Error::new(what)
                .file(recording)
                .place(format!("metadata record {RECORD}"))
                .help("the recording was changed after it was made: make it again with dockhil run, or give --model and take the record out")
        };
        let key = |key: &str| record.get(key).cloned().ok_or_else(|| broken(format!("the record does not say {key}")));
        let text = |name: &str, sha256: &str| {
            let file = luggage.files.iter().find(|(file, _)| file == name);
            let (_, bytes) = file.ok_or_else(|| broken(format!("the file {name} is not attached")))?;
            if sha256_hex(bytes) != sha256 {
                return Err(broken(format!("the attached file {name} is not the one that the record names (SHA-256)")));
            }
            String::from_utf8(bytes.clone()).map_err(|_| broken(format!("the attached file {name} is no text")))
        };
        let model_sha256 = key("model_sha256")?;
        let inside = |name: &str| format!("{} / {name}", recording.display()).into();
        let source = Source {
            text: text(SCENARIO_FILE, &key("scenario_sha256")?)?,
            file: inside(SCENARIO_FILE),
            model_text: text(MODEL_FILE, &model_sha256)?,
            model_file: inside(MODEL_FILE),
            is_embedded: true,
        };
        Ok(Some(Own { source, fingerprint: key("fingerprint")?, version: key("version")?, model_sha256 }))
    }
}

/// What a replay that was saved was made with.
#[derive(Debug, Clone, PartialEq)]
pub struct Earlier {
    /// What was clamped.
    pub clamp: String,
    /// The faults that were put in, in words; empty if there were none.
    pub faults: String,
    /// The text of its model, if it is attached and the one that the record names.
    pub model_text: Option<String>,
}

impl Earlier {
    /// Looks for the record of a replay.
    pub fn find(luggage: &Luggage) -> Option<Self> {
        let (_, record) = luggage.metadata.iter().find(|(name, _)| name == REPLAY_RECORD)?;
        let key = |key: &str| record.get(key).cloned().unwrap_or_default();
        let named = key("model_sha256");
        let files = luggage.files.iter().filter(|(name, bytes)| name == MODEL_FILE && sha256_hex(bytes) == named);
        let model_text = files.filter_map(|(_, bytes)| String::from_utf8(bytes.clone()).ok()).next();
        Some(Earlier { clamp: key("clamp"), faults: key("faults"), model_text })
    }
}
