//! What a file is, told by its first bytes.

use std::io::Read;
use std::path::Path;

use crate::columns::Cells;
use crate::file::{Input, InputProblem, refusal};
use crate::stream::StreamError;
use crate::{columns235, columns252, parquet_file, statefile, text};

/// Bytes that are looked at: a row of 252 numbers has 6,300.
const HEAD_BYTES: u64 = 1 << 16;

/// Formats that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// MCAP.
    Mcap,
    /// ROS 1 bag, version 2.0.
    Rosbag,
    /// File of states for the stand-in.
    StateFile,
    /// The paper's text.
    Columns235,
    /// The lab's CSV, with or without the force sensor.
    Columns252,
    /// Parquet of states or of a table.
    Parquet,
    /// Tidy CSV or another table.
    Csv,
}

/// What a file is.
///
/// # Errors
/// [`StreamError`] for a file that cannot be opened or is nothing that is read here.
pub fn kind(path: &Path) -> Result<Kind, StreamError> {
    if path.is_dir() {
        return Err(refusal(path, None, "is a folder", "give one of the files in it"));
    }
    let mut input = match Input::open(path) {
        Err(problem @ InputProblem::NotGzip) => return Err(problem.refusal(path)),
        other => other.map_err(|problem| problem.refusal(path))?,
    };
    let mut head = Vec::new();
    if let Err(error) = input.by_ref().take(HEAD_BYTES).read_to_end(&mut head)
        && head.is_empty()
    {
        let what = if input.compressed() { "the gzip stream is damaged" } else { "cannot be read" };
        return Err(refusal(path, None, format!("{what} ({error})"), "copy the file again"));
    }
    let found = of_head(&head, &extension(path)).map_err(|(what, remedy)| refusal(path, None, what, remedy))?;
    if input.compressed() && matches!(found, Kind::Mcap | Kind::Rosbag | Kind::Parquet) {
        return Err(refusal(path, None, "is compressed as a whole", "decompress it first (gunzip)"));
    }
    Ok(found)
}

/// Extension in lower case, that before `.gz` where there is one.
fn extension(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    name.rsplit_once('.').map_or(String::new(), |(_, extension)| extension.to_owned())
}

