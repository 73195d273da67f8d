//! Builds small ONNX models in code, and evaluates them node by node in plain double precision.
#![allow(dead_code, reason = "each test binary uses a part")]

use std::collections::BTreeMap;
use std::path::PathBuf;

use prost::Message;
use tract_onnx::pb::attribute_proto::AttributeType;
use tract_onnx::pb::tensor_shape_proto::{Dimension, dimension};
use tract_onnx::pb::{
    AttributeProto, GraphProto, ModelProto, NodeProto, OperatorSetIdProto, StringStringEntryProto, TensorProto, TensorShapeProto,
    TypeProto, ValueInfoProto, type_proto,
};

/// `../shared/models`, or nothing (said plainly) where it is absent.
pub(crate) fn shared_models() -> Option<PathBuf> {
    let default = || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared"));
    let models = std::env::var_os("RAVENPOSE_SHARED").map_or_else(default, PathBuf::from).join("models");
    if models.is_dir() {
        return Some(models);
    }
    println!("skipped: ../shared/models is absent");
    None
}

/// SplitMix64.
pub(crate) struct Random(pub u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in -1..1.
    pub(crate) fn signed(&mut self) -> f32 {
        (self.next() as f64 / u64::MAX as f64 * 2.0 - 1.0) as f32
    }

    pub(crate) fn vector(&mut self, len: usize) -> Vec<f32> {
        (0..len).map(|_| self.signed()).collect()
    }
}

