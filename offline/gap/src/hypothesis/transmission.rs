//! What lies between motor and joint: play, stretch, hysteresis, creep, coupling, ratio, eccentric pulleys, offsets.

use super::dictionary::{Dictionary, minus, size, times};
use super::friction::{BEFORE, BEFORE_S, HEATING_S, heat};
use super::{Bound, Column, Family, Valley, hysteresis, product};
use crate::cell::Channel;
use crate::motion::Motion;
use crate::pair::Pair;
use crate::run::Run;

/// Widths of play, shares of a joint's travel.
const PLAY: [f64; 14] = [0.0003, 0.0006, 0.001, 0.0018, 0.003, 0.005, 0.008, 0.012, 0.018, 0.027, 0.04, 0.06, 0.09, 0.14];
/// Widths of play that stand beside each other, shares of a joint's travel.
const WIDTHS: [f64; 12] = [0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9];
/// The same for the motion of another joint.
const COUPLED_WIDTHS: [f64; 5] = [0.05, 0.15, 0.3, 0.5, 0.8];
/// Times in which the usual load carries a link across its play, to begin with, s.
const CARRIED_S: [f64; 4] = [0.003, 0.02, 0.08, 0.3];
/// Loads over which a loaded joint crosses its play, shares of the RMS load; over all of that it is a spring.
const CROSSING: [f64; 4] = [0.02, 0.06, 0.15, 0.4];
/// The form of a coupling by a cable that has play itself.
pub(crate) const LATE_COUPLING: &str = "position, with play";
/// Forms of a position that drifts.
pub(crate) const DRIFTS: [&str; 2] = ["position", "position, under way"];
/// The zero of what measures the joint itself.
pub(crate) const SENSOR: &str = "of the sensor at the joint";
/// A spring to the ground whose force has a memory.
pub(crate) const GROUND: &str = "to the ground";
/// Times the furthest that a joint is seen, and the range that it has, within which it was homed.
const HOMED: f64 = 2.0;
/// Time constants of creep, s.
const CREEP_S: [f64; 8] = [0.5, 1.0, 2.0, 5.0, 15.0, 50.0, 150.0, 500.0];
/// How many time constants before a recording it may have begun; earlier it has settled.
const BEGUN: f64 = 2.0;
/// How many of the time constants are tried where it was under way: of the longer ones the start is but an offset.
const UNDER_WAY: usize = 6;
/// Longest time in which a damped cable gives way, s.
const DAMPED_S: f64 = 0.05;
/// Over so many time constants its load is averaged where its past is not known.
const AVERAGED: f64 = 2.0;
/// Times its usual load to which a cable may have crept at the start.
const STARTED: f64 = 2.0;
/// Periods of an eccentric pulley, from and to as shares of the travel, and how many. Where the recording shows a small part of what the
/// joint can do they go on to that: a pulley is as large as the joint needs it.
const PERIODS: (f64, f64, usize) = (0.03, 2.5, 36);

const TRANSMISSION: Channel = Channel::Transmission;

/// What share of its load a cable has settled to at the start of a run, of a shape.
type Settled = fn(&[f64]) -> f64;

pub(super) fn push(dictionary: &Dictionary, all: &mut Vec<Family>) {
    let problem = dictionary.problem;
    for j in 0..dictionary.joints() {
        if problem.robot.drives[j].ground[0] > 0.0 && problem.cell(Channel::JointTorque, j).is_some() {
            push_ground(dictionary, j, all);
        }
    }
    if !problem.has(TRANSMISSION) && (problem.cell(Channel::EndEffector, 0).is_none() || problem.tip_from_truth) {
        return;
    }
    for j in 0..dictionary.joints() {
        push_play(dictionary, j, all);
        push_elastic(dictionary, j, all);
        push_geometry(dictionary, j, all);
        push_coupling(dictionary, j, all);
    }
}

