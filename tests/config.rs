//! Fault F41: whatever is wrong with a configuration, `ravenposed` refuses it with one line that says where, what and what to do.

mod common;

use common::TempDir;
use ravenpose::config::{ArmSources, Config, ModelSource, Wait};
use ravenpose::correction::{Pace, Quantity};
use ravenpose::network::Format;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const BINARY: &str = env!("CARGO_BIN_EXE_ravenposed");
const TOP: &str = "allow_untrained, allow_degraded, transport, loop, limits, gold, green, report";
const LOOP: &str = "core, priority, wait, spin_us, keep_warm, hold_cpu_dma_latency, lock_memory";
const LIMITS: &str = "period_us, stale_us, budget_us, good_cycles, recover_um_per_cycle, rate_um_per_cycle, envelope_mm, recover_deg_per_cycle, rate_deg_per_cycle, envelope_deg, late_degraded, late_fallback";
const SYNTAX: &str = "write key = value, text in double quotes, tables as [name]";
const VALUE: &str = "the value is missing, followed by something else, or text without quotes";

/// Text and the expected line after `ravenposed: FILE`; `{TOP}` and the like stand for the constants above.
const UNKNOWN: [(&str, &str); 14] = [
    ("alow_untrained = true", ":1:1: unknown key `alow_untrained` (did you mean `allow_untrained`?); allowed here: {TOP}"),
    ("# a comment\n\nverbose = true", ":3:1: unknown key `verbose`; allowed here: {TOP}"),
    ("[limit]\nperiod_us = 1000", ":1:2: unknown key `limit` (did you mean `limits`?); allowed here: {TOP}"),
    (
        "[gold]\nmodel = \"a.onnx\"\n[gren]\nmodel = \"a.onnx\"",
        ":3:2: unknown key `gren` (did you mean `green`?); allowed here: {TOP}",
    ),
    (
        "[transport]\nprefx = \"a_\"",
        ":2:1: unknown key `prefx` in [transport] (did you mean `prefix`?); allowed here: prefix, root",
    ),
    ("[loop]\n  prioritty = 80", ":2:3: unknown key `prioritty` in [loop] (did you mean `priority`?); allowed here: {LOOP}"),
    ("[loop]\r\ncorre = 1\r\n", ":2:1: unknown key `corre` in [loop] (did you mean `core`?); allowed here: {LOOP}"),
    ("[limits]\nperiod_ms = 1", ":2:1: unknown key `period_ms` in [limits] (did you mean `period_us`?); allowed here: {LIMITS}"),
    (
        "limits.envelope_um = 9000",
        ":1:8: unknown key `envelope_um` in [limits] (did you mean `envelope_mm`?); allowed here: {LIMITS}",
    ),
    (
        "[gold]\nmodell = \"a.onnx\"",
        ":2:1: unknown key `modell` in [gold] (did you mean `model`?); allowed here: orientation, model, sha256, weights, weights_deviation_um",
    ),
    (
        "[green]\nmodel = \"a.onnx\"\nsha265 = \"\"",
        ":3:1: unknown key `sha265` in [green] (did you mean `sha256`?); allowed here: orientation, model, sha256, weights, weights_deviation_um",
    ),
    (
        "[report]\ninterval = 60",
        ":2:1: unknown key `interval` in [report] (did you mean `interval_s`?); allowed here: runtime_dir, histogram_dir, interval_s",
    ),
    (
        "[loop]\n\"co\\nre\\u001b[31m\\u202e\" = 1",
        ":2:1: unknown key `co\\nre\\u{1b}[31m\\u{202e}` in [loop]; allowed here: {LOOP}",
    ),
    ("[loop]\n\"a`b\" = 1", ":2:1: unknown key `a`b` in [loop]; allowed here: {LOOP}"),
];

