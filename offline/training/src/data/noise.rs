//! The noise of a tracker, added to the exact truth of a simulation.

use super::Trajectory;
use crate::random::Random;

/// Adds independent normal noise to the labels; `sd` is that of the whole vector, as trackers state it, in the labels' unit.
/// [`Trajectory::exact`] stays, and
/// [`Trajectory::noise`] says it.
pub fn add_noise(trajectory: &mut Trajectory, outputs: usize, sd: f64, random: &mut Random) {
    trajectory.noise = sd;
    let per_axis = sd / (outputs.max(1) as f64).sqrt();
    for label in &mut trajectory.labels {
        *label += (per_axis * random.normal()) as f32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_has_the_size_of_the_vector_and_leaves_the_exact_truth_alone() {
        let n = 30_000;
        let exact = vec![1.0_f32; 3 * n];
        let mut one = Trajectory { labels: exact.clone(), exact: exact.clone(), ..Trajectory::default() };
        add_noise(&mut one, 3, 0.5, &mut Random::new(3, 0));
        let squares: f64 = one.labels.iter().map(|label| f64::from(label - 1.0).powi(2)).sum();
        let rms = (squares / n as f64).sqrt();
        assert!((rms - 0.5).abs() < 0.01, "{rms}");
        assert_eq!(one.exact, exact);
    }
}
