//! The graph's declared input and output. tract overrides the declared input shape with the one it is given and never reads the
//! declared output shape, so both are checked here.

use std::collections::BTreeSet;

use tract_onnx::pb::tensor_proto::DataType;
use tract_onnx::pb::tensor_shape_proto::{Dimension, dimension::Value as Dim};
use tract_onnx::pb::{GraphProto, TensorShapeProto, ValueInfoProto, type_proto};

use crate::error::ImportError;
use crate::{Expected, text};

/// Characters of a symbolic batch dimension: tract parses it as an expression, and a parser is not for hostile text.
const SYMBOL_CHARS_MAX: usize = 64;

/// Checks input and output against `expected`; gives the input's name.
pub(super) fn check<'a>(graph: &'a GraphProto, expected: &Expected) -> Result<&'a str, ImportError> {
    let stored: BTreeSet<&str> = graph.initializer.iter().map(|t| t.name.as_str()).collect();
    // Up to IR version 3 the weights are listed among the inputs too.
    let inputs: Vec<&ValueInfoProto> = graph.input.iter().filter(|i| !stored.contains(i.name.as_str())).collect();
    let names = |infos: &[&ValueInfoProto]| text::names(infos.iter().map(|i| i.name.as_str()));
    let [input] = inputs.as_slice() else {
        return Err(ImportError::InputCount { found: inputs.len(), names: names(&inputs) });
    };
    let outputs: Vec<&ValueInfoProto> = graph.output.iter().collect();
    let [output] = outputs.as_slice() else {
        return Err(ImportError::OutputCount { found: outputs.len(), names: names(&outputs) });
    };
    Port { role: "input", info: input, width: expected.inputs }.check_input()?;
    Port { role: "output", info: output, width: expected.outputs }.check_output()?;
    Ok(&input.name)
}

struct Port<'a> {
    role: &'static str,
    info: &'a ValueInfoProto,
    width: usize,
}

impl Port<'_> {
    fn check_input(&self) -> Result<(), ImportError> {
        match self.shape()? {
            Some(shape) => self.check_shape(shape, false),
            None => Err(self.refuse("unknown".to_owned(), "export with a declared input shape")),
        }
    }

    fn check_output(&self) -> Result<(), ImportError> {
        self.shape()?.map_or(Ok(()), |shape| self.check_shape(shape, true))
    }

    fn shape(&self) -> Result<Option<&TensorShapeProto>, ImportError> {
        let wrong_type = |found: String| ImportError::SignatureType { role: self.role, name: text::name(&self.info.name), found };
        let declared = self.info.r#type.as_ref().and_then(|t| t.value.as_ref());
        let Some(type_proto::Value::TensorType(tensor)) = declared else {
            return Err(wrong_type("no tensor of a declared type".to_owned()));
        };
        match DataType::try_from(tensor.elem_type) {
            Ok(DataType::Float) => Ok(tensor.shape.as_ref()),
            Ok(other) => Err(wrong_type(other.as_str_name().to_owned())),
            Err(_) => Err(wrong_type(format!("type number {}", tensor.elem_type))),
        }
    }

    fn check_shape(&self, shape: &TensorShapeProto, width_may_be_open: bool) -> Result<(), ImportError> {
        let refuse = |remedy| Err(self.refuse(describe(shape), remedy));
        let [batch, width] = shape.dim.as_slice() else {
            return refuse("export with a batch dimension and one row of features");
        };
        if !is_open(batch) && fixed(batch) != Some(1) {
            return refuse("fix the batch dimension to 1 or leave it symbolic");
        }
        if fixed(width) == i64::try_from(self.width).ok() || (width_may_be_open && is_open(width)) {
            return Ok(());
        }
        refuse("train and export for this number of features")
    }

    fn refuse(&self, found: String, remedy: &'static str) -> ImportError {
        ImportError::SignatureShape { role: self.role, name: text::name(&self.info.name), found, width: self.width, remedy }
    }
}

fn fixed(dim: &Dimension) -> Option<i64> {
    match &dim.value {
        Some(Dim::DimValue(value)) => Some(*value),
        _ => None,
    }
}

fn is_open(dim: &Dimension) -> bool {
    match &dim.value {
        None => true,
        Some(Dim::DimValue(_)) => false,
        Some(Dim::DimParam(symbol)) => {
            symbol.len() <= SYMBOL_CHARS_MAX && symbol.chars().all(|c| c.is_ascii_alphanumeric() || "_.-:?".contains(c))
        }
    }
}

fn describe(shape: &TensorShapeProto) -> String {
    let shown = shape.dim.iter().take(crate::limits::RANK_MAX).map(|dim| match &dim.value {
        None => "?".to_owned(),
        Some(Dim::DimValue(value)) => value.to_string(),
        Some(Dim::DimParam(symbol)) => text::name(symbol),
    });
    format!("[{}]", shown.collect::<Vec<_>>().join(", "))
}
