//! Tidy CSV, compressed, without a byte that tells when or how it was made.

use crate::arm::Arm;
use crate::controller::RATE;
use crate::run::Signals;
use flate2::{Compression, GzBuilder};
use std::fmt::Write as _;
use std::io::Write as _;

/// Samples between two frames of the tip in a recording.
pub const FRAME: usize = 20;

/// The bytes of a `.csv.gz`. `every_row`: the tip stands in every row, as a simulator has it; otherwise it comes at 50 Hz.
///
/// # Errors
///
/// Those of the compressor.
pub fn csv_gz(signals: &Signals, arm: &Arm, every_row: bool) -> std::io::Result<Vec<u8>> {
    let text = csv(signals, arm, every_row);
    let mut gz = GzBuilder::new().mtime(0).write(Vec::new(), Compression::new(3));
    gz.write_all(text.as_bytes())?;
    gz.finish()
}

fn csv(signals: &Signals, arm: &Arm, every_row: bool) -> String {
    let samples = signals.tip.len();
    let mut text = String::with_capacity(samples * (60 + 70 * arm.size()));
    let _ = write!(text, "# robot = {}\n# sample_hz = {RATE}\nt_s", arm.name);
    let joints: Vec<(usize, &str)> = arm.joints.iter().enumerate().map(|(j, joint)| (j + 1, joint.motion.unit())).collect();
    let mut name = |start: &str, end: &dyn Fn(&str) -> String| {
        for (j, unit) in &joints {
            let _ = write!(text, ",{start}_{j}_{}", end(unit));
        }
    };
    name("mpos", &|_| "rad".into());
    name("mvel", &|_| "rad_s".into());
    name("tau", &|_| "nm".into());
    name("jpos", &|unit| unit.into());
    name("jpos_d", &|unit| unit.into());
    name("truth_jpos", &|unit| unit.into());
    text.push_str(",x_mm,y_mm,z_mm,truth_x_mm,truth_y_mm,truth_z_mm\n");
    for k in 0..samples {
        decimal(&mut text, k as f64 / RATE, 4);
        let mut row = |values: &mut dyn Iterator<Item = f64>, digits: usize| {
            for value in values {
                text.push(',');
                decimal(&mut text, value, digits);
            }
        };
        row(&mut signals.motor[k].iter().copied(), 6);
        row(&mut signals.motor_speed[k].iter().copied(), 6);
        row(&mut signals.torque[k].iter().copied(), 6);
        row(&mut signals.motor[k].iter().zip(&arm.drives).map(|(m, drive)| m / drive.ratio), 7);
        row(&mut signals.command[k].iter().copied(), 7);
        row(&mut signals.joint[k].iter().copied(), 7);
        row(&mut signals.reported_tip[k].iter().map(|x| x * 1e3), 4);
        if !every_row && !k.is_multiple_of(FRAME) {
            text.push_str(",,,\n");
        } else {
            row(&mut signals.tip[k].iter().map(|x| x * 1e3), 4);
            text.push('\n');
        }
    }
    text
}

/// A number with fixed decimals. Much faster than `format!`, which would be half of a case's time.
fn decimal(text: &mut String, value: f64, digits: usize) {
    const POWERS: [f64; 8] = [1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7];
    let scaled = (value * POWERS[digits]).round();
    let mut number = scaled.abs() as u64;
    let mut bytes = [b'0'; 24];
    let mut at = bytes.len();
    let mut written = 0;
    while number > 0 || written <= digits {
        if written == digits && digits > 0 {
            at -= 1;
            bytes[at] = b'.';
        }
        at -= 1;
        bytes[at] = b'0' + (number % 10) as u8;
        number /= 10;
        written += 1;
    }
    if scaled < 0.0 {
        text.push('-');
    }
    for byte in &bytes[at..] {
        text.push(char::from(*byte));
    }
}

#[cfg(test)]
mod tests {
    use super::decimal;

    #[test]
    fn decimals_are_those_of_format() {
        for value in [0.0, 1.0, -1.0, 0.123_456_7, -0.000_001, 467.077_859, -0.05, 99.999_999_9, 0.6e-7, 1e-9] {
            for digits in [4, 6, 7] {
                let mut text = String::new();
                decimal(&mut text, value, digits);
                let plain = format!("{value:.digits$}");
                let zero = plain.trim_start_matches('-').bytes().all(|b| b == b'0' || b == b'.');
                assert!(text == plain || (zero && text == plain.trim_start_matches('-')), "{text} {plain}");
            }
        }
    }
}
