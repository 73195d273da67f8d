//! Two-phase calibration (Seita 2018): a rigid transform of the reported tip, then a random forest on what it leaves.

use super::{Forest, Rival, rows};
use crate::data::Trajectory;
use nalgebra::{Matrix3, Vector3};

/// Features of `raven118-v1` that the second phase looks at: reported tip and rotation.
const POSE: [usize; 12] = [0, 1, 2, 6, 7, 8, 9, 10, 11, 12, 13, 14];

/// Rigid transform, then forest.
pub struct RigidForest {
    rotation: Matrix3<f64>,
    from: Vector3<f64>,
    to: Vector3<f64>,
    forest: Forest,
}

impl RigidForest {
    /// Nothing learnt yet.
    pub fn new(seed: u64) -> Self {
        Self { rotation: Matrix3::identity(), from: Vector3::zeros(), to: Vector3::zeros(), forest: Forest::new(&POSE, seed) }
    }

    /// What the transform moves the reported tip by, mm.
    fn shift(&self, row: &[f32]) -> Vector3<f64> {
        let reported = reported(row);
        self.rotation * (reported - self.from) + self.to - reported
    }
}

/// Reported tip, mm.
fn reported(row: &[f32]) -> Vector3<f64> {
    Vector3::new(f64::from(row[0]), f64::from(row[1]), f64::from(row[2])) * 1e-3
}

impl Rival for RigidForest {
    fn fit(&mut self, train: &[Trajectory], outputs: usize) {
        let pairs: Vec<(Vector3<f64>, Vector3<f64>)> = train
            .iter()
            .flat_map(|one| rows(one).zip(one.labels.chunks_exact(outputs)))
            .map(|(row, label)| (reported(row), reported(row) + Vector3::from_fn(|axis, _| f64::from(label[axis]))))
            .collect();
        let n = pairs.len().max(1) as f64;
        self.from = pairs.iter().map(|(a, _)| a).sum::<Vector3<f64>>() / n;
        self.to = pairs.iter().map(|(_, b)| b).sum::<Vector3<f64>>() / n;
        // Kabsch 1976.
        let cross: Matrix3<f64> = pairs.iter().map(|(a, b)| (b - self.to) * (a - self.from).transpose()).sum();
        let svd = cross.svd(true, true);
        if let (Some(u), Some(v)) = (svd.u, svd.v_t) {
            let sign = (u * v).determinant().signum();
            self.rotation = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v;
        }
        let labels: Vec<f32> = train
            .iter()
            .flat_map(|one| rows(one).zip(one.labels.chunks_exact(outputs)))
            .flat_map(|(row, label)| {
                let shift = self.shift(row);
                (0..outputs).map(move |axis| label[axis] - shift[axis] as f32).collect::<Vec<_>>()
            })
            .collect();
        self.forest.fit_labels(train, labels, outputs);
    }

    fn estimate(&self, one: &Trajectory) -> Vec<f32> {
        rows(one)
            .flat_map(|row| {
                let shift = self.shift(row);
                self.forest.row(row).into_iter().enumerate().map(|(axis, rest)| rest + shift[axis] as f32).collect::<Vec<_>>()
            })
            .collect()
    }
}
