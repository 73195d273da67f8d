//! Independent readers and writers of bags and MCAP files (the Python packages rosbags, mcap, mcap-ros1-support) agree with
//! ours, number by number.
//!
//! `RAVENPOSE_PYTHON` names an interpreter that has the packages; `make test` makes one. Without it the tests say that they skip.

mod common;
#[path = "common/records.rs"]
mod records;

use std::ffi::OsString;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

use arm::Side;
use common::Scratch;
use ravenpose_wire::RavenState;
use recordings::mcap_file::{McapLog, McapSink, McapSource};
use recordings::ros::{RAVEN_STATE, STATE_BYTES, decode_state, encode_state};
use recordings::rosbag_file::{ChunkCompression, RosbagSink, RosbagSource};
use recordings::stream::{Record, Sink, Source, Truth};
use records::{all, drain, write_all};
use serde_json::{Value, json};

/// The interpreter, if it has the packages.
fn python() -> Option<OsString> {
    let python = std::env::var_os("RAVENPOSE_PYTHON");
    let has =
        |python: &OsString| Command::new(python).args(["-c", "import rosbags, mcap, mcap_ros1"]).stderr(Stdio::null()).status();
    let found = python.filter(|python| has(python).is_ok_and(|status| status.success()));
    if found.is_none() {
        println!("skipped: RAVENPOSE_PYTHON names no interpreter with rosbags, mcap and mcap-ros1-support (make test makes one)");
    }
    found
}

