//! Reads tract's decluttered graph as one chain of steps from input to output.
//!
//! Operand order, rank and the orientation of weights vary from node to node (tract drops unit axes where it can), so a value is
//! taken here as a plain vector: at most one axis is longer than 1, and then the order in memory is the order of the axis.

mod einsum;
mod elu;

use tract_onnx::prelude::*;
use tract_onnx::tract_core::ops::binary::TypedBinOp;
use tract_onnx::tract_core::ops::change_axes::{AxisOp, IntoShape};
use tract_onnx::tract_core::ops::einsum::EinSum;
use tract_onnx::tract_core::ops::element_wise::ElementWiseOp;
use tract_onnx::tract_core::ops::identity::Identity;
use tract_onnx::tract_core::ops::math::{Add, Div, Max, Mul, Sub, Tanh};
use tract_onnx::tract_core::ops::nn::Sigmoid;

use crate::error::ImportError;
use crate::network::Activation;
use crate::{Expected, text};

/// One step on a vector. All numbers are finite.
pub(crate) enum Step {
    /// Elementwise product.
    Scale(Vec<f64>),
    /// Elementwise sum.
    Shift(Vec<f64>),
    /// Product with a matrix.
    Dense(Matrix),
    Activate(Activation),
}

/// Row-major `[outputs][inputs]`.
pub(crate) struct Matrix {
    pub(crate) inputs: usize,
    pub(crate) outputs: usize,
    pub(crate) weights: Vec<f64>,
}

pub(crate) struct Link {
    /// The node that asked for the step, for messages.
    pub(crate) node: String,
    pub(crate) step: Step,
}

/// The steps from the graph's input to its output, of the expected widths.
pub(crate) fn read(model: &TypedModel, expected: &Expected) -> Result<Vec<Link>, ImportError> {
    let ([start], [end]) = (model.inputs.as_slice(), model.outputs.as_slice()) else {
        let found = format!("{} inputs and {} outputs", model.inputs.len(), model.outputs.len());
        return Err(ImportError::NotAChain { node: "graph".to_owned(), found });
    };
    let mut reader = Reader { model, at: *start, width: expected.inputs, links: Vec::new() };
    reader.check_width(*start, expected.inputs)?;
    while reader.at != *end {
        reader.advance()?;
    }
    if !model.node(end.node).outputs[end.slot].successors.is_empty() {
        return Err(not_a_chain(model.node(end.node), "the output is used further"));
    }
    if reader.width != expected.outputs {
        let node = text::name(&model.node(end.node).name);
        return Err(ImportError::OutputWidth { node, found: reader.width, expected: expected.outputs });
    }
    Ok(reader.links)
}

struct Reader<'m> {
    model: &'m TypedModel,
    at: OutletId,
    width: usize,
    links: Vec<Link>,
}

