//! `ravenpose prove`: concealed-truth trials. Three programs that share no code answer for one another: `ravenpose-generate` makes
//! recordings and seals their causes, this program's `gap` answers in processes of its own, `ravenpose-score` opens the envelopes.

use crate::output;
use gap::verdicts::sha256;
use serde_json::{Value, json};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

/// What was asked for.
pub(crate) struct Wish<'a> {
    pub(crate) matrix: &'a str,
    pub(crate) seed: u64,
    pub(crate) out: &'a Path,
    pub(crate) jobs: Option<usize>,
}

/// Exit status when a target of the design is missed (as `diff` has it: 1 found something, 2 trouble).
const MISSED: u8 = 1;

/// Makes what is missing, asks what is unanswered, scores all; stopped, it goes on where it was.
pub(crate) fn run(wish: &Wish) -> Result<ExitCode, String> {
    let own = std::env::current_exe()
        .map_err(|error| format!("where this program stands is not known ({error}); call it by its path"))?;
    let (generate, score) = (beside(&own, "ravenpose-generate")?, beside(&own, "ravenpose-score")?);
    let jobs = wish.jobs.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from)).to_string();
    output::make_folder(wish.out)?;
    begin(wish, &sha256(&read(&own)?))?;

    let seed = wish.seed.to_string();
    let out = wish.out.as_os_str();
    let given = ["--matrix", wish.matrix, "--seed", &seed, "--jobs", &jobs, "--out"].map(OsStr::new);
    let when = if wish.out.join("reports").exists() { "of this trial" } else { "before any answer" };
    call(&generate, given.into_iter().chain([out]))?;
    say!("hash of the sealed truths, {when}: {}", sha256(&read(&wish.out.join("manifest.json"))?));
    call(&score, [OsStr::new("run"), out, OsStr::new("--tool"), own.as_os_str(), OsStr::new("--jobs"), OsStr::new(&jobs)])?;
    call(&score, [out])?;

    let scored = wish.out.join("score.json");
    let text = read(&scored)?;
    let value: Value = serde_json::from_slice(&text).map_err(|error| format!("{}: {error}", scored.display()))?;
    let targets = value["targets"].as_array().map_or(&[][..], Vec::as_slice);
    let missed = targets.iter().filter(|target| target["met"] != true).count();
    say!("{} of {} targets met; {}", targets.len() - missed, targets.len(), wish.out.join("score.html").display());
    Ok(if missed == 0 { ExitCode::SUCCESS } else { ExitCode::from(MISSED) })
}

/// A program that was built with this one.
fn beside(own: &Path, name: &str) -> Result<PathBuf, String> {
    let path = own.with_file_name(name);
    if path.is_file() {
        return Ok(path);
    }
    Err(format!("{}: is not there; build it with make offline, and call the ravenpose that was built with it", path.display()))
}

/// One folder, one trial: what was begun with other numbers or by another program must not be mixed with it.
fn begin(wish: &Wish, tool_sha256: &str) -> Result<(), String> {
    let path = wish.out.join("trial.json");
    let now = json!({ "matrix": wish.matrix, "seed": wish.seed, "tool_sha256": tool_sha256 });
    if !path.exists() {
        if wish.out.join("manifest.json").exists() {
            return Err(format!("{}: holds another trial; give another --out", wish.out.display()));
        }
        return output::all(&path, format!("{now:#}\n").as_bytes());
    }
    let begun: Value =
        serde_json::from_slice(&read(&path)?).map_err(|error| format!("{}: {error}; remove the folder", path.display()))?;
    for (key, what) in [("matrix", "another matrix"), ("seed", "another seed"), ("tool_sha256", "another build of ravenpose")] {
        if begun[key] != now[key] {
            return Err(format!(
                "{}: was begun with {what} ({key} {}); give another --out, or remove it",
                path.display(),
                begun[key]
            ));
        }
    }
    Ok(())
}

fn call<'a>(program: &Path, words: impl IntoIterator<Item = &'a OsStr>) -> Result<(), String> {
    let status =
        Command::new(program).args(words).status().map_err(|error| format!("{}: does not start ({error})", program.display()))?;
    if status.success() { Ok(()) } else { Err(format!("{}: ended with {status}; what it says stands above", program.display())) }
}

fn read(path: &Path) -> Result<Vec<u8>, String> {
    std::fs::read(path).map_err(|error| format!("{}: cannot be read: {error}", path.display()))
}
