//! Shared by the tests: where scenes are, and changed copies of them.
#![allow(dead_code, missing_docs, reason = "each test file uses its own part")]

use std::path::{Path, PathBuf};
use vision::accuracy::{Accuracy, compare, read_truth};
use vision::commands;
use vision::outcome::Tracked;
use vision::track::Mode;

/// A folder of test data, or plain words that it is absent.
pub(crate) fn data(name: &str) -> Option<PathBuf> {
    let root = std::env::var_os("RAVENPOSE_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"), PathBuf::from);
    let folder = root.join(name);
    if folder.exists() {
        return Some(folder);
    }
    println!("skipped: {} is absent", folder.display());
    None
}

/// A folder that is removed in the end.
pub(crate) struct Folder(pub(crate) PathBuf);

impl Folder {
    pub(crate) fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("ravenpose-vision-{}-{name}", std::process::id()));
        drop(std::fs::remove_dir_all(&path));
        std::fs::create_dir_all(&path).expect("a temporary folder");
        Self(path)
    }

    /// A copy of a scene whose first `frames` frames are linked in.
    pub(crate) fn of_scene(name: &str, scene: &Path, frames: usize) -> Self {
        let copy = Self::new(name);
        for file in ["rig.toml", "markers.csv", "truth.csv"] {
            std::fs::write(copy.0.join(file), std::fs::read(scene.join(file)).expect(file)).expect(file);
        }
        let text = std::fs::read_to_string(scene.join("frames.csv")).expect("frames.csv");
        let kept: Vec<&str> = text.lines().take(frames + 1).collect();
        std::fs::write(copy.0.join("frames.csv"), kept.join("\n")).expect("frames.csv");
        std::fs::create_dir_all(copy.0.join("chessboard")).expect("folder");
        for camera in 0..4 {
            let board = format!("chessboard/cam{camera}.jpg");
            std::os::unix::fs::symlink(scene.join(&board), copy.0.join(&board)).expect("link");
            let images = format!("frames/cam{camera}");
            std::fs::create_dir_all(copy.0.join(&images)).expect("folder");
            for frame in 0..frames {
                let image = format!("{images}/{frame:06}.jpg");
                std::os::unix::fs::symlink(scene.join(&image), copy.0.join(&image)).expect("link");
            }
        }
        copy
    }

    /// Replaces something in a text file.
    pub(crate) fn edit(&self, file: &str, change: impl Fn(&str) -> String) {
        let path = self.0.join(file);
        let text = std::fs::read_to_string(&path).expect(file);
        let changed = change(&text);
        assert_ne!(text, changed, "the edit of {file} changes something");
        std::fs::write(&path, changed).expect(file);
    }

    /// Replaces an image by what a function makes of it.
    pub(crate) fn repaint(&self, file: &str, change: impl Fn(&image::RgbImage) -> image::RgbImage) {
        let path = self.0.join(file);
        let image = image::open(&path).expect(file).to_rgb8();
        std::fs::remove_file(&path).expect(file);
        let out = std::io::BufWriter::new(std::fs::File::create(&path).expect(file));
        image::codecs::jpeg::JpegEncoder::new_with_quality(out, 92).encode_image(&change(&image)).expect(file);
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        drop(std::fs::remove_dir_all(&self.0));
    }
}

/// Calibrates a folder and tracks its recording.
pub(crate) fn run(folder: &Path, mode: Mode) -> Result<Tracked, vision::Error> {
    let file = folder.join("cameras.toml");
    let (own, file) = if std::fs::write(&file, "").is_ok() {
        (None, file)
    } else {
        let own = Folder::new(&format!("cameras-{}", folder.file_name().map_or_else(String::new, |n| n.to_string_lossy().into())));
        let file = own.0.join("cameras.toml");
        (Some(own), file)
    };
    std::fs::write(&file, commands::cameras_text(&commands::calibrate(folder, mode)?)).expect("written");
    let tracked = commands::track(&file, folder, mode, &mut |_, _| {});
    drop(own);
    tracked
}

/// Calibrates, tracks, and compares with the scene's truth.
pub(crate) fn accuracy(folder: &Path, mode: Mode) -> Accuracy {
    let tracked = run(folder, mode).expect("a measured recording");
    let truth = read_truth(&folder.join("truth.csv")).expect("truth");
    let rig = vision::rig::read(folder).expect("rig");
    let found = compare(&tracked, &truth, rig.fixture.as_ref().expect("fixture")).expect("measured frames");
    print!("{}", vision::accuracy::lines(&folder.display().to_string(), &found));
    found
}
