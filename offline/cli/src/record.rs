//! `ravenpose record`: the running service's states and poses, and webcams' images, into an MCAP file, on one clock.
//!
//! A listening thread (real-time where the rights allow it) empties the two links every millisecond and stamps what comes
//! with the wall clock as it was at the start plus the monotonic time since; a writing thread compresses and writes. What is
//! written stands as `NAME.part` until the end: a kill leaves all but the last second there.

use crate::clock::Clock;
use crate::webcams::{self, Image, Webcams};
use crossbeam_queue::ArrayQueue;
use ravenpose::{realtime, signals};
use ravenpose_transport::{DEPTH_MAX, Reader, Settings};
use ravenpose_wire::{ArmPose, CorrectedPose, RavenState};
use recordings::mcap_file::{LogChannel, McapLog};
use recordings::ros::{COMPRESSED_IMAGE, CompressedImage, Header, MessageType, camera_topic};
use recordings::stream::{Record, Sink};
use std::path::Path;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

/// Messages of each stream that may wait for the disk: eight seconds.
const WAITING_MAX: usize = 8192;
/// The writing thread looks that often.
const PAUSE: Duration = Duration::from_millis(5);
/// Below RAVEN's controller (90) and the service (80).
const PRIORITY: i32 = 20;
/// Messages lost before the recorder heard them.
const LOST: u8 = 1;

/// `CorrectedPose.v1` as a ROS 1 message; the MD5 follows from the text by ROS's rule.
const POSE: MessageType = MessageType {
    name: "ravenpose/CorrectedPose",
    md5: "e5cd4e91a993e13e988ee7b776cd1d44",
    definition: "uint64 sequence\nuint64 source_id\nuint64 source_sequence\nint64 source_time_ns\nint64 start_time_ns\n\
int64 publish_time_ns\nuint32 arms\nint32 runlevel\nuint64 cycles\nuint64 lost\nuint64 skipped\nuint64 duplicates\n\
uint64 out_of_order\nuint64 refused\nuint64 late\nuint64 overruns\nravenpose/ArmPose gold\nravenpose/ArmPose green\n\
================================================================================\nMSG: ravenpose/ArmPose\n\
uint32 status\nuint32 flags\nuint64 model_id\nuint32 reset_count\nfloat32 domain_score\nfloat64[3] raw_position_um\n\
float64[3] correction_um\nfloat64[3] corrected_position_um\nfloat64[3] bound95_um\nfloat32[9] orientation\nuint32 hold_cycles\n\
uint64 orientation_model_id\nfloat64[3] rotation_deg\nfloat64[3] rotation_bound95_deg\nfloat32[9] corrected_orientation\n",
};

/// What the listening thread hands over, with times in ns since 1970. Without locks or allocation: an ordinary thread that holds a lock
/// on a busy machine would make the listener wait for longer than the link keeps messages.
struct Heard {
    states: ArrayQueue<(u64, RavenState)>,
    poses: ArrayQueue<(u64, CorrectedPose)>,
    /// Nothing more will come.
    ended: AtomicBool,
}

/// What was heard and what was missed.
#[derive(Default)]
struct Tally {
    states: u64,
    poses: u64,
    lost_states: u64,
    lost_poses: u64,
    last_state: Option<(u64, u64)>,
    last_pose: Option<u64>,
}

impl Tally {
    fn state(&mut self, state: &RavenState) {
        if let Some((source, sequence)) = self.last_state
            && source == state.source_id
        {
            self.lost_states += state.sequence.saturating_sub(sequence + 1);
        }
        self.last_state = Some((state.source_id, state.sequence));
        self.states += 1;
    }

    /// A restarted service goes on from a much higher number: a step of over a minute is no loss of ours.
    fn pose(&mut self, pose: &CorrectedPose) {
        if let Some(sequence) = self.last_pose {
            let missed = pose.sequence.saturating_sub(sequence + 1);
            self.lost_poses += if missed < 60_000 { missed } else { 0 };
        }
        self.last_pose = Some(pose.sequence);
        self.poses += 1;
    }
}

