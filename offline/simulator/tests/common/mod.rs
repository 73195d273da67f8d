//! Shared by the tests: vectors and recordings beside the repository, as tables of numbers with named columns.
#![allow(dead_code, missing_docs, reason = "each test file uses its own part")]

pub(crate) mod cases;
pub(crate) mod urdf;

use std::collections::HashMap;
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

/// Columns of numbers; cells that are not numbers are NaN.
pub(crate) struct Table {
    columns: HashMap<String, usize>,
    rows: Vec<Vec<f64>>,
}

/// Reads a table, or says plainly that it is absent.
pub(crate) fn table(path: &Path) -> Option<Table> {
    let Ok(text) = std::fs::read_to_string(path) else {
        println!("skipped: {} is absent", path.display());
        return None;
    };
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let header = lines.next().expect("header");
    let columns = header.split(',').enumerate().map(|(i, name)| (name.to_owned(), i)).collect();
    let rows = lines.map(|line| line.split(',').map(|cell| cell.parse().unwrap_or(f64::NAN)).collect()).collect();
    Some(Table { columns, rows })
}

impl Table {
    pub(crate) fn rows(&self) -> usize {
        self.rows.len()
    }

    pub(crate) fn number(&self, row: usize, name: &str) -> f64 {
        self.rows[row][*self.columns.get(name).unwrap_or_else(|| panic!("no column {name}"))]
    }

    /// `PREFIX_1_UNIT` to `PREFIX_3_UNIT`, joint 3 with its own unit, in the first three of eight places.
    pub(crate) fn vector(&self, row: usize, prefix: &str, units: [&str; 3]) -> [f64; 8] {
        let mut out = [0.0; 8];
        for (joint, unit) in units.iter().enumerate() {
            out[joint] = self.number(row, &format!("{prefix}_{}{unit}", joint + 1));
        }
        out
    }
}

pub(crate) const POSITION: [&str; 3] = ["_rad", "_rad", "_m"];
pub(crate) const RATE: [&str; 3] = ["_rad_s", "_rad_s", "_m_s"];
pub(crate) const ANGLE: [&str; 3] = ["_rad"; 3];
pub(crate) const SPEED: [&str; 3] = ["_rad_s"; 3];
pub(crate) const TORQUE: [&str; 3] = ["_nm"; 3];
