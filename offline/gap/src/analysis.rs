//! From runs to a report: prepare, learn, search, judge on what was held out, put into words.

use std::io::Write as _;
use std::time::Instant;

use gap_report::{
    Channel as Told, DataQuality, Fit, FloorMethod, Level, Physics, Report, Role, Run as ToldRun, RunRole, Space, Status, Verdict,
};
use recordings::Recording;
use simulator::model::RobotModel;

use crate::found::{Found, Outcome};
use crate::gates;
use crate::given::{Given, Options};
use crate::held_out::{HeldOut, beside, left, sized};
use crate::hypothesis::{Candidate, Dictionary, LATE_TORQUES, besides};
use crate::intervals::{Estimate, estimates};
use crate::motion::{Band, Motion};
use crate::nominal::Nominal;
use crate::pair::Pair;
use crate::problem::Problem;
use crate::robot::Robot;
use crate::run::{Both, Extent, Run, alike, as_noisy, common, in_one_unit_of_time};
use crate::run_error::RunError;
use crate::search::{Answer, Effect, Thresholds, search};
use crate::split::{HELD_OUT, held_out_of, split};
use crate::told::{cell_quantity, cell_unit};
use crate::{
    builtin, channels, closed_loop, comparable, corrected, counts, flexible, floors, known, lag, parallel, unexplained, verdicts,
};

/// Why there is no report.
#[derive(Debug, thiserror::Error)]
pub enum AnalysisError {
    /// A run cannot be used.
    #[error(transparent)]
    Run(#[from] RunError),
    /// No channel at all.
    #[error(
        "{run}: has neither torque nor joint or tip truth beside positions; record tau or dac, truth_jpos or truth_x, truth_y, truth_z"
    )]
    NoChannel {
        /// The first run.
        run: String,
    },
    /// Torques alone, of joints that hardly move.
    #[error(
        "{run}: no joint moves more than 0.01 rad or 1 mm, so that its torque says nothing; move every joint through some of its range"
    )]
    Standing {
        /// The first run.
        run: String,
    },
    /// No channel that all have.
    #[error(
        "nothing to compare: {lacks}; give runs that all have the same channel, and a simulation with the recording's, or leave --sim out to \
         compare with the robot model"
    )]
    OneSided {
        /// Who lacks what.
        lacks: String,
    },
    /// The library of explanations does not fit.
    #[error(
        "{minutes:.0} minutes to explain need some {needs_gib:.1} GiB of memory, {free_gib:.1} are free; take stretches of a few minutes \
         with `ravenpose convert --from S --to S`, of a simulation the same ones, and give each of them as a run"
    )]
    Memory {
        /// Length of what is fitted on.
        minutes: f64,
        /// What it needs.
        needs_gib: f64,
        /// What there is.
        free_gib: f64,
    },
}

/// The clock of a simulation is not the recording's.
fn another_clock(one: &Given, lag_s: f64) -> DataQuality {
    let (ms, when) = (lag_s.abs() * 1e3, if lag_s > 0.0 { "later" } else { "earlier" });
    let message = format!(
        "the simulation of {} has the same commands {ms:.1} ms {when} than the recording: its clock is another one, and was set back by that; give \
         both on one clock",
        one.id
    );
    DataQuality::new("same_clock", Level::Warn, message).run(one.id.clone()).value(lag_s, "s")
}

/// Where the simulations of some runs could be compared sample by sample, and that of another cannot.
fn only_taught(runs: &[Both], comparable: &[bool]) -> Option<DataQuality> {
    let at_odds = runs.iter().zip(comparable).find(|(_, comparable)| !**comparable).filter(|_| comparable.contains(&true));
    at_odds.map(|((real, _), _)| {
        let message = format!(
            "the simulation of {} moves otherwise than the recording, so that no simulation is compared sample by sample: they only say what to \
             believe of the robot; leave that run out to compare the others with theirs",
            real.id
        );
        DataQuality::new("same_motion", Level::Warn, message).run(real.id.clone())
    })
}

