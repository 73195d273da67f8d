//! Why a recording cannot be used.

/// Why a recording cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RunError {
    /// Fewer than two rows.
    #[error("{run}: has {rows} rows; record at least 9 s, better two runs of 30 s")]
    Rows {
        /// File of the run.
        run: String,
        /// Their number.
        rows: usize,
    },
    /// Time that is not one.
    #[error("{run}: row {row} after the header: {what}")]
    Time {
        /// File of the run.
        run: String,
        /// Row, from 1.
        row: usize,
        /// What is wrong and what would do.
        what: String,
    },
    /// A joint of another kind.
    #[error("{run}: has {column}, but joint {joint} of the robot {robot} {moves}; give the robot of this recording with --robot")]
    OtherJoint {
        /// File of the run.
        run: String,
        /// The column that tells.
        column: String,
        /// Number of the joint, from 1.
        joint: usize,
        /// The robot.
        robot: String,
        /// What the robot's joint does.
        moves: &'static str,
    },
    /// A sensor that says nothing.
    #[error(
        "{run}: {column} is the same in every row although {moving}; leave the column out if it was not recorded, or mend the sensor"
    )]
    Constant {
        /// File of the run.
        run: String,
        /// The column.
        column: String,
        /// Why it should not be.
        moving: String,
    },
    /// A robot that stands still.
    #[error("{run}: nothing moves: {column} and every other position is the same in every row; record while all joints move")]
    Still {
        /// File of the run.
        run: String,
        /// The first position.
        column: String,
    },
    /// A table without a time.
    #[error("{run}: has no column t_s; give a run with time, not a table")]
    NoTime {
        /// File of the run.
        run: String,
    },
    /// Neither motor nor joint positions of some joint.
    #[error(
        "{run}: has neither mpos_{joint}_rad nor jpos_{joint}_{unit}; the robot {robot} has {joints} joints, give its recording or another --robot"
    )]
    NoPosition {
        /// File of the run.
        run: String,
        /// Number of the joint, from 1.
        joint: usize,
        /// Its unit.
        unit: &'static str,
        /// The robot.
        robot: String,
        /// Its joints.
        joints: usize,
    },
    /// A time in another unit.
    #[error("{run}: its rows are {times} times as far apart as those of {other}: a time in {unit}; give t_s in seconds")]
    UnitOfTime {
        /// File of the run.
        run: String,
        /// That of its recording or simulation.
        other: String,
        /// How much further apart.
        times: String,
        /// The unit that it has.
        unit: &'static str,
    },
    /// Nothing overlaps.
    #[error(
        "{sim}: its time ({sim_s}) and that of the recording {run} ({run_s}) do not overlap; give the runs in the same order, on one clock"
    )]
    NoOverlap {
        /// File of the run.
        run: String,
        /// Its first and last time.
        run_s: String,
        /// File of the simulation.
        sim: String,
        /// Its first and last time.
        sim_s: String,
    },
}
