//! Webcams by the kernel's own interface, Video for Linux: Motion JPEG as the camera sends it, each image with the kernel's stamp.
//!
//! The stamp is of `CLOCK_MONOTONIC`, as the robot's states are, and of the moment in which the camera began the image (the USB driver of
//! webcams says so; others stamp its end). What comes later, when the image has crossed the bus and its buffer was waited for, moves by
//! milliseconds from image to image.
//!
//! This module contains `unsafe`: the kernel's calls, with its structures as `linux/videodev2.h` lays them out on 64-bit machines, and its
//! buffers, mapped.

use super::{Shot, Source};
use crate::error::{Error, Result};
use std::fs::{File, OpenOptions};
use std::os::fd::AsRawFd;
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

/// Images that the driver may fill while one is taken.
const BUFFERS: u32 = 4;
/// Silence that is taken for an end, ms.
const SILENCE_MS: i32 = 5000;

const CAPTURE: u32 = 1;
const MAPPED: u32 = 1;
const CAN_CAPTURE: u32 = 0x1;
const CAN_STREAM: u32 = 0x0400_0000;
const HAS_OWN_CAPABILITIES: u32 = 0x8000_0000;
const MJPG: u32 = u32::from_le_bytes(*b"MJPG");
const BROKEN: u32 = 0x40;
const STAMP: u32 = 0xe000;
const STAMP_MONOTONIC: u32 = 0x2000;

#[repr(C)]
struct Capability {
    text: [u8; 80],
    version: u32,
    capabilities: u32,
    device: u32,
    reserved: [u32; 3],
}

#[repr(C)]
struct Format {
    kind: u32,
    padding: u32,
    width: u32,
    height: u32,
    pixels: u32,
    rest: [u32; 47],
}

#[repr(C)]
struct Parameters {
    kind: u32,
    capability: u32,
    mode: u32,
    /// Seconds of one image.
    numerator: u32,
    denominator: u32,
    rest: [u32; 46],
}

#[repr(C)]
struct Request {
    count: u32,
    kind: u32,
    memory: u32,
    rest: [u32; 2],
}

#[repr(C)]
struct Buffer {
    index: u32,
    kind: u32,
    used: u32,
    flags: u32,
    field: u32,
    padding: u32,
    seconds: i64,
    microseconds: i64,
    timecode: [u32; 4],
    sequence: u32,
    memory: u32,
    offset: u64,
    length: u32,
    rest: [u32; 3],
}

/// `_IOC` of the kernel: direction, size of the structure, letter V, number.
const fn request<T>(direction: u64, number: u64) -> u64 {
    direction << 30 | (size_of::<T>() as u64) << 16 | (b'V' as u64) << 8 | number
}
const WRITE: u64 = 1;
const READ: u64 = 2;
const QUERY_CAPABILITY: u64 = request::<Capability>(READ, 0);
const SET_FORMAT: u64 = request::<Format>(READ | WRITE, 5);
const SET_PARAMETERS: u64 = request::<Parameters>(READ | WRITE, 22);
const REQUEST_BUFFERS: u64 = request::<Request>(READ | WRITE, 8);
const QUERY_BUFFER: u64 = request::<Buffer>(READ | WRITE, 9);
const QUEUE: u64 = request::<Buffer>(READ | WRITE, 15);
const DEQUEUE: u64 = request::<Buffer>(READ | WRITE, 17);
const STREAM_ON: u64 = request::<u32>(WRITE, 18);
const STREAM_OFF: u64 = request::<u32>(WRITE, 19);

/// A structure of the kernel's, of zeros.
trait Plain: Sized {
    fn zeros() -> Self {
        // SAFETY: implemented for structures of integers only, for which zeros are a value.
        unsafe { std::mem::zeroed() }
    }
}
impl Plain for Capability {}
impl Plain for Format {}
impl Plain for Parameters {}
impl Plain for Request {}
impl Plain for Buffer {}
impl Plain for u32 {}

/// One call about `what`, again when a signal came.
fn call<T: Plain>(device: &File, number: u64, what: &mut T) -> std::io::Result<()> {
    loop {
        // SAFETY: each number is made of the size of the structure that goes with it, which the kernel reads and fills.
        if unsafe { libc::ioctl(device.as_raw_fd(), number, std::ptr::from_mut(what)) } >= 0 {
            return Ok(());
        }
        let error = std::io::Error::last_os_error();
        if error.kind() != std::io::ErrorKind::Interrupted {
            return Err(error);
        }
    }
}

/// A buffer of the driver's in our memory.
struct Mapped {
    bytes: *mut u8,
    length: usize,
}

// SAFETY: memory that only its owner reads.
unsafe impl Send for Mapped {}

