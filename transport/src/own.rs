//! A link of a test's own.

use crate::Settings;

/// Files of a link of its own, gone when dropped.
pub(crate) struct Own(pub Settings);

impl Own {
    /// Of this name and process.
    pub(crate) fn new(name: &str) -> Self {
        let name = format!("{name}{}_", std::process::id());
        let root = std::env::temp_dir().join(format!("ravenpose-{name}"));
        Self(Settings { prefix: name, root: format!("{}/", root.display()) })
    }
}

impl Drop for Own {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0.root);
        for file in std::fs::read_dir("/dev/shm").into_iter().flatten().flatten() {
            if file.file_name().to_string_lossy().starts_with(&self.0.prefix) {
                let _ = std::fs::remove_file(file.path());
            }
        }
    }
}
