//! One sentence per physics, right in sign, size, unit and confidence.

use crate::common;

use gap_report::{
    Channel, DataQuality, Evidence, Feature, Identifiable, Interval, Level, Location, MODEL_ERROR, Motion, Parameter, Physics,
    Regime, Subsystem, TestMethod, Verdict, headline, headlines, quality_headline, vocabulary, words,
};

/// A sure verdict with parameters of the vocabulary, each with an interval of a tenth to both sides.
fn verdict(physics: &Physics, joints: &[&str], motion: Motion, values: &[(&str, f64)]) -> Verdict {
    let parameter = |(name, value): &(&str, f64)| {
        let half = 0.1 * value.abs();
        Parameter::of(physics, name, motion, *value, [value - half, value + half]).unwrap_or_else(|| panic!("{physics} {name}"))
    };
    let joints = joints.iter().map(|joint| (*joint).to_owned());
    let location = Location::new(Channel::JointTorque, joints, Subsystem::Unknown, Regime::all());
    let parameters = values.iter().map(parameter).collect();
    let alternative = Verdict::alternative(1, physics.clone(), 0.97, location, parameters, Vec::new());
    Verdict { role: gap_report::Role::Primary, ..alternative }
}

fn said(physics: &Physics, joints: &[&str], values: &[(&str, f64)]) -> String {
    headline(&verdict(physics, joints, Motion::Revolute, values))
}

/// Physics, joints, parameters, sentence.
type Case = (Physics, &'static [&'static str], &'static [(&'static str, f64)], &'static str);

