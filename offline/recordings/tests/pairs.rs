//! Pairs from streams whose clock, frame, noise and losses are known: recovered within the stated errors, or refused.
#![allow(missing_docs)]

mod common;
#[path = "pairs/made.rs"]
mod made;
#[path = "pairs/refusals.rs"]
mod refusals;

use common::data;
use made::{Case, Motion, Path, Random, dropped, make};
use nalgebra::{Rotation3, UnitQuaternion, Vector3};
use recordings::pairs::{
    ClockChoice, Interpolation, Limits, Options, Pair, PairError, Reason, RegistrationChoice, Reported, Truth, pair, register,
    sample,
};
use recordings::{Column, Recording};

/// Share of 95 % intervals that hold the true value, per parameter, over seeds.
fn coverage(cases: impl Iterator<Item = Case>) -> [f64; 8] {
    let (mut inside, mut count) = ([0.0; 8], 0.0);
    for case in cases {
        let run = make(&case);
        let paired = run.pair(&Options::default()).unwrap_or_else(|error| panic!("seed {}: {error}", case.seed));
        let deviations = run.deviations(&paired);
        for (inside, deviation) in inside.iter_mut().zip(deviations) {
            *inside += f64::from(u8::from(deviation.abs() <= 1.96));
        }
        count += 1.0;
    }
    inside.map(|inside| inside / count)
}

#[test]
fn clock_drift_and_frame_come_back_within_their_stated_errors() {
    let cases = (0..120).map(|seed| {
        let mut random = Random(seed + 900);
        Case {
            seed,
            duration_s: 40.0,
            state_hz: if seed % 2 == 0 { 1000.0 } else { 100.0 },
            truth_hz: [15.0, 25.0, 50.0][seed as usize % 3],
            offset_s: random.between(-4.5, 4.5),
            drift: random.between(-2e-4, 2e-4),
            ..Case::default()
        }
    });
    let shares = coverage(cases);
    println!("white noise: share of 95 % intervals that hold the value, offset, drift, rotation 3, middle 3: {shares:.3?}");
    let mean = shares.iter().sum::<f64>() / 8.0;
    assert!((0.92..=0.98).contains(&mean), "{mean}");
    assert!(shares.iter().all(|share| *share >= 0.88), "{shares:?}");
}

#[test]
fn a_slow_error_of_the_arm_widens_the_stated_errors() {
    let case = |seed| Case { seed, duration_s: 240.0, arm_error_m: 2e-3, arm_error_s: 1.0, state_hz: 100.0, ..Case::default() };
    let shares = coverage((0..100).map(case));
    println!("arm error 2 mm over 1 s: share of 95 % intervals that hold the value: {shares:.3?}");
    assert!(shares.iter().all(|share| *share >= 0.82), "{shares:?}");
    let white = make(&Case { duration_s: 240.0, state_hz: 100.0, noise_m: 2.06e-3, ..Case::default() });
    let white = white.pair(&Options::default()).expect("white");
    let slow = make(&case(1)).pair(&Options::default()).expect("slow");
    let ratio = slow.report.clock.offset_sd_s / white.report.clock.offset_sd_s;
    println!("standard error of the offset: {ratio:.1} times that of white noise of the same size");
    assert!(ratio > 1.5, "{ratio}");
    let noise = slow.report.label.noise_sd_m;
    assert!(
        noise.iter().all(|noise| (0.4e-3..1.1e-3).contains(noise)),
        "the frame-to-frame noise is not the arm's error: {noise:?}"
    );
}

#[test]
fn outliers_and_lost_frames_are_named_and_change_nothing() {
    for seed in 0..20 {
        let case = Case { seed, lost: 0.1, wrong: 0.08, arm_error_m: 1.5e-3, ..Case::default() };
        let run = make(&case);
        let paired = run.pair(&Options::default()).unwrap_or_else(|error| panic!("seed {seed}: {error}"));
        assert_eq!(dropped(&paired, Reason::LostFrame), run.lost, "seed {seed}");
        let named = run.wrong.iter().filter(|&&frame| paired.fates[frame] == Some(Reason::Outlier)).count();
        assert!(named * 100 >= run.wrong.len() * 97, "seed {seed}: {named} of {} outliers were named", run.wrong.len());
        let falsely = dropped(&paired, Reason::Outlier) - named;
        assert!(falsely * 100 <= run.truth.t_s.len(), "seed {seed}: {falsely} good frames were called outliers");
        assert!(
            run.deviations(&paired).iter().all(|deviation| deviation.abs() < 4.5),
            "seed {seed}: {:?}",
            run.deviations(&paired)
        );
        let taken: usize = paired.report.dropped.iter().map(|dropped| dropped.frames).sum();
        assert_eq!(taken + paired.pairs.len(), run.truth.t_s.len());
    }
}

