//! One sentence per physics: what the robot has and the simulation lacks, where, how much. They start with a small letter and
//! end without a full stop, so that others can be built around them.

use super::amount::{amount, amount_beside, amount_in, degrees, per_cent, size};
use super::joints::{joint, joints};
use super::number::{percent, short, with_unit};
use super::unit::Scale;
use crate::{Channel, Feature, Location, Parameter, Physics, Subsystem, Verdict};

/// What a verdict says.
pub(crate) fn sentence(verdict: &Verdict) -> String {
    let facts = Facts(verdict);
    let at = joints(&verdict.location.joint);
    let said = match &verdict.physics {
        Physics::CoulombFriction => facts.more(&at, "f_c", "dry friction"),
        Physics::ViscousFriction => facts.viscous(&at),
        Physics::StribeckFriction => facts.stribeck(&at),
        Physics::LoadDependentFriction => facts.load_dependent(&at),
        Physics::Backlash => facts.more(&at, "b", "play"),
        Physics::CableStretch if facts.is_less("k") => {
            format!(
                "the cable of {at} gives way under load less than in the simulation{}",
                facts.with(", by that of a spring of ", "k")
            )
        }
        Physics::CableStretch => {
            format!("the cable of {at} gives way under load{}, which the simulation lacks", facts.with(" like a spring of ", "k"))
        }
        Physics::CableHysteresis => format!(
            "the cable of {at} does not return the way it came: stretching and releasing differ{}, which the simulation lacks",
            facts.with(" over ", "z_m")
        ),
        Physics::CableCreep if facts.is_less("J_k") => format!(
            "the cable of {at} goes on stretching under a steady load less than in the simulation{}",
            facts.with(", with a time constant of ", "T_k")
        ),
        Physics::CableCreep => format!(
            "the cable of {at} goes on stretching under a steady load{}, which the simulation lacks",
            facts.with(", with a time constant of ", "T_k")
        ),
        Physics::JointCoupling => facts.coupling(),
        Physics::Payload => facts.payload(),
        Physics::GravityDirection => facts.tilt(),
        Physics::LinkInertia => facts.inertia(&at),
        Physics::MotorTorqueScale => facts.motor(&at),
        Physics::TorqueRipple => facts.ripple(&at),
        Physics::JointOffset => format!("the zero of {at} is off{}", facts.with(" by ", "o")),
        Physics::TransmissionRatio => facts.ratio(&at),
        Physics::PulleyEccentricity => facts.eccentricity(&at),
        Physics::LinkGeometry => facts.geometry(&at),
        Physics::MeasurementDelay => facts.delay(),
        Physics::FrameMisalignment => facts.frame(),
        Physics::ExternalContact => {
            format!("something outside presses against the arm{}, which the simulation lacks", facts.with(" with up to ", "f_max"))
        }
        Physics::ThermalDrift => facts.thermal(&at),
        Physics::None => "the simulation agrees with the recordings: no difference beyond noise".to_owned(),
        Physics::Unmodelled => facts.unmodelled(&at),
        Physics::Plugin(name) => format!("the added hypothesis \u{201c}{name}\u{201d} explains the difference at {at}"),
    };
    said + &when(&verdict.location)
}

/// From when to when, if it is not always.
fn when(location: &Location) -> String {
    match location.time_intervals.as_slice() {
        [] => String::new(),
        [one] => {
            format!(", from {:.1} to {}\u{a0}s of {}", one.start_s, format_args!("{:.1}", one.end_s), one.run)
        }
        several => format!(", in {} stretches of time", several.len()),
    }
}

/// A verdict read for its numbers.
struct Facts<'a>(&'a Verdict);

