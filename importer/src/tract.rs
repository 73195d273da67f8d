//! Everything asked of tract: from the checked protobuf to a typed graph.

use tract_onnx::pb::{ModelProto, NodeProto, TensorProto, tensor_proto::DataType};
use tract_onnx::prelude::*;

use crate::check::Checked;
use crate::error::ImportError;
use crate::text;

pub(crate) fn refused(stage: &'static str) -> impl Fn(TractError) -> ImportError {
    // `{:#}` gives the chain of causes in one line, and no stack trace.
    move |error| ImportError::Tract { stage, reason: text::reason(&format!("{error:#}")) }
}

/// The graph with its input fixed to float32 `[1, inputs]`.
pub(crate) fn load(proto: &ModelProto, inputs: usize) -> Result<InferenceModel, ImportError> {
    tract_onnx::onnx()
        // Declared shapes of inner values add nothing to the weights' own shapes, and would be parsed as expressions.
        .with_ignore_value_info(true)
        .model_for_proto_model(proto)
        .map_err(refused("read the graph"))?
        .with_input_fact(0, f32::fact([1, inputs]).into())
        .map_err(refused("fix the input shape"))
}

/// The state to read weights from: constants folded, nothing packed yet.
pub(crate) fn declutter(checked: Checked, inputs: usize) -> Result<TypedModel, ImportError> {
    let mut proto = checked.proto;
    centre_input_norms(&mut proto, &checked.input_norms, inputs);
    load(&proto, inputs)?.into_typed().and_then(TypedModel::into_decluttered).map_err(refused("work out types and shapes"))
}

/// Puts a subtraction of the mean before each batch normalisation of the network's own input, and a mean of zero into it.
///
/// tract turns a batch normalisation into `slope * x + intercept` in float32. On raw features, whose mean can be 1e7 times
/// their deviation, the intercept's rounding alone would be half a deviation. Centring first keeps the mean exact.
fn centre_input_norms(proto: &mut ModelProto, norms: &[usize], inputs: usize) {
    let Some(graph) = proto.graph.as_mut() else { return };
    for (count, index) in norms.iter().enumerate() {
        let norm = &mut graph.node[index + count];
        // Names with a space and the node's own output in them: unique, because that output is.
        let centred = format!("{} centred", norm.output[0]);
        let zero = format!("{} zero mean", norm.output[0]);
        let mean = std::mem::replace(&mut norm.input[3], zero.clone());
        let input = std::mem::replace(&mut norm.input[0], centred.clone());
        graph.initializer.push(TensorProto {
            name: zero,
            dims: vec![inputs as i64],
            data_type: DataType::Float as i32,
            float_data: vec![0.0; inputs],
            ..TensorProto::default()
        });
        let sub = NodeProto {
            name: centred.clone(),
            op_type: "Sub".to_owned(),
            input: vec![input, mean],
            output: vec![centred],
            ..NodeProto::default()
        };
        graph.node.insert(index + count, sub);
    }
}