impl Reader<'_> {
    fn advance(&mut self) -> Result<(), ImportError> {
        let here = self.model.node(self.at.node);
        let next = match here.outputs[self.at.slot].successors.as_slice() {
            [] => return Err(not_a_chain(here, "its result is not used, and the output does not depend on the input")),
            [inlet] => self.single(*inlet)?,
            _ => {
                let (alpha, end) =
                    elu::find(self.model, self.at).ok_or_else(|| not_a_chain(here, "its result goes to several nodes"))?;
                self.push(end, Step::Activate(Activation::Elu { alpha }));
                end
            }
        };
        let node = self.model.node(next);
        if node.outputs.len() != 1 {
            return Err(not_a_chain(node, &format!("{} outputs", node.outputs.len())));
        }
        self.at = OutletId::new(next, 0);
        self.check_width(self.at, self.width)
    }

    /// Takes in the node at `inlet`, the only one that uses the value so far.
    fn single(&mut self, inlet: InletId) -> Result<usize, ImportError> {
        let node = self.model.node(inlet.node);
        let only_moves = node.op_is::<AxisOp>() || node.op_is::<IntoShape>() || node.op_is::<Identity>();
        if let Some(op) = node.op_as::<ElementWiseOp>() {
            let activation = activation(op).ok_or_else(|| not_a_chain(node, &format!("operator {}", op.0.name())))?;
            self.push(node.id, Step::Activate(activation));
        } else if let Some(op) = node.op_as::<TypedBinOp>() {
            self.binary(node, op, inlet.slot)?;
        } else if let Some(op) = node.op_as::<EinSum>() {
            let matrix = einsum::read(self.model, node, op, inlet.slot, self.width)?;
            self.width = matrix.outputs;
            self.push(node.id, Step::Dense(matrix));
        } else if !only_moves {
            return Err(not_a_chain(node, &format!("operator {}", node.op.name())));
        }
        Ok(node.id)
    }

    fn binary(&mut self, node: &TypedNode, op: &TypedBinOp, slot: usize) -> Result<(), ImportError> {
        let operand = constant(self.model, node, 1 - slot)?;
        let operand = match operand.len() {
            1 => vec![operand[0]; self.width],
            len if len == self.width => operand,
            len => return Err(not_a_chain(node, &format!("{len} constants for {} values", self.width))),
        };
        let negated = |values: Vec<f64>| values.into_iter().map(|v| -v).collect();
        if op.0.is::<Add>() {
            self.push(node.id, Step::Shift(operand));
        } else if op.0.is::<Mul>() {
            self.push(node.id, Step::Scale(operand));
        } else if op.0.is::<Sub>() && slot == 0 {
            self.push(node.id, Step::Shift(negated(operand)));
        } else if op.0.is::<Sub>() {
            self.push(node.id, Step::Scale(vec![-1.0; self.width]));
            self.push(node.id, Step::Shift(operand));
        } else if op.0.is::<Div>() && slot == 0 && !operand.contains(&0.0) {
            self.push(node.id, Step::Scale(operand.into_iter().map(|v| 1.0 / v).collect()));
        } else if op.0.is::<Max>() && operand.iter().all(|v| *v == 0.0) {
            self.push(node.id, Step::Activate(Activation::Relu));
        } else {
            return Err(not_a_chain(node, &format!("operator {} with these constants", op.0.name())));
        }
        Ok(())
    }

    fn push(&mut self, node: usize, step: Step) {
        self.links.push(Link { node: text::name(&self.model.node(node).name), step });
    }

    /// A value must be a float32 vector: several long axes would need an order that the chain does not keep, and a larger
    /// volume than before means that a constant spread the value out.
    fn check_width(&self, outlet: OutletId, width: usize) -> Result<(), ImportError> {
        let node = self.model.node(outlet.node);
        let fact = &node.outputs[outlet.slot].fact;
        let shape = fact.shape.as_concrete().unwrap_or_default();
        let long = shape.iter().filter(|d| **d != 1).count();
        if fact.datum_type == f32::datum_type() && long <= 1 && shape.iter().product::<usize>() == width {
            return Ok(());
        }
        Err(not_a_chain(node, &format!("result {fact:?} instead of {width} float32 values")))
    }
}

fn activation(op: &ElementWiseOp) -> Option<Activation> {
    if op.0.is::<Sigmoid>() {
        Some(Activation::Sigmoid)
    } else if op.0.is::<Tanh>() {
        Some(Activation::Tanh)
    } else {
        None
    }
}

/// The constant at input `slot` of `node`, in row-major order.
fn constant(model: &TypedModel, node: &TypedNode, slot: usize) -> Result<Vec<f64>, ImportError> {
    let numbers = tensor(model, node, slot).and_then(|t| t.to_plain_array_view::<f32>().ok().map(|v| v.iter().copied().collect()));
    let numbers: Vec<f32> = numbers.ok_or_else(|| not_a_chain(node, "both operands are computed"))?;
    match numbers.iter().position(|v| !v.is_finite()) {
        Some(index) => Err(ImportError::NotFinite { tensor: text::name(&node.name), index, value: f64::from(numbers[index]) }),
        None => Ok(numbers.into_iter().map(f64::from).collect()),
    }
}

fn tensor<'m>(model: &'m TypedModel, node: &TypedNode, slot: usize) -> Option<&'m Arc<Tensor>> {
    let outlet = *node.inputs.get(slot)?;
    model.node(outlet.node).outputs[outlet.slot].fact.konst.as_ref()
}

fn not_a_chain(node: &TypedNode, found: &str) -> ImportError {
    ImportError::NotAChain { node: text::name(&node.name), found: text::reason(found) }
}