#[test]
fn a_drift_over_two_hours_is_found() {
    // As long as the paper's data set; the drift alone moves the ends apart by 1.5 s.
    let case = Case {
        duration_s: 8400.0,
        state_hz: 100.0,
        offset_s: 3.2,
        drift: 180e-6,
        arm_error_m: 3e-3,
        arm_error_s: 5.0,
        lost: 0.05,
        wrong: 0.01,
        ..Case::default()
    };
    let run = make(&case);
    let begun = std::time::Instant::now();
    let paired = run.pair(&Options::default()).expect("pairs");
    println!("{} states and {} frames in {:.1} s", run.t_s.len(), run.truth.t_s.len(), begun.elapsed().as_secs_f64());
    println!("{}", paired.report);
    assert!(paired.report.clock.drift_fitted);
    assert!(run.deviations(&paired).iter().all(|deviation| deviation.abs() < 4.0), "{:?}", run.deviations(&paired));
    assert!((paired.report.clock.drift_ppm - 180.0).abs() < 3.0);
    let last = paired.pairs.last().expect("pairs");
    let true_time_s = run.clock.state_time_s(last.truth_time_s);
    assert!((last.state_time_s - true_time_s).abs() < 5e-3, "at the end: {} against {true_time_s}", last.state_time_s);
}

#[test]
fn a_quarter_of_wrong_positions_does_no_harm() {
    for seed in 0..10 {
        let run = make(&Case { seed, wrong: 0.25, ..Case::default() });
        let paired = run.pair(&Options::default()).unwrap_or_else(|error| panic!("seed {seed}: {error}"));
        assert!(
            run.deviations(&paired).iter().all(|deviation| deviation.abs() < 4.5),
            "seed {seed}: {:?}",
            run.deviations(&paired)
        );
        let (named, wrong) = (dropped(&paired, Reason::Outlier), run.wrong.len());
        assert!(named * 10 >= wrong * 9, "seed {seed}: {named} of {wrong}");
    }
}

#[test]
fn a_short_run_takes_the_drift_as_zero_and_says_so() {
    let run = make(&Case { duration_s: 9.0, arm_error_m: 1e-3, arm_error_s: 0.2, ..Case::default() });
    let paired = run.pair(&Options::default()).expect("pairs");
    assert!(!paired.report.clock.drift_fitted && paired.clock.drift == 0.0);
    assert!(paired.report.notes.iter().any(|note| note.contains("drift was taken as zero")), "{:?}", paired.report.notes);
}

#[test]
fn labels_are_true_minus_reported_in_frame_0() {
    let run = make(&Case { noise_m: 1e-6, arm_error_m: 2e-3, arm_error_s: 3.0, ..Case::default() });
    let known = Options {
        clock: ClockChoice::Known(run.clock),
        registration: RegistrationChoice::Known(run.frame),
        standstill_every_s: 0.0,
        ..Options::default()
    };
    let paired = run.pair(&known).expect("pairs");
    assert_eq!(paired.pairs.len(), run.truth.t_s.len());
    let random = &mut Random(1_u64.wrapping_mul(0x1234_5678_9abc_def1) + 77);
    let path = Path::new(Motion::Teleoperation, random);
    for Pair { frame, truth_time_s, state_time_s, reported_m, truth_m, label_m, .. } in &paired.pairs {
        assert_eq!(*truth_time_s, run.truth.t_s[*frame]);
        assert_eq!(*state_time_s, run.clock.state_time_s(*truth_time_s));
        let (there, brought) = (path.at(*state_time_s), run.frame.apply(run.truth.position_m[*frame]));
        for axis in 0..3 {
            assert!((reported_m[axis] - there[axis]).abs() < 2e-6, "interpolated: {} against {}", reported_m[axis], there[axis]);
            assert!((truth_m[axis] - brought[axis]).abs() < 1e-12);
            assert_eq!(label_m[axis], truth_m[axis] - reported_m[axis]);
        }
    }
    let rms = paired.report.label.rms_3d_m;
    assert!((2.5e-3..4.5e-3).contains(&rms), "2 mm per axis: {rms}");
}

