//! The memory in front of the layers as nodes of the graph: the form that the importer's `memory.rs` describes and asks for.
//!
//! `memory` and `remembered`, and `friction` if there is any, are inputs with default values, so that from the 118 features alone any runtime gives the answer of a
//! memory that has seen nothing else; whoever hands `memory_out` back in, with `remembered` true, has the whole of it.

use super::proto::{Attribute, Graph, Node, Tensor};
use super::{FLOAT, INPUT, INT, node, tensor, value};
use ravenpose::memory::Play;

/// `TensorProto.INT64`.
const INT64: i32 = 7;
/// `TensorProto.BOOL`.
const BOOL: i32 = 9;
/// Nodes of a memory.
pub(super) const NODES: usize = 8;

/// Adds the nodes, ports and tensors; gives the name of what the first layer sees.
pub(super) fn write(graph: &mut Graph, plays: &[Play], frictions: usize) -> String {
    let features: Vec<u8> = plays.iter().flat_map(|play| (play.input as i64).to_le_bytes()).collect();
    let widths: Vec<f32> = plays.iter().map(|play| play.half_width).collect();
    graph.initializer.extend([
        tensor("memory", &[1, plays.len()], vec![0.0; plays.len()].iter()),
        Tensor { dims: vec![1, 1], data_type: BOOL, name: "remembered".to_owned(), raw_data: vec![0] },
        Tensor { dims: vec![plays.len() as i64], data_type: INT64, name: "memory.features".to_owned(), raw_data: features },
        tensor("memory.half_widths", &[plays.len()], widths.iter()),
    ]);
    graph.input.extend([value("memory", FLOAT, plays.len()), value("remembered", BOOL, 1)]);
    graph.output.push(value("memory_out", FLOAT, plays.len()));
    let mut seen = vec![INPUT, "memory.places"];
    if frictions > 0 {
        graph.initializer.push(tensor("friction", &[1, frictions], vec![0.0; frictions].iter()));
        graph.input.push(value("friction", FLOAT, frictions));
        seen.push("friction");
    }
    let of = |operator: &str, inputs: &[&str], output: &str| {
        node(operator, output, inputs.iter().map(|name| (*name).to_owned()).collect(), output)
    };
    graph.node.extend([
        along_rows(of("Gather", &[INPUT, "memory.features"], "memory.x")),
        of("Sub", &["memory.x", "memory.half_widths"], "memory.lower"),
        of("Add", &["memory.x", "memory.half_widths"], "memory.upper"),
        of("Max", &["memory", "memory.lower"], "memory.above"),
        of("Min", &["memory.above", "memory.upper"], "memory.moved"),
        of("Where", &["remembered", "memory.moved", "memory.x"], "memory_out"),
        of("Sub", &["memory.x", "memory_out"], "memory.places"),
        along_rows(of("Concat", &seen, "memory.inputs")),
    ]);
    "memory.inputs".to_owned()
}

fn along_rows(mut node: Node) -> Node {
    node.attribute.push(Attribute { name: "axis".to_owned(), i: 1, kind: INT });
    node
}

/// The plays of a graph that [`write`] wrote, and whether it is told of friction; none where it has no memory.
pub(super) fn read(graph: &Graph) -> Result<(Vec<Play>, bool), String> {
    let stored = |name: &str| graph.initializer.iter().find(|one| one.name == name);
    let (Some(features), Some(widths)) = (stored("memory.features"), stored("memory.half_widths")) else {
        return Ok((Vec::new(), false));
    };
    let widths = super::floats(widths)?;
    let features: Vec<i64> = features.raw_data.as_chunks::<8>().0.iter().map(|eight| i64::from_le_bytes(*eight)).collect();
    let operators = graph.node.iter().take(NODES).map(|node| node.op_type.as_str());
    if features.len() != widths.len() || !operators.eq(["Gather", "Sub", "Add", "Max", "Min", "Where", "Sub", "Concat"]) {
        return Err("has a memory that ravenpose did not write".to_owned());
    }
    let play = |(feature, half_width): (i64, f32)| match usize::try_from(feature) {
        Ok(input) if input < ravenpose_wire::FEATURES && half_width > 0.0 => Ok(Play { input, half_width }),
        _ => Err(format!("has a play of half width {half_width} on feature {feature}")),
    };
    let plays = features.into_iter().zip(widths).map(play).collect::<Result<_, _>>()?;
    Ok((plays, graph.input.iter().any(|one| one.name == "friction")))
}