/// Least length of what is fitted on, s.
const SHORTEST_S: f64 = 6.0;
/// Least length of any run, s.
const MOMENT_S: f64 = 1.0;
/// Fewest rows of a run.
const LEAST_ROWS: usize = 20;
/// Of what follows the smoothing at its peak, per row of the fit and joint, a tenth to spare (`examples/resources.rs`, 20 minutes).
const LIBRARY_BYTES: f64 = 24_000.0;
/// Length of a block, s; long runs take longer ones.
const BLOCK_S: f64 = 1.5;
/// Most blocks; of many runs two for each all the same.
const BLOCKS: f64 = 40.0;
/// Times the noise floor that may be left of held-out runs where a robot's own numbers are taken at their word,
const FLOOR: f64 = 2.0;
/// or share of the removable error that has to be gone.
const REMOVED: f64 = 0.95;
/// Share of its torque that the model of a simulator leaves; real robots leave a tenth and more.
const OF_A_MODEL: f64 = 0.05;
/// Logarithm of what rough numbers may leave more: they fit less of what only this recording has.
const ABOUT: f64 = 0.4;
/// Times what is left of what was fitted, from which on what was held out is looked at by itself; noise differs less from run to run.
const ELSEWHERE: f64 = 1.25;
/// Times what effects leave of what was fitted, from which on it is told that they leave so much more of what was held out.
const MORE_THERE: f64 = 3.0;
/// The library has to reach this share of the ceiling's gain.
const REACH: f64 = 0.6;

/// Runs the whole analysis. Where what was fitted agrees and the runs that were held out do not, these are analysed by themselves: a cable may
/// slip in the last run.
///
/// # Errors
/// [`AnalysisError`] where there is nothing to compare; everything else ends in a report.
pub fn analyse(
    model: &RobotModel,
    given: &[Given],
    options: &Options,
    progress: &mut dyn FnMut(&str),
) -> Result<Outcome, AnalysisError> {
    let mut whole = analyse_runs(model, given, options, progress)?;
    if whole.report.status != Status::NoMismatch || whole.elsewhere < ELSEWHERE || given.len() < 2 {
        return Ok(whole);
    }
    progress("what was held out, by itself");
    let first = given.len() - held_out_of(given.len());
    let ids = |given: &[Given]| given.iter().map(|one| one.id.as_str()).collect::<Vec<_>>().join(", ");
    let (agree, differ) = (ids(&given[..first]), ids(&given[first..]));
    let told = |message: String| DataQuality::new("runs_differ", Level::Warn, message);
    // What cannot be analysed by itself leaves the answer of all together.
    match analyse(model, &given[first..], options, progress) {
        Ok(mut held) if says_more(&held.report, whole.elsewhere) => {
            let of_runs =
                |quality: &DataQuality| quality.run.as_ref().is_some_and(|id| given[..first].iter().any(|one| one.id == *id));
            held.report.data_quality.extend(whole.report.data_quality.into_iter().filter(of_runs));
            held.report.data_quality.push(told(format!("nothing is missing in {agree}; what is said is of {differ}")));
            let agreeing = whole.report.inputs.runs.into_iter().take(first).map(|run| ToldRun { role: RunRole::Null, ..run });
            held.report.inputs.runs.splice(0..0, agreeing);
            Ok(held)
        }
        _ => {
            if whole.elsewhere > MORE_THERE {
                let message =
                    format!("{:.1} times as much is left of {differ} as of {agree}, and nothing says why", whole.elsewhere);
                whole.report.data_quality.push(told(message));
            }
            Ok(whole)
        }
    }
}

/// Does a run by itself say more than all together, which agree? A name does; what has none may be noise that differs, if it is not large.
fn says_more(report: &Report, times_more: f64) -> bool {
    match report.status {
        Status::Explained | Status::PartlyExplained => true,
        Status::Unmodelled => times_more > MORE_THERE,
        Status::NoMismatch | Status::InsufficientData => false,
    }
}

