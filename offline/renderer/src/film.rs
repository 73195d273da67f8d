//! From light to an image file's pixels: blur, tint, curve, noise, eight bits.

use crate::backdrop::Plate;
use crate::random::Random;
use crate::scene::Scene;
use image::RgbImage;

/// Normal numbers to draw noise from: fresh ones for each pixel would take longer than the rays.
pub(crate) struct Grain(Vec<f32>);

impl Grain {
    pub(crate) fn new() -> Self {
        let mut random = Random::new(0, 9);
        Self((0..1 << 16).map(|_| random.normal() as f32).collect())
    }
}

/// Blurred by a Gaussian.
pub(crate) fn blurred(plate: &Plate, sigma_px: f64) -> Plate {
    if sigma_px < 0.05 {
        return plate.clone();
    }
    let reach = (3.0 * sigma_px).ceil() as i64;
    let weights: Vec<f32> = (-reach..=reach).map(|k| (-0.5 * (k as f64 / sigma_px).powi(2)).exp() as f32).collect();
    let total: f32 = weights.iter().sum();
    let (w, h) = (plate.width as i64, plate.height as i64);
    // A whole row at a time, shifted: rows beyond the border are the border's.
    let pass = |from: &[[f32; 3]], dx: i64, dy: i64| -> Vec<[f32; 3]> {
        let mut to = vec![[0.0_f32; 3]; from.len()];
        for (y, row) in to.chunks_exact_mut(plate.width).enumerate() {
            for (k, weight) in weights.iter().enumerate() {
                let (step, weight) = (k as i64 - reach, weight / total);
                let other = (y as i64 + dy * step).clamp(0, h - 1) * w;
                let line = &from[other as usize..(other + w) as usize];
                let shift = dx * step;
                let (least, most) = ((-shift).clamp(0, w), (w - shift).clamp(0, w));
                let mut add = |x: i64, own: &[f32; 3]| (0..3).for_each(|c| row[x as usize][c] += weight * own[c]);
                (0..least).for_each(|x| add(x, &line[0]));
                (most..w).for_each(|x| add(x, &line[(w - 1) as usize]));
                let inner = row[least as usize..most as usize].iter_mut();
                for (own, value) in inner.zip(&line[(least + shift) as usize..(most + shift) as usize]) {
                    (0..3).for_each(|c| own[c] += weight * value[c]);
                }
            }
        }
        to
    };
    let across = pass(&plate.light, 1, 0);
    Plate { width: plate.width, height: plate.height, light: pass(&across, 0, 1) }
}

/// The image that the sensor makes of light that has gone through the lens.
pub(crate) fn developed(plate: &Plate, scene: &Scene, grain: &Grain, random: &mut Random) -> RgbImage {
    let tint = scene.tint.map(|v| v as f32);
    let (power, noise) = (1.0 / scene.gamma as f32, scene.noise as f32);
    let mut raw = Vec::with_capacity(3 * plate.light.len());
    for light in &plate.light {
        let bits = random.bits();
        for c in 0..3 {
            let value = (light[c] * tint[c]).clamp(0.0, 1.0);
            let curved = if power == 1.0 { value } else { value.powf(power) };
            let drawn = grain.0[(bits >> (16 * c)) as usize & 0xffff];
            raw.push((255.0 * curved + noise * drawn + 0.5).clamp(0.0, 255.0) as u8);
        }
    }
    // As many bytes as the image has.
    RgbImage::from_raw(plate.width as u32, plate.height as u32, raw).unwrap_or_default()
}
