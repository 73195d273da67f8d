//! Video in: AVI files of Motion JPEG, other files through a program, and live sources behind the trait that webcams have.

mod common;

use common::{Folder, data, run};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use vision::Result;
use vision::rig::Rig;
use vision::track::Mode;
use vision::video::record::record;
use vision::video::{Shot, Source, open};

/// An AVI file of JPEG images; `code` names their format.
fn avi(images: &[Vec<u8>], rate: u32, code: [u8; 4]) -> Vec<u8> {
    let chunk = |id: &[u8], content: &[u8]| {
        let mut all = id.to_vec();
        all.extend((content.len() as u32).to_le_bytes());
        all.extend(content);
        all.resize(all.len() + content.len() % 2, 0);
        all
    };
    let list = |kind: &[u8], content: &[u8]| chunk(b"LIST", &[kind, content].concat());
    let header = |kind: &[u8], code: &[u8], scale: u32, rate: u32| {
        let mut all = [kind, code, &[0; 12]].concat();
        all.extend(scale.to_le_bytes());
        all.extend(rate.to_le_bytes());
        all.resize(56, 0);
        chunk(b"strh", &all)
    };
    // A sound stream first: the video is stream 01.
    let sound = list(b"strl", &header(b"auds", &[0; 4], 1, 8000));
    let video = list(b"strl", &header(b"vids", &code, 1, rate));
    let head = list(b"hdrl", &[chunk(b"avih", &[0; 56]), sound, video].concat());
    let mut movie = Vec::new();
    for image in images {
        movie.extend(chunk(b"00wb", b"sound"));
        movie.extend(chunk(b"01dc", image));
    }
    chunk(b"RIFF", &[b"AVI ".to_vec(), head, chunk(b"JUNK", &[0; 7]), list(b"movi", &movie), chunk(b"idx1", &[0; 16])].concat())
}

fn images(scene: &Path, camera: usize, frames: usize) -> Vec<Vec<u8>> {
    (0..frames).map(|frame| std::fs::read(scene.join(format!("frames/cam{camera}/{frame:06}.jpg"))).expect("image")).collect()
}

fn easy() -> Option<(PathBuf, Rig)> {
    let scene = data("vision-rendered")?.join("easy");
    let rig = vision::rig::read(&scene).expect("rig");
    Some((scene, rig))
}

fn opened(path: &Path) -> Result<Box<dyn Source>> {
    open(path, Some(Path::new("/nowhere/ffmpeg")), [1280, 720], 15.0)
}

/// The one line of an error, which has to hold some words.
fn line<T>(result: Result<T>, words: &[&str]) {
    let Err(error) = result else { panic!("no error with {words:?}") };
    let text = error.to_string();
    assert!(!text.contains('\n') && words.iter().all(|word| text.contains(word)), "{text}");
}

#[test]
fn a_recording_of_videos_is_measured_as_its_images_are() {
    let Some((scene, rig)) = easy() else { return };
    let own = Folder::new("videos");
    let sources = (0..4).map(|camera| {
        let file = own.0.join(format!("{camera}.avi"));
        std::fs::write(&file, avi(&images(&scene, camera, 4), 15, *b"MJPG")).expect("file");
        Some(opened(&file).expect("a video"))
    });
    let out = own.0.join("scene");
    let mut last = 0;
    let made = record(&rig, sources.collect(), 15.0, None, &out, &mut |done, _| last = done).expect("recorded");
    assert_eq!((made.frames, made.images, last), (4, vec![4; 4], 4));
    let same = Folder::of_scene("videos-images", &scene, 4);
    for part in ["markers.csv", "chessboard/cam0.jpg", "chessboard/cam1.jpg", "chessboard/cam2.jpg", "chessboard/cam3.jpg"] {
        std::fs::create_dir_all(out.join("chessboard")).expect("folder");
        std::fs::copy(scene.join(part), out.join(part)).expect("copied");
    }
    let text = |folder: &Path| vision::commands::truth_text(&run(folder, Mode::Default).expect("measured"));
    assert_eq!(text(&out), text(&same.0));
}

