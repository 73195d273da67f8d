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
    let pass = |from: &[[f32; 3]], dx: i64, dy: i64| -> Vec<[f32; 3]> {
        let mut to = Vec::with_capacity(from.len());
        for y in 0..h {
            for x in 0..w {
                let mut sum = [0.0_f32; 3];
                for (k, weight) in weights.iter().enumerate() {
                    let step = k as i64 - reach;
                    let at = (y + dy * step).clamp(0, h - 1) * w + (x + dx * step).clamp(0, w - 1);
                    let own = from[at as usize];
                    for c in 0..3 {
                        sum[c] += weight * own[c];
                    }
                }
                to.push(sum.map(|v| v / total));
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