/// One analysis of runs together.
///
/// Where no simulation is given, the robot's own numbers are taken at their word first. If something is left that they and the
/// library do not explain, they are believed but roughly, if that leaves less: a lab's numbers of a real robot are.
fn analyse_runs(
    model: &RobotModel,
    given: &[Given],
    options: &Options,
    progress: &mut dyn FnMut(&str),
) -> Result<Outcome, AnalysisError> {
    let simulated = parallel::map(given, |one| if one.sim.is_some() { None } else { builtin::simulated(model, &one.real) });
    let taken = Taken { at_its_word: true, shaken: false };
    let mut at_its_word = analyse_with(model, given, options, (&simulated, taken), progress)?;
    if may_shake(&at_its_word.report) {
        progress("the links, shaken on their cables");
        let shaken = analyse_with(model, given, options, (&simulated, Taken { shaken: true, ..taken }), progress)?;
        // What the encoders of the joints tell of it may be no more than their noise.
        if shaken.left < at_its_word.left && unexplained(&shaken) <= unexplained(&at_its_word) {
            at_its_word = shaken;
        }
    }
    let stands_in = simulated.iter().any(Option::is_some);
    if !stands_in || reaches_floor(&at_its_word.report) {
        return Ok(at_its_word);
    }
    progress("the robot's numbers, believed roughly");
    // The numbers are taken roughly, but the model's own effects are there.
    let along = |one: &Given| builtin::along_motion(model, &one.real).ok();
    let effects: Vec<_> = if model.effects().is_empty() { Vec::new() } else { parallel::map(given, along) };
    let roughly = analyse_with(model, given, options, (&effects, Taken { at_its_word: false, shaken: false }), progress)?;
    // What is explained at its word is not explained better by what leaves more.
    let about = if unexplained(&at_its_word) > 0 { ABOUT } else { 0.0 };
    let better = unexplained(&roughly) < unexplained(&at_its_word).max(1) && roughly.left < at_its_word.left + about;
    Ok(if better { roughly } else { at_its_word })
}

/// How a robot and its recordings are taken.
#[derive(Debug, Clone, Copy)]
struct Taken {
    /// Are the robot's own numbers right?
    at_its_word: bool,
    /// Do the links shake on their cables?
    shaken: bool,
}

/// How much of an answer has no name.
fn unexplained(outcome: &Outcome) -> u8 {
    match outcome.report.status {
        Status::NoMismatch | Status::Explained | Status::InsufficientData => 0,
        Status::PartlyExplained => 1,
        Status::Unmodelled => 2,
    }
}

/// Does a motor ripple, or a cable give way while its signals seem late? Links shake on their cables then: their own encoders show how they
/// accelerate, the motors' do not.
fn may_shake(report: &Report) -> bool {
    let is_told = |physics: &[Physics]| {
        let primary = |verdict: &&Verdict| verdict.role == Role::Primary;
        report.verdicts.iter().filter(primary).any(|verdict| physics.contains(&verdict.physics))
    };
    let late =
        is_told(&[Physics::CableStretch, Physics::CableHysteresis, Physics::Backlash]) && is_told(&[Physics::MeasurementDelay]);
    report.inputs.channels.contains(&Told::Transmission) && (late || is_told(&[Physics::TorqueRipple]))
}

/// Does hardly anything but noise remain?
fn reaches_floor(report: &Report) -> bool {
    let reached = |fit: &Fit| {
        fit.removed_fraction.is_some_and(|removed| removed > REMOVED)
            || fit.noise_floor.is_some_and(|floor| fit.after <= FLOOR * floor)
    };
    match report.status {
        Status::NoMismatch | Status::InsufficientData => true,
        Status::Explained => {
            report.verdicts.iter().flat_map(|v| &v.fit).filter(|fit| fit.space == Space::EquationError).all(reached)
        }
        Status::PartlyExplained | Status::Unmodelled => false,
    }
}

