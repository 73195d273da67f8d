//! The whole chain without hardware: simulate, render, calibrate, track, pair.
#![allow(missing_docs)]

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn ravenpose(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_ravenpose")).current_dir(folder).args(arguments).output().expect("ravenpose runs")
}

fn done(folder: &Path, arguments: &[&str]) -> String {
    let output = ravenpose(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn refused(folder: &Path, arguments: &[&str], words: &[&str]) {
    let output = ravenpose(folder, arguments);
    let line = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {line}");
    assert_eq!(line.trim_end().lines().count(), 1, "{line}");
    assert!(words.iter().all(|word| line.contains(word)), "{line}");
}

/// A folder of our own, gone at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("ravenpose-chain-{name}-{}", std::process::id()));
        drop(std::fs::remove_dir_all(&path));
        std::fs::create_dir_all(&path).expect("folder");
        Self(path)
    }

    fn text(&self, file: &str) -> String {
        std::fs::read_to_string(self.0.join(file)).expect(file)
    }

    fn json(&self, file: &str) -> Value {
        serde_json::from_str(&self.text(file)).expect(file)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        drop(std::fs::remove_dir_all(&self.0));
    }
}

/// Positions by frame, mm; lost frames are left out.
fn positions(text: &str) -> Vec<(String, [f64; 3])> {
    let row = |line: &str| -> Option<(String, [f64; 3])> {
        let cells: Vec<&str> = line.split(',').collect();
        let value = |k: usize| cells.get(k)?.parse().ok();
        Some((cells[0].to_owned(), [value(2)?, value(3)?, value(4)?]))
    };
    text.lines().skip(1).filter_map(row).collect()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("numbers").iter().map(|v| v.as_f64().expect("a number")).collect()
}

#[test]
fn a_simulated_recording_is_rendered_measured_and_paired() {
    let own = Folder::new("whole");
    std::fs::write(own.0.join("scene.toml"), "resolution = [640, 480]\nframes_per_s = 10.0\nclock_offset_s = 1.2\ntool = true\n")
        .expect("scene");
    done(&own.0, &["simulate", "--minutes", "0.17", "--seed", "4", "--out", "runs"]);
    // A folder without a name of its own cannot be put in place whole: told before the work, which would be lost.
    let here = own.0.join("here");
    std::fs::create_dir(&here).expect("folder");
    refused(&here, &["vision", "render", "../runs/run_0001.mcap", "--out", "."], &["has no name of its own"]);
    let render =
        ["vision", "render", "runs/run_0001.mcap", "--out", "seen", "--scene", "scene.toml", "--seed", "3", "--seconds", "8"];
    let words = done(&own.0, &render);
    assert!(words.contains("frames of 4 cameras"), "{words}");
    // What cannot be written is told before the work, and no input is replaced.
    for (out, words) in
        [("none/cameras.toml", "there is no folder none"), ("seen/rig.toml", "both input and output"), (".", "is a folder")]
    {
        refused(&own.0, &["vision", "calibrate", "seen", "--out", out], &[words]);
    }
    done(&own.0, &["vision", "calibrate", "seen", "--out", "cameras.toml"]);
    // Calibrated again, what belongs to the set-up stays.
    let registration =
        "\n[registration]\nrotation = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]\ntranslation_mm = [1.5, 2.5, 3.5]\n";
    std::fs::write(own.0.join("cameras.toml"), own.text("cameras.toml") + registration).expect("cameras");
    let words = done(&own.0, &["vision", "calibrate", "seen", "--out", "cameras.toml"]);
    assert!(words.contains("its [registration] is kept"), "{words}");
    assert_eq!(own.text("cameras.toml").matches("[registration]").count(), 1);
    assert!(own.text("cameras.toml").contains("translation_mm = [1.5, 2.5, 3.5]"), "{}", own.text("cameras.toml"));
    for (out, words) in [("none/truth.csv", "there is no folder none"), ("cameras.toml", "both input and output")] {
        refused(&own.0, &["vision", "track", "--cameras", "cameras.toml", "seen", "--out", out], &[words]);
    }
    // As `vision record` writes it: a second before the images are on the clock of the states, which simulated runs begin at 1.7e9 s.
    let frames = own.text("seen/frames.csv");
    std::fs::write(own.0.join("seen/frames.csv"), format!("# start_unix_s = soon\n{frames}")).expect("frames");
    let track = ["vision", "track", "--cameras", "cameras.toml", "seen", "--out", "truth.csv", "--overlay", "sheet"];
    refused(&own.0, &track, &["frames.csv", "line 1", "start_unix_s is 'soon'"]);
    std::fs::write(own.0.join("seen/frames.csv"), format!("# start_unix_s = 1700000000.25\n{frames}")).expect("frames");
    done(&own.0, &track);
    assert!(own.text("truth.csv").starts_with("# start_unix_s = 1700000000.250000\nframe,t_s,"));
    assert!(own.text("sheet/index.html").contains("<svg"));

    let (found, wanted) = (positions(&own.text("truth.csv")), positions(&own.text("seen/truth.csv")));
    assert!(found.len() * 20 >= wanted.len() * 19, "{} of {} frames", found.len(), wanted.len());
    let mut square = 0.0;
    for (frame, at) in &found {
        let (_, real) = wanted.iter().find(|(own, _)| own == frame).expect("a frame of the scene");
        let off2: f64 = (0..3).map(|k| (at[k] - real[k]).powi(2)).sum();
        assert!(off2.sqrt() < 2.0, "frame {frame} is wrong by {:.2} mm", off2.sqrt());
        square += off2;
    }
    let rms_mm = (square / found.len() as f64).sqrt();
    assert!(rms_mm < 0.4, "{rms_mm}");

    let words = done(&own.0, &["pair", "runs/run_0001.mcap", "--truth", "truth.csv", "--out", "pairs.csv"]);
    assert!(words.contains("is at 0.250 s of the states, by the start times"), "{words}");
    let (report, real) = (own.json("pairs.report.json"), own.json("seen/registration_true.json"));
    let offset_s = report["clock"]["clock"]["offset_s"].as_f64().expect("offset");
    assert!((offset_s - 1.2).abs() < 0.01, "{offset_s}");
    // The registration takes the middle of what was seen to where frame 0 has it: to the arm's own error and the cameras'.
    let matrix: Vec<Vec<f64>> = real["world_to_frame_0"]["rotation"].as_array().expect("rows").iter().map(numbers).collect();
    let shift_mm = numbers(&real["world_to_frame_0"]["translation_mm"]);
    let pairs = own.text("pairs.csv");
    let mut lines = pairs.lines().filter(|line| !line.starts_with('#'));
    let head: Vec<&str> = lines.next().expect("a head").split(',').collect();
    let at = |name: &str| head.iter().position(|own| *own == name).expect(name);
    let truth_times = own.text("truth.csv");
    let mut compared = 0;
    for line in lines {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().expect("a number")).collect();
        let Some(row) = truth_times.lines().skip(1).find(|row| {
            row.split(',').nth(1).and_then(|t| t.parse::<f64>().ok()).is_some_and(|t| (t - cells[at("truth_t_s")]).abs() < 1e-5)
        }) else {
            continue;
        };
        let world: Vec<f64> = row.split(',').skip(2).take(3).map(|cell| cell.parse().expect("a number")).collect();
        let off2: f64 = (0..3)
            .map(|k| {
                let expected = (0..3).map(|j| matrix[k][j] * world[j]).sum::<f64>() + shift_mm[k];
                (cells[at(["truth_x_mm", "truth_y_mm", "truth_z_mm"][k])] - expected).powi(2)
            })
            .sum();
        assert!(off2.sqrt() < 1.0, "registered {:.2} mm beside the true frame 0", off2.sqrt());
        compared += 1;
    }
    assert!(compared >= 30, "{compared} pairs");
}

