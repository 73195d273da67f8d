//! Attributes and children of an XML element, with the place for errors.

use nalgebra::{IsometryMatrix3, Matrix3, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3};
use roxmltree::Node;

use super::UrdfError;

/// No part of an arm is as far from the one before, m: such lengths are millimetres.
const FURTHEST_M: f64 = 30.0;

/// First bytes of all lines.
pub(super) struct Lines(Vec<usize>);

impl Lines {
    pub(super) fn of(text: &str) -> Self {
        Self(std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect())
    }
}

/// An element, and what to call it in an error.
#[derive(Clone)]
pub(super) struct Element<'a> {
    node: Node<'a, 'a>,
    lines: &'a Lines,
    pub(super) place: String,
}

impl<'a> Element<'a> {
    pub(super) fn new(node: Node<'a, 'a>, lines: &'a Lines, place: String) -> Self {
        Self { node, lines, place }
    }

    /// Line of its first byte, from 1.
    pub(super) fn line(&self) -> usize {
        self.lines.0.partition_point(|&start| start <= self.node.range().start)
    }

    pub(super) fn tag(&self) -> &'a str {
        self.node.tag_name().name()
    }

    /// Elements inside, named after this one.
    pub(super) fn children(&self) -> impl Iterator<Item = Element<'a>> {
        self.node.children().filter(Node::is_element).map(|node| Self::new(node, self.lines, self.place.clone()))
    }

    /// The one child with this tag.
    pub(super) fn child(&self, tag: &str) -> Result<Option<Element<'a>>, UrdfError> {
        let mut found = self.children().filter(|child| child.tag() == tag);
        let first = found.next();
        match found.next() {
            Some(second) => Err(second.contradiction(format!("a second <{tag}>; keep one"))),
            None => Ok(first),
        }
    }

    /// The child with this tag, or an error.
    pub(super) fn needed(&self, tag: &str) -> Result<Element<'a>, UrdfError> {
        self.child(tag)?.ok_or_else(|| self.missing(format!("<{tag}>")))
    }

    pub(super) fn attribute(&self, name: &str) -> Option<&'a str> {
        self.node.attribute(name).map(str::trim)
    }

    /// A name that is not empty.
    pub(super) fn name(&self, attribute: &str) -> Result<String, UrdfError> {
        let name = self.attribute(attribute).filter(|name| !name.is_empty());
        name.map(str::to_owned).ok_or_else(|| self.missing(format!("attribute `{attribute}` of <{}>", self.tag())))
    }

    /// Text inside, trimmed.
    pub(super) fn text(&self) -> &'a str {
        self.node.text().map_or("", str::trim)
    }

    /// A finite number in an attribute.
    pub(super) fn number(&self, attribute: &str) -> Result<Option<f64>, UrdfError> {
        self.attribute(attribute).map(|text| self.parse(text, attribute)).transpose()
    }

    /// The number inside the element.
    pub(super) fn number_inside(&self) -> Result<f64, UrdfError> {
        self.parse(self.text(), "its text")
    }

    pub(super) fn needed_number(&self, attribute: &str) -> Result<f64, UrdfError> {
        self.number(attribute)?.ok_or_else(|| self.missing(format!("attribute `{attribute}` of <{}>", self.tag())))
    }

    fn parse(&self, text: &str, attribute: &str) -> Result<f64, UrdfError> {
        finite(text).ok_or_else(|| self.not_a_number(attribute, text, "a finite number"))
    }

    /// Exactly `N` finite numbers in an attribute.
    fn numbers<const N: usize>(&self, attribute: &str, expected: &'static str) -> Result<Option<[f64; N]>, UrdfError> {
        let Some(text) = self.attribute(attribute) else { return Ok(None) };
        let numbers: Option<Vec<f64>> = text.split_whitespace().map(finite).collect();
        let numbers = numbers.and_then(|numbers| <[f64; N]>::try_from(numbers).ok());
        numbers.map(Some).ok_or_else(|| self.not_a_number(attribute, text, expected))
    }

    pub(super) fn vector(&self, attribute: &str) -> Result<Option<Vector3<f64>>, UrdfError> {
        Ok(self.numbers(attribute, "three finite numbers")?.map(|numbers: [f64; 3]| Vector3::from(numbers)))
    }

    /// The pose in the child `<origin>`; the identity where there is none.
    pub(super) fn origin(&self) -> Result<IsometryMatrix3<f64>, UrdfError> {
        let Some(origin) = self.child("origin")? else { return Ok(IsometryMatrix3::identity()) };
        let position = origin.vector("xyz")?.unwrap_or_else(Vector3::zeros);
        if position.norm() > FURTHEST_M {
            return Err(
                origin.contradiction(format!("its origin is {:.0} m away; lengths of a URDF are in metres", position.norm()))
            );
        }
        let turned = origin.vector("rpy")?;
        let quaternion: Option<[f64; 4]> = origin.numbers("quat_xyzw", "four finite numbers")?;
        let rotation = match (turned, quaternion) {
            (Some(_), Some(_)) => return Err(origin.contradiction("both rpy and quat_xyzw; keep one".to_owned())),
            (Some(rpy), None) => from_rpy(&rpy),
            (None, Some([x, y, z, w])) => {
                let quaternion = UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-6);
                let quaternion = quaternion.ok_or_else(|| origin.not_a_number("quat_xyzw", "of no length", "a rotation"))?;
                quaternion.to_rotation_matrix()
            }
            (None, None) => Rotation3::identity(),
        };
        Ok(IsometryMatrix3::from_parts(Translation3::from(position), rotation))
    }

    pub(super) fn missing(&self, what: String) -> UrdfError {
        UrdfError::Missing { line: self.line(), place: self.place.clone(), what }
    }

    pub(super) fn contradiction(&self, what: String) -> UrdfError {
        UrdfError::Contradiction { line: self.line(), place: self.place.clone(), what }
    }

    fn not_a_number(&self, attribute: &str, found: &str, expected: &'static str) -> UrdfError {
        let what = format!("{attribute} of <{}>", self.tag());
        UrdfError::Number { line: self.line(), place: self.place.clone(), what, found: found.to_owned(), expected }
    }
}

