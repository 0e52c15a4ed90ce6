//! Files are written whole or not at all.

use crate::error::Error;
use std::io::Write;
use std::path::Path;

/// Writes beside the target, then renames: nobody ever sees half a file.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    let failed = |error: std::io::Error| {
        Error::new(format!("cannot write: {error}")).file(path).help("check that the folder exists and is writable")
    };
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    name.push(".part");
    let beside = path.with_file_name(name);
    let mut file = std::fs::File::create(&beside).map_err(failed)?;
    let written = file.write_all(bytes).and_then(|()| file.sync_all()).and_then(|()| std::fs::rename(&beside, path));
    written.map_err(|error| {
        // The file beside is ours; that it cannot be removed either adds nothing to the message.
        let _ = std::fs::remove_file(&beside);
        failed(error)
    })
}
