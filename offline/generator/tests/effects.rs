//! Each effect shows what its equation says, and one that never comes changes nothing.

use generator::arm::{Arm, DryLaw};
use generator::effect::Effect;
use generator::lagrange::Chain;
use generator::random::Random;
use generator::robots;
use generator::run::{Robot, Signals, play};
use generator::sensors::record;
use generator::trajectory::{self, Excitation, Trajectory};
use nalgebra::{Rotation3, Vector3};
use std::f64::consts::TAU;

struct Bench {
    arm: Arm,
    model: Arm,
    trajectory: Trajectory,
    without: Signals,
}

impl Bench {
    fn new() -> Self {
        let pair = robots::raven(&mut Random::new(7, "effects"));
        let mut arm = pair.truth;
        arm.dry_law = DryLaw::Smooth(0.5);
        let trajectory = trajectory::draw(&arm, 8.0, Excitation::Teleoperation, &mut Random::new(7, "run"));
        let without = Signals::default();
        let mut bench = Self { arm, model: pair.model, trajectory, without };
        bench.without = bench.play(&[]);
        bench
    }

    fn play(&self, effects: &[Effect]) -> Signals {
        let robot = Robot { truth: &self.arm, model: &self.model, stepped: false };
        record(&play(&robot, effects, &self.trajectory), &self.arm, effects, None)
    }

    fn with(&self, physics: &str, joint: Option<usize>, parameters: &[(&str, f64)]) -> Signals {
        self.play(&[Effect::at(physics, joint, parameters)])
    }

    /// Joint-side torque added, where the joint moves steadily: (speed, added torque).
    fn added(&self, with: &Signals, j: usize) -> Vec<(f64, f64)> {
        let ratio = self.arm.drives[j].ratio;
        let speed = |k: usize| self.without.motor_speed[k][j] / ratio;
        let steady = |&k: &usize| (speed(k) - speed(k - 150)).abs() < 0.1 * speed(k).abs() && speed(k).abs() * ratio > 5.0;
        (300..with.count_all())
            .filter(steady)
            .map(|k| (speed(k), (with.torque[k][j] - self.without.torque[k][j]) * ratio))
            .collect()
    }

    /// True minus reported joint position, with the effect minus without.
    fn shifted(&self, with: &Signals, j: usize) -> Vec<f64> {
        let error = |s: &Signals, k: usize| s.joint[k][j] - s.motor[k][j] / self.arm.drives[j].ratio;
        (0..with.count_all()).map(|k| error(with, k) - error(&self.without, k)).collect()
    }
}

trait All {
    fn count_all(&self) -> usize;
}

impl All for Signals {
    fn count_all(&self) -> usize {
        self.tip.len()
    }
}

/// Slope of y over x through the origin.
fn slope(points: impl IntoIterator<Item = (f64, f64)>) -> f64 {
    let (xy, xx) = points.into_iter().fold((0.0, 0.0), |(xy, xx), (x, y)| (xy + x * y, xx + x * x));
    xy / xx
}

fn near(value: f64, wanted: f64, share: f64) {
    assert!((value - wanted).abs() <= share * wanted.abs(), "{value} instead of {wanted}");
}

fn rms(values: impl IntoIterator<Item = f64>) -> f64 {
    let (sum, count) = values.into_iter().fold((0.0, 0.0), |(sum, count), v| (sum + v * v, count + 1.0));
    f64::sqrt(sum / count)
}

