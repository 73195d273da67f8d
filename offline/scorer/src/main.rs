//! `ravenpose-score`: runs the tool over sealed cases, and scores its reports.

use scorer::{html, markdown, run, trial, verify};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

const USAGE: &str = "usage: ravenpose-score run DIR --tool RAVENPOSE [--jobs N]   (lets `RAVENPOSE gap` answer every case, then publishes)
       ravenpose-score publish DIR                        (hashes of reports/*/report.json into reports/manifest.json)
       ravenpose-score DIR [--out DIR] [--answered-only]  (verifies both manifests, scores, writes score.json, score.html, score.md)";

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    match command(&words) {
        Ok(()) => ExitCode::SUCCESS,
        Err(trouble) => {
            eprintln!("{trouble}");
            ExitCode::from(2)
        }
    }
}

fn command(words: &[String]) -> Result<(), String> {
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    match words[..] {
        ["run", folder, ref rest @ ..] => {
            let (tool, jobs) = match rest {
                ["--tool", tool] => (tool, 1),
                ["--tool", tool, "--jobs", jobs] => (tool, jobs.parse().map_err(|_| format!("--jobs {jobs}: not a number"))?),
                _ => return Err(USAGE.into()),
            };
            let count = run::run(Path::new(folder), Path::new(tool), jobs)?;
            println!("{count} reports");
            Ok(())
        }
        ["publish", folder] => {
            println!("{} reports", run::publish(Path::new(folder))?);
            Ok(())
        }
        [folder, ref rest @ ..] if !folder.starts_with('-') => {
            let (mut out, mut answered_only) = (PathBuf::from(folder), false);
            let mut rest = rest.iter();
            while let Some(word) = rest.next() {
                match *word {
                    "--answered-only" => answered_only = true,
                    "--out" => out = PathBuf::from(rest.next().ok_or(USAGE)?),
                    _ => return Err(format!("`{word}`: not an option\n{USAGE}")),
                }
            }
            score(Path::new(folder), &out, answered_only)
        }
        _ => Err(USAGE.into()),
    }
}

fn score(folder: &Path, out: &Path, answered_only: bool) -> Result<(), String> {
    let score = trial::trial(folder, answered_only)?;
    let json = serde_json::to_string_pretty(&score).map_err(|error| error.to_string())?;
    std::fs::create_dir_all(out).map_err(|error| format!("{}: {error}", out.display()))?;
    for (name, text) in [("score.json", json + "\n"), ("score.html", html::page(&score)), ("score.md", markdown::markdown(&score))]
    {
        let path = out.join(name);
        verify::write_whole(&path, text.as_bytes()).map_err(|error| format!("{}: {error}", path.display()))?;
    }
    print!("{}", markdown::text(&score));
    Ok(())
}
