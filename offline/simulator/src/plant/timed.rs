//! Effects that act for some time only.

/// An effect and the time in which it acts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Timed<T> {
    pub(crate) effect: T,
    pub(crate) from_s: f64,
    pub(crate) to_s: f64,
    pub(crate) on: bool,
}

impl<T> Timed<T> {
    pub(crate) fn new(effect: T, from_s: f64, to_s: f64) -> Self {
        Self { effect, from_s, to_s, on: from_s <= 0.0 }
    }

    /// Returns whether it was switched.
    pub(crate) fn at(&mut self, time_s: f64) -> bool {
        let before = std::mem::replace(&mut self.on, (self.from_s..self.to_s).contains(&time_s));
        before != self.on
    }
}

/// Effects that act now.
pub(crate) fn on<T>(effects: &[Timed<T>]) -> impl Iterator<Item = &T> {
    effects.iter().filter(|timed| timed.on).map(|timed| &timed.effect)
}