#[test]
fn friction() {
    let bench = Bench::new();
    for at_link in [0.0, 1.0] {
        let mut effect = Effect::at("coulomb_friction", Some(1), &[("f_c", 2.0)]);
        effect.details.insert("at_link".into(), at_link);
        let with = bench.play(&[effect]);
        near(slope(bench.added(&with, 0).into_iter().map(|(v, t)| (v.signum(), t))), 2.0, 0.05);
        // no other joint feels it
        assert!(rms(bench.added(&with, 2).into_iter().map(|(_, t)| t)) < 0.5);
    }
    let with = bench.with("viscous_friction", Some(3), &[("b", 60.0)]);
    near(slope(bench.added(&with, 2)), 60.0, 0.05);

    let with = bench.with("stribeck_friction", Some(1), &[("f_c", 1.0), ("f_s", 2.5), ("v_s", 0.15), ("a", 2.0)]);
    for (v, torque) in bench.added(&with, 0).into_iter().filter(|(v, _)| v.abs() > 0.08) {
        let wanted = v.signum() * (1.0 + 1.5 * (-(v / 0.15) * (v / 0.15)).exp());
        assert!((torque - wanted).abs() < 0.35, "at {v} rad/s {torque} instead of {wanted}");
    }

    let with = bench.with("load_dependent_friction", Some(2), &[("f_0", 0.1), ("mu_l", 0.3)]);
    let ratio = bench.arm.drives[1].ratio;
    let points = (300..with.count_all()).filter(|&k| bench.without.motor_speed[k][1].abs() > 8.0).map(|k| {
        let sign = bench.without.motor_speed[k][1].signum();
        ((0.1 + 0.3 * bench.without.load[k][1].abs()) * sign, (with.torque[k][1] - bench.without.torque[k][1]) * ratio)
    });
    near(slope(points), 1.0, 0.08);

    let mut fading = Effect::at("thermal_drift", Some(1), &[("kappa_T", 0.5), ("T", 4.0)]);
    fading.details.insert("reference".into(), rms(bench.without.torque.iter().map(|row| row[0])));
    let with = bench.play(&[fading]);
    let lost = |from: usize, to: usize| {
        let level = bench.arm.drives[0].dry;
        let moving = (from..to).filter(|&k| bench.without.motor_speed[k][0].abs() > 8.0);
        slope(moving.map(|k| (bench.without.motor_speed[k][0].signum(), bench.without.torque[k][0] - with.torque[k][0]))) / level
    };
    let (early, late) = (lost(0, 1500), lost(6000, 8000));
    assert!(early > 0.0 && early < 0.25 && late > 0.3 && late < 0.5, "{early} {late}");
}

#[test]
fn cable() {
    let bench = Bench::new();
    let (count, load) = (bench.without.count_all(), |with: &Signals, k: usize, j: usize| with.load[k][j]);

    let with = bench.with("cable_stretch", Some(2), &[("k", 400.0)]);
    let shifted = bench.shifted(&with, 1);
    near(slope((0..count).map(|k| (load(&with, k, 1), -shifted[k]))), 1.0 / 400.0, 0.03);

    let with = bench.with("backlash", Some(3), &[("b", 1e-3)]);
    let shifted = bench.shifted(&with, 2);
    let (low, high) = shifted.iter().fold((f64::MAX, f64::MIN), |(low, high), &x| (low.min(x), high.max(x)));
    near(high - low, 1e-3, 0.15);
    // in a loaded joint play rests on the loaded side, whichever way it moves
    for k in (0..count).filter(|&k| load(&with, k, 2) > 2.0) {
        assert!((shifted[k] + 0.5e-3).abs() < 0.15e-3, "{}", shifted[k]);
    }

    let with = bench.with("cable_hysteresis", Some(2), &[("a", 0.6), ("k", 430.0), ("z_m", 2e-3), ("n", 1.0), ("g", 0.5)]);
    let shifted = bench.shifted(&with, 1);
    assert!(rms(shifted.iter().copied()) > 5e-4);
    // what goes round in a loop is lost: the work of the cable over the run exceeds that of an elastic one
    let work = |s: &Signals| {
        let stretch = |k: usize| s.motor[k][1] / bench.arm.drives[1].ratio - s.joint[k][1];
        (1..count).map(|k| s.load[k][1] * (stretch(k) - stretch(k - 1))).sum::<f64>()
    };
    assert!(work(&with) - work(&bench.without) > 1e-4, "{} {}", work(&with), work(&bench.without));

    let with = bench.with("cable_creep", Some(2), &[("J_k", 5e-4), ("T_k", 1.0)]);
    let shifted = bench.shifted(&with, 1);
    let mut slow = 0.0;
    for (k, &shifted) in shifted.iter().enumerate() {
        slow += 1e-3 * (5e-4 * load(&with, k, 1) - slow);
        if k > 5000 {
            assert!((shifted + slow).abs() < 0.1 * slow.abs() + 5e-5, "{shifted} {slow}");
        }
    }
}

