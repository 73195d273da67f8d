//! What a flexible predictor gains that knows no physics: the ceiling against which the library is held
//! (gap-design.md, section 7, rule 7).

use crate::cell::Cell;
use crate::hypothesis::{Column, Dictionary};
use crate::nominal::sign_series;
use crate::score::{Fit, Grams, Scorer};

/// The ceiling beside the library.
#[derive(Debug, Clone)]
pub struct Ceiling {
    /// Gain of the library over nothing, nats.
    pub library_nats: f64,
    /// Gain of library and flexible columns together over nothing, nats.
    pub together_nats: f64,
    /// Without the block that says most, the gain of the flexible columns over the library.
    pub least_nats: f64,
    /// The cell where the flexible columns add most, and what they gain there.
    pub cell: Option<(usize, f64)>,
    /// Names of the features that add most there, most first.
    pub depends_on: Vec<&'static str>,
}

/// Features of one cell: names and series on the grid.
fn features(dictionary: &Dictionary, cell: &Cell) -> Vec<(&'static str, Vec<f64>)> {
    let problem = dictionary.problem;
    let n = dictionary.joints();
    let motion = |r: usize| &problem.pairs[r].real;
    let mut all = Vec::new();
    let joints: Vec<usize> = match cell.channel {
        crate::cell::Channel::EndEffector => (0..n).collect(),
        _ => std::iter::once(cell.index).chain((0..n).filter(|j| *j != cell.index)).collect(),
    };
    for (rank, &j) in joints.iter().enumerate() {
        let q = dictionary.at_grid(|r, i, _| motion(r).position[j][i]);
        let v = dictionary.at_grid(|r, i, _| motion(r).velocity[j][i]);
        let mid = crate::series::mean(&q);
        let spread = (0.5 * dictionary.travel(j)).max(1e-9);
        let x: Vec<f64> = q.iter().map(|q| (q - mid) / spread).collect();
        let power = |k: i32| x.iter().map(|x| x.powi(k)).collect::<Vec<f64>>();
        let (own, cell_own) = (rank == 0, cell.channel != crate::cell::Channel::EndEffector);
        all.push((if own && cell_own { "position" } else { "position of another joint" }, x.clone()));
        all.push((if own && cell_own { "posture" } else { "posture of the others" }, power(2)));
        all.push((if own && cell_own { "velocity" } else { "velocity of another joint" }, v.clone()));
        if own || !cell_own {
            all.push(("posture", power(3)));
            let signs: Vec<Vec<f64>> = problem.pairs.iter().map(|pair| sign_series(&pair.real, j)).collect();
            let sign = dictionary.at_grid(|r, i, _| signs[r][i]);
            let load = dictionary.load(j);
            let times = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).collect::<Vec<f64>>();
            all.push(("velocity sign", sign.clone()));
            all.push(("velocity sign and position", times(&sign, &x)));
            all.push(("velocity sign and posture", times(&sign, &power(2))));
            all.push(("velocity squared", v.iter().map(|v| v * v.abs()).collect()));
            all.push(("load", load.clone()));
            all.push(("load squared", load.iter().map(|l| l * l.abs()).collect()));
            all.push(("load cubed", load.iter().map(|l| l.powi(3)).collect()));
            all.push(("load and velocity sign", load.iter().zip(&sign).map(|(l, s)| l.abs() * s).collect()));
            all.push(("acceleration", dictionary.at_grid(|r, i, _| motion(r).acceleration[j][i])));
        }
    }
    all.push(("constant", vec![1.0; dictionary.grid.len()]));
    for (k, name) in [(1, "time"), (2, "time")] {
        all.push((
            name,
            dictionary.at_grid(|r, i, _| {
                let share = i as f64 / motion(r).run.len() as f64;
                if k == 1 { share } else { share * share }
            }),
        ));
    }
    all
}

/// Gain that a further feature has to bring, nats.
const STEP_NATS: f64 = 4.0;
/// Most features of a cell.
const FEATURES: usize = 6;

/// Adds to a set the features that help, one after the other, cell by cell: what is held out decides, so that the ceiling
/// does not rise by overfitting. A cell that gains less than `least` nats gains nothing: the best of thirty features gains something in any, and a robot
/// of six joints has fifteen.
pub fn ceiling(dictionary: &Dictionary, scorer: &mut Scorer, grams: &Grams, none: &Fit, least: f64) -> Ceiling {
    let problem = dictionary.problem;
    let library = scorer.fit(grams);
    let mut wide = grams.clone();
    let mut together = library.clone();
    scorer.temper(grams, &library);
    let mut by_cell = vec![(0.0, Vec::new()); problem.cells.len()];
    for c in 0..problem.cells.len() {
        let mut columns = cell_columns(dictionary, c);
        let before = (wide.clone(), together.clone());
        while by_cell[c].1.len() < FEATURES {
            let scored = columns.iter().enumerate().map(|(k, (_, column))| {
                let fit = scorer.fit(&scorer.extended(&wide, std::slice::from_ref(column)));
                (k, scorer.gain(&together, &fit).nats)
            });
            let Some((k, nats)) = scored.max_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, nats)| *nats > STEP_NATS) else { break };
            let (name, column) = columns.swap_remove(k);
            wide = scorer.extended(&wide, &[column]);
            together = scorer.fit(&wide);
            by_cell[c].0 += nats;
            by_cell[c].1.push(name);
            scorer.temper(&wide, &together);
        }
        if by_cell[c].0 < least && !by_cell[c].1.is_empty() {
            by_cell[c] = (0.0, Vec::new());
            (wide, together) = before;
            scorer.temper(&wide, &together);
        }
    }
    let gain = scorer.gain(&library, &together);
    let cell = by_cell
        .iter()
        .enumerate()
        .map(|(c, (nats, _))| (c, *nats))
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .filter(|(_, nats)| *nats > 0.0);
    let mut depends_on: Vec<&'static str> = Vec::new();
    for name in cell.map_or(&[][..], |(c, _)| &by_cell[c].1) {
        if depends_on.len() < 3 && !depends_on.contains(name) {
            depends_on.push(name);
        }
    }
    let library_nats = scorer.gain(none, &library).nats;
    Ceiling {
        library_nats,
        together_nats: library_nats + gain.nats.max(0.0),
        least_nats: gain.least.min(gain.nats),
        cell,
        depends_on,
    }
}

/// Features of one cell as columns.
fn cell_columns(dictionary: &Dictionary, c: usize) -> Vec<(&'static str, Column)> {
    let cell = &dictionary.problem.cells[c];
    let on_grid = cell.channel != crate::cell::Channel::EndEffector;
    let column = |series: Vec<f64>| {
        let mut column = Column::default();
        column.push(Some(c), &if on_grid { series } else { dictionary.to_tip(&series) });
        column.silence(dictionary.problem);
        column
    };
    features(dictionary, cell)
        .into_iter()
        .map(|(name, series)| (name, column(series)))
        .filter(|(_, column)| !column.is_empty())
        .collect()
}