fn analyse_with(
    model: &RobotModel,
    given: &[Given],
    options: &Options,
    (simulated, Taken { at_its_word, shaken }): (&[Option<Recording>], Taken),
    progress: &mut dyn FnMut(&str),
) -> Result<Outcome, AnalysisError> {
    let begun = Instant::now();
    let robot = Robot { simulates_itself: given.iter().all(|one| one.sim.is_none()), ..Robot::of(model) };
    progress("reading the runs");
    let mut runs = Vec::new();
    // Simulations that move otherwise, or at another time, than the recording.
    let mut apart: Vec<Run> = Vec::new();
    // Of each run: may its simulation be compared sample by sample?
    let mut comparable = vec![false; given.len()];
    let mut from_recording = false;
    let mut wrong = Vec::new();
    let mut clocks = Vec::new();
    for (k, one) in given.iter().enumerate() {
        let real = Run::new(&one.real, &robot)?;
        let sim = match &one.sim {
            Some((sim, _)) => {
                let mut sim = Run::new(sim, &robot)?;
                in_one_unit_of_time(&real, &sim)?;
                if let Some(lag_s) = lag::of_commands(&real, &sim) {
                    sim.start_s -= lag_s;
                    clocks.push(another_clock(one, lag_s));
                }
                Some(sim)
            }
            // What stands in for it, where it can.
            None => simulated.get(k).and_then(Option::as_ref).and_then(|sim| Run::new(sim, &robot).ok()),
        };
        // One that says what it is, is believed: our own simulator measures as noisily as the robot does.
        let says_so = one.sim.as_ref().is_some_and(|(sim, _)| sim.metadata.get("simulated").is_some_and(|value| value == "true"));
        let of_robot = |real: &Run, sim: &Run| one.sim.is_some() && !says_so && as_noisy(real, sim) && !of_a_model(&robot, sim);
        runs.push(match sim {
            Some(sim) => {
                // One as noisy as the recording is a recording of its own, whose noise would only be added.
                let recorded = of_robot(&real, &sim);
                from_recording |= recorded;
                let alike = alike(&robot, &real, &sim);
                if recorded || !alike {
                    apart.push(counts::read_alike(&robot, &real, sim.clone()));
                }
                comparable[k] = !recorded && alike;
                if !recorded && !alike && one.sim.is_some() {
                    let named = |run: &Run| Run { id: one.id.clone(), ..run.clone() };
                    wrong.extend(comparable::elsewhere(&robot, &named(&real), &sim));
                }
                // Of another rate: another run of its own, which says what to believe, and no more.
                if !alike && (real.dt_s - sim.dt_s).abs() > 0.01 * real.dt_s && sim.torque.is_some() {
                    (Run { id: one.id.clone(), ..real }, None)
                } else {
                    let (real, sim) = common(&real, &sim)?;
                    let sim = counts::read_alike(&robot, &real, sim);
                    (Run { id: one.id.clone(), ..real }, Some(sim))
                }
            }
            None => (Run { id: one.id.clone(), ..real }, None),
        });
    }
    let mut quality = gates::check(&robot, &runs);
    quality.append(&mut clocks);
    for one in given {
        quality.extend(one.notes.iter().map(|note| DataQuality::new("file", Level::Warn, note.clone()).run(one.id.clone())));
    }
    if model.as_raven().is_none() {
        quality.extend(gates::beyond(&robot, &given[0].real, &given[0].id));
    }
    // A simulation with its input reversed says nothing of the robot: the robot's own numbers stand in for it.
    if quality.iter().any(|q| q.check == "input_sign" && q.level == Level::Fail && q.message.contains("simulation")) {
        for run in &mut runs {
            run.1 = None;
        }
        apart.clear();
        wrong.clear();
    }
    if runs[0].0.torque.is_none() && runs[0].0.truth.is_none() && runs[0].0.tip.is_none() {
        return Err(AnalysisError::NoChannel { run: runs[0].0.id.clone() });
    }
    // Units and signs say more than that it moves otherwise; another recording of the robot moves as it likes.
    if !from_recording {
        wrong.splice(0..0, comparable::check(&robot, &runs));
    }
    if !wrong.is_empty() {
        let extents: Vec<Extent> = runs.iter().map(|(real, _)| real.extent()).collect();
        quality.splice(0..0, wrong);
        return Ok(verdicts::insufficient(&robot, &extents, given, options, quality, begun));
    }
    // With torques of their own they say what to believe of the robot, but not sample by sample.
    let mut apart: Vec<Run> = if apart.iter().all(|sim| sim.torque.is_some()) { apart } else { Vec::new() };
    let from_recording = from_recording && !apart.is_empty();
    if !apart.is_empty() {
        // All or none: residuals of which some hold the simulation's own and others do not are no one problem.
        if given.iter().all(|one| one.sim.is_some()) {
            quality.extend(only_taught(&runs, &comparable));
        }
        for (run, comparable) in runs.iter_mut().zip(&comparable) {
            apart.extend(run.1.take().filter(|_| *comparable));
        }
    }
    let by_lab: Vec<bool> = given.iter().map(|one| one.sim.is_some()).collect();
    let in_common = channels::in_common(&mut runs, &by_lab);
    quality.extend(in_common.map_err(|lacks| AnalysisError::OneSided { lacks })?);
    let band = if from_recording { Band::LEARNT } else { Band::of(&runs[0].0, &robot) };
    let extents: Vec<Extent> = runs.iter().map(|(real, _)| real.extent()).collect();
    let (train, held) = split(runs);
    let train_s: f64 = train.iter().map(|(run, _)| run.len() as f64 * run.dt_s).sum();
    let runs = train.iter().chain(&held).map(|(run, _)| run);
    let moment = runs.filter(|_| train_s >= SHORTEST_S).find(|run| (run.len() as f64) * run.dt_s < MOMENT_S);
    if train_s < SHORTEST_S || moment.is_some() {
        quality.insert(0, moment.map_or_else(|| too_short(train_s), a_moment));
        return Ok(verdicts::insufficient(&robot, &extents, given, options, quality, begun));
    }
    progress("smoothing");
    let pair = |(real, sim): Both| {
        let (real, sim) = parallel::both(|| Motion::new(real, band), || sim.map(|sim| Motion::new(sim, band)));
        let pair = Pair::new(real, sim);
        if shaken { pair.shaken() } else { pair }
    };
    let train: Vec<Pair> = parallel::map(train, pair);
    let held: Vec<Pair> = parallel::map(held, pair);
    let seen_s: f64 = train.iter().map(|pair| pair.real.rows.len() as f64 * band.for_period(pair.real.run.dt_s).step_s).sum();
    let empty = train.iter().chain(&held).map(|pair| &pair.real).find(|real| real.rows.len() < LEAST_ROWS);
    if seen_s < 0.5 * SHORTEST_S || empty.is_some() {
        let seldom = train.iter().chain(&held).find_map(|pair| Some(seldom_read(&pair.real.run, pair.real.run.rows_apart()?)));
        let empty = empty.filter(|_| seen_s >= 0.5 * SHORTEST_S).map(|real| real.run.id.as_str());
        quality.insert(0, seldom.unwrap_or_else(|| too_few(seen_s, empty)));
        return Ok(verdicts::insufficient(&robot, &extents, given, options, quality, begun));
    }
    fits(&train, train_s, robot.joint_count(), options.free_bytes)?;
    progress("learning what the simulator believes");
    let apart: Vec<Motion> = apart.into_iter().map(|sim| Motion::new(sim, band)).collect();
    let sims: Vec<&Motion> = train.iter().chain(&held).filter_map(|pair| pair.sim.as_ref()).chain(&apart).collect();
    let nominal =
        if sims.is_empty() || !at_its_word { Nominal::of(&robot) } else { Nominal::learn_with(&robot, &sims, from_recording) };
    quality.extend(gates::nominal(&robot, &nominal, &sims));
    let problem = Problem::new(&robot, &nominal, &train, BLOCK_S.max(train_s / BLOCKS));
    let prior = match (sims.is_empty() || !at_its_word, from_recording) {
        (true, _) => Prior::Believed,
        (false, true) => Prior::Drifting,
        (false, false) if !apart.is_empty() => Prior::Apart,
        (false, false) => Prior::Exact,
    };
    let mut problem = prior.put_on(problem);
    if problem.cells.is_empty() {
        if train[0].real.torque.is_none() {
            let lacks = "no tip of the simulation was seen when one of the recording was".to_owned();
            return Err(AnalysisError::OneSided { lacks });
        }
        // A torque is there, of joints that stand; the other channels are compared at rest too.
        return Err(AnalysisError::Standing { run: given[0].id.clone() });
    }
    let (floors, floor_methods): (Vec<f64>, Vec<FloorMethod>) = floors::floors(&problem).into_iter().unzip();
    // What the model gets wrong itself, and the forms of its own effects do, is no further effect.
    known::put_on(&mut problem, model, given, band);
    if robot.simulates_itself {
        problem.beyond_the_cycle();
    }
    let mut dictionary = Dictionary::new(&problem);
    let read_s = begun.elapsed().as_secs_f64();
    progress("searching the library");
    // Points have offset, play and coupling on every joint, and nothing else.
    let effects =
        if problem.of_points() { robot.joint_count().max(options.thresholds.effects) } else { options.thresholds.effects };
    let thresholds = Thresholds { effects, ..options.thresholds };
    let mut trace = |line| {
        if options.trace {
            // Nobody may listen any more.
            let _ = writeln!(std::io::stderr(), "{line}");
        }
    };
    let mut answer = search(&problem, &mut dictionary, &thresholds, &mut trace);
    let screen_s = begun.elapsed().as_secs_f64() - read_s;
    progress("sizes and intervals");
    let held_problem = prior.put_on(Problem::new(&robot, &nominal, &held, BLOCK_S));
    let mut held_dictionary = Dictionary::new(&held_problem);
    let sizes = |dictionary: &Dictionary, answer: &Answer| estimates(dictionary, &answer.scorer, &nominal, &robot, &answer.effects);
    let mut estimates = sizes(&dictionary, &answer);
    // What was held out bears the effects as well.
    let bear_there = |held: &mut Dictionary, answer: &Answer, estimates: &[Estimate]| {
        let all = sized(&answer.effects, estimates);
        let (there, _) = HeldOut { problem: &problem, dictionary: held, floors: &floors }.there(&all);
        held.bear(besides(held, there.iter().zip(all.iter().map(|(_, coefficients)| *coefficients))), |_| 1.0);
    };
    bear_there(&mut held_dictionary, &answer, &estimates);
    let said: Vec<Candidate> = answer.effects.iter().map(|effect| effect.chosen.candidate.clone()).collect();
    let refused = HeldOut { problem: &problem, dictionary: &held_dictionary, floors: &floors }.judge(
        &mut answer,
        &mut estimates,
        &|answer| sizes(&dictionary, answer),
        &thresholds,
        &mut trace,
    );
    let stays = |(own, effect): (&Candidate, &Effect)| own.same_form(&effect.chosen.candidate);
    if said.len() != answer.effects.len() || !said.iter().zip(&answer.effects).all(stays) {
        // What was taken back is borne no more, and what came in its place bears the others.
        answer = answer.bearing(&mut dictionary, &thresholds);
        estimates = sizes(&dictionary, &answer);
        bear_there(&mut held_dictionary, &answer, &estimates);
    }
    let held_out = HeldOut { problem: &problem, dictionary: &held_dictionary, floors: &floors };
    let ceiling = flexible::ceiling(&dictionary, &mut answer.scorer, &answer.grams, &answer.none, thresholds.nats);
    let beyond = ceiling.together_nats - ceiling.library_nats;
    let unmodelled = beyond_recording(&problem, &answer, &ceiling)
        && ceiling.cell.is_none_or(|(c, _)| {
            let left = crate::series::rms(left(&problem, c, &sized(&answer.effects, &estimates)).into_iter());
            left >= problem.practical.any[c].max(problem.own_error(c))
        })
        && beyond > 2.0 * options.thresholds.nats
        && ceiling.least_nats > options.thresholds.nats
        && ceiling.library_nats < REACH * ceiling.together_nats;
    let beside = beside(&problem, &answer.effects, &estimates);
    let (_, held_windows) = held_out.there(&sized(&answer.effects, &estimates));
    // What the controller acts on is what was logged, but where motors or torques are logged late.
    let late = answer.effects.iter().zip(&estimates).any(|(effect, estimate)| {
        let family = &effect.chosen.candidate.family;
        let motors = family.form == "joint encoders" && estimate.coefficients[0] < 0.0;
        family.physics == "measurement_delay" && (motors || LATE_TORQUES.contains(&family.form))
    });
    let simulated_by_lab = given.iter().all(|one| one.sim.is_some()) && !sims.is_empty();
    let found = Found {
        robot: &robot,
        nominal: &nominal,
        problem: &problem,
        dictionary: &dictionary,
        held: &held_problem,
        held_dictionary: &held_dictionary,
        answer: &answer,
        estimates: &estimates,
        held_windows: &held_windows,
        ceiling: &ceiling,
        floors: &floors,
        floor_methods: &floor_methods,
        beside: &beside,
        controller: (simulated_by_lab && !late)
            .then(|| crate::controller::changed(&problem, &sized(&answer.effects, &estimates)))
            .flatten(),
        learnt: !sims.is_empty(),
        unmodelled,
        refused: refused.as_ref(),
        // Only against a lab's own simulation: of a robot file it is known too roughly how far it is off.
        unexplained: (refused.is_none() && !unmodelled && !from_recording && simulated_by_lab)
            .then(|| match &sized(&answer.effects, &estimates)[..] {
                [] => unexplained::left(&problem, &floors),
                all => unexplained::mostly(&problem, &floors, all),
            })
            .flatten(),
    };
    progress("judging on what was held out");
    let corrected = answer.effects.iter().any(Effect::is_named).then(|| corrected::model(model, &found, (given, band)));
    progress("the corrected model, simulated");
    let judged_s = begun.elapsed().as_secs_f64();
    let again = match &corrected {
        Some(models) => closed_loop::again((&models.before, &models.there), &found, given, band),
        None => closed_loop::Again::default(),
    };
    let simulate_s = begun.elapsed().as_secs_f64() - judged_s;
    quality.extend(again.told.iter().cloned());
    let left_out = corrected.as_ref().map_or(&[][..], |models| &models.left_out);
    quality.extend(left_out.iter().map(|why| DataQuality::new("corrected_model", Level::Warn, format!("not in it: {why}"))));
    let mut outcome = verdicts::outcome(&found, &extents, given, options, quality, corrected, &again.fits);
    outcome.report.timing.simulate_s = Some(simulate_s);
    let left: Vec<f64> = (0..problem.cells.len())
        .filter_map(|c| found.before_and_after(c))
        .map(|(_, _, after)| crate::series::rms(after.into_iter()).max(1e-300).ln())
        .collect();
    outcome.left = crate::series::mean(&left);
    if matches!(prior, Prior::Exact) {
        outcome.elsewhere = times_more(&problem, &held_problem, &floors);
    }
    outcome.report.data_quality.extend(more_there(&found));
    outcome.report.timing.read_s = Some(read_s);
    outcome.report.timing.screen_s = Some(screen_s);
    outcome.report.timing.total_s = begun.elapsed().as_secs_f64();
    outcome.report.timing.threads = u64::try_from(parallel::cores()).ok();
    Ok(outcome)
}

