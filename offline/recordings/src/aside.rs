//! A file that is written under a temporary name in the same folder and gets its own name when it is complete.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Removes itself when dropped without [`Aside::commit`].
#[derive(Debug)]
pub(crate) struct Aside {
    path: PathBuf,
    temporary: PathBuf,
    complete: bool,
}

impl Aside {
    /// Makes the temporary file, empty, for reading and writing.
    pub(crate) fn create(path: &Path) -> std::io::Result<(Self, File)> {
        let aside = Self { path: path.to_owned(), temporary: temporary_beside(path), complete: false };
        let file = File::options().read(true).write(true).create(true).truncate(true).open(&aside.temporary)?;
        Ok((aside, file))
    }

    /// Brings the content to the disk, then gives the file its name.
    pub(crate) fn commit(mut self, file: &File) -> std::io::Result<()> {
        file.sync_all()?;
        std::fs::rename(&self.temporary, &self.path)?;
        self.complete = true;
        sync_folder(&self.path)
    }
}

impl Drop for Aside {
    fn drop(&mut self) {
        if !self.complete {
            let _ = std::fs::remove_file(&self.temporary);
        }
    }
}

/// A rename reaches the disk with the folder.
pub(crate) fn sync_folder(path: &Path) -> std::io::Result<()> {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => File::open(folder)?.sync_all(),
        _ => File::open(".")?.sync_all(),
    }
}

fn temporary_beside(path: &Path) -> PathBuf {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let mut name = std::ffi::OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(format!(".{}.{}.tmp", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed)));
    path.with_file_name(name)
}