fn finite(text: &str) -> Option<f64> {
    text.parse::<f64>().ok().filter(|value| value.is_finite())
}

/// URDF's fixed-axis roll, pitch, yaw: `Rz(yaw) · Ry(pitch) · Rx(roll)`.
fn from_rpy(rpy: &Vector3<f64>) -> Rotation3<f64> {
    let ((sr, cr), (sp, cp), (sy, cy)) = (rpy.x.sin_cos(), rpy.y.sin_cos(), rpy.z.sin_cos());
    Rotation3::from_matrix_unchecked(Matrix3::new(
        cy * cp,
        cy * sp * sr - sy * cr,
        cy * sp * cr + sy * sr,
        sy * cp,
        sy * sp * sr + cy * cr,
        sy * sp * cr - cy * sr,
        -sp,
        cp * sr,
        cp * cr,
    ))
}

/// The inverse of [`from_rpy`]; accurate where the pitch is a right angle too, since the roll is read from what yaw and
/// pitch leave.
pub(super) fn to_rpy(rotation: &Rotation3<f64>) -> Vector3<f64> {
    let r = rotation.matrix();
    let yaw = r.m21.atan2(r.m11);
    let pitch = (-r.m31).atan2(r.m11.hypot(r.m21));
    let rest = from_rpy(&Vector3::new(0.0, pitch, yaw)).matrix().transpose() * r;
    Vector3::new(rest.m32.atan2(rest.m22), pitch, yaw)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roll_pitch_yaw_round_trips_at_right_angles_too() {
        let half = std::f64::consts::FRAC_PI_2;
        for pitch in [0.3, half, -half, half - 1e-9, -half + 1e-12, 2.0] {
            for (roll, yaw) in [(0.0, 0.0), (1.0, -2.0), (-3.0, 0.5)] {
                let rotation = from_rpy(&Vector3::new(roll, pitch, yaw));
                let back = from_rpy(&to_rpy(&rotation));
                assert!((back.matrix() - rotation.matrix()).amax() < 1e-15, "{roll} {pitch} {yaw}");
                let known = Rotation3::from_euler_angles(roll, pitch, yaw);
                assert!((known.matrix() - rotation.matrix()).amax() < 1e-15);
            }
        }
    }
}
