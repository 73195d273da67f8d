//! Files beside the report.

use serde::{Deserialize, Serialize};

use super::Extra;
use crate::names::names;

names! {
    /// What a file beside the report is.
    Format {
        /// TOML, such as a robot model.
        Toml "toml",
        /// JSON.
        Json "json",
        /// Unified robot description format.
        Urdf "urdf",
        /// MuJoCo's model format.
        Mjcf "mjcf",
        /// Gazebo's model format.
        Sdf "sdf",
        /// C source.
        C "c",
        /// Comma-separated table.
        Csv "csv",
        /// Parquet table.
        Parquet "parquet",
        /// Vector picture.
        Svg "svg",
        /// Raster picture.
        Png "png",
        /// Page.
        Html "html",
    }
}

/// A file beside the report.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Artifact {
    /// Path relative to the folder of report.json, without `..`.
    pub path: String,
    /// What it is.
    pub format: Format,
    /// SHA-256 of its bytes, 64 lower-case hexadecimal digits.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sha256: Option<String>,
    /// Title.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub title: Option<String>,
    /// Further keys.
    #[serde(flatten)]
    pub extra: Extra,
}

impl Artifact {
    /// A file of a kind, without hash and title.
    pub fn new(path: impl Into<String>, format: Format) -> Self {
        Self { path: path.into(), format, sha256: None, title: None, extra: Extra::default() }
    }

    /// Sets the hash of its bytes.
    #[must_use]
    pub fn sha256(mut self, hash: impl Into<String>) -> Self {
        self.sha256 = Some(hash.into());
        self
    }

    /// Sets its title.
    #[must_use]
    pub fn title(mut self, title: impl Into<String>) -> Self {
        self.title = Some(title.into());
        self
    }
}
