//! The written file in ONNX's own checker and in ONNX Runtime.
//!
//! `RAVENPOSE_PYTHON` names an interpreter that has `onnx`, `onnxruntime` and `numpy`; `make test` makes one. Without it the test
//! says that it skips.
#![allow(missing_docs)]

mod common;

use common::{Folder, python, runs, small};
use std::path::{Path, PathBuf};
use std::process::Command;
use training::commands::{self, Model, Wish};
use training::data::{self, Reading};

const SCRIPT: &str = "
import sys, numpy, onnx, onnxruntime
model = onnx.load(sys.argv[1])
onnx.checker.check_model(model, full_check=True)
rows = numpy.fromfile(sys.argv[2], dtype='<f4').reshape(-1, 118)
session = onnxruntime.InferenceSession(sys.argv[1], providers=['CPUExecutionProvider'])
assert [port.name for port in session.get_inputs()] == ['input'], 'one input that must be given'
remembers = {port.name for port in session.get_overridable_initializers()} >= {'memory', 'remembered'}
assert remembers == (sys.argv[4] == 'remembers')
memory, alone, in_order = {}, [], []
for row in rows:
    alone.append(session.run(['output'], {'input': row[None]})[0])
    found = session.run(None, {'input': row[None], **memory})
    in_order.append(found[0])
    if remembers:
        memory = {'memory': found[1], 'remembered': numpy.array([[True]])}
numpy.concatenate(alone + in_order).astype('<f4').tofile(sys.argv[3])
";

/// Python with ONNX Runtime; none, and said so, where it is not.
fn with_runtime() -> Option<PathBuf> {
    let Some(python) = python() else {
        println!("skipped: RAVENPOSE_PYTHON is absent (make test makes one)");
        return None;
    };
    let imports = Command::new(&python).args(["-c", "import numpy, onnx, onnxruntime"]).output();
    if !imports.is_ok_and(|output| output.status.success()) {
        println!("skipped: onnx, onnxruntime or numpy is absent from {}", python.display());
        return None;
    }
    Some(python)
}

/// Rows of features alone, then the same with this friction.
const FRICTION: &str = "
import sys, numpy, onnx, onnxruntime
onnx.checker.check_model(onnx.load(sys.argv[1]), full_check=True)
session = onnxruntime.InferenceSession(sys.argv[1])
rows = numpy.fromfile(sys.argv[2], '<f4').reshape(-1, 118)
friction = numpy.array([[float(word) for word in sys.argv[4:]]], '<f4')
out = [session.run(['output'], {'input': row[None]})[0] for row in rows]
out += [session.run(['output'], {'input': row[None], 'friction': friction})[0] for row in rows]
numpy.concatenate(out).astype('<f4').tofile(sys.argv[3])
";

#[test]
fn the_shipped_models_say_in_onnx_runtime_what_their_cards_say_and_take_friction() {
    let Some(python) = with_runtime() else { return };
    let folder = Folder::new("shipped");
    for name in ["raven2-worn.onnx", "raven2-worn-orientation.onnx"] {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models").join(name);
        let Model { chain, card } = Model::read(&file).expect(name);
        assert!(chain.friction && chain.inputs() == 118 + 21 + 3, "{name}");
        let golden: Vec<Vec<f64>> = card["ravenpose.golden"]
            .lines()
            .map(|line| line.split_whitespace().map(|word| word.parse().expect("a number")).collect())
            .collect();
        let inputs = golden.iter().map(|pair| pair[..118].iter().map(|value| *value as f32).collect::<Vec<f32>>());
        let bytes: Vec<u8> = inputs.clone().flatten().flat_map(f32::to_le_bytes).collect();
        std::fs::write(folder.file("in"), bytes).expect("inputs");
        let friction = [0.004_f32, -0.003, 0.012];
        let ran = Command::new(&python)
            .args(["-c", FRICTION])
            .args([&file, &folder.file("in"), &folder.file("out")])
            .args(friction.map(|value| value.to_string()))
            .output()
            .expect("python");
        assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
        let found = std::fs::read(folder.file("out")).expect("outputs");
        let found: Vec<f64> =
            found.chunks_exact(4).map(|four| f64::from(f32::from_le_bytes([four[0], four[1], four[2], four[3]]))).collect();
        let alone = golden.iter().flat_map(|pair| pair[118..].to_vec());
        let told = inputs.flat_map(|row| chain.estimate_exactly(&[&row[..], &[0.0; 21], &friction].concat()));
        let expected: Vec<f64> = alone.chain(told).collect();
        assert_eq!(found.len(), expected.len(), "{name}");
        let off = |(found, expected): (&f64, &f64)| (found - expected).abs() / expected.abs().max(1.0);
        let worst = found.iter().zip(&expected).map(off).fold(0.0, f64::max);
        assert!(worst <= 2e-5, "{name}: {worst}");
        // And it matters.
        let half = found.len() / 2;
        assert!(found[..half].iter().zip(&found[half..]).any(|(alone, told)| (alone - told).abs() > 1e-2), "{name}");
    }
}

#[test]
fn onnx_runtime_gives_what_the_card_says() {
    let Some(python) = with_runtime() else { return };
    let folder = Folder::new("runtime");
    let files = runs(&folder, 3, 3.0, ".mcap");
    for preset in ["default", "one-state", "paper", "paper-code"] {
        let (out, recipe) = (folder.file("model.onnx"), small(preset));
        // Every state has a truth in these runs, so that a memory fed with the rows has seen all of them.
        let reading = Reading { plays: recipe.plays(), truth_hz: 1000.0, ..Reading::default() };
        commands::train(&Wish { data: &files, reading: &reading, recipe: &recipe, out: &out }, &mut |_| {}).expect("trained");
        let chain = Model::read(&out).expect("model").chain;
        let set = data::read(&files, &reading, &mut |_, _| {}).expect("runs");
        let rows: Vec<&[f32]> = set.trajectories[0].inputs.chunks_exact(set.inputs()).collect();
        assert!(rows.len() > 2900, "{}", rows.len());
        let bytes: Vec<u8> = rows.iter().flat_map(|row| &row[..118]).flat_map(|value| value.to_le_bytes()).collect();
        std::fs::write(folder.file("in"), bytes).expect("inputs");
        let ran = Command::new(&python)
            .args(["-c", SCRIPT])
            .args([&out, &folder.file("in"), &folder.file("out")])
            .arg(if recipe.memory { "remembers" } else { "one state" })
            .output()
            .expect("python");
        assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
        let found = std::fs::read(folder.file("out")).expect("outputs");
        let found = found.chunks_exact(4).map(|four| f32::from_le_bytes([four[0], four[1], four[2], four[3]]));
        // First each row for itself, as a memory that has seen nothing else; then in order.
        let alone = rows.iter().map(|row| [&row[..118], &vec![0.0; row.len() - 118]].concat());
        let in_order = rows.iter().map(|row| row.to_vec());
        let expected: Vec<f64> = alone.chain(in_order).flat_map(|row| chain.estimate_exactly(&row)).collect();
        assert_eq!(found.len(), expected.len(), "{preset}");
        let mut worst = 0.0_f64;
        for (found, expected) in found.zip(expected) {
            worst = worst.max((f64::from(found) - expected).abs() / expected.abs().max(1.0));
        }
        assert!(worst <= 2e-5, "{preset}: {worst}");
    }
}
