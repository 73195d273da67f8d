//! Training, validation and test: whole trajectories, never samples.

use crate::data::{DataSet, Trajectory};
use crate::error::TrainingError;
use crate::random::Random;

/// Share of the trajectories that nothing reads before the final figures, and the share for choosing.
const TEST_SHARE: f64 = 0.1;
const VALIDATION_SHARE: f64 = 0.1;
/// Purpose of the stream of random numbers that the split is drawn from.
const SPLIT: u64 = 12;

/// Which trajectory is in which set, as indices into [`DataSet::trajectories`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Split {
    /// To learn from.
    pub train: Vec<usize>,
    /// To choose by: early stopping, bounds.
    pub validation: Vec<usize>,
    /// For the final figures.
    pub test: Vec<usize>,
}

impl Split {
    /// Draws whole trajectories: a tenth (at least one) each for validation and test, the rest for training.
    ///
    /// # Errors
    /// [`TrainingError::TooFew`] below three trajectories.
    pub fn draw(trajectories: usize, seed: u64) -> Result<Self, TrainingError> {
        if trajectories < 3 {
            return Err(TrainingError::TooFew { found: trajectories });
        }
        let mut order: Vec<usize> = (0..trajectories).collect();
        Random::new(seed, SPLIT).shuffle(&mut order);
        let count = |share: f64| ((trajectories as f64 * share).round() as usize).max(1);
        let mut test = order.split_off(trajectories - count(TEST_SHARE));
        let mut validation = order.split_off(order.len() - count(VALIDATION_SHARE));
        for set in [&mut order, &mut validation, &mut test] {
            set.sort_unstable();
        }
        Ok(Self { train: order, validation, test })
    }
}

/// Test trajectories, which can be counted and no more: `evaluate` reads the files itself.
#[derive(Debug)]
pub struct Sealed {
    trajectories: Vec<Trajectory>,
}

impl Sealed {
    /// Names of the trajectories inside.
    pub fn names(&self) -> Vec<String> {
        self.trajectories.iter().map(|one| one.name.clone()).collect()
    }

    /// Time that all of them cover, s.
    pub fn seconds(&self) -> f64 {
        self.trajectories.iter().map(Trajectory::seconds).sum()
    }

    /// Rows of all of them.
    pub fn rows(&self) -> usize {
        self.trajectories.iter().map(Trajectory::rows).sum()
    }
}

/// A data set in three parts. Training code is given the first two; the third is sealed.
#[derive(Debug)]
pub struct Parts {
    /// To learn from.
    pub train: Vec<Trajectory>,
    /// To choose by.
    pub validation: Vec<Trajectory>,
    /// For the final figures.
    pub test: Sealed,
}

impl Parts {
    /// Moves the trajectories of a data set into their parts.
    pub fn of(data: &mut DataSet, split: &Split) -> Self {
        let mut all: Vec<Option<Trajectory>> = std::mem::take(&mut data.trajectories).into_iter().map(Some).collect();
        let mut take = |set: &[usize]| set.iter().filter_map(|index| all.get_mut(*index)?.take()).collect::<Vec<_>>();
        Self { train: take(&split.train), validation: take(&split.validation), test: Sealed { trajectories: take(&split.test) } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_trajectory_is_in_two_sets_and_none_is_lost() {
        for trajectories in 3..60 {
            for seed in 0..20 {
                let split = Split::draw(trajectories, seed).expect("split");
                let mut all = [split.train.clone(), split.validation.clone(), split.test.clone()].concat();
                all.sort_unstable();
                assert_eq!(all, (0..trajectories).collect::<Vec<_>>());
                assert!(!split.train.is_empty() && !split.validation.is_empty() && !split.test.is_empty());
            }
        }
        assert_eq!(Split::draw(28, 1).expect("split").test.len(), 3);
    }

    #[test]
    fn a_split_depends_on_its_seed_alone() {
        assert_eq!(Split::draw(28, 5), Split::draw(28, 5));
        assert_ne!(Split::draw(28, 5), Split::draw(28, 6));
    }

    #[test]
    fn one_trajectory_is_too_few() {
        let line = Split::draw(1, 0).expect_err("too few").to_string();
        assert!(line.contains("1 trajectories: at least 3"), "{line}");
    }

    #[test]
    fn parts_hold_the_trajectories_of_their_set() {
        let named = |index: usize| Trajectory { name: index.to_string(), ..Trajectory::default() };
        let mut data = DataSet { trajectories: (0..10).map(named).collect(), ..DataSet::default() };
        let split = Split::draw(10, 3).expect("split");
        let parts = Parts::of(&mut data, &split);
        let names = |set: &[usize]| set.iter().map(usize::to_string).collect::<Vec<_>>();
        assert_eq!(parts.test.names(), names(&split.test));
        assert_eq!(parts.train.iter().map(|one| one.name.clone()).collect::<Vec<_>>(), names(&split.train));
        assert!(data.trajectories.is_empty());
    }
}
