//! What was found, as a report.

use std::time::{Instant, SystemTime};

use gap_report::{
    Access, Artifact, Calibration, Channel as Told, Confusable, DataQuality, Evidence, ExcessRms, Feature, Fit as FitFigure,
    Format, Identifiable, Inputs, Interval, Level, Location, MODEL_ERROR, Mismatch, Motion, Parameter, Physics, Pictures, Regime,
    Remaining, Report, Role, Run as ToldRun, RunKind, RunRole, Score, Simulator, Space, Status, Subsystem, TestMethod, Timing,
    Tool, Verdict, ranked, timestamp,
};

use crate::cell::Channel;
use crate::controller::Changed;
use crate::corrected::Corrected;
use crate::found::{Found, Outcome};
use crate::given::{Given, Options};
use crate::held_out::Refused;
use crate::hypothesis::{Candidate, NEVER, STEADY_FORCE, UNMODELLED, Window, shift};
use crate::intervals::{Edge, Estimate};
use crate::pictures;
use crate::robot::Robot;
use crate::run::{Extent, Run};
use crate::search::{Effect, Scored, confused, is_uneven, likelihood, numbers_beyond};
use crate::split::{cut, held_out_of};
use crate::told::{cell_name, cell_quantity, cell_unit, joints, main_cell, told};
use crate::unexplained::{Pattern, Unexplained};
use crate::{experiment, regime, region};

/// A report of runs that are too few or too short.
pub(crate) fn insufficient(
    robot: &Robot,
    runs: &[Extent],
    given: &[Given],
    options: &Options,
    data_quality: Vec<DataQuality>,
    begun: Instant,
) -> Outcome {
    let mut report = bare(robot, runs, given, options, data_quality);
    report.status = Status::InsufficientData;
    report.timing.total_s = begun.elapsed().as_secs_f64();
    report.summary = gap_report::headlines(&report).join(" ");
    Outcome { report, pictures: Pictures::default(), corrected: None, left_out: Vec::new(), left: f64::NAN, elsewhere: 0.0 }
}

/// The whole report.
pub(crate) fn outcome(
    found: &Found,
    runs: &[Extent],
    given: &[Given],
    options: &Options,
    data_quality: Vec<DataQuality>,
    corrected: Option<Corrected>,
    again: &[Vec<FitFigure>],
) -> Outcome {
    let robot = found.robot;
    let mut report = bare(robot, runs, given, options, data_quality);
    let thresholds = &options.thresholds;
    let effects = &found.answer.effects;
    let channels: Vec<Told> = {
        let mut all: Vec<Told> = found.problem.cells.iter().map(|cell| told(cell.channel)).collect();
        all.dedup();
        all
    };
    let text = corrected.as_ref().map(Corrected::to_toml);
    let artifact = text.as_ref().map(|text| Artifact::new("corrected.toml", Format::Toml).sha256(sha256(text.as_bytes())));
    report.inputs.channels.clone_from(&channels);
    let mut verdicts = Vec::new();
    for (k, (effect, estimate)) in effects.iter().zip(found.estimates).enumerate() {
        let Some(artifact) = artifact.clone().filter(|_| effect.is_named()) else {
            verdicts.push(unnamed(found, k, effect, estimate));
            continue;
        };
        verdicts.extend(verdicts_of(found, k, effect, estimate, thresholds.nats, artifact));
        if let (Some(primary), Some(again)) =
            (verdicts.iter_mut().rev().find(|v: &&mut Verdict| v.role == Role::Primary), again.get(k))
        {
            primary.fit.extend(again.iter().cloned());
        }
    }
    let unnamed = found.controller.is_some()
        || found.unexplained.is_some()
        || found.refused.is_some()
        || effects.iter().any(|effect| !effect.is_named());
    if let (Some(refused), None) = (found.refused, found.controller) {
        verdicts.push(not_held(found, effects.len() as u64 + 1, refused));
    }
    if let Some(changed) = found.controller {
        verdicts.push(another_controller(found, effects.len() as u64 + 1, changed));
    }
    if let (Some(unexplained), None) = (&found.unexplained, found.controller) {
        verdicts.push(seen(found, effects.len() as u64 + 1, unexplained));
    }
    if found.unmodelled && !unnamed {
        verdicts.push(unmodelled(found, effects.len() as u64 + 1));
    }
    if verdicts.is_empty() {
        let next = found.answer.next.as_ref();
        let nats = next.map_or(0.0, |n| n.gain.nats);
        let claim = next.map_or("no hypothesis explains anything".to_owned(), |n| {
            let why = if nats < thresholds.nats {
                "gains less than is asked for"
            } else {
                "does not hold on what was held out, or not often enough"
            };
            format!("the best of all hypotheses, {}, {why}", n.candidate.family.physics.replace('_', " "))
        });
        let evidence = Evidence::new("search of the whole library", claim, (nats, "nats"), TestMethod::HeldOutGain);
        let probability = 1.0 / (1.0 + ((nats - thresholds.nats) / 2.0).exp());
        verdicts.push(Verdict::none(probability.clamp(0.5, 0.999), channels[0], vec![evidence]));
    }
    report.status = match (!effects.iter().any(Effect::is_named), found.unmodelled || unnamed) {
        (true, false) => Status::NoMismatch,
        (true, true) => Status::Unmodelled,
        (false, false) => Status::Explained,
        (false, true) => Status::PartlyExplained,
    };
    let detected = report.status != Status::NoMismatch;
    report.mismatch = Mismatch { detected, p_value: None, excess_rms: excess(found), extra: gap_report::Extra::default() };
    doubt_beside_unknowns(&mut verdicts);
    report.verdicts = ranked(verdicts);
    report.corrected_model = artifact;
    report.remaining = remaining(found);
    let failed = report.data_quality.iter().filter(|q| q.level == Level::Fail).map(gap_report::quality_headline);
    report.summary = failed.chain(gap_report::headlines(&report)).collect::<Vec<_>>().join(" ");
    Outcome {
        report,
        pictures: pictures::draw(found),
        corrected: text,
        left_out: corrected.map_or_else(Vec::new, |models| models.left_out),
        left: f64::NAN,
        elsewhere: 0.0,
    }
}

