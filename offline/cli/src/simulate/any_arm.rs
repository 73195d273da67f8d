//! Runs of an arm from a URDF: tidy tables.

use super::workers::Watch;
use super::{Wish, commands, files, finish, homing_line, name, runs_away, workers};
use recordings::save::{self, TableFormat};
use recordings::table::{Batch, ColumnCells, TableColumn, TableSink, rows_of_batch};
use simulator::any_arm::{ArmCycle, ArmSimulation, trajectory};
use simulator::plant::Vector;
use simulator::production::{Motion, Plan, Run};
use simulator::resimulate::{ArmColumns, ClosedLoop, closed_loop};
use simulator::{Robot, RobotModel, resimulate};
use std::fmt::Write as _;
use std::path::Path;
use std::process::ExitCode;

/// How long cables settle before the first sample, s.
const SETTLE_S: f64 = 2.0;

pub(super) fn run(wish: &Wish<'_>, model: &RobotModel) -> Result<ExitCode, String> {
    let format = match wish.format {
        None => "csv",
        Some(format @ ("csv" | "csv.gz" | "parquet")) => format,
        Some(other) => {
            return Err(format!(
                "--format {other}: messages with a state exist for RAVEN-II only; write --format csv, csv.gz or parquet"
            ));
        }
    };
    if wish.arm != "gold" {
        return Err(format!("--arm {}: {} has one arm; leave --arm out", wish.arm, model.name()));
    }
    if wish.motion == "zigzag" {
        return Err(format!("--motion zigzag: is for RAVEN-II; {} has reaches as in teleoperation", model.name()));
    }
    for note in model.notes() {
        say!("note: {note}");
    }
    if model.controller().is_none() {
        say!("note: the robot's file has no [controller]; gains are assumed");
    }
    if wish.commands.is_empty() { made(wish, model, format) } else { followed(wish, model, format) }
}

/// Reaches that the seed decides.
fn made(wish: &Wish<'_>, model: &RobotModel, format: &str) -> Result<ExitCode, String> {
    // How runs are cut and seeded is the same for every robot.
    let plan = Plan {
        robot: Robot::nominal(),
        sides: Vec::new(),
        duration_s: wish.minutes.unwrap_or_default() * 60.0,
        run_s: wish.run_minutes * 60.0,
        runs_per_session: 1,
        seed: wish.seed.unwrap_or_default(),
        homing_seed: wish.homing_seed,
        motion: Motion::Teleoperation,
    };
    let runs = plan.runs();
    let (files, summary) = files(wish, runs.len(), format)?;
    drop(ArmSimulation::new(model, None, 0, &[0.0; 8]).map_err(|error| format!("{}: {error}", model.name()))?);
    let total = runs.iter().map(Run::cycles).sum();
    let offsets = workers::all(&files, files.len(), total, wish.threads, |index, watch| {
        reaches(model, runs[index], &files[index], plan.seed, watch)
    })?;
    let homing = homing_line(wish);
    let mut text = format!("robot = {}\nseed = {}\n{homing}runs = {}\n", model.name(), plan.seed, runs.len());
    for ((run, file), offset) in runs.iter().zip(&files).zip(offsets) {
        let offset = &offset[..model.joint_count()];
        let _ = writeln!(
            text,
            "{}: {:.3} s, teleoperation, homing offset {offset:?} (rad, sliding joints m)",
            name(file),
            run.duration_s
        );
    }
    let made = format!("{} runs of {:.3} s", runs.len(), runs[0].duration_s);
    finish(wish, model, &made, &summary, &text)?;
    Ok(ExitCode::SUCCESS)
}

/// One run; returns what its homing left.
fn reaches(model: &RobotModel, run: Run, file: &Path, seed: u64, watch: &Watch) -> Result<Vector, String> {
    let motion = trajectory(model, run.seed, run.duration_s);
    let mut simulation = ArmSimulation::new(model, None, run.homing_seed, motion.start()).map_err(|error| error.to_string())?;
    simulation.settle(motion.start(), SETTLE_S);
    let [seed, homing, number] = [seed, run.homing_seed, run.index as u64 + 1].map(|number| number.to_string());
    let period_s = simulation.period_s();
    let mut table = Table::create(
        file,
        model,
        period_s,
        &[("seed", &seed), ("homing_seed", &homing), ("run", &number), ("motion", "teleoperation")],
    )?;
    for cycle in 0..(run.duration_s / period_s).round() as u64 {
        watch.cycle()?;
        let time_s = (cycle as f64 * period_s * 1e9).round() / 1e9;
        table.row(time_s, &simulation.tick(&motion.at(time_s)))?;
    }
    if !simulation.state().is_finite() {
        return Err(runs_away(model.name()));
    }
    table.finish()?;
    Ok(*simulation.homing_offset())
}

