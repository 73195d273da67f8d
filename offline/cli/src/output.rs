//! Output files appear whole or not at all.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// Writes through `write` into a file beside `path`, then renames it; on any failure nothing is left.
pub(crate) fn whole(path: &Path, write: impl FnOnce(&mut dyn Write) -> Result<(), String>) -> Result<(), String> {
    let mut aside = path.as_os_str().to_owned();
    aside.push(format!(".{}.new", std::process::id()));
    let aside = PathBuf::from(aside);
    let failed = |cause: std::io::Error| format!("{}: cannot be written: {cause}", path.display());
    let file = File::create(&aside).map_err(failed)?;
    let mut buffered = BufWriter::new(file);
    let written = write(&mut buffered)
        .and_then(|()| buffered.flush().map_err(failed))
        .and_then(|()| buffered.get_ref().sync_all().map_err(failed))
        .and_then(|()| fs::rename(&aside, path).map_err(failed));
    if written.is_err() {
        let _ = fs::remove_file(&aside);
    }
    written
}
