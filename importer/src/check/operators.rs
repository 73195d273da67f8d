//! The operators of a dense network, as one table, and the check of a node against it.

use std::ops::RangeInclusive;

use tract_onnx::pb::attribute_proto::AttributeType;
use tract_onnx::pb::{AttributeProto, NodeProto};

use super::is_default_domain;
use crate::error::ImportError;
use crate::{limits, text};

/// What an operator does to the kind of value it is given.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Effect {
    /// New numbers.
    Computes,
    /// The same numbers in the same order, perhaps of another shape; inputs after the first are shapes or axes.
    Moves,
    /// A stored tensor.
    Stores,
}

enum Rule {
    Float { min: f32 },
    Int { min: i64, max: i64 },
    Axes,
}

pub(super) struct Operator {
    name: &'static str,
    inputs: RangeInclusive<usize>,
    attributes: &'static [(&'static str, Rule)],
    pub(super) effect: Effect,
}

const RANK: i64 = limits::RANK_MAX as i64;
const AXES: &[(&str, Rule)] = &[("axes", Rule::Axes)];
const GEMM: &[(&str, Rule)] = &[
    ("alpha", Rule::Float { min: f32::MIN }),
    ("beta", Rule::Float { min: f32::MIN }),
    ("transA", Rule::Int { min: 0, max: 0 }),
    ("transB", Rule::Int { min: 0, max: 1 }),
];
const NORM: &[(&str, Rule)] = &[
    ("epsilon", Rule::Float { min: 0.0 }),
    ("momentum", Rule::Float { min: f32::MIN }),
    ("spatial", Rule::Int { min: 1, max: 1 }),
    ("training_mode", Rule::Int { min: 0, max: 0 }),
];

const fn operator(
    name: &'static str,
    inputs: RangeInclusive<usize>,
    attributes: &'static [(&'static str, Rule)],
    effect: Effect,
) -> Operator {
    Operator { name, inputs, attributes, effect }
}

static OPERATORS: [Operator; 18] = [
    operator("Gemm", 2..=3, GEMM, Effect::Computes),
    operator("MatMul", 2..=2, &[], Effect::Computes),
    operator("Add", 2..=2, &[], Effect::Computes),
    operator("Sub", 2..=2, &[], Effect::Computes),
    operator("Mul", 2..=2, &[], Effect::Computes),
    operator("Div", 2..=2, &[], Effect::Computes),
    operator("BatchNormalization", 5..=5, NORM, Effect::Computes),
    operator("Sigmoid", 1..=1, &[], Effect::Computes),
    operator("Tanh", 1..=1, &[], Effect::Computes),
    operator("Relu", 1..=1, &[], Effect::Computes),
    operator("Elu", 1..=1, &[("alpha", Rule::Float { min: f32::MIN_POSITIVE })], Effect::Computes),
    operator("Identity", 1..=1, &[], Effect::Moves),
    operator("Flatten", 1..=1, &[("axis", Rule::Int { min: -RANK, max: RANK })], Effect::Moves),
    operator("Reshape", 2..=2, &[("allowzero", Rule::Int { min: 0, max: 1 })], Effect::Moves),
    operator("Squeeze", 1..=2, AXES, Effect::Moves),
    operator("Unsqueeze", 1..=2, AXES, Effect::Moves),
    // 1 is FLOAT: casting float32 to float32 is all that may happen.
    operator("Cast", 1..=1, &[("to", Rule::Int { min: 1, max: 1 }), ("saturate", Rule::Int { min: 0, max: 1 })], Effect::Moves),
    operator("Constant", 0..=0, &[], Effect::Stores),
];

/// A node's name in messages: many exporters leave it empty, the output's name never is.
pub(super) fn label(node: &NodeProto) -> String {
    let output = node.output.first().map_or("", String::as_str);
    text::name(if node.name.is_empty() { output } else { &node.name })
}

/// Inputs that are given; trailing empty names stand for left-out optional ones.
pub(super) fn inputs(node: &NodeProto) -> &[String] {
    let given = node.input.iter().rposition(|name| !name.is_empty()).map_or(0, |last| last + 1);
    &node.input[..given]
}