/// Is the torque of a run that of rigid bodies with drives, as a simulator's is but for its noise?
fn of_a_model(robot: &Robot, sim: &Run) -> bool {
    let motion = Motion::new(sim.clone(), Band::of(sim, robot));
    let nominal = Nominal::learn(robot, std::slice::from_ref(&motion));
    let n = robot.joint_count();
    2 * (0..n).filter(|j| nominal.not_understood(*j) > OF_A_MODEL).count() <= n
}

/// How far the nominal model is to be trusted.
#[derive(Debug, Clone, Copy)]
enum Prior {
    /// The lab's own numbers, which no simulation has shown.
    Believed,
    /// Learnt from another recording.
    Drifting,
    /// Learnt from simulations that move otherwise.
    Apart,
    /// Learnt from simulations of the same motion.
    Exact,
}

impl Prior {
    fn put_on(self, problem: Problem) -> Problem {
        match self {
            Self::Believed => problem.believed_roughly(),
            Self::Drifting => problem.learnt_from_recording(),
            Self::Apart => problem.not_by_sample(),
            Self::Exact => problem,
        }
    }
}

/// Is what the effects leave, where the ceiling gains most, more than the nominal model leaves of the robot that it knows?
fn beyond_recording(problem: &Problem, answer: &Answer, ceiling: &flexible::Ceiling) -> bool {
    let Some((c, _)) = ceiling.cell else { return true };
    let within = answer.fit.within[c] / problem.cells[c].rows.len().max(1) as f64;
    !problem.from_recording || within.sqrt() > problem.practical.any[c]
}

