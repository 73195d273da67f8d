//! The memory that a model may have in front of its network: plays, each of which holds one feature back by a half width.
//!
//! In the file it is eight nodes ahead of the dense layers and two inputs with default values, so that any runtime gives the answer
//! of a memory that has seen nothing else from the raw features alone, and the whole of it whoever hands `memory_out` back in:
//!
//! ```text
//! x      = Gather(input, memory.features)              memory      [1, n], zeros by default
//! place  = Min(Max(memory, x - r), x + r)              remembered  [1, 1], false by default
//! memory_out     = Where(remembered, place, x)         r = memory.half_widths
//! memory.inputs  = Concat(input, x - memory_out)       what the first layer sees
//! ```
//!
//! A network that knows of friction has one more such input, `friction` [1, m], zeros by default: the last of what is concatenated.
//!
//! Here that part is checked against this very form and cut off; the rest is a chain like any other.

use tract_onnx::pb::attribute_proto::AttributeType;
use tract_onnx::pb::tensor_proto::DataType;
use tract_onnx::pb::tensor_shape_proto::dimension::Value as Dim;
use tract_onnx::pb::{AttributeProto, GraphProto, NodeProto, TensorProto, ValueInfoProto, type_proto};

use crate::error::ImportError;
use crate::limits::{FRICTION_MAX, PLAYS_MAX};
use crate::network::Play;

const MEMORY: &str = "memory";
const REMEMBERED: &str = "remembered";
const OUT: &str = "memory_out";
const FRICTION: &str = "friction";
const FEATURES: &str = "memory.features";
const HALF_WIDTHS: &str = "memory.half_widths";
const INPUTS: &str = "memory.inputs";

/// Operator, inputs and output of each node; `@` stands for the graph's own input.
const NODES: [(&str, &[&str], &str); 8] = [
    ("Gather", &["@", FEATURES], "memory.x"),
    ("Sub", &["memory.x", HALF_WIDTHS], "memory.lower"),
    ("Add", &["memory.x", HALF_WIDTHS], "memory.upper"),
    ("Max", &[MEMORY, "memory.lower"], "memory.above"),
    ("Min", &["memory.above", "memory.upper"], "memory.moved"),
    ("Where", &[REMEMBERED, "memory.moved", "memory.x"], OUT),
    ("Sub", &["memory.x", OUT], "memory.places"),
    ("Concat", &["@", "memory.places"], INPUTS),
];

/// What was taken off a graph.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Cut {
    pub(crate) plays: Vec<Play>,
    /// Numbers of friction behind their places.
    pub(crate) friction: usize,
}

impl Cut {
    /// Inputs of the first layer beyond the file's own.
    pub(crate) fn width(&self) -> usize {
        self.plays.len() + self.friction
    }
}

/// Takes the memory off the graph, whose input is then as wide as the first layer; nothing where the file has no memory.
///
/// # Errors
/// [`ImportError::Memory`] for one of another form.
pub(crate) fn cut(graph: &mut GraphProto, inputs: usize) -> Result<Cut, ImportError> {
    let named = |list: &[ValueInfoProto], name: &str| list.iter().any(|one| one.name == name);
    if !named(&graph.input, MEMORY) && !named(&graph.output, OUT) {
        return Ok(Cut::default());
    }
    let own = own_input(graph)?;
    if let Some(absent) = [MEMORY, REMEMBERED].iter().find(|name| !named(&graph.input, name)) {
        return Err(wrong(format!("{absent} is no input of the graph")));
    }
    let friction = friction(graph)?;
    check_nodes(graph, &own, friction > 0)?;
    check_names(graph, &own)?;
    let cut = Cut { plays: plays(graph, inputs)?, friction };
    check_ports(graph, &cut)?;
    check_default(graph, MEMORY, DataType::Float, cut.plays.len())?;
    check_default(graph, REMEMBERED, DataType::Bool, 1)?;
    if friction > 0 {
        check_default(graph, FRICTION, DataType::Float, friction)?;
    }
    graph.node.drain(..NODES.len());
    graph.initializer.retain(|one| ![MEMORY, REMEMBERED, FRICTION, FEATURES, HALF_WIDTHS].contains(&one.name.as_str()));
    graph.input.retain(|one| ![MEMORY, REMEMBERED, FRICTION].contains(&one.name.as_str()));
    graph.output.retain(|one| one.name != OUT);
    let widened = graph.input.iter_mut().find(|one| one.name == own).is_some_and(|one| widen(one, inputs, cut.width()));
    if widened { Ok(cut) } else { Err(wrong(format!("the graph's input is not [1, {inputs}]"))) }
}