#[test]
fn transmission() {
    let bench = Bench::new();
    let (count, ratio) = (bench.without.count_all(), |j: usize| bench.arm.drives[j].ratio);
    let with = bench.with("joint_offset", Some(1), &[("o", 0.01)]);
    near(bench.shifted(&with, 0).iter().sum::<f64>() / count as f64, 0.01, 0.02);

    let mut effect = Effect::at("transmission_ratio", Some(1), &[("e", 0.02)]);
    effect.details.insert("home".into(), 0.3);
    let with = bench.play(&[effect]);
    let shifted = bench.shifted(&with, 0);
    near(slope((0..count).map(|k| (with.motor[k][0] / ratio(0) - 0.3, shifted[k]))), 0.02, 0.05);

    let with = bench.with("pulley_eccentricity", Some(1), &[("e_over_r", 0.005), ("period", 0.3), ("phi", 0.7)]);
    let shifted = bench.shifted(&with, 0);
    near(slope((0..count).map(|k| ((TAU * with.motor[k][0] / ratio(0) / 0.3 + 0.7).sin(), shifted[k]))), 0.005, 0.05);

    let mut effect = Effect::at("joint_coupling", Some(2), &[("c_ij", 0.02)]);
    effect.details.insert("from".into(), 1.0);
    let with = bench.play(&[effect]);
    let shifted = bench.shifted(&with, 1);
    // the motor of joint 2 turns by c q_1 more than its joint: the joint stays behind by that much
    near(slope((0..count).map(|k| (-with.joint[k][0], shifted[k]))), 0.02, 0.05);
    // the driving joint feels the driven cable: by virtual work c times its load, which relieves its own motor
    let pull = (300..count).map(|k| (-0.02 * with.load[k][1], with.load[k][0] - bench.without.load[k][0]));
    near(slope(pull), 1.0, 0.2);
}

#[test]
fn bodies_and_motors() {
    let bench = Bench::new();
    let count = bench.without.count_all();
    let at = Vector3::new(0.02, -0.01, -0.04);
    let hold = |change: &dyn Fn(&mut Chain<3>), k: usize| {
        let mut chain = Chain::<3>::new(&bench.arm);
        let q: [f64; 3] = std::array::from_fn(|j| bench.without.joint[k][j]);
        let before = chain.posture(&q, &[0.0; 3]).gravity;
        change(&mut chain);
        let after = chain.posture(&q, &[0.0; 3]).gravity;
        std::array::from_fn::<f64, 3, _>(|j| (after[j] - before[j]) / bench.arm.drives[j].ratio)
    };
    let slow = |&k: &usize| (0..3).all(|j| (bench.without.motor_speed[k][j] - bench.without.motor_speed[k - 150][j]).abs() < 8.0);
    let with = bench.with("payload", None, &[("m_p", 0.2), ("c_x", at.x), ("c_y", at.y), ("c_z", at.z)]);
    let turned = bench.with("gravity_direction", None, &[("a", 0.1), ("b", -0.15)]);
    // About the axes of frame 0, the link `base`.
    let gravity = Rotation3::new(Vector3::new(0.1, -0.15, 0.0))
        * (generator::arm::rotation(bench.arm.mount).transpose() * generator::arm::GRAVITY);
    for (signals, change) in [
        (&with, &(|chain: &mut Chain<3>| chain.set_load(0.2, at)) as &dyn Fn(&mut Chain<3>)),
        (&turned, &|chain: &mut Chain<3>| chain.set_gravity(gravity)),
    ] {
        let points = (300..count).filter(slow).flat_map(|k| {
            let wanted: [f64; 3] = hold(change, k);
            let torque = &bench.without.torque[k];
            (0..3).map(move |j| (wanted[j], signals.torque[k][j] - torque[j]))
        });
        near(slope(points), 1.0, 0.1);
    }

    let with = bench.with("motor_torque_scale", Some(1), &[("kappa", 0.8)]);
    near(slope((300..count).filter(slow).map(|k| (with.torque[k][0], bench.without.torque[k][0]))), 0.8, 0.03);

    let with = bench.with("torque_ripple", Some(1), &[("amp", 0.7), ("order", 1.0), ("phase", 0.4)]);
    let ratio = bench.arm.drives[0].ratio;
    let points = (300..count).filter(|&k| bench.without.motor_speed[k][0].abs() > 10.0);
    let points =
        points.map(|k| ((bench.without.motor[k][0] + 0.4).sin(), (with.torque[k][0] - bench.without.torque[k][0]) * ratio));
    near(slope(points), 0.7, 0.15);
}

