//! Faults F21 to F23: a model that is damaged, of the wrong shape, or whose card belongs to another network never starts.

mod common;
#[path = "common/onnx.rs"]
mod onnx;

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

#[test]
fn a_trained_model_loads_with_everything_that_its_card_states() {
    let directory = TempDir::new("models-trained");
    let (model, card) = load_bytes(&directory, &small().trained().bytes()).expect("a trained model");
    assert!(!card.untrained && !model.untrained);
    assert_eq!((card.bound, card.bound95), (12.5, [1.0, 2.0, 3.0]));
    assert_eq!((model.bound, model.bound95), (12_500.0, [1000.0, 2000.0, 3000.0]));
    assert_eq!(card.golden.len(), 4);
    // Pedal down, unless it says otherwise; any board.
    assert_eq!((card.allowed.runlevels.as_slice(), card.allowed.boards.as_slice()), (&[3][..], &[][..]));
    let stated = small().trained().set("ravenpose.runlevels", "2 3").set("ravenpose.boards", "49");
    let (model, _) = load_bytes(&directory, &stated.bytes()).expect("a trained model");
    assert_eq!((model.allowed.runlevels.as_slice(), model.allowed.boards.as_slice()), (&[2, 3][..], &[49][..]));
    let domain = card.domain.expect("a domain");
    assert_eq!((domain.min[117], domain.max[0], domain.center[5], domain.weight[5], domain.limit), (-2.0, 2.0, 0.0, 0.5, 3.0));
}

#[test]
fn an_untrained_model_needs_no_card() {
    let directory = TempDir::new("models-cardless");
    let trained = small().trained();
    let cases = [
        ("no metadata", small().onnx()),
        ("trained on nothing", small().onnx().set("ravenpose.trained_on", "nothing: random weights")),
        ("blank", small().onnx().set("ravenpose.trained_on", "  ")),
        ("foreign metadata", small().onnx().set("producer", "a\nb\u{1b}")),
        ("the mark removed", trained.without("ravenpose.trained_on")),
    ];
    for (case, onnx) in cases {
        let (model, card) = load_bytes(&directory, &onnx.bytes()).unwrap_or_else(|line| panic!("{case}: {line}"));
        assert!(model.untrained && card.untrained, "{case}");
    }
    let (_, card) = load_bytes(&directory, &small().onnx().bytes()).expect("no metadata");
    assert!(card.domain.is_none() && card.golden.is_empty() && card.bound95.iter().all(|bound| bound.is_nan()));
}

#[test]
fn every_missing_property_of_a_trained_model_is_refused_by_name() {
    let directory = TempDir::new("models-missing");
    for key in [
        "ravenpose.feature_layout",
        "ravenpose.units",
        "ravenpose.feature_min",
        "ravenpose.feature_max",
        "ravenpose.domain_center",
        "ravenpose.domain_weight",
        "ravenpose.domain_limit",
        "ravenpose.golden",
    ] {
        let line = refusal(&directory, &small().trained().without(key).bytes());
        assert_eq!(line, format!("property {key} is missing; a trained model states it, see docs/models.md"));
    }
    let half = small().onnx().set("ravenpose.feature_min", words(&[0.0; FEATURES]));
    let line = refusal(&directory, &half.bytes());
    assert!(line.starts_with("property ravenpose.feature_max is missing"), "half a domain: {line}");
}

/// The card of a model that watches the load.
fn watching() -> Onnx {
    let rows = [0.1; 3 * 122];
    small()
        .trained()
        .set("ravenpose.load_expected", words(&rows))
        .set("ravenpose.load_pull", words(&[0.5; 12]))
        .set("ravenpose.load_noise_nm", "0.1 0.2 0.3")
        .set("ravenpose.load_weight", "1 2 3")
        .set("ravenpose.load_travel_deg", "10 20 30")
        .set("ravenpose.load_information", "1 2 3")
        .set("ravenpose.load_limit_kg", "0.25")
}