/// Everything but the answer.
fn bare(robot: &Robot, runs: &[Extent], given: &[Given], options: &Options, mut data_quality: Vec<DataQuality>) -> Report {
    // What is said of a simulation stands at its run.
    for told in &mut data_quality {
        let of_sim = |one: &&Given| one.sim.as_ref().is_some_and(|(sim, _)| told.run.as_ref() == Some(&sim.name));
        if let Some(one) = given.iter().find(of_sim) {
            told.run = Some(one.id.clone());
        }
    }
    let out = held_out_of(runs.len());
    let told_runs = runs.iter().zip(given).enumerate().map(|(k, (extent, one))| {
        let (seconds, rate) = (extent.seconds(), 1.0 / extent.dt_s);
        let mut run = if runs.len() == 1 {
            let (_, from) = cut(*extent);
            let held_out = (extent.time_s(from), extent.time_s(extent.samples));
            ToldRun::split(&one.id, held_out, seconds, rate, one.real_sha256.clone())
        } else {
            let role = if k + out >= runs.len() { RunRole::HeldOut } else { RunRole::Train };
            ToldRun::new(&one.id, role, seconds, rate, one.real_sha256.clone())
        };
        run.kind = RunKind::Real;
        run.samples = Some(extent.samples as u64);
        run.sim_sha256 = one.sim.as_ref().map(|(_, hash)| hash.clone());
        run
    });
    let with_sim = given.iter().any(|one| one.sim.is_some());
    let access = if with_sim { Access::RecordedOutput } else { Access::Builtin };
    let name = if with_sim { "recorded simulation" } else { "ravenpose" };
    Report {
        schema_version: "1.0.0".to_owned(),
        report_id: format!("gap-{}", &options.config_sha256[..12]),
        created: timestamp(SystemTime::now()),
        tool: Tool::ravenpose(options.config_sha256.clone(), options.seed),
        inputs: Inputs {
            robot: gap_report::Robot {
                name: robot.name.clone(),
                urdf_sha256: options.urdf_sha256.clone(),
                joints: robot.joints.clone(),
                extra: gap_report::Extra::default(),
            },
            simulator: Simulator { name: name.to_owned(), version: None, access, extra: gap_report::Extra::default() },
            runs: told_runs.collect(),
            channels: vec![Told::JointTorque],
            extra: gap_report::Extra::default(),
        },
        data_quality,
        status: Status::InsufficientData,
        summary: String::new(),
        mismatch: Mismatch { detected: false, p_value: None, excess_rms: Vec::new(), extra: gap_report::Extra::default() },
        verdicts: Vec::new(),
        corrected_model: None,
        remaining: Remaining {
            library_gain_nats: 0.0,
            flexible_gain_nats: 0.0,
            explained_share: None,
            depends_on: None,
            fit: None,
            extra: gap_report::Extra::default(),
        },
        calibration: Calibration {
            null_runs: 0,
            threshold_nats: options.thresholds.nats,
            false_alarm_upper95: None,
            probability_temperature: None,
            source: None,
            extra: gap_report::Extra::default(),
        },
        timing: Timing {
            read_s: None,
            screen_s: None,
            fit_s: None,
            simulate_s: None,
            total_s: 0.0,
            threads: None,
            extra: gap_report::Extra::default(),
        },
        plots: Vec::new(),
        sealed_case: None,
        extra: gap_report::Extra::default(),
    }
}

