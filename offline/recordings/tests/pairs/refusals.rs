//! What cannot be paired is refused, with what was measured.

use recordings::pairs::{ClockChoice, Options, PairError, Reported, Truth, pair};

use super::made::{Case, Motion, make};

fn refused(case: &Case, options: &Options) -> PairError {
    let error = match make(case).pair(options) {
        Ok(paired) => panic!("seed {} must be refused:\n{}", case.seed, paired.report),
        Err(error) => error,
    };
    println!("{error}");
    assert!(!error.to_string().contains('\n'));
    error
}

#[test]
fn motion_that_cannot_tell_is_refused_with_what_was_measured() {
    let options = Options::default();
    for seed in 0..12 {
        let of = |motion| Case { seed, motion, ..Case::default() };
        assert!(matches!(refused(&of(Motion::Still), &options), PairError::TooLittleMotion { spread_m, .. } if spread_m < 1e-6));
        let line = refused(&of(Motion::Line), &options);
        assert!(matches!(line, PairError::Degenerate { spread_m, .. } if spread_m[0] > 5e-3 && spread_m[1] < 1e-3), "{line}");
        // On a circle at constant speed a delay is a rotation.
        let circle = refused(&of(Motion::Circle), &options);
        let told = matches!(
            circle,
            PairError::ClockUndetermined { .. } | PairError::TooLittleMotion { .. } | PairError::Degenerate { .. }
        );
        assert!(told, "{circle}");
        let closed = refused(&of(Motion::Loop), &options);
        let PairError::Ambiguous { first_s, second_s, .. } = closed else { panic!("{closed}") };
        let turns = (first_s - second_s) / 2.0;
        assert!(turns.round() != 0.0 && (turns - turns.round()).abs() < 0.01, "{closed}");
    }
    // The same loop within less than a turn is told.
    let narrow = Options { clock: ClockChoice::Fit { expected_offset_s: -0.5, window_s: 0.9, drift_max: 5e-4 }, ..options };
    let closed = make(&Case { motion: Motion::Loop, ..Case::default() }).pair(&narrow).expect("pairs");
    assert!((closed.clock.offset_s + 0.6).abs() < 2e-3);
}

#[test]
fn streams_that_do_not_belong_together_are_refused() {
    for seed in 0..20 {
        let (one, other) = (make(&Case { seed, ..Case::default() }), make(&Case { seed: seed + 1000, ..Case::default() }));
        let error = pair(&one.reported(), &other.truth, &Options::default()).expect_err("two runs");
        assert!(matches!(error, PairError::NoAgreement { .. } | PairError::TooLittleMotion { .. }), "seed {seed}: {error}");
    }
    let late = Case { offset_s: -900.0, ..Case::default() };
    assert!(matches!(refused(&late, &Options::default()), PairError::NoOverlap { .. }));
    let told =
        Options { clock: ClockChoice::Fit { expected_offset_s: -898.0, window_s: 5.0, drift_max: 5e-4 }, ..Options::default() };
    assert!((make(&late).pair(&told).expect("pairs").clock.offset_s + 900.0).abs() < 2e-3);
    let outside = refused(&Case { offset_s: 7.0, ..Case::default() }, &Options::default());
    assert!(
        matches!(outside, PairError::NoAgreement { .. } | PairError::AtEdge { .. } | PairError::TooLittleMotion { .. }),
        "{outside}"
    );
}

#[test]
fn a_run_too_short_for_the_offset_is_refused() {
    let slow = Case { duration_s: 12.0, arm_error_m: 8e-3, arm_error_s: 2.0, ..Case::default() };
    let mut refusals = 0;
    for seed in 0..10 {
        match make(&Case { seed, ..slow.clone() }).pair(&Options::default()) {
            Err(error) => {
                println!("{error}");
                refusals += 1;
            }
            Ok(paired) => assert!(paired.report.clock.offset_sd_s <= 0.02),
        }
    }
    assert!(refusals >= 5, "{refusals} of 10 were refused");
}

#[test]
fn bad_columns_are_refused_in_one_line() {
    let run = make(&Case::default());
    let mut cut = run.truth.clone();
    cut.position_m.pop();
    let mut back = run.truth.clone();
    back.t_s[7] = back.t_s[6];
    let mut nan = run.truth.clone();
    nan.t_s[7] = f64::NAN;
    let few = Truth { t_s: run.truth.t_s[..20].to_vec(), position_m: run.truth.position_m[..20].to_vec(), quaternion: None };
    for (truth, expected) in [
        (cut, "the truth stream: a column has 878 values for 879 times; give one for each"),
        (back, "the truth stream, row 7: time 101.7 s does not rise above 101.7 s; sort the rows and drop repeated times"),
        (nan, "the truth stream, row 7: time NaN s does not rise above 101.7 s; sort the rows and drop repeated times"),
        (few, "only 20 of 20 true positions can be matched with a state, 30 are needed; record longer, or check the cameras"),
        (
            Truth::default(),
            "only 0 of 0 true positions can be matched with a state, 30 are needed; record longer, or check the cameras",
        ),
    ] {
        let error = pair(&run.reported(), &truth, &Options::default()).expect_err(expected).to_string();
        assert!(error.contains("row 7") && expected.contains("row 7") || error == expected, "{error}");
    }
    let short = Reported { position_m: [&run.position_m[0][1..], &run.position_m[1], &run.position_m[2]], ..run.reported() };
    assert!(matches!(pair(&short, &run.truth, &Options::default()), Err(PairError::Column { stream: "reported", .. })));
    let empty = Reported { t_s: &[], position_m: [&[], &[], &[]], quaternion: None, runlevel: None };
    assert!(pair(&empty, &run.truth, &Options::default()).is_err());
}
