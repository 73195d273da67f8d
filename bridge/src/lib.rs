//! The C interface: publish `raven_state`, read the corrected pose. `include/ravenpose.h` is generated from this file.
//!
//! The publisher lives inside the robot's control process. After `open`, `loan`, `send`, `publish`, `take` and `next` allocate nothing,
//! lock nothing and make no system call, but for the one call in which a new peer appears and, while a service with `wait = "event"`
//! listens, one call per state to wake it; none of them ever blocks or panics. A
//! handle may be used by any thread, but by one at a time.
//!
//! This crate contains `unsafe`: every function takes pointers from C. They may be null (an error code); otherwise they must be what
//! their description says.

#![allow(clippy::missing_safety_doc, reason = "the one rule for all pointers stands above and in the header")]

mod error;
mod handle;

pub use error::Code;
pub use handle::{PoseReader, Publisher};

use handle::guarded;
use ravenpose_transport::Settings;
use ravenpose_wire::{AHEAD_MAX_NS, ARMS, ArmPose, ArmStatus, CorrectedPose, RavenState};
use std::ffi::{CStr, c_char};

/// Version of this interface. `ravenpose_*_open` refuses a caller that was compiled against another one.
pub const RAVENPOSE_ABI_VERSION: u32 = 1;
/// Age beyond which a pose must not be used, ns (the consumer rule).
pub const RAVENPOSE_POSE_AGE_MAX_NS: i64 = 5_000_000;

/// What `open` wants to know. Initialise it with `RAVENPOSE_OPTIONS_INIT`; zero or null means the default.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Options {
    /// `RAVENPOSE_ABI_VERSION` as the caller was compiled with.
    pub abi_version: u32,
    /// `sizeof(ravenpose_state)` as the caller was compiled with.
    pub state_size: u32,
    /// `sizeof(ravenpose_pose)` as the caller was compiled with.
    pub pose_size: u32,
    /// Readers: messages kept while nobody takes them, 1 to 256 (0: 1, the newest only).
    pub queue_depth: u32,
    /// Zero.
    pub reserved: [u32; 2],
    /// Prefix of the shared files (null: `RAVENPOSE_PREFIX`, else `iox2_`).
    pub prefix: *const c_char,
    /// Root of the shared files (null: `RAVENPOSE_ROOT`, else `/tmp/iceoryx2/`).
    pub root: *const c_char,
}

impl Default for Options {
    /// As `RAVENPOSE_OPTIONS_INIT` has it.
    fn default() -> Self {
        Self {
            abi_version: RAVENPOSE_ABI_VERSION,
            state_size: size_of::<RavenState>() as u32,
            pose_size: size_of::<CorrectedPose>() as u32,
            queue_depth: 0,
            reserved: [0; 2],
            prefix: std::ptr::null(),
            root: std::ptr::null(),
        }
    }
}

fn settings(options: &Options) -> Result<Settings, Code> {
    if options.state_size as usize != size_of::<RavenState>() || options.pose_size as usize != size_of::<CorrectedPose>() {
        return Err(Code::Version);
    }
    let mut settings = Settings::from_env();
    for (from, to) in [(options.prefix, &mut settings.prefix), (options.root, &mut settings.root)] {
        if !from.is_null() {
            // SAFETY: the caller gives a NUL-terminated string or null.
            let text = unsafe { CStr::from_ptr(from) };
            text.to_str().map_err(|_| Code::Argument)?.clone_into(to);
        }
    }
    Ok(settings)
}

/// Copies a one-line message to the caller's buffer, cut to its size.
unsafe fn tell(message: &str, to: *mut c_char, size: usize) {
    if to.is_null() || size == 0 {
        return;
    }
    let length = message.len().min(size - 1);
    // SAFETY: the caller gives a buffer of `size` bytes.
    unsafe {
        std::ptr::copy_nonoverlapping(message.as_ptr().cast(), to, length);
        *to.add(length) = 0;
    }
}

