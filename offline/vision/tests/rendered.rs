//! The rendered scenes against their truth: what the project promises of them.

mod common;

use common::{Folder, accuracy, data, run};
use vision::track::Mode;

fn promised(scene: &str, rms_mm: f64, frames: usize) {
    let Some(folder) = data("vision-rendered") else { return };
    let found = accuracy(&folder.join(scene), Mode::Default);
    assert!(found.end_effector.rms_mm[3] <= rms_mm, "{found:?}");
    assert!(found.orientation_deg <= 0.4, "{found:?}");
    assert!(found.measured >= frames, "{found:?}");
    assert_eq!(found.wrong, 0, "{found:?}");
}

#[test]
fn steady_light_is_measured_in_every_frame() {
    promised("easy", 0.20, 14);
}

#[test]
fn a_tool_before_the_balls_is_seen_past() {
    promised("occlusion", 0.30, 9);
}

#[test]
fn side_light_blur_discs_and_lost_images_are_borne() {
    promised("hard", 0.50, 9);
}

#[test]
fn the_papers_way_is_worse_but_never_wrong() {
    let Some(folder) = data("vision-rendered") else { return };
    for scene in ["easy", "occlusion"] {
        let ours = accuracy(&folder.join(scene), Mode::Default);
        let paper = accuracy(&folder.join(scene), Mode::Paper);
        assert!(paper.end_effector.rms_mm[3] > ours.end_effector.rms_mm[3]);
        assert!(paper.end_effector.rms_mm[3] < 0.53, "{paper:?}");
        assert_eq!(paper.wrong, 0, "{paper:?}");
    }
}

#[test]
fn warm_dim_light_and_noise_change_little() {
    let Some(folder) = data("vision-rendered") else { return };
    let scene = Folder::of_scene("warm", &folder.join("hard"), 6);
    for camera in 0..4 {
        for frame in 0..6 {
            scene.repaint(&format!("frames/cam{camera}/{frame:06}.jpg"), |image| {
                let mut state = (camera * 10 + frame + 1) as u64;
                let mut noise = || {
                    state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                    ((state >> 40) % 13) as f64 - 6.0
                };
                let mut changed = image.clone();
                for pixel in changed.pixels_mut() {
                    for (value, gain) in pixel.0.iter_mut().zip([0.9, 0.55, 0.33]) {
                        *value = (f64::from(*value) * gain + noise()).clamp(0.0, 255.0) as u8;
                    }
                }
                changed
            });
        }
    }
    let found = accuracy(&scene.0, Mode::Default);
    assert!(found.end_effector.rms_mm[3] <= 0.50, "{found:?}");
    assert!(found.measured >= 5 && found.wrong == 0, "{found:?}");
}

#[test]
fn a_lost_camera_costs_accuracy_and_not_frames() {
    let Some(folder) = data("vision-rendered") else { return };
    let scene = Folder::of_scene("three", &folder.join("easy"), 5);
    std::fs::remove_dir_all(scene.0.join("frames/cam1")).expect("folder");
    let found = accuracy(&scene.0, Mode::Default);
    assert!(found.measured == 5 && found.wrong == 0 && found.end_effector.rms_mm[3] < 0.30, "{found:?}");
}

#[test]
fn frames_come_back_after_all_images_were_black() {
    let Some(folder) = data("vision-rendered") else { return };
    let scene = Folder::of_scene("gap", &folder.join("occlusion"), 7);
    for camera in 0..4 {
        for frame in 2..4 {
            scene.repaint(&format!("frames/cam{camera}/{frame:06}.jpg"), |image| {
                image::RgbImage::new(image.width(), image.height())
            });
        }
    }
    let tracked = run(&scene.0, Mode::Default).expect("a measured recording");
    let measured: Vec<bool> = tracked.rows.iter().map(|row| row.found.is_ok()).collect();
    assert_eq!(measured, [true, true, false, false, true, true, true]);
    let text = vision::commands::truth_text(&tracked);
    let lost = text.lines().nth(3).expect("a row");
    assert!(lost.starts_with("2,0.133333,,") && lost.ends_with(",lost"), "{lost}");
    assert!(text.lines().all(|line| line.split(',').count() == text.lines().next().expect("head").split(',').count()));
}

#[test]
fn the_same_images_give_the_same_answer() {
    let Some(folder) = data("vision-rendered") else { return };
    let scene = Folder::of_scene("again", &folder.join("hard"), 4);
    let text = || vision::commands::truth_text(&run(&scene.0, Mode::Default).expect("measured"));
    assert_eq!(text(), text());
}
