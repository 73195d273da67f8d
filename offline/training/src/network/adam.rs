//! Adam (Kingma and Ba 2015) with decoupled weight decay.

/// First and second moments of every number.
#[derive(Debug, Clone, PartialEq)]
pub struct Adam {
    /// Steps so far.
    pub steps: u64,
    /// Moving mean of the gradient.
    pub first: Vec<Vec<f32>>,
    /// Moving mean of its square.
    pub second: Vec<Vec<f32>>,
}

const BETA_1: f64 = 0.9;
const BETA_2: f64 = 0.999;
const EPSILON: f32 = 1e-8;

impl Adam {
    /// Moments of zero for numbers of these lengths.
    pub fn new(lengths: impl Iterator<Item = usize>) -> Self {
        let first: Vec<Vec<f32>> = lengths.map(|length| vec![0.0; length]).collect();
        Self { steps: 0, second: first.clone(), first }
    }

    /// One step down the gradients. `decay` shrinks the numbers for which `decays` says so, per step and unit of the rate.
    pub fn step(&mut self, numbers: &mut [&mut [f32]], gradients: &[Vec<f32>], rate: f64, decay: f64, decays: &[bool]) {
        self.steps += 1;
        let t = self.steps as f64;
        let correction = (1.0 - BETA_2.powf(t)).sqrt() / (1.0 - BETA_1.powf(t));
        let (step, b1, b2) = ((rate * correction) as f32, BETA_1 as f32, BETA_2 as f32);
        let shrink = (1.0 - rate * decay) as f32;
        let moments = self.first.iter_mut().zip(&mut self.second);
        for (((numbers, gradients), (first, second)), decays) in numbers.iter_mut().zip(gradients).zip(moments).zip(decays) {
            let shrink = if *decays { shrink } else { 1.0 };
            for (((x, g), m), v) in numbers.iter_mut().zip(gradients).zip(first.iter_mut()).zip(second.iter_mut()) {
                *m = b1 * *m + (1.0 - b1) * g;
                *v = b2 * *v + (1.0 - b2) * g * g;
                *x = *x * shrink - step * *m / (v.sqrt() + EPSILON);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_step_is_the_rate_whatever_the_gradient() {
        let mut x = [1.0_f32, -2.0];
        let mut adam = Adam::new([2].into_iter());
        adam.step(&mut [&mut x], &[vec![1e-3, -50.0]], 0.01, 0.0, &[true]);
        assert!((x[0] - 0.99).abs() < 1e-4 && (x[1] + 1.99).abs() < 1e-4, "{x:?}");
    }
}
