//! Robots as files say them.
//!
//! [`RobotModel`] is any robot: a RAVEN-II ([`Robot`]) or one whose arm comes from a URDF ([`UrdfRobot`]). A file is a plant
//! file (`schema = "raven2-plant/1"`), a URDF, or a robot file:
//!
//! ```toml
//! schema = "ravenpose-robot/1"
//! name = "raven2-worn"
//! base = "raven2-nominal"     # or "urdf", with urdf = "path" or urdf_xml = '''...'''
//!
//! [plant.cable]               # any numbers of the plant file that differ
//! ke_n = [720e3, 176e3, 9.25e3]
//!
//! [homing]                    # a new static offset at each homing: standard deviation per joint, rad and m
//! offset_sd = [0.01, 0.01, 0.002, 0.0, 0.0, 0.0, 0.0]
//!
//! [stiction]                  # joint friction that holds at rest: travel over which it turns, rad, rad, m
//! presliding = [1e-4, 1e-4, 2e-5]
//!
//! [tool_cables]               # what motor 3 drags along, at its capstan (plant::Dragged)
//! stiffness_nm_rad = 0.02
//! level_nm = 0.07
//! v_s_rad_s = 4.0
//! memory_s = 0.05
//!
//! [[effect]]
//! physics = "backlash"        # a name of models/gap-vocabulary.json
//! joint = 3
//! parameters = { b = 0.0015 }
//! from_s = 5.0                # optional: acts from here on (payload picked up, cable slipped)
//! ```
//!
//! Tables of a robot from a URDF: docs/simulator.md.

mod change;
mod columns;
mod controller_model;
mod drive_model;
mod effect;
mod error;
mod fields;
mod model_error;
mod raven;
mod raven_change;
mod raven_file;
mod robot_model;
mod save;
mod tables;
mod urdf_file;
mod urdf_robot;

pub use columns::MappedColumn;
pub use controller_model::{ControllerModel, ControllerNumbers};
pub use drive_model::{Connection, DriveModel};
pub(crate) use effect::delay;
pub use effect::{Bound, Effect};
pub use error::RobotError;
pub use model_error::ModelError;
pub use raven::{Pretension, Robot};
pub use robot_model::{PayloadSite, RobotModel};
pub use urdf_robot::UrdfRobot;
