//! The written file in ONNX's own checker and in ONNX Runtime.
//!
//! `RAVENPOSE_PYTHON` names an interpreter that has `onnx`, `onnxruntime` and `numpy`; `make test` makes one. Without it the test
//! says that it skips.
#![allow(missing_docs)]

mod common;

use common::{Folder, python, runs, small};
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

#[test]
fn onnx_runtime_gives_what_the_card_says() {
    let Some(python) = python() else {
        println!("skipped: RAVENPOSE_PYTHON is absent (make test makes one)");
        return;
    };
    let imports = Command::new(&python).args(["-c", "import numpy, onnx, onnxruntime"]).output();
    if !imports.is_ok_and(|output| output.status.success()) {
        println!("skipped: onnx, onnxruntime or numpy is absent from {}", python.display());
        return;
    }
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