type Refused = (String, &'static str);

fn of_head(head: &[u8], extension: &str) -> Result<Kind, Refused> {
    if head.is_empty() {
        return Err(("is empty".to_owned(), "record at least one sample"));
    }
    if let Some((_, kind)) = OURS.iter().find(|(magic, _)| head.starts_with(magic)) {
        return Ok(*kind);
    }
    if let Some((_, _, what, remedy)) =
        OTHERS.iter().find(|(at, magic, _, _)| head.get(*at..).is_some_and(|head| head.starts_with(magic)))
    {
        return Err((format!("looks like {what}"), remedy));
    }
    if let Some((_, what)) = NAMED.iter().find(|(names, _)| names.contains(&extension)) {
        return Err((
            format!("is named .{extension} but does not begin like {what}"),
            "copy it again, or name it after what it is",
        ));
    }
    if extension == "onnx" || looks_like_onnx(head) {
        return Err(("looks like an ONNX model".to_owned(), "models are for ravenposed and `ravenpose infer`; give a recording"));
    }
    of_text(head, extension)
}

/// First bytes of what is read.
const OURS: [(&[u8], Kind); 4] = [
    (b"\x89MCAP0\r\n", Kind::Mcap),
    (b"#ROSBAG V2.0\n", Kind::Rosbag),
    (&statefile::MAGIC, Kind::StateFile),
    (&parquet_file::MAGIC, Kind::Parquet),
];

/// Names that promise one of ours.
const NAMED: [(&[&str], &str); 4] = [
    (&["mcap"], "an MCAP file"),
    (&["bag", "active"], "a ROS 1 bag of version 2.0"),
    (&["rvs", "rvnstate"], "a state file"),
    (&["parquet"], "a Parquet file"),
];

const GIVE_RECORDING: &str = "give a recording (MCAP, bag, CSV, Parquet, .rvs)";
const CONVERT: &str = "export it to CSV, Parquet or MCAP with the program that it comes from";

/// Where, first bytes, what it is, what to do.
const OTHERS: [(usize, &[u8], &str, &str); 33] = [
    (0, b"#ROSBAG V1", "a ROS bag of version 1.x", "bring it to version 2.0 with `rosbag fix`"),
    (0, b"PARE", "an encrypted Parquet file", "decrypt it first"),
    (0, b"SQLite format 3\0", "an SQLite database, as ROS 2 bags (.db3) are", "convert it with `ros2 bag convert` to MCAP"),
    (0, b"PK\x03\x04", "a ZIP archive (also .npz and .xlsx are)", "unpack it, or export it to CSV"),
    (0, b"PK\x05\x06", "an empty ZIP archive", GIVE_RECORDING),
    (0, b"\x89HDF\r\n\x1a\n", "an HDF5 file (also .mat of version 7.3 is)", CONVERT),
    (0, b"MATLAB 5.0 MAT-file", "a MATLAB file", CONVERT),
    (0, b"\x93NUMPY", "a NumPy array", "save it with numpy.savetxt and a header of column names"),
    (0, b"ARROW1", "an Arrow file", CONVERT),
    (0, b"\x80\x02", "a Python pickle", CONVERT),
    (0, b"\x80\x03", "a Python pickle", CONVERT),
    (0, b"\x80\x04", "a Python pickle", CONVERT),
    (0, b"\x80\x05", "a Python pickle", CONVERT),
    (0, b"\x89PNG\r\n\x1a\n", "a PNG image", GIVE_RECORDING),
    (0, b"\xff\xd8\xff", "a JPEG image", GIVE_RECORDING),
    (0, b"GIF8", "a GIF image", GIVE_RECORDING),
    (0, b"II*\0", "a TIFF image", GIVE_RECORDING),
    (0, b"RIFF", "a video or sound file", GIVE_RECORDING),
    (4, b"ftyp", "a video file", GIVE_RECORDING),
    (0, b"\x1a\x45\xdf\xa3", "a Matroska video", GIVE_RECORDING),
    (0, b"%PDF", "a PDF document", GIVE_RECORDING),
    (0, b"\x7fELF", "a program", GIVE_RECORDING),
    (0, b"BZh", "a bzip2 file", "decompress it first (bunzip2)"),
    (0, b"\xfd7zXZ\0", "an xz file", "decompress it first (unxz)"),
    (0, b"\x28\xb5\x2f\xfd", "a zstd file", "decompress it first (unzstd)"),
    (0, b"\x04\x22\x4d\x18", "an LZ4 file", "decompress it first (unlz4)"),
    (0, b"7z\xbc\xaf\x27\x1c", "a 7-Zip archive", "unpack it"),
    (0, b"Rar!", "a RAR archive", "unpack it"),
    (257, b"ustar", "a tar archive", "unpack it"),
    (0, b"\xff\xfe", "UTF-16 text", "save it as UTF-8"),
    (0, b"\xfe\xff", "UTF-16 text", "save it as UTF-8"),
    (0, b"<?xml", "an XML document", GIVE_RECORDING),
    (0, b"\x1f\x8b", "gzip within gzip", "decompress it once"),
];

/// A protobuf that begins with a small version of the format and the name of a producer.
fn looks_like_onnx(head: &[u8]) -> bool {
    matches!(head, [0x08, 1..=32, 0x12, length, ..] if *length < 64)
}

/// Text by its name where that is not a table's, otherwise by its first line.
fn of_text(head: &[u8], extension: &str) -> Result<Kind, Refused> {
    let documents = ["json", "toml", "yaml", "yml", "md", "urdf", "xml", "html", "py", "rs", "m", "c", "cc", "cpp", "h", "hpp"];
    if documents.contains(&extension) {
        return Err((format!("is a .{extension} document, not a recording"), GIVE_RECORDING));
    }
    let is_table_name = ["csv", "txt", "dat", "tsv"].contains(&extension);
    if head.contains(&0) && !is_table_name {
        let first: Vec<String> = head.iter().take(8).map(|byte| format!("{byte:02x}")).collect();
        return Err((format!("is no format that this program knows (first bytes {})", first.join(" ")), GIVE_RECORDING));
    }
    let head = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head);
    let mut lines = head.split(|byte| *byte == b'\n').map(<[u8]>::trim_ascii).filter(|line| !line.is_empty());
    of_first_line(lines.next().unwrap_or_default())
}

