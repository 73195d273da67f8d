//! Parquet: full states ([`StateWriter`], [`StateReader`]) and tables ([`TableWriter`], [`TableReader`]), zstd, row groups of
//! at most 32,768 rows, so that an hour at 1 kHz passes in bounded memory.
//!
//! Of a state every field is there, each number in a column of its own with its unit in the name (`mpos_gold_1_deg`,
//! `jpos_gold_3_m_x57`: joint 3 as published, metres × 57.29578) as INT32, INT64 or FLOAT, bit for bit; beside it
//! `truth_ARM_...` columns (DOUBLE, null where unknown). A truth stands in the row of the state before it; a second truth of
//! an arm before the next state gets a row without a state. Between two states gold's truth is read before green's.
//!
//! Each row group has a CRC-32 in the file's metadata (`ravenpose.crc32`), checked before it is decoded. A cut Parquet file
//! has lost its table of contents, which stands at the end: it is refused.

mod read;
mod state_columns;
mod state_reader;
mod state_writer;
mod store;
mod table_reader;
mod table_writer;
mod write;

pub use state_reader::StateReader;
pub use state_writer::StateWriter;
pub use table_reader::TableReader;
pub use table_writer::TableWriter;

/// Rows of a row group at most.
pub const ROW_GROUP_ROWS: usize = 1 << 15;

/// First and last bytes of a Parquet file.
pub const MAGIC: [u8; 4] = *b"PAR1";

/// What a state or truth loses in this format: nothing.
pub const LOSSES: [&str; 0] = [];

/// Key of the layout in the file's metadata.
const LAYOUT_KEY: &str = "ravenpose.layout";

/// Layout of full states.
const STATES_LAYOUT: &str = "raven_state.v1";

/// Layout of tables.
const TABLE_LAYOUT: &str = "table.v1";

/// Key of the checksums: `OFFSET:LENGTH:CRC` of each row group, CRC in hexadecimal, separated by blanks.
const CHECKSUM_KEY: &str = "ravenpose.crc32";
