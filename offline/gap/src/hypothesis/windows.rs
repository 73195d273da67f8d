//! When an effect is there.

use std::sync::Arc;

/// From when to when, s from the start of a run; infinite where it does not begin or end in it.
pub type Window = [f64; 2];

/// The whole of a run.
pub const ALWAYS: Window = [f64::NEG_INFINITY, f64::INFINITY];
/// Nothing of it.
pub const NEVER: Window = [f64::INFINITY, f64::INFINITY];

/// What it costs that an effect comes or goes in a run, comes and goes, or is there in some runs and not in others, nats: edges are searched for.
const EDGES_NATS: [f64; 3] = [0.0, 8.0, 20.0];
const CHOICE_NATS: f64 = 4.0;

/// Windows that begin or end at one of these instants.
pub fn with_one_edge(edges: &[f64]) -> impl Iterator<Item = Window> {
    edges.iter().flat_map(|edge| [[*edge, f64::INFINITY], [f64::NEG_INFINITY, *edge]])
}

/// Windows between each two edges, of which the later ones come later.
pub fn with_both_edges(edges: &[f64]) -> impl Iterator<Item = Window> {
    edges.iter().flat_map(|from| edges.iter().filter(move |to| *to > from).map(move |to| [*from, *to]))
}

/// When an effect is there: alike in all runs, or in each run by itself.
#[derive(Debug, Clone, PartialEq)]
pub struct Windows(Arc<[Window]>);

impl Windows {
    /// Alike in every run.
    pub fn alike(window: Window) -> Self {
        Self(Arc::new([window]))
    }

    /// In each run by itself, in their order; none where it is always there.
    pub fn each(windows: &[Window]) -> Option<Self> {
        let first = *windows.first()?;
        let alike = windows.iter().all(|window| *window == first);
        (!alike || first != ALWAYS).then(|| if alike { Self::alike(first) } else { Self(windows.into()) })
    }

    /// In a run.
    pub fn of(&self, run: usize) -> Window {
        self.0.get(run).copied().unwrap_or(self.0[0])
    }

    /// The window that all runs have, if they are alike.
    pub fn in_all(&self) -> Option<Window> {
        if let [one] = *self.0 { Some(one) } else { None }
    }

    /// Every window that there is: one, or one for each run.
    pub fn all(&self) -> &[Window] {
        &self.0
    }

    /// Is it there in no run?
    pub fn is_never(&self) -> bool {
        self.0.iter().all(|window| *window == NEVER)
    }

    /// With another window in the place of one of [`Windows::all`].
    #[must_use]
    pub fn with(&self, place: usize, window: Window) -> Self {
        let mut all = self.0.to_vec();
        all[place] = window;
        Self(all.into())
    }

    /// With one of its edges moved.
    #[must_use]
    pub fn moved(&self, (place, edge): (usize, usize), by_s: f64) -> Self {
        let mut window = self.0[place];
        window[edge] += by_s;
        self.with(place, window)
    }

    /// The edges that lie in the runs, each with its place among [`Windows::all`].
    pub fn edges(&self) -> Vec<(usize, usize)> {
        let all = (0..self.0.len()).flat_map(|place| [(place, 0), (place, 1)]);
        all.filter(|(place, edge)| self.0[*place][*edge].is_finite()).collect()
    }

    /// Does one begin or end in a run within so many seconds of where the other does?
    pub fn share_edge(&self, other: &Self, within_s: f64) -> bool {
        let edges = |windows: &Self, run: usize| windows.of(run).into_iter().filter(|t| t.is_finite()).collect::<Vec<f64>>();
        (0..self.0.len().max(other.0.len()))
            .any(|run| edges(self, run).iter().any(|own| edges(other, run).iter().any(|its| (own - its).abs() < within_s)))
    }

    /// Do both begin and end in every run at the same time, to so many seconds?
    pub fn coincide(&self, other: &Self, within_s: f64) -> bool {
        let near = |own: f64, its: f64| own == its || (own - its).abs() < within_s;
        (0..self.0.len().max(other.0.len())).all(|run| (0..2).all(|edge| near(self.of(run)[edge], other.of(run)[edge])))
    }

    /// What it costs, nats.
    pub fn price(&self) -> f64 {
        let edges = |window: &Window| EDGES_NATS[window.iter().filter(|t| t.is_finite()).count()];
        let choices = if self.0.len() > 1 { CHOICE_NATS * self.0.len() as f64 } else { 0.0 };
        self.0.iter().map(edges).sum::<f64>() + choices
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_of_runs_that_are_one_are_told_once() {
        let late = [3.0, f64::INFINITY];
        assert_eq!(Windows::each(&[ALWAYS, ALWAYS]), None);
        assert_eq!(Windows::each(&[late, late]), Some(Windows::alike(late)));
        let each = Windows::each(&[late, NEVER, [1.0, 2.0]]).expect("windows");
        assert_eq!((each.of(0), each.of(1), each.of(2)), (late, NEVER, [1.0, 2.0]));
        assert_eq!(each.edges(), [(0, 0), (2, 0), (2, 1)]);
        assert_eq!(each.moved((2, 1), 0.5).of(2), [1.0, 2.5]);
        assert!(each.price() > Windows::alike(late).price());
    }

    #[test]
    fn edges_are_shared_in_the_same_run_only() {
        let late = Windows::alike([3.0, f64::INFINITY]);
        let of = |windows: &[Window]| Windows::each(windows).expect("windows");
        assert!(late.share_edge(&of(&[[8.0, f64::INFINITY], [2.8, 5.0]]), 0.3));
        assert!(!of(&[[3.0, f64::INFINITY], [8.0, 9.0]]).share_edge(&of(&[[8.0, 9.0], [3.0, f64::INFINITY]]), 0.3));
    }

    #[test]
    fn windows_coincide_if_both_their_edges_do_in_every_run() {
        let (late, of) = (Windows::alike([3.0, f64::INFINITY]), |windows: &[Window]| Windows::each(windows).expect("windows"));
        assert!(late.coincide(&Windows::alike([3.2, f64::INFINITY]), 0.3) && late.coincide(&late, 0.3));
        for other in [Windows::alike([3.4, f64::INFINITY]), Windows::alike([3.0, 9.0]), of(&[[3.0, f64::INFINITY], NEVER])] {
            assert!(!late.coincide(&other, 0.3) && !other.coincide(&late, 0.3), "{other:?}");
        }
    }
}