const WRONG_TYPE: [(&str, &str); 21] = [
    ("allow_untrained = 1", ":1:19: allow_untrained = 1 must be true or false, without quotes"),
    ("allow_degraded = \"true\"", ":1:18: allow_degraded = \"true\" must be true or false, without quotes"),
    ("[loop]\nlock_memory = \"no\"", ":2:15: loop.lock_memory = \"no\" must be true or false, without quotes"),
    ("[loop]\nhold_cpu_dma_latency = 0", ":2:24: loop.hold_cpu_dma_latency = 0 must be true or false, without quotes"),
    ("[loop]\ncore = \"1\"", ":2:8: loop.core = \"1\" must be a whole number from 0 to 4095"),
    ("[loop]\npriority = 80.0", ":2:12: loop.priority = 80.0 must be a whole number from 1 to 95"),
    ("[loop]\nspin_us = [200]", ":2:11: loop.spin_us is a list and must be a whole number from 0 to 900"),
    ("[loop]\ncore = { number = 1 }", ":2:8: loop.core is a table and must be a whole number from 0 to 4095"),
    ("[loop]\nwait = \"poll\"", ":2:8: loop.wait = \"poll\" must be \"spin\", \"sleep\" or \"event\""),
    ("[loop]\nwait = 3", ":2:8: loop.wait = 3 must be \"spin\", \"sleep\" or \"event\""),
    ("[limits]\nenvelope_mm = \"10 mm\"", ":2:15: limits.envelope_mm = \"10 mm\" must be a number from 0.01 to 50"),
    (
        "[limits]\nrate_um_per_cycle = 2026-11-21",
        ":2:21: limits.rate_um_per_cycle = 2026-11-21 must be a number from 0.01 to 15000",
    ),
    ("[limits]\nrecover_um_per_cycle = true", ":2:24: limits.recover_um_per_cycle = true must be a number from 0.01 to 1000"),
    ("[gold]\nmodel = 3", ":2:9: gold.model = 3 must be a path without control characters, in quotes"),
    ("gold = \"a.onnx\"", ":1:8: gold = \"a.onnx\" must be a table, written [gold] once"),
    ("[[green]]\nmodel = \"a.onnx\"", ":1:1: green is a list and must be a table, written [green] once"),
    ("loop = 1", ":1:8: loop = 1 must be a table, written [loop] once"),
    ("[transport]\nprefix = 7", ":2:10: transport.prefix = 7 must be 1 to 32 letters, digits, '_' or '-', in quotes"),
    ("[transport]\nroot = 7", ":2:8: transport.root = 7 must be an absolute path of at most 100 bytes, in quotes"),
    ("[report]\nhistogram_dir = false", ":2:17: report.histogram_dir = false must be a path without control characters, in quotes"),
    ("[report]\ninterval_s = 1e3", ":2:14: report.interval_s = 1e3 must be a whole number from 1 to 86400"),
];