fn run(python: &OsString, arguments: &[&str], input: &str) -> String {
    let mut child = Command::new(python)
        .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/python/recordings.py"))
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("python");
    child.stdin.take().expect("stdin").write_all(input.as_bytes()).expect("written");
    let output = child.wait_with_output().expect("python ends");
    assert!(output.status.success(), "{arguments:?}\n{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

/// States with every kind of number, and truths.
fn records() -> Vec<Record> {
    let specials = [0.0, -0.0, 1.5, f32::NAN, f32::INFINITY, f32::MIN_POSITIVE, 1e-45, f32::MAX];
    let whole = [0, 1, -1, i32::MAX, i32::MIN];
    let mut records = Vec::new();
    for index in 0..40_u32 {
        let float = |place: usize| specials[(index as usize + place) % specials.len()];
        let int = |place: usize| whole[(index as usize + place) % whole.len()];
        let mut state = RavenState {
            source_id: u64::MAX,
            source_time_ns: i64::MIN,
            arms: 3,
            hdr_seq: index,
            hdr_stamp_sec: 1_700_000_000 + index,
            hdr_stamp_nsec: 999_999_999,
            runlevel: 3,
            dt_nsec: 1_000_000,
            type_: [49, 22],
            pos: std::array::from_fn(int),
            ori: std::array::from_fn(float),
            enc_vals: std::array::from_fn(int),
            jpos: std::array::from_fn(float),
            jac_f: std::array::from_fn(float),
            ..RavenState::new()
        };
        state.seal(u64::MAX - u64::from(index));
        let side = Side::ALL[index as usize % 2];
        let mut truth = Truth::unknown(1_700_000_000_999_999_999 + i64::from(index) * 1_000_000_000, side);
        truth.position_m = [f64::from(index), -0.0, f64::MIN_POSITIVE];
        truth.quaternion_wxyz = [1.0, 0.25, f64::NAN, -0.5];
        if index % 3 == 0 {
            truth.joints = std::array::from_fn(|joint| f64::from(index) / (joint as f64 + 7.0));
        }
        records.extend([Record::State(Box::new(state)), Record::Truth(truth)]);
    }
    records
}

fn singles(values: &[f32]) -> impl Iterator<Item = Value> {
    values.iter().map(|value| json!(format!("{:08x}", value.to_bits())))
}

fn doubles(values: &[f64]) -> impl Iterator<Item = Value> {
    values.iter().map(|value| json!(format!("{:016x}", value.to_bits())))
}

fn ints(values: &[i32]) -> impl Iterator<Item = Value> {
    values.iter().map(|value| json!(value))
}

fn state_numbers(state: &RavenState) -> Value {
    let header = [json!(state.hdr_seq), json!(state.hdr_stamp_sec), json!(state.hdr_stamp_nsec), json!("")];
    let mut numbers: Vec<Value> = header.into_iter().collect();
    numbers.extend(ints(&[state.runlevel, state.sublevel, state.last_seq]).chain(ints(&state.type_)).chain(ints(&state.pos)));
    numbers.extend(singles(&state.ori).chain(singles(&state.ori_d)));
    numbers.extend(
        ints(&state.pos_d).chain(ints(&[state.dt_sec, state.dt_nsec])).chain(ints(&state.enc_vals)).chain(ints(&state.dac_val)),
    );
    for field in [&state.tau, &state.mpos, &state.jpos, &state.mvel, &state.jvel, &state.mpos_d, &state.jpos_d] {
        numbers.extend(singles(field));
    }
    for field in [&state.grasp_d[..], &state.encoffsets, &state.jac_vel, &state.jac_f] {
        numbers.extend(singles(field));
    }
    Value::Array(numbers)
}

fn pose_numbers(truth: &Truth, index: usize) -> Value {
    let frame = format!("{}/frame_0", truth.side.name());
    let stamp = (truth.time_ns / 1_000_000_000, truth.time_ns % 1_000_000_000);
    let [w, x, y, z] = truth.quaternion_wxyz;
    let header = [json!(index), json!(stamp.0), json!(stamp.1), json!(frame)];
    Value::Array(header.into_iter().chain(doubles(&truth.position_m)).chain(doubles(&[x, y, z, w])).collect())
}

/// Do the lines of the script say what the records say?
fn compare(lines: &str, records: &[Record]) {
    let lines: Vec<Value> = lines.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    let of = |topic: &str| lines.iter().filter(|line| line[0] == topic).collect::<Vec<_>>();
    let states: Vec<_> =
        records.iter().filter_map(|record| if let Record::State(state) = record { Some(state) } else { None }).collect();
    let truths: Vec<_> =
        records.iter().filter_map(|record| if let Record::Truth(truth) = record { Some(truth) } else { None }).collect();
    let (found, origins) = (of("/ravenstate"), of("/ravenstate/origin"));
    assert_eq!((found.len(), origins.len()), (states.len(), states.len()));
    for ((found, origin), state) in found.iter().zip(&origins).zip(&states) {
        let time_ns = Record::State((*state).clone()).time_ns();
        assert_eq!(**found, json!(["/ravenstate", "raven_2/raven_state", time_ns, state_numbers(state)]));
        let expected = json!([
            state.hdr_seq,
            state.hdr_stamp_sec,
            state.hdr_stamp_nsec,
            "",
            state.source_id,
            state.sequence,
            state.source_time_ns,
            state.arms
        ]);
        assert_eq!(origin[3], expected);
    }
    let poses: Vec<_> = lines.iter().filter(|line| line[1] == "geometry_msgs/PoseStamped").collect();
    assert_eq!(poses.len(), truths.len());
    for (index, (found, truth)) in poses.iter().zip(&truths).enumerate() {
        assert_eq!(
            **found,
            json!([
                format!("/truth/{}/pose", truth.side.name()),
                "geometry_msgs/PoseStamped",
                truth.time_ns,
                pose_numbers(truth, index)
            ])
        );
    }
    let joints: Vec<_> = lines.iter().filter(|line| line[1] == "sensor_msgs/JointState").collect();
    let measured: Vec<_> = truths.iter().filter(|truth| !truth.joints[0].is_nan()).collect();
    assert_eq!(joints.len(), measured.len());
    for (found, truth) in joints.iter().zip(measured) {
        // Header, seven names, seven positions; neither speeds nor forces.
        let positions: Vec<Value> = doubles(&truth.joints).collect();
        assert_eq!(
            (found[3].as_array().expect("numbers").len(), &found[3].as_array().expect("numbers")[11..]),
            (18, &positions[..])
        );
    }
}

fn pairs() -> Vec<(String, String)> {
    vec![("robot".to_owned(), "raven2 α".to_owned())]
}

#[test]
fn rosbags_reads_every_number_of_our_bags() {
    let Some(python) = python() else { return };
    let scratch = Scratch::new("py-bag");
    for (name, compression) in [("none.bag", ChunkCompression::None), ("lz4.bag", ChunkCompression::Lz4)] {
        let path = scratch.path().join(name);
        let mut sink = Box::new(RosbagSink::create(&path, &pairs(), compression).expect("created"));
        write_all(sink.as_mut(), &records());
        sink.finish().expect("finished");
        let lines = run(&python, &["read", &path.to_string_lossy()], "");
        compare(&lines, &records());
        assert!(lines.contains("[\"robot\", \"raven2 \\u03b1\"]"));
    }
}

#[test]
fn the_mcap_package_reads_every_number_of_our_files() {
    let Some(python) = python() else { return };
    let scratch = Scratch::new("py-mcap");
    let path = scratch.path().join("run.mcap");
    let mut sink = Box::new(McapSink::create(&path, &pairs()).expect("created"));
    write_all(sink.as_mut(), &records());
    sink.finish().expect("finished");
    let lines = run(&python, &["read", &path.to_string_lossy()], "");
    let (metadata, messages) = lines.split_once('\n').expect("lines");
    assert_eq!(metadata, "[\"ravenpose\", \"robot\", \"raven2 \\u03b1\"]");
    compare(messages, &records());
}

#[test]
fn the_mcap_package_reads_a_log_that_has_no_end() {
    let Some(python) = python() else { return };
    let scratch = Scratch::new("py-log");
    let mut log = McapLog::create(&scratch.path().join("run.mcap"), &pairs()).expect("created");
    write_all(&mut log, &records());
    log.flush().expect("flushed");
    // As after a kill: what is in the file now, without the end that dropping the log would write.
    let path = scratch.file("killed.mcap", &std::fs::read(log.part()).expect("bytes"));
    compare(&run(&python, &["recover", &path.to_string_lossy()], ""), &records());
}

/// The state that the script writes.
fn scripted(index: u32) -> Vec<u8> {
    let mut bytes: Vec<u8> = [index, 1_700_000_000 + index, 500, 0].into_iter().flat_map(u32::to_le_bytes).collect();
    let mut put = |is_int: bool, count: u32, step: u32| {
        for place in 0..count {
            let int = (index * 1000 + step * 100 + place) as i32;
            let float = index as f32 + step as f32 / 4.0 + place as f32 / 64.0;
            bytes.extend(if is_int { int.to_le_bytes() } else { float.to_le_bytes() });
        }
    };
    for (is_int, step, count) in [
        (true, 1, 3),
        (true, 2, 2),
        (true, 3, 6),
        (false, 4, 18),
        (false, 5, 18),
        (true, 6, 6),
        (true, 7, 2),
        (true, 8, 16),
        (true, 9, 16),
    ] {
        put(is_int, count, step);
    }
    for step in 10..17 {
        put(false, 16, step);
    }
    for (step, count) in [(17, 2), (18, 16), (19, 12), (20, 12)] {
        put(false, count, step);
    }
    bytes
}

fn check_scripted(mut source: impl Source, path: &Path) {
    let (records, damage, error) = drain(&mut source);
    assert_eq!((damage, error), (None, None), "{}", path.display());
    assert_eq!(records.len(), 2_000);
    for (index, record) in records.iter().enumerate() {
        let Record::State(state) = record else { panic!("a state") };
        let mut bytes = Vec::new();
        encode_state(state, &mut bytes);
        assert!(bytes == scripted(index as u32), "{} state {index}", path.display());
        assert_eq!((bytes.len(), state.sequence, state.arms), (STATE_BYTES, index as u64 + 1, 3));
    }
    assert!(source.channels().iter().all(|channel| channel.is_read && channel.messages == 2_000));
}

#[test]
fn we_read_what_rosbags_and_the_mcap_package_write() {
    let Some(python) = python() else { return };
    assert_eq!(decode_state(&scripted(3)).expect("980 bytes").runlevel, 3_100);
    let scratch = Scratch::new("py-write");
    for how in ["none", "bz2", "lz4"] {
        let path = scratch.path().join(format!("{how}.bag"));
        let _ = run(&python, &["write", &path.to_string_lossy(), how, "2000"], RAVEN_STATE.definition);
        check_scripted(RosbagSource::open(&path).expect("opens"), &path);
    }
    for how in ["none", "zstd", "lz4", "unchunked"] {
        let path = scratch.path().join(format!("{how}.mcap"));
        let _ = run(&python, &["write", &path.to_string_lossy(), how, "2000"], RAVEN_STATE.definition);
        check_scripted(McapSource::open(&path).expect("opens"), &path);
    }
    // And what we read of theirs, they read of ours.
    let ours = scratch.path().join("ours.bag");
    let mut sink = Box::new(RosbagSink::create(&ours, &[], ChunkCompression::Lz4).expect("created"));
    let records = all(McapSource::open(&scratch.path().join("lz4.mcap")).expect("opens"));
    write_all(sink.as_mut(), &records);
    sink.finish().expect("finished");
    compare(&run(&python, &["read", &ours.to_string_lossy()], ""), &records);
}
