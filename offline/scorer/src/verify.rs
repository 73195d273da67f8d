//! Nothing was changed after its hash was published.

use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A truth or report with the hash it had.
pub type Bytes = BTreeMap<String, Vec<u8>>;

/// SHA-256 in hexadecimal.
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().fold(String::new(), |text, byte| text + &format!("{byte:02x}"))
}

/// The hashes of a manifest: its `cases` object.
///
/// # Errors
///
/// A file that is not there or has no such object.
pub fn manifest(path: &Path) -> Result<BTreeMap<String, String>, String> {
    let bytes = std::fs::read(path).map_err(|error| format!("{}: {error}", path.display()))?;
    let value: serde_json::Value = serde_json::from_slice(&bytes).map_err(|error| format!("{}: {error}", path.display()))?;
    serde_json::from_value(value["cases"].clone()).map_err(|error| format!("{}: `cases`: {error}", path.display()))
}

/// Reads the file of every case of a manifest and compares its hash. `missing_allowed`: a file that is not there is left out.
///
/// # Errors
///
/// The first file that is not what was published.
pub fn read(hashes: &BTreeMap<String, String>, place: impl Fn(&str) -> PathBuf, missing_allowed: bool) -> Result<Bytes, String> {
    let mut all = Bytes::new();
    for (case, hash) in hashes {
        let path = place(case);
        match std::fs::read(&path) {
            Ok(bytes) if &sha256(&bytes) == hash => {
                all.insert(case.clone(), bytes);
            }
            Ok(_) => return Err(format!("{}: not what its manifest says; it was changed after publication", path.display())),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound && missing_allowed => {}
            Err(error) => return Err(format!("{}: {error}", path.display())),
        }
    }
    Ok(all)
}

/// Compares the files of one case with the hashes that its truth holds. A case that was thrown away after the run is no trouble.
///
/// # Errors
///
/// The first file that is not what was sealed.
pub fn data(folder: &Path, files: &BTreeMap<String, String>) -> Result<(), String> {
    for (name, hash) in files {
        let path = folder.join(name);
        match std::fs::read(&path) {
            Ok(bytes) if &sha256(&bytes) != hash => return Err(format!("{}: not the file that was sealed", path.display())),
            _ => {}
        }
    }
    Ok(())
}

/// Writes a file under a temporary name and renames it.
///
/// # Errors
///
/// Those of the disk.
pub fn write_whole(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    name.push(".part");
    let part = path.with_file_name(name);
    std::fs::write(&part, bytes)?;
    std::fs::rename(&part, path)
}
