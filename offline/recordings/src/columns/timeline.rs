//! Header and time step of states from a file that holds time stamps only.

use ravenpose_wire::RavenState;

/// `dt` of the first state, ns: one control period (ravenstate.md, section 2).
const FIRST_DT_NS: i64 = 1_000_000;

const NS_PER_S: i64 = 1_000_000_000;

/// The time stamps so far.
#[derive(Debug, Default)]
pub(crate) struct Timeline {
    first_ns: i64,
    before_ns: i64,
    count: u64,
}

impl Timeline {
    /// Fills sequence, times and `dt` of the next state; false if the stamp is not a time that the header can hold.
    pub(crate) fn complete(&mut self, state: &mut RavenState, stamp_ns: i64) -> bool {
        let Ok(seconds) = u32::try_from(stamp_ns.div_euclid(NS_PER_S)) else {
            return false;
        };
        if self.count == 0 {
            (self.first_ns, self.before_ns) = (stamp_ns, stamp_ns - FIRST_DT_NS);
        }
        let dt_ns = stamp_ns - self.before_ns;
        state.hdr_stamp_sec = seconds;
        state.hdr_stamp_nsec = stamp_ns.rem_euclid(NS_PER_S) as u32;
        // As ROS does it: whole seconds rounded down, nanoseconds never negative. Both stamps are below 2^32 s.
        state.dt_sec = dt_ns.div_euclid(NS_PER_S).clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32;
        state.dt_nsec = dt_ns.rem_euclid(NS_PER_S) as i32;
        state.source_time_ns = stamp_ns - self.first_ns;
        state.hdr_seq = self.count as u32;
        self.count += 1;
        self.before_ns = stamp_ns;
        state.seal(self.count);
        true
    }

    /// Time stamp of the first state, ns.
    pub(crate) fn first_ns(&self) -> i64 {
        self.first_ns
    }
}
