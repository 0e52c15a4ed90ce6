//! Files are written whole or not at all.

use crate::error::Error;
use sha2::{Digest as _, Sha256};
use std::io::Write;
use std::path::Path;

/// Writes beside the target, then renames: nobody ever sees half a file. A link is followed; what is no regular file, such as
/// a pipe or a device, is written to and stays what it is.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    let failed = |error: std::io::Error| {
        Error::new(format!("cannot write: {error}"))
            .file(path)
            .help("check that the folder exists, is writable and has room")
    };
    if path.metadata().is_ok_and(|about| !about.is_file()) {
        let opened = std::fs::OpenOptions::new().write(true).open(path);
        return opened.and_then(|mut file| file.write_all(bytes)).map_err(failed);
    }
    let target = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    let mut name = target.file_name().unwrap_or_default().to_os_string();
    name.push(".part");
    let beside = target.with_file_name(name);
    let mut file = std::fs::File::create(&beside).map_err(failed)?;
    let written = file.write_all(bytes).and_then(|()| file.sync_all()).and_then(|()| std::fs::rename(&beside, &target));
    written.map_err(|error| {
        // The file beside is ours; that it cannot be removed either adds nothing to the message.
        let _ = std::fs::remove_file(&beside);
        failed(error)
    })
}

/// SHA-256 of some bytes, in hexadecimal.
pub fn sha256_hex(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}