unsafe fn open<T>(
    options: *const Options,
    out: *mut *mut T,
    message: *mut c_char,
    message_size: usize,
    make: impl FnOnce(&Settings, &Options) -> Result<T, (Code, String)>,
) -> i32 {
    if options.is_null() || out.is_null() {
        return Code::Null as i32;
    }
    // SAFETY: both were checked for null; the caller gives valid pointers otherwise. Only the first field is read before the version
    // is known to be ours: options of another version may be shorter.
    let abi_version = unsafe {
        *out = std::ptr::null_mut();
        (&raw const (*options).abi_version).read()
    };
    if abi_version != RAVENPOSE_ABI_VERSION {
        let text = format!(
            "version mismatch: the program was compiled for ABI {abi_version}, this library has ABI {RAVENPOSE_ABI_VERSION}; compile it again"
        );
        // SAFETY: the caller's buffer.
        unsafe { tell(&text, message, message_size) };
        return Code::Version as i32;
    }
    // SAFETY: options of our own version.
    let options = unsafe { *options };
    let made = guarded(|| match settings(&options) {
        Ok(settings) => make(&settings, &options),
        Err(Code::Version) => Err((Code::Version, version_text(&options))),
        Err(code) => Err((code, code.text().to_owned())),
    });
    match made {
        Ok(Ok(handle)) => {
            // SAFETY: checked above.
            unsafe { *out = Box::into_raw(Box::new(handle)) };
            Code::Ok as i32
        }
        Ok(Err((code, text))) => {
            // SAFETY: the caller's buffer.
            unsafe { tell(&text, message, message_size) };
            code as i32
        }
        Err(code) => {
            // SAFETY: the caller's buffer.
            unsafe { tell(code.text(), message, message_size) };
            code as i32
        }
    }
}

fn version_text(options: &Options) -> String {
    format!(
        "version mismatch: the program was compiled for ABI {} (state {} bytes, pose {} bytes), this library has ABI {} ({}, {}); compile it again",
        options.abi_version,
        options.state_size,
        options.pose_size,
        RAVENPOSE_ABI_VERSION,
        size_of::<RavenState>(),
        size_of::<CorrectedPose>()
    )
}

/// Version of this library's interface.
#[unsafe(no_mangle)]
pub extern "C" fn ravenpose_abi_version() -> u32 {
    RAVENPOSE_ABI_VERSION
}

/// What a code means; a static text, never null.
#[unsafe(no_mangle)]
pub extern "C" fn ravenpose_error_text(code: i32) -> *const c_char {
    error::text(code).as_ptr()
}

/// `CLOCK_MONOTONIC` in ns, the clock of all messages.
#[unsafe(no_mangle)]
pub extern "C" fn ravenpose_now_ns() -> i64 {
    ravenpose_transport::now_ns()
}

/// Makes `state` a state of zeros with a valid version and size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ravenpose_state_init(state: *mut RavenState) -> i32 {
    if state.is_null() {
        return Code::Null as i32;
    }
    // SAFETY: checked; the caller gives a valid place.
    unsafe { state.write(RavenState::new()) };
    Code::Ok as i32
}

/// Opens the one publisher of states. Not real-time: call it before the control loop. On failure `message` (may be null) gets one line.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ravenpose_publisher_open(
    options: *const Options,
    publisher: *mut *mut Publisher,
    message: *mut c_char,
    message_size: usize,
) -> i32 {
    // SAFETY: the caller's pointers, checked for null inside.
    unsafe { open(options, publisher, message, message_size, |settings, _| Publisher::open(settings)) }
}

/// Gives a place in shared memory to write the next state into: zeros, with version, size, source and the next sequence number set.
/// Asked again before `send`, it gives the same place. Nothing is visible before `send`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ravenpose_publisher_loan(publisher: *mut Publisher, state: *mut *mut RavenState) -> i32 {
    // SAFETY: the caller gives null or a live handle, used by one thread at a time.
    let (Some(publisher), false) = (unsafe { publisher.as_mut() }, state.is_null()) else { return Code::Null as i32 };
    match guarded(|| publisher.loan()) {
        Ok(Ok(place)) => {
            // SAFETY: checked above.
            unsafe { *state = place };
            Code::Ok as i32
        }
        Ok(Err(code)) | Err(code) => code as i32,
    }
}

