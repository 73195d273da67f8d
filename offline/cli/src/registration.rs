//! `[registration]` of `cameras.toml`: the one rigid transform of a set-up that brings the cameras' world into frame 0 of the arm.

use crate::output;
use recordings::pairs::{RegistrationReport, Rigid};
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::Path;

const NAME: &str = "registration";

/// The section; position in frame 0 = rotation · position in the world + translation.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Section {
    /// Rows.
    rotation: [[f64; 3]; 3],
    translation_mm: [f64; 3],
    /// What it was fitted to, and how well: for people.
    #[serde(default)]
    from: String,
    #[serde(default)]
    points: usize,
    #[serde(default)]
    rms_mm: f64,
    /// Standard errors: about the axes of frame 0, and of the middle of the points.
    #[serde(default)]
    rotation_sd_deg: [f64; 3],
    #[serde(default)]
    centre_sd_mm: [f64; 3],
}

/// Reads it.
///
/// # Errors
/// One line for a file that is absent, no TOML, without the section, or whose rotation is none.
pub(crate) fn read(cameras: &Path) -> Result<Rigid, String> {
    let name = cameras.display();
    let text = fs::read_to_string(cameras)
        .map_err(|cause| format!("{name}: cannot be read: {cause}; give the cameras.toml of `ravenpose vision calibrate`"))?;
    let file = parsed(cameras, &text)?;
    let Some(section) = file.get(NAME) else {
        return Err(format!("{name}: has no [{NAME}]; `ravenpose pair RUN --truth truth.csv --register {name}` writes it"));
    };
    let wrong = |what: String| format!("{name}: [{NAME}]: {what}; write it anew with `ravenpose pair --register`");
    let section: Section =
        section.clone().try_into().map_err(|error: toml::de::Error| wrong(error.message().replace('\n', " ")))?;
    let rigid = Rigid { rotation: section.rotation, translation_m: section.translation_mm.map(|mm| mm * 1e-3) };
    if !rigid.is_rotation() {
        return Err(wrong("rotation is no rotation".to_owned()));
    }
    if rigid.translation_m.iter().any(|value| !value.is_finite()) {
        return Err(wrong("translation_mm is not finite".to_owned()));
    }
    Ok(rigid)
}

/// Writes it into the file, in place of an earlier one; everything else stays as it is.
///
/// # Errors
/// One line for a file that is absent, no TOML, or cannot be written.
pub(crate) fn write(cameras: &Path, found: &RegistrationReport, from: &str) -> Result<(), String> {
    let text = fs::read_to_string(cameras)
        .map_err(|cause| format!("{}: cannot be read: {cause}; make it with `ravenpose vision calibrate`", cameras.display()))?;
    let _ = parsed(cameras, &text)?;
    let section = Section {
        rotation: found.rigid.rotation,
        translation_mm: found.rigid.translation_m.map(|m| m * 1e3),
        from: from.to_owned(),
        points: found.points,
        rms_mm: found.rms_m * 1e3,
        rotation_sd_deg: found.rotation_sd_rad.map(f64::to_degrees),
        centre_sd_mm: found.centre_sd_m.map(|m| m * 1e3),
    };
    let body = toml::to_string(&section).map_err(|error| format!("{}: {error}", cameras.display()))?;
    let whole = format!(
        "{}\n# position in frame 0 of the arm = rotation (rows) x position here + translation; by `ravenpose pair --register`.\n[{NAME}]\n{body}",
        without(&text).trim_end()
    );
    // What was put together must read as it was meant.
    let _ = parsed(cameras, &whole)?;
    output::all(cameras, whole.as_bytes())
}

/// The section of a file that is to be written anew, with the comment above it; none where there is no such file, or none in it.
pub(crate) fn kept(cameras: &Path) -> Option<String> {
    let text = fs::read_to_string(cameras).ok()?;
    let section = parsed(cameras, &text).ok()?.remove(NAME)?;
    let body = toml::to_string(&section).ok()?;
    Some(format!(
        "\n# kept from before these cameras were calibrated; it holds where the markers have not been moved since.\n[{NAME}]\n{body}"
    ))
}

fn parsed(cameras: &Path, text: &str) -> Result<toml::Table, String> {
    text.parse().map_err(|error: toml::de::Error| {
        let line = error.span().map_or(1, |span| text[..span.start.min(text.len())].matches('\n').count() + 1);
        let what = error.message().replace('\n', " ");
        format!("{}: line {line}: {what}; make it with `ravenpose vision calibrate`", cameras.display())
    })
}

/// The text without the section and the comment lines right above it.
fn without(text: &str) -> String {
    let mut kept: Vec<&str> = Vec::new();
    let mut inside = false;
    for line in text.lines() {
        let header = line.trim_start().starts_with('[');
        if header {
            inside = line.trim() == format!("[{NAME}]");
            while inside && kept.last().is_some_and(|last| last.trim_start().starts_with('#') || last.trim().is_empty()) {
                kept.pop();
            }
        }
        // Rows of the rotation begin with a bracket too, but deeper in.
        if !inside {
            kept.push(line);
        }
    }
    kept.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAMERAS: &str = "# Cameras.\nresolution = [640, 480]\n\n[[camera]]\nname = \"cam0\"\nrotation = [[1.0, 0.0, 0.0],\n[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]\n";

    fn report() -> RegistrationReport {
        RegistrationReport {
            fitted: true,
            rigid: Rigid { rotation: [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], translation_m: [0.1, -0.2, 0.3] },
            rotation_sd_rad: [1e-3; 3],
            centre_sd_m: [1e-4; 3],
            inliers: 90,
            points: 100,
            rms_m: 6e-4,
            sd_m: [3e-4; 3],
            covariance_m2: [[0.0; 3]; 3],
            explained: 0.99,
        }
    }

    #[test]
    fn what_was_written_is_read_and_a_second_one_takes_its_place() {
        let file = std::env::temp_dir().join(format!("ravenpose-registration-{}.toml", std::process::id()));
        fs::write(&file, CAMERAS).expect("file");
        for _ in 0..3 {
            write(&file, &report(), "a \"run\".mcap").expect("written");
        }
        let found = read(&file).expect("read");
        let text = fs::read_to_string(&file).expect("file");
        fs::remove_file(&file).expect("file");
        assert_eq!(found, report().rigid);
        assert!(text.starts_with(CAMERAS), "{text}");
        assert_eq!(text.matches("[registration]").count(), 1);
        assert_eq!(text.matches("by `ravenpose pair --register`").count(), 1);
    }

    #[test]
    fn a_section_that_is_absent_or_no_rotation_is_one_line() {
        let file = std::env::temp_dir().join(format!("ravenpose-registration-bad-{}.toml", std::process::id()));
        let section =
            |rotation: &str| format!("{CAMERAS}[registration]\nrotation = {rotation}\ntranslation_mm = [0.0, 0.0, 0.0]\n");
        for (text, what) in [
            (CAMERAS.to_owned(), "has no [registration]"),
            ("camera = [".to_owned(), "line 1"),
            (section("[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]]"), "no rotation"),
            (section("[[1.1, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]"), "no rotation"),
            (section("[[nan, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]"), "no rotation"),
            (section("[[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]]"), "[registration]"),
        ] {
            fs::write(&file, text).expect("file");
            let line = read(&file).expect_err(what);
            assert!(line.contains(what) && line.lines().count() == 1, "{line}");
        }
        fs::remove_file(&file).expect("file");
        assert!(read(&file).expect_err("absent").contains("cannot be read"));
    }
}
