//! What a lab may give by mistake: one line that says file, place, what and remedy, or a frame that is lost.

mod common;

use common::{Folder, data, run};
use vision::commands::calibrate;
use vision::track::Mode;

/// The one line of an error, which has to hold some words.
fn line<T: std::fmt::Debug>(result: Result<T, vision::Error>, words: &[&str]) {
    let text = result.expect_err("an error").to_string();
    assert!(!text.contains('\n'), "{text}");
    for word in words {
        assert!(text.contains(word), "'{word}' in: {text}");
    }
}

fn scene(name: &str, frames: usize) -> Option<Folder> {
    Some(Folder::of_scene(name, &data("vision-rendered")?.join("easy"), frames))
}

#[test]
fn an_absent_rig_is_named() {
    let own = Folder::new("absent");
    line(calibrate(&own.0, Mode::Default), &["rig.toml", "cannot be read"]);
}

#[test]
fn a_rig_that_is_no_toml_names_the_line() {
    let Some(own) = scene("toml", 0) else { return };
    own.edit("rig.toml", |text| text.replace("fx = 1413.095", "fx = = 1413.095"));
    line(calibrate(&own.0, Mode::Default), &["rig.toml", "line 27"]);
}

#[test]
fn absurd_lenses_are_refused() {
    let Some(_) = data("vision-rendered") else { return };
    let edits = [
        ("fx = 1411.622", "fx = 14.1", "focal"),
        ("cx = 651.289", "cx = 6512.89", "principal point"),
        ("distortion = [-0.041502,", "distortion = [-9.0,", "distortion"),
        ("fx = 1411.622", "fx = nan", "focal"),
    ];
    for (was, is, word) in edits {
        let Some(own) = scene("lens", 0) else { return };
        own.edit("rig.toml", |text| text.replace(was, is));
        line(calibrate(&own.0, Mode::Default), &["rig.toml", "cam0", word]);
    }
}

#[test]
fn a_lens_that_no_marker_agrees_with_is_refused() {
    let Some(own) = scene("focal", 0) else { return };
    own.edit("rig.toml", |text| text.replace("fx = 1411.622\nfy = 1411.622", "fx = 700.0\nfy = 700.0"));
    let text = calibrate(&own.0, Mode::Default).expect_err("refused").to_string();
    assert!(text.contains("cam0") || text.contains("marks"), "{text}");
}

#[test]
fn a_marker_marked_twice_names_both_lines() {
    let Some(own) = scene("twice", 0) else { return };
    own.edit("markers.csv", |text| text.replace("m01,127.06,-126.91,215.86,cam0,", "m00,127.08,-127.03,279.3,cam0,"));
    line(calibrate(&own.0, Mode::Default), &["markers.csv", "line 3", "m00", "twice in cam0", "line 2"]);
}

#[test]
fn too_few_markers_name_the_camera() {
    let Some(own) = scene("few", 0) else { return };
    own.edit("markers.csv", |text| {
        text.lines().filter(|line| !line.contains("cam2") || line.starts_with("m00")).collect::<Vec<_>>().join("\n")
    });
    for mode in [Mode::Default, Mode::Paper] {
        line(calibrate(&own.0, mode), &["markers.csv", "cam2", "1 marker"]);
    }
}

#[test]
fn an_unknown_camera_and_a_cell_that_is_no_number_name_the_line() {
    let Some(own) = scene("cells", 0) else { return };
    own.edit("markers.csv", |text| text.replace("cam1,230.7", "cam9,230.7"));
    line(calibrate(&own.0, Mode::Default), &["line 18", "cam9", "cam0, cam1"]);
    own.edit("markers.csv", |text| text.replace("cam9,230.7", "cam1,2x0.7"));
    line(calibrate(&own.0, Mode::Default), &["line 18", "u_px", "2x0.7"]);
}

#[test]
fn a_board_that_is_not_there_or_not_found_is_named() {
    let Some(own) = scene("board", 0) else { return };
    own.repaint("chessboard/cam3.jpg", |image| image::RgbImage::from_pixel(image.width(), image.height(), image::Rgb([90; 3])));
    line(calibrate(&own.0, Mode::Default), &["chessboard/cam3.jpg", "8 x 6", "not found"]);
    std::fs::remove_file(own.0.join("chessboard/cam3.jpg")).expect("image");
    line(calibrate(&own.0, Mode::Default), &["chessboard", "cam3", "position_mm"]);
}

#[test]
fn images_of_another_size_are_named() {
    let Some(own) = scene("size", 2) else { return };
    own.repaint("frames/cam2/000001.jpg", |_| image::RgbImage::new(640, 360));
    line(run(&own.0, Mode::Default), &["frames/cam2/000001.jpg", "640 x 360", "1280 x 720"]);
}

