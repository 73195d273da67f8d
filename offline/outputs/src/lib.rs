//! Files that have no name before they are complete.

use atomic_write_file::AtomicWriteFile;
use std::fs::File;
use std::io::{ErrorKind, Result, Write};
use std::path::Path;

/// A file being written. Nothing is left of it when it is dropped without [`Whole::commit`], nor when the program is ended.
#[derive(Debug)]
pub struct Whole(AtomicWriteFile);

impl Whole {
    /// Makes the file, empty, for reading and writing.
    ///
    /// # Errors
    /// Those of the filesystem, and a folder in the place of the file.
    pub fn create(path: &Path) -> Result<(Self, File)> {
        // Found out when the file gets its name, its content would be left under another one.
        if path.is_dir() {
            return Err(ErrorKind::IsADirectory.into());
        }
        let whole = AtomicWriteFile::options().read(true).open(path)?;
        let file = whole.as_file().try_clone()?;
        Ok((Self(whole), file))
    }

    /// Brings the content to the disk, then gives the file its name.
    ///
    /// # Errors
    /// Those of the filesystem.
    pub fn commit(self) -> Result<()> {
        self.0.commit()
    }
}

/// Writes bytes so.
///
/// # Errors
/// Those of the filesystem, and a folder in the place of the file.
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    let (whole, mut file) = Whole::create(path)?;
    file.write_all(bytes)?;
    whole.commit()
}

/// Can there be another file in a folder? Nothing is left of the one that is tried.
///
/// # Errors
/// Those of the filesystem.
pub fn try_in(folder: &Path) -> Result<()> {
    Whole::create(&folder.join(".ravenpose")).map(drop)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn a_file_is_replaced_whole_and_what_fails_or_is_dropped_leaves_nothing() {
        let folder = std::env::temp_dir().join(format!("ravenpose-outputs-{}", std::process::id()));
        fs::create_dir_all(folder.join("taken")).expect("folder");
        let names = || fs::read_dir(&folder).expect("folder").count();
        write(&folder.join("file"), b"first").expect("written");
        write(&folder.join("file"), b"again").expect("written");
        assert_eq!(fs::read(folder.join("file")).expect("read"), b"again");
        assert_eq!(write(&folder.join("taken"), b"x").expect_err("a folder").kind(), ErrorKind::IsADirectory);
        assert!(write(&folder.join("absent/file"), b"x").is_err());
        let (whole, mut file) = Whole::create(&folder.join("dropped")).expect("begun");
        file.write_all(b"x").expect("written");
        drop(whole);
        try_in(&folder).expect("room");
        assert_eq!(names(), 2, "file and taken");
        fs::remove_dir_all(&folder).expect("removed");
    }
}
