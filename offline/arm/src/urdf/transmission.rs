//! `<transmission>` as ROS writes it: one motor on one joint. Everything else is refused by name.

use super::UrdfError;
use super::element::Element;

/// A simple transmission.
pub(super) struct Transmission {
    pub(super) line: usize,
    pub(super) name: String,
    pub(super) joint: String,
    pub(super) actuator: Option<String>,
    /// None where the text has none.
    pub(super) reduction: Option<f64>,
    pub(super) offset: f64,
}

pub(super) fn read(element: &Element, name: String) -> Result<Transmission, UrdfError> {
    let refuse = |what: String| UrdfError::Transmission { line: element.line(), name: name.clone(), what };
    // The type is an element, in the oldest form an attribute.
    let kind = match element.child("type")? {
        Some(kind) => kind.text(),
        None => element.attribute("type").unwrap_or(""),
    };
    let kind = if kind.is_empty() { "of no type" } else { kind };
    if kind.rsplit(['/', ':', '.']).next() != Some("SimpleTransmission") {
        return Err(refuse(format!("it is {kind}")));
    }
    let (joints, actuators) = (ends(element, "joint"), ends(element, "actuator"));
    if joints.len() != 1 || actuators.len() > 1 {
        return Err(refuse(format!("it has {} joints and {} actuators", joints.len(), actuators.len())));
    }
    let offset = match joints[0].child("offset")? {
        Some(offset) => offset.number_inside()?,
        None => 0.0,
    };
    let actuator = actuators.first().map(|actuator| actuator.name("name")).transpose()?;
    let reduction = reduction(element, &joints[0], actuators.first())?;
    Ok(Transmission { line: element.line(), joint: joints[0].name("name")?, actuator, reduction, offset, name })
}

fn ends<'a>(element: &Element<'a>, tag: &str) -> Vec<Element<'a>> {
    element.children().filter(|child| child.tag() == tag).collect()
}

/// `mechanicalReduction` stands in the actuator; older files have it in the joint or the transmission.
fn reduction(element: &Element, joint: &Element, actuator: Option<&Element>) -> Result<Option<f64>, UrdfError> {
    let mut found = None;
    for place in actuator.into_iter().chain([joint, element]) {
        let Some(reduction) = place.child("mechanicalReduction")? else { continue };
        let value = reduction.number_inside()?;
        if value == 0.0 {
            return Err(reduction.contradiction("mechanicalReduction is 0; give motor turns per joint turn".to_owned()));
        }
        if found.is_some_and(|before| before != value) {
            return Err(reduction.contradiction("two mechanicalReductions that differ; keep one".to_owned()));
        }
        found = Some(value);
    }
    Ok(found)
}