#[test]
fn each_physics_says_what_the_robot_has() {
    use Physics as P;
    let elbow: &'static [&'static str] = &["elbow"];
    let cases: Vec<Case> = vec![
        (
            P::CoulombFriction,
            elbow,
            &[("f_c", 0.81)],
            "The elbow joint has 0.810 N m (0.729 to 0.891) of dry friction that the simulation lacks.",
        ),
        (
            P::CoulombFriction,
            &["J2"],
            &[("f_c", -0.5)],
            "Joint J2 has 0.500 N m (0.450 to 0.550) less dry friction than the simulation.",
        ),
        (
            P::ViscousFriction,
            elbow,
            &[("b", 2.7)],
            "Friction in the elbow joint grows with speed by 2.70 N m s/rad (2.43 to 2.97), which the simulation lacks.",
        ),
        (
            P::ViscousFriction,
            elbow,
            &[("b", -2.7)],
            "Friction in the elbow joint grows less with speed than in the simulation, by 2.70 N m s/rad (2.43 to 2.97).",
        ),
        (
            P::StribeckFriction,
            elbow,
            &[("f_c", 0.8), ("f_s", 1.3), ("v_s", 0.004)],
            "The elbow joint sticks: its friction falls from 1.30 N m (1.17 to 1.43) to 0.800 N m (0.720 to 0.880) above 4.00 mrad/s, which the simulation lacks.",
        ),
        (
            P::LoadDependentFriction,
            elbow,
            &[("mu_l", 0.2)],
            "Friction in the elbow joint grows with load by 20.0 % (18.0 to 22.0) of it, which the simulation lacks.",
        ),
        (
            P::LoadDependentFriction,
            elbow,
            &[("mu_l", -0.05)],
            "Friction in the elbow joint grows with load less than in the simulation, by 5.00 % (4.50 to 5.50) of it.",
        ),
        (
            P::CableStretch,
            elbow,
            &[("k", -5700.0)],
            "The cable of the elbow joint gives way under load less than in the simulation, by that of a spring of 5700 N m/rad (5130 to 6270).",
        ),
        (
            P::CableCreep,
            elbow,
            &[("T_k", 42.0), ("J_k", -0.001)],
            "The cable of the elbow joint goes on stretching under a steady load less than in the simulation, with a time constant of 42.0 s (37.8 to 46.2).",
        ),
        (P::Backlash, elbow, &[("b", 0.0021)], "The elbow joint has 2.10 mrad (1.89 to 2.31) of play that the simulation lacks."),
        (
            P::CableStretch,
            elbow,
            &[("k", 5700.0)],
            "The cable of the elbow joint gives way under load like a spring of 5700 N m/rad (5130 to 6270), which the simulation lacks.",
        ),
        (
            P::CableHysteresis,
            elbow,
            &[("z_m", 0.001)],
            "The cable of the elbow joint does not return the way it came: stretching and releasing differ over 1.00 mrad (0.90 to 1.10), which the simulation lacks.",
        ),
        (
            P::CableCreep,
            elbow,
            &[("T_k", 42.0)],
            "The cable of the elbow joint goes on stretching under a steady load, with a time constant of 42.0 s (37.8 to 46.2), which the simulation lacks.",
        ),
        (
            P::JointCoupling,
            &["elbow", "shoulder"],
            &[("c_ij", 0.02)],
            "The shoulder joint drags the elbow joint along by 0.0200 rad/rad (0.0180 to 0.0220), beyond what the simulation has.",
        ),
        (P::Payload, &[], &[("m_p", 0.105)], "The tool carries 105 g (94 to 115) that the simulation does not know of."),
        (P::Payload, &[], &[("m_p", -0.05)], "The tool is 50.0 g (45.0 to 55.0) lighter than in the simulation."),
        (
            P::GravityDirection,
            &[],
            &[("a", 0.1), ("b", -0.02)],
            "The base is tilted by 5.73° (5.16° to 6.30°) about x and \u{2212}1.15° (\u{2212}1.26° to \u{2212}1.03°) about y against the simulation.",
        ),
        (
            P::LinkInertia,
            elbow,
            &[("dpi_B", 0.4)],
            "The link at the elbow joint is 400 g (360 to 440) heavier than in the simulation.",
        ),
        (
            P::MotorTorqueScale,
            elbow,
            &[("kappa", 0.5)],
            "The motor of the elbow joint gives 0.500 (0.450 to 0.550) times the torque that the simulation assumes.",
        ),
        (P::MotorTorqueScale, elbow, &[("kappa", -1.0)], "The recorded motor torque of the elbow joint has the opposite sign."),
        (
            P::TorqueRipple,
            elbow,
            &[("amp", 0.3), ("order", 8.0)],
            "The motor torque of the elbow joint ripples by 0.300 N m (0.270 to 0.330), 8 times per turn, which the simulation lacks.",
        ),
        (P::JointOffset, elbow, &[("o", -0.0032)], "The zero of the elbow joint is off by 3.20 mrad (2.88 to 3.52)."),
        (
            P::TransmissionRatio,
            elbow,
            &[("e", -0.02)],
            "The elbow joint moves 2.00 % (1.80 to 2.20) less far than the simulation says.",
        ),
        (
            P::PulleyEccentricity,
            elbow,
            &[("e_over_r", 0.002), ("period", 0.633)],
            "A pulley of the elbow joint runs out of true by 2.00 mrad (1.80 to 2.20), once every 0.633 rad of travel.",
        ),
        (
            P::LinkGeometry,
            elbow,
            &[("d_length", 0.002), ("d_alpha", 0.01)],
            "The link at the elbow joint is 2.00 mm (1.80 to 2.20) longer and is twisted by 0.573° (0.516° to 0.630°) against the simulation.",
        ),
        (
            P::MeasurementDelay,
            &[],
            &[("d", 0.0231)],
            "Motor torques arrive 23.1 ms (20.8 to 25.4) later than the simulation assumes.",
        ),
        (
            P::MeasurementDelay,
            elbow,
            &[("d", -0.004)],
            "Motor torques of the elbow joint arrive 4.00 ms (3.60 to 4.40) earlier than the simulation assumes.",
        ),
        (
            P::MeasurementDelay,
            &[],
            &[("clock_drift", 1e-5)],
            "The clocks drift apart, by 10.0 millionths (9.0 to 11.0) of the time.",
        ),
        (
            P::FrameMisalignment,
            &[],
            &[("w_z", 0.02), ("t_x", -0.003)],
            "The camera\u{2019}s frame is turned by 1.15° (1.03° to 1.26°) about z and shifted by 3.00 mm (2.70 to 3.30) along x against the robot\u{2019}s.",
        ),
        (
            P::ExternalContact,
            &[],
            &[("f_max", 4.2), ("k", 500.0)],
            "Something outside presses against the arm with up to 4.20 N (3.78 to 4.62), which the simulation lacks.",
        ),
        (
            P::ThermalDrift,
            elbow,
            &[("kappa_T", 0.22), ("T", 300.0)],
            "Friction in the elbow joint falls by 22.0 % (19.8 to 24.2) as the motor warms up, with a time constant of 300 s, which the simulation lacks.",
        ),
        (P::None, &[], &[], "The simulation agrees with the recordings: no difference beyond noise."),
        (P::Unmodelled, elbow, &[], "The simulation lacks something at the elbow joint that no known physics explains."),
        (
            P::Plugin("drag".to_owned()),
            elbow,
            &[],
            "The added hypothesis \u{201c}drag\u{201d} explains the difference at the elbow joint.",
        ),
    ];
    for (physics, joints, values, expected) in &cases {
        assert_eq!(said(physics, joints, values), *expected);
    }
    for physics in Physics::ALL {
        assert!(cases.iter().any(|case| case.0 == *physics), "{physics}");
    }
}

