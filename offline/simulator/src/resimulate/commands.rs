//! The commands of a recording at any time.

use super::{ResimulateError, Run};
use crate::model::RobotModel;
use crate::plant::Vector;

/// Commanded joints of a recording, complete for the robot: joints of a RAVEN-II's tool that were not commanded stand at home.
#[derive(Debug, Clone, PartialEq)]
pub struct Commands {
    time_s: Vec<f64>,
    rows: Vec<Vector>,
}

impl Commands {
    /// Of a run.
    ///
    /// # Errors
    /// [`ResimulateError`] without commands.
    pub fn of_run(model: &RobotModel, run: &Run) -> Result<Self, ResimulateError> {
        let Some(commands) = &run.joints_d else {
            let unit = model.joint_kinds()[0].position_unit();
            return Err(run.missing(&format!("jpos_d_1_{unit}"), "its commands are the commanded position of every joint"));
        };
        let mut rows = commands.clone();
        if let Some(robot) = model.as_raven() {
            let n = model.joint_count();
            // A log of states has the columns of a tool that was not commanded, too.
            let has_tool = commands.iter().any(|row| row[n..].iter().any(|value| *value != 0.0));
            let home = &robot.raven.plant().limits.home;
            for joint in (n..home.len()).filter(|joint| !has_tool || run.uncommanded[*joint]) {
                for row in &mut rows {
                    row[joint] = home[joint];
                }
            }
        }
        Ok(Self { time_s: run.time_s.clone(), rows })
    }

    /// Joints at the first row.
    pub fn first(&self) -> &Vector {
        &self.rows[0]
    }

    /// Rates at the first row.
    pub fn first_rates(&self) -> Vector {
        let span_s = self.time_s[1] - self.time_s[0];
        std::array::from_fn(|i| (self.rows[1][i] - self.rows[0][i]) / span_s)
    }

    /// From the first to the last row, s.
    pub fn duration_s(&self) -> f64 {
        self.time_s[self.time_s.len() - 1] - self.time_s[0]
    }

    /// Joints at a time since the first row, s: on the line between two rows, at rest beyond the ends.
    pub fn at(&self, time_s: f64) -> Vector {
        let time_s = time_s + self.time_s[0];
        let after = self.time_s.partition_point(|row_s| *row_s <= time_s + 1e-9).min(self.rows.len() - 1);
        let before = after.saturating_sub(1);
        let span_s = self.time_s[after] - self.time_s[before];
        let share = if span_s > 0.0 { ((time_s - self.time_s[before]) / span_s).clamp(0.0, 1.0) } else { 0.0 };
        // On a row (but for rounding) the row itself.
        let share = if share < 1e-6 { 0.0 } else { share };
        std::array::from_fn(|i| self.rows[before][i] + share * (self.rows[after][i] - self.rows[before][i]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_is_itself_and_between_two_there_is_a_line() {
        let time_s: Vec<f64> = (0..50).map(|k| 7.0 + f64::from(k) * 1e-3).collect();
        let rows: Vec<Vector> = (0..50).map(|k| [f64::from(k).sin(); 8]).collect();
        let commands = Commands { time_s, rows: rows.clone() };
        for (k, row) in rows.iter().enumerate() {
            assert_eq!(commands.at(k as f64 * 1e-3), *row, "{k}");
        }
        assert!((commands.at(0.0105)[0] - f64::midpoint(rows[10][0], rows[11][0])).abs() < 1e-9);
        assert_eq!(commands.at(9.0), rows[49]);
        assert_eq!(commands.at(-1.0), rows[0]);
    }
}
