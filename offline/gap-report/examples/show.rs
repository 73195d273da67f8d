//! `cargo run --release -p ravenpose-gap-report --example show OUT_DIR`: the two reports of the specification and one of every
//! other kind, with made-up pictures, to look at; their words go to the terminal.

#[path = "../tests/common/mod.rs"]
mod common;

use std::path::Path;

use gap_report::{BeforeAfter, Channel, HeatMap, HeatRun, Pictures, Quantity, Share, Signature, Spectrum, check, words, write};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let out = std::env::args().nth(1).ok_or("usage: show OUT_DIR")?;
    for (name, report) in common::all() {
        let folder = Path::new(&out).join(name);
        let pictures = match name {
            "explained" => pictures(true),
            "none" => pictures(false),
            _ => Pictures::default(),
        };
        write(&report, &pictures, &folder)?;
        println!("{}:\n\n{}", folder.join("report.html").display(), words(&report));
        for violation in check(&report) {
            println!("  {violation}");
        }
    }
    Ok(())
}

/// Numbers that look random, from -1 to 1, the same every time (xorshift).
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// About normal, of deviation 1.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.next()).sum::<f64>() / 2.0
    }
}

fn pictures(mismatch: bool) -> Pictures {
    let mut noise = Noise(0x9e37_79b9_7f4a_7c15);
    let heat = vec![
        heat(Channel::JointTorque, &["shoulder", "elbow", "insertion"], if mismatch { 4.9 } else { 0.1 }, &mut noise),
        heat(Channel::EndEffector, &["x", "y", "z"], if mismatch { 1.7 } else { 0.05 }, &mut noise),
    ];
    if !mismatch {
        return Pictures { heat, ..Pictures::default() };
    }
    let share = |joint: &str, regime: &str, share| Share {
        channel: Channel::JointTorque,
        joint: joint.to_owned(),
        regime: regime.to_owned(),
        share,
    };
    let shares = vec![
        share("insertion", "constant offset with the sign of velocity", 0.62),
        share("insertion", "within 40 ms of a reversal", 0.19),
        share("elbow", "", 0.12),
        share("shoulder", "", 0.07),
    ];
    let spectra = vec![spectrum(&mut noise)];
    Pictures { heat, shares, signatures: vec![friction(&mut noise), delay(&mut noise)], before_after: runs(&mut noise), spectra }
}

fn heat(channel: Channel, rows: &[&str], strength: f64, noise: &mut Noise) -> HeatMap {
    let run = |i: usize, noise: &mut Noise| {
        let values = (0..rows.len()).map(|row| {
            (0..120)
                .map(|bin| {
                    let moving = (0.5 + 0.5 * (f64::from(bin) * 0.21 + i as f64).sin()).powi(2);
                    let of_row = if row == 2 { 1.0 } else { 0.12 * (row + 1) as f64 };
                    let masked = i == 2 && (40..46).contains(&bin);
                    if masked { f64::NAN } else { (1.0 + 0.08 * noise.normal() + strength * of_row * moving).abs() }
                })
                .collect()
        });
        HeatRun { run: format!("run-0{}", i + 1), start_s: 0.0, bin_s: 0.5, values: values.collect() }
    };
    HeatMap { channel, rows: rows.iter().map(|row| (*row).to_owned()).collect(), runs: (0..5).map(|i| run(i, noise)).collect() }
}

fn friction(noise: &mut Noise) -> Signature {
    let velocity: Vec<f64> = (0..1200).map(|i| 0.04 * (f64::from(i) * 0.137).sin()).collect();
    let side = |v: f64| (v / 4e-4).tanh();
    let before = velocity.iter().map(|v| (*v, 12.1 * side(*v) + 2.7 * noise.normal())).collect();
    let after = velocity.iter().map(|v| (*v, 2.9 * noise.normal())).collect();
    let half = |sign: f64| vec![(sign * 0.0008, sign * 12.1), (sign * 0.04, sign * 12.1)];
    let band = |sign: f64| {
        vec![(sign * 0.0008, sign * 12.1 - 0.8, sign * 12.1 + 0.8), (sign * 0.04, sign * 12.1 - 0.8, sign * 12.1 + 0.8)]
    };
    Signature {
        effect: 1,
        feature: Quantity::new("Velocity of the insertion joint", "m/s"),
        error: Quantity::new("Force error, insertion", "N"),
        before,
        after,
        curve: vec![half(-1.0), half(1.0)],
        band: vec![band(-1.0), band(1.0)],
        caption: "The error jumps by 24 N where the motion reverses and is flat on both sides: dry friction.".to_owned(),
    }
}

fn delay(noise: &mut Noise) -> Signature {
    let points: Vec<(f64, f64)> = (1..120).map(|i| f64::from(i) / 30.0).map(|f| (f, -8.3 * f + 1.5 * noise.normal())).collect();
    Signature {
        effect: 2,
        feature: Quantity::new("Frequency", "Hz"),
        error: Quantity::new("Phase of the camera behind the motor", "°"),
        after: points.iter().map(|(f, _)| (*f, 1.5 * noise.normal())).collect(),
        before: points,
        curve: vec![vec![(0.0, 0.0), (4.0, -33.2)]],
        band: vec![vec![(0.0, 0.0, 0.0), (4.0, -35.0, -31.5)]],
        caption: "The phase falls in proportion to frequency, equally on all axes: a pure delay.".to_owned(),
    }
}

fn runs(noise: &mut Noise) -> Vec<BeforeAfter> {
    let t_s: Vec<f64> = (0..6000).map(|i| f64::from(i) * 0.01).collect();
    let side = |t: f64| ((0.9 * t).sin() / 0.03).tanh();
    let force = t_s.iter().map(|t| 12.1 * side(*t) + 2.7 * noise.normal()).collect();
    let force_after = t_s.iter().map(|t| 1.4 * (0.31 * t).sin() + 2.75 * noise.normal()).collect();
    let tip = t_s.iter().map(|t| 2.0e-3 * (1.1 * t).cos() + 0.74e-3 * noise.normal()).collect();
    let tip_after = t_s.iter().map(|t| 0.8e-3 * (0.4 * t).sin() + 0.74e-3 * noise.normal()).collect();
    let both = |effect, name: &str, unit: &str, before, after, floor| BeforeAfter {
        effect: Some(effect),
        run: "run-04".to_owned(),
        error: Quantity::new(name, unit),
        t_s: t_s.clone(),
        before,
        after,
        noise_floor: Some(floor),
    };
    vec![
        both(1, "Force error, insertion", "N", force, force_after, 2.7),
        both(2, "Tool position error, x", "m", tip, tip_after, 0.74e-3),
    ]
}

fn spectrum(noise: &mut Noise) -> Spectrum {
    let frequency_hz: Vec<f64> = (0..200).map(|i| 0.1 * 10_f64.powf(f64::from(i) / 199.0 * 2.6)).collect();
    let mut of = |size: f64| -> Vec<f64> {
        frequency_hz
            .iter()
            .map(|f| size / (1.0 + f * f) * (0.2 * noise.normal()).exp() + 0.02 * (0.2 * noise.normal()).exp())
            .collect()
    };
    Spectrum {
        effect: None,
        error: Quantity::new("force error, insertion", "N"),
        before: of(8.0),
        after: of(0.6),
        noise_floor: of(0.3),
        frequency_hz: frequency_hz.clone(),
    }
}
