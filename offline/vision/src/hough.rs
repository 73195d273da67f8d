//! Circles of a colour, as in the paper's figure 4: grey, blur, Canny; colour, blur, binary; product; Hough; and the accumulator's
//! threshold by bisection, so that exactly k circles remain.

use crate::colour::ColourRange;
use image::{GrayImage, Luma, RgbImage};
use imageproc::edges::canny;
use imageproc::filter::gaussian_blur_f32;
use nalgebra::Point2;

/// A circle in an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle {
    /// Centre, in pixels from the image's corner.
    pub centre: Point2<f64>,
    /// Radius.
    pub radius_px: f64,
    /// Part of the circle's border that edges of its colour lie on, 0 to 1.
    pub support: f64,
}

/// Part of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    /// First column.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// An edge pixel and the direction into the ball.
struct Edge {
    x: f32,
    y: f32,
    inward: [f32; 2],
}

/// Pixels of a colour in a window, binary, and freed of single ones.
pub fn mask(image: &RgbImage, window: Window, range: &ColourRange) -> GrayImage {
    let raw = image.as_raw();
    let stride = 3 * image.width() as usize;
    let (w, h) = (window.width as usize, window.height as usize);
    // A blur of 3 x 3 halves and more the noise of each channel; the ball is many times wider.
    let mut lines = vec![0_u16; 3 * w * h];
    for y in 0..h {
        let row = &raw[(window.y as usize + y) * stride + 3 * window.x as usize..][..3 * w];
        for x in 0..w {
            let (left, right) = (x.saturating_sub(1), (x + 1).min(w - 1));
            for c in 0..3 {
                lines[3 * (y * w + x) + c] =
                    u16::from(row[3 * left + c]) + u16::from(row[3 * x + c]) + u16::from(row[3 * right + c]);
            }
        }
    }
    GrayImage::from_fn(window.width, window.height, |x, y| {
        let (x, y) = (x as usize, y as usize);
        let rows = [y.saturating_sub(1), y, (y + 1).min(h - 1)];
        let rgb = std::array::from_fn(|c| rows.iter().map(|row| f32::from(lines[3 * (row * w + x) + c])).sum::<f32>() / 9.0);
        Luma([if range.holds(rgb) { 255 } else { 0 }])
    })
}

/// The smallest window that holds all of a colour, with a margin; `None` if there is none of it.
pub fn extent(image: &RgbImage, range: &ColourRange, margin_px: u32) -> Option<Window> {
    let (mut x0, mut x1, mut y0, mut y1) = (u32::MAX, 0, u32::MAX, 0);
    let mut row = vec![false; (image.width() / 4) as usize];
    for y in 0..image.height() / 4 {
        let before = row.clone();
        for x in 0..image.width() / 4 {
            let mut sum = [0.0_f32; 3];
            for (dx, dy) in [(1, 1), (2, 1), (1, 2), (2, 2)] {
                let pixel = image.get_pixel(4 * x + dx, 4 * y + dy).0;
                for k in 0..3 {
                    sum[k] += 0.25 * f32::from(pixel[k]);
                }
            }
            row[x as usize] = range.holds(sum);
            // Two in a column: a single one is noise.
            if row[x as usize] && before[x as usize] {
                (x0, x1) = (x0.min(4 * x), x1.max(4 * x + 4));
                (y0, y1) = (y0.min(4 * y), y1.max(4 * y + 4));
            }
        }
    }
    if x1 <= x0 {
        return None;
    }
    let (x0, y0) = (x0.saturating_sub(margin_px), y0.saturating_sub(4 + margin_px));
    let (x1, y1) = ((x1 + margin_px).min(image.width()), (y1 + margin_px).min(image.height()));
    Some(Window { x: x0, y: y0, width: x1 - x0, height: y1 - y0 })
}