#[test]
fn what_cannot_be_rendered_or_recorded_is_one_clear_line() {
    let own = Folder::new("refused");
    std::fs::write(own.0.join("run.csv"), "t_s,x_mm,y_mm,z_mm\n0,1,2,3\n0.1,1,2,3\n").expect("a run");
    refused(&own.0, &["vision", "render", "run.csv", "--out", "a"], &["run.csv", "truth_x_m", "ravenpose simulate"]);
    refused(&own.0, &["vision", "render", "run.csv", "--out", "a", "--scene", "none.toml"], &["none.toml", "cannot be read"]);
    std::fs::write(own.0.join("scene.toml"), "cameras = 4\nbrightnes = 1\n").expect("a scene");
    refused(
        &own.0,
        &["vision", "render", "run.csv", "--out", "a", "--scene", "scene.toml"],
        &["scene.toml", "line 2", "brightnes"],
    );
    refused(&own.0, &["vision", "record", "cam0=/dev/video77", "--rig", ".", "--out", "a"], &["rig.toml", "cannot be read"]);
    let camera = |name: &str| {
        format!(
            "[[camera]]\nname = \"{name}\"\nfx = 700\nfy = 700\ncx = 320\ncy = 240\nposition_mm = [0, 600, 0]\nlook_at_mm = [0, 0, 0]\n"
        )
    };
    std::fs::write(own.0.join("rig.toml"), format!("resolution = [640, 480]\n{}{}", camera("left"), camera("right")))
        .expect("a rig");
    refused(&own.0, &["vision", "record", "left=/dev/video77", "--rig", ".", "--out", "a"], &["/dev/video77", "no such device"]);
    refused(&own.0, &["vision", "record", "middle=x.avi", "--rig", ".", "--out", "a"], &["middle", "left, right"]);
    refused(&own.0, &["vision", "record", "x.avi", "--rig", ".", "--out", "a"], &["x.avi", "CAMERA=SOURCE"]);
    refused(&own.0, &["vision", "mark", "."], &["left", "no image", "--images"]);
    assert!(!own.0.join("a").exists());
}