#[test]
fn what_a_card_says_about_load_is_read_whole_or_refused() {
    let directory = TempDir::new("models-load");
    let (_, card) = load_bytes(&directory, &small().trained().bytes()).expect("a model that does not watch");
    assert_eq!(card.load, None);
    let (model, card) = load_bytes(&directory, &watching().bytes()).expect("a model that does");
    let load = card.load.expect("load");
    assert_eq!((load.weight, load.travel_deg, load.limit_kg), ([1.0, 2.0, 3.0], [10.0, 20.0, 30.0], 0.25));
    assert!(load.expected.iter().all(|row| row.len() == 122) && load.pull == [[0.5; 4]; 3]);
    assert_eq!(ravenpose::correction::Estimator::load_score(&model.estimator), Some(0.0));
    for key in
        ["load_expected", "load_pull", "load_noise_nm", "load_weight", "load_travel_deg", "load_information", "load_limit_kg"]
    {
        let key = format!("ravenpose.{key}");
        let line = refusal(&directory, &watching().without(&key).bytes());
        assert_eq!(line, format!("property {key} is missing; a trained model states it, see docs/models.md"));
    }
    for (key, value, problem) in [
        ("load_expected", words(&[0.1; 3 * 121]), "121 numbers per motor, expected 122 for 0 plays"),
        ("load_expected", words(&[0.1; 100]), "100 numbers, expected as many for each of 3 motors"),
        ("load_expected", String::new(), "0 numbers, expected as many for each of 3 motors"),
        ("load_expected", "nan 1 2".to_owned(), "\"nan\" is not a finite number"),
        ("load_pull", words(&[0.5; 11]), "11 numbers, expected 12"),
        ("load_pull", "1 2 3 4 0 0 0 0 1 2 3 4".to_owned(), "a motor's numbers are all 0"),
        ("load_noise_nm", "1 0 1".to_owned(), "0 is not above 0"),
        ("load_weight", "1 -1 1".to_owned(), "-1 is not above 0"),
        ("load_travel_deg", "1 0 1".to_owned(), "0 is not above 0"),
        ("load_information", "1 -2 1".to_owned(), "-2 is not above 0"),
        ("load_limit_kg", "0".to_owned(), "0 is not above 0"),
    ] {
        assert_refused(&directory, watching(), key, value, problem);
    }
    let with_friction =
        |least: &str, largest: &str| watching().set("ravenpose.friction_min_nm", least).set("ravenpose.friction_max_nm", largest);
    for (model, key, problem) in [
        (with_friction("-1 -1 -1", "1 1 1"), "friction_min_nm", ": 3 numbers, the network takes the friction of 0 motors"),
        (with_friction("-1 0 -1", "1 1 1"), "friction_min_nm", ": 0 to 1 does not hold the usual friction, 0"),
        (with_friction("-1 -1 -1", "1 -0.5 1"), "friction_min_nm", ": -1 to -0.5 does not hold the usual friction, 0"),
        (with_friction("-1 -1", "1 1 1"), "friction_min_nm", ": 2 numbers, expected 3"),
        (
            watching().set("ravenpose.friction_min_nm", "-1 -1 -1"),
            "friction_max_nm",
            " is missing; a trained model states it, see docs/models.md",
        ),
        (
            small().trained().set("ravenpose.friction_max_nm", "1 1 1"),
            "load_expected",
            " is missing; a trained model states it, see docs/models.md",
        ),
    ] {
        assert_eq!(refusal(&directory, &model.bytes()), format!("property ravenpose.{key}{problem}"));
    }
}

#[test]
fn a_model_corrects_the_quantity_that_it_was_trained_for_and_no_other() {
    let directory = TempDir::new("models-quantity");
    let load = |onnx: &Onnx, quantity| {
        let bytes = onnx.bytes();
        load_as(&directory.file("model.onnx", &bytes), Some(hash(&bytes)), quantity)
    };
    let turning = || {
        small()
            .trained()
            .set("ravenpose.units", Quantity::Orientation.units())
            .set("ravenpose.correction_bound_deg", "7.5")
            .set("ravenpose.bound95_deg", "0.1 0.2 0.3")
    };
    let (model, card) = load(&turning(), Quantity::Orientation).expect("a model of the orientation");
    assert_eq!((card.quantity, card.bound, card.bound95), (Quantity::Orientation, 7.5, [0.1, 0.2, 0.3].map(|x: f32| f64::from(x))));
    assert_eq!((model.bound, model.bound95), (card.bound, card.bound95), "degrees stay degrees");
    let mixed = |onnx: &Onnx, quantity, found: &str, expected: &str| {
        let line = load(onnx, quantity).err().expect("another quantity");
        assert!(
            line.starts_with(&format!("corrects the {found}, not the {expected}; ")) && line.contains("[gold.orientation]"),
            "{line}"
        );
    };
    mixed(&turning(), Quantity::Position, "orientation", "position");
    mixed(&small().trained(), Quantity::Orientation, "position", "orientation");
    let negative = turning().set("ravenpose.bound95_deg", "1 -2 3");
    assert_eq!(
        load(&negative, Quantity::Orientation).err().expect("refused"),
        "property ravenpose.bound95_deg: -2 is not a half width"
    );
}

