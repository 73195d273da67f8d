//! A cell: a channel of a joint or an axis.

use crate::series::rms;

/// A residual space (gap-design.md, section 2).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Channel {
    /// Torque at a joint.
    JointTorque,
    /// `A⁻¹ m - q` of a joint.
    Transmission,
    /// Tip in the base frame, one axis.
    EndEffector,
}

/// One scalar residual over all runs.
#[derive(Debug, Clone)]
pub struct Cell {
    /// Its space.
    pub channel: Channel,
    /// Joint or axis.
    pub index: usize,
    /// Run and sample of each row.
    pub rows: Vec<(usize, usize)>,
    /// Recording minus simulation, N·m, N, rad or m.
    pub residual: Vec<f64>,
    /// Places of the rows that say nothing, where residual and columns are 0: a drive is held by its friction, which takes
    /// any force below its level, or elastic joints shake each other.
    pub silent: Vec<usize>,
    /// What the nominal model misses at each row of the simulation's own torque; empty where none says it.
    pub missed: Vec<f64>,
}

impl Cell {
    /// Without rows.
    pub(crate) fn new(channel: Channel, index: usize) -> Self {
        Self { channel, index, rows: Vec::new(), residual: Vec::new(), silent: Vec::new(), missed: Vec::new() }
    }

    /// Of each row, whether it says something.
    pub(crate) fn says(&self) -> Vec<bool> {
        let mut says = vec![true; self.rows.len()];
        for &k in &self.silent {
            says[k] = false;
        }
        says
    }

    /// RMS of a series over the rows that say something.
    pub(crate) fn rms(&self, series: &[f64]) -> f64 {
        rms(series.iter().zip(self.says()).filter(|(_, says)| *says).map(|(y, _)| *y))
    }

    /// Makes a series 0 where the cell says nothing.
    pub fn silence<T: Copy + Default>(&self, series: &mut [T]) {
        zero_at(series, &self.silent);
    }
}

pub(crate) fn zero_at<T: Copy + Default>(series: &mut [T], places: &[usize]) {
    for &k in places {
        series[k] = T::default();
    }
}