/// Refuses what the library of explanations would fill more memory for than there is.
fn fits(train: &[Pair], train_s: f64, joints: usize, free_bytes: fn() -> Option<u64>) -> Result<(), AnalysisError> {
    let rows: usize = train.iter().map(|pair| pair.real.rows.len().max(pair.real.tip_rows.len())).sum();
    let needs = LIBRARY_BYTES * (rows * joints) as f64;
    let gib = |bytes: f64| bytes / f64::from(1 << 30);
    match free_bytes() {
        Some(free) if needs > free as f64 => {
            Err(AnalysisError::Memory { minutes: train_s / 60.0, needs_gib: gib(needs), free_gib: gib(free as f64) })
        }
        _ => Ok(()),
    }
}

fn too_short(seconds: f64) -> DataQuality {
    let needed = SHORTEST_S / (1.0 - HELD_OUT);
    DataQuality::new(
        "too_short",
        Level::Fail,
        format!("{seconds:.1} s are left to fit on; record at least {needed:.0} s, better two runs of 30 s, all joints moving"),
    )
    .value(seconds, "s")
}

/// A run that says nothing by itself.
fn a_moment(run: &Run) -> DataQuality {
    let seconds = run.len() as f64 * run.dt_s;
    let message = format!(
        "{} has {seconds:.1} s that can be compared, a run needs {MOMENT_S:.0} s at least; leave it out, or record a longer one",
        run.id
    );
    DataQuality::new("too_short", Level::Fail, message).run(run.id.clone()).value(seconds, "s")
}