/// Hands the loaned state over. Sets the guard words, `source_time_ns` if it is 0, and `arms` if it is 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ravenpose_publisher_send(publisher: *mut Publisher) -> i32 {
    // SAFETY: the caller gives null or a live handle, used by one thread at a time.
    let Some(publisher) = (unsafe { publisher.as_mut() }) else { return Code::Null as i32 };
    guarded(|| publisher.send()).map_or_else(|code| code as i32, |code| code as i32)
}

/// Copies `state` and hands it over: `loan`, copy, `send` in one call. A sequence number of 0 means the next one.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ravenpose_publisher_publish(publisher: *mut Publisher, state: *const RavenState) -> i32 {
    // SAFETY: the caller gives null or a live handle, used by one thread at a time, and null or a valid state.
    let (Some(publisher), Some(state)) = (unsafe { publisher.as_mut() }, unsafe { state.as_ref() }) else {
        return Code::Null as i32;
    };
    guarded(|| publisher.publish(state)).map_or_else(|code| code as i32, |code| code as i32)
}

/// Readers of states that are connected now; 0 for null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ravenpose_publisher_readers(publisher: *const Publisher) -> u32 {
    // SAFETY: the caller gives null or a live handle.
    unsafe { publisher.as_ref() }.map_or(0, |publisher| guarded(|| publisher.readers()).unwrap_or(0))
}

/// Closes the publisher and sets the caller's pointer to null. Null is allowed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ravenpose_publisher_close(publisher: *mut *mut Publisher) {
    // SAFETY: the caller gives null or the address of a pointer that came from `open`, closed once.
    unsafe { close(publisher) };
}

/// Opens a reader of poses. Not real-time. On failure `message` (may be null) gets one line.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ravenpose_pose_reader_open(
    options: *const Options,
    reader: *mut *mut PoseReader,
    message: *mut c_char,
    message_size: usize,
) -> i32 {
    // SAFETY: the caller's pointers, checked for null inside.
    unsafe {
        open(options, reader, message, message_size, |settings, options| PoseReader::open(settings, options.queue_depth as usize))
    }
}

/// Takes the newest pose that was not taken yet. `RAVENPOSE_NOTHING_NEW` leaves `pose` as it is.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ravenpose_pose_reader_take(reader: *mut PoseReader, pose: *mut CorrectedPose) -> i32 {
    // SAFETY: as for every reader call: null, or a live handle used by one thread at a time and a valid place.
    unsafe { read(reader, pose, PoseReader::latest) }
}

/// Takes the oldest pose that still waits in the queue (for recorders). `RAVENPOSE_NOTHING_NEW` leaves `pose` as it is.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ravenpose_pose_reader_next(reader: *mut PoseReader, pose: *mut CorrectedPose) -> i32 {
    // SAFETY: as above.
    unsafe { read(reader, pose, PoseReader::next) }
}

/// Waits for a pose that was not taken yet, at most `timeout_ns`, looking every 50 µs, and takes the newest. Not for a real-time
/// thread: it sleeps, and after half a second of silence it makes sure that it still listens to the living service.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ravenpose_pose_reader_wait(reader: *mut PoseReader, timeout_ns: i64, pose: *mut CorrectedPose) -> i32 {
    // SAFETY: as above.
    unsafe { read(reader, pose, |reader| reader.wait(timeout_ns)) }
}

/// Closes the reader and sets the caller's pointer to null. Null is allowed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ravenpose_pose_reader_close(reader: *mut *mut PoseReader) {
    // SAFETY: the caller gives null or the address of a pointer that came from `open`, closed once.
    unsafe { close(reader) };
}

