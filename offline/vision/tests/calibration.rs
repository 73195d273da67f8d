//! Cameras from boards and markers.

mod common;

use common::{Folder, data};
use vision::commands::{Calibrated, calibrate};
use vision::track::Mode;

fn centres_mm(calibrated: &Calibrated) -> Vec<[f64; 3]> {
    calibrated.cameras.iter().map(|known| std::array::from_fn(|k| known.camera.centre_m[k] * 1e3)).collect()
}

fn farthest_mm(a: &Calibrated, b: &Calibrated) -> f64 {
    let pairs = centres_mm(a).into_iter().zip(centres_mm(b));
    pairs.map(|(a, b)| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()).fold(0.0, f64::max)
}

#[test]
fn camera_centres_are_within_three_of_their_own_deviations() {
    let Some(folder) = data("vision-rendered") else { return };
    for scene in ["easy", "occlusion", "hard"] {
        let found = calibrate(&folder.join(scene), Mode::Default).expect("cameras");
        assert!(found.contradictions.is_empty(), "{:?}", found.contradictions);
        let text = std::fs::read_to_string(folder.join(scene).join("cameras_true.json")).expect("truth");
        let numbers: Vec<f64> =
            text.split(|c: char| !(c.is_ascii_digit() || "+-.eE".contains(c))).filter_map(|t| t.parse().ok()).collect();
        for (k, known) in found.cameras.iter().enumerate() {
            assert!(known.reprojection_rms_px < 0.9, "{scene} {known:?}");
            let deviation = known.centre_deviation_m.expect("deviations");
            for axis in 0..3 {
                let off_mm = known.camera.centre_m[axis] * 1e3 - numbers[19 * k + axis];
                assert!(off_mm.abs() < 3.0 * deviation[axis] * 1e3, "{scene} {} {off_mm} {deviation:?}", known.camera.name);
            }
        }
    }
}

#[test]
fn a_mismarked_point_is_named_and_left_out() {
    let Some(folder) = data("vision-rendered") else { return };
    let sound = calibrate(&folder.join("easy"), Mode::Default).expect("cameras");
    for wrong in ["455.0", "520.0"] {
        let scene = Folder::of_scene("mismark", &folder.join("easy"), 0);
        // Marker m07 of cam0 is at 946.1, 454.1.
        scene.edit("markers.csv", |text| text.replace("cam0,946.1,454.1", &format!("cam0,953.1,{wrong}")));
        let found = calibrate(&scene.0, Mode::Default).expect("cameras");
        let named: Vec<_> = found.contradictions.iter().map(|c| (c.marker.as_str(), c.camera.as_deref(), c.line)).collect();
        assert_eq!(named, [("m07", Some("cam0"), 9)]);
        assert!(farthest_mm(&found, &sound) < 0.6, "{}", farthest_mm(&found, &sound));
    }
}

#[test]
fn a_marker_that_stands_elsewhere_is_named_as_such() {
    let Some(folder) = data("vision-rendered") else { return };
    let scene = Folder::of_scene("elsewhere", &folder.join("easy"), 0);
    scene.edit("markers.csv", |text| text.replace("m05,126.97,126.87,215.82", "m05,131.97,126.87,215.82"));
    let found = calibrate(&scene.0, Mode::Default).expect("cameras");
    assert!(found.contradictions.iter().any(|c| c.marker == "m05" && c.camera.is_none()), "{:?}", found.contradictions);
    assert!(found.contradictions.iter().all(|c| c.marker == "m05"), "{:?}", found.contradictions);
}