#[test]
fn a_constant_offset_of_the_arm_hides_in_a_fitted_registration_only() {
    let run = make(&Case { arm_offset_m: Vector3::new(3e-3, -2e-3, 1e-3), ..Case::default() });
    let fitted = run.pair(&Options::default()).expect("pairs");
    assert!(fitted.report.label.mean_m.iter().all(|mean| mean.abs() < 1e-4), "{:?}", fitted.report.label.mean_m);
    assert!(fitted.report.notes.iter().any(|note| note.contains("constant offset of the arm")));
    let known = Options { registration: RegistrationChoice::Known(run.frame), ..Options::default() };
    let known = run.pair(&known).expect("pairs");
    for (mean, offset) in known.report.label.mean_m.iter().zip([3e-3, -2e-3, 1e-3]) {
        assert!((mean - offset).abs() < 1e-4, "{mean} against {offset}");
    }
    assert!(!known.report.registration.fitted && known.report.clock.fitted);
}

#[test]
fn gaps_runlevels_repeats_and_standstill_are_counted_by_frame() {
    let mut run = make(&Case { noise_m: 1e-5, ..Case::default() });
    let frames = run.truth.t_s.len();
    // Frames 100 and 101 come twice from the camera.
    run.truth.position_m[100] = run.truth.position_m[99];
    run.truth.position_m[101] = run.truth.position_m[99];
    // No states for two seconds.
    let keep = |t: f64| !(120.0..122.0).contains(&t);
    let rows: Vec<usize> = (0..run.t_s.len()).filter(|&row| keep(run.t_s[row])).collect();
    let chosen = |values: &[f64]| rows.iter().map(|&row| values[row]).collect::<Vec<f64>>();
    let t_s = chosen(&run.t_s);
    let axes = [chosen(&run.position_m[0]), chosen(&run.position_m[1]), chosen(&run.position_m[2])];
    // The pedal is up for three seconds.
    let levels: Vec<f64> = t_s.iter().map(|t| if (130.0..133.0).contains(t) { 2.0 } else { 3.0 }).collect();
    let reported = Reported { t_s: &t_s, position_m: [&axes[0], &axes[1], &axes[2]], quaternion: None, runlevel: Some(&levels) };
    let options =
        Options { clock: ClockChoice::Known(run.clock), registration: RegistrationChoice::Known(run.frame), ..Options::default() };
    let paired = pair(&reported, &run.truth, &options).expect("pairs");
    println!("{}", paired.report);
    let within = |from: f64, to: f64| run.truth.t_s.iter().filter(|t| (from..to).contains(&run.clock.state_time_s(**t))).count();
    assert_eq!(dropped(&paired, Reason::StateGap), within(120.0, 122.0));
    assert_eq!(dropped(&paired, Reason::Runlevel), within(130.0, 133.0));
    // The first of the repeated ones is 1/15 s old when it comes again: the arm has moved, the label has jumped.
    assert_eq!(dropped(&paired, Reason::RepeatedFrame), 2);
    assert_eq!(paired.pairs.len() + paired.report.dropped.iter().map(|dropped| dropped.frames).sum::<usize>(), frames);
    let all = Options { runlevel: None, ..options };
    assert_eq!(dropped(&pair(&reported, &run.truth, &all).expect("pairs"), Reason::Runlevel), 0);

    let still = make(&Case { motion: Motion::Still, duration_s: 60.0, ..Case::default() });
    let options = Options { registration: RegistrationChoice::Known(still.frame), ..options };
    let limits = Limits { explained_min: f64::NEG_INFINITY, ..Limits::default() };
    let options = Options { clock: ClockChoice::Known(still.clock), limits, ..options };
    let paired = still.pair(&options).expect("pairs");
    assert!((55..=62).contains(&paired.pairs.len()), "one a second: {}", paired.pairs.len());
    assert_eq!(dropped(&paired, Reason::Standstill), still.truth.t_s.len() - paired.pairs.len());
}

