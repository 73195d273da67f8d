//! Reports for tests and for looking at: the two of the specification, and made-up ones of every status.
#![allow(dead_code)]

use gap_report::{
    Access, Artifact, Calibration, Channel, CiMethod, Confusable, DataQuality, EffectSize, Evidence, ExcessRms, Experiment, Extra,
    Feature, Fit, FloorMethod, Format, Inputs, Interval, Level, Location, Mismatch, Motion, Parameter, Physics, Regime, Remaining,
    Report, Robot, Run, RunKind, RunRole, SCHEMA_VERSION, Score, Simulator, Space, Status, Subsystem, TestMethod, Timing, Tool,
    Verdict, ranked,
};

pub(crate) const EXPLAINED: &str = include_str!("../data/gap-report.example.json");
pub(crate) const NONE: &str = include_str!("../data/gap-report.example-none.json");

pub(crate) fn explained() -> Report {
    serde_json::from_str(EXPLAINED).expect("the example is a report")
}

pub(crate) fn none() -> Report {
    serde_json::from_str(NONE).expect("the example is a report")
}

pub(crate) const HASH: &str = "6b86b273ff34fce19d6b804eff5a3f5747ada4eaa22f1d49c01e52ddb7875b4b";

/// A report without verdicts of one run, split in time.
fn bare(status: Status, summary: &str) -> Report {
    Report {
        schema_version: SCHEMA_VERSION.to_owned(),
        report_id: "made-up".to_owned(),
        created: "2026-02-03T04:05:06Z".to_owned(),
        tool: Tool::ravenpose(HASH, 7),
        inputs: Inputs {
            robot: Robot {
                name: "RAVEN-II <gold> & \"worn\"".to_owned(),
                urdf_sha256: None,
                joints: ["shoulder", "elbow", "insertion"].map(str::to_owned).to_vec(),
                extra: Extra::default(),
            },
            simulator: Simulator {
                name: "raven2-nominal".to_owned(),
                version: None,
                access: Access::Builtin,
                extra: Extra::default(),
            },
            runs: vec![Run {
                kind: RunKind::Real,
                samples: Some(30_000),
                ..Run::split("raven_teleop_2024-01-01", (20.4, 30.0), 30.0, 1000.0, HASH)
            }],
            channels: vec![Channel::JointTorque, Channel::ClosedLoopOutput],
            extra: Extra::default(),
        },
        data_quality: vec![DataQuality::new("time_order", Level::Ok, "times rise throughout")],
        status,
        summary: summary.to_owned(),
        mismatch: Mismatch {
            detected: !matches!(status, Status::NoMismatch | Status::InsufficientData),
            p_value: Some(0.0004),
            excess_rms: vec![ExcessRms {
                channel: Channel::JointTorque,
                joint: Some("elbow".to_owned()),
                value: 0.91,
                unit: "N.m".to_owned(),
                noise_floor: 0.12,
                n_effective: Some(83.0),
                extra: Extra::default(),
            }],
            extra: Extra::default(),
        },
        verdicts: Vec::new(),
        corrected_model: None,
        remaining: Remaining {
            library_gain_nats: 41.0,
            flexible_gain_nats: 97.0,
            explained_share: None,
            depends_on: None,
            fit: None,
            extra: Extra::default(),
        },
        calibration: Calibration {
            null_runs: 330,
            threshold_nats: 6.0,
            false_alarm_upper95: None,
            probability_temperature: None,
            source: None,
            extra: Extra::default(),
        },
        timing: Timing { total_s: 8.25, threads: Some(2), ..Timing::default() },
        plots: Vec::new(),
        sealed_case: None,
        extra: Extra::default(),
    }
}

fn elbow(feature: Feature, condition: &str) -> Location {
    let regime = Regime::new(feature, condition);
    Location::new(Channel::JointTorque, ["elbow".to_owned()], Subsystem::Cable, regime)
}

fn held_out() -> Vec<String> {
    vec!["raven_teleop_2024-01-01".to_owned()]
}

/// The elbow's friction, which could be load-dependent friction.
pub(crate) fn friction(effect: u64) -> Verdict {
    let parameter = Parameter::of(&Physics::CoulombFriction, "f_c", Motion::Revolute, 0.81, [0.70, 0.92]).expect("known");
    let floor = Some((0.12, FloorMethod::Innovations));
    let fit = Fit::rms("torque elbow", "N.m", Space::EquationError, (0.91, 0.19), floor, held_out());
    let gain = Evidence::new("held-out gain", "friction explains the error", (88.0, "nats"), TestMethod::HeldOutGain);
    let model = Artifact::new("corrected.toml", Format::Toml).sha256(HASH);
    let location = elbow(Feature::VelocitySign, "constant with the sign of velocity");
    let parts = (vec![parameter.method(CiMethod::BlockBootstrap)], vec![fit], vec![gain]);
    let experiment = Experiment {
        duration_s: Some(60.0),
        extra_equipment: Some(vec!["a weight of 100 g".to_owned()]),
        warning: Some("Keep the tool away from the table.".to_owned()),
        ..Experiment::new(
            "tell dry friction from friction that grows with load",
            vec![Physics::CoulombFriction, Physics::LoadDependentFriction],
            vec!["move the elbow up and down at 0.1 rad/s, five times".to_owned(), "repeat with the weight".to_owned()],
        )
    };
    Verdict::primary(effect, Physics::CoulombFriction, 0.62, location, parts, model).score(Score::new(88.0, 9.0)).confusable(
        vec![Confusable::new(Physics::LoadDependentFriction, "the load hardly varied")],
        0.93,
        experiment,
    )
}

