//! `raven118-v1`: which 118 numbers of a state a network sees, in which order. The one table of it.

use crate::{FEATURES, RavenState};

/// Name of the layout, as `ravenpose.feature_layout` in a model's metadata has it.
pub const LAYOUT: &str = "raven118-v1";
/// Feature index of the time step.
pub const DT: usize = 117;

/// A run of features that come from one field.
pub struct Block {
    /// Field of `raven_state`.
    pub field: &'static str,
    /// First feature.
    pub start: usize,
    /// Number of features.
    pub count: usize,
    /// Unit as published.
    pub unit: &'static str,
}

/// The table, and straight code out of it: a loop over the table would call through 18 pointers in each cycle.
macro_rules! layout {
    ($($field:ident, $name:literal, $start:literal, $count:literal, $unit:literal;)*) => {
        /// The layout, in feature order. Values exactly as published, as `f32`; nothing is converted before the network.
        pub static BLOCKS: [Block; 18] = [
            $(Block { field: $name, start: $start, count: $count, unit: $unit },)*
            Block { field: "dt", start: DT, count: 1, unit: "s" },
        ];

        /// Fills the features of one arm (0 gold, 1 green).
        pub fn extract(state: &RavenState, arm: usize, features: &mut [f32; FEATURES]) {
            $(
                let from = &state.$field.as_chunks::<$count>().0[arm];
                for (to, from) in features[$start..$start + $count].iter_mut().zip(from) {
                    *to = *from as f32;
                }
            )*
            features[DT] = (f64::from(state.dt_sec) + f64::from(state.dt_nsec) * 1e-9) as f32;
        }

        /// The other way: fills in what a state has of one arm (0 gold, 1 green). Whole numbers are rounded.
        pub fn insert(features: &[f32; FEATURES], arm: usize, state: &mut RavenState) {
            $(
                let to = &mut state.$field.as_chunks_mut::<$count>().0[arm];
                for (to, from) in to.iter_mut().zip(&features[$start..$start + $count]) {
                    to.set(*from);
                }
            )*
            state.dt_sec = 0;
            state.dt_nsec = (f64::from(features[DT]) * 1e9).round() as i32;
        }
    };
}

/// A number of a state, from a feature.
trait Number {
    fn set(&mut self, value: f32);
}

impl Number for f32 {
    fn set(&mut self, value: f32) {
        *self = value;
    }
}

impl Number for i32 {
    fn set(&mut self, value: f32) {
        *self = value.round() as Self;
    }
}

layout! {
    pos, "pos", 0, 3, "um";
    pos_d, "pos_d", 3, 3, "um";
    ori, "ori", 6, 9, "1";
    ori_d, "ori_d", 15, 9, "1";
    enc_vals, "encVals", 24, 8, "counts";
    dac_val, "dac_val", 32, 8, "counts";
    tau, "tau", 40, 8, "N m";
    mpos, "mpos", 48, 8, "deg";
    jpos, "jpos", 56, 8, "deg; joint 3: m x 57.29578";
    mvel, "mvel", 64, 8, "deg/s";
    jvel, "jvel", 72, 8, "deg/s; joint 3: m/s x 57.29578";
    mpos_d, "mpos_d", 80, 8, "deg";
    jpos_d, "jpos_d", 88, 8, "deg; joint 3: m x 57.29578";
    grasp_d, "grasp_d", 96, 1, "rad";
    encoffsets, "encoffsets", 97, 8, "counts";
    jac_vel, "jac_vel", 105, 6, "-";
    jac_f, "jac_f", 111, 6, "-";
}

/// Field and index within the arm of a feature, as `jpos[2]`.
pub fn name(feature: usize) -> String {
    BLOCKS.iter().find(|block| (block.start..block.start + block.count).contains(&feature)).map_or_else(
        || format!("feature {feature}"),
        |block| {
            if block.count == 1 { block.field.to_owned() } else { format!("{}[{}]", block.field, feature - block.start) }
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_cover_all_features_once_in_order() {
        let mut next = 0;
        for block in &BLOCKS {
            assert_eq!(block.start, next, "{}", block.field);
            next += block.count;
        }
        assert_eq!(next, FEATURES);
    }

    #[test]
    fn every_arm_field_reaches_its_own_feature() {
        let mut state = RavenState::new();
        for (i, value) in state.pos.iter_mut().enumerate() {
            *value = 100 + i as i32;
        }
        for (i, value) in state.jpos.iter_mut().enumerate() {
            *value = 500.0 + i as f32;
        }
        state.grasp_d = [7.0, 8.0];
        state.jac_f[11] = -4.5;
        state.dt_nsec = 1_000_000;
        let mut features = [0.0; FEATURES];
        extract(&state, crate::GREEN, &mut features);
        assert_eq!(features[0..3], [103.0, 104.0, 105.0]);
        assert_eq!(features[56], 508.0);
        assert_eq!(features[63], 515.0);
        assert_eq!(features[96], 8.0);
        assert_eq!(features[116], -4.5);
        assert_eq!(features[DT], 0.001);
        extract(&state, crate::GOLD, &mut features);
        assert_eq!(features[0..3], [100.0, 101.0, 102.0]);
        assert_eq!(features[56], 500.0);
        assert_eq!(features[96], 7.0);
    }

    #[test]
    fn what_is_inserted_is_extracted() {
        let wanted: [f32; FEATURES] = std::array::from_fn(|feature| if feature == DT { 0.002 } else { feature as f32 - 40.0 });
        let mut state = RavenState::new();
        insert(&wanted, crate::GREEN, &mut state);
        let mut found = [0.0; FEATURES];
        extract(&state, crate::GREEN, &mut found);
        assert_eq!(found, wanted);
        // The other arm has nothing but the time step, which both share.
        extract(&state, crate::GOLD, &mut found);
        assert_eq!(found[..DT], [0.0; DT]);
    }
}
