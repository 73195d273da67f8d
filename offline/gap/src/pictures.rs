//! Data of the report's figures.

use gap_report::{BeforeAfter, HeatMap, HeatRun, Pictures, Quantity, Share, Signature};

use crate::cell::Channel;
use crate::found::Found;
use crate::held_out::{left, others, sized};
use crate::hypothesis::Candidate;
use crate::problem::Problem;
use crate::series::rms;
use crate::told::{cell_name, cell_quantity, cell_unit, main_cell, told};

/// Width of a bin of the heat map, s.
const BIN_S: f64 = 0.5;

/// Everything that is drawn.
pub(crate) fn draw(found: &Found) -> Pictures {
    let mut pictures = Pictures { heat: heat(found), shares: shares(found), ..Pictures::default() };
    for (k, (effect, estimate)) in found.answer.effects.iter().zip(found.estimates).enumerate() {
        let cell = main_cell(found.floors, &effect.chosen.candidate, &estimate.coefficients);
        pictures.signatures.push(signature(found, k, cell));
        pictures.before_after.extend(before_after(found, k as u64 + 1, cell));
    }
    pictures
}

fn heat(found: &Found) -> Vec<HeatMap> {
    let mut maps: Vec<HeatMap> = Vec::new();
    for (c, cell) in found.problem.cells.iter().enumerate() {
        let channel = told(cell.channel);
        if maps.last().is_none_or(|map| map.channel != channel) {
            let runs = found.problem.pairs.iter().map(|pair| HeatRun {
                run: pair.real.run.id.clone(),
                start_s: pair.real.run.start_s,
                bin_s: BIN_S,
                values: Vec::new(),
            });
            maps.push(HeatMap { channel, rows: Vec::new(), runs: runs.collect() });
        }
        let Some(map) = maps.last_mut() else { continue };
        map.rows.push(cell_name(found.robot, cell));
        let says = cell.says();
        for (r, run) in map.runs.iter_mut().enumerate() {
            let of = &found.problem.pairs[r].real.run;
            let bins = ((of.len() as f64 * of.dt_s / BIN_S).ceil() as usize).max(1);
            let mut each: Vec<Vec<f64>> = vec![Vec::new(); bins];
            let of_run = cell.rows.iter().zip(&cell.residual).zip(&says).filter(|((row, _), says)| row.0 == r && **says);
            for ((&(_, i), y), _) in of_run {
                each[((i as f64 * of.dt_s / BIN_S) as usize).min(bins - 1)].push(*y);
            }
            run.values.push(
                each.into_iter()
                    .map(|bin| if bin.is_empty() { f64::NAN } else { rms(bin.into_iter()) / found.floors[c].max(1e-300) })
                    .collect(),
            );
        }
    }
    maps
}

/// Share of each cell in its channel's excess energy, in units of its noise.
fn shares(found: &Found) -> Vec<Share> {
    let excess: Vec<f64> = found
        .problem
        .cells
        .iter()
        .zip(found.floors)
        .map(|(cell, floor)| (cell.rms(&cell.residual).powi(2) / floor.powi(2).max(1e-300) - 1.0).max(0.0))
        .collect();
    let mut all = Vec::new();
    for channel in [Channel::JointTorque, Channel::Transmission, Channel::EndEffector] {
        let of: Vec<usize> = (0..excess.len()).filter(|c| found.problem.cells[*c].channel == channel).collect();
        let total: f64 = of.iter().map(|c| excess[*c]).sum();
        if total > 0.5 {
            all.extend(of.into_iter().map(|c| Share {
                channel: told(channel),
                joint: cell_name(found.robot, &found.problem.cells[c]),
                regime: String::new(),
                share: excess[c] / total,
            }));
        }
    }
    all
}