fn push_play(dictionary: &Dictionary, j: usize, all: &mut Vec<Family>) {
    let travel = dictionary.travel(j);
    all.push(Family::shaped(
        "backlash",
        &[j],
        "follows the motion",
        TRANSMISSION,
        &[Bound::Between(0.7, 1.4)],
        &[("b", true)],
        product(&[&PLAY.map(|share| share * travel)]),
        move |d, s| vec![d.strain_of(j, lag(d, s[0], &|run| run.drive_and_past(j)))],
    ));
    // Where no load is known, hysteresis follows the motion: play of many widths, one beside the other.
    if size(dictionary.cable_load(j)) < 1e-9 {
        let widths = WIDTHS.map(|share| share * travel);
        let family = Family::fixed(
            "cable_hysteresis",
            &[j],
            "play of many widths",
            TRANSMISSION,
            &[Bound::Free; WIDTHS.len() + 2],
            move |d| {
                widths
                    .iter()
                    .map(|width| d.strain_of(j, lag(d, *width, &|run| run.drive_and_past(j))))
                    .chain([d.deflection_of(j, minus(&position(d, j))), offset(d, j)])
                    .collect()
            },
        );
        all.push(family.about_a_constant().penalised(3.0));
    }
    let usual = size(dictionary.cable_load(j)).max(1e-9);
    // A damped link takes its time from one side to the other: the impulse of its load that carries it across is the shape.
    let impulses = CARRIED_S.map(|time| time * usual);
    let carried = Family::shaped(
        "backlash",
        &[j],
        "carried across by the load",
        TRANSMISSION,
        &[Bound::Positive],
        &[("impulse", true)],
        product(&[&impulses]),
        move |d, s| vec![d.strain_of(j, carried(d, j, s[0]))],
    );
    all.push(carried.penalised(1.5));
    all.push(
        Family::shaped(
            "backlash",
            &[j],
            "rests on the loaded side",
            TRANSMISSION,
            &[Bound::Positive],
            &[("crossing", true)],
            product(&[&CROSSING.map(|share| share * usual)]),
            move |d, s| {
                let crossing = s[0].min(usual);
                vec![d.strain_of(j, d.cable_load(j).iter().map(|l| 0.5 * (l / crossing).tanh()).collect())]
            },
        )
        .penalised(1.5),
    );
}

/// Where a link stands in a play of one, between -1/2 and 1/2, whose load carries it across against a damper.
fn carried(dictionary: &Dictionary, j: usize, impulse: f64) -> Vec<f64> {
    let load = dictionary.cable_load(j);
    let mut out: Vec<f64> = Vec::with_capacity(load.len());
    let mut before: Option<(usize, f64, f64)> = None;
    for (&(r, i, _), now) in dictionary.grid.iter().zip(load) {
        let time_s = dictionary.problem.pairs[r].real.run.elapsed_s(i);
        let place = match before.filter(|(run, ..)| *run == r) {
            // Where a run begins it has come to rest.
            None => 0.5 * now.signum(),
            Some((_, since_s, last)) => {
                let pushed = 0.5 * (last + now) * (time_s - since_s) / impulse.max(1e-12);
                (out[out.len() - 1] + pushed).clamp(-0.5, 0.5)
            }
        };
        out.push(place);
        before = Some((r, time_s, *now));
    }
    out
}

/// How far what is moved through a play lags behind what moves it.
fn lag(dictionary: &Dictionary, width: f64, moves: &dyn Fn(&Run) -> [&[f64]; 2]) -> Vec<f64> {
    dictionary.smoothed(|r| {
        let [past, series] = moves(&dictionary.problem.pairs[r].real.run);
        let mut inner = past.first().unwrap_or(&series[0]).to_owned();
        let mut follow = |x: &f64| {
            inner = f64::clamp(inner, x - 0.5 * width, x + 0.5 * width);
            x - inner
        };
        for x in past {
            follow(x);
        }
        series.iter().map(follow).collect()
    })
}

