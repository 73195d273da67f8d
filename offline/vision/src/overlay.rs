//! A contact sheet of a measured recording: one page that stands on its own and shows, frame by frame and camera by camera, which
//! circles were found, which were suspended, and why.

use crate::camera::Camera;
use crate::edge::Cone;
use crate::error::{Error, Result};
use crate::outcome::{Row, Tracked};
use crate::outcome::{Suspended, View};
use crate::recording::Recording;
use crate::rig::{Fixture, Rig};
use crate::table::FrameTime;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use image::RgbImage;
use nalgebra::{Point2, Point3};
use std::fmt::Write as _;
use std::path::Path;

/// Frames on a page; of longer recordings lost ones first, then ones with suspended circles, then others.
const MOST_FRAMES: usize = 60;
/// Width of the pictures, px.
const WIDTH: u32 = 480;
/// Their quality.
const QUALITY: u8 = 70;
/// Corners of a drawn outline.
const CORNERS: i32 = 36;

const STYLE: &str = "\
body{font:15px/1.4 system-ui,sans-serif;margin:0 auto;max-width:1600px;padding:12px;background:#fff;color:#1c1c1c}\
h1{font-size:1.3em;margin:.2em 0}h2{font-size:1em;margin:0 0 4px}section{border-top:1px solid #bbb;padding:10px 0}\
.cams{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,300px),1fr));gap:8px}\
figure{margin:0}figure svg{width:100%;height:auto;display:block;background:#222}figcaption{font-size:.85em;overflow-wrap:anywhere}\
.lost h2{color:#b00020}.why{color:#8a4b00}.scroll{overflow-x:auto}table{border-collapse:collapse}td,th{padding:2px 8px;text-align:right;\
border-bottom:1px solid #ddd}td:first-child,th:first-child{text-align:left}#odd:checked~section.fine{display:none}\
path{fill:none;vector-effect:non-scaling-stroke;stroke-width:1.5}path.in{stroke:#fff}path.out{stroke:#ffb000;stroke-dasharray:5 4}\
text{font:34px system-ui,sans-serif;fill:#fff;paint-order:stroke;stroke:#000;stroke-width:6px}";

/// The page of a measured recording.
///
/// # Errors
/// If images cannot be read.
pub fn sheet(cameras: &[Camera], rig: &Rig, folder: &Path, tracked: &Tracked) -> Result<String> {
    let recording = Recording::open(rig, folder)?;
    let Some(fixture) = &rig.fixture else {
        return Err(Error::content(&rig.file, "fixture", "absent", "describe the balls"));
    };
    let shown = chosen(&tracked.rows);
    let measured = tracked.rows.iter().filter(|row| row.found.is_ok()).count();
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width,\
         initial-scale=1\"><title>Tracked frames</title><style>{STYLE}</style></head><body>\n<h1>{measured} of {} frames measured</h1>\n\
         <p>{}: {} frames shown. White outlines count; dashed ones are suspended, drawn where the pose has the ball.</p>\n",
        tracked.rows.len(),
        escaped(&folder.display().to_string()),
        shown.len()
    );
    page.push_str(&summary(cameras, tracked));
    page.push_str("<input type=\"checkbox\" id=\"odd\"> <label for=\"odd\">only frames with lost or suspended circles</label>\n");
    for index in shown {
        let row = &tracked.rows[index];
        let images = recording.images(&FrameTime { frame: row.frame, t_s: row.t_s })?;
        page.push_str(&section(cameras, fixture, tracked, row, &images)?);
    }
    page.push_str("</body></html>\n");
    Ok(page)
}

/// Rows on the page, in order.
fn chosen(rows: &[Row]) -> Vec<usize> {
    let rank = |row: &Row| if row.found.is_err() { 0 } else { 1 + usize::from(!odd(row)) };
    let mut all: Vec<usize> = Vec::new();
    for wanted in 0..3 {
        let own: Vec<usize> = (0..rows.len()).filter(|k| rank(&rows[*k]) == wanted).collect();
        let free = MOST_FRAMES - all.len();
        let step = own.len().div_ceil(free.max(1)).max(1);
        all.extend(own.iter().step_by(step).take(free));
    }
    all.sort_unstable();
    all
}

fn odd(row: &Row) -> bool {
    row.found.is_err() || row.views.iter().flatten().any(|view| matches!(view, View::Suspended(_)))
}

const REASONS: [Suspended; 6] =
    [Suspended::NoImage, Suspended::NotFound, Suspended::Motion, Suspended::Colour, Suspended::Contradicts, Suspended::Returning];

