//! `gap --watch` beside a publisher of states.

use crate::common::{Folder, errors, text, with_effect};
use ravenpose_transport::{Settings, Writer};
use ravenpose_wire::RavenState;
use recordings::mcap_file::McapSource;
use recordings::stream::{Record, Source};
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

fn settings(folder: &Folder, name: &str) -> Settings {
    let root = format!("{}/", text(&folder.file("iceoryx2")));
    Settings { prefix: format!("rpgap{name}{}_", std::process::id()), root }
}

/// The command beside a publisher of the states of a recording, four times as fast as they came.
fn watched(settings: &Settings, arguments: &[&str], recording: Option<&Path>) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_ravenpose"));
    command.args(arguments).stdout(Stdio::piped()).stderr(Stdio::piped());
    command.env("RAVENPOSE_PREFIX", &settings.prefix).env("RAVENPOSE_ROOT", &settings.root);
    let link = Writer::<RavenState>::open(settings).expect("states");
    let child = command.spawn().expect("ravenpose runs");
    if let Some(recording) = recording {
        // A subscriber hears what is sent once it is there.
        std::thread::sleep(Duration::from_secs(1));
        let mut source = McapSource::open(recording).expect("MCAP");
        let (begun, mut sequence) = (Instant::now(), 0);
        while let Some(record) = source.next().expect("record") {
            let Record::State(mut state) = record else { continue };
            sequence += 1;
            state.source_id = 5;
            state.seal(sequence);
            link.send(&state).expect("sent");
            let due = begun + Duration::from_micros(250 * sequence);
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
        }
    }
    let output = child.wait_with_output().expect("output");
    drop(link);
    for entry in std::fs::read_dir("/dev/shm").into_iter().flatten().flatten() {
        if entry.file_name().to_string_lossy().starts_with(&settings.prefix) {
            let _ = std::fs::remove_file(entry.path());
        }
    }
    output
}

#[test]
fn a_running_robot_that_carries_a_weight_is_told_from_its_stream() {
    let folder = Folder::new("live");
    let robot = folder.write("heavy.toml", with_effect("physics = \"payload\"\nparameters = { m_p = 0.3, c_z = -0.45 }"));
    let (run, out) = (folder.run("0.4", Some(&robot), &[]), folder.file("out"));
    let arguments = ["gap", "--watch", "--seconds", "9", "--out", text(&out)];
    let output = watched(&settings(&folder, "live"), &arguments, Some(&run));
    let words = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(output.status.code(), Some(1), "{words}{}", errors(&output));
    assert!(words.contains("0 to 15 s: ") && words.contains("carries"), "{words}");
    let report = std::fs::read_to_string(out.join("report.json")).expect("a report");
    assert!(report.contains("\"payload\""), "{report}");
}

#[test]
fn a_stream_without_states_is_told_and_leaves_nothing() {
    let folder = Folder::new("silent");
    let out = folder.file("out");
    let arguments = ["gap", "--watch", "--seconds", "6", "--out", text(&out)];
    let output = watched(&settings(&folder, "silent"), &arguments, None);
    assert_eq!(output.status.code(), Some(2));
    let words = errors(&output);
    assert!(words.contains("no states are heard") && words.contains("no look was possible"), "{words}");
    assert!(!out.exists());
}