#[test]
fn other_videos_go_through_the_program() {
    let Some((scene, rig)) = easy() else { return };
    let own = Folder::new("program");
    std::fs::write(own.0.join("made.avi"), avi(&images(&scene, 0, 2), 15, *b"MJPG")).expect("file");
    let video = own.0.join("clip.mp4");
    std::fs::write(&video, "some other format").expect("file");
    let program = own.0.join("ffmpeg");
    let script = |text: &str| {
        std::fs::write(&program, format!("#!/bin/sh\n{text}\n")).expect("script");
        std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).expect("script");
    };
    script(&format!("cat {}", own.0.join("made.avi").display()));
    let source = open(&video, Some(&program), rig.size_px, 15.0).expect("a video");
    let made =
        record(&rig, vec![Some(source), None, None, None], 15.0, None, &own.0.join("scene"), &mut |_, _| {}).expect("recorded");
    assert_eq!((made.frames, made.images), (2, vec![2, 0, 0, 0]));
    script("echo 'first words' >&2; echo 'Invalid data found' >&2; exit 1");
    line(open(&video, Some(&program), rig.size_px, 15.0), &["clip.mp4", "Invalid data found"]);
    line(opened(&video), &["clip.mp4", "/nowhere/ffmpeg", "install ffmpeg"]);
    std::fs::write(&video, avi(&images(&scene, 0, 1), 15, *b"H264")).expect("file");
    line(opened(&video), &["clip.mp4", "install ffmpeg"]);
}

#[test]
fn what_is_no_video_is_one_clear_line() {
    let Some((scene, rig)) = easy() else { return };
    line(opened(Path::new("/dev/video-of-nobody")), &["/dev/video-of-nobody", "no such device", "plug"]);
    line(opened(Path::new("/tmp/no-such-video.avi")), &["no such file"]);
    let own = Folder::new("no-video");
    let small = own.0.join("small.avi");
    let mut jpeg = Vec::new();
    image::codecs::jpeg::JpegEncoder::new(&mut jpeg).encode_image(&image::RgbImage::new(64, 48)).expect("image");
    std::fs::write(&small, avi(&[jpeg], 15, *b"MJPG")).expect("file");
    let out = own.0.join("scene");
    let source = |file: &Path| vec![Some(opened(file).expect("a video")), None, None, None];
    line(record(&rig, source(&small), 15.0, None, &out, &mut |_, _| {}), &["cam0", "64 x 48", "1280 x 720"]);
    std::fs::write(&small, avi(&[b"no image".to_vec()], 15, *b"MJPG")).expect("file");
    line(record(&rig, source(&small), 15.0, None, &out, &mut |_, _| {}), &["cam0", "no JPEG"]);
    assert!(!out.exists(), "nothing is left of a recording that failed");
    line(record(&rig, source(&small), -1.0, None, &out, &mut |_, _| {}), &["frames/s"]);
    std::fs::create_dir_all(out.join("mine")).expect("folder");
    line(record(&rig, source(&small), 15.0, None, &out, &mut |_, _| {}), &["not empty"]);
    drop(scene);
}

#[test]
fn a_video_cut_off_anywhere_ends_with_its_last_whole_image_or_is_refused() {
    let image = vec![7_u8; 101];
    let whole = avi(&vec![image.clone(); 3], 30, *b"MJPG");
    let own = Folder::new("cut");
    let mut most = 0;
    for length in 0..whole.len() {
        let file = own.0.join("cut.avi");
        std::fs::write(&file, &whole[..length]).expect("file");
        let Ok(mut source) = opened(&file) else { continue };
        let mut count = 0;
        while let Some(shot) = source.next().expect("an image") {
            assert_eq!(shot.jpeg, image);
            assert!((shot.t_s - f64::from(count) / 30.0).abs() < 1e-9);
            count += 1;
        }
        assert!(count >= most, "more of the file holds no fewer images");
        most = count;
    }
    assert_eq!(most, 3);
}

/// A camera with its own rate and phase, which is unplugged at some time.
struct Fake {
    jpeg: Vec<u8>,
    next_s: f64,
    step_s: f64,
    silent_s: [f64; 2],
    ends_s: f64,
}

impl Source for Fake {
    fn next(&mut self) -> Result<Option<Shot>> {
        let t_s = self.next_s;
        self.next_s += self.step_s;
        if t_s >= self.silent_s[0] && t_s < self.silent_s[1] {
            self.next_s = self.silent_s[1];
            return self.next();
        }
        if t_s >= self.ends_s {
            return Ok(None);
        }
        Ok(Some(Shot { t_s, taken_ns: None, jpeg: self.jpeg.clone() }))
    }