fn push_elastic(dictionary: &Dictionary, j: usize, all: &mut Vec<Family>) {
    let usual = size(dictionary.cable_load(j));
    if usual < 1e-9 {
        return;
    }
    // Nor can a cable give way less than not at all: of what the simulation has of it, all may be too much.
    let there = dictionary.problem.nominal.compliance[j][0];
    let least = if there > 0.0 { Bound::Between(-there, f64::INFINITY) } else { Bound::Positive };
    all.push(Family::fixed("cable_stretch", &[j], "linear", TRANSMISSION, &[least], move |d| {
        vec![d.strain_of(j, d.cable_load(j).to_vec())]
    }));
    // Its damper is stiff beside a softer spring: it gives way late.
    let damped = [Bound::Positive, Bound::UpTo(DAMPED_S, 0.0)];
    let family = Family::fixed("cable_stretch", &[j], "linear, damped", TRANSMISSION, &damped, move |d| {
        let load = d.cable_load(j);
        vec![d.strain_of(j, load.to_vec()), d.strain_of(j, minus(&rate(d, load)))]
    });
    all.push(family.penalised(1.0));
    hysteresis::push(dictionary, j, usual, all);
    let begun: Settled = |s| 1.0 - (-s[1].clamp(0.0, BEGUN * s[0]) / s[0]).exp();
    for (form, shape, grid, settled, valley) in [
        ("settled at the start", &[("T_k", true)][..], product(&[&CREEP_S]), (|_| 1.0) as Settled, Valley::Plain),
        ("begun before the start", &[("T_k", true), (BEFORE, true)], product(&[&CREEP_S, &BEFORE_S]), begun, Valley::Long),
    ] {
        let columns = move |d: &Dictionary, s: &[f64]| vec![d.strain_of(j, crept(d, j, s[0], settled(s)))];
        let family = Family::shaped("cable_creep", &[j], form, TRANSMISSION, &[Bound::Positive], shape, grid, columns);
        all.push(family.lying_in(valley).penalised(1.0));
    }
    if dictionary.problem.robot.simulates_itself {
        // Where it has crept before: that dies away.
        let columns = move |d: &Dictionary, s: &[f64]| {
            vec![d.strain_of(j, crept(d, j, s[0], 0.0)), d.strain_of(j, left_of_before(d, j, s[0]))]
        };
        let bounds = [Bound::Positive, Bound::Within(STARTED)];
        let family = Family::shaped(
            "cable_creep",
            &[j],
            "under way at the start",
            TRANSMISSION,
            &bounds,
            &[("T_k", true)],
            product(&[&CREEP_S[..UNDER_WAY]]),
            columns,
        );
        all.push(family.penalised(4.0));
    }
    // Within seconds creep is likelier.
    for (form, before, penalty) in [(DRIFTS[0], BEFORE_S[0], 3.0), (DRIFTS[1], BEFORE_S[1], 6.0)] {
        let grid = product(&[&HEATING_S, &[before]]);
        let most = 2.0 * before;
        all.push(
            Family::shaped(
                "thermal_drift",
                &[j],
                form,
                TRANSMISSION,
                &[Bound::Free],
                &[("T", true), (BEFORE, true)],
                grid,
                move |d, s| vec![d.strain_of(j, heat(d, j, &[s[0], s[1].min(most)]))],
            )
            .lying_in(Valley::Long)
            .penalised(penalty),
        );
    }
}

/// Load behind a first-order lag, which at the start of a run is where it stood so long that it settled to this share of its load. Of the
/// rest of a run, whose beginning is not there, the load was what it is now on the average.
fn crept(dictionary: &Dictionary, j: usize, time_s: f64, settled: f64) -> Vec<f64> {
    let load = dictionary.cable_load(j);
    // Faster creep is stretch, and no claim of its own.
    if time_s < 0.6 * CREEP_S[0] {
        return vec![0.0; load.len()];
    }
    let mut out: Vec<f64> = Vec::with_capacity(load.len());
    for (row, &(r, i, k)) in dictionary.grid.iter().enumerate() {
        let motion = &dictionary.problem.pairs[r].real;
        let state = if k > 0 {
            let passed_s = (i - motion.rows[k - 1]) as f64 * motion.run.dt_s;
            let keep = (-passed_s / time_s).exp();
            keep * out[row - 1] + (1.0 - keep) * load[row]
        } else if motion.run.since_s > 0.0 {
            let seen = dictionary.grid[row..]
                .iter()
                .take_while(|(other, at, _)| *other == r && (at - i) as f64 * motion.run.dt_s < AVERAGED * time_s);
            let usual = crate::series::mean(&load[row..row + seen.count()]);
            let left = (-motion.run.since_s / time_s).exp();
            (1.0 - left) * usual + left * settled * load[row]
        } else {
            settled * load[row]
        };
        out.push(state);
    }
    out
}