fn wrong(found: String) -> ImportError {
    ImportError::Memory { found }
}

/// The one input that is neither stored nor the memory's.
fn own_input(graph: &GraphProto) -> Result<String, ImportError> {
    let stored = |name: &str| graph.initializer.iter().any(|one| one.name == name);
    let of_memory = |name: &str| [MEMORY, REMEMBERED, FRICTION].contains(&name);
    let mut own = graph.input.iter().map(|one| one.name.as_str()).filter(|name| !stored(name) && !of_memory(name));
    match (own.next(), own.next()) {
        (Some(name), None) => Ok(name.to_owned()),
        _ => Err(wrong("not exactly one input beside the memory's".to_owned())),
    }
}

/// Numbers of friction that the graph takes; 0 where it has no such input.
fn friction(graph: &GraphProto) -> Result<usize, ImportError> {
    if !graph.input.iter().any(|one| one.name == FRICTION) {
        return Ok(0);
    }
    match stored(graph, FRICTION)?.dims.as_slice() {
        [1, width @ 1..=FRICTION_MAX] => Ok(*width as usize),
        _ => Err(wrong(format!("{FRICTION} is not [1, 1 to {FRICTION_MAX}]"))),
    }
}

fn check_nodes(graph: &GraphProto, own: &str, has_friction: bool) -> Result<(), ImportError> {
    for (index, (operator, inputs, output)) in NODES.iter().enumerate() {
        let node = graph.node.get(index).ok_or_else(|| wrong(format!("only {index} nodes")))?;
        let last = (*output == INPUTS && has_friction).then_some(FRICTION);
        let wanted = inputs.iter().map(|name| if *name == "@" { own } else { *name }).chain(last);
        let same = node.op_type == *operator
            && node.domain.is_empty()
            && node.input.iter().map(String::as_str).eq(wanted)
            && node.output == [*output]
            && has_axis(node, matches!(*operator, "Gather" | "Concat"));
        if !same {
            return Err(wrong(format!("node {index} is not the {operator} that makes {output}")));
        }
    }
    Ok(())
}

/// Whether its only attribute is `axis = 1`, or it has none where it needs none.
fn has_axis(node: &NodeProto, wanted: bool) -> bool {
    let axis = || AttributeProto { name: "axis".to_owned(), r#type: AttributeType::Int as i32, i: 1, ..AttributeProto::default() };
    match node.attribute.as_slice() {
        [] => !wanted,
        [one] => wanted && *one == axis(),
        _ => false,
    }
}

/// What is cut off is checked by nobody else: a second value of such a name would take its place.
fn check_names(graph: &GraphProto, own: &str) -> Result<(), ImportError> {
    let stored = graph.initializer.iter().map(|one| one.name.as_str());
    let later = graph.node.iter().skip(NODES.len()).flat_map(|node| &node.output).map(String::as_str);
    match stored.chain(later).chain([own]).find(|name| NODES.iter().any(|(.., output)| output == name)) {
        Some(name) => Err(wrong(format!("{name} is defined twice"))),
        None => Ok(()),
    }
}

/// The memory's own inputs and output, as they are declared.
fn check_ports(graph: &GraphProto, cut: &Cut) -> Result<(), ImportError> {
    let plays = cut.plays.len();
    let wanted = [
        (MEMORY, DataType::Float, plays),
        (REMEMBERED, DataType::Bool, 1),
        (OUT, DataType::Float, plays),
        (FRICTION, DataType::Float, cut.friction),
    ];
    for port in graph.input.iter().chain(&graph.output) {
        let Some((name, data_type, width)) = wanted.iter().find(|(name, ..)| port.name == *name) else { continue };
        let Some(type_proto::Value::TensorType(tensor)) = port.r#type.as_ref().and_then(|kind| kind.value.as_ref()) else {
            return Err(wrong(format!("{name} has no declared type")));
        };
        let dims = tensor.shape.iter().flat_map(|shape| &shape.dim).map(|dim| match dim.value {
            Some(Dim::DimValue(value)) => value,
            _ => 0,
        });
        if tensor.elem_type != *data_type as i32 || !dims.eq([1, *width as i64]) {
            return Err(wrong(format!("{name} is not declared as {} [1, {width}]", data_type.as_str_name())));
        }
    }
    Ok(())
}