#[test]
fn another_layout_or_unit_is_refused_with_expected_and_found() {
    let directory = TempDir::new("models-units");
    let long = "x".repeat(5000);
    let cases = [
        ("ravenpose.feature_layout", "raven118-v2", "\"raven118-v2\"", features::LAYOUT),
        ("ravenpose.feature_layout", "", "\"\"", features::LAYOUT),
        ("ravenpose.units", "SI", "\"SI\"", Quantity::Position.units()),
        (
            "ravenpose.units",
            "raven_state as published; position error in m",
            "\"raven_state as published; position error in m\"",
            Quantity::Position.units(),
        ),
        ("ravenpose.units", "mm\n\u{1b}[2J\u{202e}", "\"mm[2J\\u{202e}\"", Quantity::Position.units()),
        ("ravenpose.units", &long, &format!("\"{}\"", &long[..60]), Quantity::Position.units()),
    ];
    for (key, value, found, expected) in cases {
        for onnx in [small().trained(), small().onnx()] {
            let line = refusal(&directory, &onnx.set(key, value).bytes());
            let wanted = format!("property {key} is {found}, expected {expected:?}; export the model again with this ravenpose");
            assert_eq!(line, wanted);
        }
    }
}

#[test]
fn unusable_numbers_are_refused_with_the_property_and_the_problem() {
    let directory = TempDir::new("models-numbers");
    let with = |index: usize, word: &str| {
        let mut list = vec!["0"; FEATURES];
        list[index] = word;
        list.join(" ")
    };
    let mut above = [-2.0; FEATURES];
    above[58] = 2.5;
    let cases = [
        ("feature_min", words(&[0.0; 117]), "117 numbers, expected 118"),
        ("feature_max", words(&[0.0; 119]), "119 numbers, expected 118"),
        ("domain_center", String::new(), "0 numbers, expected 118"),
        ("feature_min", with(3, "nan"), "\"nan\" is not a finite number"),
        ("feature_max", with(3, "inf"), "\"inf\" is not a finite number"),
        ("domain_weight", with(117, "1e39"), "\"1e39\" is not a finite number"),
        ("domain_center", with(0, "abc"), "\"abc\" is not a number"),
        ("domain_center", with(0, "1,5"), "\"1,5\" is not a number"),
        ("domain_center", with(0, "a\u{7}\u{202e}b"), "\"a\\u{202e}b\" is not a number"),
        ("feature_min", words(&above), "jpos[2] has a minimum above its maximum"),
        ("domain_limit", "0".to_owned(), "0 is not a positive distance"),
        ("domain_limit", "-1".to_owned(), "-1 is not a positive distance"),
        ("domain_limit", "1 2".to_owned(), "2 numbers, expected 1"),
        ("domain_limit", "NaN".to_owned(), "\"NaN\" is not a finite number"),
        ("correction_bound_mm", "-1".to_owned(), "-1 is not positive"),
        ("correction_bound_mm", "0".to_owned(), "0 is not positive"),
        ("correction_bound_mm", "15 mm".to_owned(), "\"mm\" is not a number"),
        ("correction_bound_mm", String::new(), "0 numbers, expected 1"),
        ("correction_bound_mm", "inf".to_owned(), "\"inf\" is not a finite number"),
        ("bound95_mm", "1 2".to_owned(), "2 numbers, expected 3"),
        ("bound95_mm", "1 2 3 4".to_owned(), "4 numbers, expected 3"),
        ("bound95_mm", "1 -2 3".to_owned(), "-2 is not a half width"),
        ("bound95_unsettled_mm", "1 2".to_owned(), "2 numbers, expected 3"),
        ("bound95_unsettled_mm", "1 -2 3".to_owned(), "-2 is not a half width"),
        ("bound95_unsettled_mm", "1 2 2.9".to_owned(), "is narrower than ravenpose.bound95_mm"),
        ("bound95_unsettled_mm", "1 2 3".to_owned(), "the network has no memory"),
        ("runlevels", "3 x".to_owned(), "\"x\" is not a whole number"),
        ("runlevels", String::new(), "no numbers, expected at least one"),
        ("boards", "49.5".to_owned(), "\"49.5\" is not a whole number"),
        ("golden", words(&[0.0; 120]), "120 numbers, expected 121"),
        ("golden", words(&[0.0; 122]), "122 numbers, expected 121"),
        ("golden", format!("{} 0 nan 0", with(0, "0")), "\"nan\" is not a finite number"),
        ("golden", format!("{} 0 0 zero", with(0, "0")), "\"zero\" is not a number"),
    ];
    for (key, value, problem) in cases {
        assert_refused(&directory, small().trained(), key, value, problem);
    }
}