/// Weight of a rival beside the claim that was chosen, whose own is 1. A larger claim that holds the chosen one, and had to be better by more
/// than it is, is not the likelier one.
fn weight_beside(chosen: &Scored, rival: &Scored) -> f64 {
    let more = numbers_beyond(&rival.candidate, &chosen.candidate).max(0.0);
    likelihood(rival.score, chosen.score, more).exp().min(1.0)
}

/// Weight of an effect, of its rivals and of none of them together.
fn total_weight(effect: &Effect) -> f64 {
    let chosen = &effect.chosen;
    let none = likelihood(0.0, chosen.score, 0.0).exp();
    1.0 + effect.rivals.iter().map(|r| weight_beside(chosen, r)).sum::<f64>() + none
}

/// How probable a claim is at most that was taken in place of one that fits better: so many were right in opened sets (8 of 11).
const SECOND: f64 = 0.75;

/// And at most where its own interval holds that there is nothing: of three such names in an opened set two were wrong. (Not of hysteresis, whose
/// share of a straight spring says that alone; both of these were right.)
const MAY_BE_NOTHING: f64 = 0.5;

/// And at most where something without a name is in the same channel of the same joint, or in what its controller does: what no known physics says,
/// another one says in part. Of 18 such names in two opened sets 16 were wrong; in none of these sets are both there.
const BESIDE_AN_UNKNOWN: f64 = 0.5;

/// Takes names that stand beside something without one for no likelier than that, and all that they are confused with.
fn doubt_beside_unknowns(verdicts: &mut [Verdict]) {
    let is_unknown = |verdict: &&Verdict| verdict.role == Role::Primary && verdict.physics == Physics::Unmodelled;
    let unknown: Vec<Location> = verdicts.iter().filter(is_unknown).map(|verdict| verdict.location.clone()).collect();
    let beside = |place: &Location| {
        unknown.iter().any(|other| {
            let same_place = other.joint == place.joint || other.joint.iter().any(|joint| place.joint.contains(joint));
            same_place && (other.channel == place.channel || other.subsystem == Subsystem::Controller)
        })
    };
    let doubted = |verdict: &Verdict| {
        let is_named = !matches!(verdict.physics, Physics::Unmodelled | Physics::None);
        verdict.role == Role::Primary && is_named && verdict.probability > BESIDE_AN_UNKNOWN && beside(&verdict.location)
    };
    let shares: Vec<(u64, f64)> =
        verdicts.iter().filter(|verdict| doubted(verdict)).map(|v| (v.effect, BESIDE_AN_UNKNOWN / v.probability)).collect();
    for (effect, share) in shares {
        for verdict in verdicts.iter_mut().filter(|verdict| verdict.effect == effect) {
            verdict.probability *= share;
            verdict.set_probability = verdict.set_probability.map(|set| set * share);
            verdict.summary = verdict.summary.is_some().then(|| gap_report::headline(verdict));
        }
    }
}