const WRONG_VALUE: [(&str, &str); 29] = [
    ("[limits]\nstale_us = 1000", ":2:12: limits.stale_us = 1000 must be longer than limits.period_us = 1000"),
    ("[limits]\nperiod_us = 800\nstale_us = 500", ":3:12: limits.stale_us = 500 must be longer than limits.period_us = 800"),
    ("[limits]\nperiod_us = 8_000", ":2:13: limits.stale_us = 5000 (the default) must be longer than limits.period_us = 8000"),
    ("[limits]\nenvelope_mm = nan", ":2:15: limits.envelope_mm = nan must be a number from 0.01 to 50"),
    ("[limits]\nenvelope_mm = inf", ":2:15: limits.envelope_mm = inf must be a number from 0.01 to 50"),
    ("[limits]\nrate_um_per_cycle = -inf", ":2:21: limits.rate_um_per_cycle = -inf must be a number from 0.01 to 15000"),
    ("[limits]\nrecover_um_per_cycle = 1e400", ":2:24: limits.recover_um_per_cycle = 1e400 must be a number from 0.01 to 1000"),
    (
        "[report]\ninterval_s = 99999999999999999999",
        ":2:14: report.interval_s = 99999999999999999999 must be a whole number from 1 to 86400",
    ),
    (
        "[loop]\ncore = -9_223_372_036_854_775_809",
        ":2:8: loop.core = -9_223_372_036_854_775_809 must be a whole number from 0 to 4095",
    ),
    ("loop = { core = 0xFFFF }", ":1:17: loop.core = 0xFFFF must be a whole number from 0 to 4095"),
    ("[transport]\nprefix = \"a/b\"", ":2:10: transport.prefix = \"a/b\" must be 1 to 32 letters, digits, '_' or '-', in quotes"),
    ("[transport]\nprefix = \"\"", ":2:10: transport.prefix = \"\" must be 1 to 32 letters, digits, '_' or '-', in quotes"),
    (
        "[transport]\nprefix = \"a\\nb\"",
        ":2:10: transport.prefix = \"a\\nb\" must be 1 to 32 letters, digits, '_' or '-', in quotes",
    ),
    (
        "[transport]\nroot = \"tmp/iceoryx2\"",
        ":2:8: transport.root = \"tmp/iceoryx2\" must be an absolute path of at most 100 bytes, in quotes",
    ),
    (
        "[transport]\nroot = \"/a\\u0000\"",
        ":2:8: transport.root = \"/a\\u0000\" must be an absolute path of at most 100 bytes, in quotes",
    ),
    ("[transport]\nroot = \"/ä\"", ":2:8: transport root \"/ä/\" is not usable as a file name; use letters, digits, '_' and '-'"),
    (
        "[transport]\nprefix = \"robot_\"\nroot = \"/rrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrr\"\n[loop]\nwait = \"event\"",
        ":3:8: transport prefix \"robot_\" and root \"/rrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrr/\" together have more than the 63 bytes that wait = \"event\" leaves them; give a shorter root",
    ),
    ("[gold]", ":1:1: gold.model is missing; add model = \"FILE.onnx\" to [gold]"),
    (
        "[gold]\nmodel = \"a.onnx\"\nweights = \"int8\"",
        ":3:11: gold.weights = \"int8\" must be \"auto\", \"f32\", \"f16\", \"bf16\", \"i16\", \"i12\" or \"i8\"",
    ),
    (
        "[gold]\nmodel = \"a.onnx\"\nweights_deviation_um = 0",
        ":3:24: gold.weights_deviation_um = 0 must be a number from 0.001 to 1000",
    ),
    (
        "[gold]\nmodel = \"a.onnx\"\n[gold.orientation]\nmodel = \"b.onnx\"\nweights_deviation_um = 1",
        ":5:1: unknown key `weights_deviation_um` in [gold.orientation] (did you mean `weights_deviation_mdeg`?); allowed here: model, sha256, weights, weights_deviation_mdeg",
    ),
    (
        "[gold]\nmodel = \"a.onnx\"\n[gold.orientation]\nmodel = 3",
        ":4:9: gold.orientation.model = 3 must be a path without control characters, in quotes",
    ),
    ("[gold]\n[gold.orientation]\nmodel = \"b.onnx\"", ":1:1: gold.model is missing; add model = \"FILE.onnx\" to [gold]"),
    (
        "[gold]\nmodel = \"a.onnx\"\n[gold.orientation]",
        ":3:1: gold.orientation.model is missing; add model = \"FILE.onnx\" to [gold.orientation]",
    ),
    (
        "[gold]\nmodel = \"a.onnx\"\norientation = \"b.onnx\"",
        ":3:15: gold.orientation = \"b.onnx\" must be a table, written [gold.orientation] once",
    ),
    ("[gold]\nmodel = \"\"", ":2:9: gold.model = \"\" must be a path without control characters, in quotes"),
    ("[gold]\nmodel = \"a\\u0007\"", ":2:9: gold.model = \"a\\u0007\" must be a path without control characters, in quotes"),
    (
        "[green]\nmodel = \"a.onnx\"\nsha256 = \"12ab\"",
        ":3:10: green.sha256 = \"12ab\" must be 64 hexadecimal digits, as `sha256sum MODEL.onnx` prints, in quotes",
    ),
    ("[report]\nruntime_dir = \"\"", ":2:15: report.runtime_dir = \"\" must be a path without control characters, in quotes"),
];