#[test]
fn a_delay_names_what_comes_late_by_its_channel() {
    let told = |channel: Channel, value: f64| {
        let mut verdict = verdict(&Physics::MeasurementDelay, &[], Motion::Revolute, &[("d", value)]);
        verdict.location.channel = channel;
        headline(&verdict)
    };
    let tip = told(Channel::EndEffector, 0.02);
    assert_eq!(tip, "Positions of the tip arrive 20.0 ms (18.0 to 22.0) later than the simulation assumes.");
    // Which of the two is late is not to be seen.
    let encoders = told(Channel::Transmission, 0.001);
    assert!(encoders.starts_with("Joint encoders and motor positions are 1.00 ms"), "{encoders}");
}

#[test]
fn an_amplifiers_offset_is_no_scale_of_one() {
    let verdict = verdict(&Physics::MotorTorqueScale, &["elbow"], Motion::Revolute, &[("kappa", 1.0)]);
    assert_eq!(headline(&verdict), "The motor of the elbow joint gives a constant torque that the simulation lacks.");
}

#[test]
fn a_fading_that_had_no_time_to_end_has_no_size() {
    let mut verdict = verdict(&Physics::ThermalDrift, &["elbow"], Motion::Revolute, &[("kappa_T", 0.27), ("T", 10.9)]);
    verdict.parameters[0].ci95 = [-39.2, 1.0];
    let expected = |way: &str| {
        format!(
            "Friction in the elbow joint {way} as the motor warms up, which the simulation lacks; how far it will go, and how fast, these \
             recordings are too short to tell."
        )
    };
    assert_eq!(headline(&verdict), expected("changes"));
    verdict.parameters[0].ci95 = [0.02, 2.4];
    assert_eq!(headline(&verdict), expected("falls"));
}

/// With all parameters, with none, at no joint, at three, linear or turning: a sentence that stands.
#[test]
fn every_physics_has_a_sentence_whatever_is_known() {
    for hypothesis in &vocabulary().hypotheses {
        for joints in [&[][..], &["J1"], &["shoulder", "elbow", "insertion"]] {
            for motion in [Motion::Revolute, Motion::Prismatic] {
                let middle = |range: [f64; 2]| 0.3 * range[0] + 0.7 * range[1];
                let all: Vec<(&str, f64)> =
                    hypothesis.parameters.iter().map(|known| (known.name.as_str(), middle(known.raven_range))).collect();
                for values in [&all[..], &[]] {
                    let text = headline(&verdict(&hypothesis.physics, joints, motion, values));
                    assert!(text.ends_with('.') && !text.contains("..") && !text.contains("  "), "{text}");
                    assert!(text.starts_with(char::is_uppercase) && text.len() < 260, "{text}");
                    assert!(!text.contains('_') && !text.contains("NaN") && !text.contains('\u{a0}'), "{text}");
                }
            }
        }
    }
}

#[test]
fn sentences_are_honest_about_confidence() {
    let mut friction = verdict(&Physics::CoulombFriction, &["elbow"], Motion::Revolute, &[("f_c", 0.8)]);
    for (probability, start) in [(0.95, "The elbow"), (0.7, "Most likely the elbow"), (0.3, "Possibly the elbow")] {
        friction.probability = probability;
        assert!(headline(&friction).starts_with(start), "{}", headline(&friction));
    }
    friction.parameters[0] = friction.parameters[0].clone().identifiable(Identifiable::Weak);
    assert!(headline(&friction).contains("has about 0.800 N m"), "{}", headline(&friction));
    friction.location.time_intervals.push(Interval::new("run-02", 12.1, 15.3));
    assert!(headline(&friction).ends_with(", from 12.1 to 15.3 s of run-02."), "{}", headline(&friction));
}

