//! Runs of a RAVEN-II: full states with their truth.

use super::workers::Watch;
use super::{Wish, commands, files, finish, homing_line, name, runs_away, workers};
use crate::convert;
use arm::{JOINTS, Side};
use recordings::save::{self, StateFormat, TableFormat};
use recordings::stream::Record;
use recordings::tidy::{self, StateTable};
use recordings::{open, table};
use simulator::RobotModel;
use simulator::production::{Motion, Plan, Player, Run};
use std::fmt::Write as _;
use std::path::Path;
use std::process::ExitCode;

pub(super) fn run(wish: &Wish<'_>, model: RobotModel) -> Result<ExitCode, String> {
    let format = wish.format.unwrap_or("mcap");
    let status = match wish.arm {
        _ if wish.commands.is_empty() => made(wish, &model, format)?,
        "both" => {
            return Err(
                "--arm both: a recording's commands are followed by one arm at a time; write --arm gold or green".to_owned()
            );
        }
        "green" => followed(wish, &model.with_side(Side::Green), format)?,
        _ => followed(wish, &model, format)?,
    };
    // The truth may be among it, for which runs are simulated.
    let file = Path::new("run").with_extension(format);
    let of_table = || TableFormat::of_name(&file).map_or(&[][..], TableFormat::losses_of_states);
    convert::note_all(StateFormat::of_name(&file).map_or_else(of_table, StateFormat::losses));
    Ok(status)
}

/// Trajectories that the seed decides.
fn made(wish: &Wish<'_>, model: &RobotModel, format: &str) -> Result<ExitCode, String> {
    let Some(robot) = model.as_raven().cloned() else { return Err(format!("{}: is no RAVEN-II", model.name())) };
    let plan = Plan {
        robot,
        sides: match wish.arm {
            "green" => vec![Side::Green],
            "both" => vec![Side::Gold, Side::Green],
            _ => vec![Side::Gold],
        },
        duration_s: wish.minutes.unwrap_or_default() * 60.0,
        run_s: wish.run_minutes * 60.0,
        runs_per_session: wish.runs_per_session.unwrap_or(1),
        seed: wish.seed.unwrap_or_default(),
        homing_seed: wish.homing_seed,
        motion: match wish.motion {
            "teleoperation" => Motion::Teleoperation,
            "zigzag" => Motion::Zigzag,
            _ => Motion::Mixed,
        },
    };
    let runs = plan.runs();
    let (files, summary) = files(wish, runs.len(), format)?;
    // Effects that cannot be are refused before anything is written.
    drop(Player::new(&plan, runs[0]).map_err(|error| format!("{}: {error}", model.name()))?);
    let total = runs.iter().map(Run::cycles).sum();
    let sessions: Vec<&[Run]> = runs.chunks(plan.runs_per_session).collect();
    let offsets = workers::all(&files, sessions.len(), total, wish.threads, |session, watch| {
        let mut last: Option<Player> = None;
        let mut offsets: Vec<Vec<[f64; JOINTS]>> = Vec::new();
        for run in sessions[session] {
            let begun = last.as_ref().map_or_else(|| Player::new(&plan, *run), |last| last.followed_by(&plan, *run));
            let mut player = begun.map_err(|error| error.to_string())?;
            offsets.push(plan.sides.iter().filter_map(|side| player.homing_offset(*side).copied()).collect());
            let [seed, homing, number] = [plan.seed, run.homing_seed, run.index as u64 + 1].map(|number| number.to_string());
            let metadata = [("seed", seed.as_str()), ("homing_seed", &homing), ("run", &number), ("motion", motion_of(*run))];
            write(&mut player, model.name(), &metadata, &files[run.index], watch)?;
            last = Some(player);
        }
        Ok(offsets)
    })?;
    let offsets: Vec<Vec<[f64; JOINTS]>> = offsets.into_iter().flatten().collect();
    let homing = homing_line(wish);
    let session = if plan.runs_per_session > 1 { format!("runs per session = {}\n", plan.runs_per_session) } else { String::new() };
    let mut text = format!("robot = {}\nseed = {}\n{homing}{session}runs = {}\n", model.name(), plan.seed, runs.len());
    for ((run, file), offsets) in runs.iter().zip(&files).zip(&offsets) {
        let _ = write!(text, "{}: {:.3} s, {}", name(file), run.duration_s, motion_of(*run));
        for (side, offset) in plan.sides.iter().zip(offsets) {
            let _ = write!(text, ", homing offset {} {offset:?} (rad, joint 3 m)", side.name());
        }
        text.push('\n');
    }
    let made = format!("{} runs of {:.3} s", runs.len(), runs[0].duration_s);
    finish(wish, model, &made, &summary, &text)?;
    Ok(ExitCode::SUCCESS)
}