/// How often circles counted and were suspended, per camera and reason.
fn summary(cameras: &[Camera], tracked: &Tracked) -> String {
    let mut text = String::from("<div class=\"scroll\"><table><tr><th>circles of measured frames</th><th>count</th>");
    for reason in REASONS {
        let _ = write!(text, "<th>{}</th>", reason.words());
    }
    text.push_str("</tr>\n");
    for (index, camera) in cameras.iter().enumerate() {
        let views: Vec<&View> = tracked.rows.iter().flat_map(|row| &row.views).filter_map(|own| own.get(index)).collect();
        let effective = views.iter().filter(|view| matches!(view, View::Effective(_))).count();
        let _ = write!(text, "<tr><td>{}</td><td>{effective}</td>", escaped(&camera.name));
        for reason in REASONS {
            let count = views.iter().filter(|view| matches!(view, View::Suspended(own) if *own == reason)).count();
            let _ = write!(text, "<td>{count}</td>");
        }
        text.push_str("</tr>\n");
    }
    text.push_str("</table></div>\n");
    text
}

fn section(
    cameras: &[Camera],
    fixture: &Fixture,
    tracked: &Tracked,
    row: &Row,
    images: &[(Option<RgbImage>, Option<String>)],
) -> Result<String> {
    let (class, verdict) = match &row.found {
        Err(lost) => ("lost", format!("lost: {}", lost.words(&tracked.balls))),
        Ok(found) => {
            let p = found.pose.translation.vector * 1e3;
            let class = if odd(row) { "odd" } else { "fine" };
            (class, format!("{:.2}, {:.2}, {:.2} mm, residual {:.3} mm", p.x, p.y, p.z, found.residual_m * 1e3))
        }
    };
    let mut text = format!(
        "<section class=\"{class}\"><h2>frame {}, {:.3} s: {}</h2><div class=\"cams\">\n",
        row.frame,
        row.t_s,
        escaped(&verdict)
    );
    for (index, camera) in cameras.iter().enumerate() {
        let (image, _) = &images[index];
        let [w, h] = camera.size_px;
        let _ = write!(text, "<figure><svg viewBox=\"0 0 {w} {h}\" role=\"img\" aria-label=\"{}\">", escaped(&camera.name));
        if let Some(image) = image {
            let _ = write!(text, "<image width=\"{w}\" height=\"{h}\" href=\"data:image/jpeg;base64,{}\"/>", picture(image)?);
        }
        let mut reasons = Vec::new();
        for (ball, name) in tracked.balls.iter().enumerate() {
            match row.views.get(ball).and_then(|own| own.get(index)) {
                Some(View::Effective(sighting)) => outline(&mut text, camera, &sighting.cone, "in", name),
                Some(View::Suspended(reason)) => {
                    reasons.push(format!("{name}: {}", reason.words()));
                    if let Some(cone) = expected(camera, fixture, row, ball) {
                        outline(&mut text, camera, &cone, "out", name);
                    }
                }
                // Paper mode keeps no circles: where the pose has the ball.
                None => {
                    if let Some(cone) = expected(camera, fixture, row, ball) {
                        outline(&mut text, camera, &cone, "in", name);
                    }
                }
            }
        }
        if image.is_none() && reasons.is_empty() {
            reasons.push(Suspended::NoImage.words().to_owned());
        }
        let why = if reasons.is_empty() {
            String::new()
        } else {
            format!(": <span class=\"why\">{}</span>", escaped(&reasons.join("; ")))
        };
        let _ = writeln!(text, "</svg><figcaption>{}{why}</figcaption></figure>", escaped(&camera.name));
    }
    text.push_str("</div></section>\n");
    Ok(text)
}

/// Outline of a ball where the pose of a frame has it.
fn expected(camera: &Camera, fixture: &Fixture, row: &Row, ball: usize) -> Option<Cone> {
    let found = row.found.as_ref().ok()?;
    let centre = found.pose * Point3::from(fixture.centres_m()[ball]);
    Cone::of_sphere(&camera.local(&centre), fixture.ball_radius_m)
}

fn outline(text: &mut String, camera: &Camera, cone: &Cone, class: &str, name: &str) {
    let corner = |k: i32| camera.intrinsics.pixel(&cone.ray(f64::from(k) * std::f64::consts::TAU / f64::from(CORNERS)));
    let corners: Vec<Point2<f64>> = (0..CORNERS).filter_map(corner).collect();
    let (Some(first), Some(middle)) = (corners.first(), camera.intrinsics.pixel(&cone.axis)) else { return };
    let _ = write!(text, "<path class=\"{class}\" d=\"M{:.1} {:.1}", first.x, first.y);
    for corner in &corners[1..] {
        let _ = write!(text, "L{:.1} {:.1}", corner.x, corner.y);
    }
    let _ = write!(text, "Z\"/><text x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"middle\">{}</text>", middle.x, middle.y, escaped(name));
}

/// A small JPEG, as text.
fn picture(image: &RgbImage) -> Result<String> {
    let height = (f64::from(image.height()) * f64::from(WIDTH) / f64::from(image.width())).round().max(1.0) as u32;
    let small = image::imageops::thumbnail(image, WIDTH, height);
    let mut bytes = Vec::new();
    image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, QUALITY).encode_image(&small).map_err(|error| {
        Error::content(Path::new("overlay"), "picture", error.to_string().replace('\n', " "), "free some memory")
    })?;
    Ok(STANDARD.encode(bytes))
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
