//! The official Python iceoryx2 package as an independent client: subscribes to `raven/pose` and reads every field right.
//!
//! `RAVENPOSE_PYTHON` names an interpreter that has the package; `make test` makes one. Without it the test says that it skips.

mod common;
#[path = "common/service.rs"]
mod service;
#[path = "common/stalls.rs"]
mod stalls;

use ravenpose_transport::Reader;
use ravenpose_wire::{ArmPose, CorrectedPose};
use serde_json::{Value, json};
use service::{CONFIG, World, publish_forever, role};
use stalls::despite_stops;
use std::collections::HashMap;
use std::process::Stdio;

fn number(value: f64) -> Value {
    if value.is_nan() { Value::Null } else { json!(format!("{:016x}", value.to_bits())) }
}

fn arm(pose: &ArmPose) -> Value {
    let vector = |values: [f64; 3]| Value::Array(values.into_iter().map(number).collect());
    let matrix = |values: [f32; 9]| values.map(|value| number(f64::from(value)));
    json!({
        "status": pose.status, "flags": pose.flags, "model_id": pose.model_id, "reset_count": pose.reset_count,
        "domain_score": number(f64::from(pose.domain_score)), "raw_position_um": vector(pose.raw_position_um),
        "correction_um": vector(pose.correction_um), "corrected_position_um": vector(pose.corrected_position_um),
        "bound95_um": vector(pose.bound95_um), "orientation": matrix(pose.orientation), "hold_cycles": pose.hold_cycles,
        "orientation_model_id": pose.orientation_model_id, "rotation_deg": vector(pose.rotation_deg),
        "rotation_bound95_deg": vector(pose.rotation_bound95_deg), "corrected_orientation": matrix(pose.corrected_orientation),
        "reserved": pose.reserved,
    })
}

fn expected(pose: &CorrectedPose) -> Value {
    json!({
        "version": pose.version, "size": pose.size, "guard_head": pose.guard_head, "sequence": pose.sequence, "source_id": pose.source_id,
        "source_sequence": pose.source_sequence, "source_time_ns": pose.source_time_ns, "start_time_ns": pose.start_time_ns,
        "publish_time_ns": pose.publish_time_ns, "arms": pose.arms, "runlevel": pose.runlevel, "cycles": pose.cycles, "lost": pose.lost,
        "skipped": pose.skipped, "duplicates": pose.duplicates, "out_of_order": pose.out_of_order, "refused": pose.refused,
        "late": pose.late, "overruns": pose.overruns, "arm": pose.arm.iter().map(arm).collect::<Vec<_>>(), "guard_tail": pose.guard_tail,
    })
}

#[test]
fn the_official_python_package_reads_every_field() {
    if role().as_deref() == Some("publisher") {
        publish_forever();
    }
    let Some(python) = std::env::var_os("RAVENPOSE_PYTHON") else {
        println!("skipped: RAVENPOSE_PYTHON names no interpreter with iceoryx2 0.9.3 (make test makes one)");
        return;
    };
    despite_stops(|| {
        let world = World::new("python");
        let config = world.config(CONFIG);
        let _service = world.start(&config, &[]);
        let reader: Reader<CorrectedPose> = world.poses();
        let _publisher = world.role("the_official_python_package_reads_every_field", "publisher");
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python/read_pose.py");
        let client = world
            .command(&python.to_string_lossy())
            .args([script, "1500", &world.settings.prefix, &world.settings.root, "exact"])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("python");
        // Read beside it; the client's end is seen through its output.
        let waiting = std::thread::spawn(move || client.wait_with_output().expect("python ends"));
        let mut seen = HashMap::new();
        while !waiting.is_finished() {
            while let Some(pose) = reader.next().expect("pose") {
                seen.insert(pose.sequence, expected(&pose));
            }
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        let output = waiting.join().expect("joined");
        let text = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success(), "{text}{}", String::from_utf8_lossy(&output.stderr));
        let mut compared = 0;
        let mut corrected = 0;
        for line in text.lines().filter(|line| line.starts_with('{')) {
            let read: Value = serde_json::from_str(line).expect("JSON");
            let sequence = read["sequence"].as_u64().expect("sequence");
            if let Some(expected) = seen.get(&sequence) {
                assert_eq!(&read, expected, "pose {sequence}");
                compared += 1;
                corrected += u64::from(read["arm"][0]["correction_um"][0] != number(0.0));
            }
        }
        println!("{compared} poses compared field by field, {corrected} of them with a correction");
        assert!(compared > 250 && corrected > 100);
    });
}