fn stored<'a>(graph: &'a GraphProto, name: &str) -> Result<&'a TensorProto, ImportError> {
    let mut found = graph.initializer.iter().filter(|one| one.name == name);
    match (found.next(), found.next()) {
        (Some(one), None) => Ok(one),
        _ => Err(wrong(format!("{name} is not stored exactly once"))),
    }
}

fn plays(graph: &GraphProto, inputs: usize) -> Result<Vec<Play>, ImportError> {
    let (features, widths) = (stored(graph, FEATURES)?, stored(graph, HALF_WIDTHS)?);
    let count = usize::try_from(features.dims.first().copied().unwrap_or(0)).unwrap_or(0);
    if !(1..=PLAYS_MAX).contains(&count) {
        return Err(wrong(format!("{FEATURES} names not 1 to {PLAYS_MAX} features")));
    }
    let features = numbers(features, DataType::Int64, &[count], i64::from_le_bytes)?;
    let widths = numbers(widths, DataType::Float, &[count], f32::from_le_bytes)?;
    features
        .into_iter()
        .zip(widths)
        .map(|(feature, half_width)| match usize::try_from(feature) {
            Ok(input) if input < inputs && half_width.is_finite() && half_width > 0.0 => Ok(Play { input, half_width }),
            _ => Err(wrong(format!("a play of half width {half_width} on input {feature}"))),
        })
        .collect()
}

/// Zeros, or false: what the answer from the features alone rests on.
fn check_default(graph: &GraphProto, name: &str, data_type: DataType, count: usize) -> Result<(), ImportError> {
    let values = match data_type {
        DataType::Bool => numbers(stored(graph, name)?, data_type, &[1, count], |[byte]: [u8; 1]| f32::from(byte))?,
        _ => numbers(stored(graph, name)?, data_type, &[1, count], f32::from_le_bytes)?,
    };
    if values.iter().all(|value| *value == 0.0) { Ok(()) } else { Err(wrong(format!("{name} does not begin with zeros"))) }
}

/// The numbers of a tensor that keeps them as raw bytes and nowhere else.
fn numbers<T, const BYTES: usize>(
    tensor: &TensorProto,
    data_type: DataType,
    dims: &[usize],
    read: fn([u8; BYTES]) -> T,
) -> Result<Vec<T>, ImportError> {
    let bytes: usize = dims.iter().product::<usize>() * BYTES;
    let wanted = TensorProto {
        name: tensor.name.clone(),
        dims: dims.iter().map(|size| *size as i64).collect(),
        data_type: data_type as i32,
        raw_data: tensor.raw_data.clone(),
        doc_string: tensor.doc_string.clone(),
        ..TensorProto::default()
    };
    if tensor.raw_data.len() != bytes || wanted != *tensor {
        return Err(wrong(format!("{} is not {} {dims:?} as raw data", tensor.name, data_type.as_str_name())));
    }
    Ok(tensor.raw_data.as_chunks::<BYTES>().0.iter().map(|chunk| read(*chunk)).collect())
}

/// Gives the graph's input the name and the width of what the first layer sees; `false` if it was not `inputs` wide.
fn widen(input: &mut ValueInfoProto, inputs: usize, more: usize) -> bool {
    let Some(type_proto::Value::TensorType(tensor)) = input.r#type.as_mut().and_then(|kind| kind.value.as_mut()) else {
        return false;
    };
    let Some(width) = tensor.shape.as_mut().and_then(|shape| shape.dim.get_mut(1)) else { return false };
    match &mut width.value {
        Some(Dim::DimValue(value)) if *value == inputs as i64 => *value = (inputs + more) as i64,
        _ => return false,
    }
    INPUTS.clone_into(&mut input.name);
    true
}
