//! Which name was given for which.

use crate::judge::Judged;
use crate::vocabulary::NAMES;
use serde::Serialize;

/// Counts of first names by truth; cases of at most one effect.
#[derive(Clone, Debug, Serialize)]
pub struct Confusion {
    /// Names of rows and columns.
    pub names: Vec<String>,
    /// `counts[truth][answer]`.
    pub counts: Vec<Vec<usize>>,
    /// Cases that have no column: no report, or a name outside the vocabulary.
    pub elsewhere: usize,
}

/// Over all given cases.
pub fn confusion<'a>(cases: impl Iterator<Item = &'a Judged>) -> Confusion {
    let place = |name: &str| NAMES.iter().position(|known| *known == name);
    let mut counts = vec![vec![0; NAMES.len()]; NAMES.len()];
    let mut elsewhere = 0;
    for case in cases.filter(|case| case.truth.len() == 1) {
        match (place(&case.truth[0]), place(&case.answer)) {
            (Some(row), Some(column)) => counts[row][column] += 1,
            _ => elsewhere += 1,
        }
    }
    Confusion { names: NAMES.iter().map(|&name| name.to_owned()).collect(), counts, elsewhere }
}