#[test]
fn a_property_that_occurs_twice_is_refused() {
    let directory = TempDir::new("models-twice");
    let mut onnx = small().trained();
    onnx.metadata.push(("ravenpose.units".to_owned(), "SI".to_owned()));
    assert_eq!(refusal(&directory, &onnx.bytes()), "metadata key `ravenpose.units` occurs twice: expected each key once");
}

#[test]
fn a_trained_range_of_another_order_or_unit_is_refused() {
    let directory = TempDir::new("models-range");
    let untrained = Onnx::untrained();
    let with = |change: fn(&mut Vec<f64>)| {
        ["ravenpose.feature_min", "ravenpose.feature_max"].into_iter().fold(untrained.clone(), |onnx, key| {
            let mut numbers = onnx.get(key).split_ascii_whitespace().map(|word| word.parse().expect("a number")).collect();
            change(&mut numbers);
            onnx.set(key, words(&numbers))
        })
    };
    let cases = [
        ("positions in m", with(|list| list[..6].iter_mut().for_each(|limit| *limit /= 1e6)), "pair 1: pos[0] is "),
        (
            "angles in rad",
            with(|list| list[88..90].iter_mut().for_each(|limit| *limit = limit.to_radians())),
            "pair 0: jpos_d[0] is ",
        ),
        ("shifted by one", with(|list| list.rotate_left(1)), "pair 0: jpos[1] is "),
        ("reversed", with(|list| list.reverse()), "pair 0: encVals[3] is "),
        ("two neighbours swapped", with(|list| list.swap(57, 58)), "pair 0: jpos[1] is "),
    ];
    for (case, onnx, problem) in cases {
        let line = load_bytes(&directory, &onnx.bytes()).err().unwrap_or_else(|| panic!("{case}: accepted"));
        assert!(line.starts_with(&format!("property ravenpose.golden: {problem}")), "{case}: {line}");
        assert!(line.contains(", outside its trained range "), "{case}: {line}");
    }
}

