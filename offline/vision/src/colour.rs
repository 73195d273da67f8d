//! What the balls' colours look like in a recording, learnt from the recording itself.
//!
//! A colour is a range of hue with a least chroma. Hues are the peaks of the recording's own histogram next to the named colours, so
//! that tinted light shifts the ranges with it; chroma is told from the noise of what is grey.

use image::RgbImage;

/// Colour names that a fixture may use.
pub const NAMES: [&str; 7] = ["red", "orange", "yellow", "green", "cyan", "blue", "magenta"];

/// How far a hue may be from that under white light, degrees.
const SHIFT_DEG: f64 = 32.0;
/// Widest half range of a colour, degrees.
const HALF_RANGE_DEG: f64 = 26.0;

/// Hue of a named colour under white light, degrees.
pub fn nominal_hue_deg(name: &str) -> Option<f64> {
    let hues = [0.0, 28.0, 55.0, 130.0, 185.0, 225.0, 310.0];
    NAMES.iter().position(|own| *own == name).map(|k| hues[k])
}

/// One ball's colour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColourRange {
    /// Middle of the range, degrees.
    pub hue_deg: f64,
    /// How far below and above it the range goes, degrees.
    pub half_deg: [f64; 2],
    /// Least chroma (largest minus smallest channel), grey levels.
    pub chroma: f32,
    /// Factors of red, green, blue that make grey things grey in this light.
    pub balance: [f32; 3],
}

/// Hue in degrees and chroma in grey levels.
pub fn hue_chroma(rgb: [f32; 3]) -> (f64, f32) {
    let [r, g, b] = rgb;
    let (most, least) = (r.max(g).max(b), r.min(g).min(b));
    let chroma = most - least;
    if chroma <= 0.0 {
        return (0.0, 0.0);
    }
    let sector = if most == r {
        ((g - b) / chroma).rem_euclid(6.0)
    } else if most == g {
        (b - r) / chroma + 2.0
    } else {
        (r - g) / chroma + 4.0
    };
    (f64::from(sector) * 60.0, chroma)
}

/// Signed difference of two hues, degrees, -180 to 180.
pub fn hue_difference(a_deg: f64, b_deg: f64) -> f64 {
    (a_deg - b_deg + 180.0).rem_euclid(360.0) - 180.0
}

impl ColourRange {
    /// Is a colour in the range?
    pub fn holds(&self, rgb: [f32; 3]) -> bool {
        let (hue, chroma) = hue_chroma(balanced(rgb, self.balance));
        let off = hue_difference(hue, self.hue_deg);
        chroma >= self.chroma && off >= -self.half_deg[0] && off <= self.half_deg[1]
    }
}

fn balanced(rgb: [f32; 3], balance: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|k| rgb[k] * balance[k])
}

/// Factors by which most of what is seen becomes grey: medians of red and blue against green. The balls are a small part of it.
fn white_balance(pixels: &[[f32; 3]]) -> [f32; 3] {
    // In dim light the brighter half says it; what is nearly black says nothing.
    let mut sums: Vec<f32> = pixels.iter().map(|rgb| rgb.iter().sum()).collect();
    let middle = sums.len() / 2;
    let median = if sums.is_empty() { 0.0 } else { *sums.select_nth_unstable_by(middle, f32::total_cmp).1 };
    let least = median.clamp(18.0, 60.0);
    let lit: Vec<&[f32; 3]> = pixels.iter().filter(|rgb| rgb.iter().sum::<f32>() > least && rgb[1] > 4.0).collect();
    if lit.len() * 20 < pixels.len() {
        return [1.0; 3];
    }
    let ratio = |k: usize| {
        let mut all: Vec<f32> = lit.iter().map(|rgb| rgb[1] / rgb[k].max(1.0)).collect();
        let middle = all.len() / 2;
        let (_, median, _) = all.select_nth_unstable_by(middle, f32::total_cmp);
        median.clamp(0.33, 3.0)
    };
    let (red, blue) = (ratio(0), ratio(2));
    let mean = (red + 1.0 + blue) / 3.0;
    [red / mean, 1.0 / mean, blue / mean]
}

