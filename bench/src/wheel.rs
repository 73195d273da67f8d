//! Libraries inside Python packages, from the virtual environments that `make venv` and `make bench-peers` make.
//!
//! This module contains `unsafe`: opening a library, and looking for its symbols.

use std::ffi::{CStr, CString, c_void};
use std::path::{Path, PathBuf};

const ENVIRONMENTS: [&str; 2] = ["build/venv/lib", "build/peers/lib"];

/// The first file of a package's folder whose name begins so.
pub(crate) fn library(folder: &str, prefix: &str) -> Option<PathBuf> {
    let entries =
        |path: &Path| std::fs::read_dir(path).into_iter().flatten().flatten().map(|entry| entry.path()).collect::<Vec<_>>();
    let pythons = ENVIRONMENTS.iter().flat_map(|environment| entries(Path::new(environment)));
    let folders = pythons.map(|python| python.join("site-packages").join(folder));
    let named = |path: &PathBuf| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(prefix));
    folders.flat_map(|folder| entries(&folder)).find(named)
}

/// A library that stays open to the end of the process.
pub(crate) struct Library {
    handle: *mut c_void,
    path: PathBuf,
}

impl Library {
    pub(crate) fn open(path: &Path) -> Result<Self, String> {
        let name = CString::new(path.display().to_string()).map_err(|cause| cause.to_string())?;
        // SAFETY: the name ends with 0; what the library does when it is loaded is its package's business.
        let handle = unsafe { libc::dlopen(name.as_ptr(), libc::RTLD_NOW | libc::RTLD_LOCAL) };
        if handle.is_null() {
            Err(format!("{}: cannot be opened", path.display()))
        } else {
            Ok(Self { handle, path: path.to_owned() })
        }
    }

    /// A function of the library.
    ///
    /// # Safety
    /// `F` is the type of a function pointer, of the signature that the library's header declares under this name.
    pub(crate) unsafe fn function<F: Copy>(&self, name: &CStr) -> Result<F, String> {
        const { assert!(size_of::<F>() == size_of::<*mut c_void>()) };
        // SAFETY: the handle is open, the name ends with 0.
        let symbol = unsafe { libc::dlsym(self.handle, name.as_ptr()) };
        if symbol.is_null() {
            return Err(format!("{}: has no {}", self.path.display(), name.to_string_lossy()));
        }
        // SAFETY: of the size of a pointer, as checked above, and by the caller's promise of this type.
        Ok(unsafe { std::mem::transmute_copy::<*mut c_void, F>(&symbol) })
    }
}