#[test]
fn a_file_that_is_no_image_is_named() {
    let Some(own) = scene("noimage", 2) else { return };
    let path = own.0.join("frames/cam2/000001.jpg");
    std::fs::remove_file(&path).expect("image");
    std::fs::write(&path, "not an image").expect("file");
    line(run(&own.0, Mode::Default), &["frames/cam2/000001.jpg", "JPEG"]);
}

#[test]
fn a_recording_without_an_image_that_can_be_read_is_refused() {
    let Some(own) = scene("empty", 2) else { return };
    for camera in 0..4 {
        for frame in 0..2 {
            let path = own.0.join(format!("frames/cam{camera}/{frame:06}.jpg"));
            std::fs::remove_file(&path).expect("image");
            std::fs::write(&path, "").expect("file");
        }
    }
    line(run(&own.0, Mode::Default), &["frames", "no image", "can be used"]);
}

#[test]
fn an_image_that_was_cut_off_costs_its_camera_that_frame_alone() {
    let Some(own) = scene("cut", 3) else { return };
    let path = own.0.join("frames/cam2/000001.jpg");
    let whole = std::fs::read(&path).expect("image");
    for kept in [0, 20, whole.len() / 4, whole.len() / 2, whole.len() - 3] {
        std::fs::remove_file(&path).expect("image");
        std::fs::write(&path, &whole[..kept]).expect("file");
        let tracked = run(&own.0, Mode::Default).expect("tracked");
        assert!(tracked.rows.iter().all(|row| row.found.is_ok()), "{kept} bytes");
        let remarks: Vec<&String> = tracked.rows.iter().flat_map(|row| &row.remarks).collect();
        assert!(remarks.len() == 1 && remarks[0].contains("cam2/000001.jpg: "), "{remarks:?}");
        let cameras = |row: usize| tracked.rows[row].found.as_ref().expect("a pose").cameras;
        assert!(cameras(1) < cameras(0), "{:?} {:?}", cameras(1), cameras(0));
    }
}

#[test]
fn frames_out_of_order_name_the_line() {
    let Some(own) = scene("order", 3) else { return };
    own.edit("frames.csv", |text| text.replace("1,0.066667\n2,0.133333", "2,0.133333\n1,0.066667"));
    line(run(&own.0, Mode::Default), &["frames.csv", "line 4", "out of order"]);
}

#[test]
fn one_camera_with_images_is_too_few() {
    let Some(own) = scene("one", 2) else { return };
    for camera in 1..4 {
        std::fs::remove_dir_all(own.0.join(format!("frames/cam{camera}"))).expect("folder");
    }
    line(run(&own.0, Mode::Default), &["frames", "1 of 4 cameras"]);
}

#[test]
fn a_frame_with_one_image_is_lost() {
    let Some(own) = scene("single", 3) else { return };
    for camera in 1..4 {
        std::fs::remove_file(own.0.join(format!("frames/cam{camera}/000001.jpg"))).expect("image");
    }
    let tracked = run(&own.0, Mode::Default).expect("tracked");
    assert!(tracked.rows[0].found.is_ok() && tracked.rows[1].found.is_err() && tracked.rows[2].found.is_ok());
    assert_eq!(tracked.rows[1].remarks.len(), 3, "{:?}", tracked.rows[1].remarks);
}

#[test]
fn images_of_another_camera_lose_the_frame() {
    let Some(own) = scene("swapped", 3) else { return };
    // cam0 shows what cam2 saw: nothing consistent, and never a wrong pose.
    for frame in 0..3 {
        let path = own.0.join(format!("frames/cam0/{frame:06}.jpg"));
        std::fs::remove_file(&path).expect("image");
        std::os::unix::fs::symlink(own.0.join(format!("frames/cam2/{frame:06}.jpg")), &path).expect("link");
    }
    let found = common::accuracy(&own.0, Mode::Default);
    assert_eq!(found.wrong, 0, "{found:?}");
}

#[test]
fn cameras_of_another_rig_are_refused() {
    let Some(own) = scene("rig", 1) else { return };
    let file = own.0.join("cameras.toml");
    let cameras = calibrate(&own.0, Mode::Default).expect("cameras");
    std::fs::write(&file, vision::commands::cameras_text(&cameras)).expect("written");
    own.edit("rig.toml", |text| text.replace("name = \"cam3\"", "name = \"cam7\""));
    line(vision::commands::track(&file, &own.0, Mode::Default, &mut |_, _| {}), &["cameras.toml", "cam7"]);
}

#[test]
fn a_fixture_of_unknown_colours_is_refused() {
    let Some(own) = scene("colour", 1) else { return };
    own.edit("rig.toml", |text| text.replace("x_ball = \"green\"", "x_ball = \"greenish\""));
    line(run(&own.0, Mode::Default), &["rig.toml", "fixture", "greenish", "red, orange"]);
}
