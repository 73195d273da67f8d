//! What the caches, huge pages, reading ahead and a core of one's own bring to a run of the network with weights of 16 bits.

use crate::kernel::{EVICTED, flush};
use crate::table::{Table, quantiles};
use ravenpose::network::{Format, InstructionSet, Plan};
use ravenpose_importer::{Activation, Network, Random};
use ravenpose_transport::{now_ns, sleep_until_ns};
use std::process::Command;

/// Hidden layers of the network that the service runs, and of one that fits in a second cache of 512 KiB.
const SHAPES: [(&str, [usize; 5]); 2] = [("600-500-400", [118, 600, 500, 400, 3]), ("250-250-250", [118, 250, 250, 250, 3])];
/// Read between two runs so that nothing of the weights is left in the second cache, but in the third.
const MUCH: usize = 4 << 20;
const RUNS: usize = 2000;
/// Runs of a part, then the next has its turn.
const TURN: usize = 200;
/// Argument of a process that is to do without huge pages.
pub(crate) const SMALL_PAGES: &str = "small-pages";

/// What happens between two runs, or just before one.
#[derive(Clone, Copy, PartialEq)]
enum Before {
    Nothing,
    OtherData,
    Flush,
    Sleep,
}

fn plan(widths: &[usize]) -> Plan {
    let mut random = Random::new(1);
    let network =
        Network::dense(widths, Activation::Sigmoid, |_, inputs| (random.uniform() as f32 - 0.5) * (6.0 / inputs as f32).sqrt());
    Plan::with(&network, InstructionSet::best(), Format::I16).in_one_piece()
}

/// Times of some runs; the first `ahead` bytes of the weights are read just before each. `much` is the other data.
fn times(plan: &mut Plan, much: &[u8], before: Before, ahead: usize, runs: usize) -> Vec<i64> {
    let (input, mut output) = ([0.3_f32; 118], [0.0_f32; 3]);
    let mut next = now_ns();
    let taken = (0..runs)
        .map(|_| {
            match before {
                Before::Nothing => {}
                Before::OtherData => {
                    std::hint::black_box(much.chunks(64).map(|line| u64::from(line[0])).sum::<u64>());
                }
                Before::Flush => plan.memory().for_each(|bytes| flush(bytes.as_ptr(), bytes.len())),
                Before::Sleep => {
                    next = (next + 1_000_000).max(now_ns());
                    sleep_until_ns(next);
                }
            }
            let lines = plan.memory().flat_map(|bytes| bytes.chunks(64));
            std::hint::black_box(lines.take(ahead / 64).map(|line| u64::from(line[0])).sum::<u64>());
            let start = now_ns();
            plan.run(&input, &mut output);
            now_ns() - start
        })
        .collect();
    std::hint::black_box(output);
    taken
}

/// Runs once a millisecond, and with everything out of the caches, as a process of its own: gives the quantiles of each shape and the
/// huge pages in use, KiB.
pub(crate) fn asleep(small_pages: bool) -> Result<String, String> {
    if small_pages {
        rustix::thread::disable_transparent_huge_pages(true)
            .map_err(|cause| format!("no way to do without huge pages: {cause}"))?;
    }
    let mut words = Vec::new();
    let mut plans = SHAPES.map(|(_, widths)| plan(&widths));
    let much = vec![1_u8; EVICTED];
    for plan in &mut plans {
        times(plan, &[], Before::Sleep, 0, TURN);
        let asleep = times(plan, &[], Before::Sleep, 0, RUNS);
        let evicted = times(plan, &much, Before::OtherData, 0, TURN);
        // Of so few runs no thousandth is told.
        let [p50, p99, _, most] = quantiles(&mut { evicted });
        let rows = [quantiles(&mut { asleep }), [p50, p99, f64::NAN, most]];
        words.extend(rows.into_iter().flatten().map(|us| format!("{us:.3}")));
    }
    // While the weights are there.
    let rollup = std::fs::read_to_string("/proc/self/smaps_rollup").unwrap_or_default();
    drop(plans);
    let huge = rollup.lines().find_map(|line| line.strip_prefix("AnonHugePages:")?.split_whitespace().next());
    words.push(huge.unwrap_or("0").to_owned());
    Ok(words.join(" "))
}

/// [`asleep`] in another process: two rows for each shape, and the KiB of huge pages.
fn elsewhere(command: &mut Command) -> Result<(Vec<f64>, f64), String> {
    let output = command.output().map_err(|cause| format!("{command:?}: {cause}"))?;
    let text = String::from_utf8_lossy(&output.stdout);
    let numbers: Vec<f64> = text.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    match numbers.split_last() {
        Some((huge, rows)) if rows.len() == 8 * SHAPES.len() => Ok((rows.to_vec(), *huge)),
        _ => Err(String::from_utf8_lossy(&output.stderr).trim().to_owned()),
    }
}

/// The table.
pub(crate) fn run(core: usize) -> Result<Table, String> {
    let parts = [
        ("tight loop", Before::Nothing, 0),
        ("4 MB of other data read between", Before::OtherData, 0),
        ("  and the first 8 KiB read ahead", Before::OtherData, 8192),
        ("weights flushed from every cache between", Before::Flush, 0),
        ("  and the first 8 KiB read ahead", Before::Flush, 8192),
        ("asleep until the next millisecond", Before::Sleep, 0),
        ("  and the first 8 KiB read ahead", Before::Sleep, 8192),
        ("  and all of them read ahead", Before::Sleep, usize::MAX),
    ];
    let mut table = Table::new("What caches, pages and the core bring: weights of 16 bits, us", &["p50", "p99", "p99.9", "max"]);
    let program = std::env::current_exe().map_err(|cause| cause.to_string())?;
    let [mut own, mut small, mut shielded] = [Command::new(&program), Command::new(&program), Command::new("bench/shield.sh")];
    own.arg("asleep");
    small.args(["asleep", SMALL_PAGES]);
    shielded.arg(core.to_string()).arg(&program).arg("asleep");
    let others = [
        ("  in a process of its own", own),
        ("  and its weights on pages of 4 KiB", small),
        ("  and the core to itself (bench/shield.sh)", shielded),
    ];
    let much = vec![1_u8; MUCH];
    let others = others.map(|(name, mut command)| {
        let found = elsewhere(&mut command);
        match &found {
            Ok((_, huge)) => println!("{}: {huge:.0} KiB on huge pages", name.trim()),
            Err(why) => println!("note: {}: not measured: {why}", name.trim()),
        }
        (name, found.ok())
    });
    for (number, (name, widths)) in SHAPES.into_iter().enumerate() {
        let mut plan = plan(&widths);
        table.row(&format!("{name}, {:.2} MB", plan.bytes() as f64 / 1e6), &[]);
        let mut all: Vec<Vec<i64>> = parts.iter().map(|_| Vec::new()).collect();
        for _ in 0..RUNS / TURN {
            for ((_, before, ahead), all) in parts.iter().zip(&mut all) {
                times(&mut plan, &much, *before, *ahead, 20);
                all.extend(times(&mut plan, &much, *before, *ahead, TURN));
            }
        }
        for ((name, ..), mut times) in parts.iter().zip(all) {
            table.row(name, &quantiles(&mut times));
        }
        for (what, at) in [("", 8 * number), (", everything out of the caches", 8 * number + 4)] {
            for (name, found) in &others {
                let found = found.as_ref().and_then(|(rows, _)| rows.get(at..at + 4));
                table.row(&format!("{name}{what}"), found.unwrap_or(&[f64::NAN; 4]));
            }
        }
    }
    Ok(table)
}
