//! A file that gets its name when it is complete.

use atomic_write_file::AtomicWriteFile;
use std::fs::File;
use std::path::Path;

/// Nothing is left of it when it is dropped without [`Aside::commit`], nor when the program is ended.
#[derive(Debug)]
pub(crate) struct Aside(AtomicWriteFile);

impl Aside {
    /// Makes the file, empty, for reading and writing.
    pub(crate) fn create(path: &Path) -> std::io::Result<(Self, File)> {
        // Found out when the file gets its name, its content would be left under another one.
        if path.is_dir() {
            return Err(std::io::ErrorKind::IsADirectory.into());
        }
        let aside = AtomicWriteFile::options().read(true).open(path)?;
        let file = aside.as_file().try_clone()?;
        Ok((Self(aside), file))
    }

    /// Brings the content to the disk, then gives the file its name.
    pub(crate) fn commit(self) -> std::io::Result<()> {
        self.0.commit()
    }
}

/// A rename reaches the disk with the folder.
pub(crate) fn sync_folder(path: &Path) -> std::io::Result<()> {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => File::open(folder)?.sync_all(),
        _ => File::open(".")?.sync_all(),
    }
}