fn motion_of(run: Run) -> &'static str {
    if run.zigzag { "zigzag" } else { "teleoperation" }
}

/// Commands of recordings, from their first to their last row, at 1 kHz.
fn followed(wish: &Wish<'_>, model: &RobotModel, format: &str) -> Result<ExitCode, String> {
    let (recorded, status) = commands::all(wish.commands, model, wish.arm)?;
    let (files, summary) = files(wish, recorded.len(), format)?;
    let runs: Vec<Run> = recorded
        .iter()
        .enumerate()
        .map(|(index, run)| {
            let duration_s = run.time_s[run.len() - 1] - run.time_s[0] + 1e-3;
            let seed = wish.seed.unwrap_or_default();
            // Each recording homes the robot anew.
            Run {
                index,
                seed,
                homing_seed: wish.homing_seed.unwrap_or(seed.wrapping_add(index as u64)),
                duration_s,
                zigzag: false,
                in_session: 0,
            }
        })
        .collect();
    let total = runs.iter().map(Run::cycles).sum();
    workers::all(&files, files.len(), total, wish.threads, |index, watch| {
        let mut player = Player::following(model, &recorded[index], runs[index]).map_err(|error| error.to_string())?;
        let [seed, homing, number] = [runs[index].seed, runs[index].homing_seed, index as u64 + 1].map(|number| number.to_string());
        let metadata = [("seed", seed.as_str()), ("homing_seed", &homing), ("run", &number), ("motion", "commands of a recording")];
        write(&mut player, model.name(), &metadata, &files[index], watch)
    })?;
    let seed = wish.seed.unwrap_or_default();
    let mut text = format!("robot = {}\narm = {}\nseed = {seed}\nruns = {}\n", model.name(), wish.arm, runs.len());
    for ((run, file), recorded) in runs.iter().zip(&files).zip(&recorded) {
        let (duration_s, homing) = (run.duration_s, run.homing_seed);
        let _ = writeln!(text, "{}: {duration_s:.3} s, homing seed {homing}, commands of {}", name(file), recorded.name);
    }
    finish(wish, model, &format!("{} runs", runs.len()), &summary, &text)?;
    Ok(status)
}

fn write(player: &mut Player, robot: &str, more: &[(&str, &str)], file: &Path, watch: &Watch) -> Result<(), String> {
    let fixed = [("robot", robot), ("simulated", "true")];
    let metadata: Vec<(String, String)> = fixed
        .iter()
        .chain(more)
        .chain(&[("sample_hz", "1000")])
        .map(|(key, value)| ((*key).to_owned(), (*value).to_owned()))
        .collect();
    // A tidy table is made of the states by the same code that converts recordings: through a file beside it.
    let table = if StateFormat::of_name(file).is_none() { TableFormat::of_name(file) } else { None };
    let aside = || file.with_file_name(format!(".{}.{}.states.mcap", name(file), std::process::id()));
    let states_file = if table.is_some() { aside() } else { file.to_owned() };
    let format = StateFormat::of_name(&states_file).ok_or_else(|| format!("{}: no format has this ending", file.display()))?;
    let mut sink = save::create_states(&states_file, format, &metadata).map_err(|error| error.to_string())?;
    player.records(|record| {
        if matches!(record, Record::State(_)) {
            watch.cycle()?;
        }
        sink.write(record).map_err(|error| error.to_string())
    })?;
    if !player.is_somewhere() {
        return Err(runs_away(robot));
    }
    sink.finish().map_err(|error| error.to_string())?;
    if let Some(format) = table {
        let made = tidy_table(&states_file, file, format);
        drop(std::fs::remove_file(&states_file));
        made?;
    }
    Ok(())
}

fn tidy_table(states: &Path, out: &Path, format: TableFormat) -> Result<(), String> {
    let open::Opened::States(source) = open::open(states).map_err(|error| error.to_string())? else {
        return Err(format!("{}: is not a recording of states", states.display()));
    };
    let mut source = StateTable::new(source, tidy::Options { arms: None, all_truth: true, orientation: false })
        .map_err(|error| error.to_string())?;
    let metadata = table::TableSource::metadata(&source).to_vec();
    let columns = table::TableSource::columns(&source).to_vec();
    let mut sink = save::create_table(out, format, &columns, &metadata).map_err(|error| error.to_string())?;
    table::copy(&mut source, sink.as_mut(), &mut |_, _| {}).map_err(|error| error.to_string())?;
    sink.finish().map_err(|error| error.to_string())
}
