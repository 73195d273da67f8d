//! Shared by the tests: where the vectors and recordings lie, and a table with named columns.
#![allow(dead_code, missing_docs, reason = "each test file uses its own part")]

pub(crate) mod each_arm;
pub(crate) mod random_arm;
pub(crate) mod urdf_text;

use std::io::Read;
use std::path::{Path, PathBuf};

/// `RAVENPOSE_VECTORS`, or `../shared/vectors` beside the repository.
pub(crate) fn vectors() -> PathBuf {
    std::env::var_os("RAVENPOSE_VECTORS")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/vectors"), PathBuf::from)
}

/// `RAVENPOSE_DATA`, or `../shared/data` beside the repository.
pub(crate) fn data() -> PathBuf {
    std::env::var_os("RAVENPOSE_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"), PathBuf::from)
}

/// The recordings of a folder, in order.
pub(crate) fn runs(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().filter_map(|entry| Some(entry.ok()?.path()));
    let mut runs: Vec<PathBuf> = entries.filter(|path| path.to_string_lossy().ends_with(".csv.gz")).collect();
    runs.sort();
    runs
}

/// Rows of text cells under named columns.
pub(crate) struct Table {
    header: Vec<String>,
    rows: Vec<Vec<String>>,
}

/// Reads a table, or says plainly that it is absent.
pub(crate) fn table(path: &Path) -> Option<Table> {
    let Ok(bytes) = std::fs::read(path) else {
        println!("skipped: {} is absent", path.display());
        return None;
    };
    let mut text = String::new();
    if path.extension().is_some_and(|extension| extension == "gz") {
        flate2::read::GzDecoder::new(bytes.as_slice()).read_to_string(&mut text).expect("gzip");
    } else {
        text = String::from_utf8(bytes).expect("text");
    }
    let mut lines =
        text.lines().filter(|line| !line.starts_with('#')).map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
    let header = lines.next().expect("header");
    Some(Table { header, rows: lines.collect() })
}

impl Table {
    pub(crate) fn rows(&self) -> usize {
        self.rows.len()
    }

    pub(crate) fn text(&self, row: usize, name: &str) -> &str {
        let column = self.header.iter().position(|header| header == name).unwrap_or_else(|| panic!("no column {name}"));
        &self.rows[row][column]
    }

    pub(crate) fn number(&self, row: usize, name: &str) -> f64 {
        let text = self.text(row, name);
        text.parse().unwrap_or_else(|_| panic!("row {row}, {name}: {text:?}"))
    }

    /// The number, if the table has the column and the cell is not empty.
    pub(crate) fn optional(&self, row: usize, name: &str) -> Option<f64> {
        let column = self.header.iter().position(|header| header == name)?;
        self.rows[row][column].parse().ok()
    }

    /// `PREFIX_1_UNIT` to `PREFIX_7_UNIT`, joint 3 with its own unit; absent cells are 0.
    pub(crate) fn joints(&self, row: usize, prefix: &str, unit: &str, unit_3: &str) -> [f64; 7] {
        std::array::from_fn(|i| {
            let name = format!("{prefix}_{}_{}", i + 1, if i == 2 { unit_3 } else { unit });
            if self.header.contains(&name) { self.text(row, &name).parse().unwrap_or(0.0) } else { 0.0 }
        })
    }
}

/// Largest deviation so far.
#[derive(Default)]
pub(crate) struct Worst(pub(crate) f64);

impl Worst {
    pub(crate) fn see(&mut self, deviation: f64) {
        assert!(deviation.is_finite());
        self.0 = self.0.max(deviation.abs());
    }
}

impl Worst {
    /// Deviations entry by entry.
    pub(crate) fn see_all(&mut self, found: &[f64], expected: &[f64]) {
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.iter().zip(expected) {
            self.see(found - expected);
        }
    }
}

/// Numbers that a seed repeats: `SplitMix64`.
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub(crate) fn within(&mut self, lower: f64, upper: f64) -> f64 {
        lower + (upper - lower) * ((self.bits() >> 11) as f64 / (1_u64 << 53) as f64)
    }

    pub(crate) fn signed(&mut self, size: f64) -> f64 {
        self.within(-size, size)
    }

    pub(crate) fn below(&mut self, count: usize) -> usize {
        (self.bits() % count as u64) as usize
    }

    pub(crate) fn vector(&mut self, size: f64) -> nalgebra::Vector3<f64> {
        nalgebra::Vector3::new(self.signed(size), self.signed(size), self.signed(size))
    }
}