/// The primary verdict of an effect and its alternatives.
fn verdicts_of(found: &Found, k: usize, effect: &Effect, estimate: &Estimate, threshold: f64, artifact: Artifact) -> Vec<Verdict> {
    let number = k as u64 + 1;
    let best = effect.chosen.score;
    let named = |r: &&Scored| r.candidate.family.physics != UNMODELLED;
    let close: Vec<&Scored> = effect.rivals.iter().filter(named).filter(|r| r.score > best - confused(best)).take(4).collect();
    let total = total_weight(effect);
    let candidate = &effect.chosen.candidate;
    let cell = main_cell(found.floors, candidate, &estimate.coefficients);
    let family = &candidate.family;
    let nothing = family.physics != "cable_hysteresis" && estimate.may_be_nothing(family);
    let caps = [(effect.second, SECOND), (nothing, MAY_BE_NOTHING)];
    let at_most = caps.iter().filter(|(holds, _)| *holds).fold(1.0, |least: f64, (_, cap)| least.min(*cap));
    let probability = (1.0 / total).min(at_most);
    let physics = physics(candidate);
    let mut location = location(found, k, effect.share);
    location.workspace_region = region::of_effect(found, k, cell);
    let fit = fits(found, k);
    let score = Score {
        folds: Some(found.problem.block_count as u64),
        threshold_nats: Some(threshold),
        n_parameters: Some(estimate.parameters.len() as u64),
        ..Score::new(effect.gain.nats, effect.gain.error)
    };
    let claim = format!("explains {:.0} % of what is left where it shows most", 100.0 * effect.share);
    let mut evidence =
        Evidence::new("held-out gain over all other effects", claim, (effect.gain.nats, "nats"), TestMethod::HeldOutGain);
    evidence.effect = None;
    let uneven = is_uneven(&effect.gain).then(|| {
        let claim = "its gain comes from a few blocks; how much of the squared error it explains, block by block, over the standard error of that";
        Evidence::new(
            "squared error explained, block by block",
            claim,
            (effect.gain.explained, "standard errors"),
            TestMethod::HeldOutGain,
        )
    });
    let size = crate::parameters::beside(found.robot, found.nominal, candidate, &estimate.coefficients);
    let size =
        size.map(|(name, value, unit)| Evidence::new(name, format!("{value:.3e} {unit}"), (value, unit), TestMethod::HeldOutGain));
    let mut verdict = Verdict::primary(
        number,
        physics.clone(),
        probability,
        location.clone(),
        (told_parameters(found, candidate, estimate), fit, std::iter::once(evidence).chain(uneven).chain(size).collect()),
        artifact,
    );
    verdict.score = Some(score);
    if !close.is_empty() {
        let with: Vec<Confusable> = close
            .iter()
            .map(|rival| {
                let mut one = Confusable::new(self::physics(&rival.candidate), "predicts the held-out data about as well");
                one.joint = Some(joints(found.robot, &rival.candidate));
                one.score_difference_nats = Some(best - rival.score);
                one
            })
            .collect();
        let set = probability + close.iter().map(|r| weight_beside(&effect.chosen, r) / total).sum::<f64>();
        let rivals: Vec<Physics> = std::iter::once(physics).chain(close.iter().map(|r| self::physics(&r.candidate))).collect();
        verdict = verdict.confusable(with, set.min(1.0), experiment::suggest(found.robot, candidate, &close, rivals));
    }
    verdict.summary = Some(gap_report::headline(&verdict));
    let alternatives =
        effect.rivals.iter().filter(named).take(3).filter(|r| weight_beside(&effect.chosen, r) / total > 0.005).map(|rival| {
            let place = Location::new(
                told(rival.candidate.family.channel),
                joints(found.robot, &rival.candidate),
                regime::subsystem(&rival.candidate),
                regime::regime(&rival.candidate),
            );
            let numbers = crate::parameters::parameters(
                found.robot,
                found.nominal,
                &rival.candidate,
                &rival.coefficients,
                &rival.candidate.shape,
            );
            let numbers = numbers
                .into_iter()
                .filter(|n| n.value.is_finite())
                .map(|n| Parameter::new(n.name, n.value, n.unit, [n.value, n.value]))
                .map(|parameter| with_its_way(found.robot, &rival.candidate, parameter))
                .collect();
            Verdict::alternative(
                number,
                self::physics(&rival.candidate),
                weight_beside(&effect.chosen, rival) / total,
                place,
                numbers,
                Vec::new(),
            )
        });
    std::iter::once(verdict).chain(alternatives.collect::<Vec<_>>()).collect()
}