/// Rows of numbers without a header are one of the layouts that are known by their number of columns; all else is CSV.
fn of_first_line(line: &[u8]) -> Result<Kind, Refused> {
    if line.starts_with(b"{") || line.starts_with(b"[") {
        return Err(("looks like JSON or TOML, not a table".to_owned(), GIVE_RECORDING));
    }
    if line.starts_with(b"<") {
        return Err(("looks like XML or HTML, not a table".to_owned(), GIVE_RECORDING));
    }
    let mut cells = Cells::new(line);
    let numbers = cells.by_ref().filter(|cell| text::number(cell).is_some()).count();
    let count = Cells::count_of(line);
    // One broken number does not make a header.
    if numbers + 1 < count || count < 2 {
        return Ok(Kind::Csv);
    }
    match (count, line.contains(&b',')) {
        (columns235::COLUMNS, _) => Ok(Kind::Columns235),
        (columns252::COLUMNS | columns252::COLUMNS_WITH_FORCE, _) => Ok(Kind::Columns252),
        (240, true) => Err((
            "looks like the lab's CSV of the message alone (240 columns)".to_owned(),
            "combine it with the encoders (252 columns) as the lab's scripts do, or convert the bag itself",
        )),
        (32, false) => Err((
            "looks like the label file (32 columns) that goes with a text of 235 columns".to_owned(),
            "give the recording itself",
        )),
        _ => Ok(Kind::Csv),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn content_goes_before_the_name() {
        for (head, extension, expected) in [
            (&b"\x89MCAP0\r\n..."[..], "csv", Kind::Mcap),
            (b"#ROSBAG V2.0\n", "", Kind::Rosbag),
            (b"RVNSTATE", "rvs", Kind::StateFile),
            (b"PAR1", "parquet", Kind::Parquet),
            (b"t_s,x_mm\n0,1\n", "csv", Kind::Csv),
            (b"\xef\xbb\xbft_s,x_mm\n", "", Kind::Csv),
            (b"# robot = raven2\nt_s\n", "csv", Kind::Csv),
        ] {
            assert_eq!(of_head(head, extension), Ok(expected), "{extension}");
        }
    }

    #[test]
    fn other_files_are_named() {
        for (head, extension, expected) in [
            (&b"PK\x03\x04zip"[..], "npz", "looks like a ZIP archive (also .npz and .xlsx are)"),
            (b"\x89HDF\r\n\x1a\n", "h5", "looks like an HDF5 file (also .mat of version 7.3 is)"),
            (b"SQLite format 3\0", "db3", "looks like an SQLite database, as ROS 2 bags (.db3) are"),
            (b"\x89PNG\r\n\x1a\n", "png", "looks like a PNG image"),
            (b"\x08\x08\x12\x07pytorch", "bin", "looks like an ONNX model"),
            (b"\x99MCAP0\r\n", "mcap", "is named .mcap but does not begin like an MCAP file"),
            (b"{\"a\": 1}", "txt", "looks like JSON or TOML, not a table"),
            (b"\0\x01\x02", "", "is no format that this program knows (first bytes 00 01 02)"),
            (b"", "csv", "is empty"),
        ] {
            assert_eq!(of_head(head, extension).expect_err("refused").0, expected);
        }
    }

    #[test]
    fn layouts_are_told_by_their_columns() {
        let row = |count: usize, separator: &str| vec!["1.5"; count].join(separator) + "\n";
        for (text, expected) in [
            (row(235, " "), Kind::Columns235),
            (row(252, ","), Kind::Columns252),
            (row(256, ","), Kind::Columns252),
            (row(100, ","), Kind::Csv),
        ] {
            assert_eq!(of_head(text.as_bytes(), "csv"), Ok(expected));
        }
        assert!(of_head(row(32, " ").as_bytes(), "txt").expect_err("labels").0.contains("label file"));
        assert!(of_head(row(240, ",").as_bytes(), "csv").expect_err("message").0.contains("240 columns"));
    }
}