pub(crate) fn run(out: &Path, seconds: Option<f64>, cameras: &webcams::Wish) -> Result<ExitCode, String> {
    if seconds.is_some_and(|seconds| !(seconds > 0.0 && seconds < 1e9)) {
        return Err("--seconds: must be a number above 0".to_owned());
    }
    if out.exists() {
        return Err(format!("{}: is there already; choose another --out or remove it", out.display()));
    }
    signals::block().map_err(|error| format!("signals cannot be blocked: {error}"))?;
    let clock = Clock::start();
    if !out.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("mcap")) {
        return Err(format!("{}: MCAP is recorded; name the output .mcap, and convert it afterwards", out.display()));
    }
    // What cannot be opened is refused before there is a file.
    drop(Reader::<RavenState>::open(&Settings::from_env(), DEPTH_MAX).map_err(|error| error.to_string())?);
    let (webcams, arrived) = Webcams::open(cameras, clock)?;
    let metadata = [("recorder", "ravenpose record"), ("clock", "wall clock at the start plus CLOCK_MONOTONIC since")];
    let metadata = metadata.map(|(key, value)| (key.to_owned(), value.to_owned()));
    let mut log = McapLog::create(out, &metadata).map_err(|error| error.to_string())?;
    let poses = log.add_channel("/ravenpose/pose", &POSE).map_err(|error| error.to_string())?;
    let mut channels = Vec::new();
    for webcam in &webcams.all {
        let channel = log.add_channel(&camera_topic(&webcam.name), &COMPRESSED_IMAGE).map_err(|error| error.to_string())?;
        channels.push((webcam.name.clone(), channel));
    }
    let heard = Heard { states: ArrayQueue::new(WAITING_MAX), poses: ArrayQueue::new(WAITING_MAX), ended: AtomicBool::new(false) };
    let stop = AtomicBool::new(false);
    say!("recording to {}; Ctrl-C ends it", log.part().display());
    let begun = Instant::now();
    let (tally, written, cameras) = std::thread::scope(|scope| {
        let (heard, stop, channels) = (&heard, &stop, &channels);
        let listening = scope.spawn(move || listen(heard, clock, stop));
        let writing = scope.spawn(move || write(log, (poses, channels), heard, &arrived));
        webcams.begin();
        while seconds.is_none_or(|seconds| begun.elapsed().as_secs_f64() < seconds)
            && !listening.is_finished()
            && !writing.is_finished()
        {
            if signals::wait(Duration::from_millis(50)) {
                break;
            }
        }
        let cameras = webcams.stop();
        stop.store(true, Ordering::Relaxed);
        let tally = listening.join();
        heard.ended.store(true, Ordering::Release);
        (tally, writing.join(), cameras)
    });
    let (Ok(tally), Ok(written)) = (tally, written) else { return Err("a thread of the recorder failed".to_owned()) };
    written?;
    let tally = tally?;
    say!(
        "{}: {} states, {} poses in {:.1} s; missed by the recorder: {} states, {} poses",
        out.display(),
        tally.states,
        tally.poses,
        begun.elapsed().as_secs_f64(),
        tally.lost_states,
        tally.lost_poses
    );
    let mut whole = tally.lost_states + tally.lost_poses == 0;
    for (name, camera) in cameras {
        let fault = camera.fault.as_ref().map_or_else(String::new, |fault| format!("; ended early: {fault}"));
        let gap_ms = camera.longest_gap_ns / 1_000_000;
        say!("  {name}: {} images, {} missed, {gap_ms} ms at most without one{fault}", camera.images, camera.missed);
        whole &= camera.missed == 0 && camera.fault.is_none();
    }
    if tally.states + tally.poses == 0 {
        complain!(
            "ravenpose: {}: no state and no pose was heard; do service and controller run, as this user, with this RAVENPOSE_PREFIX and RAVENPOSE_ROOT?",
            out.display()
        );
        whole = false;
    }
    Ok(if whole { ExitCode::SUCCESS } else { ExitCode::from(LOST) })
}

