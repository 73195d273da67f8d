//! `ravenpose-generate`: recordings with a concealed cause.

use generator::case::Order;
use generator::{matrix, seal};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

const USAGE: &str = "usage: ravenpose-generate (--matrix small|full|dev | --case JSON) --out DIR [--seed N] [--only BLOCK] [--jobs N]";

struct Arguments {
    orders: Vec<Order>,
    out: PathBuf,
    jobs: usize,
}

fn main() -> ExitCode {
    match parse(std::env::args().skip(1)).and_then(|arguments| generate(&arguments)) {
        Ok(count) => {
            println!("{count} cases");
            ExitCode::SUCCESS
        }
        Err(trouble) => {
            eprintln!("{trouble}");
            ExitCode::from(2)
        }
    }
}

fn parse(mut words: impl Iterator<Item = String>) -> Result<Arguments, String> {
    let mut given = BTreeMap::new();
    while let Some(word) = words.next() {
        let name = word.strip_prefix("--").filter(|name| ["matrix", "case", "out", "seed", "only", "jobs"].contains(name));
        let name = name.ok_or_else(|| format!("`{word}`: not an option; {USAGE}"))?;
        let value = words.next().ok_or_else(|| format!("--{name} wants a value; {USAGE}"))?;
        given.insert(name.to_owned(), value);
    }
    let number = |name: &str, default: u64| given.get(name).map_or(Ok(default), |text| text.parse().map_err(|_| format!("--{name} {text}: not a number")));
    let seed = number("seed", 1)?;
    let out = given.get("out").map(PathBuf::from).ok_or(USAGE)?;
    let jobs = number("jobs", std::thread::available_parallelism().map_or(1, |cores| cores.get() as u64))? as usize;
    let mut orders = match (given.get("matrix").map(String::as_str), given.get("case")) {
        (Some(name), None) => matrix::named(name, seed).ok_or_else(|| format!("--matrix {name}: small, full or dev"))?,
        (None, Some(text)) => vec![serde_json::from_str(text).map_err(|error| format!("--case: {error}"))?],
        _ => return Err(USAGE.into()),
    };
    if let Some(block) = given.get("only") {
        orders.retain(|order| &order.block == block);
    }
    if orders.is_empty() {
        return Err("no case has this block".into());
    }
    Ok(Arguments { orders, out, jobs: jobs.max(1) })
}

fn generate(arguments: &Arguments) -> Result<usize, String> {
    let Arguments { orders, out, jobs } = arguments;
    std::fs::create_dir_all(out).map_err(|error| format!("{}: {error}", out.display()))?;
    let (next, troubles) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..*jobs {
            scope.spawn(|| {
                while let Some(order) = orders.get(next.fetch_add(1, Ordering::Relaxed)) {
                    if order.is_done(out) {
                        continue;
                    }
                    if let Err(trouble) = order.write(out)
                        && let Ok(mut troubles) = troubles.lock()
                    {
                        troubles.push(format!("{}: {trouble}", order.label));
                    }
                }
            });
        }
    });
    if let Some(first) = troubles.into_inner().unwrap_or_default().first() {
        return Err(first.clone());
    }
    manifest(out).map_err(|error| format!("{}: {error}", out.display()))?;
    Ok(orders.len())
}

/// The public list of hashes.
fn manifest(out: &Path) -> std::io::Result<()> {
    let cases = seal::commitments(&out.join("sealed"))?;
    let manifest = serde_json::json!({
        "schema": "ravenpose-truth-manifest-1",
        "generator": concat!("ravenpose-generator ", env!("CARGO_PKG_VERSION")),
        "hash": "SHA-256 of the canonical JSON of each sealed truth",
        "cases": cases,
    });
    seal::write_whole(&out.join("manifest.json"), (seal::canonical(&manifest) + "\n").as_bytes())
}
