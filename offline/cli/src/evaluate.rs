//! `ravenpose evaluate`: what a model leaves on runs that it has not seen, with its rivals beside it.

use crate::output;
use crate::train::{Named, side};
use ::training::data::Reading;
use ::training::evaluate::{self, BY_TIME, Cell, Report};
use arm::Side;
use clap::Args;
use std::io::IsTerminal;
use std::path::PathBuf;
use std::process::ExitCode;

/// What to judge, and on what.
#[derive(Args)]
pub(crate) struct Wish {
    /// Model that `ravenpose train` wrote
    #[arg(long)]
    model: PathBuf,
    /// Recordings with truth: those of its training and validation are recognised and only given to the rivals
    #[arg(long, required = true, num_args = 1..)]
    data: Vec<PathBuf>,
    /// Folder for report.json and report.html
    #[arg(long)]
    out: PathBuf,
    /// Leave the rivals out
    #[arg(long)]
    alone: bool,
    /// Of bootstrap and rivals
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Arm of a RAVEN-II, gold or green
    #[arg(long, default_value = "gold", value_parser = side)]
    arm: Side,
    #[command(flatten)]
    columns: Named,
}

pub(crate) fn run(wish: &Wish) -> Result<ExitCode, String> {
    output::check_folder(&wish.out, "--out")?;
    let reading = Reading { arm: wish.arm, seed: wish.seed, columns: wish.columns.columns(), ..Reading::default() };
    let wanted = evaluate::Wish {
        model: &wish.model,
        data: &wish.data,
        reading: &reading,
        rivals: !wish.alone,
        out: &wish.out,
        seed: wish.seed,
    };
    let terminal = std::io::stderr().is_terminal();
    let report = evaluate::evaluate(&wanted, &mut |what| {
        if terminal {
            output::complain(format_args!("\r\x1b[K{what}"));
        }
    });
    if terminal {
        output::complain(format_args!("\r\x1b[K"));
    }
    let report = report.map_err(|error| error.to_string())?;
    for note in &report.notes {
        complain!("ravenpose: {note}");
    }
    let _ = output::say(format_args!("{}", words(&report)));
    say!("{}", wish.out.join("report.html").display());
    Ok(ExitCode::SUCCESS)
}

fn words(report: &Report) -> String {
    let mut lines = vec![format!(
        "{} runs ({} rows) that the model has not seen; {} of its training and validation left out of the figures",
        report.runs.len(),
        report.rows,
        report.runs_of_training
    )];
    lines.push(format!(
        "{:24} {:>8} {:>8} {:>8} {:>8} {:>9} {:>9} {:>9} {:>9}",
        "method", "RMS", "SD", "95 %", "measured", "RMS off", "SD off", "learn s", "run us"
    ));
    for method in &report.methods {
        let vector = &method.exact.vector;
        let optional = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.1}"));
        lines.push(format!(
            "{:24} {:8.3} {:8.3} {:8.3} {:8.3} {:7.1} % {:7.1} % {:>9} {:>9}",
            method.name,
            vector.rms,
            vector.sd,
            vector.p95,
            method.measured.vector.rms,
            method.rms_reduction.value,
            method.sd_reduction.value,
            optional(method.train_s),
            optional(method.estimate_us)
        ));
    }
    let trust = &report.trust;
    lines.push(format!(
        "95 % bound holds in {:.1} % (by run {:.1} to {:.1} %); out of range {:.2} %, out of domain {:.2} % of the rows",
        trust.coverage_all, trust.coverage_of_runs.0, trust.coverage_of_runs.1, trust.out_of_range, trust.out_of_domain
    ));
    if let Some(words) = trust.settled() {
        lines.push(format!("by run {words}"));
    }
    lines.extend(trust.load.iter().map(ToString::to_string));
    lines.extend(trust.friction.iter().map(ToString::to_string));
    lines.extend(trust.far_off.iter().map(ToString::to_string));
    let in_time: Vec<_> = report.breakdown.iter().filter(|cell| cell.by == BY_TIME).collect();
    if in_time.len() > 1 {
        let one = |cell: &&Cell| format!("{}: {:.3} RMS left, the bound holds in {:.1} %", cell.part, cell.after, cell.holds);
        lines.push(format!("{BY_TIME}: {}", in_time.iter().map(one).collect::<Vec<_>>().join("; ")));
    }
    lines.extend(trust.unsettled.iter().map(ToString::to_string));
    lines.join("\n") + "\n"
}