const NOT_TOML: [(&str, &str); 16] = [
    ("allow_untrained = true\nallow_untrained = false", ":2:1: `allow_untrained` is given twice; keep one"),
    ("[loop]\ncore = 1\ncore = 2", ":3:1: `core` is given twice; keep one"),
    ("[loop]\ncore = 1\n[limits]\n[loop]", ":4:2: `loop` is given twice; keep one"),
    ("[transport]\nroot = \"/tmp", ":2:13: not TOML in `root = \"/tmp`: invalid basic string, expected `\"`; {SYNTAX}"),
    ("[transport]\nroot = '''/tmp\n\n", ":4:1: not TOML: invalid multi-line literal string, expected `'`; {SYNTAX}"),
    ("[loop\ncore = 1", ":1:6: not TOML in `[loop`: unclosed table, expected `]`; {SYNTAX}"),
    ("[loop]\ncore = 1 core", ":2:8: not TOML in `core = 1 core`: {VALUE}; {SYNTAX}"),
    ("[limits]\nenvelope_mm = 10 mm", ":2:15: not TOML in `envelope_mm = 10 mm`: {VALUE}; {SYNTAX}"),
    ("[loop]\nwait = sleep", ":2:8: not TOML in `wait = sleep`: {VALUE}; {SYNTAX}"),
    ("[loop]\ncore =", ":2:7: not TOML in `core =`: {VALUE}; {SYNTAX}"),
    ("[loop]\ncore", ":2:5: not TOML in `core`: key with no value, expected `=`; {SYNTAX}"),
    ("core: 3", ":1:7: not TOML in `core: 3`: key with no value, expected `=`; {SYNTAX}"),
    ("= 3", ":1:1: not TOML in `= 3`: unquoted keys cannot be empty, expected letters, numbers, `-`, `_`; {SYNTAX}"),
    ("{\"loop\": {}}", ":1:1: not TOML in `{\"loop\": {}}`: invalid key-value pair, expected key; {SYNTAX}"),
    ("[loop]\ncore = 0x_1", ":2:10: not TOML in `core = 0x_1`: `_` may only go between digits, expected nothing; {SYNTAX}"),
    (
        "[loop]\ncore = 1\rpriority = 2",
        ":2:10: not TOML in `core = 1\\rpriority = 2`: carriage return must be followed by newline, expected newline; {SYNTAX}",
    ),
];

const WRONG_BYTES: [(&[u8], &str); 6] = [
    (b"\xff\xfea\0l\0", ":1:1: UTF-16 text; save the file as UTF-8"),
    (b"\xfe\xff\0a\0l", ":1:1: UTF-16 text; save the file as UTF-8"),
    (b"a\0l\0l\0", ":1:2: a zero byte, as UTF-16 text has it; save the file as UTF-8"),
    (b"# 200 \xb5s\n", ":1:7: not UTF-8 text; save the file as UTF-8"),
    (b"# na\xc3\xafve\n# \xc3\xa9t\xc3\xa9 \xe9\n", ":2:7: not UTF-8 text; save the file as UTF-8"),
    (b"\xef\xbb\xbfloops = 1", ":1:1: unknown key `loops` (did you mean `loop`?); allowed here: {TOP}"),
];

/// Table, key, a number just too small, one just too large, and what is wanted. Every number of the configuration is here.
const RANGES: [(&str, &str, &str, &str, &str); 16] = [
    ("loop", "core", "-1", "4096", "a whole number from 0 to 4095"),
    ("loop", "priority", "0", "96", "a whole number from 1 to 95"),
    ("loop", "spin_us", "-1", "901", "a whole number from 0 to 900"),
    ("limits", "period_us", "99", "10001", "a whole number from 100 to 10000"),
    ("limits", "stale_us", "99", "1000001", "a whole number from 100 to 1000000"),
    ("limits", "budget_us", "0", "100001", "a whole number from 1 to 100000"),
    ("limits", "good_cycles", "0", "100001", "a whole number from 1 to 100000"),
    ("limits", "recover_um_per_cycle", "0.009", "1000.1", "a number from 0.01 to 1000"),
    ("limits", "rate_um_per_cycle", "0", "15000.1", "a number from 0.01 to 15000"),
    ("limits", "envelope_mm", "-10", "50.1", "a number from 0.01 to 50"),
    ("limits", "recover_deg_per_cycle", "0.00009", "2.1", "a number from 0.0001 to 2"),
    ("limits", "rate_deg_per_cycle", "0.00009", "90.1", "a number from 0.0001 to 90"),
    ("limits", "envelope_deg", "0.009", "90.1", "a number from 0.01 to 90"),
    ("limits", "late_degraded", "0", "1001", "a whole number from 1 to 1000"),
    ("limits", "late_fallback", "0", "1001", "a whole number from 1 to 1000"),
    ("report", "interval_s", "0", "86401", "a whole number from 1 to 86400"),
];