/// Pixels of a thinned image, 2 x 2 of them averaged: noise halves, edges stay few.
fn thinned(image: &RgbImage) -> impl Iterator<Item = [f32; 3]> + '_ {
    (0..image.height() / 4).flat_map(move |y| {
        (0..image.width() / 4).map(move |x| {
            let mut sum = [0.0; 3];
            for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let pixel = image.get_pixel(4 * x + dx, 4 * y + dy).0;
                for k in 0..3 {
                    sum[k] += 0.25 * f32::from(pixel[k]);
                }
            }
            sum
        })
    })
}

/// Learns the ranges of named colours from some images of a recording.
pub fn learn<'a>(names: &[String; 3], images: impl Iterator<Item = &'a RgbImage>) -> [ColourRange; 3] {
    let colours: Vec<[f32; 3]> = images.flat_map(thinned).collect();
    let balance = white_balance(&colours);
    let mut pixels = Vec::new();
    let mut chromas = vec![0_u32; 256];
    for rgb in colours {
        let (hue, chroma) = hue_chroma(balanced(rgb, balance));
        chromas[(chroma as usize).min(255)] += 1;
        if chroma > 8.0 {
            pixels.push((hue, chroma));
        }
    }
    let grey = grey_chroma(&chromas);
    let mut histogram = vec![0.0_f64; 360];
    for (hue, chroma) in pixels.iter().filter(|(_, chroma)| *chroma > grey) {
        histogram[(*hue as usize) % 360] += f64::from(*chroma);
    }
    let smooth: Vec<f64> = (0..360_i32)
        .map(|k| (-8..=8).map(|d: i32| histogram[(k + d).rem_euclid(360) as usize] * f64::from(9 - d.abs())).sum())
        .collect();
    let nominal: [f64; 3] = std::array::from_fn(|k| nominal_hue_deg(&names[k]).unwrap_or(0.0));
    let peaks = nominal.map(|hue| peak(&smooth, hue));
    std::array::from_fn(|k| {
        let half = |side: f64| {
            let gap = (0..3)
                .filter(|other| *other != k)
                .map(|other| side * hue_difference(peaks[other], peaks[k]))
                .map(|gap| if gap < 0.0 { gap + 360.0 } else { gap })
                .fold(360.0, f64::min);
            (0.48 * gap).min(HALF_RANGE_DEG)
        };
        let mut range = ColourRange { hue_deg: peaks[k], half_deg: [half(-1.0), half(1.0)], chroma: grey, balance };
        let mut own: Vec<f32> = pixels
            .iter()
            .filter(|(hue, chroma)| {
                let off = hue_difference(*hue, range.hue_deg);
                *chroma > grey && off > -range.half_deg[0] && off < range.half_deg[1]
            })
            .map(|(_, chroma)| *chroma)
            .collect();
        own.sort_by(f32::total_cmp);
        // Shaded sides have a good part of the chroma of the lit ones.
        let typical = own.get(own.len() / 2).copied().unwrap_or(grey);
        range.chroma = grey.max(0.3 * typical);
        range
    })
}

/// Chroma that hardly any grey pixel reaches: median plus six times the distance to the 84th percentile.
fn grey_chroma(counts: &[u32]) -> f32 {
    let total: u32 = counts.iter().sum();
    let quantile = |part: f64| {
        let mut sum = 0.0;
        counts.iter().position(|count| {
            sum += f64::from(*count);
            sum >= part * f64::from(total)
        })
    };
    let middle = quantile(0.5).unwrap_or(0) as f32;
    let upper = quantile(0.84).unwrap_or(0) as f32;
    (middle + 6.0 * (upper - middle + 1.0)).clamp(15.0, 80.0)
}

/// The highest place of a circular histogram near a hue, or the hue itself where there is nothing.
fn peak(histogram: &[f64], hue_deg: f64) -> f64 {
    let reach = SHIFT_DEG as i32;
    let near = |d: i32| histogram[(hue_deg as i32 + d).rem_euclid(360) as usize];
    let best = (-reach..=reach).max_by(|a, b| near(*a).total_cmp(&near(*b)).then(b.abs().cmp(&a.abs()))).unwrap_or(0);
    if near(best) > 0.0 { (hue_deg + f64::from(best) + 0.5).rem_euclid(360.0) } else { hue_deg }
}
