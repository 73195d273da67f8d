//! A matrix product as tract writes it: `mk,nk->n`, `k,kn->mn` and so on, in any order of axes and operands.

use tract_onnx::prelude::*;
use tract_onnx::tract_core::internal::Axis;
use tract_onnx::tract_core::ops::einsum::EinSum;

use super::{Matrix, constant, not_a_chain, tensor};
use crate::error::ImportError;

/// Where a long axis of the weights leads.
#[derive(Clone, Copy, PartialEq)]
enum Role {
    /// Summed over, together with the value's only long axis.
    Input,
    /// Kept, as the result's only long axis.
    Output,
}

/// The matrix that the einsum at `node` applies to the value at input `slot` of `width` numbers.
pub(super) fn read(model: &TypedModel, node: &TypedNode, op: &EinSum, slot: usize, width: usize) -> Result<Matrix, ImportError> {
    let refuse = || not_a_chain(node, &format!("einsum {}", op.axes));
    if node.inputs.len() != 2 || op.q_params.is_some() || op.operating_dt != f32::datum_type() {
        return Err(refuse());
    }
    let shape = tensor(model, node, 1 - slot).ok_or_else(|| not_a_chain(node, "both operands are computed"))?.shape();
    let long = long_axes(op, slot, shape).ok_or_else(refuse)?;
    let flat = constant(model, node, 1 - slot)?;
    let outputs = flat.len() / width;
    let (transposed, fits) = match long.as_slice() {
        [] => (false, width == 1 && outputs == 1),
        [(Role::Input, n)] => (false, *n == width && outputs == 1),
        [(Role::Output, n)] => (false, width == 1 && *n == outputs),
        [(Role::Output, n), (Role::Input, k)] => (false, *k == width && *n == outputs),
        [(Role::Input, k), (Role::Output, n)] => (true, *k == width && *n == outputs),
        _ => return Err(refuse()),
    };
    if !fits || outputs == 0 {
        return Err(refuse());
    }
    let weights = if transposed { transpose(&flat, outputs) } else { flat };
    Ok(Matrix { inputs: width, outputs, weights })
}

/// The weights' axes longer than 1, in order, with their roles; none if an axis is repeated or plays another role.
fn long_axes(op: &EinSum, slot: usize, shape: &[usize]) -> Option<Vec<(Role, usize)>> {
    let mut long = Vec::new();
    for (position, size) in shape.iter().enumerate().filter(|(_, size)| **size != 1) {
        let axis = op.axes.iter_all_axes().find(|axis| axis.inputs[1 - slot].contains(&position))?;
        long.push((role(axis, slot)?, *size));
    }
    Some(long)
}

fn role(axis: &Axis, slot: usize) -> Option<Role> {
    match (axis.inputs[1 - slot].len(), axis.inputs[slot].len(), axis.outputs[0].len()) {
        (1, 1, 0) => Some(Role::Input),
        (1, 0, 1) => Some(Role::Output),
        // Kept on both sides (a batch of products), summed over the weights alone, or a diagonal.
        _ => None,
    }
}

/// `[k][n]` to `[n][k]`.
fn transpose(flat: &[f64], n: usize) -> Vec<f64> {
    (0..n).flat_map(|row| flat.iter().skip(row).step_by(n).copied()).collect()
}