/// Every key, no value being its default.
const FULL: &str = r#"
allow_untrained = true
allow_degraded = true
[transport]
prefix = "robot-2_"
root = "/tmp/robot2"
[loop]
core = 3
priority = 70
wait = "event"
spin_us = 150
keep_warm = false
hold_cpu_dma_latency = true
lock_memory = false
[limits]
period_us = 2000
stale_us = 6000
budget_us = 300
good_cycles = 50
recover_um_per_cycle = 5
rate_um_per_cycle = 80.5
envelope_mm = 12.5
recover_deg_per_cycle = 0.01
rate_deg_per_cycle = 0.5
envelope_deg = 20
late_degraded = 2
late_fallback = 7
[gold]
model = "gold.onnx"
sha256 = "ABCDEF0123456789abcdef0123456789abcdef0123456789abcdef0123456789"
weights = "f16"
weights_deviation_um = 2.5
[gold.orientation]
model = "gold-orientation.onnx"
sha256 = "00CDEF0123456789abcdef0123456789abcdef0123456789abcdef0123456789"
weights = "i16"
weights_deviation_mdeg = 4
[green]
model = "/srv/green.onnx"
weights = "auto"
[report]
runtime_dir = "run"
histogram_dir = "../histograms"
interval_s = 10
"#;

fn run(arguments: &[&OsStr]) -> Output {
    Command::new(BINARY).args(arguments).output().expect("the service's binary")
}

fn check(config: &Path) -> Output {
    run(&[OsStr::new("--config"), config.as_os_str(), OsStr::new("--check-config")])
}

/// The one line of a refusal: status 2, nothing on standard output, no control character.
fn refusal(answer: &Output, case: &str) -> String {
    let stderr = String::from_utf8(answer.stderr.clone()).unwrap_or_else(|_| panic!("{case}: not UTF-8"));
    assert_eq!(answer.status.code(), Some(2), "{case}: {stderr}");
    assert!(answer.stdout.is_empty(), "{case}");
    let line = stderr.strip_suffix('\n').unwrap_or_else(|| panic!("{case}: no end of line"));
    assert!(!line.contains(|c: char| c.is_control() || c == '\u{202e}'), "{case}: {line:?}");
    line.to_owned()
}

fn refused(config: &Path, expected: &str, case: &str) {
    let expected = [("{TOP}", TOP), ("{LOOP}", LOOP), ("{LIMITS}", LIMITS), ("{SYNTAX}", SYNTAX), ("{VALUE}", VALUE)]
        .iter()
        .fold(expected.to_owned(), |text, (name, value)| text.replace(name, value));
    assert_eq!(refusal(&check(config), case), format!("ravenposed: {}{expected}", config.display()), "{case}");
}

fn all_refused<'a>(name: &str, cases: impl IntoIterator<Item = (&'a [u8], &'a str)>) {
    let directory = TempDir::new(name);
    for (text, expected) in cases {
        refused(&directory.file("bad.toml", text), expected, &String::from_utf8_lossy(text));
    }
}

fn as_bytes<'a>(cases: &'a [(&'a str, &'a str)]) -> impl Iterator<Item = (&'a [u8], &'a str)> {
    cases.iter().map(|(text, expected)| (text.as_bytes(), *expected))
}

#[test]
fn unknown_keys_are_refused_with_a_suggestion() {
    all_refused("config-unknown", as_bytes(&UNKNOWN));
}

#[test]
fn wrong_types_are_refused_with_what_is_wanted() {
    all_refused("config-type", as_bytes(&WRONG_TYPE));
}

