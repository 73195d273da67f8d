//! Stored numbers: their type, dimensions, completeness and finiteness. Nothing is allocated from the dimensions.

use tract_onnx::pb::TensorProto;
use tract_onnx::pb::tensor_proto::{DataLocation, DataType};

use crate::error::ImportError;
use crate::{limits, text};

/// Where the float32 numbers of a constant stand.
#[derive(Clone, Copy)]
pub(super) enum Floats<'a> {
    Raw(&'a [u8]),
    List(&'a [f32]),
}

impl Floats<'_> {
    pub(super) fn iter(&self) -> Box<dyn Iterator<Item = f32> + '_> {
        match self {
            // ONNX stores little-endian on every machine.
            Self::Raw(bytes) => Box::new(bytes.as_chunks().0.iter().map(|four| f32::from_le_bytes(*four))),
            Self::List(list) => Box::new(list.iter().copied()),
        }
    }

    pub(super) fn check_finite(self, name: &str) -> Result<Self, ImportError> {
        match self.iter().enumerate().find(|(_, value)| !value.is_finite()) {
            Some((index, value)) => Err(ImportError::NotFinite { tensor: text::name(name), index, value: f64::from(value) }),
            None => Ok(self),
        }
    }
}

/// A checked constant.
#[derive(Clone, Copy)]
pub(super) enum Constant<'a> {
    Floats(Floats<'a>),
    /// A few integers, good only as a shape or as axes.
    Integers,
}

/// Checks `tensor` (called `name` in messages) and takes its numbers off `budget`.
pub(super) fn check<'a>(tensor: &'a TensorProto, name: &str, budget: &mut usize) -> Result<Constant<'a>, ImportError> {
    if tensor.data_location == Some(DataLocation::External as i32) || !tensor.external_data.is_empty() {
        return Err(ImportError::ExternalData { tensor: text::name(name) });
    }
    if tensor.segment.is_some() {
        return Err(ImportError::Section { section: "tensor segments" });
    }
    let data_type = known_type(tensor, name)?;
    let count = count(tensor, name)?;
    *budget = budget.checked_sub(count).ok_or(ImportError::Limit {
        what: "or more numbers in all tensors",
        found: limits::WEIGHTS_MAX + 1,
        limit: limits::WEIGHTS_MAX,
    })?;
    check_length(tensor, name, data_type, count)?;
    if data_type == DataType::Float {
        let raw = !tensor.raw_data.is_empty();
        let floats = if raw { Floats::Raw(&tensor.raw_data) } else { Floats::List(&tensor.float_data) };
        return floats.check_finite(name).map(Constant::Floats);
    }
    check_integers(tensor, name, data_type, count)
}

fn known_type(tensor: &TensorProto, name: &str) -> Result<DataType, ImportError> {
    let refuse = |found: String| Err(ImportError::TensorType { tensor: text::name(name), found });
    match DataType::try_from(tensor.data_type) {
        Ok(known @ (DataType::Float | DataType::Int32 | DataType::Int64)) => Ok(known),
        Ok(other) => refuse(other.as_str_name().to_owned()),
        Err(_) => refuse(format!("of type number {}", tensor.data_type)),
    }
}

fn count(tensor: &TensorProto, name: &str) -> Result<usize, ImportError> {
    let mut sizes = tensor.dims.iter().map(|d| usize::try_from(*d).ok().filter(|d| *d > 0));
    let product = sizes.try_fold(1usize, |product, size| product.checked_mul(size?));
    product
        .filter(|p| *p <= limits::WEIGHTS_MAX && tensor.dims.len() <= limits::RANK_MAX)
        .ok_or_else(|| ImportError::TensorDimensions { tensor: text::name(name), found: dimensions(tensor) })
}

fn dimensions(tensor: &TensorProto) -> String {
    let shown: Vec<String> = tensor.dims.iter().take(limits::RANK_MAX).map(ToString::to_string).collect();
    let rest = if tensor.dims.len() > limits::RANK_MAX { ", ..." } else { "" };
    format!("[{}{rest}]", shown.join(", "))
}

/// The numbers stand in exactly one of the places that ONNX offers.
fn check_length(tensor: &TensorProto, name: &str, data_type: DataType, expected: usize) -> Result<(), ImportError> {
    let refuse = |found: String| {
        Err(ImportError::TensorLength { tensor: text::name(name), found, expected, dimensions: dimensions(tensor) })
    };
    let lists = [tensor.float_data.len(), tensor.int32_data.len(), tensor.int64_data.len()];
    let foreign = tensor.string_data.len() + tensor.double_data.len() + tensor.uint64_data.len();
    let (size, own) = match data_type {
        DataType::Float => (4, lists[0]),
        DataType::Int32 => (4, lists[1]),
        _ => (8, lists[2]),
    };
    if foreign + lists.iter().sum::<usize>() - own > 0 || (own > 0 && !tensor.raw_data.is_empty()) {
        return refuse("its data in more than one place".to_owned());
    }
    let raw = tensor.raw_data.len();
    if raw > 0 {
        return if raw == expected * size { Ok(()) } else { refuse(format!("{raw} bytes of raw data")) };
    }
    if own == expected { Ok(()) } else { refuse(format!("{own} numbers")) }
}

/// Integers may only name a shape, so there are few and they are small.
fn check_integers<'a>(tensor: &TensorProto, name: &str, data_type: DataType, count: usize) -> Result<Constant<'a>, ImportError> {
    if count > limits::SHAPE_NUMBERS_MAX {
        return Err(ImportError::TensorType { tensor: text::name(name), found: data_type.as_str_name().to_owned() });
    }
    let values: Vec<i64> = match data_type {
        DataType::Int32 if tensor.raw_data.is_empty() => tensor.int32_data.iter().map(|v| i64::from(*v)).collect(),
        DataType::Int32 => tensor.raw_data.as_chunks().0.iter().map(|b| i64::from(i32::from_le_bytes(*b))).collect(),
        _ if tensor.raw_data.is_empty() => tensor.int64_data.clone(),
        _ => tensor.raw_data.as_chunks().0.iter().map(|b| i64::from_le_bytes(*b)).collect(),
    };
    check_shape_numbers(&values, name)
}

/// Shape numbers: at most eight, none larger than any tensor may be.
pub(super) fn check_shape_numbers<'a>(values: &[i64], name: &str) -> Result<Constant<'a>, ImportError> {
    let small = |v: &i64| v.unsigned_abs() <= limits::WEIGHTS_MAX as u64;
    if values.len() <= limits::SHAPE_NUMBERS_MAX && values.iter().all(small) {
        return Ok(Constant::Integers);
    }
    let shown: Vec<String> = values.iter().take(limits::SHAPE_NUMBERS_MAX).map(ToString::to_string).collect();
    Err(ImportError::TensorDimensions { tensor: text::name(name), found: format!("[{}]", shown.join(", ")) })
}