/// Commands of recordings, at their times.
fn followed(wish: &Wish<'_>, model: &RobotModel, format: &str) -> Result<ExitCode, String> {
    let (runs, status) = commands::all(wish.commands, model, wish.arm)?;
    let (files, summary) = files(wish, runs.len(), format)?;
    // Each recording homes the robot anew.
    let seed = |index: usize| wish.homing_seed.unwrap_or(wish.seed.unwrap_or_default().wrapping_add(index as u64));
    let total = runs.iter().map(|run| run.len() as u64).sum();
    workers::all(&files, files.len(), total, wish.threads, |index, watch| {
        follow(model, &runs[index], &files[index], seed(index), watch)
    })?;
    let mut text = format!("robot = {}\nruns = {}\n", model.name(), runs.len());
    for (index, (run, file)) in runs.iter().zip(&files).enumerate() {
        let _ = writeln!(text, "{}: homing seed {}, commands of {}", name(file), seed(index), run.name);
    }
    finish(wish, model, &format!("{} runs", runs.len()), &summary, &text)?;
    Ok(status)
}

fn follow(model: &RobotModel, run: &resimulate::Run, file: &Path, seed: u64, watch: &Watch) -> Result<(), String> {
    let settle_s = if run.motors.is_some() { 0.0 } else { SETTLE_S };
    let options = ClosedLoop { seed, settle_s, ..ClosedLoop::default() };
    let found = closed_loop(model, run, options).map_err(|error| format!("{}: {error}", run.name))?;
    let homing = seed.to_string();
    let metadata = [("homing_seed", homing.as_str()), ("motion", "commands of a recording")];
    let mut table = Table::create(file, model, run.period_s(), &metadata)?;
    for row in 0..found.len() {
        watch.cycle()?;
        table.row(found.time_s[row], &found.row(row))?;
    }
    if found.joints.last().is_some_and(|joints| joints.iter().any(|x| !x.is_finite())) {
        return Err(runs_away(model.name()));
    }
    table.finish()
}

/// A tidy table being written.
struct Table {
    sink: Box<dyn TableSink>,
    columns: ArmColumns,
    batch: Batch,
    cells: Vec<f64>,
    full: usize,
}

impl Table {
    fn create(file: &Path, model: &RobotModel, period_s: f64, more: &[(&str, &str)]) -> Result<Self, String> {
        let rate = ((1.0 / period_s) * 1e3).round() / 1e3;
        let mut metadata = vec![("robot".to_owned(), model.name().to_owned()), ("simulated".to_owned(), "true".to_owned())];
        metadata.extend(more.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())));
        metadata.push(("sample_hz".to_owned(), rate.to_string()));
        let columns = ArmColumns::new(model, model.joint_count(), true);
        let mut header = vec![TableColumn::number("t_s")];
        header.extend(columns.names().into_iter().map(TableColumn::number));
        let format = TableFormat::of_name(file).ok_or_else(|| format!("{}: no format has this ending", file.display()))?;
        let sink = save::create_table(file, format, &header, &metadata).map_err(|error| error.to_string())?;
        let full = rows_of_batch(header.len());
        Ok(Self { sink, columns, batch: Batch::new(&header), cells: Vec::new(), full })
    }

    fn row(&mut self, time_s: f64, cycle: &ArmCycle) -> Result<(), String> {
        self.cells.clear();
        self.cells.push(time_s);
        self.columns.push(cycle, &mut self.cells);
        for (column, cell) in self.batch.columns.iter_mut().zip(&self.cells) {
            if let ColumnCells::Numbers(values) = column {
                values.push(*cell);
            }
        }
        if self.batch.rows() == self.full { self.flush() } else { Ok(()) }
    }

    fn flush(&mut self) -> Result<(), String> {
        self.sink.write(&self.batch).map_err(|error| error.to_string())?;
        self.batch.clear();
        Ok(())
    }

    fn finish(mut self) -> Result<(), String> {
        if self.batch.rows() > 0 {
            self.flush()?;
        }
        self.sink.finish().map_err(|error| error.to_string())
    }
}