#[test]
fn missing_positions_in_the_states_make_no_pairs_and_no_harm() {
    let mut run = make(&Case::default());
    for row in 20_000..25_000 {
        run.position_m[1][row] = f64::NAN;
    }
    let paired = run.pair(&Options::default()).expect("pairs");
    let gaps = dropped(&paired, Reason::StateGap);
    assert!((74..=77).contains(&gaps), "5 s at 15 Hz: {gaps}");
    assert!(paired.pairs.iter().all(|pair| pair.label_m.iter().all(|value| value.is_finite())));
    assert!(run.deviations(&paired).iter().all(|deviation| deviation.abs() < 4.5));
}

#[test]
fn orientation_labels_leave_the_mounting_out() {
    let mut random = Random(5);
    let mut run = make(&Case::default());
    let mounting = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -1.2, 0.4));
    let matrix = nalgebra::Matrix3::from_fn(|row, column| run.frame.rotation[row][column]);
    let frame = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix));
    let arm = |t: f64| UnitQuaternion::from_scaled_axis(Vector3::new(0.5 * (0.8 * t).sin(), 0.7 * (0.5 * t).cos(), 0.3 * t.sin()));
    let error = |t: f64| UnitQuaternion::from_scaled_axis(Vector3::new(0.02 * (0.9 * t).sin(), 0.0, -0.03 * (1.3 * t).cos()));
    let parts = |q: UnitQuaternion<f64>| [q.w, q.i, q.j, q.k];
    // The published sign of a quaternion may change from row to row.
    let signs: Vec<f64> = run.t_s.iter().map(|_| if random.uniform() < 0.5 { -1.0 } else { 1.0 }).collect();
    let columns: [Vec<f64>; 4] =
        std::array::from_fn(|i| run.t_s.iter().zip(&signs).map(|(&t, sign)| parts(arm(t))[i] * sign).collect());
    let seen = |&t: &f64| {
        let t = run.clock.state_time_s(t);
        parts(frame.inverse() * error(t) * arm(t) * mounting)
    };
    run.truth.quaternion = Some(run.truth.t_s.iter().map(seen).collect());
    let [w, x, y, z] = &columns;
    let reported = Reported { quaternion: Some([w, x, y, z]), ..run.reported() };
    let options =
        Options { clock: ClockChoice::Known(run.clock), registration: RegistrationChoice::Known(run.frame), ..Options::default() };
    let paired = pair(&reported, &run.truth, &options).expect("pairs");
    let report = paired.report.orientation.expect("both have orientations");
    assert_eq!(report.pairs, paired.pairs.len());
    let mut worst = 0.0_f64;
    for pair in &paired.pairs {
        let expected = error(pair.state_time_s).scaled_axis();
        let found = Vector3::from(pair.rotation_label_rad.expect("label"));
        worst = worst.max((found - expected).norm());
        let [w, x, y, z] = pair.truth_wxyz.expect("orientation");
        let truth = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z));
        let exact = error(pair.state_time_s) * arm(pair.state_time_s);
        assert!(truth.angle_to(&exact) < 0.006, "{}", truth.angle_to(&exact));
    }
    println!(
        "orientation labels are off by {:.3} deg at most, RMS label {:.2} deg",
        worst.to_degrees(),
        report.rms_rad.to_degrees()
    );
    assert!(worst < 0.006, "{worst}: the mean of the arm's error goes into the mounting, no more");
}