fn physics(candidate: &Candidate) -> Physics {
    candidate.family.physics.parse().expect("families have names of the vocabulary")
}

/// Unit of a coupling by a joint that slides, for which the vocabulary has none.
fn unit_of_coupling(robot: &Robot, candidate: &Candidate, name: &str) -> Option<&'static str> {
    let &[moved, mover] = candidate.family.joints.as_slice() else { return None };
    (name == "c_ij" && robot.prismatic[mover]).then(|| if robot.prismatic[moved] { "m/m" } else { "rad/m" })
}

fn told_parameters(found: &Found, candidate: &Candidate, estimate: &Estimate) -> Vec<Parameter> {
    let sliding = candidate.family.joints.first().is_some_and(|j| found.robot.prismatic.get(*j).copied().unwrap_or(false));
    let motion = if sliding { Motion::Prismatic } else { Motion::Revolute };
    estimate
        .parameters
        .iter()
        .filter(|(named, interval)| named.value.is_finite() && interval.iter().all(|x| x.is_finite()))
        .map(|(named, interval)| {
            let of = Parameter::of(&physics(candidate), named.name, motion, named.value, *interval);
            let mut parameter = of.unwrap_or_else(|| Parameter::new(named.name, named.value, named.unit, *interval));
            named.unit.clone_into(&mut parameter.unit);
            if let Some(unit) = unit_of_coupling(found.robot, candidate, named.name) {
                parameter.extra.set(gap_report::TRUE_UNIT, unit);
            }
            // Bearings carry what the joints do not feel of it.
            if candidate.family.form == STEADY_FORCE && candidate.columns.len() < 3 {
                parameter.identifiable = Identifiable::No;
            }
            with_its_way(found.robot, candidate, parameter.method(gap_report::CiMethod::Sandwich))
        })
        .collect()
}

/// A link that is not longer but moved: which way.
fn with_its_way(robot: &Robot, candidate: &Candidate, mut parameter: Parameter) -> Parameter {
    if let Some(along) = shift(&robot.arm, &candidate.family).and_then(|shift| shift.along) {
        parameter.extra.set(gap_report::ALONG, along);
    }
    parameter
}

/// Name and link of the site where a payload was found.
fn site(found: &Found, candidate: &Candidate) -> Option<String> {
    if candidate.family.form != "at a site" {
        return None;
    }
    let link = candidate.shape_of("link")? as usize;
    let at = ["c_x", "c_y", "c_z"].map(|name| candidate.shape_of(name).unwrap_or(f64::NAN));
    let site = found.robot.payload_sites.iter().find(|site| site.link == link && site.position_m == at)?;
    let place = site.name.clone().unwrap_or_else(|| "a payload site".to_owned());
    Some(format!("{place} (link {}, {:.3}, {:.3}, {:.3} m)", found.robot.links[link], at[0], at[1], at[2]))
}

fn location(found: &Found, k: usize, share: f64) -> Location {
    let (candidate, estimate) = (&found.answer.effects[k].chosen.candidate, &found.estimates[k]);
    let cell = &found.problem.cells[main_cell(found.floors, candidate, &estimate.coefficients)];
    let mut regime = regime::regime(candidate);
    if let Some(place) = site(found, candidate) {
        regime.condition = format!("with posture: the weight hangs at {place}");
    }
    regime.energy_share = Some(share.clamp(0.0, 1.0));
    let mut location = Location::new(told(cell.channel), joints(found.robot, candidate), regime::subsystem(candidate), regime);
    location.energy_share = Some(share.clamp(0.0, 1.0));
    let fitted = found.problem.pairs.iter().enumerate().map(|(r, pair)| {
        let edges = estimate.windows.get(r).or(estimate.windows.first());
        (pair, candidate.window_of(r), edges)
    });
    let held = found.held.pairs.iter().enumerate().map(|(r, pair)| {
        let window = found.window_there(k, r);
        // As it was fitted, or as it is there.
        let as_fitted = candidate.windows.as_ref().is_some_and(|windows| windows.in_all() == Some(window));
        (pair, window, estimate.windows.first().filter(|_| as_fitted))
    });
    if candidate.windows.is_some() || found.held_windows[k].is_some() {
        for (pair, window, edges) in fitted.chain(held).filter(|(_, window, _)| *window != NEVER) {
            let told = interval(&pair.real.run, window, edges);
            match location.time_intervals.last_mut() {
                // The last third of a single run, which is held out, goes on where the rest ended.
                Some(last) if last.run == told.run && told.end_s > told.start_s && told.start_s < last.end_s + BETWEEN_S => {
                    (last.end_s, last.end_ci95_s) = (told.end_s, told.end_ci95_s);
                }
                Some(last) if last.run == told.run && told.end_s <= told.start_s => {}
                _ => location.time_intervals.push(told),
            }
        }
    }
    location
}