/// Checks operator, domain, arity and attributes of one node.
pub(super) fn check(node: &NodeProto) -> Result<&'static Operator, ImportError> {
    if let Some(attribute) = node.attribute.iter().find(|a| a.g.is_some() || !a.graphs.is_empty()) {
        let attribute = text::name(&attribute.name);
        return Err(ImportError::Subgraph { node: label(node), operator: text::name(&node.op_type), attribute });
    }
    if !is_default_domain(&node.domain) {
        let (operator, domain) = (text::name(&node.op_type), text::name(&node.domain));
        return Err(ImportError::Domain { node: label(node), operator, domain });
    }
    let operator = OPERATORS
        .iter()
        .find(|o| o.name == node.op_type)
        .ok_or_else(|| ImportError::Operator { node: label(node), operator: text::name(&node.op_type) })?;
    arity(node, "inputs", inputs(node).len(), &operator.inputs)?;
    arity(node, "outputs", node.output.len(), &(1..=1))?;
    if operator.effect != Effect::Stores {
        attributes(node, operator)?;
    }
    Ok(operator)
}

fn arity(node: &NodeProto, role: &'static str, found: usize, expected: &RangeInclusive<usize>) -> Result<(), ImportError> {
    if expected.contains(&found) {
        return Ok(());
    }
    let (min, max) = (expected.start(), expected.end());
    let expected = if min == max { min.to_string() } else { format!("{min} to {max}") };
    Err(ImportError::Arity { node: label(node), operator: text::name(&node.op_type), role, found, expected })
}

fn attributes(node: &NodeProto, operator: &Operator) -> Result<(), ImportError> {
    for (index, attribute) in node.attribute.iter().enumerate() {
        if node.attribute[..index].iter().any(|earlier| earlier.name == attribute.name) {
            return Err(refuse(node, attribute, "given twice".to_owned(), "each attribute once"));
        }
        match operator.attributes.iter().find(|(name, _)| *name == attribute.name) {
            Some((_, rule)) => obey(node, attribute, rule)?,
            None => return Err(refuse(node, attribute, "unknown here".to_owned(), "only the operator's own attributes")),
        }
    }
    Ok(())
}

fn obey(node: &NodeProto, attribute: &AttributeProto, rule: &Rule) -> Result<(), ImportError> {
    let axes_are_small = || attribute.ints.len() <= limits::RANK_MAX && attribute.ints.iter().all(|a| (-RANK..RANK).contains(a));
    match rule {
        Rule::Float { min } => {
            let kept = is_type(attribute, AttributeType::Float) && attribute.f.is_finite() && attribute.f >= *min;
            require(kept, node, attribute, attribute.f.to_string(), "a finite number in the operator's range")
        }
        Rule::Int { min, max } => {
            let kept = is_type(attribute, AttributeType::Int) && (*min..=*max).contains(&attribute.i);
            require(kept, node, attribute, attribute.i.to_string(), "a value that inference on float32 rows allows")
        }
        Rule::Axes => {
            let kept = is_type(attribute, AttributeType::Ints) && axes_are_small();
            require(kept, node, attribute, format!("{} numbers", attribute.ints.len()), "at most 8 axes from -8 to 7")
        }
    }
}

pub(super) fn is_type(attribute: &AttributeProto, expected: AttributeType) -> bool {
    attribute.r#type == expected as i32 && attribute.ref_attr_name.is_empty()
}

fn require(
    kept: bool,
    node: &NodeProto,
    attribute: &AttributeProto,
    found: String,
    expected: &'static str,
) -> Result<(), ImportError> {
    if kept { Ok(()) } else { Err(refuse(node, attribute, found, expected)) }
}

pub(super) fn refuse(node: &NodeProto, attribute: &AttributeProto, found: String, expected: &'static str) -> ImportError {
    ImportError::Attribute { node: label(node), attribute: text::name(&attribute.name), found, expected }
}