#[test]
fn a_constant_error_of_the_orientation_stays_in_the_labels_where_the_mounting_is_known() {
    let mut run = make(&Case::default());
    let constant = UnitQuaternion::from_scaled_axis(Vector3::new(0.05, -0.02, 0.08));
    let matrix = nalgebra::Matrix3::from_fn(|row, column| run.frame.rotation[row][column]);
    let frame = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix));
    let arm = |t: f64| UnitQuaternion::from_scaled_axis(Vector3::new(0.5 * (0.8 * t).sin(), 0.7 * (0.5 * t).cos(), 0.3 * t.sin()));
    let parts = |q: UnitQuaternion<f64>| [q.w, q.i, q.j, q.k];
    let columns: [Vec<f64>; 4] = std::array::from_fn(|i| run.t_s.iter().map(|&t| parts(arm(t))[i]).collect());
    let seen = |&t: &f64| {
        let t = run.clock.state_time_s(t);
        parts(frame.inverse() * constant * arm(t))
    };
    run.truth.quaternion = Some(run.truth.t_s.iter().map(seen).collect());
    let [w, x, y, z] = &columns;
    let reported = Reported { quaternion: Some([w, x, y, z]), ..run.reported() };
    let (clock, registration) = (ClockChoice::Known(run.clock), RegistrationChoice::Known(run.frame));
    let fitted = Options { clock, registration, ..Options::default() };
    let known = Options { mounting_known: true, ..fitted };
    let rms = |options: &Options| {
        let report = pair(&reported, &run.truth, options).expect("pairs").report.orientation.expect("both have orientations");
        assert_eq!(report.is_known, options.mounting_known);
        report.rms_rad
    };
    let (fitted, known) = (rms(&fitted), rms(&known));
    assert!((known - constant.angle()).abs() < 0.003, "{known} of {}", constant.angle());
    // About the end effector's own axes a constant turn about the base's is none, so that some of it is left.
    assert!(fitted < 0.7 * known, "{fitted} of {known}");
}

#[test]
fn matched_points_are_registered_and_a_line_is_refused() {
    let run = make(&Case { noise_m: 0.2e-3, offset_s: 0.0, ..Case::default() });
    let options =
        Options { clock: ClockChoice::Known(run.clock), registration: RegistrationChoice::Known(run.frame), ..Options::default() };
    let paired = run.pair(&options).expect("pairs");
    let mut truth: Vec<[f64; 3]> = paired.pairs.iter().map(|pair| run.truth.position_m[pair.frame]).collect();
    let reported: Vec<[f64; 3]> = paired.pairs.iter().map(|pair| pair.reported_m).collect();
    truth[3] = [f64::NAN; 3];
    truth[4] = [1.0, 2.0, 3.0];
    let report = register(&truth, &reported, &Limits::default()).expect("registration");
    assert_eq!((report.points, report.points - report.inliers), (truth.len() - 1, 1));
    assert!((report.rms_m - 0.2e-3 * 3.0_f64.sqrt()).abs() < 0.02e-3, "{}", report.rms_m);
    assert!(report.sd_m.iter().all(|sd| (sd - 0.2e-3).abs() < 0.02e-3));
    let middle = run.middle();
    let moved = Vector3::from(report.rigid.apply(middle)) - Vector3::from(run.frame.apply(middle));
    assert!(moved.norm() < 5.0 * Vector3::from(report.centre_sd_m).norm());
    let line: Vec<[f64; 3]> = (0..50).map(|i| [0.001 * f64::from(i), 0.002 * f64::from(i), 0.0]).collect();
    assert!(matches!(register(&line, &line, &Limits::default()), Err(PairError::Degenerate { .. })));
    assert!(matches!(register(&line[1..], &line, &Limits::default()), Err(PairError::Column { .. })));
    assert!(matches!(register(&line[..9], &line[..9], &Limits::default()), Err(PairError::TooFewFrames { found: 9, .. })));
}

#[test]
fn the_same_streams_give_the_same_pairs_and_a_readable_report() {
    let run = make(&Case { lost: 0.05, wrong: 0.02, ..Case::default() });
    let (one, two) = (run.pair(&Options::default()).expect("pairs"), run.pair(&Options::default()).expect("pairs"));
    assert_eq!(one.pairs, two.pairs);
    assert_eq!(one.report, two.report);
    let text = one.report.to_string();
    println!("{text}");
    for part in ["pairs from", "lost frame", "clock: offset -6", "registration: 0.", "label (true - reported, frame 0)", "note: "] {
        assert!(text.contains(part), "no `{part}` in\n{text}");
    }
    let json: serde_json::Value = serde_json::from_str(&one.report.to_json()).expect("JSON");
    assert_eq!(json["pairs"], one.pairs.len());
    assert_eq!(json["dropped"][0]["reason"], "lost_frame");
    assert_eq!(json["dropped"][0]["frames"], run.lost);
    assert_eq!(json["clock"]["clock"]["offset_s"], one.clock.offset_s);
}

