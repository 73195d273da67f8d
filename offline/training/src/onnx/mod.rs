//! ONNX out and in: a chain of dense layers with its card as metadata. Operator set 17, IR 8, which every runtime since 2022 reads.

mod memory;
mod proto;

use crate::chain::{Chain, Dense};
use crate::network::Activation;
use ndarray::Array2;
use prost::Message;
use proto::{Attribute, Dimension, Entry, Graph, Model, Node, OperatorSet, Shape, Tensor, TensorType, Type, ValueInfo};
use std::collections::BTreeMap;

const IR_VERSION: i64 = 8;
const OPERATOR_SET: i64 = 17;
/// `TensorProto.FLOAT`.
const FLOAT: i32 = 1;
/// `AttributeProto.INT`.
const INT: i32 = 2;
const INPUT: &str = "input";
const OUTPUT: &str = "output";
const ACTIVATIONS: [Activation; 4] = [Activation::Sigmoid, Activation::Tanh, Activation::Relu, Activation::Elu];

/// The bytes of an ONNX file; properties in the order of their keys, so that the same model gives the same bytes.
pub fn write(chain: &Chain, metadata: &BTreeMap<String, String>) -> Vec<u8> {
    let mut graph = Graph { name: "ravenpose".to_owned(), ..Graph::default() };
    graph.input.push(value(INPUT, FLOAT, chain.inputs() - chain.remembered()));
    graph.output.push(value(OUTPUT, FLOAT, chain.outputs()));
    let mut current =
        if chain.plays.is_empty() { INPUT.to_owned() } else { memory::write(&mut graph, &chain.plays, chain.frictions()) };
    for (operator, name, values) in [("Sub", "shift", &chain.shift), ("Mul", "scale", &chain.scale)] {
        graph.initializer.push(tensor(name, &[values.len()], values.iter()));
        let out = format!("{name}.out");
        graph.node.push(node(operator, name, vec![current, name.to_owned()], &out));
        current = out;
    }
    for (index, layer) in chain.layers.iter().enumerate() {
        let (weight, bias) = (format!("layer{index}.weight"), format!("layer{index}.bias"));
        graph.initializer.push(tensor(&weight, layer.weight.shape(), layer.weight.iter()));
        graph.initializer.push(tensor(&bias, &[layer.bias.len()], layer.bias.iter()));
        let last = index + 1 == chain.layers.len();
        let sum = if last { OUTPUT.to_owned() } else { format!("layer{index}.sum") };
        let mut gemm = node("Gemm", &format!("layer{index}"), vec![current, weight, bias], &sum);
        gemm.attribute.push(Attribute { name: "transB".to_owned(), i: 1, kind: INT });
        graph.node.push(gemm);
        current = sum;
        if let (Some(operator), false) = (layer.activation.operator(), last) {
            let out = format!("layer{index}.out");
            graph.node.push(node(operator, &out.clone(), vec![current], &out));
            current = out;
        }
    }
    let model = Model {
        ir_version: IR_VERSION,
        producer_name: "ravenpose".to_owned(),
        producer_version: env!("CARGO_PKG_VERSION").to_owned(),
        graph: Some(graph),
        opset_import: vec![OperatorSet { domain: String::new(), version: OPERATOR_SET }],
        metadata_props: metadata.iter().map(|(key, value)| Entry { key: key.clone(), value: value.clone() }).collect(),
    };
    model.encode_to_vec()
}

fn node(operator: &str, name: &str, input: Vec<String>, output: &str) -> Node {
    let (name, op_type) = (format!("{name}.node"), operator.to_owned());
    Node { input, output: vec![output.to_owned()], name, op_type, attribute: Vec::new() }
}

fn tensor<'a>(name: &str, shape: &[usize], values: impl Iterator<Item = &'a f32>) -> Tensor {
    Tensor {
        dims: shape.iter().map(|size| *size as i64).collect(),
        data_type: FLOAT,
        name: name.to_owned(),
        raw_data: values.flat_map(|value| value.to_le_bytes()).collect(),
    }
}

fn value(name: &str, element: i32, width: usize) -> ValueInfo {
    let dim = vec![Dimension { value: 1 }, Dimension { value: width as i64 }];
    let tensor = Some(TensorType { element, shape: Some(Shape { dim }) });
    ValueInfo { name: name.to_owned(), kind: Some(Type { tensor }) }
}