/// What is left of a load like the usual one that a cable bore before the start of a run; nothing in the rest of a run.
fn left_of_before(dictionary: &Dictionary, j: usize, time_s: f64) -> Vec<f64> {
    let usual = size(dictionary.cable_load(j));
    dictionary.at_grid(|r, i, _| {
        let run = &dictionary.problem.pairs[r].real.run;
        if run.since_s > 0.0 { 0.0 } else { usual * (-run.elapsed_s(i) / time_s).exp() }
    })
}

/// Rate of a grid series, 1/s, run by run.
fn rate(dictionary: &Dictionary, series: &[f64]) -> Vec<f64> {
    let of_run = |(pair, run): (&Pair, &[f64])| -> Vec<f64> {
        let time_s = |row: usize| pair.real.run.elapsed_s(pair.real.rows[row]);
        let at = |row: usize| {
            let (before, after) = (row.saturating_sub(1), (row + 1).min(run.len() - 1));
            if after > before { (run[after] - run[before]) / (time_s(after) - time_s(before)) } else { 0.0 }
        };
        (0..run.len()).map(at).collect()
    };
    dictionary.problem.pairs.iter().zip(hysteresis::parts(dictionary, series)).flat_map(of_run).collect()
}

/// Bends of a spring to the ground, over one deflection: those that depend on the way, and those that turn with it, over the first.
const BENDS: [f64; 3] = [0.15, 0.5, 1.5];
const TURNS: [f64; 6] = [-4.0, -1.5, -0.5, 0.5, 1.5, 4.0];

/// A spring to the ground whose force has a memory: `k_0 y + k_1 z`, `zd = yd - (p |yd| z + q yd |z|)`.
fn push_ground(dictionary: &Dictionary, j: usize, all: &mut Vec<Family>) {
    let usual = size(&position(dictionary, j)).max(1e-12);
    let family = Family::shaped(
        "cable_hysteresis",
        &[j],
        GROUND,
        Channel::JointTorque,
        &[Bound::Positive, Bound::Free],
        &[("p", true), ("q_over_p", true)],
        product(&[&BENDS.map(|b| b / usual), &TURNS]),
        move |d, s| {
            let memory = d.smoothed(|r| remembered(&d.problem.pairs[r].real.run.position[j], s[0], s[0] * s[1]));
            vec![d.effort_of(j, memory, false), d.effort_of(j, position(d, j), false)]
        },
    );
    all.push(family.lying_in(Valley::Sharp).penalised(3.0));
}

/// Memory of a deflection, by midpoints in steps between the samples, where the deflection is a cubic; the first samples are
/// gone through twice, there and back, so that it has settled.
fn remembered(deflection: &[f64], p: f64, q: f64) -> Vec<f64> {
    const PARTS: usize = 8;
    let settle = deflection.len().min(400);
    let series: Vec<f64> = deflection[..settle].iter().rev().chain(deflection).copied().collect();
    let at = |i: usize| series[i.min(series.len() - 1)];
    let mut z = 0.0_f64;
    let mut out = vec![0.0];
    for i in 1..series.len() {
        let (a, b, c, d) = (at(i.saturating_sub(2)), at(i - 1), at(i), at(i + 1));
        let (from, to) = (0.5 * (c - a), 0.5 * (d - b));
        let cubic = |t: f64| b + t * (from + t * (3.0 * (c - b) - 2.0 * from - to + t * (2.0 * (b - c) + from + to)));
        let mut before = b;
        for part in 1..=PARTS {
            let now = cubic(part as f64 / PARTS as f64);
            let step = now - before;
            before = now;
            let slope = |z: f64| step - (p * step.abs() * z + q * step * z.abs());
            let half = z + 0.5 * slope(z);
            z += slope(half);
        }
        out.push(z);
    }
    out.split_off(settle)
}