fn recording(columns: &[(&str, Vec<f64>)]) -> Recording {
    let column = |(name, values): &(&str, Vec<f64>)| Column::new(*name, values.clone());
    Recording { name: "made".to_owned(), columns: columns.iter().map(column).collect(), ..Recording::default() }
}

#[test]
fn recordings_give_streams_with_the_truth_inside_or_beside() {
    let run = make(&Case { lost: 0.1, ..Case::default() });
    let [x, y, z] = run.position_m.clone();
    let states = recording(&[("t_s", run.t_s.clone()), ("x_m", x), ("y_m", y), ("z_m", z)]);
    let axis = |i: usize| run.truth.position_m.iter().map(|position| position[i]).collect::<Vec<f64>>();
    let vision = recording(&[("t_s", run.truth.t_s.clone()), ("x_m", axis(0)), ("y_m", axis(1)), ("z_m", axis(2))]);
    let truth = Truth::from_recording(&vision).expect("truth");
    let paired = pair(&Reported::from_recording(&states).expect("states"), &truth, &Options::default()).expect("pairs");
    assert_eq!(paired.pairs, run.pair(&Options::default()).expect("pairs").pairs);
    let missing =
        Reported::from_recording(&vision).map(|_| ()).and(Truth::from_recording(&recording(&[("t_s", vec![0.0])])).map(|_| ()));
    assert_eq!(
        missing.expect_err("no columns").to_string(),
        "made: has no column `x_m`; pairs need time (t_s) and the tip's position on both sides (x_mm, y_mm, z_mm and truth_x_mm, truth_y_mm, truth_z_mm)"
    );
}

#[test]
fn the_recordings_with_truth_inside_are_paired() {
    for case in ["a", "b", "c", "d"] {
        let path = data().join(format!("gap-examples/{case}/real_1.csv.gz"));
        if !path.exists() {
            println!("skipped: {} is absent", path.display());
            continue;
        }
        let run = recordings::csv::read(&path).unwrap_or_else(|error| panic!("{error}"));
        let (reported, truth) = (Reported::from_recording(&run).expect("states"), Truth::from_recording(&run).expect("truth"));
        assert_eq!(truth.t_s.len(), 600);
        let same = pair(&reported, &truth, &Options { standstill_every_s: 0.0, ..Options::same_clock_and_frame() }).expect("pairs");
        let (x, truth_x) = (run.column("x_m").expect("x"), run.column("truth_x_m").expect("truth"));
        for pair in &same.pairs {
            let row = run.time_s().expect("time").iter().position(|t| *t == pair.state_time_s).expect("row");
            assert_eq!(pair.label_m[0], truth_x[row] - x[row]);
        }
        let limits = Limits { offset_sd_max_s: 0.2, rotation_sd_max_rad: 0.1, ..Limits::default() };
        let fitted = pair(&reported, &truth, &Options { limits, ..Options::default() });
        match fitted {
            Ok(fitted) => {
                println!("{case}: as one clock and frame\n{}{case}: fitted\n{}", same.report, fitted.report);
                let offset_s = fitted.clock.offset_s;
                assert!(offset_s.abs() < 0.02 + 4.0 * fitted.report.clock.offset_sd_s, "{case}: {offset_s}");
                assert!(fitted.report.label.rms_3d_m < same.report.label.rms_3d_m);
            }
            Err(error) => panic!("{case}: {error}"),
        }
    }
}

#[test]
fn features_are_sampled_at_the_times_of_the_pairs() {
    let run = make(&Case::default());
    let paired = run.pair(&Options::default()).expect("pairs");
    let times = paired.state_times_s();
    let x = sample(&run.t_s, &run.position_m[0], Interpolation::Linear, 0.025, &times);
    assert!(paired.pairs.iter().zip(&x).all(|(pair, x)| (pair.reported_m[0] - x).abs() < 1e-15));
    let rows: Vec<f64> = (0..run.t_s.len()).map(|row| row as f64).collect();
    let nearest = sample(&run.t_s, &rows, Interpolation::Nearest, 0.025, &times);
    for (row, time) in nearest.iter().zip(&times) {
        assert_eq!(row.fract(), 0.0);
        assert!((run.t_s[*row as usize] - time).abs() <= 0.5005e-3);
    }
}