#[test]
fn wrong_values_are_refused_with_what_is_allowed() {
    all_refused("config-value", as_bytes(&WRONG_VALUE));
}

#[test]
fn broken_syntax_is_refused_with_the_line_it_is_in() {
    all_refused("config-syntax", as_bytes(&NOT_TOML));
}

#[test]
fn wrong_encodings_are_refused_with_the_first_wrong_character() {
    all_refused("config-bytes", WRONG_BYTES);
}

#[test]
fn every_number_is_refused_below_and_above_its_range() {
    let directory = TempDir::new("config-range");
    for (table, key, low, high, wanted) in RANGES {
        for value in [low, high] {
            let file = directory.file("bad.toml", format!("[{table}]\n{key} = {value}\n"));
            refused(&file, &format!(":2:{}: {table}.{key} = {value} must be {wanted}", key.len() + 4), key);
        }
    }
}

#[test]
fn files_that_cannot_be_read_are_refused() {
    let directory = TempDir::new("config-file");
    let dangling = directory.0.join("dangling.toml");
    std::os::unix::fs::symlink("nowhere.toml", &dangling).expect("a symlink");
    let endless = directory.0.join("endless.toml");
    std::os::unix::fs::symlink("endless.toml", &endless).expect("a symlink");
    let fifo = directory.0.join("fifo.toml");
    assert!(Command::new("mkfifo").arg(&fifo).status().expect("mkfifo").success());
    let large = directory.file("large.toml", "# padding\n".repeat(1 << 20));
    let cases = [
        (directory.0.join("missing.toml"), "No such file or directory (os error 2)"),
        (dangling, "No such file or directory (os error 2)"),
        (endless, "Too many levels of symbolic links (os error 40)"),
        (directory.0.clone(), "not a regular file"),
        (fifo, "not a regular file"),
        (PathBuf::from("/dev/zero"), "not a regular file"),
        (large, "10485760 bytes, more than the 1048576 allowed"),
    ];
    for (file, cause) in cases {
        let expected = format!(
            ": cannot read the configuration: {cause}; make it (an empty file will do, systemd/ravenposed.toml is a beginning), or give another with --config FILE"
        );
        refused(&file, &expected, &file.display().to_string());
    }
}

#[test]
fn the_shipped_example_is_good_as_it_is_and_with_every_line_in_force() {
    let text = include_str!("../systemd/ravenposed.toml");
    let directory = TempDir::new("config-example");
    let in_force = |line: &str| match line.strip_prefix('#') {
        Some(rest) if rest.starts_with(|c: char| c == '[' || c.is_ascii_lowercase()) => format!("{rest}\n"),
        _ => format!("{line}\n"),
    };
    let whole: String = text.lines().map(in_force).collect();
    let read = |name: &str, text: &str| Config::read(&directory.file(name, text)).expect("a good configuration");
    let (bare, full) = (read("bare.toml", text), read("full.toml", &whole));
    assert!(bare.models.iter().all(Option::is_none) && bare.core.is_none());
    assert!(full.models.iter().all(Option::is_some) && full.core.is_some());
}

#[test]
fn nesting_and_length_without_bound_are_refused_with_a_short_line() {
    let directory = TempDir::new("config-deep");
    let texts = [
        format!("a = {}", "[".repeat(500_000)),
        format!("a = {}", "{a = ".repeat(100_000)),
        format!("a{} = 1", ".a".repeat(250_000)),
        format!("[{}a]", "a.".repeat(250_000)),
        format!("{} = 1", "y".repeat(500_000)),
        format!("[transport]\nprefix = \"{}\"", "y".repeat(500_000)),
        format!("x = \"{}", "y".repeat(500_000)),
    ];
    for text in texts {
        let case = &text[..20];
        let file = directory.file("bad.toml", &text);
        let line = refusal(&check(&file), case);
        assert!(line.starts_with(&format!("ravenposed: {}:", file.display())), "{case}: {line}");
        assert!(line.len() < 500, "{case}: {} bytes", line.len());
    }
}

