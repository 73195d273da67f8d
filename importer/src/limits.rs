//! Bounds on what a file may ask for. They are far above any network that a 1 kHz loop can evaluate, and low enough that the
//! worst accepted file needs well under 1 GiB while it is imported.

/// Bytes of the file: the weights below as float32, and 16 MiB for everything else.
pub(crate) const FILE_BYTES_MAX: usize = 80 << 20;
/// Stored numbers in all tensors: 64 MiB as float32, which would take 64 GB/s of memory traffic at 1 kHz.
pub(crate) const WEIGHTS_MAX: usize = 16 << 20;
/// Nodes of the graph (the reference networks have about ten).
pub(crate) const NODES_MAX: usize = 1000;
/// Dimensions of one tensor.
pub(crate) const RANK_MAX: usize = 8;
/// Protobuf fields in the file. Once decoded a field takes at most 1432 bytes (an empty attribute), so 143 MB in all.
pub(crate) const PARTS_MAX: usize = 100_000;
/// Messages inside messages.
pub(crate) const DEPTH_MAX: usize = 16;
/// Numbers in a shape or axes constant.
pub(crate) const SHAPE_NUMBERS_MAX: usize = RANK_MAX;
/// Plays of a memory.
pub(crate) const PLAYS_MAX: usize = 64;
/// Numbers of friction beside it: one per motor would be eight.
pub(crate) const FRICTION_MAX: i64 = 8;
/// Operator sets. tract states that it is tested with 9 to 18 and reads later ones by the same rules; the tests here read the
/// operators of dense networks in each version up to 22, and none beyond.
pub(crate) const OPSETS: std::ops::RangeInclusive<i64> = 9..=22;
