//! Turns the bytes of an ONNX file into plain dense layers, refusing everything doubtful.
//!
//! tract reads the graph, but alone it is no gate: it loads files with the wrong output width, a future operator set, NaN
//! weights or a negative variance, hides the NaN behind a clamped sigmoid, and panics on some graphs. So an import runs in four
//! steps, and each may only refuse:
//!
//! 1. the protobuf is bounded, decoded and checked (`wire`, `check`); a memory in front of the layers is read and cut off (`memory`);
//! 2. tract works out the graph, with panics caught (`tract`, `guard`), and its graph is read as one chain (`chain`);
//! 3. elementwise steps are folded into the layers in double precision (`fold`);
//! 4. the result is compared with tract's own runner of the same bytes (`agree`).
//!
//! This crate never touches the file system, never follows a path from a file, and allocates nothing from a number that the
//! file merely claims. It belongs to start-up: nothing here is fit for a real-time loop.

mod agree;
mod chain;
mod check;
mod error;
mod fold;
mod guard;
mod limits;
mod memory;
mod network;
mod oracle;
mod random;
mod text;
mod tract;
mod wire;

#[cfg(test)]
#[path = "../tests/common/mod.rs"]
mod common;

pub use error::ImportError;
pub use network::{Activation, Dense, InputScale, Network, Play};
pub use oracle::Oracle;
pub use random::Random;

/// The shape that the service's contract asks for: float32 `[1, inputs]` to `[1, outputs]`, a memory's own ports not counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Expected {
    /// Width of the input row (118 for ravenposed).
    pub inputs: usize,
    /// Width of the output row (3 for ravenposed).
    pub outputs: usize,
}

/// Imports the bytes of an ONNX file.
///
/// A batch dimension of 1 or a symbolic one is accepted. Every number of the result is finite.
///
/// # Errors
///
/// One [`ImportError`] variant per kind of refusal; its message is one line that does not name the file.
pub fn import(bytes: &[u8], expected: &Expected) -> Result<Network, ImportError> {
    let mut checked = check::check(bytes, expected)?;
    let metadata = std::mem::take(&mut checked.metadata);
    let memory::Cut { plays, friction } = std::mem::take(&mut checked.memory);
    let norms_input = !checked.input_norms.is_empty();
    let expected = checked.expected;
    guard::guarded(|| {
        let mut oracle = Oracle::load(&checked.proto, expected.inputs)?;
        let links = chain::read(&tract::declutter(checked, expected.inputs)?, &expected)?;
        let mut folded = fold::fold(links, expected.inputs, metadata)?;
        (folded.network.plays, folded.network.friction) = (plays, friction);
        if norms_input {
            // tract's runner writes the normalisation as `a * x + b`, though the imported network does not.
            folded.cancelling.fill(true);
        }
        agree::check(&folded, &mut oracle)?;
        Ok(folded.network)
    })
}