#[test]
fn a_path_with_control_characters_does_not_break_the_line() {
    let directory = TempDir::new("config-name");
    let file = directory.file("a\nb\u{1b}.toml", "loops = 1");
    let line = refusal(&check(&file), "name");
    let shown = format!("ravenposed: {}/a\\nb\\u{{1b}}.toml:1:1: unknown key `loops`", directory.0.display());
    assert!(line.starts_with(&shown), "{line}");
}

#[test]
fn a_model_that_does_not_exist_is_refused_with_its_path() {
    let directory = TempDir::new("config-model");
    let file = directory.file("good.toml", "[green]\nmodel = \"missing.onnx\"\n");
    let model = directory.0.join("missing.onnx");
    assert_eq!(
        refusal(&check(&file), "missing model"),
        format!(
            "ravenposed: {}: cannot read the model: No such file or directory (os error 2); give the path of an ONNX file",
            model.display()
        )
    );
}

#[test]
fn an_empty_file_is_good_and_says_that_there_is_no_model() {
    let directory = TempDir::new("config-empty");
    for text in ["", "\n", "# nothing\n", "\u{feff}", "[loop]\n[limits]\n[report]\n[transport]\n"] {
        let file = directory.file("good.toml", text);
        let answer = check(&file);
        assert_eq!(answer.status.code(), Some(0), "{text:?}");
        assert_eq!(String::from_utf8_lossy(&answer.stdout), format!("{}: configuration and models are good\n", file.display()));
        let said = String::from_utf8_lossy(&answer.stderr);
        assert_eq!(said, "ravenposed: no model is configured; every pose will be fallback(no_model)\n");
    }
}

#[test]
fn every_key_is_read() {
    let directory = TempDir::new("config-full");
    let config = Config::read(&directory.file("full.toml", FULL)).expect("a good configuration");
    assert!(config.allow_untrained && config.allow_degraded);
    assert_eq!((config.transport.prefix.as_str(), config.transport.root.as_str()), ("robot-2_", "/tmp/robot2/"));
    assert_eq!(
        (config.core, config.priority, config.wait, config.spin_ns, config.keep_warm),
        (Some(3), 70, Wait::Event, 150_000, false)
    );
    assert!(config.hold_cpu_dma_latency && !config.lock_memory);
    let limits = config.limits;
    assert_eq!((limits.period_ns, limits.stale_ns, limits.budget_ns), (2_000_000, 6_000_000, 300_000));
    assert_eq!((limits.good_cycles, limits.late_degraded, limits.late_fallback), (50, 2, 7));
    assert_eq!(limits.position, Pace { recover: 5.0, rate: 80.5, envelope: 12_500.0 });
    assert_eq!(limits.orientation, Pace { recover: 0.01, rate: 0.5, envelope: 20.0 });
    let sha256 = Some("abcdef0123456789abcdef0123456789abcdef0123456789abcdef0123456789".to_owned());
    let weights = Some(Format::F16);
    let position = ModelSource { sha256, weights, weights_deviation: 2.5, ..ModelSource::new(directory.0.join("gold.onnx")) };
    let orientation = ModelSource {
        path: directory.0.join("gold-orientation.onnx"),
        sha256: Some("00cdef0123456789abcdef0123456789abcdef0123456789abcdef0123456789".to_owned()),
        weights: Some(Format::I16),
        weights_deviation: 4.0,
        quantity: Quantity::Orientation,
    };
    assert_eq!(config.models[0], Some(ArmSources { position, orientation: Some(orientation) }));
    let position = ModelSource::new(PathBuf::from("/srv/green.onnx"));
    assert_eq!(config.models[1], Some(ArmSources { position, orientation: None }));
    assert_eq!(config.runtime_dir, directory.0.join("run"));
    assert_eq!(config.histogram_dir, Some(directory.0.join("../histograms")));
    assert_eq!(config.interval_s, 10);
}

#[test]
fn absent_keys_have_their_defaults() {
    let config = Config::parse("empty", "", Path::new("/etc/ravenpose")).expect("an empty configuration");
    assert!(!config.allow_untrained && !config.allow_degraded && !config.hold_cpu_dma_latency && config.lock_memory);
    assert_eq!(
        (config.core, config.priority, config.wait, config.spin_ns, config.keep_warm),
        (None, 80, Wait::Sleep, 400_000, true)
    );
    assert_eq!(config.limits.period_ns, 1_000_000);
    assert_eq!(config.models, [None, None]);
    assert_eq!((config.runtime_dir, config.histogram_dir), (PathBuf::from("/run/ravenpose"), None));
    assert_eq!(config.interval_s, 60);
}

