//! Running the program, reading what it leaves, and data to run it on.

pub(crate) use crate::program::{Folder, done, errors, ravenpose, shared, text, with_effect};
use gap_report::{Report, Role, Status, Verdict, check};
use generator::order::{Order, Sealed, Wanted};
use simulator::RobotModel;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Output;

/// Runs of one robot.
pub(crate) struct Case {
    pub(crate) robot: PathBuf,
    pub(crate) real: Vec<PathBuf>,
    pub(crate) sim: Vec<PathBuf>,
}

impl Case {
    /// Analyses it into a folder; the report.
    pub(crate) fn judged(&self, out: &Path) -> Report {
        report(out, &self.gap(out))
    }

    /// Analyses it into a folder.
    pub(crate) fn gap(&self, out: &Path) -> Output {
        self.gap_with(out, &[])
    }

    pub(crate) fn gap_with(&self, out: &Path, more: &[&str]) -> Output {
        let mut arguments = vec!["gap", "--real"];
        arguments.extend(self.real.iter().map(|path| text(path)));
        if !self.sim.is_empty() {
            arguments.push("--sim");
            arguments.extend(self.sim.iter().map(|path| text(path)));
        }
        arguments.extend(["--robot", text(&self.robot), "--out", text(out)]);
        arguments.extend(more);
        ravenpose(&arguments)
    }
}

/// A case of the generator, written into a folder, with its truth. Labels and seeds are those of these tests alone.
pub(crate) fn made(folder: &Folder, label: &str, effects: &[Wanted], seconds: f64) -> (Case, Vec<Sealed>) {
    let order = Order { seed: 77, label: format!("cli/{label}"), effects: effects.to_vec(), seconds, runs: 2, ..Order::default() };
    written(folder, &order)
}

/// The case of an order, written into a folder, with its truth.
pub(crate) fn written(folder: &Folder, order: &Order) -> (Case, Vec<Sealed>) {
    let case = order.make().expect("a case");
    let files: BTreeMap<String, PathBuf> =
        case.files.into_iter().map(|(name, bytes)| (name.clone(), folder.write(&name, bytes))).collect();
    let runs = |start: &str| files.iter().filter(|(name, _)| name.starts_with(start)).map(|(_, path)| path.clone()).collect();
    (Case { robot: files["robot.urdf"].clone(), real: runs("real_"), sim: runs("sim_") }, case.truth.effects)
}

/// A case of a matrix, with its truth.
pub(crate) fn case_of(folder: &Folder, matrix: &str, seed: u64, id: &str) -> (Case, Vec<Sealed>) {
    let orders = generator::matrix::named(matrix, seed).expect("a matrix");
    written(folder, orders.iter().find(|order| order.id() == id).expect("the case"))
}

/// The lines of a table, gzip or not, without metadata.
pub(crate) fn lines(path: &Path) -> Vec<String> {
    let folder = Folder::new(&format!("lines-{}", path.to_string_lossy().replace(['/', '.'], "-")));
    let plain = folder.file("plain.csv");
    done(&["convert", text(path), text(&plain)]);
    let table = std::fs::read_to_string(plain).expect("table");
    table.lines().filter(|line| !line.starts_with('#')).map(str::to_owned).collect()
}

/// A table with its values changed, by column and row, or a column left out where nothing comes back.
pub(crate) fn with_columns(folder: &Folder, name: &str, path: &Path, change: impl Fn(&str, usize, f64) -> Option<f64>) -> PathBuf {
    let all = lines(path);
    let header: Vec<&str> = all[0].split(',').collect();
    let kept: Vec<usize> = (0..header.len()).filter(|k| change(header[*k], 0, 1.0).is_some()).collect();
    let row = |(place, line): (usize, &String)| {
        let cells: Vec<&str> = line.split(',').collect();
        let cell = |k: &usize| {
            // The tip is not in every row.
            cells[*k]
                .parse()
                .map_or_else(|_| cells[*k].to_owned(), |value| change(header[*k], place, value).expect("kept").to_string())
        };
        kept.iter().map(cell).collect::<Vec<_>>().join(",")
    };
    let head = kept.iter().map(|k| header[*k]).collect::<Vec<_>>().join(",");
    let rows: Vec<String> = std::iter::once(head).chain(all[1..].iter().enumerate().map(row)).collect();
    folder.write(name, rows.join("\n") + "\n")
}