impl Mapped {
    fn new(device: &File, buffer: &Buffer) -> std::io::Result<Self> {
        let length = buffer.length as usize;
        // SAFETY: a new mapping at a place of the kernel's choice.
        let bytes = unsafe {
            libc::mmap(
                std::ptr::null_mut(),
                length,
                libc::PROT_READ,
                libc::MAP_SHARED,
                device.as_raw_fd(),
                (buffer.offset as u32).into(),
            )
        };
        if bytes == libc::MAP_FAILED { Err(std::io::Error::last_os_error()) } else { Ok(Self { bytes: bytes.cast(), length }) }
    }

    /// The first bytes of an image that was taken from the driver and not given back yet.
    fn first(&self, count: usize) -> Vec<u8> {
        // SAFETY: mapped for as many bytes; the driver writes only to buffers that it was given.
        unsafe { std::slice::from_raw_parts(self.bytes, count.min(self.length)) }.to_vec()
    }
}

impl Drop for Mapped {
    fn drop(&mut self) {
        // SAFETY: mapped by `new`, and nothing borrows from it.
        unsafe { libc::munmap(self.bytes.cast(), self.length) };
    }
}

/// A webcam that sends images.
struct Camera {
    path: PathBuf,
    device: File,
    buffers: Vec<Mapped>,
    /// Why it is over.
    last_words: Option<String>,
}

/// Opens a webcam and lets it send images of this size, as near to this rate as it can.
pub(super) fn webcam(path: &Path, size_px: [u32; 2], frames_per_s: f64) -> Result<Box<dyn Source>> {
    let wrong = |what: String, remedy: &str| Error::content(path, "webcam", what, remedy);
    let mut open = OpenOptions::new();
    let device = open.read(true).write(true).custom_flags(libc::O_NONBLOCK).open(path).map_err(|error| match error.kind() {
        std::io::ErrorKind::NotFound => {
            Error::content(path, "video", "no such device", "plug the camera in, ls /dev/video* shows those there are")
        }
        _ => wrong(error.to_string(), "be in the group that owns it (video), and look who else uses it: fuser -v /dev/video*"),
    })?;
    let mut found = Capability::zeros();
    let no_camera = || {
        wrong("it takes no images".to_owned(), "a webcam has several devices, the first one is the camera: v4l2-ctl --list-devices")
    };
    call(&device, QUERY_CAPABILITY, &mut found).map_err(|_| no_camera())?;
    let can = if found.capabilities & HAS_OWN_CAPABILITIES == 0 { found.capabilities } else { found.device };
    if can & CAN_CAPTURE == 0 || can & CAN_STREAM == 0 {
        return Err(no_camera());
    }

    let [width, height] = size_px;
    let mut format = Format { kind: CAPTURE, width, height, pixels: MJPG, ..Format::zeros() };
    call(&device, SET_FORMAT, &mut format)
        .map_err(|error| wrong(error.to_string(), "look who else uses it: fuser -v /dev/video*"))?;
    if format.pixels != MJPG {
        return Err(wrong(
            "it sends no Motion JPEG".to_owned(),
            "give --ffmpeg ffmpeg, which makes JPEG of what it sends; images are then stamped when they come",
        ));
    }
    if [format.width, format.height] != size_px {
        let what = format!("it sends {}x{} px instead of {width}x{height}", format.width, format.height);
        return Err(wrong(what, "ask for a size that it has: v4l2-ctl --list-formats-ext"));
    }
    let rate = (frames_per_s * 1000.0).round() as u32;
    let mut parameters = Parameters { kind: CAPTURE, numerator: 1000, denominator: rate, ..Parameters::zeros() };
    // A camera that knows one rate only may refuse; what it sends is seen.
    drop(call(&device, SET_PARAMETERS, &mut parameters));

    let refused = |error: std::io::Error| wrong(format!("it gives no images: {error}"), "unplug it and plug it in");
    let mut request = Request { count: BUFFERS, kind: CAPTURE, memory: MAPPED, rest: [0; 2] };
    call(&device, REQUEST_BUFFERS, &mut request).map_err(refused)?;
    let mut camera = Camera { path: path.to_owned(), device, buffers: Vec::new(), last_words: None };
    for index in 0..request.count {
        let mut buffer = Buffer { index, kind: CAPTURE, memory: MAPPED, ..Buffer::zeros() };
        call(&camera.device, QUERY_BUFFER, &mut buffer).map_err(refused)?;
        camera.buffers.push(Mapped::new(&camera.device, &buffer).map_err(refused)?);
        camera.give(index).map_err(refused)?;
    }
    call(&camera.device, STREAM_ON, &mut CAPTURE.clone()).map_err(refused)?;
    Ok(Box::new(camera))
}