#[test]
fn the_ends_of_every_range_are_good() {
    let ends = [
        "loop = { core = 0, priority = 1, wait = \"spin\", spin_us = 0 }",
        "loop = { core = 4095, priority = 95, wait = \"sleep\", spin_us = 900 }",
        "limits = { period_us = 100, stale_us = 101, budget_us = 1, good_cycles = 1, recover_um_per_cycle = 0.01 }",
        "limits = { period_us = 10000, stale_us = 1000000, budget_us = 100000, good_cycles = 100000, recover_um_per_cycle = 1000 }",
        "limits = { recover_deg_per_cycle = 0.0001, rate_deg_per_cycle = 0.0001, envelope_deg = 0.01 }",
        "limits = { recover_deg_per_cycle = 2, rate_deg_per_cycle = 90, envelope_deg = 90 }",
        "limits = { rate_um_per_cycle = 0.01, envelope_mm = 0.01, late_degraded = 1, late_fallback = 1 }",
        "limits = { rate_um_per_cycle = 15000, envelope_mm = 50, late_degraded = 1000, late_fallback = 1000 }",
        "report = { interval_s = 1 }",
        "report = { interval_s = 86400 }",
        "transport = { prefix = \"abcdefghijklmnopqrstuvwxyz_-0123\", root = \"/\" }",
    ];
    for text in ends {
        let read = Config::parse("ends", text, Path::new("."));
        assert!(read.is_ok(), "{text}: {}", read.err().map(|error| error.to_string()).unwrap_or_default());
    }
}

#[test]
fn a_relative_model_is_found_beside_the_configuration() {
    let directory = TempDir::new("config-relative");
    std::os::unix::fs::symlink(common::untrained().parent().expect("a parent"), directory.0.join("models")).expect("a symlink");
    let file = directory.file("good.toml", "allow_untrained = true\n[gold]\nmodel = \"models/untrained.onnx\"\n");
    let answer =
        Command::new(BINARY).current_dir("/").arg("--config").arg(&file).arg("--check-config").output().expect("the binary");
    let said = String::from_utf8_lossy(&answer.stderr);
    assert_eq!(answer.status.code(), Some(0), "{said}");
    assert!(said.contains("gold arm: the model is UNTRAINED"), "{said}");
}

#[test]
fn help_and_version_say_that_this_is_research_software() {
    for argument in ["--help", "-h", "--version"] {
        let answer = run(&[OsStr::new(argument)]);
        let said = String::from_utf8_lossy(&answer.stdout).to_lowercase();
        assert_eq!(answer.status.code(), Some(0), "{argument}");
        assert!(answer.stderr.is_empty(), "{argument}");
        assert!(said.starts_with("ravenposed ") && said.contains("research software, no clinical use"), "{argument}: {said}");
    }
    assert!(String::from_utf8_lossy(&run(&[OsStr::new("--version")]).stdout).contains(env!("CARGO_PKG_VERSION")));
}

#[test]
fn wrong_arguments_are_refused() {
    let cases: [(&[&str], &str); 6] = [
        (&["--confg"], "unknown argument \"--confg\"; see --help"),
        (&["extra"], "unknown argument \"extra\"; see --help"),
        (&["a\nb"], "unknown argument \"a\\nb\"; see --help"),
        (&["--config"], "--config wants a value; see --help"),
        (&["--config", "a.toml", "--config", "b.toml"], "--config is given twice, first \"a.toml\"; leave one"),
        (&["--test-hook", "1:2"], "--test-hook \"1:2\" is not AFTER:TURNS:MICROSECONDS"),
    ];
    for (arguments, expected) in cases {
        let arguments: Vec<&OsStr> = arguments.iter().map(OsStr::new).collect();
        assert_eq!(refusal(&run(&arguments), expected), format!("ravenposed: {expected}"));
    }
}
