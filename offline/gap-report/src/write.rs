//! Onto the disk: report.json and report.html, neither of which has its name before it is complete, so that nobody reads half a
//! file.

use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use crate::{Pictures, Report, html};

/// Why there is no report.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The folder cannot be made.
    #[error("{path}: cannot make the folder: {source}")]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file cannot be written.
    #[error("{path}: cannot be written: {source}")]
    File {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A number is NaN or infinite, which JSON has no word for, or an object cannot be JSON.
    #[error("report.json: {0}")]
    Json(String),
}

/// Writes report.json and report.html into a folder, which is made if it is not there. The report is not judged beyond what
/// JSON can hold: see [`crate::check`].
///
/// # Errors
/// [`WriteError`]; files that were there before stay as they were.
pub fn write(report: &Report, pictures: &Pictures, folder: &Path) -> Result<(), WriteError> {
    let text = json(report)?;
    let page = html(report, pictures);
    std::fs::create_dir_all(folder).map_err(|source| WriteError::Folder { path: folder.to_owned(), source })?;
    replace(&folder.join("report.json"), text.as_bytes())?;
    replace(&folder.join("report.html"), page.as_bytes())
}

/// The text of report.json.
///
/// # Errors
/// [`WriteError::Json`] with the places of numbers that are NaN or infinite.
pub fn json(report: &Report) -> Result<String, WriteError> {
    let unwritable = crate::check::not_finite(report);
    if !unwritable.is_empty() {
        return Err(WriteError::Json(unwritable.join("; ")));
    }
    serde_json::to_string_pretty(report).map(|text| text + "\n").map_err(|error| WriteError::Json(error.to_string()))
}

/// A file as a whole or not at all.
fn replace(path: &Path, bytes: &[u8]) -> Result<(), WriteError> {
    outputs::write(path, bytes).map_err(|source| WriteError::File { path: path.to_owned(), source })
}

/// A time as RFC 3339 in UTC to the second, such as `2026-01-15T10:00:00Z`, for [`Report::created`].
pub fn timestamp(time: SystemTime) -> String {
    let seconds = time.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
    let (day, second) = (seconds / 86_400, seconds % 86_400);
    let (year, month, day) = date(day);
    format!("{year:04}-{month:02}-{day:02}T{:02}:{:02}:{:02}Z", second / 3600, second / 60 % 60, second % 60)
}

/// Year, month and day of a day after 1970-01-01. Years begin in March here, so that the leap day is the last one (after
/// H. Hinnant, "chrono-compatible low-level date algorithms").
fn date(days: u64) -> (u64, u64, u64) {
    const DAYS_TO_1970: u64 = 719_468;
    let days = days + DAYS_TO_1970;
    let (era, of_era) = (days / 146_097, days % 146_097);
    let year = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    let month = (5 * of_year + 2) / 153;
    let day = of_year - (153 * month + 2) / 5 + 1;
    let (month, next) = if month < 10 { (month + 3, 0) } else { (month - 9, 1) };
    (400 * era + year + next, month, day)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn times_of_known_seconds() {
        for (seconds, text) in [
            (0, "1970-01-01T00:00:00Z"),
            (951_782_399, "2000-02-28T23:59:59Z"),
            (951_782_400, "2000-02-29T00:00:00Z"),
            (1_768_471_200, "2026-01-15T10:00:00Z"),
            (4_107_542_400, "2100-03-01T00:00:00Z"),
        ] {
            assert_eq!(timestamp(UNIX_EPOCH + Duration::from_secs(seconds)), text);
        }
    }
}