/// Longer than what is left out between the fitted part of a single run and the rest, s.
const BETWEEN_S: f64 = 1.5;

/// A window in a run, on the run's own clock, with the intervals of its edges where they are known.
fn interval(run: &Run, window: Window, known: Option<&[Option<Edge>; 2]>) -> Interval {
    let (first, last) = (run.told_s(run.start_s), run.told_s(run.time_s(run.len() - 1)));
    let start_s = run.told_s(run.start_s - run.since_s);
    let at = |edge: usize, open: f64| if window[edge].is_finite() { (start_s + window[edge]).clamp(first, last) } else { open };
    let mut told = Interval::new(&run.id, at(0, first), at(1, last));
    let ci = |edge: usize| known.and_then(|edges| edges[edge]).map(|(_, ci)| ci.map(|t| (start_s + t).max(0.0)));
    (told.start_ci95_s, told.end_ci95_s) = (ci(0), ci(1));
    told
}

/// Ids of the held-out runs.
fn held_ids(found: &Found) -> Vec<String> {
    found.held.pairs.iter().map(|pair| pair.real.run.id.clone()).collect()
}

fn fits(found: &Found, k: usize) -> Vec<FitFigure> {
    let (candidate, theta) = (&found.answer.effects[k].chosen.candidate, &found.estimates[k].coefficients);
    let main = main_cell(found.floors, candidate, theta);
    // A joint that stands in what was held out has no torque there: then where the effect is highest of what there is.
    let height = |c: usize| candidate.rms(c, theta) / found.floors[c].max(1e-300);
    let there = |c: usize| found.before_and_after(c).map(|at| (c, at));
    let others = || (0..found.floors.len()).filter_map(there).max_by(|(a, _), (b, _)| height(*a).total_cmp(&height(*b)));
    let Some((cell, (c, before, after))) = there(main).or_else(others) else { return Vec::new() };
    let of = &found.problem.cells[cell];
    let there = &found.held.cells[c];
    let pair = (there.rms(&before), there.rms(&after));
    let floor = Some((found.floors[cell], found.floor_methods[cell]));
    let (quantity, unit) = (cell_quantity(found.robot, of), cell_unit(found.robot, of));
    let mut fit = FitFigure::rms(quantity, unit, Space::EquationError, pair, floor, held_ids(found));
    if found.is_absent(k) || height(cell) == 0.0 {
        fit.removed_fraction = None;
        fit.extra.set(gap_report::ABSENT, true);
    }
    vec![fit]
}

fn excess(found: &Found) -> Vec<ExcessRms> {
    found
        .problem
        .cells
        .iter()
        .enumerate()
        .map(|(c, cell)| {
            let size = cell.rms(&cell.residual);
            let rows = cell.says().into_iter().filter(|says| *says).count();
            let mut extra = gap_report::Extra::default();
            if !cell.missed.is_empty() {
                extra.set(MODEL_ERROR, cell.rms(&cell.missed));
            }
            ExcessRms {
                channel: told(cell.channel),
                // An axis of the tip is no joint.
                joint: (cell.channel != Channel::EndEffector).then(|| cell_name(found.robot, cell)),
                value: (size * size - found.floors[c].powi(2)).max(0.0).sqrt(),
                unit: cell_unit(found.robot, cell).to_owned(),
                noise_floor: found.floors[c],
                n_effective: Some(rows as f64 / found.answer.scorer.correlation[c]),
                extra,
            }
        })
        .collect()
}

