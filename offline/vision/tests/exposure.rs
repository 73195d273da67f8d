//! Exposure by the smear of rims, on made-up rims.

use vision::exposure::{RimWidth, estimate};

/// Rims of 8 frames and 6 circles that move at 150 px/s in turning directions; `exposure_s` by frame.
fn rims(exposure_s: impl Fn(usize) -> f64) -> Vec<RimWidth> {
    let mut state = 1_u64;
    let mut noise = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        f64::from((state >> 40) as u32 % 1000) / 1000.0 - 0.5
    };
    let mut all = Vec::new();
    for frame in 0..8 {
        for group in 0..6 {
            let heading = 0.4 * frame as f64 + group as f64;
            for k in 0..100 {
                let angle = f64::from(k) * std::f64::consts::TAU / 100.0;
                let (y, x) = angle.sin_cos();
                let speed = 150.0 * (angle - heading).cos();
                // Wider across the image than along it, and on one side: the lens and the light, not the motion.
                let own = 1.2 + 0.3 * (x * x - y * y) + 0.2 * x + 0.1 * group as f64;
                let variance = own + (speed * exposure_s(frame)).powi(2) / 12.0 + 0.3 * noise();
                let width_px = (0.8416 * variance.sqrt()) as f32;
                all.push(RimWidth { frame, group, normal: [x as f32, y as f32], width_px, speed_px_s: speed as f32 });
            }
        }
    }
    all
}

#[test]
fn smear_along_the_motion_gives_the_exposure() {
    let found = estimate(&rims(|_| 0.015), 8, 6).expect("an exposure");
    assert!((found.typical_s - 0.015).abs() < 0.001, "{found:?}");
    assert!(found.different_s.is_empty(), "{found:?}");
}

#[test]
fn rims_wide_for_other_reasons_give_none() {
    assert!(estimate(&rims(|_| 0.0), 8, 6).is_none());
}

#[test]
fn a_frame_of_another_exposure_is_told_apart() {
    let found = estimate(&rims(|frame| if frame == 7 { 0.0 } else { 0.015 }), 8, 6).expect("an exposure");
    assert!((found.typical_s - 0.015).abs() < 0.0015, "{found:?}");
    assert!(found.different_s.len() == 1 && found.different_s[0].0 == 7 && found.different_s[0].1 < 0.007, "{found:?}");
}
