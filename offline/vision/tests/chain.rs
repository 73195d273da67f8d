//! Recordings of our own rendering, measured against their truth: the renderer shares no code with the tracker.

mod common;

use common::{Folder, accuracy, run};
use renderer::{Motion, Scene, render};
use vision::accuracy::Accuracy;
use vision::commands;
use vision::track::Mode;

/// A rendered scene of some frames.
fn rendered(name: &str, scene: &str, frames: usize) -> Folder {
    let own = Folder::new(name);
    let scene = Scene::parse(name, scene).expect("a scene");
    let seconds = (frames as f64 - 0.5) / scene.frames_per_s;
    let made =
        render(&scene, &Motion::wandering(u64::from(name != "line") * 3), 5, seconds, &own.0, &mut |_, _| {}).expect("rendered");
    assert_eq!((made.frames, made.in_view), (frames, frames));
    own
}

fn measured(name: &str, scene: &str, frames: usize) -> Accuracy {
    accuracy(&rendered(name, scene, frames).0, Mode::Default)
}

#[test]
fn small_images_are_measured() {
    let found = measured("small", "resolution = [640, 480]", 6);
    assert!(found.measured == 6 && found.wrong == 0, "{found:?}");
    assert!(found.end_effector.rms_mm[3] < 0.30 && found.orientation_deg < 0.2, "{found:?}");
}

#[test]
fn three_cameras_with_bent_images_and_clutter_are_enough() {
    let scene = "resolution = [640, 480]\ncameras = 3\nfocal = 0.8\ndistortion = -0.25\nclutter = 4\nnoise = 3.0";
    let found = measured("three", scene, 6);
    assert!(found.measured >= 5 && found.wrong == 0, "{found:?}");
    assert!(found.end_effector.rms_mm[3] < 0.50, "{found:?}");
}

#[test]
fn cameras_on_one_line_are_named_and_nothing_is_guessed() {
    let camera = |x: f64| format!("[[camera]]\nposition_mm = [{x}, -600.0, 25.0]\nlook_at_mm = [0.0, 0.0, 244.0]\n");
    let scene = format!("resolution = [640, 480]\n{}{}{}", camera(-420.0), camera(0.0), camera(420.0));
    let own = rendered("line", &scene, 5);
    let found = commands::calibrate(&own.0, Mode::Default).expect("cameras");
    assert!(
        found.remarks.iter().any(|remark| remark.contains("rig.toml") && remark.contains("on one line")),
        "{:?}",
        found.remarks
    );
    let found = accuracy(&own.0, Mode::Default);
    assert!(found.measured >= 4 && found.wrong == 0, "{found:?}");
}

#[test]
fn the_contact_sheet_says_what_was_suspended() {
    let own = rendered("sheet", "resolution = [640, 480]\n", 3);
    std::fs::remove_file(own.0.join("frames/cam2/000001.jpg")).expect("image");
    let tracked = run(&own.0, Mode::Default).expect("tracked");
    let text = commands::overlay_text(&own.0.join("cameras.toml"), &own.0, &tracked).expect("a page");
    assert_eq!(text.matches("<section").count(), 3);
    assert_eq!(text.matches("<image").count(), 11, "four cameras, three frames, one image missing");
    assert_eq!(text.matches("class=\"in\"").count(), 33);
    assert_eq!(text.matches("class=\"out\"").count(), 3);
    assert!(text.contains("green: no image, or a black one"), "the reason stands beside the image");
    assert!(!text.contains("http"), "nothing from outside");
}

#[test]
fn the_same_seed_gives_the_same_images() {
    let bytes =
        |name: &str| std::fs::read(rendered(name, "resolution = [320, 240]", 1).0.join("frames/cam1/000000.jpg")).expect("image");
    assert_eq!(bytes("seed-a"), bytes("seed-b"));
}

#[test]
fn scenes_that_cannot_be_are_refused_in_one_line() {
    for (text, words) in [
        ("fps = 3", ["line 1", "fps"]),
        ("focal = 0.0", ["focal", "between"]),
        ("cameras = 1", ["cameras", "between 2 and 16"]),
        ("balls = [\"pink\", \"red\", \"green\"]", ["balls", "pink"]),
        ("balls = [\"red\", \"red\", \"green\"]", ["balls", "one colour"]),
        ("resolution = [1, 1]", ["resolution", "64"]),
        ("light = [0, 0, 0]", ["light", "three numbers"]),
    ] {
        let line = Scene::parse("scene.toml", text).expect_err(text).to_string();
        assert!(line.starts_with("scene.toml: ") && !line.contains('\n'), "{line}");
        assert!(words.iter().all(|word| line.contains(word)), "{line}");
    }
}

#[test]
fn a_folder_in_use_is_left_alone() {
    let own = Folder::new("occupied");
    std::fs::write(own.0.join("notes.txt"), "mine").expect("a file");
    let scene = Scene::parse("small", "resolution = [64, 64]").expect("a scene");
    let line = render(&scene, &Motion::wandering(0), 0, 0.0, &own.0, &mut |_, _| {}).expect_err("refused").to_string();
    assert!(line.contains("is not empty"), "{line}");
    assert_eq!(std::fs::read_dir(&own.0).expect("folder").count(), 1);
}