fn unmodelled(found: &Found, number: u64) -> Verdict {
    let (c, nats) = found.ceiling.cell.unwrap_or((0, 0.0));
    let cell = &found.problem.cells[c];
    let joint = if cell.channel == Channel::EndEffector { Vec::new() } else { vec![cell_name(found.robot, cell)] };
    let regime = Regime::new(Feature::All, format!("depends on {}", found.ceiling.depends_on.join(", ")));
    let location = Location::new(told(cell.channel), joint, Subsystem::Unknown, regime);
    let claim = "a predictor that knows no physics does far better than every hypothesis";
    let evidence = Evidence::new("flexible ceiling", claim, (nats, "nats"), TestMethod::HeldOutGain);
    let share = found.ceiling.library_nats.max(0.0) / found.ceiling.together_nats.max(1e-9);
    Verdict::unmodelled(number, (1.0 - share).clamp(0.5, 0.99), location, evidence)
}

/// The verdict of a controller that is not the simulation's.
fn another_controller(found: &Found, number: u64, changed: Changed) -> Verdict {
    let unit = if found.robot.prismatic[changed.joint] { "N" } else { "N.m" };
    let [missed, left] = changed.missed;
    let regime = Regime::new(Feature::All, "depends on tracking error".to_owned());
    let joint = vec![found.robot.joints[changed.joint].clone()];
    let claim = format!(
        "the simulation's control law misses the recorded torque by {missed:.3e} {unit} RMS, {left:.1e} with {:.2} times its \
         proportional gain",
        changed.gain
    );
    let evidence = Evidence::new("control law learnt from the simulation", claim, (missed, unit), TestMethod::HeldOutGain);
    Verdict::unmodelled(number, 0.9, Location::new(Told::Command, joint, Subsystem::Controller, regime), evidence)
}

/// The verdict of what is there where nothing explains it.
fn seen(found: &Found, number: u64, unexplained: &Unexplained) -> Verdict {
    let cell = &found.problem.cells[unexplained.cell];
    let unit = cell_unit(found.robot, cell);
    let (places, pattern) = match unexplained.pattern {
        Pattern::Seldom => {
            let share = 100.0 * unexplained.share;
            ("in few places".to_owned(), format!("{share:.0} % of it in few places: too seldom to be held against other data"))
        }
        Pattern::Again { frequency_hz } => (
            format!("comes again, mostly at {frequency_hz:.2} Hz"),
            format!("foreseen by its own past, as noise is not: it comes again, mostly at {frequency_hz:.2} Hz"),
        ),
        Pattern::Mostly => ("nearly all the time".to_owned(), "left by what has a name, nearly all the time".to_owned()),
    };
    let regime = Regime::new(Feature::Time, places);
    let mut location = Location::new(told(cell.channel), vec![cell_name(found.robot, cell)], Subsystem::Unknown, regime);
    location.energy_share = Some(unexplained.share.clamp(0.0, 1.0));
    location.time_intervals = unexplained
        .stretches
        .iter()
        .map(|&(run, [from, to])| {
            let run = &found.problem.pairs[run].real.run;
            let told = |at: f64| run.told_s(run.start_s + at);
            Interval::new(&run.id, told(from), told(to))
        })
        .collect();
    let (rms, floor) = (unexplained.rms, unexplained.floor);
    let claim = format!("{rms:.3e} {unit} RMS where noise alone gives {floor:.1e}, {pattern}");
    Verdict::unmodelled(number, 0.9, location, Evidence::new("size over the noise floor", claim, (rms, unit), TestMethod::Gate))
}

