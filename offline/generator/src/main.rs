//! `ravenpose-generate`: recordings with a concealed cause.

use generator::order::Order;
use generator::{batch, matrix};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::ExitCode;

const USAGE: &str =
    "usage: ravenpose-generate (--matrix small|full|dev | --case JSON) --out DIR [--seed N] [--only BLOCK|CASE] [--jobs N]";

struct Arguments {
    orders: Vec<Order>,
    out: PathBuf,
    jobs: usize,
}

fn main() -> ExitCode {
    match parse(std::env::args().skip(1))
        .and_then(|given| batch::make(&given.orders, &given.out, given.jobs).map(|()| given.orders.len()))
    {
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
    let number = |name: &str, default: u64| {
        given.get(name).map_or(Ok(default), |text| text.parse().map_err(|_| format!("--{name} {text}: not a number")))
    };
    let seed = number("seed", 1)?;
    let out = given.get("out").map(PathBuf::from).ok_or(USAGE)?;
    let jobs = number("jobs", std::thread::available_parallelism().map_or(1, |cores| cores.get() as u64))? as usize;
    let mut orders = match (given.get("matrix").map(String::as_str), given.get("case")) {
        (Some(name), None) => matrix::named(name, seed).ok_or_else(|| format!("--matrix {name}: small, full or dev"))?,
        (None, Some(text)) => vec![serde_json::from_str(text).map_err(|error| format!("--case: {error}"))?],
        _ => return Err(USAGE.into()),
    };
    if let Some(wanted) = given.get("only") {
        orders.retain(|order| &order.block == wanted || &order.id() == wanted);
        if orders.is_empty() {
            return Err(format!("--only {wanted}: neither a block of this matrix nor a case of this seed"));
        }
    }
    Ok(Arguments { orders, out, jobs: jobs.max(1) })
}
