//! The sets of cases: `small` for every change, `full` for a release, `dev` to tune with. Labels hold the name of the set, so no
//! two sets share a trajectory or a parameter even at the same seed.

use crate::logger::Logging;
use crate::order::{Kind, Order, Wanted};
use crate::random::Random;
use crate::trajectory::Excitation;

/// The physics of the vocabulary.
pub const PHYSICS: [&str; 22] = [
    "coulomb_friction",
    "viscous_friction",
    "stribeck_friction",
    "load_dependent_friction",
    "backlash",
    "cable_stretch",
    "cable_hysteresis",
    "cable_creep",
    "joint_coupling",
    "payload",
    "gravity_direction",
    "link_inertia",
    "motor_torque_scale",
    "torque_ripple",
    "joint_offset",
    "transmission_ratio",
    "pulley_eccentricity",
    "link_geometry",
    "measurement_delay",
    "frame_misalignment",
    "external_contact",
    "thermal_drift",
];

/// What no name of the vocabulary covers.
pub const OUTSIDE: [&str; 6] = [
    "outside:cubic_stiffness",
    "outside:position_friction",
    "outside:drag",
    "outside:cable_slack",
    "outside:missed_counts",
    "outside:gain_change",
];

/// Pairs that are easily taken for one another, with the joint that makes it hardest.
const CONFUSABLE: [(&str, &str, Option<usize>); 14] = [
    ("payload", "link_inertia", Some(3)),
    ("joint_offset", "gravity_direction", Some(1)),
    ("joint_offset", "frame_misalignment", Some(1)),
    ("motor_torque_scale", "payload", Some(2)),
    ("coulomb_friction", "load_dependent_friction", Some(2)),
    ("coulomb_friction", "thermal_drift", Some(1)),
    ("coulomb_friction", "viscous_friction", Some(1)),
    ("backlash", "coulomb_friction", Some(3)),
    ("cable_hysteresis", "backlash", Some(3)),
    ("cable_creep", "thermal_drift", Some(2)),
    ("measurement_delay", "viscous_friction", Some(2)),
    ("measurement_delay", "cable_stretch", Some(2)),
    ("transmission_ratio", "joint_coupling", Some(1)),
    ("transmission_ratio", "link_geometry", Some(2)),
];

/// A set under construction.
struct Set {
    seed: u64,
    name: &'static str,
    orders: Vec<Order>,
}

impl Set {
    fn add(&mut self, block: &str, effects: Vec<Wanted>, change: impl FnOnce(&mut Order)) {
        let label = format!("{}/{block}/{}", self.name, self.orders.len());
        let mut order = Order { seed: self.seed, label, block: block.into(), effects, ..Order::default() };
        change(&mut order);
        self.orders.push(order);
    }

    fn nulls(&mut self, noise: f64, count: usize, runs: usize) {
        self.nothing("null", count, |order| {
            order.noise = noise;
            order.runs = runs;
        });
    }

    /// Cases without an effect, every fourth on another arm.
    fn nothing(&mut self, block: &str, count: usize, change: impl Fn(&mut Order)) {
        for index in 0..count {
            self.add(block, Vec::new(), |order| {
                order.robot = kind(index % 4 == 3);
                change(order);
            });
        }
    }

    /// An arm that mostly stands, and nothing else.
    fn standing(&mut self, count: usize) {
        self.nothing("poor", count, |order| order.excitation = Excitation::Poor);
    }

    /// What a faulty logger wrote: of nothing, and of each effect.
    fn faulty(&mut self, nulls: usize, severities: &[f64]) {
        self.nothing("faulty", nulls, |order| order.logging = Logging::Faulty);
        for physics in PHYSICS {
            for &severity in severities {
                self.add("faulty", vec![wanted(physics, severity)], |order| order.logging = Logging::Faulty);
            }
        }
    }

    /// Arms unlike that of the examples: each effect once on each, and nothing.
    fn arms(&mut self, severities: &[f64], nulls: usize) {
        for robot in [Kind::Six, Kind::Planar, Kind::Gantry] {
            for (index, physics) in PHYSICS.into_iter().enumerate() {
                let effect = wanted(physics, severities[index % severities.len()]);
                self.add("arms", vec![effect], |order| order.robot = robot);
            }
            for _ in 0..nulls {
                self.add("arms", Vec::new(), |order| order.robot = robot);
            }
        }
    }

    fn outside(&mut self, severities: &[f64], repeats: usize) {
        for physics in OUTSIDE {
            for repeat in 0..repeats {
                for &severity in severities {
                    self.add("outside", vec![wanted(physics, severity)], |order| order.robot = kind(repeat % 4 == 3));
                }
            }
        }
    }