/// At most `wanted` circles of a colour with radii within bounds, the best supported first.
pub fn circles(image: &RgbImage, window: Window, range: &ColourRange, radius_px: [f64; 2], wanted: usize) -> Vec<Circle> {
    if window.width < 8 || window.height < 8 {
        return Vec::new();
    }
    let colour = mask(image, window, range);
    let grey = GrayImage::from_fn(window.width, window.height, |x, y| {
        let [r, g, b] = image.get_pixel(window.x + x, window.y + y).0;
        Luma([((u32::from(r) * 77 + u32::from(g) * 150 + u32::from(b) * 29) >> 8) as u8])
    });
    // Where the count jumps over what is wanted, two maxima stand on one circle: a wider blur merges them.
    let mut found = Vec::new();
    for sigma in [1.4_f32, 2.0, 2.8] {
        let smooth = gaussian_blur_f32(&grey, sigma - 0.4);
        let edges = product(&canny(&smooth, 12.0, 30.0), &smooth, &colour);
        let (circles, exact) = vote(&edges, [window.width, window.height], radius_px, wanted, f64::from(sigma));
        found = circles;
        if exact {
            break;
        }
    }
    for circle in &mut found {
        circle.centre.x += f64::from(window.x) + 0.5;
        circle.centre.y += f64::from(window.y) + 0.5;
    }
    found
}

/// Canny's edges at the border of the colour, each with the direction in which the colour lies.
fn product(edges: &GrayImage, smooth: &GrayImage, colour: &GrayImage) -> Vec<Edge> {
    let (w, h) = (edges.width() as i64, edges.height() as i64);
    let mut all = Vec::new();
    for (x, y, value) in edges.enumerate_pixels() {
        if value.0[0] == 0 {
            continue;
        }
        let (mut sx, mut sy, mut count) = (0.0_f32, 0.0_f32, 0_u32);
        for dy in -3_i64..=3 {
            for dx in -3_i64..=3 {
                let (px, py) = (i64::from(x) + dx, i64::from(y) + dy);
                if px >= 0 && py >= 0 && px < w && py < h && colour.get_pixel(px as u32, py as u32).0[0] > 0 {
                    sx += dx as f32;
                    sy += dy as f32;
                    count += 1;
                }
            }
        }
        let length = sx.hypot(sy);
        // The border of a half plane: neither alone nor amidst the colour.
        if (5..=42).contains(&count) && length > 12.0 {
            // The gradient says the direction better than the mask does; the mask says which way is in.
            let (gx, gy) = gradient(smooth, x, y);
            let slope = gx.hypot(gy);
            let along = (gx * sx + gy * sy) / (slope * length).max(1e-6);
            if along.abs() > 0.7 {
                let sign = along.signum() / slope;
                all.push(Edge { x: x as f32, y: y as f32, inward: [gx * sign, gy * sign] });
            }
        }
    }
    all
}

/// Sobel's gradient.
fn gradient(image: &GrayImage, x: u32, y: u32) -> (f32, f32) {
    let (w, h) = (i64::from(image.width()) - 1, i64::from(image.height()) - 1);
    let v = |dx: i64, dy: i64| {
        f32::from(image.get_pixel((i64::from(x) + dx).clamp(0, w) as u32, (i64::from(y) + dy).clamp(0, h) as u32).0[0])
    };
    let gx = v(1, -1) + 2.0 * v(1, 0) + v(1, 1) - v(-1, -1) - 2.0 * v(-1, 0) - v(-1, 1);
    let gy = v(-1, 1) + 2.0 * v(0, 1) + v(1, 1) - v(-1, -1) - 2.0 * v(0, -1) - v(1, -1);
    (gx, gy)
}

fn vote(edges: &[Edge], size: [u32; 2], radius_px: [f64; 2], wanted: usize, sigma: f64) -> (Vec<Circle>, bool) {
    // The centre may lie outside the window.
    let margin = radius_px[1].ceil() as i64 + 2;
    let (w, h) = (i64::from(size[0]) + 2 * margin, i64::from(size[1]) + 2 * margin);
    let mut plane = vec![0.0_f32; (w * h) as usize];
    for edge in edges {
        // The direction is good to some degrees: a short bar across it.
        for step in 0..=(radius_px[1] - radius_px[0]).ceil() as i64 {
            let r = radius_px[0] as f32 + step as f32;
            for bar in [-0.08_f32, -0.04, 0.0, 0.04, 0.08] {
                let x = edge.x + r * (edge.inward[0] - bar * edge.inward[1]);
                let y = edge.y + r * (edge.inward[1] + bar * edge.inward[0]);
                let (x, y) = (x.round() as i64 + margin, y.round() as i64 + margin);
                if x >= 0 && y >= 0 && x < w && y < h {
                    plane[(y * w + x) as usize] += 1.0;
                }
            }
        }
    }
    let plane = crate::picture::Plane { width: w as usize, height: h as usize, values: plane }.blurred(sigma);
    let peaks = peaks(&plane, radius_px[0]);
    let (kept, exact) = bisect(&peaks, wanted);
    let circles = kept
        .iter()
        .map(|(_, x, y)| Point2::new((*x - margin) as f64, (*y - margin) as f64))
        .filter_map(|centre| radius_of(edges, centre, radius_px))
        .collect();
    (circles, exact)
}