/// Series of a problem at a cell's rows: what an effect is drawn against.
fn feature(problem: &Problem, candidate: &Candidate, cell: usize) -> (Quantity, Vec<f64>) {
    let family = &candidate.family;
    let rows = &problem.cells[cell].rows;
    let robot = problem.robot;
    let joint = family.joints.first().copied().unwrap_or_else(|| problem.cells[cell].index.min(robot.joint_count() - 1));
    let at = |value: &dyn Fn(usize, usize) -> f64| rows.iter().map(|&(r, i)| value(r, i)).collect::<Vec<f64>>();
    let motion = |r: usize| &problem.pairs[r].real;
    let unit = robot.position_unit(joint);
    let name = &robot.joints[joint];
    if candidate.windows.is_some() {
        return (Quantity::new("Time", "s"), at(&|r, i| motion(r).run.time_s(i)));
    }
    match family.physics {
        "coulomb_friction" | "viscous_friction" | "stribeck_friction" | "measurement_delay" => {
            (Quantity::new(format!("Velocity of {name}"), format!("{unit}/s")), at(&|r, i| motion(r).velocity[joint][i]))
        }
        "cable_stretch" | "cable_hysteresis" | "load_dependent_friction" | "motor_torque_scale" | "backlash" => {
            let load = |r: usize, i: usize| {
                let rows = &problem.pairs[r].real.rows;
                let k = rows.partition_point(|row| *row < i).min(rows.len() - 1);
                let beyond = if family.channel == Channel::Transmission { problem.shaking[r].borne(joint, k) } else { 0.0 };
                problem.loads[r][k].link[joint] + beyond
            };
            (Quantity::new(format!("Load of {name}"), robot.effort_unit(joint)), at(&load))
        }
        "joint_coupling" => {
            let other = family.joints.get(1).copied().unwrap_or(joint);
            (
                Quantity::new(format!("Position of {}", robot.joints[other]), robot.position_unit(other)),
                at(&|r, i| motion(r).position[other][i]),
            )
        }
        "link_inertia" if candidate.is_of_a_drive() => (
            Quantity::new(format!("Acceleration of {name}"), format!("{unit}/s²")),
            at(&|r, i| motion(r).drive_acceleration[joint][i]),
        ),
        "thermal_drift" | "cable_creep" => (Quantity::new("Time", "s"), at(&|r, i| motion(r).run.time_s(i))),
        _ => (Quantity::new(format!("Position of {name}"), unit), at(&|r, i| motion(r).position[joint][i])),
    }
}

fn signature(found: &Found, k: usize, cell: usize) -> Signature {
    let of = &found.problem.cells[cell];
    let own = &found.answer.effects[k].chosen.candidate;
    let (feature, x) = feature(found.problem, own, cell);
    // Only this effect: the others are taken off.
    let others = others(&sized(&found.answer.effects, found.estimates), k);
    let before = left(found.problem, cell, &others);
    let effect = own.effect(cell, &found.estimates[k].coefficients);
    let after: Vec<f64> = before.iter().zip(&effect).map(|(y, p)| y - p).collect();
    let every = (x.len() / 900).max(1);
    let says = of.says();
    let those = |y: &[f64]| x.iter().zip(y).zip(&says).filter(|(_, says)| **says).map(|((x, y), _)| (*x, *y)).collect::<Vec<_>>();
    let points = |y: &[f64]| those(y).into_iter().step_by(every).collect();
    Signature {
        effect: k as u64 + 1,
        feature,
        error: Quantity::new(format!("Error of {}", cell_quantity(found.robot, of)), cell_unit(found.robot, of)),
        before: points(&before),
        after: points(&after),
        curve: vec![curve(&those(&effect))],
        band: Vec::new(),
        caption: String::new(),
    }
}

/// Mean of the fitted effect over bins of the feature.
fn curve(effect: &[(f64, f64)]) -> Vec<(f64, f64)> {
    const BINS: usize = 80;
    let (low, high) = crate::series::range(effect.iter().map(|(x, _)| *x));
    let width = (high - low).max(1e-300) / BINS as f64;
    let mut sums = vec![(0.0, 0.0, 0.0); BINS];
    for (x, y) in effect {
        let bin = &mut sums[(((x - low) / width) as usize).min(BINS - 1)];
        *bin = (bin.0 + x, bin.1 + y, bin.2 + 1.0);
    }
    sums.into_iter().filter(|s| s.2 > 0.0).map(|s| (s.0 / s.2, s.1 / s.2)).collect()
}

fn before_after(found: &Found, effect: u64, cell: usize) -> Option<BeforeAfter> {
    let (c, before, after) = found.before_and_after(cell)?;
    let of = &found.held.cells[c];
    // The first held-out run.
    let rows: Vec<usize> = (0..of.rows.len()).filter(|k| of.rows[*k].0 == 0).collect();
    let says = of.says();
    // Rows that say nothing are left out.
    let drawn = |y: &[f64]| rows.iter().map(|k| if says[*k] { y[*k] } else { f64::NAN }).collect();
    let run = &found.held.pairs[0].real.run;
    Some(BeforeAfter {
        effect: Some(effect),
        run: run.id.clone(),
        error: Quantity::new(format!("Error of {}", cell_quantity(found.robot, of)), cell_unit(found.robot, of)),
        t_s: rows.iter().map(|k| run.time_s(of.rows[*k].1)).collect(),
        before: drawn(&before),
        after: drawn(&after),
        noise_floor: Some(found.floors[cell]),
    })
}