impl Facts<'_> {
    fn parameter(&self, name: &str) -> Option<&Parameter> {
        self.0.parameters.iter().find(|parameter| parameter.name == name)
    }

    /// ` of 12.1 N (11.3 to 12.9)`; nothing if the parameter is not there.
    fn with(&self, before: &str, name: &str) -> String {
        self.parameter(name).map_or_else(String::new, |parameter| format!("{before}{}", amount(&size(parameter))))
    }

    /// Has the robot less of it than the simulation?
    fn is_less(&self, name: &str) -> bool {
        self.parameter(name).is_some_and(|parameter| parameter.value < 0.0)
    }

    /// The value alone.
    fn bare(&self, before: &str, name: &str, after: &str) -> String {
        let text = |parameter: &Parameter| format!("{before}{}{after}", with_unit(parameter.value.abs(), &parameter.unit));
        self.parameter(name).map_or_else(String::new, text)
    }

    /// More, or less, of something that the simulation has too little or too much of.
    fn more(&self, at: &str, name: &str, what: &str) -> String {
        match self.parameter(name) {
            Some(parameter) if parameter.value < 0.0 => {
                format!("{at} has {} less {what} than the simulation", amount(&size(parameter)))
            }
            Some(parameter) => format!("{at} has {} of {what} that the simulation lacks", amount(parameter)),
            None => format!("{at} has {what} that the simulation lacks"),
        }
    }

    fn viscous(&self, at: &str) -> String {
        match self.parameter("b") {
            Some(b) if b.value < 0.0 => {
                format!("friction in {at} grows less with speed than in the simulation, by {}", amount(&size(b)))
            }
            _ => format!("friction in {at} grows with speed{}, which the simulation lacks", self.with(" by ", "b")),
        }
    }

    fn stribeck(&self, at: &str) -> String {
        let (rest, moving, speed) = (self.with(" from ", "f_s"), self.with(" to ", "f_c"), self.bare(" above ", "v_s", ""));
        format!("{at} sticks: its friction falls{rest}{moving}{speed}, which the simulation lacks")
    }

    fn load_dependent(&self, at: &str) -> String {
        let by = self.parameter("mu_l").map_or_else(String::new, |mu| format!(" by {} of it", amount_in(&size(mu), &per_cent())));
        if self.is_less("mu_l") {
            return format!(
                "friction in {at} grows with load less than in the simulation{}{by}",
                if by.is_empty() { "" } else { "," }
            );
        }
        format!("friction in {at} grows with load{by}, which the simulation lacks")
    }

    /// The first joint is moved, the second moves it.
    fn coupling(&self) -> String {
        let by = self.with(" by ", "c_ij");
        match self.0.location.joint.as_slice() {
            [moved, mover, ..] => {
                format!("{} drags {} along{by}, beyond what the simulation has", joint(mover), joint(moved))
            }
            [moved] => format!("{} is dragged along{by} by another joint, beyond what the simulation has", joint(moved)),
            [] => format!("one joint drags another along{by}, beyond what the simulation has"),
        }
    }

    fn payload(&self) -> String {
        match self.parameter("m_p") {
            Some(mass) if mass.value < 0.0 => format!("the tool is {} lighter than in the simulation", amount(&size(mass))),
            Some(mass) => format!("the tool carries {} that the simulation does not know of", amount(mass)),
            None => "the tool carries a load that the simulation does not know of".to_owned(),
        }
    }

    fn tilt(&self) -> String {
        let about =
            |name: &str, axis: &str| self.parameter(name).map(|angle| format!("{} about {axis}", amount_in(angle, &degrees())));
        let axes: Vec<String> = [about("a", "x"), about("b", "y")].into_iter().flatten().collect();
        let by = if axes.is_empty() { String::new() } else { format!(" by {}", axes.join(" and ")) };
        format!("the base is tilted{by} against the simulation")
    }

    fn inertia(&self, at: &str) -> String {
        let Some(found) = self.0.parameters.first() else {
            return format!("the link at {at} has another mass or inertia than in the simulation");
        };
        let (by, less) = (amount(&size(found)), found.value < 0.0);
        if self.0.location.subsystem == Subsystem::Motor {
            return format!("the drive of {at} has {by} {} inertia than in the simulation", if less { "less" } else { "more" });
        }
        match found.unit.as_str() {
            "kg" => format!("the link at {at} is {by} {} than in the simulation", if less { "lighter" } else { "heavier" }),
            "kg.m" => format!("the mass of the link at {at} lies elsewhere than in the simulation, by a moment of {by}"),
            _ => format!("the link at {at} is {} to turn than in the simulation, by {by}", if less { "easier" } else { "harder" }),
        }
    }

    fn motor(&self, at: &str) -> String {
        match self.parameter("kappa") {
            Some(kappa) if kappa.value < 0.0 => format!("the recorded motor torque of {at} has the opposite sign"),
            Some(kappa) if kappa.value == 1.0 => {
                let by = self.parameter("d_0").map_or_else(String::new, |by| format!(" {}", amount(by)));
                format!("the motor of {at} gives a constant torque{by} that the simulation lacks")
            }
            Some(kappa) => {
                format!("the motor of {at} gives {} times the torque that the simulation assumes", amount_beside(kappa, 1.0))
            }
            None => format!("the motor of {at} gives another torque than the simulation assumes"),
        }
    }

    fn ripple(&self, at: &str) -> String {
        // Orders are whole numbers, known or fitted.
        let times = |order: &Parameter| {
            let whole = (order.value - order.value.round()).abs() < 0.05;
            let count = if whole { format!("{:.0}", order.value) } else { short(order.value) };
            format!(", {count} times per turn")
        };
        let order = self.parameter("order").map_or_else(String::new, times);
        format!("the motor torque of {at} ripples{}{order}, which the simulation lacks", self.with(" by ", "amp"))
    }

    fn ratio(&self, at: &str) -> String {
        match self.parameter("e") {
            Some(e) => {
                let way = if e.value < 0.0 { "less far" } else { "further" };
                format!("{at} moves {} {way} than the simulation says", amount_in(&size(e), &per_cent()))
            }
            None => format!("{at} moves by another ratio than the simulation says"),
        }
    }

    fn eccentricity(&self, at: &str) -> String {
        let every = self.bare(", once every ", "period", " of travel");
        format!("a pulley of {at} runs out of true{}{every}", self.with(" by ", "e_over_r"))
    }

    fn geometry(&self, at: &str) -> String {
        let length = self.parameter("d_length").map(|length| {
            let by = amount(&size(length));
            match length.along() {
                Some([_, way]) => format!("is moved by {by} along {way} of the frame before it"),
                None => format!("is {by} {}", if length.value < 0.0 { "shorter" } else { "longer" }),
            }
        });
        let twist = self.parameter("d_alpha").map(|twist| format!("is twisted by {}", amount_in(&size(twist), &degrees())));
        let both: Vec<String> = [length, twist].into_iter().flatten().collect();
        let how = if both.is_empty() { "has another shape".to_owned() } else { both.join(" and ") };
        format!("the link at {at} {how} against the simulation")
    }

    fn delay(&self) -> String {
        let location = &self.0.location;
        let what = match location.subsystem {
            Subsystem::Camera => "camera positions",
            Subsystem::Motor | Subsystem::Amplifier | Subsystem::Controller => "motor torques",
            Subsystem::Sensor => "sensor readings",
            _ => match location.channel {
                Channel::EndEffector => "positions of the tip",
                Channel::JointTorque => "motor torques",
                _ => "measurements",
            },
        };
        let of = if location.joint.is_empty() { String::new() } else { format!(" of {}", joints(&location.joint)) };
        match (self.parameter("d"), self.parameter("clock_drift")) {
            // Which of the two is late is not to be seen.
            (Some(d), _) if location.channel == Channel::Transmission => {
                format!(
                    "joint encoders and motor positions are {} further apart in time than the simulation assumes",
                    amount(&size(d))
                )
            }
            (Some(d), _) => {
                let way = if d.value < 0.0 { "earlier" } else { "later" };
                format!("{what}{of} arrive {} {way} than the simulation assumes", amount(&size(d)))
            }
            (None, Some(drift)) => {
                let millionths = Scale { name: "millionths".to_owned(), per_unit: 1e6 };
                format!("the clocks drift apart, by {} of the time", amount_in(&size(drift), &millionths))
            }
            (None, None) => format!("{what}{of} arrive at another time than the simulation assumes"),
        }
    }

    /// The greatest turn and the greatest shift; those that may be zero are left out.
    fn frame(&self) -> String {
        let greatest = |prefix: &str| {
            let of_prefix = self.0.parameters.iter().filter(|parameter| parameter.name.starts_with(prefix));
            let certain = of_prefix.filter(|parameter| parameter.ci95[0] * parameter.ci95[1] > 0.0);
            certain.max_by(|a, b| a.value.abs().total_cmp(&b.value.abs()))
        };
        let axis = |parameter: &Parameter| parameter.name.chars().next_back().unwrap_or('?');
        let turn = greatest("w_").map(|w| format!("turned by {} about {}", amount_in(&size(w), &degrees()), axis(w)));
        let shift = greatest("t_").map(|t| format!("shifted by {} along {}", amount(&size(t)), axis(t)));
        let both: Vec<String> = [turn, shift].into_iter().flatten().collect();
        let how = if both.is_empty() { "turned or shifted".to_owned() } else { both.join(" and ") };
        format!("the camera\u{2019}s frame is {how} against the robot\u{2019}s")
    }

    fn thermal(&self, at: &str) -> String {
        let within = self.bare(", with a time constant of ", "T", "");
        if self.0.location.channel != Channel::JointTorque {
            return format!("the position of {at} drifts as it warms up{within}, which the simulation lacks");
        }
        match self.parameter("kappa_T") {
            Some(kappa) => {
                let way = if kappa.value < 0.0 { "rises" } else { "falls" };
                // More than twice of all that there is: until it has ended, a size makes up for its time constant.
                if kappa.ci95[1] - kappa.ci95[0] > 2.0 {
                    let way = if kappa.ci95[0] < 0.0 && kappa.ci95[1] > 0.0 { "changes" } else { way };
                    return format!(
                        "friction in {at} {way} as the motor warms up, which the simulation lacks; how far it will go, and how fast, these recordings are too \
                         short to tell"
                    );
                }
                let by = amount_in(&size(kappa), &per_cent());
                format!("friction in {at} {way} by {by} as the motor warms up{within}, which the simulation lacks")
            }
            None => format!("friction in {at} changes as the motor warms up{within}, which the simulation lacks"),
        }
    }

    fn unmodelled(&self, at: &str) -> String {
        let location = &self.0.location;
        let share = location.energy_share.map_or_else(String::new, |share| format!(" ({} of the error)", percent(share)));
        let depends: Vec<&str> = location.regime.iter().filter_map(|regime| plain_feature(regime.feature)).collect();
        let goes_with = if depends.is_empty() { String::new() } else { format!("; it goes with {}", depends.join(" and ")) };
        format!("the simulation lacks something at {at}{share} that no known physics explains{goes_with}")
    }
}

/// What a condition depends on, in a sentence; none for `always`.
pub(crate) fn plain_feature(feature: Feature) -> Option<&'static str> {
    match feature {
        Feature::All => None,
        Feature::VelocitySign => Some("the direction of motion"),
        Feature::Reversal => Some("reversals"),
        Feature::Speed => Some("speed"),
        Feature::Load => Some("load"),
        Feature::Posture => Some("posture"),
        Feature::MotorAngle => Some("the motor\u{2019}s angle"),
        Feature::Time => Some("time"),
        Feature::TemperatureProxy => Some("warming up"),
        Feature::Frequency => Some("frequency"),
        Feature::OtherJoint => Some("the motion of another joint"),
        Feature::Contact => Some("contact"),
    }
}