/// Reads what [`write`] wrote: the chain and its metadata.
///
/// # Errors
/// What is not as this crate writes it, in words.
pub fn read(bytes: &[u8]) -> Result<(Chain, BTreeMap<String, String>), String> {
    let model = Model::decode(bytes).map_err(|error| format!("is no ONNX file: {error}"))?;
    let graph = model.graph.ok_or("has no graph")?;
    let tensors: BTreeMap<&str, &Tensor> = graph.initializer.iter().map(|one| (one.name.as_str(), one)).collect();
    let (plays, friction) = memory::read(&graph)?;
    let mut nodes = graph.node.iter().skip(if plays.is_empty() { 0 } else { memory::NODES }).peekable();
    let mut next = |operator: &str| nodes.next_if(|node| node.op_type == operator);
    let vector = |node: Option<&Node>, at: usize| -> Result<Vec<f32>, String> {
        let name = node.and_then(|node| node.input.get(at)).ok_or("is not a chain that ravenpose wrote")?;
        floats(tensors.get(name.as_str()).ok_or_else(|| format!("lacks the tensor {}", name.escape_debug()))?)
    };
    let shift = vector(next("Sub"), 1)?;
    let scale = vector(next("Mul"), 1)?;
    let mut layers = Vec::new();
    let mut width = shift.len();
    while let Some(gemm) = next("Gemm") {
        let (weight, bias) = (vector(Some(gemm), 1)?, vector(Some(gemm), 2)?);
        let wrong = |_| format!("layer {} has weights that do not fit", layers.len());
        let weight = Array2::from_shape_vec((bias.len(), width), weight).map_err(wrong)?;
        width = bias.len();
        let activation = ACTIVATIONS.into_iter().find(|one| one.operator().is_some_and(|operator| next(operator).is_some()));
        layers.push(Dense { weight, bias, activation: activation.unwrap_or(Activation::Identity) });
    }
    let whole = nodes.next().is_none() && !layers.is_empty() && scale.len() == shift.len();
    let chain = Chain { shift, scale, layers, plays, friction };
    let fits = chain.plays.is_empty() || chain.inputs() == ravenpose_wire::FEATURES + chain.remembered();
    if !whole || !fits {
        return Err("is not a chain that ravenpose wrote".to_owned());
    }
    let metadata: BTreeMap<String, String> = model.metadata_props.into_iter().map(|entry| (entry.key, entry.value)).collect();
    // What was read is what the file computes only if the file is what would have been written: attributes, shapes and wiring too.
    let again = Model::decode(write(&chain, &metadata).as_slice()).ok().and_then(|model| model.graph);
    let same = |again: &Graph| again.node == graph.node && again.initializer == graph.initializer;
    if !again.as_ref().is_some_and(same) {
        return Err("is not a chain that ravenpose wrote".to_owned());
    }
    Ok((chain, metadata))
}

fn floats(tensor: &Tensor) -> Result<Vec<f32>, String> {
    let values: Vec<f32> =
        tensor.raw_data.chunks_exact(4).map(|four| f32::from_le_bytes([four[0], four[1], four[2], four[3]])).collect();
    if tensor.data_type != FLOAT || values.iter().any(|value| !value.is_finite()) {
        return Err(format!("the tensor {} is not of finite float32", tensor.name.escape_debug()));
    }
    Ok(values)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ravenpose::memory::Play;

    fn chain() -> Chain {
        of_width(4)
    }

    fn of_width(inputs: usize) -> Chain {
        let layer = |rows: usize, columns: usize, activation| Dense {
            weight: Array2::from_shape_fn((rows, columns), |(r, c)| (r * 7 + c) as f32 * 0.01 - 0.1),
            bias: vec![0.25; rows],
            activation,
        };
        let layers = vec![layer(5, inputs, Activation::Tanh), layer(6, 5, Activation::Elu), layer(3, 6, Activation::Identity)];
        Chain { shift: vec![1.0; inputs], scale: vec![0.5; inputs], layers, plays: Vec::new(), friction: false }
    }

    /// Of a RAVEN-II's features, with two places behind them.
    fn with_memory() -> Chain {
        let plays = vec![Play { input: 56, half_width: 0.25 }, Play { input: 57, half_width: 3.0 }];
        Chain { plays, friction: true, ..of_width(ravenpose_wire::FEATURES + 5) }
    }

    #[test]
    fn a_memory_that_does_not_fit_the_layers_is_refused() {
        let bytes = write(&Chain { shift: vec![0.0; 119], ..with_memory() }, &BTreeMap::new());
        assert!(read(&bytes).is_err());
        let bytes = write(&Chain { plays: vec![Play { input: 118, half_width: 1.0 }; 2], ..with_memory() }, &BTreeMap::new());
        assert!(read(&bytes).expect_err("beyond the features").contains("on feature 118"));
    }

    #[test]
    fn what_was_written_reads_as_the_same_chain() {
        let metadata = BTreeMap::from([("ravenpose.units".to_owned(), "mm".to_owned())]);
        for chain in [chain(), with_memory()] {
            let bytes = write(&chain, &metadata);
            assert_eq!(read(&bytes), Ok((chain.clone(), metadata.clone())));
            assert_eq!(bytes, write(&chain, &metadata));
        }
    }

    #[test]
    fn a_damaged_file_is_refused_without_a_panic() {
        for chain in [chain(), with_memory()] {
            let bytes = write(&chain, &BTreeMap::new());
            for length in 0..bytes.len() {
                if let Ok((found, _)) = read(&bytes[..length]) {
                    assert_eq!(found, chain, "{length}");
                }
            }
            for at in 0..bytes.len() {
                let mut other = bytes.clone();
                other[at] ^= 0x55;
                let _ = read(&other);
            }
        }
    }

    #[test]
    fn what_computes_something_else_than_the_chain_in_it_is_not_read() {
        let bytes = write(&chain(), &BTreeMap::new());
        assert!(read(&bytes).is_ok());
        let refused = |change: &dyn Fn(&mut Graph)| {
            let mut model = Model::decode(bytes.as_slice()).expect("a model");
            change(model.graph.as_mut().expect("a graph"));
            read(&model.encode_to_vec()).expect_err("refused")
        };
        let gemm = |graph: &Graph| graph.node.iter().position(|node| node.op_type == "Gemm").expect("a layer");
        let all: [&dyn Fn(&mut Graph); 4] = [
            // Weights the other way round; half of the sum; a matrix of other sides; an activation that nobody waits for.
            &|graph| {
                let node = gemm(graph);
                graph.node[node].attribute.clear();
            },
            &|graph| {
                let node = gemm(graph);
                graph.node[node].attribute.push(Attribute { name: "alpha".to_owned(), i: 0, kind: 1 });
            },
            &|graph| graph.initializer.iter_mut().find(|one| one.dims.len() == 2).expect("weights").dims.reverse(),
            &|graph| {
                let (last, first) = (graph.node.len() - 1, graph.node[gemm(graph)].output[0].clone());
                graph.node[last].input[0] = first;
            },
        ];
        for change in all {
            assert!(refused(change).contains("is not a chain that ravenpose wrote"));
        }
    }
}
