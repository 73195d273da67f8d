//! Why a file was refused. Each message is one line without the file's name, which the caller knows.

use thiserror::Error;

/// A refusal. Names from the file are escaped and cut, so that a message is always one printable line.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ImportError {
    /// The file has no bytes.
    #[error("the file is empty: expected an ONNX model")]
    Empty,
    /// A bound of the importer is exceeded.
    #[error("{found} {what}: expected at most {limit}")]
    Limit {
        /// What was counted.
        what: &'static str,
        /// How many there are (or at least are).
        found: usize,
        /// How many are accepted.
        limit: usize,
    },
    /// The bytes are no (complete) protobuf message.
    #[error("not an ONNX file, or cut off: {reason}")]
    NotProtobuf {
        /// What the decoder met.
        reason: String,
    },
    /// The model has no graph.
    #[error("the model has no graph: expected an ONNX model of a network")]
    NoGraph,
    /// The version of the standard operators is absent, doubled or out of range.
    #[error("opset {found}: expected one version from 9 to 22 of the default domain; export with opset 9 to 22")]
    Opset {
        /// The version, or why there is none.
        found: String,
    },
    /// A node is of an operator domain other than the default one.
    #[error("node `{node}`: operator `{operator}` of domain `{domain}`: expected standard operators only")]
    Domain {
        /// The node.
        node: String,
        /// Its operator.
        operator: String,
        /// The operator's domain.
        domain: String,
    },
    /// A section that an inference network has no use for.
    #[error("the model has {section}: expected a plain inference graph; export without {section}")]
    Section {
        /// Its name in ONNX.
        section: &'static str,
    },
    /// Not exactly one input.
    #[error("{found} graph inputs ({names}): expected exactly one")]
    InputCount {
        /// How many inputs are no initialisers.
        found: usize,
        /// The first of their names.
        names: String,
    },
    /// Not exactly one output.
    #[error("{found} graph outputs ({names}): expected exactly one")]
    OutputCount {
        /// How many outputs.
        found: usize,
        /// The first of their names.
        names: String,
    },
    /// A graph input or output is not float32.
    #[error("graph {role} `{name}` is {found}: expected float32; export the model with float32 {role}s")]
    SignatureType {
        /// `input` or `output`.
        role: &'static str,
        /// Its name.
        name: String,
        /// Its declared type.
        found: String,
    },
    /// A graph input or output has another shape than the service's.
    #[error("graph {role} `{name}` has shape {found}: expected [1, {width}]; {remedy}")]
    SignatureShape {
        /// `input` or `output`.
        role: &'static str,
        /// Its name.
        name: String,
        /// Its declared shape.
        found: String,
        /// The expected last dimension.
        width: usize,
        /// What to change.
        remedy: &'static str,
    },
    /// A memory in front of the layers that is not of the one form that is understood.
    #[error("the memory in front of the layers: {found}: expected the eight nodes that `ravenpose train` writes (docs/models.md)")]
    Memory {
        /// What is different.
        found: String,
    },
    /// A tensor of a type other than float32 (or of integers for a shape).
    #[error("tensor `{tensor}` is {found}: expected float32; export the model with float32 weights")]
    TensorType {
        /// The tensor.
        tensor: String,
        /// Its type.
        found: String,
    },
    /// Impossible dimensions.
    #[error("tensor `{tensor}` has dimensions {found}: expected at most 8 positive dimensions of at most 16777216 numbers in all")]
    TensorDimensions {
        /// The tensor.
        tensor: String,
        /// Its dimensions.
        found: String,
    },
    /// The stored numbers do not fill the dimensions.
    #[error("tensor `{tensor}` stores {found}: expected {expected} numbers for dimensions {dimensions}")]
    TensorLength {
        /// The tensor.
        tensor: String,
        /// How much is stored.
        found: String,
        /// How many numbers the dimensions ask for.
        expected: usize,
        /// The dimensions.
        dimensions: String,
    },
    /// The numbers are in another file.
    #[error("tensor `{tensor}` keeps external data: expected all weights inside the file; save the model without external data")]
    ExternalData {
        /// The tensor.
        tensor: String,
    },
    /// A stored number, or one computed from the stored ones, is NaN or infinite.
    #[error("`{tensor}`, number {index}, is {value}: expected a finite float32")]
    NotFinite {
        /// The tensor, attribute or folded layer.
        tensor: String,
        /// Index of the number in row-major order.
        index: usize,
        /// The number.
        value: f64,
    },
    /// A batch normalisation has no positive variance.
    #[error("node `{node}`: variance `{tensor}`, number {index}, is {value}: expected more than 0")]
    Variance {
        /// The node.
        node: String,
        /// The variance tensor.
        tensor: String,
        /// Index of the number.
        index: usize,
        /// The number.
        value: f32,
    },
    /// An integer tensor outside a shape, or a shape that is no integer constant.
    #[error("node `{node}`: input `{input}` is {found}: expected {expected}")]
    Operand {
        /// The node.
        node: String,
        /// The input.
        input: String,
        /// What it is.
        found: &'static str,
        /// What is accepted there.
        expected: &'static str,
    },
    /// An operator that a dense network does not need.
    #[error(
        "node `{node}`: operator `{operator}` is not supported: expected only the operators of a dense network (Gemm, MatMul, Add, BatchNormalization, Sigmoid, Tanh, Relu, Elu, ...)"
    )]
    Operator {
        /// The node.
        node: String,
        /// Its operator.
        operator: String,
    },
    /// A node holds a graph of its own.
    #[error("node `{node}`: attribute `{attribute}` of operator `{operator}` is a subgraph: expected no control flow")]
    Subgraph {
        /// The node.
        node: String,
        /// Its operator.
        operator: String,
        /// The attribute.
        attribute: String,
    },
    /// An unknown attribute or an unsupported value of a known one.
    #[error("node `{node}`: attribute `{attribute}` is {found}: expected {expected}")]
    Attribute {
        /// The node.
        node: String,
        /// The attribute.
        attribute: String,
        /// Its value.
        found: String,
        /// What is accepted.
        expected: &'static str,
    },
    /// A wrong number of inputs or outputs of a node.
    #[error("node `{node}` ({operator}) has {found} {role}: expected {expected}")]
    Arity {
        /// The node.
        node: String,
        /// Its operator.
        operator: String,
        /// `inputs` or `outputs`.
        role: &'static str,
        /// How many.
        found: usize,
        /// How many are accepted.
        expected: String,
    },
    /// A node's input exists nowhere.
    #[error("node `{node}`: input `{input}` is missing: expected an initializer, the graph input or a node's output of that name")]
    Missing {
        /// The node.
        node: String,
        /// The input.
        input: String,
    },
    /// A node uses a value that is produced later.
    #[error(
        "node `{node}`: input `{input}` is produced only by a later node (cycle, or unsorted graph): expected nodes in order of use"
    )]
    Cycle {
        /// The node.
        node: String,
        /// The input.
        input: String,
    },
    /// Two tensors of one name.
    #[error("the name `{name}` is defined twice: expected each tensor to be defined once")]
    DuplicateName {
        /// The name.
        name: String,
    },
    /// No node makes the graph's output.
    #[error("graph output `{output}` is not produced by any node: expected the result of the last layer")]
    OutputNotProduced {
        /// The output.
        output: String,
    },
    /// A node's result goes nowhere.
    #[error("node `{node}`: output `{output}` is never used: expected every node to lead to the graph output")]
    Unused {
        /// The node.
        node: String,
        /// Its output.
        output: String,
    },
    /// Arithmetic on constants alone: folding it could allocate without bound (a column times a row).
    #[error("node `{node}` ({operator}) computes a constant: expected the file to hold its result; export with constant folding")]
    ComputedConstant {
        /// The node.
        node: String,
        /// Its operator.
        operator: String,
    },
    /// A metadata key occurs twice.
    #[error("metadata key `{key}` occurs twice: expected each key once")]
    DuplicateMetadata {
        /// The key.
        key: String,
    },
    /// tract refused the graph (among others: layers whose widths do not fit).
    #[error("tract could not {stage}: {reason}; check that each layer's input width is the previous layer's output width")]
    Tract {
        /// What tract was asked for.
        stage: &'static str,
        /// Its message.
        reason: String,
    },
    /// tract panicked; the panic was caught.
    #[error("tract panicked on this graph: {reason}")]
    Panicked {
        /// The panic's message.
        reason: String,
    },
    /// The graph is no chain of dense layers.
    #[error("node `{node}`: {found}: expected one chain of dense layers, elementwise constants and activations")]
    NotAChain {
        /// The node (as tract names it).
        node: String,
        /// What stands there.
        found: String,
    },
    /// The network's real output has another width than expected.
    #[error("the network ends at `{node}` with {found} outputs: expected {expected}")]
    OutputWidth {
        /// The last node.
        node: String,
        /// Its width.
        found: usize,
        /// The expected width.
        expected: usize,
    },
    /// The imported layers and tract's own runner disagree.
    #[error("output {index} is {imported} in the imported layers and {tract} in tract: expected agreement within {tolerance:e}")]
    Disagreement {
        /// Index of the output.
        index: usize,
        /// What the imported layers gave.
        imported: f64,
        /// What tract gave.
        tract: f64,
        /// The accepted distance.
        tolerance: f64,
    },
    /// An input vector of the wrong length was given to the oracle.
    #[error("{found} inputs: expected {expected}")]
    InputLength {
        /// How many numbers were given.
        found: usize,
        /// How many the network takes.
        expected: usize,
    },
}