fn listen(heard: &Heard, clock: Clock, stop: &AtomicBool) -> Result<Tally, String> {
    // Without the right it listens all the same; the 256 ms that a link keeps are usually enough.
    if let Err(missing) = realtime::set_fifo(PRIORITY) {
        say!("note: no real-time priority for the recorder ({missing}); messages may be missed on a busy machine");
    }
    let settings = Settings::from_env();
    let states = Reader::<RavenState>::open(&settings, DEPTH_MAX).map_err(|error| error.to_string())?;
    let poses = Reader::<CorrectedPose>::open(&settings, DEPTH_MAX).map_err(|error| error.to_string())?;
    let mut tally = Tally::default();
    let mut full = false;
    while !stop.load(Ordering::Relaxed) {
        let taken = states.drain(|state| {
            if state.admit().is_ok() {
                tally.state(state);
                full |= heard.states.push((clock.stamp(state.source_time_ns), *state)).is_err();
            }
        });
        taken.map_err(|error| error.to_string())?;
        let taken = poses.drain(|pose| {
            if pose.admit().is_ok() {
                tally.pose(pose);
                full |= heard.poses.push((clock.stamp(pose.publish_time_ns), *pose)).is_err();
            }
        });
        taken.map_err(|error| error.to_string())?;
        if full {
            return Err("the disk is too slow: over eight seconds of messages waited; record to a faster disk".to_owned());
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    Ok(tally)
}

fn write(
    mut log: McapLog,
    (poses, cameras): (LogChannel, &[(String, LogChannel)]),
    heard: &Heard,
    arrived: &Receiver<Image>,
) -> Result<(), String> {
    let mut bytes = Vec::new();
    let failed = |error: recordings::stream::StreamError| error.to_string();
    loop {
        // Asked first: what came before the end is then found below.
        let ended = heard.ended.load(Ordering::Acquire);
        while let Some((time_ns, state)) = heard.states.pop() {
            log.write_at(&Record::State(Box::new(state)), time_ns).map_err(failed)?;
        }
        while let Some((time_ns, pose)) = heard.poses.pop() {
            encode(&pose, &mut bytes);
            log.write_message(poses, time_ns, pose.sequence as u32, &bytes).map_err(failed)?;
        }
        // A camera that hangs may hold on to its end of the channel for ever.
        for Image { camera, time_ns, number, jpeg } in arrived.try_iter() {
            let Some((name, channel)) = cameras.get(camera) else { continue };
            bytes.clear();
            CompressedImage { header: Header::at(number, time_ns), data: jpeg }.encode(name, &mut bytes);
            log.write_message(*channel, time_ns, number, &bytes).map_err(failed)?;
        }
        if ended {
            return Box::new(log).finish().map_err(failed);
        }
        log.tick().map_err(failed)?;
        std::thread::sleep(PAUSE);
    }
}

/// The fields of [`POSE`] in order, little-endian, as ROS 1 serialises them.
fn encode(pose: &CorrectedPose, out: &mut Vec<u8>) {
    out.clear();
    for value in [pose.sequence, pose.source_id, pose.source_sequence] {
        out.extend(value.to_le_bytes());
    }
    for value in [pose.source_time_ns, pose.start_time_ns, pose.publish_time_ns] {
        out.extend(value.to_le_bytes());
    }
    out.extend(pose.arms.to_le_bytes());
    out.extend(pose.runlevel.to_le_bytes());
    for value in [pose.cycles, pose.lost, pose.skipped, pose.duplicates, pose.out_of_order, pose.refused, pose.late, pose.overruns]
    {
        out.extend(value.to_le_bytes());
    }
    for arm in &pose.arm {
        encode_arm(arm, out);
    }
}

fn encode_arm(arm: &ArmPose, out: &mut Vec<u8>) {
    out.extend(arm.status.to_le_bytes());
    out.extend(arm.flags.to_le_bytes());
    out.extend(arm.model_id.to_le_bytes());
    out.extend(arm.reset_count.to_le_bytes());
    out.extend(arm.domain_score.to_le_bytes());
    for vector in [arm.raw_position_um, arm.correction_um, arm.corrected_position_um, arm.bound95_um] {
        out.extend(vector.iter().flat_map(|value| value.to_le_bytes()));
    }
    out.extend(arm.orientation.iter().flat_map(|value| value.to_le_bytes()));
    out.extend(arm.hold_cycles.to_le_bytes());
    out.extend(arm.orientation_model_id.to_le_bytes());
    for vector in [arm.rotation_deg, arm.rotation_bound95_deg] {
        out.extend(vector.iter().flat_map(|value| value.to_le_bytes()));
    }
    out.extend(arm.corrected_orientation.iter().flat_map(|value| value.to_le_bytes()));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_has_as_many_bytes_as_its_definition_says() {
        let size = |kind: &str| match kind {
            "uint64" | "int64" => 8,
            "uint32" | "int32" | "float32" => 4,
            "float64[3]" => 24,
            "float32[9]" => 36,
            other => panic!("{other}"),
        };
        let (pose, arm) = POSE.definition.split_once("====").expect("two parts");
        let fields = |text: &str| -> usize {
            text.lines()
                .filter(|line| !line.contains("ravenpose/") && !line.contains('='))
                .map(|line| size(line.split(' ').next().expect("kind")))
                .sum()
        };
        let mut bytes = Vec::new();
        encode(&CorrectedPose::new(), &mut bytes);
        assert_eq!(bytes.len(), fields(pose) + 2 * fields(arm));
    }

    #[test]
    fn gaps_are_counted_per_publisher() {
        let mut tally = Tally::default();
        let mut state = RavenState::new();
        for (source, sequence) in [(1, 1), (1, 2), (1, 5), (2, 1), (2, 2)] {
            state.source_id = source;
            state.seal(sequence);
            tally.state(&state);
        }
        assert_eq!((tally.states, tally.lost_states), (5, 2));
    }
}