fn position(dictionary: &Dictionary, j: usize) -> Vec<f64> {
    dictionary.at_grid(|r, i, _| dictionary.problem.pairs[r].real.position[j][i])
}

/// q_true = q + o: the deflection A⁻¹m - q_true is -o.
fn offset(dictionary: &Dictionary, j: usize) -> Column {
    dictionary.deflection_of(j, vec![-1.0; dictionary.grid.len()])
}

/// The sensor at a joint tells 1 more than there is: what it is compared with, the tip and the load that go with it are elsewhere.
fn sensor_off(dictionary: &Dictionary, j: usize) -> Column {
    let torque = dictionary.asked_more(1e-3, |_, _, state, step| state.position[j] -= step);
    let tip = dictionary.tip(|_, _, row| [0, 1, 2].map(|axis| -dictionary.tip_jacobian[row][axis * dictionary.joints() + j]));
    offset(dictionary, j).and(torque).and(tip)
}

/// How far from zero a joint may have been homed, rad or m: what would be 0 further away is no error that grows with the way, but an offset.
fn homed_within(dictionary: &Dictionary, j: usize) -> f64 {
    let furthest = position(dictionary, j).iter().fold(0.0, |most: f64, q| most.max(q.abs()));
    HOMED * (furthest + dictionary.problem.robot.range(j))
}

fn push_geometry(dictionary: &Dictionary, j: usize, all: &mut Vec<Family>) {
    let ratio = move |d: &Dictionary| d.deflection_of(j, minus(&position(d, j)));
    // Work is kept: the motor turns less for the link's way, and carries its load on a longer lever. The link moves faster than the motor says.
    let own = move |joint: usize| f64::from(u8::from(joint == j));
    let with_torque = move |d: &Dictionary| {
        let faster = |motion: &Motion, i: usize| [&motion.position, &motion.velocity, &motion.acceleration].map(|set| set[j][i]);
        let mut lever = Column::default();
        lever.push(d.problem.cell(Channel::JointTorque, j), &d.load(j));
        ratio(d).and(d.moved_otherwise(own, faster)).and(lever)
    };
    let elsewhere = move |d: &Dictionary| offset(d, j).and(d.moved_otherwise(own, |_, _| [1.0, 0.0, 0.0]));
    let (small, free, homed) = (Bound::Between(-0.5, 0.5), Bound::Free, Bound::Within(homed_within(dictionary, j)));
    all.push(Family::fixed("joint_offset", &[j], "constant", TRANSMISSION, &[free], move |d| vec![offset(d, j)]));
    if dictionary.problem.tip_from_truth {
        // Where the links and the tip are taken to be is off as well.
        let family = Family::fixed("joint_offset", &[j], SENSOR, TRANSMISSION, &[free], move |d| vec![sensor_off(d, j)]);
        all.push(family.penalised(1.0));
    }
    all.push(
        Family::fixed("transmission_ratio", &[j], "about zero", TRANSMISSION, &[small], move |d| vec![ratio(d)]).penalised(0.5),
    );
    all.push(
        Family::fixed("transmission_ratio", &[j], "about zero, torque too", TRANSMISSION, &[small], move |d| vec![with_torque(d)])
            .penalised(0.5),
    );
    all.push(
        Family::fixed("transmission_ratio", &[j], "about where it was homed", TRANSMISSION, &[small, homed], move |d| {
            vec![ratio(d), offset(d, j)]
        })
        .penalised(1.5),
    );
    all.push(
        Family::fixed(
            "transmission_ratio",
            &[j],
            "about where it was homed, torque too",
            TRANSMISSION,
            &[small, homed],
            move |d| vec![with_torque(d), elsewhere(d)],
        )
        .penalised(1.5),
    );
    let travel = dictionary.travel(j);
    // A bend in points that a camera saw is mostly play or the camera.
    let unlikely = if dictionary.problem.of_points() { 12.0 } else { 0.0 };
    let robot = dictionary.problem.robot;
    let periods = periods(travel, robot.range(j), least_period(robot.motor_from_joint[(j, j)]));
    for (form, carries) in [("once per turn", false), ("once per turn, torque too", true)] {
        all.push(
            Family::shaped(
                "pulley_eccentricity",
                &[j],
                form,
                TRANSMISSION,
                &[free, free],
                &[("period", true)],
                product(&[&periods]),
                move |d, s| {
                    let (q, rate) = (position(d, j), std::f64::consts::TAU / s[0]);
                    let wave = |phase: f64| {
                        // q_true = q + e sin(...): the deflection is the opposite.
                        let mut column = d.deflection_of(j, q.iter().map(|q| -(rate * q + phase).sin()).collect());
                        if carries {
                            // The lever turns with the pulley.
                            let lever: Vec<f64> = q.iter().map(|q| rate * (rate * q + phase).cos()).collect();
                            column.push(d.problem.cell(Channel::JointTorque, j), &times(&lever, &d.load(j)));
                        }
                        column
                    };
                    vec![wave(0.0), wave(std::f64::consts::FRAC_PI_2)]
                },
            )
            // Found among so many.
            .penalised(2.0 + (periods.len() as f64).ln() + unlikely),
        );
    }
}

