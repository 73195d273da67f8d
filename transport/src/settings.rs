//! Where the shared files live.

use crate::TransportError;
use iceoryx2::prelude::{Config, FileName, Path, SemanticString};
use std::time::Duration;

const CREATION_TIMEOUT: Duration = Duration::from_micros(100);

/// Prefix and root of the shared files. All parties that want to talk must agree on both; the defaults are those of iceoryx2, so
/// that any iceoryx2 client finds us.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Settings {
    /// Prefix of every shared file, `iox2_` by default. Another prefix makes another, separate world (tests, a second robot).
    pub prefix: String,
    /// Directory of iceoryx2's own files, `/tmp/iceoryx2/` by default.
    pub root: String,
}

impl Default for Settings {
    fn default() -> Self {
        Self { prefix: "iox2_".to_owned(), root: "/tmp/iceoryx2/".to_owned() }
    }
}

impl Settings {
    /// The defaults, or what `RAVENPOSE_PREFIX` and `RAVENPOSE_ROOT` say.
    pub fn from_env() -> Self {
        let default = Self::default();
        Self {
            prefix: std::env::var("RAVENPOSE_PREFIX").ok().filter(|v| !v.is_empty()).unwrap_or(default.prefix),
            root: std::env::var("RAVENPOSE_ROOT").ok().filter(|v| !v.is_empty()).unwrap_or(default.root),
        }
    }

    /// Can files be named so?
    ///
    /// # Errors
    /// [`TransportError::Settings`].
    pub fn check(&self) -> Result<(), TransportError> {
        self.iceoryx2().map(drop)
    }

    pub(crate) fn iceoryx2(&self) -> Result<Config, TransportError> {
        let mut config = Config::default();
        let bad = |what: &str, value: &str| TransportError::Settings { what: what.to_owned(), value: value.to_owned() };
        config.global.prefix = FileName::new(self.prefix.as_bytes()).map_err(|_| bad("prefix", &self.prefix))?;
        // Another working directory would be another world.
        if !self.root.starts_with('/') {
            return Err(TransportError::Relative { root: self.root.clone() });
        }
        config.global.set_root_path(&Path::new(self.root.as_bytes()).map_err(|_| bad("root", &self.root))?);
        // How long iceoryx2 retries on a peer's files that it cannot open, also inside `send` and `receive` (another user's files, for
        // one): half a second by default, far too long inside a controller. Opening retries by itself, see `link::retried`.
        config.global.creation_timeout = CREATION_TIMEOUT;
        Ok(config)
    }
}