    fn live(&self) -> bool {
        true
    }

    fn last_words(&mut self) -> Option<String> {
        Some("it was unplugged".to_owned())
    }
}

#[test]
fn live_cameras_of_different_phase_give_common_frames() {
    let Some((scene, rig)) = easy() else { return };
    let jpeg = images(&scene, 0, 1).remove(0);
    let fake = |begun_s: f64, step_s: f64, silent_s: [f64; 2]| -> Option<Box<dyn Source>> {
        Some(Box::new(Fake {
            jpeg: jpeg.clone(),
            next_s: 1000.0 + begun_s,
            step_s,
            silent_s: silent_s.map(|s| 1000.0 + s),
            ends_s: f64::INFINITY,
        }))
    };
    let sources =
        vec![fake(0.0, 1.0 / 30.0, [9.0, 9.0]), fake(0.21, 1.0 / 15.0, [9.0, 9.0]), fake(0.05, 1.0 / 15.1, [0.5, 1.0]), None];
    let own = Folder::new("live");
    let out = own.0.join("scene");
    let made = record(&rig, sources, 15.0, Some(2.0), &out, &mut |_, _| {}).expect("recorded");
    assert_eq!(made.frames, 30);
    assert_eq!(made.images[..2], [30, 30], "cameras that go on have an image for each frame");
    assert!((20..=24).contains(&made.images[2]), "half a second of silence: {:?}", made.images);
    let text = std::fs::read_to_string(out.join("frames.csv")).expect("times");
    assert!(text.starts_with("# start_unix_s = 1000.210000\nframe,t_s\n0,0.000000\n1,0.066667\n"), "{text}");
    let frames = vision::table::read_frames(&out.join("frames.csv")).expect("times");
    assert_eq!((frames.times.len(), frames.start_unix_s), (30, Some(1000.21)));
}

#[test]
fn a_camera_that_is_unplugged_does_not_end_the_recording_of_the_others() {
    let Some((scene, rig)) = easy() else { return };
    let jpeg = images(&scene, 0, 1).remove(0);
    let fake = |ends_s: f64| -> Option<Box<dyn Source>> {
        Some(Box::new(Fake { jpeg: jpeg.clone(), next_s: 1000.0, step_s: 0.1, silent_s: [0.0; 2], ends_s: 1000.0 + ends_s }))
    };
    let own = Folder::new("unplugged");
    let sources = vec![fake(9.0), fake(1.0), fake(9.0), None];
    let made = record(&rig, sources, 10.0, Some(3.0), &own.0.join("scene"), &mut |_, _| {}).expect("recorded");
    assert_eq!((made.frames, &made.images[..]), (30, &[30, 10, 30, 0][..]));
    let [(camera, after_s, said)] = &made.ended[..] else { panic!("{:?}", made.ended) };
    assert!(*camera == 1 && (after_s - 0.9).abs() < 0.01 && said.as_deref() == Some("it was unplugged"), "{:?}", made.ended);
}

#[test]
fn a_damaged_image_costs_its_camera_that_frame_and_a_short_video_is_told() {
    let Some((scene, rig)) = easy() else { return };
    let own = Folder::new("damaged");
    let made = |name: &str, frames_of_last: usize| {
        let sources = (0..4).map(|camera| {
            let mut all = images(&scene, camera, if camera == 3 { frames_of_last } else { 14 });
            if camera == 2 {
                all[2].truncate(150);
            }
            let file = own.0.join(format!("{name}{camera}.avi"));
            std::fs::write(&file, avi(&all, 5, *b"MJPG")).expect("file");
            Some(opened(&file).expect("a video"))
        });
        record(&rig, sources.collect(), 5.0, None, &own.0.join(name), &mut |_, _| {}).expect("recorded")
    };
    let whole = made("whole", 14);
    assert_eq!((whole.frames, &whole.images[..], &whole.damaged[..]), (14, &[14, 14, 13, 14][..], &[0, 0, 1, 0][..]));
    assert!(whole.ended.is_empty() && !own.0.join("whole/frames/cam2/000002.jpg").exists(), "{:?}", whole.ended);
    let short = made("short", 4);
    assert_eq!(short.frames, 4);
    assert!(matches!(&short.ended[..], [(3, after_s, None)] if (after_s - 0.6).abs() < 0.01), "{:?}", short.ended);
}
