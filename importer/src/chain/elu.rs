//! Elu, which tract spells out: `iff(0 < x, x, alpha * (exp(x) - 1))`, without the product when alpha is 1.

use tract_onnx::prelude::*;
use tract_onnx::tract_core::ops::binary::{BinMiniOp, TypedBinOp};
use tract_onnx::tract_core::ops::element_wise::ElementWiseOp;
use tract_onnx::tract_core::ops::logic::{CompLT, Iff};
use tract_onnx::tract_core::ops::math::{Exp, Mul, Sub};

use super::tensor;

/// Alpha and the last node of the Elu that starts from `x`, if exactly that uses `x`.
pub(super) fn find(model: &TypedModel, x: OutletId) -> Option<(f32, usize)> {
    let users = &model.node(x.node).outputs[x.slot].successors;
    let user = |wanted: fn(&TypedNode) -> bool| users.iter().map(|i| model.node(i.node)).find(|n| wanted(n));
    let iff = user(TypedNode::op_is::<Iff>)?;
    let test = user(is_binary::<CompLT>)?;
    let exp = user(|n| n.op_as::<ElementWiseOp>().is_some_and(|op| op.0.is::<Exp>()))?;
    let less_one = only_user(model, exp)?;
    let is_less_one = is_binary::<Sub>(less_one) && less_one.inputs[0] == exp.id.into() && scalar(model, less_one, 1) == Some(1.0);
    let (alpha, negative) = scaled(model, less_one)?;
    let shape_is_elu = users.len() == 3
        && is_less_one
        && test.inputs[1] == x
        && scalar(model, test, 0) == Some(0.0)
        && only_user(model, test)?.id == iff.id
        && only_user(model, negative)?.id == iff.id
        && iff.inputs.as_slice() == [test.id.into(), x, negative.id.into()];
    shape_is_elu.then_some((alpha, iff.id))
}

/// The product with alpha after `less_one`, or `less_one` itself when alpha is 1.
fn scaled<'m>(model: &'m TypedModel, less_one: &'m TypedNode) -> Option<(f32, &'m TypedNode)> {
    let next = only_user(model, less_one)?;
    if !is_binary::<Mul>(next) {
        return Some((1.0, less_one));
    }
    let slot = usize::from(next.inputs[0] == less_one.id.into());
    Some((scalar(model, next, slot)?, next))
}

fn is_binary<O: BinMiniOp>(node: &TypedNode) -> bool {
    node.op_as::<TypedBinOp>().is_some_and(|op| op.0.is::<O>())
}

fn only_user<'m>(model: &'m TypedModel, node: &TypedNode) -> Option<&'m TypedNode> {
    match node.outputs.as_slice() {
        [output] if output.successors.len() == 1 => Some(model.node(output.successors[0].node)),
        _ => None,
    }
}

/// The constant at `slot`, if it is one finite number.
fn scalar(model: &TypedModel, node: &TypedNode, slot: usize) -> Option<f32> {
    let numbers = tensor(model, node, slot)?.to_plain_array_view::<f32>().ok()?;
    let mut numbers = numbers.iter().copied();
    let first = numbers.next().filter(|v| v.is_finite())?;
    numbers.next().is_none().then_some(first)
}
