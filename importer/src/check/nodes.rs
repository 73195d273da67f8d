//! The graph's wiring: every value defined once and before its use, every node leading to the output, constants where constants
//! belong.

use std::collections::{BTreeMap, BTreeSet};

use tract_onnx::pb::attribute_proto::AttributeType;
use tract_onnx::pb::{GraphProto, NodeProto};

use super::operators::{self, Effect, inputs, label};
use super::tensor::{self, Constant, Floats};
use crate::error::ImportError;
use crate::{limits, text};

#[derive(Clone, Copy)]
enum Value<'a> {
    /// Depends on the network's input.
    Computed,
    /// The network's input itself, perhaps in another shape.
    Input,
    Constant(Constant<'a>),
}

struct Wiring<'a> {
    values: BTreeMap<&'a str, Value<'a>>,
    /// Names that some node produces, earlier or later: tells a cycle from a missing tensor.
    produced: BTreeSet<&'a str>,
    used: BTreeSet<&'a str>,
    budget: usize,
    input_norms: Vec<usize>,
}

/// Checks all tensors and nodes; gives the indices of batch normalisations of the network's own input.
pub(super) fn check<'a>(graph: &'a GraphProto, input: &'a str) -> Result<Vec<usize>, ImportError> {
    let mut wiring = Wiring {
        values: BTreeMap::new(),
        produced: graph.node.iter().flat_map(|n| &n.output).map(String::as_str).collect(),
        used: BTreeSet::new(),
        budget: limits::WEIGHTS_MAX,
        input_norms: Vec::new(),
    };
    // Operators first: an unsupported one explains the odd tensors that it needs.
    let operators = graph.node.iter().map(operators::check).collect::<Result<Vec<_>, _>>()?;
    for stored in &graph.initializer {
        let constant = tensor::check(stored, &stored.name, &mut wiring.budget)?;
        wiring.define(&stored.name, Value::Constant(constant))?;
    }
    wiring.define(input, Value::Input)?;
    for (index, (node, operator)) in graph.node.iter().zip(operators).enumerate() {
        wiring.node(index, node, operator.effect)?;
    }
    wiring.outputs(graph)?;
    Ok(wiring.input_norms)
}

impl<'a> Wiring<'a> {
    fn define(&mut self, name: &'a str, value: Value<'a>) -> Result<(), ImportError> {
        // The empty name stands for an absent input, so nothing may be called so.
        if name.is_empty() || self.values.insert(name, value).is_some() {
            return Err(ImportError::DuplicateName { name: text::name(name) });
        }
        Ok(())
    }

    fn node(&mut self, index: usize, node: &'a NodeProto, effect: Effect) -> Result<(), ImportError> {
        let values = inputs(node).iter().map(|name| self.resolve(node, name)).collect::<Result<Vec<_>, _>>()?;
        let result = match effect {
            Effect::Stores => Value::Constant(self.stored(node)?),
            Effect::Moves => moved(node, &values)?,
            Effect::Computes => computed(node, &values)?,
        };
        if node.op_type == "BatchNormalization" {
            self.norm(index, node, &values)?;
        }
        self.define(&node.output[0], result)
    }

    fn resolve(&mut self, node: &NodeProto, name: &'a str) -> Result<Value<'a>, ImportError> {
        self.used.insert(name);
        self.values.get(name).copied().ok_or_else(|| {
            let (node, input) = (label(node), text::name(name));
            if self.produced.contains(name) { ImportError::Cycle { node, input } } else { ImportError::Missing { node, input } }
        })
    }

    fn stored(&mut self, node: &'a NodeProto) -> Result<Constant<'a>, ImportError> {
        let name = &node.output[0];
        let [attribute] = node.attribute.as_slice() else {
            let (operator, found, expected) = ("Constant".to_owned(), node.attribute.len(), "1".to_owned());
            return Err(ImportError::Arity { node: label(node), operator, role: "attributes", found, expected });
        };
        let is = |kind, key: &str| attribute.name == key && operators::is_type(attribute, kind);
        if let Some(t) = attribute.t.as_ref().filter(|_| is(AttributeType::Tensor, "value")) {
            return tensor::check(t, name, &mut self.budget);
        }
        if is(AttributeType::Float, "value_float") {
            return Floats::List(std::slice::from_ref(&attribute.f)).check_finite(name).map(Constant::Floats);
        }
        if is(AttributeType::Floats, "value_floats") && !attribute.floats.is_empty() {
            self.budget = self.budget.saturating_sub(attribute.floats.len());
            return Floats::List(&attribute.floats).check_finite(name).map(Constant::Floats);
        }
        if is(AttributeType::Int, "value_int") {
            return tensor::check_shape_numbers(&[attribute.i], name);
        }
        if is(AttributeType::Ints, "value_ints") && !attribute.ints.is_empty() {
            return tensor::check_shape_numbers(&attribute.ints, name);
        }
        Err(operators::refuse(node, attribute, "no dense tensor".to_owned(), "a float32 tensor, or integers for a shape"))
    }

    /// tract takes any variance and hides the NaN of a negative one behind its clamped sigmoid.
    fn norm(&mut self, index: usize, node: &NodeProto, values: &[Value<'a>]) -> Result<(), ImportError> {
        for (name, value) in node.input.iter().zip(values).skip(1) {
            let Value::Constant(Constant::Floats(floats)) = value else {
                return Err(operand(node, name, "computed", "a stored float32 tensor"));
            };
            let bad = floats.iter().enumerate().find(|(_, v)| *v <= 0.0);
            if let Some((index, value)) = bad.filter(|_| *name == node.input[4]) {
                return Err(ImportError::Variance { node: label(node), tensor: text::name(name), index, value });
            }
        }
        if matches!(values[0], Value::Input) {
            self.input_norms.push(index);
        }
        Ok(())
    }

    fn outputs(&self, graph: &GraphProto) -> Result<(), ImportError> {
        let output = graph.output.first().map_or("", |o| o.name.as_str());
        if !self.produced.contains(output) {
            return Err(ImportError::OutputNotProduced { output: text::name(output) });
        }
        let leads_on = |name: &str| self.used.contains(name) || name == output;
        match graph.node.iter().find(|n| !leads_on(&n.output[0])) {
            Some(node) => Err(ImportError::Unused { node: label(node), output: text::name(&node.output[0]) }),
            None => Ok(()),
        }
    }
}

fn moved<'a>(node: &NodeProto, values: &[Value<'a>]) -> Result<Value<'a>, ImportError> {
    for (name, value) in node.input.iter().zip(values).skip(1) {
        if !matches!(value, Value::Constant(Constant::Integers)) {
            return Err(operand(node, name, "no integer constant", "a stored integer shape or axes"));
        }
    }
    Ok(values[0])
}

fn computed<'a>(node: &NodeProto, values: &[Value<'a>]) -> Result<Value<'a>, ImportError> {
    for (name, value) in node.input.iter().zip(values) {
        if matches!(value, Value::Constant(Constant::Integers)) {
            return Err(operand(node, name, "an integer tensor", "float32; export the model with float32 weights"));
        }
    }
    if values.iter().all(|v| matches!(v, Value::Constant(_))) {
        return Err(ImportError::ComputedConstant { node: label(node), operator: text::name(&node.op_type) });
    }
    Ok(Value::Computed)
}

fn operand(node: &NodeProto, input: &str, found: &'static str, expected: &'static str) -> ImportError {
    ImportError::Operand { node: label(node), input: text::name(input), found, expected }
}
