//! Faults F21 to F23: a model that is damaged, of the wrong shape, or whose card belongs to another network never starts.

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/onnx.rs"]
mod onnx;

mod cards;
mod golden;

use common::{Rng, TempDir};
use onnx::{Onnx, Small, words};
use ravenpose::card::Card;
use ravenpose::config::ModelSource;
use ravenpose::correction::{Model, Quantity};
use ravenpose::model::{self, Estimate};
use ravenpose::network::{Format, InstructionSet};
use ravenpose_wire::{FEATURES, features};
use sha2::{Digest, Sha256};
use std::fmt::Write;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const BINARY: &str = env!("CARGO_BIN_EXE_ravenposed");

fn small() -> Small {
    Small::new(FEATURES, 3)
}

fn hash(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

/// Loads a file; a refusal must be one printable line that begins with the file.
fn load(path: &Path, sha256: Option<String>) -> Result<(Model<Estimate>, Card), String> {
    load_as(path, sha256, Quantity::Position)
}

fn load_as(path: &Path, sha256: Option<String>, quantity: Quantity) -> Result<(Model<Estimate>, Card), String> {
    let source = ModelSource { sha256, quantity, ..ModelSource::new(path.to_owned()) };
    model::load(&source).map(|loaded| (loaded.model, loaded.card)).map_err(|error| {
        let line = error.to_string();
        assert!(!line.contains(|c: char| c.is_control() || c == '\u{202e}'), "{line:?}");
        assert!(line.len() < 700, "{} bytes: {line}", line.len());
        line.strip_prefix(&format!("{}: ", path.display())).unwrap_or_else(|| panic!("names no file: {line}")).to_owned()
    })
}

/// Loads these bytes with their right hash.
fn load_bytes(directory: &TempDir, bytes: &[u8]) -> Result<(Model<Estimate>, Card), String> {
    load(&directory.file("model.onnx", bytes), Some(hash(bytes)))
}

fn refusal(directory: &TempDir, bytes: &[u8]) -> String {
    load_bytes(directory, bytes).err().expect("a refusal")
}

/// With this value of `ravenpose.KEY` the model is refused for this problem.
fn assert_refused(directory: &TempDir, onnx: Onnx, key: &str, value: String, problem: &str) {
    let key = format!("ravenpose.{key}");
    assert_eq!(refusal(directory, &onnx.set(&key, value).bytes()), format!("property {key}: {problem}"));
}

/// Runs `ravenposed --check-config` in 1 GiB of address space and 3 s of processor time: the kernel ends it beyond that.
fn service(config: &Path) -> Output {
    let script = "ulimit -v 1048576 && ulimit -t 3 && exec timeout -s KILL 120 \"$0\" --config \"$1\" --check-config";
    Command::new("sh").args(["-c", script, BINARY]).arg(config).output().expect("sh")
}

/// The one line with which the service refuses a configuration.
fn service_refusal(config: &Path) -> String {
    let answer = service(config);
    let said = String::from_utf8(answer.stderr).expect("UTF-8");
    assert_eq!(answer.status.code(), Some(2), "{said}");
    assert!(answer.stdout.is_empty());
    let line = said.strip_suffix('\n').expect("a line");
    assert!(!line.contains(char::is_control), "{line:?}");
    line.strip_prefix("ravenposed: ").unwrap_or_else(|| panic!("{line}")).to_owned()
}

fn make_fifo(path: &Path) {
    assert!(Command::new("mkfifo").arg(path).status().expect("mkfifo").success());
}

#[test]
fn the_right_hash_is_accepted_in_every_form_that_sha256sum_writes() {
    let directory = TempDir::new("models-hash-good");
    let bytes = small().trained().bytes();
    let path = directory.file("model.onnx", &bytes);
    let right = hash(&bytes);
    for text in [
        format!("{right}  model.onnx\n"),
        format!("{right} *model.onnx\n"),
        right.clone(),
        format!("{}  model.onnx\r\n", right.to_uppercase()),
    ] {
        directory.file("model.onnx.sha256", &text);
        let (model, card) = load(&path, None).unwrap_or_else(|line| panic!("{text:?}: {line}"));
        assert!(!model.untrained && !card.untrained);
        assert_eq!(format!("{:016x}", model.id), right[..16], "the identity is the beginning of the hash");
    }
    directory.file("model.onnx.sha256", "nothing");
    assert!(load(&path, Some(right.to_uppercase())).is_ok(), "the configuration's hash goes first");
}

#[test]
fn a_missing_or_malformed_hash_is_refused_with_the_command_that_makes_one() {
    let directory = TempDir::new("models-hash-bad");
    let path = directory.file("model.onnx", small().trained().bytes());
    let beside = directory.0.join("model.onnx.sha256");
    let check = |cause: &str| {
        let expected = format!(
            "no usable hash beside the model ({}: {cause}); run `sha256sum model.onnx > model.onnx.sha256` in its directory after checking where it comes from",
            beside.display()
        );
        assert_eq!(load(&path, None).err().expect("a refusal"), expected);
    };
    check("No such file or directory (os error 2)");
    let no_digits = "does not begin with 64 hexadecimal digits";
    let digits = "0123456789abcdef".repeat(4);
    for text in ["", "\n", "model.onnx", &digits[1..], &format!("{digits}0"), &format!("g{}", &digits[1..]), &format!("\\{digits}")]
    {
        std::fs::write(&beside, text).expect("a file");
        check(no_digits);
    }
    std::fs::write(&beside, b"\xff\xfe\0\x1b[2J").expect("a file");
    check(no_digits);
    std::fs::write(&beside, vec![b'a'; 10_000]).expect("a file");
    check("10000 bytes, more than the 8192 allowed");
    std::fs::remove_file(&beside).expect("a file");
    std::fs::create_dir(&beside).expect("a directory");
    check("not a regular file");
    std::fs::remove_dir(&beside).expect("a directory");
    // Through the service, which is stopped if it should wait for a writer.
    make_fifo(&beside);
    let line = service_refusal(&directory.file("config.toml", "[gold]\nmodel = \"model.onnx\"\n"));
    assert!(line.contains(&format!("({}: not a regular file)", beside.display())), "{line}");
}

#[test]
fn a_wrong_hash_is_refused_with_both_hashes_and_where_the_expected_one_stands() {
    let directory = TempDir::new("models-hash-wrong");
    let bytes = small().trained().bytes();
    let path = directory.file("model.onnx", &bytes);
    let found = hash(&bytes);
    let expected = hash(b"another file");
    let beside = directory.file("model.onnx.sha256", format!("{expected}  model.onnx\n"));
    let line = |origin: &str| {
        format!("SHA-256 is {found}, expected {expected} (from {origin}); the file was changed or damaged, copy it again")
    };
    assert_eq!(load(&path, None).err(), Some(line(&beside.display().to_string())));
    directory.file("model.onnx.sha256", format!("{found}  model.onnx\n"));
    assert_eq!(load(&path, Some(expected.clone())).err(), Some(line("the configuration")));
}

#[test]
fn every_truncation_is_refused_by_hash_and_by_content() {
    let directory = TempDir::new("models-cut");
    let whole = std::fs::read(common::untrained()).expect("the repository's model");
    let right = hash(&whole);
    let path = directory.file("model.onnx", &whole);
    let file = std::fs::OpenOptions::new().write(true).open(&path).expect("the copy");
    // From the longest on, so that cutting the same file gives each of them.
    for step in (0..60).rev() {
        let length = if step == 59 { whole.len() - 1 } else { whole.len() * step / 59 };
        file.set_len(length as u64).expect("a shorter file");
        let found = hash(&whole[..length]);
        let line = load(&path, Some(right.clone())).err().expect("a refusal");
        assert!(line.starts_with(&format!("SHA-256 is {found}, expected {right}")), "{length}: {line}");
        let line = load(&path, Some(found)).err().expect("a refusal without the hash's help");
        assert!(line.starts_with("not an ONNX file, or cut off: ") || length == 0, "{length}: {line}");
    }
}

/// Flips one random bit at a time; every one must be refused by the hash.
fn flip(path: &Path, flips: u32, rng: &mut Rng) {
    let whole = std::fs::read(path).expect("the copy");
    let right = hash(&whole);
    let file = std::fs::OpenOptions::new().write(true).open(path).expect("the copy");
    for _ in 0..flips {
        let (at, bit) = (rng.below(whole.len() as u64), rng.below(8));
        let byte = whole[at as usize];
        file.write_all_at(&[byte ^ (1 << bit)], at).expect("a flipped bit");
        let line = load(path, Some(right.clone())).err().unwrap_or_else(|| panic!("byte {at}, bit {bit} was accepted"));
        assert!(line.starts_with("SHA-256 is ") && line.contains(&right), "byte {at}, bit {bit}: {line}");
        file.write_all_at(&[byte], at).expect("the byte as it was");
    }
    assert!(load(path, Some(right)).is_ok(), "the file is whole again");
}

#[test]
fn ten_thousand_flipped_bits_are_all_refused() {
    let directory = TempDir::new("models-flip");
    let path = directory.file("model.onnx", small().trained().bytes());
    flip(&path, 10_000, &mut Rng(0xF21));
}

#[test]
fn flipped_bits_of_the_full_size_model_are_all_refused() {
    let directory = TempDir::new("models-flip-large");
    let path = directory.file("model.onnx", std::fs::read(common::untrained()).expect("the repository's model"));
    flip(&path, 300, &mut Rng(0xF22));
}

#[test]
fn other_files_are_refused_by_hash_and_by_content() {
    let directory = TempDir::new("models-other");
    let right = hash(&small().trained().bytes());
    let cases: [(&str, Vec<u8>); 8] = [
        ("empty", Vec::new()),
        ("zeros", vec![0; 10_000]),
        ("ones", vec![0xff; 10_000]),
        ("a program", std::fs::read(BINARY).expect("the binary")),
        ("text", b"ravenpose model\n".to_vec()),
        ("a picture", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x01".to_vec()),
        ("an archive", b"PK\x03\x04\x14\0\0\0\x08\0".to_vec()),
        ("a link of git-lfs", b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n".to_vec()),
    ];
    for (case, bytes) in cases {
        let path = directory.file("model.onnx", &bytes);
        let line = load(&path, Some(right.clone())).err().expect(case);
        assert!(line.starts_with(&format!("SHA-256 is {}, expected {right}", hash(&bytes))), "{case}: {line}");
        let line = load(&path, Some(hash(&bytes))).err().expect(case);
        let content = ["not an ONNX file, or cut off: ", "the file is empty: ", "the model has no graph: "];
        assert!(content.iter().any(|start| line.starts_with(start)), "{case}: {line}");
    }
}

#[test]
fn what_is_no_file_of_bounded_size_is_refused_at_once() {
    let directory = TempDir::new("models-file");
    let sparse = directory.file("sparse.onnx", "");
    let file = std::fs::OpenOptions::new().write(true).open(&sparse).expect("the file");
    file.set_len(4 << 30).expect("a sparse file of 4 GiB");
    let fifo = directory.0.join("fifo.onnx");
    make_fifo(&fifo);
    let dangling = directory.0.join("dangling.onnx");
    std::os::unix::fs::symlink("nowhere.onnx", &dangling).expect("a symlink");
    let cases = [
        (sparse, "4294967296 bytes, more than the 134217728 allowed"),
        (fifo, "not a regular file"),
        (directory.0.clone(), "not a regular file"),
        (PathBuf::from("/dev/zero"), "not a regular file"),
        (dangling, "No such file or directory (os error 2)"),
        (directory.0.join("missing.onnx"), "No such file or directory (os error 2)"),
    ];
    for (path, cause) in cases {
        let config = directory.file("config.toml", format!("[gold]\nmodel = \"{}\"\n", path.display()));
        let expected = format!("{}: cannot read the model: {cause}; give the path of an ONNX file", path.display());
        assert_eq!(service_refusal(&config), expected);
    }
}

/// What the refusal of each hostile file must name; `None` for those that load.
const HOSTILE: [(&str, Option<&str>); 28] = [
    ("ok_small.onnx", None),
    ("dynamic_batch_ok.onnx", None),
    ("empty.onnx", Some("the file is empty")),
    ("random_bytes.onnx", Some("not an ONNX file")),
    ("text_not_onnx.onnx", Some("not an ONNX file")),
    ("truncated_half.onnx", Some("cut off")),
    ("truncated_last_byte.onnx", Some("cut off")),
    ("input_width_117.onnx", Some("graph input `ravenstate` has shape [1, 117]: expected [1, 118]")),
    ("output_width_4.onnx", Some("graph output `position_error` has shape [1, 4]: expected [1, 3]")),
    ("declared_120_weights_118.onnx", Some("graph input `ravenstate` has shape [1, 120]: expected [1, 118]")),
    ("batch_64.onnx", Some("graph input `ravenstate` has shape [64, 118]: expected [1, 118]")),
    ("float16.onnx", Some("is FLOAT16: expected float32")),
    ("weight_nan.onnx", Some("is NaN: expected a finite float32")),
    ("bias_inf.onnx", Some("is inf: expected a finite float32")),
    ("bn_negative_variance.onnx", Some("is -0.5: expected more than 0")),
    ("unsupported_op_erf.onnx", Some("operator `Erf` is not supported")),
    ("custom_domain_op.onnx", Some("operator `RavenMagic` of domain `com.example`")),
    ("control_flow_if.onnx", Some("operator `If`")),
    ("two_inputs.onnx", Some("2 graph inputs")),
    ("huge_dims_header.onnx", Some("has dimensions")),
    ("negative_dim.onnx", Some("has dimensions")),
    ("raw_data_too_short.onnx", Some("stores")),
    ("missing_initializer.onnx", Some("is missing: expected an initializer")),
    ("layer_width_mismatch.onnx", Some("width")),
    ("cycle.onnx", Some("cycle")),
    ("output_not_produced.onnx", Some("is not produced by any node")),
    ("external_data_path_escape.onnx", Some("keeps external data")),
    ("opset_999.onnx", Some("opset 999")),
];

#[test]
fn the_service_handles_every_hostile_file_as_its_readme_wants() {
    let Some(bad) = common::shared("models/bad") else { return };
    let entries = std::fs::read_dir(&bad).expect("the directory").map(|entry| entry.expect("an entry").file_name());
    let mut present: Vec<_> = entries.filter_map(|name| name.into_string().ok()).filter(|name| name != "README.md").collect();
    let mut known: Vec<&str> = HOSTILE.iter().map(|(name, _)| *name).collect();
    present.sort_unstable();
    known.sort_unstable();
    assert_eq!(present, known, "the table lists every file");

    let directory = TempDir::new("models-hostile");
    for (name, reason) in HOSTILE {
        let bytes = std::fs::read(bad.join(name)).expect(name);
        let path = directory.file(name, &bytes);
        directory.file(&format!("{name}.sha256"), format!("{}  {name}\n", hash(&bytes)));
        let config = directory.file("config.toml", format!("allow_untrained = true\n[green]\nmodel = \"{name}\"\n"));
        let Some(reason) = reason else {
            let answer = service(&config);
            assert_eq!(answer.status.code(), Some(0), "{name}");
            assert!(String::from_utf8_lossy(&answer.stderr).contains("green arm: the model is UNTRAINED"), "{name}");
            continue;
        };
        let line = service_refusal(&config);
        assert!(line.starts_with(&format!("{}: ", path.display())) && line.contains(reason), "{name}: {line}");
    }
}

#[test]
fn networks_of_another_shape_type_or_operator_are_refused_with_expected_and_found() {
    let directory = TempDir::new("models-shape");
    let changed = |change: fn(&mut Small)| {
        let mut network = small();
        change(&mut network);
        network.onnx().bytes()
    };
    let cases: [(Vec<u8>, &str); 10] = [
        (Small::new(117, 3).onnx().bytes(), "graph input `ravenstate` has shape [1, 117]: expected [1, 118]; "),
        (Small::new(119, 3).onnx().bytes(), "graph input `ravenstate` has shape [1, 119]: expected [1, 118]; "),
        (Small::new(118, 2).onnx().bytes(), "graph output `error` has shape [1, 2]: expected [1, 3]; "),
        (Small::new(118, 4).onnx().bytes(), "graph output `error` has shape [1, 4]: expected [1, 3]; "),
        (changed(|network| network.element = Small::DOUBLE), "graph input `ravenstate` is DOUBLE: expected float32; "),
        (changed(|network| network.activation = "Softmax"), "node `node.hidden`: operator `Softmax` is not supported: expected "),
        (changed(|network| network.activation = "Raven"), "node `node.hidden`: operator `Raven` is not supported: expected "),
        (changed(|network| network.hidden_weights[130] = f32::NAN), "`w0`, number 130, is NaN: expected a finite float32"),
        (changed(|network| network.last_bias[2] = f32::NEG_INFINITY), "`b1`, number 2, is -inf: expected a finite float32"),
        (
            changed(|network| network.last_bias.truncate(2)),
            "tensor `b1` stores 8 bytes of raw data: expected 3 numbers for dimensions [3]",
        ),
    ];
    for (bytes, expected) in cases {
        let line = refusal(&directory, &bytes);
        assert!(line.starts_with(expected), "{line}");
    }
}

/// With a right hash only the content speaks: whatever is read must end in a model or in one line.
#[test]
fn a_flipped_bit_under_a_right_hash_gives_a_model_or_one_line() {
    let directory = TempDir::new("models-flip-hash");
    let whole = small().trained().bytes();
    let mut rng = Rng(0xB17);
    let mut refused = 0;
    for _ in 0..500 {
        let mut bytes = whole.clone();
        bytes[rng.below(whole.len() as u64) as usize] ^= 1 << rng.below(8);
        refused += u32::from(load_bytes(&directory, &bytes).is_err());
    }
    println!("{refused} of 500 refused by content alone");
    assert!(refused > 100, "{refused}");
}

#[test]
fn the_smallest_weights_that_are_exact_enough_are_chosen_and_a_format_that_is_not_is_refused() {
    let with = |weights, weights_deviation| {
        let source = ModelSource { weights, weights_deviation, ..ModelSource::new(common::untrained()) };
        model::load(&source)
            .map(|loaded| (loaded.model.estimator.plan().format(), loaded.deviation.worst * 1000.0, loaded.weights()))
    };
    let worst = |format| with(Some(format), 1000.0).expect("exact enough").1;
    let (i8, i12, i16) = (worst(Format::I8), worst(Format::I12), worst(Format::I16));
    assert!(i16 < i12 && i12 < i8 / 3.0, "{i16} {i12} {i8}");
    // Without byte products 12 bits take as much room as 16, and are not for a free choice.
    let packed = InstructionSet::best() == InstructionSet::Avx512Vnni;
    let between = if packed { Format::I12 } else { Format::I16 };
    for (limit_um, format) in
        [(1e-3, Format::F32), (0.5 * (i16 + i12), Format::I16), (0.9 * i8, between), (1.1 * i8, Format::I8), (1000.0, Format::I8)]
    {
        let (chosen, deviation_um, said) = with(None, limit_um).expect("a choice");
        assert_eq!(chosen, format, "{limit_um}");
        assert!(deviation_um <= limit_um && said.starts_with(&format!("weights {format}, at most ")), "{said}");
    }
    for format in Format::ALL {
        assert_eq!(with(Some(format), 1000.0).expect("exact enough").0, format);
        let narrow = with(Some(format), 1e-3);
        if format == Format::F32 {
            assert!(narrow.is_ok(), "float32 is the network as it came");
        } else {
            let line = narrow.expect_err("a refusal").to_string();
            assert!(line.contains(&format!("untrained.onnx: weights of format {format} deviate by up to 0.0")), "{line}");
            assert!(line.ends_with("choose another format, weights = \"auto\", or raise weights_deviation_um"), "{line}");
        }
    }
}

#[test]
fn the_service_says_what_it_does_with_each_kind_of_model() {
    let directory = TempDir::new("models-service");
    let model = |name: &str, onnx: &Onnx| {
        let bytes = onnx.bytes();
        directory.file(&format!("{name}.sha256"), format!("{}  {name}\n", hash(&bytes)));
        directory.file(name, bytes).display().to_string()
    };
    model("trained.onnx", &small().trained());
    model("untrained.onnx", &Onnx::untrained());
    let wrong = model("wrong.onnx", &small().trained().with_golden(|rows| rows[0][118] += 1.0));
    model("turning.onnx", &small().trained().set("ravenpose.units", Quantity::Orientation.units()));
    let gold = |name: &str| format!("[gold]\nmodel = \"{name}\"\n");
    let turned = |name: &str| format!("{}[gold.orientation]\nmodel = \"{name}\"\n", gold("trained.onnx"));
    let good = [
        (gold("trained.onnx"), String::new()),
        (
            gold("untrained.onnx"),
            "ravenposed: gold arm: the model is untrained; every pose will be fallback(untrained)\n".to_owned(),
        ),
        (
            format!("allow_untrained = true\n{}", gold("untrained.onnx")),
            "ravenposed: gold arm: the model is UNTRAINED; allow_untrained = true publishes its numbers all the same\n".to_owned(),
        ),
        (
            format!("allow_degraded = true\n{}", gold("wrong.onnx")),
            format!("ravenposed: gold arm: {wrong}: golden pair 0: output 0 is "),
        ),
        (turned("turning.onnx"), String::new()),
        (format!("allow_degraded = true\n{}", turned("trained.onnx")), "ravenposed: orientation of the gold arm: ".to_owned()),
    ];
    for (config, said) in good {
        let answer = service(&directory.file("config.toml", &config));
        let stderr = String::from_utf8_lossy(&answer.stderr);
        assert_eq!(answer.status.code(), Some(0), "{config}{stderr}");
        let (weights, others): (Vec<&str>, Vec<&str>) = stderr.lines().partition(|line| line.contains(" arm: weights "));
        let refused = config.matches("allow_degraded").count();
        assert_eq!(weights.len() + refused, config.matches(".onnx").count(), "{config}{stderr}");
        assert!(
            others.len() <= 1 && others.first().map_or(said.is_empty(), |line| format!("{line}\n").starts_with(&said)),
            "{config}{stderr}"
        );
    }
    let line =
        service_refusal(&directory.file("config.toml", format!("{}[green]\nmodel = \"trained.onnx\"\n", gold("wrong.onnx"))));
    assert!(line.starts_with(&format!("{wrong}: golden pair 0: output 0 is ")), "{line}");
    let line = service_refusal(&directory.file("config.toml", gold("turning.onnx")));
    assert!(line.contains("turning.onnx: corrects the orientation, not the position; "), "{line}");
}