#[test]
fn what_nobody_knows_is_located() {
    let mut location =
        Location::new(Channel::JointTorque, ["elbow".to_owned()], Subsystem::Unknown, Regime::new(Feature::Posture, "x"));
    location.regime.push(Regime::new(Feature::Load, "y"));
    location.energy_share = Some(0.44);
    let shown_by = Evidence::new("a", "b", (1.0, "nats"), TestMethod::HeldOutGain);
    let text = headline(&Verdict::unmodelled(1, 0.4, location, shown_by));
    let expected = "The simulation lacks something at the elbow joint (44 % of the error) that no known physics explains; it goes with \
                    posture and load.";
    assert_eq!(text, expected);
}

#[test]
fn failures_of_the_data_say_what_they_mean() {
    let failed = DataQuality::new("input_sign", Level::Fail, "torque and velocity agree at 97 % of the reversals").run("run-1");
    let text = quality_headline(&failed);
    assert_eq!(text, "The recorded torque has the wrong sign (run-1): torque and velocity agree at 97 % of the reversals.");
    let passed = DataQuality { level: Level::Ok, run: None, ..failed };
    assert_eq!(quality_headline(&passed), "Input sign: torque and velocity agree at 97 % of the reversals.");
    let other = DataQuality::new("my own_check", Level::Fail, "went wrong!");
    assert_eq!(quality_headline(&other), "My own check: went wrong!");
}

#[test]
fn a_report_opens_with_its_answer() {
    let first = |report: &gap_report::Report| headlines(report).first().cloned().unwrap_or_default();
    assert_eq!(first(&common::insufficient()), "These recordings do not allow a verdict.");
    assert!(headlines(&common::insufficient())[1].starts_with("The recorded torque has the wrong sign"));
    assert_eq!(first(&common::no_mismatch()), "The simulation agrees with the recordings: no difference beyond noise.");
    assert!(headlines(&common::partly_explained())[1].starts_with("Beyond that, the simulation lacks something"));
    // Without verdicts, checks and sentences of its own: the summary.
    let mut empty = common::insufficient();
    empty.data_quality.clear();
    assert_eq!(headlines(&empty)[1], "The data do not allow an answer.");
}

#[test]
fn words_are_short_plain_and_begin_with_the_answer() {
    for (name, report) in common::all() {
        let text = words(&report);
        let lines: Vec<&str> = text.lines().collect();
        assert!(lines.len() <= 15, "{name}: {text}");
        assert!(lines.iter().all(|line| line.chars().count() <= 100), "{name}: {text}");
        assert!(text.ends_with('\n') && !text.contains(['\u{a0}', '<', '\u{1b}']), "{name}: {text}");
        assert!(lines[0].starts_with(&headlines(&report)[0][..20]), "{name}: {text}");
    }
    let text = words(&common::explained());
    for part in ["12.1 N (11.3 to 12.9)", "23.1 ms", "99 %", "Would decide:", "Not excluded:"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert!(words(&common::explained_with_failure()).contains("Put right first: The logged motor commands"));
    // What a terminal would take for a command.
    let mut nasty = common::explained();
    nasty.verdicts[0].location.joint[0] = "el\u{1b}[2Jbow\u{7}".to_owned();
    assert!(words(&nasty).contains("the el\u{fffd}[2Jbow\u{fffd} joint"));
    // However much there is to say.
    let mut long = common::explained();
    for check in &mut long.data_quality {
        (check.level, check.message) = (Level::Fail, "a long story ".repeat(60));
    }
    assert!(words(&long).lines().count() <= 15);
    assert!(words(&long).contains("12.1 N"));
}

#[test]
fn what_the_model_misses_itself_is_said_of_an_agreement_that_is_no_more_than_that() {
    let mut report = common::no_mismatch();
    report.verdicts[0].evidence[0].effect = None;
    let told = |report: &gap_report::Report, own: f64| {
        let mut report = report.clone();
        report.mismatch.excess_rms[0].extra.set(MODEL_ERROR, own);
        words(&report).split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let of_model = "; there the model that was learnt from the simulation misses";
    assert!(told(&report, 2.5).contains(&format!("noise alone 0.120 N m{of_model} 2.50 N m of the simulation itself")));
    assert!(!told(&report, 0.5).contains(of_model));
    // What is not beyond noise needs no other reason.
    report.mismatch.excess_rms[0].value = 0.1;
    assert!(!told(&report, 2.5).contains(of_model));
}
