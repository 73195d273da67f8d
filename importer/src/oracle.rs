//! tract's own runner of the same bytes.

use tract_onnx::pb::ModelProto;
use tract_onnx::prelude::*;

use crate::error::ImportError;
use crate::tract::{load, refused};
use crate::{Expected, check, guard, import};

/// tract's optimised runner with one kept state: the second opinion on an import, and the rival in benchmarks.
///
/// It allocates on every run (about 50 times), so it is no engine for a real-time loop. It also hides NaN: a NaN among the
/// inputs can come out as a finite, plausible number.
pub struct Oracle {
    state: TypedSimpleState,
    inputs: usize,
}

impl Oracle {
    /// Loads the model that [`import`] accepts from the same bytes; a memory in front of the layers is left to the caller.
    ///
    /// # Errors
    ///
    /// Whatever [`import`] refuses is refused here too: tract alone would accept several unsuitable files.
    pub fn new(bytes: &[u8], expected: &Expected) -> Result<Self, ImportError> {
        drop(import(bytes, expected)?);
        let checked = check::check(bytes, expected)?;
        guard::guarded(|| Self::load(&checked.proto, checked.expected.inputs))
    }

    /// Loads a checked model; the caller guards against tract's panics.
    pub(crate) fn load(proto: &ModelProto, inputs: usize) -> Result<Self, ImportError> {
        let stage = refused("optimise the graph");
        let plan = load(proto, inputs)?.into_optimized().and_then(TypedModel::into_runnable).map_err(&stage)?;
        Ok(Self { state: plan.spawn().map_err(&stage)?, inputs })
    }

    /// Evaluates one input row in float32: `Expected::inputs` numbers, and one per play of a memory.
    ///
    /// # Errors
    ///
    /// [`ImportError::InputLength`] for another number of inputs, [`ImportError::Tract`] if tract fails.
    pub fn run(&mut self, input: &[f32]) -> Result<Vec<f32>, ImportError> {
        if input.len() != self.inputs {
            return Err(ImportError::InputLength { found: input.len(), expected: self.inputs });
        }
        self.run_tract(input).map_err(refused("run the network"))
    }

    fn run_tract(&mut self, input: &[f32]) -> TractResult<Vec<f32>> {
        let row = Tensor::from_shape(&[1, self.inputs], input)?;
        let outputs = self.state.run(tvec!(row.into()))?;
        Ok(outputs[0].to_plain_array_view::<f32>()?.iter().copied().collect())
    }
}

impl std::fmt::Debug for Oracle {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Oracle").field("inputs", &self.inputs).finish_non_exhaustive()
    }
}