/// Local maxima of the accumulator, none nearer to a higher one than half the least radius.
fn peaks(plane: &crate::picture::Plane, least_radius_px: f64) -> Vec<(f32, i64, i64)> {
    let mut all = Vec::new();
    for y in 1..plane.height as i64 - 1 {
        for x in 1..plane.width as i64 - 1 {
            let own = plane.values[y as usize * plane.width + x as usize];
            if own > 0.5
                && own >= plane.at(x + 1, y)
                && own > plane.at(x - 1, y)
                && own >= plane.at(x, y + 1)
                && own > plane.at(x, y - 1)
            {
                all.push((own, x, y));
            }
        }
    }
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut kept: Vec<(f32, i64, i64)> = Vec::new();
    for peak in all {
        let apart = |other: &(f32, i64, i64)| ((other.1 - peak.1) as f64).hypot((other.2 - peak.2) as f64) > 0.5 * least_radius_px;
        if kept.iter().all(apart) {
            kept.push(peak);
        }
        if kept.len() > 40 {
            break;
        }
    }
    kept
}

/// The threshold above which exactly `wanted` maxima stand, by bisection; `false` if there is no such threshold.
fn bisect(peaks: &[(f32, i64, i64)], wanted: usize) -> (Vec<(f32, i64, i64)>, bool) {
    let count = |threshold: f32| peaks.iter().filter(|peak| peak.0 > threshold).count();
    let (mut low, mut high) = (0.0_f32, peaks.first().map_or(1.0, |peak| peak.0));
    for _ in 0..24 {
        let middle = 0.5 * (low + high);
        match count(middle).cmp(&wanted) {
            std::cmp::Ordering::Equal => {
                return (peaks.iter().filter(|peak| peak.0 > middle).copied().collect(), true);
            }
            std::cmp::Ordering::Greater => low = middle,
            std::cmp::Ordering::Less => high = middle,
        }
    }
    (peaks.iter().take(wanted).copied().collect(), count(low) < wanted)
}

/// The radius on which most edges lie that point at a centre, and how much of the circle they cover.
fn radius_of(edges: &[Edge], centre: Point2<f64>, radius_px: [f64; 2]) -> Option<Circle> {
    let first = radius_px[0].floor() - 2.0;
    let bins = (radius_px[1] - first).ceil() as usize + 4;
    let mut counts = vec![0.0_f64; bins];
    let mut sectors = vec![0_u128; bins];
    for edge in edges {
        let to = [centre.x - f64::from(edge.x), centre.y - f64::from(edge.y)];
        let distance = to[0].hypot(to[1]);
        let towards = to[0] * f64::from(edge.inward[0]) + to[1] * f64::from(edge.inward[1]);
        if distance < first || distance >= first + bins as f64 - 1.0 || towards < 0.9 * distance {
            continue;
        }
        let bin = (distance - first) as usize;
        counts[bin] += 1.0 / distance;
        let sector = ((to[1].atan2(to[0]) + std::f64::consts::PI) / std::f64::consts::TAU * 72.0) as usize % 72;
        sectors[bin] |= 1 << sector;
    }
    let triple = |k: usize| counts[k - 1] + counts[k] + counts[k + 1];
    let best = (1..bins - 1).max_by(|a, b| triple(*a).total_cmp(&triple(*b)))?;
    let mass = triple(best);
    if mass <= 0.0 {
        return None;
    }
    let offset = (counts[best + 1] - counts[best - 1]) / mass;
    let covered = (sectors[best - 1] | sectors[best] | sectors[best + 1]).count_ones();
    Some(Circle { centre, radius_px: first + best as f64 + 0.5 + offset, support: f64::from(covered) / 72.0 })
}