    /// Effects that are at other times in other runs.
    fn by_run(&mut self, severities: &[f64], repeats: usize) {
        for physics in PHYSICS {
            for repeat in 0..repeats {
                let effect = Wanted { by_run: true, ..wanted(physics, severities[repeat % severities.len()]) };
                self.add("by_run", vec![effect], |order| {
                    order.runs = 3 + repeat % 2;
                    order.robot = kind(repeat % 4 == 3);
                });
            }
        }
    }

    fn pairs(&mut self, count: usize, severities: &[f64]) {
        let mut random = Random::new(self.seed, &format!("{}/pairs", self.name));
        for index in 0..count {
            let (a, b, joint) = if let Some(known) = CONFUSABLE.get(index) {
                *known
            } else {
                let first = random.index(PHYSICS.len());
                (PHYSICS[first], PHYSICS[(first + 1 + random.index(PHYSICS.len() - 1)) % PHYSICS.len()], None)
            };
            for &severity in severities {
                let effects = [a, b].map(|physics| Wanted { joint, ..wanted(physics, severity) });
                self.add("pairs", effects.into(), |_| ());
            }
        }
    }
}

fn wanted(physics: &str, severity: f64) -> Wanted {
    Wanted { physics: physics.into(), severity: Some(severity), ..Wanted::default() }
}

fn kind(other: bool) -> Kind {
    if other { Kind::Variant } else { Kind::Raven }
}

/// A set by its name, ordered by case identifier so that not even the order of making tells a block.
pub fn named(name: &str, seed: u64) -> Option<Vec<Order>> {
    let mut orders = match name {
        "small" => small(seed),
        "full" => full(seed),
        "dev" => dev(seed),
        _ => return None,
    };
    orders.sort_by_cached_key(Order::id);
    Some(orders)
}

/// 22 effects at three severities, and 30 nulls.
fn small(seed: u64) -> Vec<Order> {
    let mut set = Set { seed, name: "small", orders: Vec::new() };
    for physics in PHYSICS {
        for severity in [0.3, 1.0, 3.0] {
            set.add("single", vec![wanted(physics, severity)], |_| ());
        }
    }
    set.nulls(1.0, 30, 2);
    set.orders
}

/// The matrix of the design, section 9, a block of effects as large as those of data/gap-examples, and one of effects by run.
fn full(seed: u64) -> Vec<Order> {
    let mut set = Set { seed, name: "full", orders: Vec::new() };
    for physics in PHYSICS {
        for severity in [0.3, 1.0, 3.0] {
            for noise in [1.0, 2.0, 4.0] {
                for repeat in 0..5 {
                    let effect = Wanted { onset: repeat == 4, ..wanted(physics, severity) };
                    set.add("single", vec![effect], |order| {
                        order.noise = noise;
                        order.robot = kind(repeat == 3);
                    });
                }
            }
        }
        for severity in [10.0, 30.0] {
            for repeat in 0..5 {
                let effect = Wanted { onset: repeat == 4, ..wanted(physics, severity) };
                set.add("strong", vec![effect], |order| order.robot = kind(repeat == 3));
            }
        }
        for repeat in 0..5 {
            let severity = [1.0, 3.0][repeat % 2];
            set.add("poor", vec![wanted(physics, severity)], |order| order.excitation = Excitation::Poor);
        }
    }
    for noise in [1.0, 2.0, 4.0] {
        set.nulls(noise, 110, 2);
    }
    set.pairs(60, &[1.0, 3.0]);
    set.outside(&[3.0, 10.0], 5);
    set.by_run(&[3.0, 10.0], 4);
    set.nulls(1.0, 22, 4);
    set.standing(44);
    set.faulty(44, &[3.0, 10.0]);
    set.pairs(60, &[10.0, 30.0]);
    set.arms(&[3.0, 10.0], 22);
    set.orders
}

/// A set to tune with: every kind of case once or a few times.
fn dev(seed: u64) -> Vec<Order> {
    let mut set = Set { seed, name: "dev", orders: Vec::new() };
    for physics in PHYSICS {
        for severity in [0.3, 1.0, 3.0] {
            set.add("single", vec![wanted(physics, severity)], |_| ());
        }
        for severity in [10.0, 30.0] {
            set.add("strong", vec![wanted(physics, severity)], |_| ());
        }
        set.add("onset", vec![Wanted { onset: true, ..wanted(physics, 10.0) }], |_| ());
        set.add("variant", vec![wanted(physics, 3.0)], |order| order.robot = Kind::Variant);
        set.add("poor", vec![wanted(physics, 3.0)], |order| order.excitation = Excitation::Poor);
    }
    set.nulls(1.0, 30, 2);
    set.pairs(20, &[3.0]);
    set.outside(&[3.0, 10.0], 1);
    set.by_run(&[10.0], 2);
    set.standing(12);
    set.faulty(12, &[3.0]);
    set.pairs(20, &[30.0]);
    set.arms(&[3.0], 6);
    set.orders
}
