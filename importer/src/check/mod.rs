//! Checks the protobuf before tract sees it: tract hides NaN behind its clamped sigmoid, overrides declared shapes, ignores
//! operator domains, and loads several unsuitable files without complaint.

mod nodes;
mod operators;
mod signature;
mod tensor;

use std::collections::BTreeMap;

use prost::Message;
use tract_onnx::pb::{GraphProto, ModelProto};

use crate::error::ImportError;
use crate::{Expected, limits, memory, text, wire};

/// A model that holds only known operators, complete finite tensors and one float32 input and output of the expected widths.
pub(crate) struct Checked {
    pub(crate) proto: ModelProto,
    pub(crate) metadata: BTreeMap<String, String>,
    /// The memory that stood in front of what `proto` still has.
    pub(crate) memory: memory::Cut,
    /// Widths of what `proto` still has: a memory's places and the friction are inputs.
    pub(crate) expected: Expected,
    /// Indices of batch normalisations that take the network's own input.
    pub(crate) input_norms: Vec<usize>,
}

pub(crate) fn check(bytes: &[u8], expected: &Expected) -> Result<Checked, ImportError> {
    let mut proto = decode(bytes)?;
    sections(&proto)?;
    opset(&proto)?;
    let metadata = metadata(&proto)?;
    let graph = proto.graph.as_mut().ok_or(ImportError::NoGraph)?;
    counts(graph)?;
    let memory = memory::cut(graph, expected.inputs)?;
    let expected = Expected { inputs: expected.inputs + memory.width(), ..*expected };
    let input = signature::check(graph, &expected)?;
    let input_norms = nodes::check(graph, input)?;
    Ok(Checked { proto, metadata, memory, expected, input_norms })
}

fn decode(bytes: &[u8]) -> Result<ModelProto, ImportError> {
    if bytes.is_empty() {
        return Err(ImportError::Empty);
    }
    limit("bytes", bytes.len(), limits::FILE_BYTES_MAX)?;
    wire::scan(bytes)?;
    ModelProto::decode(bytes).map_err(|e| ImportError::NotProtobuf { reason: text::reason(&e.to_string()) })
}

fn limit(what: &'static str, found: usize, limit: usize) -> Result<(), ImportError> {
    if found > limit { Err(ImportError::Limit { what, found, limit }) } else { Ok(()) }
}

fn sections(proto: &ModelProto) -> Result<(), ImportError> {
    let graph = proto.graph.as_ref().ok_or(ImportError::NoGraph)?;
    let present = [
        (!proto.training_info.is_empty(), "training information"),
        (!proto.functions.is_empty(), "model-local functions"),
        (!graph.sparse_initializer.is_empty(), "sparse initializers"),
        (!graph.quantization_annotation.is_empty(), "quantization annotations"),
    ];
    match present.iter().find(|(present, _)| *present) {
        Some((_, section)) => Err(ImportError::Section { section }),
        None => Ok(()),
    }
}

/// The empty domain and its long name are the same.
fn is_default_domain(domain: &str) -> bool {
    domain.is_empty() || domain == "ai.onnx"
}

/// A foreign domain may be imported as long as no node uses it: exporters list them by habit.
fn opset(proto: &ModelProto) -> Result<(), ImportError> {
    let versions: Vec<i64> = proto.opset_import.iter().filter(|o| is_default_domain(&o.domain)).map(|o| o.version).collect();
    let refuse = |found: String| Err(ImportError::Opset { found });
    match versions.as_slice() {
        [version] if limits::OPSETS.contains(version) => Ok(()),
        [version] => refuse(version.to_string()),
        [] => refuse("is not stated".to_owned()),
        _ => refuse("is stated more than once".to_owned()),
    }
}

fn metadata(proto: &ModelProto) -> Result<BTreeMap<String, String>, ImportError> {
    let mut map = BTreeMap::new();
    for entry in &proto.metadata_props {
        if map.insert(entry.key.clone(), entry.value.clone()).is_some() {
            return Err(ImportError::DuplicateMetadata { key: text::name(&entry.key) });
        }
    }
    Ok(map)
}

fn counts(graph: &GraphProto) -> Result<(), ImportError> {
    limit("nodes", graph.node.len(), limits::NODES_MAX)?;
    limit("tensors", graph.initializer.len(), limits::NODES_MAX * 5)
}