/// Places that were read so seldom that what the log has between them is bridged over no more.
fn seldom_read(run: &Run, rows: usize) -> DataQuality {
    let ms = 1e3 * rows as f64 * run.dt_s;
    let message = format!(
        "positions of {} are new only every {rows} rows ({ms:.0} ms), the rows between repeat them; give every {rows}th row alone, in which they \
         are new",
        run.id
    );
    DataQuality::new("gaps", Level::Fail, message).run(run.id.clone()).value(rows as f64, "1")
}

/// Little that can be used, altogether or in a run.
fn too_few(seconds: f64, empty: Option<&str>) -> DataQuality {
    let message = match empty {
        Some(run) => format!(
            "next to nothing of {run} is without empty cells and lost rows around it; record it without gaps, or leave it out"
        ),
        None => format!(
            "{seconds:.1} s without empty cells and lost rows are left to fit on; record at least {:.0} s without gaps, better two runs of 30 s",
            SHORTEST_S / (1.0 - HELD_OUT)
        ),
    };
    let told = DataQuality::new("gaps", Level::Fail, message).value(seconds, "s");
    if let Some(run) = empty { told.run(run) } else { told }
}

/// What to know where the effects leave far more of what was held out than of what was fitted, in the channel where that is most.
fn more_there(found: &Found) -> Option<DataQuality> {
    let of_cell = |c: usize| {
        let (there, _, after) = found.before_and_after(c)?;
        let fitted = left(found.problem, c, &sized(&found.answer.effects, found.estimates));
        let asked = found.problem.nuisances[c].columns.is_empty();
        let sizes = (found.held.cells[there].rms(&after), found.problem.cells[c].rms(&fitted).max(found.floors[c]));
        asked.then_some((c, sizes.0, sizes.1))
    };
    let all = (0..found.problem.cells.len()).filter_map(of_cell).filter(|(_, there, fitted)| *there > MORE_THERE * fitted);
    let asked = !found.answer.effects.is_empty() && !found.is_later_part();
    let (c, there, fitted) = all.max_by(|a, b| (a.1 / a.2).total_cmp(&(b.1 / b.2))).filter(|_| asked)?;
    let cell = &found.problem.cells[c];
    let (what, unit) = (cell_quantity(found.robot, cell), cell_unit(found.robot, cell));
    let runs: Vec<&str> = found.held.pairs.iter().map(|pair| pair.real.run.id.as_str()).collect();
    let message = format!(
        "with this, {what} is off by {fitted:.2e} {unit} RMS in what was fitted and by {there:.2e} in what was held out: something may be \
         otherwise there; compare {} by itself too",
        runs.join(", ")
    );
    Some(DataQuality::new("runs_differ", Level::Warn, message).value(there, unit))
}

/// Times more that is left of what was held out than of what was fitted, where that is most; what noise and the model's own error leave counts as left.
fn times_more(fitted: &Problem, held: &Problem, floors: &[f64]) -> f64 {
    let size = |problem: &Problem, cell: usize| problem.cells[cell].rms(&problem.cells[cell].residual);
    let of_cell = |c: usize| {
        let there = held.cell(fitted.cells[c].channel, fitted.cells[c].index)?;
        let least = floors[c].max(fitted.practical.any[c]).max(fitted.own_error(c));
        fitted.nuisances[c].columns.is_empty().then(|| size(held, there) / size(fitted, c).max(least).max(1e-300))
    };
    (0..fitted.cells.len()).filter_map(of_cell).fold(0.0, f64::max)
}
