//! Column names: quantity, joint number, unit; and how units are shown.

/// Unit of a column and the one that it is shown in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scale {
    /// Shown value = factor × column.
    pub(super) factor: f64,
    /// Name of the shown unit; empty for a bare number.
    pub(super) unit: &'static str,
}

/// Units at the end of a column name (in lower case) and how they are shown. Longer ones first.
static UNITS: [(&str, Scale); 18] = [
    ("rad_s", Scale { factor: 180.0 / std::f64::consts::PI, unit: "deg/s" }),
    ("deg_s", Scale { factor: 1.0, unit: "deg/s" }),
    ("mm_s", Scale { factor: 1.0, unit: "mm/s" }),
    ("m_s", Scale { factor: 1e3, unit: "mm/s" }),
    ("counts", Scale { factor: 1.0, unit: "counts" }),
    ("rad", Scale { factor: 180.0 / std::f64::consts::PI, unit: "deg" }),
    ("deg", Scale { factor: 1.0, unit: "deg" }),
    ("nm", Scale { factor: 1.0, unit: "N·m" }),
    ("mm", Scale { factor: 1.0, unit: "mm" }),
    ("um", Scale { factor: 1e-3, unit: "mm" }),
    ("cm", Scale { factor: 10.0, unit: "mm" }),
    ("kg", Scale { factor: 1.0, unit: "kg" }),
    ("px", Scale { factor: 1.0, unit: "px" }),
    ("hz", Scale { factor: 1.0, unit: "Hz" }),
    ("m", Scale { factor: 1e3, unit: "mm" }),
    ("n", Scale { factor: 1.0, unit: "N" }),
    ("a", Scale { factor: 1.0, unit: "A" }),
    ("s", Scale { factor: 1.0, unit: "s" }),
];

impl Scale {
    /// A bare number.
    pub(super) const PLAIN: Self = Self { factor: 1.0, unit: "" };

    /// `Title, unit`.
    pub(super) fn titled(&self, title: &str) -> String {
        if self.unit.is_empty() { title.to_owned() } else { format!("{title}, {}", self.unit) }
    }

    /// Small torques in thousandths.
    pub(super) fn fitted_to(self, most: f64) -> Self {
        if self.unit == "N·m" && most * self.factor < 0.5 { Self { factor: self.factor * 1e3, unit: "mN·m" } } else { self }
    }
}

/// A column name taken apart.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Name<'a> {
    /// Quantity, as `jpos_d`, in the letters of the file.
    pub(super) family: &'a str,
    /// Joint number.
    pub(super) index: Option<u32>,
    pub(super) scale: Scale,
}

pub(super) fn parse(name: &str) -> Name<'_> {
    let lower = name.to_ascii_lowercase();
    let ends_in = |unit: &str| lower.strip_suffix(unit).is_some_and(|rest| rest.ends_with('_') && rest.len() > 1);
    let (rest, scale) = UNITS
        .iter()
        .find(|(unit, _)| ends_in(unit))
        // Only ASCII letters change in lower case, so lengths agree.
        .map_or((name, Scale::PLAIN), |(unit, scale)| (&name[..name.len() - unit.len() - 1], *scale));
    let letters = rest.trim_end_matches(|c: char| c.is_ascii_digit());
    let family = letters.strip_suffix('_').unwrap_or(letters);
    match rest[letters.len()..].parse() {
        Ok(index) if !family.is_empty() => Name { family, index: Some(index), scale },
        _ => Name { family: rest, index: None, scale },
    }
}

/// `marker_x` as `marker` and `x`, for quantities along axes.
pub(super) fn axis(family: &str) -> Option<(&str, &str)> {
    family.rsplit_once('_').filter(|(group, axis)| !group.is_empty() && matches!(*axis, "x" | "y" | "z" | "rx" | "ry" | "rz"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_come_apart_into_quantity_joint_and_unit() {
        for (name, family, index, unit) in [
            ("jpos_d_3_m", "jpos_d", Some(3), "mm"),
            ("truth_jpos_1_rad", "truth_jpos", Some(1), "deg"),
            ("dq_2_rad_s", "dq", Some(2), "deg/s"),
            ("tau_1_Nm", "tau", Some(1), "N·m"),
            ("tau_3_N", "tau", Some(3), "N"),
            ("x_d_um", "x_d", None, "mm"),
            ("truth_z_m", "truth_z", None, "mm"),
            ("flag", "flag", None, ""),
            ("i", "i", None, ""),
            ("q_rad", "q", None, "deg"),
            ("s", "s", None, ""),
            ("_m", "_m", None, ""),
            ("in_117", "in", Some(117), ""),
            ("measured_q2_rad", "measured_q", Some(2), "deg"),
            ("42", "42", None, ""),
            ("größe_mm", "größe", None, "mm"),
        ] {
            let found = parse(name);
            assert_eq!((found.family, found.index, found.scale.unit), (family, index, unit), "{name}");
        }
    }
}