pub(crate) fn float(name: &str, value: f32) -> AttributeProto {
    AttributeProto { name: name.into(), r#type: AttributeType::Float as i32, f: value, ..Default::default() }
}

pub(crate) fn int(name: &str, value: i64) -> AttributeProto {
    AttributeProto { name: name.into(), r#type: AttributeType::Int as i32, i: value, ..Default::default() }
}

pub(crate) fn tensor(name: &str, dims: &[i64], values: &[f32]) -> TensorProto {
    let raw_data = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    TensorProto { name: name.into(), dims: dims.to_vec(), data_type: 1, raw_data, ..Default::default() }
}

pub(crate) fn port(name: &str, batch: Option<dimension::Value>, width: i64) -> ValueInfoProto {
    typed_port(name, 1, batch, width)
}

pub(crate) fn typed_port(name: &str, elem_type: i32, batch: Option<dimension::Value>, width: i64) -> ValueInfoProto {
    let width = Dimension { value: Some(dimension::Value::DimValue(width)), ..Default::default() };
    let shape = TensorShapeProto { dim: vec![Dimension { value: batch, ..Default::default() }, width] };
    let value = Some(type_proto::Value::TensorType(type_proto::Tensor { elem_type, shape: Some(shape) }));
    ValueInfoProto { name: name.into(), r#type: Some(TypeProto { value, ..Default::default() }), ..Default::default() }
}

/// A chain under construction: each call adds a node that takes the previous node's output.
pub(crate) struct Chain {
    pub(crate) model: ModelProto,
    pub(crate) random: Random,
    pub(crate) width: usize,
    last: String,
    count: usize,
}

impl Chain {
    pub(crate) fn new(inputs: usize) -> Self {
        let one = Some(dimension::Value::DimValue(1));
        let graph = GraphProto { name: "test".into(), input: vec![port("x", one, inputs as i64)], ..Default::default() };
        let opset = OperatorSetIdProto { domain: String::new(), version: 17 };
        let model = ModelProto { ir_version: 8, opset_import: vec![opset], graph: Some(graph), ..Default::default() };
        Self { model, random: Random(7), width: inputs, last: "x".into(), count: 0 }
    }

    pub(crate) fn graph(&mut self) -> &mut GraphProto {
        self.model.graph.as_mut().unwrap()
    }

    /// Adds a stored tensor and gives its name.
    pub(crate) fn store(&mut self, dims: &[usize], values: &[f32]) -> String {
        self.count += 1;
        let name = format!("t{}", self.count);
        let dims: Vec<i64> = dims.iter().map(|d| *d as i64).collect();
        self.graph().initializer.push(tensor(&name, &dims, values));
        name
    }

    pub(crate) fn integers(&mut self, values: &[i64]) -> String {
        let name = self.store(&[values.len()], &[]);
        let stored = self.graph().initializer.last_mut().unwrap();
        stored.data_type = 7;
        stored.int64_data = values.to_vec();
        name
    }

    /// Adds a node; `@` among the inputs stands for the chain so far.
    pub(crate) fn node(mut self, op_type: &str, inputs: &[&str], attribute: Vec<AttributeProto>) -> Self {
        self.count += 1;
        let output = format!("v{}", self.count);
        let input = inputs.iter().map(|i| if *i == "@" { self.last.clone() } else { (*i).to_owned() }).collect();
        let node = NodeProto {
            name: format!("n{}", self.count),
            op_type: op_type.into(),
            input,
            output: vec![output.clone()],
            attribute,
            ..Default::default()
        };
        self.graph().node.push(node);
        self.last = output;
        self
    }

    pub(crate) fn gemm(mut self, outputs: usize, transposed: bool, alpha: f32, beta: f32) -> Self {
        let weights = self.random.vector(outputs * self.width);
        let dims = if transposed { [outputs, self.width] } else { [self.width, outputs] };
        let w = self.store(&dims, &weights);
        let bias = self.random.vector(outputs);
        let b = self.store(&[outputs], &bias);
        self.width = outputs;
        let attributes = vec![float("alpha", alpha), float("beta", beta), int("transB", i64::from(transposed))];
        self.node("Gemm", &["@", &w, &b], attributes)
    }

    pub(crate) fn dense(self, outputs: usize) -> Self {
        self.gemm(outputs, true, 1.0, 1.0)
    }

    pub(crate) fn matmul(mut self, outputs: usize) -> Self {
        let weights = self.random.vector(outputs * self.width);
        let w = self.store(&[self.width, outputs], &weights);
        self.width = outputs;
        self.node("MatMul", &["@", &w], vec![])
    }

    /// An elementwise operator with the chain on the left.
    pub(crate) fn with(mut self, op_type: &str, values: &[f32]) -> Self {
        let c = self.store(&[values.len()], values);
        self.node(op_type, &["@", &c], vec![])
    }

    pub(crate) fn activate(self, op_type: &str) -> Self {
        self.node(op_type, &["@"], vec![])
    }

    pub(crate) fn norm_of(mut self, mean: &[f32], variance: &[f32]) -> Self {
        let width = self.width;
        let (gamma, beta) = (self.random.vector(width), self.random.vector(width));
        let names = [&gamma[..], &beta[..], mean, variance].map(|values| self.store(&[width], values));
        self.node("BatchNormalization", &["@", &names[0], &names[1], &names[2], &names[3]], vec![float("epsilon", 1e-3)])
    }

    pub(crate) fn norm(mut self) -> Self {
        let mean = self.random.vector(self.width);
        let variance: Vec<f32> = self.random.vector(self.width).iter().map(|v| v.abs() + 0.1).collect();
        self.norm_of(&mean, &variance)
    }

    pub(crate) fn metadata(mut self, key: &str, value: &str) -> Self {
        self.model.metadata_props.push(StringStringEntryProto { key: key.into(), value: value.into() });
        self
    }

    pub(crate) fn finish(mut self) -> ModelProto {
        let (name, width) = (self.last.clone(), self.width as i64);
        self.graph().output.push(port(&name, Some(dimension::Value::DimValue(1)), width));
        self.model
    }
}

pub(crate) fn bytes(model: &ModelProto) -> Vec<u8> {
    model.encode_to_vec()
}

/// A small network with most operators, for truncation and bit flips.
pub(crate) fn small() -> ModelProto {
    Chain::new(5)
        .with("Sub", &[1.0; 5])
        .dense(4)
        .norm()
        .activate("Sigmoid")
        .matmul(3)
        .with("Add", &[0.5; 3])
        .metadata("k", "v")
        .finish()
}

/// Puts a memory in front of a network of `inputs` + `plays.len()` inputs, as `ravenpose train` does.
pub(crate) fn remember(mut model: ModelProto, inputs: usize, plays: &[(i64, f32)]) -> ModelProto {
    let one = Some(dimension::Value::DimValue(1));
    let graph = model.graph.as_mut().unwrap();
    let own = std::mem::replace(&mut graph.input[0], port("raw", one.clone(), inputs as i64)).name;
    let n = plays.len() as i64;
    graph.input.push(port("memory", one.clone(), n));
    graph.input.push(typed_port("remembered", 9, one.clone(), 1));
    graph.output.push(port("memory_out", one, n));
    let widths: Vec<f32> = plays.iter().map(|(_, width)| *width).collect();
    let features = plays.iter().flat_map(|(feature, _)| feature.to_le_bytes()).collect();
    graph.initializer.push(tensor("memory", &[1, n], &vec![0.0; plays.len()]));
    graph.initializer.push(tensor("memory.half_widths", &[n], &widths));
    let plain = |name: &str, dims: &[i64], data_type: i32, raw_data: Vec<u8>| TensorProto {
        name: name.into(),
        dims: dims.to_vec(),
        data_type,
        raw_data,
        ..Default::default()
    };
    graph.initializer.push(plain("memory.features", &[n], 7, features));
    graph.initializer.push(plain("remembered", &[1, 1], 9, vec![0]));
    let nodes: [(&str, &[&str], &str); 8] = [
        ("Gather", &["raw", "memory.features"], "memory.x"),
        ("Sub", &["memory.x", "memory.half_widths"], "memory.lower"),
        ("Add", &["memory.x", "memory.half_widths"], "memory.upper"),
        ("Max", &["memory", "memory.lower"], "memory.above"),
        ("Min", &["memory.above", "memory.upper"], "memory.moved"),
        ("Where", &["remembered", "memory.moved", "memory.x"], "memory_out"),
        ("Sub", &["memory.x", "memory_out"], "memory.places"),
        ("Concat", &["raw", "memory.places"], "memory.inputs"),
    ];
    let made = nodes.iter().map(|(op_type, input, output)| NodeProto {
        name: format!("{output}.node"),
        op_type: (*op_type).into(),
        input: input.iter().map(|name| (*name).to_owned()).collect(),
        output: vec![(*output).to_owned()],
        attribute: if matches!(*op_type, "Gather" | "Concat") { vec![int("axis", 1)] } else { Vec::new() },
        ..Default::default()
    });
    let made: Vec<NodeProto> = made.collect();
    for node in &mut graph.node {
        for input in node.input.iter_mut().filter(|input| **input == own) {
            "memory.inputs".clone_into(input);
        }
    }
    graph.node.splice(0..0, made);
    model
}

/// Tells a network with a memory so many numbers of friction: it then has so many more inputs than features and plays.
pub(crate) fn tell_friction(mut model: ModelProto, friction: i64) -> ModelProto {
    let graph = model.graph.as_mut().unwrap();
    graph.input.push(port("friction", Some(dimension::Value::DimValue(1)), friction));
    graph.initializer.push(tensor("friction", &[1, friction], &vec![0.0; friction as usize]));
    graph.node[7].input.push("friction".to_owned());
    model
}

fn floats(tensor: &TensorProto) -> Vec<f64> {
    tensor.raw_data.chunks_exact(4).map(|b| f64::from(f32::from_le_bytes(b.try_into().unwrap()))).collect()
}

fn broadcast(a: &[f64], b: &[f64], f: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    let at = |v: &[f64], i: usize| if v.len() == 1 { v[0] } else { v[i] };
    (0..a.len().max(b.len())).map(|i| f(at(a, i), at(b, i))).collect()
}

/// Evaluates a model as the ONNX operators are specified, without the importer.
pub(crate) fn evaluate(model: &ModelProto, input: &[f32]) -> Vec<f64> {
    let graph = model.graph.as_ref().unwrap();
    let mut values: BTreeMap<&str, Vec<f64>> = graph.initializer.iter().map(|t| (t.name.as_str(), floats(t))).collect();
    values.insert(&graph.input[0].name, input.iter().map(|x| f64::from(*x)).collect());
    for node in &graph.node {
        let inputs: Vec<&Vec<f64>> = node.input.iter().map(|i| &values[i.as_str()]).collect();
        let result = operator(node, &inputs);
        values.insert(&node.output[0], result);
    }
    values[graph.output[0].name.as_str()].clone()
}

fn operator(node: &NodeProto, inputs: &[&Vec<f64>]) -> Vec<f64> {
    let attribute = |name: &str| node.attribute.iter().find(|a| a.name == name);
    let number = |name: &str, default: f32| f64::from(attribute(name).map_or(default, |a| a.f));
    let x = inputs.first().copied().cloned().unwrap_or_default();
    let each = |f: &dyn Fn(f64) -> f64| x.iter().map(|v| f(*v)).collect();
    match node.op_type.as_str() {
        "Gemm" | "MatMul" => {
            let transposed = attribute("transB").is_some_and(|a| a.i == 1);
            let (w, k) = (inputs[1], x.len());
            let n = w.len() / k;
            let weight = |i: usize, o: usize| if transposed { w[o * k + i] } else { w[i * n + o] };
            let bias = |o: usize| inputs.get(2).map_or(0.0, |b| b[if b.len() == 1 { 0 } else { o }]);
            let sum = |o: usize| (0..k).map(|i| x[i] * weight(i, o)).sum::<f64>();
            (0..n).map(|o| number("alpha", 1.0) * sum(o) + number("beta", 1.0) * bias(o)).collect()
        }
        "Add" => broadcast(&x, inputs[1], |a, b| a + b),
        "Sub" => broadcast(&x, inputs[1], |a, b| a - b),
        "Mul" => broadcast(&x, inputs[1], |a, b| a * b),
        "Div" => broadcast(&x, inputs[1], |a, b| a / b),
        "BatchNormalization" => (0..x.len())
            .map(|i| {
                let deviation = (inputs[4][i] + number("epsilon", 1e-5)).sqrt();
                (x[i] - inputs[3][i]) / deviation * inputs[1][i] + inputs[2][i]
            })
            .collect(),
        "Sigmoid" => each(&|v| 1.0 / (1.0 + (-v).exp())),
        "Tanh" => each(&f64::tanh),
        "Relu" => each(&|v| v.max(0.0)),
        "Elu" => each(&|v| if v < 0.0 { number("alpha", 1.0) * (v.exp() - 1.0) } else { v }),
        "Identity" | "Cast" | "Reshape" | "Flatten" | "Squeeze" | "Unsqueeze" => x,
        other => panic!("the test evaluator does not know {other}"),
    }
}