/// The consumer rule for one arm (0 gold, 1 green) at the time `now_ns`: writes the corrected position if it may be used, else the raw
/// one, in µm, frame 0 of the arm. Returns `RAVENPOSE_OK` for corrected, `RAVENPOSE_RAW` for raw, a negative code for bad arguments.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ravenpose_position(pose: *const CorrectedPose, arm: u32, now_ns: i64, position_um: *mut f64) -> i32 {
    // SAFETY: the caller gives null or a valid pose, and null or room for three numbers.
    unsafe { consume(pose, arm, now_ns, position_um, |arm| (true, &arm.corrected_position_um, &arm.raw_position_um)) }
}

/// The same for the orientation: nine numbers, row-major. Returns `RAVENPOSE_OK` for corrected, `RAVENPOSE_RAW` for RAVEN's own, also
/// where no model corrects the orientation, a negative code for bad arguments.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ravenpose_orientation(pose: *const CorrectedPose, arm: u32, now_ns: i64, orientation: *mut f32) -> i32 {
    // SAFETY: the caller gives null or a valid pose, and null or room for nine numbers.
    unsafe {
        consume(pose, arm, now_ns, orientation, |arm| (arm.orientation_model_id != 0, &arm.corrected_orientation, &arm.orientation))
    }
}

/// The consumer rule: writes an arm's corrected numbers to `room` if they may be used, else the raw ones. `of` an arm: is there a
/// correction at all, corrected, raw.
///
/// # Safety
/// `pose` is null or valid, `room` is null or has room for `N` numbers.
unsafe fn consume<T: Copy, const N: usize>(
    pose: *const CorrectedPose,
    arm: u32,
    now_ns: i64,
    room: *mut T,
    of: impl Fn(&ArmPose) -> (bool, &[T; N], &[T; N]),
) -> i32 {
    // SAFETY: the caller gives null or a valid pose.
    let (Some(pose), false) = (unsafe { pose.as_ref() }, room.is_null()) else { return Code::Null as i32 };
    let Some(estimate) = pose.arm.get(arm as usize) else { return Code::Argument as i32 };
    if pose.admit().is_err() {
        return Code::Torn as i32;
    }
    if estimate.status == ArmStatus::Absent as u32 {
        return Code::Absent as i32;
    }
    // A pose of the future is of another clock, and may be of any age.
    let fresh = (-AHEAD_MAX_NS..RAVENPOSE_POSE_AGE_MAX_NS).contains(&now_ns.saturating_sub(pose.source_time_ns));
    let (is_corrected, corrected, raw) = of(estimate);
    let usable = fresh && estimate.status == ArmStatus::Valid as u32 && is_corrected;
    let numbers = if usable { corrected } else { raw };
    // SAFETY: the caller gives room for as many numbers.
    unsafe { std::ptr::copy_nonoverlapping(numbers.as_ptr(), room, N) };
    if usable { Code::Ok as i32 } else { Code::Raw as i32 }
}

/// Number of arms in a pose.
#[unsafe(no_mangle)]
pub extern "C" fn ravenpose_arms() -> u32 {
    ARMS as u32
}

unsafe fn read(
    reader: *mut PoseReader,
    pose: *mut CorrectedPose,
    take: impl FnOnce(&mut PoseReader) -> Result<Option<CorrectedPose>, Code>,
) -> i32 {
    // SAFETY: the caller gives null or a live handle, used by one thread at a time.
    let (Some(reader), false) = (unsafe { reader.as_mut() }, pose.is_null()) else { return Code::Null as i32 };
    match guarded(|| take(reader)) {
        Ok(Ok(Some(message))) => {
            // SAFETY: checked above.
            unsafe { pose.write(message) };
            Code::Ok as i32
        }
        Ok(Ok(None)) => Code::NothingNew as i32,
        Ok(Err(code)) | Err(code) => code as i32,
    }
}

unsafe fn close<T>(handle: *mut *mut T) {
    if handle.is_null() {
        return;
    }
    // SAFETY: `handle` is valid; what it points to came from `Box::into_raw` in `open` and is freed once, since it is nulled here.
    unsafe {
        let inner = std::mem::replace(&mut *handle, std::ptr::null_mut());
        if !inner.is_null() {
            let inner = Box::from_raw(inner);
            let _ = guarded(move || drop(inner));
        }
    }
}
