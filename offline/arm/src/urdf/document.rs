//! The elements of a URDF text as types: links, joints, transmissions. Numbers are checked here, connections in `chain.rs`.

use std::collections::HashSet;

use nalgebra::{IsometryMatrix3, Matrix3, Vector3};
use roxmltree::Document;

use super::UrdfError;
use super::element::{Element, Lines};
use super::transmission::{self, Transmission};
use crate::serial::{JointKind, JointLimits, LinkInertia};

/// All that is read.
pub(super) struct Robot {
    pub(super) name: String,
    pub(super) links: Vec<Link>,
    pub(super) joints: Vec<Joint>,
    pub(super) transmissions: Vec<Transmission>,
}

pub(super) struct Link {
    pub(super) name: String,
    /// In the link's frame; none where the text has none.
    pub(super) inertia: Option<LinkInertia>,
}

/// How a joint moves.
#[derive(Clone, PartialEq)]
pub(super) enum Motion {
    Fixed,
    Moving(JointKind),
    /// Refused if it stands in the chain: `floating`, `mimic`, ...
    Other(String),
}

pub(super) struct Joint {
    pub(super) line: usize,
    pub(super) name: String,
    pub(super) motion: Motion,
    pub(super) parent: String,
    pub(super) child: String,
    pub(super) origin: IsometryMatrix3<f64>,
    pub(super) axis: Vector3<f64>,
    pub(super) limits: JointLimits,
    pub(super) damping: f64,
    pub(super) friction: f64,
    /// What was assumed about it.
    pub(super) notes: Vec<String>,
}

pub(super) fn read(text: &str) -> Result<Robot, UrdfError> {
    let document = Document::parse(text).map_err(|error| UrdfError::Xml { what: error.to_string().replace('\n', " ") })?;
    let lines = Lines::of(text);
    let root = Element::new(document.root_element(), &lines, "robot".to_owned());
    if root.tag() != "robot" {
        return Err(UrdfError::NotARobot { line: root.line(), found: root.tag().to_owned() });
    }
    let name = root.attribute("name").filter(|name| !name.is_empty()).unwrap_or("robot").to_owned();
    let mut robot = Robot { name, links: Vec::new(), joints: Vec::new(), transmissions: Vec::new() };
    let mut taken = HashSet::new();
    for mut element in root.children() {
        match element.tag() {
            "link" => {
                let name = named(&mut element, &mut taken)?;
                robot.links.push(Link { inertia: inertia(&element)?, name });
            }
            "joint" => {
                let name = named(&mut element, &mut taken)?;
                robot.joints.push(joint(&element, name)?);
            }
            "transmission" => {
                let name = element.attribute("name").unwrap_or("without a name").to_owned();
                element.place = format!("transmission {name}");
                robot.transmissions.push(transmission::read(&element, name)?);
            }
            _ => {}
        }
    }
    Ok(robot)
}

/// The element's name, which its errors carry from here on.
fn named(element: &mut Element, taken: &mut HashSet<String>) -> Result<String, UrdfError> {
    element.tag().clone_into(&mut element.place);
    let name = element.name("name")?;
    element.place = format!("{} {name}", element.tag());
    if taken.insert(element.place.clone()) {
        Ok(name)
    } else {
        Err(UrdfError::Duplicate { line: element.line(), place: element.place.clone() })
    }
}

fn inertia(link: &Element) -> Result<Option<LinkInertia>, UrdfError> {
    let Some(inertial) = link.child("inertial")? else { return Ok(None) };
    let mass = inertial.needed("mass")?;
    let mass_kg = mass.needed_number("value")?;
    if mass_kg < 0.0 {
        return Err(mass.contradiction("its mass is negative; correct it".to_owned()));
    }
    let tensor = inertial.needed("inertia")?;
    let [xx, xy, xz, yy, yz, zz] = ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"].map(|name| tensor.needed_number(name));
    let (xy, xz, yz) = (xy?, xz?, yz?);
    let inertia_com_kg_m2 = Matrix3::new(xx?, xy, xz, xy, yy?, yz, xz, yz, zz?);
    let upright = LinkInertia { mass_kg, com_m: Vector3::zeros(), inertia_com_kg_m2 };
    Ok(Some(upright.transformed(&inertial.origin()?)))
}

fn joint(element: &Element, name: String) -> Result<Joint, UrdfError> {
    let mut notes = Vec::new();
    let motion = motion(element)?;
    let end = |tag: &str| element.needed(tag)?.name("link");
    let axis = match element.child("axis")? {
        None => Vector3::x(),
        Some(axis) => axis.vector("xyz")?.ok_or_else(|| axis.missing("attribute `xyz` of <axis>".to_owned()))?,
    };
    let limits = match &motion {
        Motion::Moving(kind) => limits(element, *kind, &mut notes)?,
        _ => JointLimits::NONE,
    };
    let dynamics = element.child("dynamics")?;
    let dynamic = |attribute: &str| -> Result<f64, UrdfError> {
        let Some(of) = &dynamics else { return Ok(0.0) };
        match of.number(attribute)? {
            Some(value) if value < 0.0 => Err(of.contradiction(format!("{attribute} is negative; correct it"))),
            value => Ok(value.unwrap_or(0.0)),
        }
    };
    Ok(Joint {
        line: element.line(),
        motion,
        parent: end("parent")?,
        child: end("child")?,
        origin: element.origin()?,
        axis,
        limits,
        damping: dynamic("damping")?,
        friction: dynamic("friction")?,
        notes,
        name,
    })
}

fn motion(element: &Element) -> Result<Motion, UrdfError> {
    let kind = element.name("type")?;
    if element.child("mimic")?.is_some() && kind != "fixed" {
        return Ok(Motion::Other("mimic".to_owned()));
    }
    Ok(match kind.as_str() {
        "fixed" => Motion::Fixed,
        "revolute" => Motion::Moving(JointKind::Revolute),
        "continuous" => Motion::Moving(JointKind::Continuous),
        "prismatic" => Motion::Moving(JointKind::Prismatic),
        _ => Motion::Other(kind),
    })
}

/// `<limit>`: what is absent is unknown, never zero, but for the one end of a range whose other end is given (URDF's default).
fn limits(joint: &Element, kind: JointKind, notes: &mut Vec<String>) -> Result<JointLimits, UrdfError> {
    let mut limits = JointLimits::NONE;
    let Some(limit) = joint.child("limit")? else {
        if kind != JointKind::Continuous {
            notes.push(format!("{}: no <limit>, its range is unknown", joint.place));
        }
        return Ok(limits);
    };
    let (lower, upper) = (limit.number("lower")?, limit.number("upper")?);
    if kind != JointKind::Continuous {
        if lower.is_some() || upper.is_some() {
            (limits.lower, limits.upper) = (lower.unwrap_or(0.0), upper.unwrap_or(0.0));
        } else {
            notes.push(format!("{}: <limit> without lower and upper, its range is unknown", joint.place));
        }
        if limits.lower > limits.upper {
            return Err(limit.contradiction(format!("lower {} exceeds upper {}; swap or correct them", limits.lower, limits.upper)));
        }
    }
    for (attribute, field) in [("velocity", &mut limits.velocity), ("effort", &mut limits.effort)] {
        match limit.number(attribute)? {
            Some(value) if value < 0.0 => return Err(limit.contradiction(format!("{attribute} is negative; correct it"))),
            // Exporters write 0 where nothing is known.
            Some(value) if value > 0.0 => *field = value,
            _ => {}
        }
    }
    Ok(limits)
}
