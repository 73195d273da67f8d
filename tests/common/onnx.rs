//! Small ONNX files with the card of a trained model, made by hand and taken apart, for tests of what is refused.
#![allow(dead_code)]

use super::common::{Rng, untrained};
use ravenpose::correction::Quantity;
use ravenpose_wire::{FEATURES, features};
use std::fmt::Write;

pub(crate) const HIDDEN: usize = 8;

/// Protobuf, as far as these tests write and split it.
mod protobuf {
    pub(super) fn varint(mut value: u64, out: &mut Vec<u8>) {
        while value >= 0x80 {
            out.push(value as u8 | 0x80);
            value >>= 7;
        }
        out.push(value as u8);
    }

    pub(super) fn number(field: u64, value: u64) -> Vec<u8> {
        let mut out = Vec::new();
        varint(field << 3, &mut out);
        varint(value, &mut out);
        out
    }

    pub(super) fn bytes(field: u64, contents: &[u8]) -> Vec<u8> {
        let mut out = Vec::new();
        varint(field << 3 | 2, &mut out);
        varint(contents.len() as u64, &mut out);
        out.extend(contents);
        out
    }

    fn take_varint(bytes: &[u8], at: &mut usize) -> u64 {
        let mut value = 0;
        for shift in (0..64).step_by(7) {
            let byte = bytes[*at];
            *at += 1;
            value |= u64::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                break;
            }
        }
        value
    }

    /// The fields of a message that has numbers and length-delimited fields only: number, whole field, contents.
    pub(super) fn fields(message: &[u8]) -> Vec<(u64, &[u8], &[u8])> {
        let mut out = Vec::new();
        let mut at = 0;
        while at < message.len() {
            let start = at;
            let tag = take_varint(message, &mut at);
            let length = take_varint(message, &mut at) as usize;
            let contents = match tag & 7 {
                0 => &[],
                2 => &message[at..at + length],
                other => panic!("wire type {other}"),
            };
            at += contents.len();
            out.push((tag >> 3, &message[start..at], contents));
        }
        out
    }
}

/// An ONNX file split into its metadata and the rest.
#[derive(Clone)]
pub(crate) struct Onnx {
    pub(crate) rest: Vec<u8>,
    pub(crate) metadata: Vec<(String, String)>,
}

impl Onnx {
    const METADATA: u64 = 14;

    pub(crate) fn split(bytes: &[u8]) -> Self {
        let mut onnx = Self { rest: Vec::new(), metadata: Vec::new() };
        for (number, field, contents) in protobuf::fields(bytes) {
            if number == Self::METADATA {
                let text = |index: usize| String::from_utf8(protobuf::fields(contents)[index].2.to_vec()).expect("UTF-8");
                onnx.metadata.push((text(0), text(1)));
            } else {
                onnx.rest.extend(field);
            }
        }
        onnx
    }

    pub(crate) fn untrained() -> Self {
        Self::split(&std::fs::read(untrained()).expect("the repository's model"))
    }

    pub(crate) fn get(&self, key: &str) -> &str {
        &self.metadata.iter().find(|(name, _)| name == key).unwrap_or_else(|| panic!("no {key}")).1
    }

    pub(crate) fn set(mut self, key: &str, value: impl Into<String>) -> Self {
        self = self.without(key);
        self.metadata.push((key.to_owned(), value.into()));
        self
    }

    pub(crate) fn without(mut self, key: &str) -> Self {
        self.metadata.retain(|(name, _)| name != key);
        self
    }

    pub(crate) fn bytes(&self) -> Vec<u8> {
        let mut out = self.rest.clone();
        for (key, value) in &self.metadata {
            let entry = [protobuf::bytes(1, key.as_bytes()), protobuf::bytes(2, value.as_bytes())].concat();
            out.extend(protobuf::bytes(Self::METADATA, &entry));
        }
        out
    }

    /// The golden pairs: 118 inputs and 3 outputs each.
    pub(crate) fn golden(&self) -> Vec<Vec<f64>> {
        let row = |line: &str| line.split_ascii_whitespace().map(|word| word.parse().expect("a number")).collect();
        self.get("ravenpose.golden").lines().map(row).collect()
    }

    pub(crate) fn with_golden(self, change: impl FnOnce(&mut Vec<Vec<f64>>)) -> Self {
        let mut rows = self.golden();
        change(&mut rows);
        let lines: Vec<String> = rows.iter().map(|row| words(row)).collect();
        self.set("ravenpose.golden", lines.join("\n"))
    }
}

pub(crate) fn words(numbers: &[f64]) -> String {
    let mut text = String::new();
    for number in numbers {
        let _ = write!(text, "{number:?} ");
    }
    text
}

/// A network of two layers with random weights.
#[derive(Clone)]
pub(crate) struct Small {
    pub(crate) inputs: usize,
    pub(crate) outputs: usize,
    pub(crate) activation: &'static str,
    pub(crate) element: u64,
    pub(crate) hidden_weights: Vec<f32>,
    pub(crate) hidden_bias: Vec<f32>,
    pub(crate) last_weights: Vec<f32>,
    pub(crate) last_bias: Vec<f32>,
}