impl Camera {
    /// Gives a buffer to the driver.
    fn give(&self, index: u32) -> std::io::Result<()> {
        call(&self.device, QUEUE, &mut Buffer { index, kind: CAPTURE, memory: MAPPED, ..Buffer::zeros() })
    }

    /// The next image and its buffer's facts; an error is the end.
    fn take(&self) -> std::result::Result<(Vec<u8>, Buffer), String> {
        loop {
            let mut wanted = libc::pollfd { fd: self.device.as_raw_fd(), events: libc::POLLIN, revents: 0 };
            // SAFETY: one structure, which lives as long as the call.
            let ready = unsafe { libc::poll(&raw mut wanted, 1, SILENCE_MS) };
            if ready == 0 {
                return Err(format!("nothing came for {} s; unplug it and plug it in", SILENCE_MS / 1000));
            }
            let mut buffer = Buffer { kind: CAPTURE, memory: MAPPED, ..Buffer::zeros() };
            match call(&self.device, DEQUEUE, &mut buffer) {
                Ok(()) => {}
                Err(error)
                    if error.kind() == std::io::ErrorKind::WouldBlock && wanted.revents & (libc::POLLERR | libc::POLLHUP) == 0 =>
                {
                    continue;
                }
                Err(error) if error.raw_os_error() == Some(libc::ENODEV) => return Err("it was unplugged".to_owned()),
                Err(error) => return Err(error.to_string()),
            }
            let Some(mapped) = self.buffers.get(buffer.index as usize) else {
                return Err(format!("the driver gave buffer {} of {}", buffer.index, self.buffers.len()));
            };
            let jpeg = mapped.first(buffer.used as usize);
            self.give(buffer.index).map_err(|error| error.to_string())?;
            // Half an image is none: cables and hubs lose packets.
            if buffer.flags & BROKEN == 0 && jpeg.starts_with(&[0xff, 0xd8]) {
                return Ok((jpeg, buffer));
            }
        }
    }
}

/// `CLOCK_MONOTONIC`, ns.
fn now_ns() -> i64 {
    let mut now = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: a place for the time; this clock is always there.
    unsafe { libc::clock_gettime(libc::CLOCK_MONOTONIC, &raw mut now) };
    now.tv_sec * 1_000_000_000 + now.tv_nsec
}

impl Source for Camera {
    fn next(&mut self) -> Result<Option<Shot>> {
        if self.last_words.is_some() {
            return Ok(None);
        }
        let (jpeg, buffer) = match self.take() {
            Ok(taken) => taken,
            Err(why) => {
                self.last_words = Some(format!("{}: {why}", self.path.display()));
                return Ok(None);
            }
        };
        let now = now_ns();
        let stamp = buffer.seconds * 1_000_000_000 + buffer.microseconds * 1000;
        let taken_ns = (buffer.flags & STAMP == STAMP_MONOTONIC && stamp <= now).then_some(stamp);
        let wall_s = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |since| since.as_secs_f64());
        let t_s = wall_s - taken_ns.map_or(0.0, |taken| (now - taken) as f64 * 1e-9);
        Ok(Some(Shot { t_s, taken_ns, jpeg }))
    }

    fn live(&self) -> bool {
        true
    }

    fn last_words(&mut self) -> Option<String> {
        self.last_words.clone()
    }
}

impl Drop for Camera {
    fn drop(&mut self) {
        // A camera that was unplugged refuses; it sends nothing any more.
        drop(call(&self.device, STREAM_OFF, &mut CAPTURE.clone()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::mem::offset_of;

    #[test]
    fn structures_and_numbers_are_the_kernels() {
        // As `linux/videodev2.h` gives them on x86-64 and aarch64.
        let sizes =
            [size_of::<Capability>(), size_of::<Format>(), size_of::<Parameters>(), size_of::<Request>(), size_of::<Buffer>()];
        assert_eq!(sizes, [104, 208, 204, 20, 88]);
        assert_eq!((QUERY_CAPABILITY, SET_FORMAT, SET_PARAMETERS), (0x8068_5600, 0xc0d0_5605, 0xc0cc_5616));
        assert_eq!((REQUEST_BUFFERS, QUERY_BUFFER, QUEUE, DEQUEUE), (0xc014_5608, 0xc058_5609, 0xc058_560f, 0xc058_5611));
        assert_eq!((STREAM_ON, STREAM_OFF), (0x4004_5612, 0x4004_5613));
        assert_eq!((offset_of!(Buffer, seconds), offset_of!(Buffer, sequence), offset_of!(Buffer, offset)), (24, 56, 64));
    }
}