#[test]
fn a_board_told_the_other_way_round_gives_the_same_cameras() {
    let Some(folder) = data("vision-rendered") else { return };
    let sound = calibrate(&folder.join("easy"), Mode::Default).expect("cameras");
    let scene = Folder::of_scene("turned", &folder.join("easy"), 0);
    // The far corner of cam0's board as origin, x and y reversed: the same board in the same place.
    let (o, r) = ([192.838, -223.662, 116.423], [[0.910_527, -0.195_707], [0.337_597, -0.156_600], [0.238_683, 0.968_078]]);
    let far: Vec<f64> = (0..3).map(|k| o[k] + 63.0 * r[k][0] + 45.0 * r[k][1]).collect();
    scene.edit("rig.toml", |text| {
        text.replace("[192.838, -223.662, 116.423]", &format!("[{}, {}, {}]", far[0], far[1], far[2])).replace(
            "[[0.910527, -0.195707, 0.364198], [0.337597, -0.156600, -0.928173], [0.238683, 0.968078, -0.076518]]",
            "[[-0.910527, 0.195707, 0.364198], [-0.337597, 0.156600, -0.928173], [-0.238683, -0.968078, -0.076518]]",
        )
    });
    let found = calibrate(&scene.0, Mode::Default).expect("cameras");
    assert!(farthest_mm(&found, &sound) < 0.01, "{}", farthest_mm(&found, &sound));
}

#[test]
fn approximate_places_do_without_boards() {
    let Some(folder) = data("vision-rendered") else { return };
    let sound = calibrate(&folder.join("easy"), Mode::Default).expect("cameras");
    let scene = Folder::of_scene("places", &folder.join("easy"), 0);
    std::fs::remove_dir_all(scene.0.join("chessboard")).expect("boards");
    scene.edit("rig.toml", |text| {
        let places = ["430.0, -430.0, 30.0", "430.0, 430.0, 30.0", "-430.0, 430.0, 30.0", "-430.0, -430.0, 30.0"];
        let mut camera = 0;
        let lines = text.lines().filter(|line| !line.starts_with("chessboard_rotation")).map(|line| {
            if line.starts_with("chessboard_origin_mm") {
                camera += 1;
                format!("position_mm = [{}]\nlook_at_mm = [0.0, 0.0, 240.0]", places[camera - 1])
            } else {
                line.to_owned()
            }
        });
        lines.collect::<Vec<_>>().join("\n")
    });
    let found = calibrate(&scene.0, Mode::Default).expect("cameras");
    assert!(farthest_mm(&found, &sound) < 1.5, "{}", farthest_mm(&found, &sound));
    let paper = calibrate(&scene.0, Mode::Paper).expect("cameras");
    assert!(farthest_mm(&paper, &sound) < 2.0, "{}", farthest_mm(&paper, &sound));
}

#[test]
fn cameras_toml_reads_back_as_written() {
    let Some(folder) = data("vision-rendered") else { return };
    let found = calibrate(&folder.join("hard"), Mode::Default).expect("cameras");
    let own = Folder::new("file");
    let file = own.0.join("cameras.toml");
    std::fs::write(&file, vision::commands::cameras_text(&found)).expect("written");
    let rig = vision::rig::read(&folder.join("hard")).expect("rig");
    let back = vision::cameras_file::read(&file, &rig).expect("read");
    for (a, b) in found.cameras.iter().zip(&back) {
        assert!((a.camera.centre_m - b.camera.centre_m).norm() < 1e-12);
        assert!((a.camera.rotation.matrix() - b.camera.rotation.matrix()).norm() < 1e-9);
        assert_eq!(a.camera.intrinsics, b.camera.intrinsics);
    }
}

#[test]
fn a_dim_noisy_board_is_found() {
    let Some(folder) = data("vision-rendered") else { return };
    let sound = calibrate(&folder.join("hard"), Mode::Default).expect("cameras");
    let scene = Folder::of_scene("dim", &folder.join("hard"), 0);
    for camera in 0..4 {
        scene.repaint(&format!("chessboard/cam{camera}.jpg"), |image| {
            let mut state = 7_u64;
            let mut changed = image.clone();
            for pixel in changed.pixels_mut() {
                for value in &mut pixel.0 {
                    state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                    let noise = ((state >> 40) % 17) as f64 - 8.0;
                    *value = (f64::from(*value) * 0.3 + 20.0 + noise).clamp(0.0, 255.0) as u8;
                }
            }
            changed
        });
    }
    let found = calibrate(&scene.0, Mode::Default).expect("cameras");
    assert!(farthest_mm(&found, &sound) < 0.5, "{}", farthest_mm(&found, &sound));
}