#[test]
fn tip_and_time() {
    let bench = Bench::new();
    let count = bench.without.count_all();
    let with = bench.with(
        "frame_misalignment",
        None,
        &[("w_x", 0.02), ("w_y", -0.01), ("w_z", 0.03), ("t_x", 1e-3), ("t_y", 0.0), ("t_z", -2e-3)],
    );
    let turn = Rotation3::new(Vector3::new(0.02, -0.01, 0.03));
    for k in (0..count).step_by(500) {
        let wanted = turn * Vector3::from(bench.without.tip[k]) + Vector3::new(1e-3, 0.0, -2e-3);
        assert!((wanted - Vector3::from(with.tip[k])).norm() < 1e-12);
        assert_eq!(with.torque[k], bench.without.torque[k]);
    }

    for (signal, late) in [("tip", 0.03), ("joint", 0.004), ("torque", 0.005), ("motor", 0.002)] {
        let mut effect = Effect::at("measurement_delay", None, &[("d", late)]);
        effect.signal = Some(signal.into());
        let with = bench.play(&[effect]);
        let shift = (late * 1000.0) as usize;
        for k in (shift..count).step_by(331) {
            let earlier = k - shift;
            let same = |a: f64, b: f64| assert!((a - b).abs() < 1e-9, "{signal}: {a} {b}");
            match signal {
                "tip" => same(with.tip[k][1], bench.without.tip[earlier][1]),
                "joint" => same(with.joint[k][1], bench.without.joint[earlier][1]),
                "torque" => same(with.torque[k][1], bench.without.torque[earlier][1]),
                _ => same(with.motor[k][1], bench.without.motor[earlier][1]),
            }
            if signal != "joint" {
                same(with.joint[k][0], bench.without.joint[k][0]);
            }
        }
    }

    // a longer tool: the tip moves along it, the joints do not
    let with = bench.with("link_geometry", Some(3), &[("d_length", 0.004)]);
    let gap = |s: &Signals, k: usize| (Vector3::from(s.tip[k]) - Vector3::from(s.reported_tip[k])).norm();
    assert!((100..count).all(|k| (gap(&with, k) - gap(&bench.without, k)).abs() < 4.1e-3));
    near(rms((0..count).map(|k| (Vector3::from(with.tip[k]) - Vector3::from(bench.without.tip[k])).norm())), 0.004, 0.02);
    assert!(rms(bench.shifted(&with, 0)) < 1e-5);

    let mut effect = Effect::at("external_contact", None, &[("f_max", 3.0)]);
    effect.details.extend([("n_x", 0.0), ("n_y", 1.0), ("n_z", 0.0)].map(|(name, value)| (name.to_owned(), value)));
    effect.interval = Some([3.0, 5.0]);
    let with = bench.play(&[effect]);
    let chain = Chain::<3>::new(&bench.arm);
    for k in (3200..4900).step_by(100) {
        let q: [f64; 3] = std::array::from_fn(|j| with.joint[k][j]);
        let torque = chain.tip_force(&q, &Vector3::new(0.0, 3.0, 0.0));
        let added = (with.torque[k][0] - bench.without.torque[k][0]) * bench.arm.drives[0].ratio;
        assert!((added + torque[0]).abs() < 0.15 * torque[0].abs() + 0.05, "{added} {}", torque[0]);
    }
    assert_eq!(with.torque[..2990], bench.without.torque[..2990], "before it comes nothing differs");
}

#[test]
fn what_never_comes_changes_nothing() {
    let bench = Bench::new();
    let one = |name: &str| (name.to_owned(), 0.5);
    for physics in generator::matrix::PHYSICS.iter().chain(&generator::matrix::OUTSIDE) {
        let mut effect = Effect::at(physics, Some(2), &[]);
        for name in
            "f_c f_s v_s a b k z_m n g J_k T_k c_ij m_p kappa amp order o e e_over_r period d w_x t_x d_alpha f_max p kappa_T T"
                .split(' ')
        {
            effect.parameters.extend([one(name)]);
        }
        effect.details.extend([
            one("reference"),
            one("mass_factor"),
            one("inertia_factor"),
            one("pretension"),
            one("cubic"),
            one("n_x"),
        ]);
        effect.details.extend([("from".to_owned(), 1.0), ("kp_factor".to_owned(), 0.5), ("kd_factor".to_owned(), 0.5)]);
        effect.signal = Some("tip".into());
        effect.interval = Some([1e6, 2e6]);
        let with = bench.play(&[effect]);
        assert_eq!(with.torque, bench.without.torque, "{physics}");
        assert_eq!(with.joint, bench.without.joint, "{physics}");
        assert_eq!(with.tip, bench.without.tip, "{physics}");
    }
}