/// The verdict of an effect whose explanation does not hold on what was held out.
fn not_held(found: &Found, number: u64, refused: &Refused) -> Verdict {
    let candidate = &refused.effect.chosen.candidate;
    let cell = &found.problem.cells[refused.cell];
    let (unit, [without, with]) = (cell_unit(found.robot, cell), refused.rms);
    let regime = Regime::new(Feature::All, format!("depends on {}", refused.goes_with()));
    let mut location = Location::new(told(cell.channel), joints(found.robot, candidate), Subsystem::Unknown, regime);
    location.energy_share = Some(refused.effect.share.clamp(0.0, 1.0));
    let claim = format!(
        "{} explains what was fitted, but what was held out differs by {with:.3e} {unit} RMS with it and by {without:.3e} without",
        candidate.family.physics.replace('_', " ")
    );
    Verdict::unmodelled(number, 0.9, location, Evidence::new("held-out data", claim, (with, unit), TestMethod::HeldOutGain))
}

/// The verdict of an effect that the vocabulary has no name for.
fn unnamed(found: &Found, k: usize, effect: &Effect, estimate: &Estimate) -> Verdict {
    let candidate = &effect.chosen.candidate;
    let cell = &found.problem.cells[main_cell(found.floors, candidate, &estimate.coefficients)];
    let regime = Regime::new(Feature::All, format!("depends on {}", candidate.family.form));
    let mut location = Location::new(told(cell.channel), joints(found.robot, candidate), Subsystem::Unknown, regime);
    location.energy_share = Some(effect.share.clamp(0.0, 1.0));
    let total = total_weight(effect);
    let claim = format!("a term in {} explains more than every physics that has a name", candidate.family.form);
    let evidence =
        Evidence::new("held-out gain over all other effects", claim, (effect.gain.nats, "nats"), TestMethod::HeldOutGain);
    Verdict::unmodelled(k as u64 + 1, (1.0 / total).clamp(0.01, 0.999), location, evidence)
}

fn remaining(found: &Found) -> Remaining {
    let ceiling = found.ceiling;
    let unnamed: Vec<String> = found
        .answer
        .effects
        .iter()
        .filter(|e| !e.is_named())
        .map(|e| e.chosen.candidate.family.form)
        .chain(found.controller.map(|_| "tracking error"))
        .chain(found.refused.filter(|_| found.controller.is_none()).map(Refused::goes_with))
        .map(str::to_owned)
        .chain(found.unexplained.as_ref().map(|unexplained| match unexplained.pattern {
            Pattern::Seldom | Pattern::Mostly => "time".to_owned(),
            Pattern::Again { frequency_hz } => format!("time, mostly at {frequency_hz:.2} Hz"),
        }))
        .collect();
    // Of what was gained, the part that has names.
    let gained = |named: bool| found.answer.effects.iter().filter(|e| !named || e.is_named()).map(|e| e.gain.nats).sum::<f64>();
    let named = if found.answer.effects.is_empty() { 1.0 } else { gained(true) / gained(false).max(1e-9) };
    let share = if ceiling.together_nats > 0.0 { (ceiling.library_nats / ceiling.together_nats).clamp(0.0, 1.0) } else { 1.0 };
    Remaining {
        library_gain_nats: ceiling.library_nats,
        flexible_gain_nats: ceiling.together_nats,
        // Neither the library nor the ceiling sees what nothing explains.
        explained_share: found.unexplained.is_none().then(|| (share * named).clamp(0.0, 1.0)),
        depends_on: (found.unmodelled || !unnamed.is_empty()).then(|| {
            let of_ceiling = ceiling.depends_on.iter().copied().filter(|_| found.unmodelled).map(str::to_owned);
            unnamed.into_iter().chain(of_ceiling).collect()
        }),
        fit: None,
        extra: gap_report::Extra::default(),
    }
}

/// Hash of bytes in lower-case hexadecimal digits.
pub fn sha256(bytes: &[u8]) -> String {
    // Bytes in memory can be read.
    sha256_of(bytes).unwrap_or_default()
}

/// Hash of what a reader gives, to its end, in lower-case hexadecimal digits.
///
/// # Errors
/// The reader's.
pub fn sha256_of(mut reader: impl std::io::Read) -> std::io::Result<String> {
    use sha2::{Digest, Sha256};
    use std::fmt::Write as _;

    let mut hash = Sha256::new();
    let mut room = vec![0; 1 << 16];
    loop {
        match reader.read(&mut room)? {
            0 => break,
            read => hash.update(&room[..read]),
        }
    }
    Ok(hash.finalize().iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    }))
}