/// Periods of an eccentric pulley to begin with, none below the least, of a joint that travels so far of so much that it can.
fn periods(travel: f64, range: f64, least: f64) -> Vec<f64> {
    let (from, to, count) = PERIODS;
    let ratio = (to / from).powf(1.0 / (count - 1) as f64);
    let more = (range.max(least) / (travel * to)).ln().max(0.0) / ratio.ln();
    (0..count + more.ceil() as usize).map(|k| travel * from * ratio.powi(k as i32)).filter(|period| *period >= least).collect()
}

/// The motor's own pulley is the smallest of a cable's run, but for an idler: none turns more than twice when the motor turns once. A motor
/// that turns with its joint is one whose drive is not known.
fn least_period(motor_turns: f64) -> f64 {
    if motor_turns.abs() > 1.0 { std::f64::consts::PI / motor_turns.abs() } else { 0.0 }
}

fn push_coupling(dictionary: &Dictionary, j: usize, all: &mut Vec<Family>) {
    let small = Bound::Between(-0.5, 0.5);
    for i in (0..dictionary.joints()).filter(|i| *i != j) {
        let coupled = move |d: &Dictionary| d.strain_of(j, position(d, i));
        let (pair, homed) = ([j, i], Bound::Within(homed_within(dictionary, i)));
        all.push(
            Family::fixed("joint_coupling", &pair, "position", TRANSMISSION, &[small], move |d| vec![coupled(d)]).penalised(1.0),
        );
        all.push(
            Family::fixed("joint_coupling", &pair, "position about a place", TRANSMISSION, &[small, homed], move |d| {
                vec![coupled(d), offset(d, j)]
            })
            .penalised(1.5),
        );
        if size(&dictionary.load(j)) < 1e-9 {
            // What the other joint drags along comes late where its cable has play.
            let widths = COUPLED_WIDTHS.map(|share| share * dictionary.travel(i));
            let mut bounds = vec![small];
            bounds.resize(2 + widths.len(), Bound::Free);
            let family = Family::fixed("joint_coupling", &pair, LATE_COUPLING, TRANSMISSION, &bounds, move |d| {
                let late = widths.iter().map(|width| d.strain_of(j, lag(d, *width, &|run| run.position_and_past(i))));
                std::iter::once(coupled(d)).chain(late).chain([offset(d, j)]).collect()
            });
            all.push(family.about_a_constant().penalised(4.0));
        }
        all.push(
            Family::fixed("joint_coupling", &pair, "position and torque", TRANSMISSION, &[small], move |d| {
                // m = (A + c) q, so tau_q = Aᵀ tau_m gains c times the other motor's torque, and less is asked of this one and of its cable.
                let less = d.effort_of(i, minus(d.cable_load(j)), true);
                let way =
                    |motion: &Motion, k: usize| [&motion.position, &motion.velocity, &motion.acceleration].map(|set| -set[i][k]);
                vec![coupled(d).and(less).and(d.moved_otherwise(|joint| d.strain_share(joint, j), way))]
            })
            .penalised(1.0),
        );
    }
}