fn unknown(effect: u64) -> Verdict {
    let shown_by = Evidence::new("flexible predictor", "the rest is predictable", (97.0, "nats"), TestMethod::HeldOutGain);
    let mut location = elbow(Feature::Posture, "far from the middle of its range");
    location.energy_share = Some(0.44);
    Verdict::unmodelled(effect, 0.9, location, shown_by)
}

pub(crate) fn partly_explained() -> Report {
    let alternative = Parameter::of(&Physics::LoadDependentFriction, "mu_l", Motion::Revolute, 0.2, [0.02, 0.4]).expect("known");
    let location = elbow(Feature::VelocitySign, "constant with the sign of velocity");
    let alternative = Verdict::alternative(1, Physics::LoadDependentFriction, 0.3, location, vec![alternative], Vec::new());
    let report = bare(Status::PartlyExplained, "Friction explains a part.");
    Report {
        verdicts: ranked(vec![unknown(2), alternative, friction(1)]),
        corrected_model: Some(Artifact::new("corrected.toml", Format::Toml)),
        ..report
    }
}

pub(crate) fn unmodelled() -> Report {
    Report { verdicts: vec![unknown(1)], ..bare(Status::Unmodelled, "Nothing in the library explains the elbow.") }
}

pub(crate) fn insufficient() -> Report {
    let sign = "measured torque and velocity of the elbow agree in sign where friction alone acts, at 97 % of the reversals";
    let data_quality = vec![
        DataQuality::new("input_sign", Level::Fail, sign).run("raven_teleop_2024-01-01").value(97.0, "%"),
        DataQuality::new("excitation", Level::Fail, "the insertion joint moved by 0.4 mm only").value(0.4, "mm"),
        DataQuality::new("duplicates", Level::Warn, "3.1 % of the samples are repeated and were masked"),
    ];
    Report { data_quality, ..bare(Status::InsufficientData, "The data do not allow an answer.") }
}

pub(crate) fn no_mismatch() -> Report {
    let effect = EffectSize { value: 0.05, unit: "N.m".to_owned(), ci95: None, extra: Extra::default() };
    let best = Evidence::new("best library gain", "no hypothesis reaches the threshold", (2.3, "nats"), TestMethod::HeldOutGain);
    let verdict = Verdict::none(0.97, Channel::JointTorque, vec![Evidence { effect: Some(effect), ..best }]);
    Report { verdicts: vec![verdict], ..bare(Status::NoMismatch, "No difference beyond noise.") }
}

/// A payload picked up in a run, and a failed check in spite of a verdict.
pub(crate) fn explained_with_failure() -> Report {
    let mut report = bare(Status::Explained, "A load was picked up.");
    let mass = Parameter::of(&Physics::Payload, "m_p", Motion::Revolute, 0.105, [0.098, 0.113]).expect("known");
    let floor = Some((0.12, FloorMethod::Innovations));
    let fit = Fit::rms("torque elbow", "N.m", Space::EquationError, (0.41, 0.13), floor, held_out());
    let gain = Evidence::new("held-out gain", "a load at the tool explains the error", (55.0, "nats"), TestMethod::HeldOutGain);
    let mut location = Location::new(Channel::JointTorque, [], Subsystem::Tool, Regime::new(Feature::Posture, "with posture"));
    location.time_intervals.push(Interval::new("raven_teleop_2024-01-01", 12.1, 30.0));
    let model = Artifact::new("corrected.toml", Format::Toml);
    report.verdicts =
        vec![Verdict::primary(1, Physics::Payload, 0.97, location, (vec![mass], vec![fit], vec![gain]), model.clone())];
    report.corrected_model = Some(model);
    let replay = "the logged torque command of the shoulder differs from the controller's by 21 % RMS";
    report.data_quality.push(DataQuality::new("command_replay", Level::Fail, replay).value(21.0, "%"));
    report.inputs.runs.push(Run::new("rest", RunRole::Null, 5.0, 1000.0, HASH));
    report
}

/// Every report there is, with a name.
pub(crate) fn all() -> Vec<(&'static str, Report)> {
    vec![
        ("explained", explained()),
        ("none", none()),
        ("partly-explained", partly_explained()),
        ("unmodelled", unmodelled()),
        ("insufficient", insufficient()),
        ("no-mismatch", no_mismatch()),
        ("explained-with-failure", explained_with_failure()),
    ]
}