/// The report of a folder, after every promise about its files was looked at.
pub(crate) fn report(out: &Path, output: &Output) -> Report {
    let json = std::fs::read_to_string(out.join("report.json")).unwrap_or_else(|error| panic!("{error}: {}", errors(output)));
    let report: Report = serde_json::from_str(&json).expect("a report");
    assert_eq!(check(&report), Vec::<String>::new());
    assert_eq!(violations(&json), Vec::<String>::new());
    let wanted = match report.status {
        Status::NoMismatch => 0,
        Status::InsufficientData => 2,
        _ => 1,
    };
    assert_eq!(output.status.code(), Some(wanted), "{:?}", report.status);
    assert!(errors(output).is_empty(), "{}", errors(output));
    let words = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(words.contains("report.html"), "{words}");
    alone(&std::fs::read_to_string(out.join("report.html")).expect("page"));
    let corrected = out.join("corrected.toml");
    assert_eq!(report.corrected_model.is_some(), corrected.exists());
    if corrected.exists() {
        let model = RobotModel::load(text(&corrected)).expect("corrected.toml is a robot");
        assert!(model.name().ends_with("corrected"), "{}", model.name());
    }
    report
}

/// Violations of the schema that ships.
fn violations(json: &str) -> Vec<String> {
    let schema = include_str!("../../../../models/gap-report.schema.json");
    let schema: serde_json::Value = serde_json::from_str(schema).expect("the schema is JSON");
    let validator = jsonschema::options().should_validate_formats(true).build(&schema).expect("the schema is a schema");
    let report = serde_json::from_str(json).expect("JSON");
    validator.iter_errors(&report).map(|error| format!("{}: {error}", error.instance_path)).collect()
}

/// A page needs nothing from elsewhere: no script, no address, no file.
fn alone(page: &str) {
    assert!(page.contains("<svg") || page.contains("<html"), "{} bytes", page.len());
    for mark in ["<script src", "<link", "<iframe", "@import", "url(", "src=\"http", "href=\"http", "<img src=\"/"] {
        assert!(!page.contains(mark), "{mark}");
    }
    let addresses = page.replace("http://www.w3.org/", "");
    assert!(!addresses.contains("://"), "an address in the page");
}

/// Primary verdicts, first first.
pub(crate) fn primary(report: &Report) -> Vec<&Verdict> {
    report.verdicts.iter().filter(|verdict| verdict.role == Role::Primary).collect()
}

/// The first verdict, which has to be this physics at this joint.
pub(crate) fn named<'r>(report: &'r Report, physics: &str, joint: &str) -> &'r Verdict {
    let first = primary(report)[0];
    assert_eq!(first.physics.to_string(), physics, "{}", report.summary);
    assert_eq!(first.location.joint, [joint]);
    first
}

/// An order of the generator: one physics, with these parameters.
pub(crate) fn wanted(physics: &str, joint: Option<usize>, parameters: &[(&str, f64)]) -> Wanted {
    let parameters = parameters.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
    Wanted { physics: physics.to_owned(), joint, parameters, ..Wanted::default() }
}

/// Value and interval of a parameter.
pub(crate) fn parameter(verdict: &Verdict, name: &str) -> (f64, [f64; 2]) {
    let parameter = verdict.parameters.iter().find(|parameter| parameter.name == name);
    let parameter = parameter.unwrap_or_else(|| panic!("{name} is not among {:?}", verdict.parameters));
    (parameter.value, parameter.ci95)
}

/// The interval holds the truth, and the value is within a share of it.
pub(crate) fn holds(verdict: &Verdict, name: &str, truth: f64, share: f64) {
    let (value, [low, high]) = parameter(verdict, name);
    assert!((low..=high).contains(&truth), "{name}: {truth} is not within {low} to {high}");
    near(verdict, name, truth, share);
    assert!(low < value && value < high, "{name}: {value}");
}

/// The value is within a share of the truth. Whether intervals hold truths is a matter of many cases: docs/proof.md.
pub(crate) fn near(verdict: &Verdict, name: &str, truth: f64, share: f64) {
    let (value, _) = parameter(verdict, name);
    assert!((value - truth).abs() <= share * truth.abs(), "{name}: {value} for {truth}");
}

/// One line on standard error, exit status 2, these words in it, and nothing under the folder.
pub(crate) fn refused(output: &Output, out: &Path, words: &[&str]) {
    crate::program::refused(output, words);
    assert!(!out.exists(), "{} was written", out.display());
}