/// A change of the card's golden pairs or of the network, and where the first difference is seen, if that is known.
type Disagreement = (&'static str, Onnx, Option<(usize, usize)>);

fn disagreements(onnx: &Onnx) -> Vec<Disagreement> {
    let golden = |name, change: fn(&mut Vec<Vec<f64>>), place| (name, onnx.clone().with_golden(change), place);
    vec![
        golden("an output is 1 um off", |rows| rows[3][119] += 0.001, Some((3, 1))),
        golden("the last output of the last pair", |rows| rows.last_mut().expect("a pair")[120] -= 0.0005, None),
        golden("outputs in m", |rows| rows.iter_mut().for_each(|row| row[118..].iter_mut().for_each(|y| *y /= 1000.0)), None),
        golden("the other sign", |rows| rows.iter_mut().for_each(|row| row[118..].iter_mut().for_each(|y| *y = -*y)), None),
        golden("outputs permuted", |rows| rows.iter_mut().for_each(|row| row.swap(118, 120)), None),
        golden("the output of another pair", |rows| (118..121).for_each(|i| rows[2][i] = rows[1][i]), Some((2, 0))),
        golden("two neighbouring features swapped", |rows| rows.iter_mut().for_each(|row| row.swap(1, 2)), None),
        golden("pos and pos_d swapped", |rows| rows.iter_mut().for_each(|row| (0..3).for_each(|i| row.swap(i, i + 3))), None),
        golden("mpos and mpos_d swapped", |rows| rows.iter_mut().for_each(|row| (48..56).for_each(|i| row.swap(i, i + 32))), None),
        golden("features reversed", |rows| rows.iter_mut().for_each(|row| row[..FEATURES].reverse()), None),
        golden("features shifted by one", |rows| rows.iter_mut().for_each(|row| row[..FEATURES].rotate_left(1)), None),
        golden("positions in mm", |rows| rows.iter_mut().for_each(|row| row[..6].iter_mut().for_each(|x| *x /= 1000.0)), None),
        golden("angles in rad", |rows| rows.iter_mut().for_each(|row| row[48..96].iter_mut().for_each(|x| *x *= 0.0175)), None),
    ]
}

fn golden_fails(directory: &TempDir, (name, onnx, place): &Disagreement) {
    let line = load_bytes(directory, &onnx.bytes()).err().unwrap_or_else(|| panic!("{name}: accepted"));
    assert!(line.starts_with("golden pair ") && line.contains(" mm, the card says "), "{name}: {line}");
    assert!(line.ends_with("; card and network do not belong together, export the model again"), "{name}: {line}");
    if let Some((pair, axis)) = place {
        assert!(line.starts_with(&format!("golden pair {pair}: output {axis} is ")), "{name}: {line}");
    }
}

#[test]
fn a_card_that_disagrees_with_its_network_is_refused() {
    let directory = TempDir::new("models-golden");
    let untrained = Onnx::untrained();
    assert!(load_bytes(&directory, &untrained.bytes()).is_ok(), "split and joined it is the same model");
    for case in disagreements(&small().trained()).iter().chain(&disagreements(&untrained)) {
        golden_fails(&directory, case);
    }
}

#[test]
fn a_network_that_disagrees_with_its_card_is_refused() {
    let directory = TempDir::new("models-weights");
    let card = small().trained().metadata;
    let changed = |name, change: fn(&mut Small)| {
        let mut network = small();
        change(&mut network);
        (name, Onnx { metadata: card.clone(), ..network.onnx() }, None)
    };
    let mut cases: Vec<Disagreement> = vec![
        changed("the output doubled", |network| network.last_weights.iter_mut().for_each(|w| *w *= 2.0)),
        changed("one weight of the last layer scaled", |network| network.last_weights[5] *= 1.01),
        changed("one weight of the first layer negated", |network| network.hidden_weights[500] *= -1.0),
        changed("one input in other units", |network| {
            network.hidden_weights.iter_mut().step_by(FEATURES).for_each(|w| *w *= 1000.0);
        }),
        changed("another bias", |network| network.last_bias.swap(0, 1)),
        changed("another activation", |network| network.activation = "Tanh"),
    ];
    let mut untrained = Onnx::untrained();
    swap_last_biases(&mut untrained.rest);
    cases.push(("the last biases swapped", untrained, None));
    for case in &cases {
        golden_fails(&directory, case);
    }
}

/// Swaps the x and y bias of the last layer in the bytes of `untrained.onnx`: name, then raw data of 12 bytes.
fn swap_last_biases(bytes: &mut [u8]) {
    let pattern = b"\x42\x0blayer3.bias\x4a\x0c";
    let at = bytes.windows(pattern.len()).position(|window| window == pattern).expect("the last bias") + pattern.len();
    let (x, y) = bytes[at..at + 8].split_at_mut(4);
    assert_ne!(x, y);
    x.swap_with_slice(y);
}

#[test]
fn more_golden_pairs_than_can_be_evaluated_before_the_start_are_refused() {
    let directory = TempDir::new("models-many");
    let with = |count: usize| {
        let many = small().trained().with_golden(|rows| {
            let first = rows[0].clone();
            rows.resize(count, first);
        });
        load_bytes(&directory, &many.bytes())
    };
    assert!(with(1000).is_ok());
    let line = with(1001).err().expect("refused");
    assert!(line.contains("property ravenpose.golden: 1001 pairs, expected at most 1000"), "{line}");
}

#[test]
fn a_golden_pair_as_exact_as_float32_is_accepted() {
    let directory = TempDir::new("models-float32");
    for onnx in [small().trained(), Onnx::untrained()] {
        let rounded =
            onnx.with_golden(|rows| rows.iter_mut().flat_map(|row| &mut row[118..]).for_each(|y| *y = f64::from(*y as f32)));
        assert!(load_bytes(&directory, &rounded.bytes()).is_ok());
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
