//! `docs/performance.md` with its picture, and `results.json`, from the tables of one run.

use crate::svg;
use crate::table::Table;
use serde_json::json;
use std::fmt::Write as _;
use std::path::Path;

const PAGE: &str = "# Performance

Written by `make bench`: every table by one run of `ravenpose-bench full --write`, the offline tools by `bench/offline.py`
just before it, Keras by `bench/keras_predict.py` when its lines say. Such machines are shared and noisy:
compare by ratio, within one table. `make bench-ci` is the short part; `RAVENPOSE_BENCH_ONLY=tight` (`kernel`, `memory`,
`stages`, `sleep`, `spin`, `event`, `means`, `arms`) one part of that. Simulator, recordings, vision, training and gap finder: `make bench-offline`; recordings of 1 minute to
10 hours: [recordings.md](recordings.md).

- *asked*: what the project set itself; *met* is 1 or 0, and nothing is left out that this run missed.

- *floor*: reading the same bytes of weights once, with nothing else done.
- *once a millisecond* is what a robot sees: between two runs the core sleeps, and whatever else runs pushes the weights out of the cache.
- *ORT*: ONNX Runtime by its C interface, one thread, input and output bound once; from its Python package, which `make venv` installs.
- *avx512vnni*, *avx2+fma*, *portable*: whole-number sums for i16, i12 and i8, float32 otherwise ([decision 0013](decisions/0013-small-weights.md)).
- *kept warm* is how the service runs it: while it waits for a state it reads its weights, here for 0.2 ms before. ONNX Runtime kept warm runs for 0.2 ms before; what is asked of one kept warm is held against that.
- *everything out of the caches*: 128 MiB of other data are read before each run; of so few runs no thousandth is told.
- OpenVINO and Keras are there if `make bench-peers` ran before: their packages take 2 GB.
- *What caches, pages and the core bring*: *read ahead* is reading that many bytes of the weights just before the clock starts; the last six
  rows are of three processes, one after the other: compare them with one another.
- *missed*: answers that did not come within 0.9 ms of the state; they count as 0.9 ms in the quantiles.
- *spin* is measured with real-time throttling off, as it has to be for that ([machine.md](machine.md)): by root, for that long. With it on the kernel stops what spins for 50 of each 1000 ms.
- *one hop*: both sides poll, in a row; *to a thread that an event wakes*: one that does nothing else, once a millisecond, which is what *event* adds to its own work.
- *inference* is guard and network together, as the service measures them; one arm, position alone. Guard, recording and the rest apart:
  *A cycle's parts*.
- The cost of a run is bytes over bandwidth: in the growth tables *floor* is that, the time to read the weights once from where they lie. Below some
  0.1 MB what is done once per layer counts as well.
";

/// What other programs printed, if they ran before.
const OFFLINE: &str = "build/bench/offline.txt";
const PEERS: &str = "build/bench/peers.txt";

/// Writes all of them; the page to `docs/performance.md`.
pub(crate) fn write(tables: &[Table], machine: &str) -> Result<(), String> {
    let mut page = format!("{PAGE}\nMachine: {machine}; commit {}.\n", commit());
    if let Some(picture) = tables.iter().find(|table| table.heading().contains("once a millisecond")).map(svg::bars) {
        whole(Path::new("docs/performance.svg"), &picture)?;
        page.push_str("\n![Median time of one run of the network, by engine and format](performance.svg)\n");
    }
    for table in tables {
        let _ = write!(page, "\n## {}\n\n```text\n{table}```\n", table.heading());
    }
    let [offline, peers] = [OFFLINE, PEERS].map(|path| std::fs::read_to_string(path).unwrap_or_default());
    for (heading, said) in
        [("As the published scripts run it (`make bench-peers`)", &peers), ("Offline tools (`make bench-offline`)", &offline)]
    {
        if !said.is_empty() {
            let _ = write!(page, "\n## {heading}\n\n```text\n{said}```\n");
        }
    }
    whole(Path::new("docs/performance.md"), &page)?;
    let tables: Vec<_> = tables.iter().map(Table::json).collect();
    let results = json!({
        "schema": "ravenpose-bench/1", "machine": machine, "unit": "us unless a column says otherwise", "tables": tables,
        "offline": offline.lines().collect::<Vec<_>>(), "peers": peers.lines().collect::<Vec<_>>(),
    });
    std::fs::create_dir_all("build/bench").map_err(|cause| format!("build/bench: {cause}"))?;
    whole(Path::new("build/bench/results.json"), &format!("{results:#}\n"))
}

fn whole(path: &Path, text: &str) -> Result<(), String> {
    let beside = path.with_extension("new");
    let done = std::fs::write(&beside, text).and_then(|()| std::fs::rename(&beside, path));
    done.map_err(|cause| format!("{}: cannot be written: {cause}", path.display()))
}

/// What was measured, as git names it.
fn commit() -> String {
    let said = std::process::Command::new("git").args(["describe", "--always", "--dirty"]).output();
    let name = said.ok().filter(|said| said.status.success()).map(|said| String::from_utf8_lossy(&said.stdout).trim().to_owned());
    name.unwrap_or_else(|| "unknown".to_owned())
}

/// Processor and kernel, as the machine names them.
pub(crate) fn machine(cores: usize) -> String {
    let read = |path: &str| std::fs::read_to_string(path).unwrap_or_default();
    let cpu = read("/proc/cpuinfo");
    let name = cpu
        .lines()
        .find_map(|line| line.strip_prefix("model name"))
        .map_or("unknown processor", |rest| rest.trim_start_matches([' ', '\t', ':']));
    format!("{name}, {cores} cores, Linux {}", read("/proc/sys/kernel/osrelease").trim())
}