impl Small {
    pub(crate) const FLOAT: u64 = 1;
    pub(crate) const DOUBLE: u64 = 11;

    pub(crate) fn new(inputs: usize, outputs: usize) -> Self {
        let mut rng = Rng(0x5EED);
        let mut random = |count: usize| (0..count).map(|_| (rng.uniform() - 0.5) as f32).collect::<Vec<f32>>();
        Self {
            inputs,
            outputs,
            activation: "Sigmoid",
            element: Self::FLOAT,
            hidden_weights: random(inputs * HIDDEN),
            hidden_bias: random(HIDDEN),
            last_weights: random(HIDDEN * outputs),
            last_bias: random(outputs),
        }
    }

    pub(crate) fn onnx(&self) -> Onnx {
        use protobuf::{bytes, number};
        let tensor = |name: &str, dimensions: &[usize], values: &[f32]| {
            let mut out: Vec<u8> = dimensions.iter().flat_map(|&count| number(1, count as u64)).collect();
            out.extend(number(2, Self::FLOAT));
            out.extend(bytes(8, name.as_bytes()));
            out.extend(bytes(9, &values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>()));
            bytes(5, &out)
        };
        let node = |operator: &str, inputs: &[&str], output: &str| {
            let mut out: Vec<u8> = inputs.iter().flat_map(|name| bytes(1, name.as_bytes())).collect();
            out.extend(bytes(2, output.as_bytes()));
            out.extend(bytes(3, format!("node.{output}").as_bytes()));
            out.extend(bytes(4, operator.as_bytes()));
            if operator == "Gemm" {
                out.extend(bytes(5, &[bytes(1, b"transB"), number(3, 1), number(20, 2)].concat()));
            }
            bytes(1, &out)
        };
        let value = |field: u64, name: &str, width: usize| {
            let shape = [bytes(1, &number(1, 1)), bytes(1, &number(1, width as u64))].concat();
            let kind = bytes(1, &[number(1, self.element), bytes(2, &shape)].concat());
            bytes(field, &[bytes(1, name.as_bytes()), bytes(2, &kind)].concat())
        };
        let graph = [
            node("Gemm", &["ravenstate", "w0", "b0"], "sum"),
            node(self.activation, &["sum"], "hidden"),
            node("Gemm", &["hidden", "w1", "b1"], "error"),
            bytes(2, b"small"),
            tensor("w0", &[HIDDEN, self.inputs], &self.hidden_weights),
            tensor("b0", &[HIDDEN], &self.hidden_bias),
            tensor("w1", &[self.outputs, HIDDEN], &self.last_weights),
            tensor("b1", &[self.outputs], &self.last_bias),
            value(11, "ravenstate", self.inputs),
            value(12, "error", self.outputs),
        ]
        .concat();
        let rest = [number(1, 8), bytes(7, &graph), bytes(8, &number(2, 17))].concat();
        Onnx { rest, metadata: Vec::new() }
    }

    pub(crate) fn evaluate(&self, input: &[f64]) -> Vec<f64> {
        let layer = |weights: &[f32], bias: &[f32], x: &[f64]| -> Vec<f64> {
            let rows = weights.chunks_exact(x.len()).zip(bias);
            rows.map(|(row, bias)| f64::from(*bias) + row.iter().zip(x).map(|(w, x)| f64::from(*w) * x).sum::<f64>()).collect()
        };
        let sums = layer(&self.hidden_weights, &self.hidden_bias, input);
        let hidden: Vec<f64> = sums.iter().map(|sum| 1.0 / (1.0 + (-sum).exp())).collect();
        layer(&self.last_weights, &self.last_bias, &hidden)
    }

    /// With the card of a trained model: everything stated, four golden pairs.
    pub(crate) fn trained(&self) -> Onnx {
        let mut rng = Rng(0xCA4D);
        let golden: Vec<String> = (0..4)
            .map(|_| {
                let input: Vec<f64> = (0..FEATURES).map(|_| f64::from(2.0 * rng.uniform() as f32 - 1.0)).collect();
                words(&[input.clone(), self.evaluate(&input)].concat())
            })
            .collect();
        self.onnx()
            .set("ravenpose.feature_layout", features::LAYOUT)
            .set("ravenpose.units", Quantity::Position.units())
            .set("ravenpose.trained_on", "a recording")
            .set("ravenpose.feature_min", words(&[-2.0; FEATURES]))
            .set("ravenpose.feature_max", words(&[2.0; FEATURES]))
            .set("ravenpose.domain_center", words(&[0.0; FEATURES]))
            .set("ravenpose.domain_weight", words(&[0.5; FEATURES]))
            .set("ravenpose.domain_limit", "3")
            .set("ravenpose.correction_bound_mm", "12.5")
            .set("ravenpose.bound95_mm", "1 2 3")
            .set("ravenpose.golden", golden.join("\n"))
    }
}
