//! Column names of tidy CSV: `QUANTITY[_INDEX]_UNIT`, in any case, with an optional prefix `sim_`.

use std::collections::HashSet;

use super::error::CsvProblem;

/// What a column of the file becomes.
pub(crate) struct Field {
    /// Name with the SI unit for a known quantity, that of the file otherwise.
    pub(crate) name: String,
    /// Is the quantity one of the table?
    pub(crate) known: bool,
    /// May cells be empty?
    pub(super) truth: bool,
    /// From the unit of the file.
    pub(crate) to_si: fn(f64) -> f64,
}

/// A unit of the file, the SI unit that it becomes, and the conversion.
struct Unit {
    name: &'static str,
    si: &'static str,
    to_si: fn(f64) -> f64,
}

fn same(value: f64) -> f64 {
    value
}

/// Units that a column name may end with; `nm` is N·m, `n` is N.
static UNITS: [Unit; 15] = [
    Unit { name: "rad", si: "rad", to_si: same },
    Unit { name: "deg", si: "rad", to_si: f64::to_radians },
    Unit { name: "m", si: "m", to_si: same },
    Unit { name: "cm", si: "m", to_si: |value| value / 1e2 },
    Unit { name: "mm", si: "m", to_si: |value| value / 1e3 },
    Unit { name: "um", si: "m", to_si: |value| value / 1e6 },
    Unit { name: "s", si: "s", to_si: same },
    Unit { name: "rad_s", si: "rad_s", to_si: same },
    Unit { name: "deg_s", si: "rad_s", to_si: f64::to_radians },
    Unit { name: "m_s", si: "m_s", to_si: same },
    Unit { name: "nm", si: "nm", to_si: same },
    Unit { name: "n", si: "n", to_si: same },
    Unit { name: "counts", si: "counts", to_si: same },
    Unit { name: "a", si: "a", to_si: same },
    Unit { name: "kg", si: "kg", to_si: same },
];

/// A quantity of the table in contracts.md, section "Tidy CSV".
struct Quantity {
    name: &'static str,
    /// Does a joint number follow?
    indexed: bool,
    /// SI units that it may have.
    si: &'static [&'static str],
    /// The same with all units of the file, for messages.
    allowed: &'static str,
}

const POSITION: (&[&str], &str) = (&["rad", "m"], "rad, deg, m, cm, mm or um");
const LENGTH: (&[&str], &str) = (&["m"], "m, cm, mm or um");

static QUANTITIES: [Quantity; 16] = [
    Quantity { name: "t", indexed: false, si: &["s"], allowed: "s" },
    Quantity { name: "jpos_d", indexed: true, si: POSITION.0, allowed: POSITION.1 },
    Quantity { name: "jpos", indexed: true, si: POSITION.0, allowed: POSITION.1 },
    Quantity { name: "truth_jpos", indexed: true, si: POSITION.0, allowed: POSITION.1 },
    Quantity { name: "jvel", indexed: true, si: &["rad_s", "m_s"], allowed: "rad_s, deg_s or m_s" },
    Quantity { name: "mpos", indexed: true, si: &["rad"], allowed: "rad or deg" },
    Quantity { name: "mvel", indexed: true, si: &["rad_s"], allowed: "rad_s or deg_s" },
    Quantity { name: "tau", indexed: true, si: &["nm"], allowed: "nm (joint-side torque: jtau)" },
    Quantity { name: "jtau", indexed: true, si: &["nm", "n"], allowed: "nm or n" },
    Quantity { name: "dac", indexed: true, si: &["counts"], allowed: "counts" },
    Quantity { name: "x", indexed: false, si: LENGTH.0, allowed: LENGTH.1 },
    Quantity { name: "y", indexed: false, si: LENGTH.0, allowed: LENGTH.1 },
    Quantity { name: "z", indexed: false, si: LENGTH.0, allowed: LENGTH.1 },
    Quantity { name: "truth_x", indexed: false, si: LENGTH.0, allowed: LENGTH.1 },
    Quantity { name: "truth_y", indexed: false, si: LENGTH.0, allowed: LENGTH.1 },
    Quantity { name: "truth_z", indexed: false, si: LENGTH.0, allowed: LENGTH.1 },
];

/// Does a file with this header keep the names of its origin (`q_1_rad`, `dq_1_rad_s`, ...)? Its `tau_1_nm` is then a
/// joint-side torque, not the motor torque of the table.
pub(super) fn has_origin_names(header: &[&str]) -> bool {
    header.iter().any(|name| {
        let lower = name.to_ascii_lowercase();
        lower.strip_prefix("q_").and_then(leading_number).is_some_and(|(_, rest)| rest.starts_with('_'))
    })
}

/// Reads one column name.
pub(super) fn field(name: &str, origin_names: bool) -> Result<Field, CsvProblem> {
    if name.is_empty() {
        return Err(CsvProblem::NoName);
    }
    let lower = name.to_ascii_lowercase();
    let bare = lower.strip_prefix("sim_").unwrap_or(&lower);
    match QUANTITIES.iter().find_map(|quantity| matching(quantity, bare)) {
        Some((quantity, _, _)) if origin_names && quantity.name == "tau" => Ok(unknown(name)),
        Some((quantity, index, unit)) => known(quantity, index, unit),
        None => Ok(unknown(name)),
    }
}

/// Every column of a header; what the table of tidy CSV cannot take stays as it is in the file.
pub(crate) fn loose_fields(names: &[&str]) -> Vec<Field> {
    let origin_names = has_origin_names(names);
    let in_file: HashSet<&str> = names.iter().copied().collect();
    let mut taken: HashSet<String> = HashSet::new();
    let mut fields: Vec<Field> = Vec::with_capacity(names.len());
    for name in names {
        let found = field(name, origin_names).unwrap_or_else(|_| unknown(name));
        let is_taken = found.name != *name && (in_file.contains(found.name.as_str()) || taken.contains(&found.name));
        let found = if is_taken { unknown(name) } else { found };
        taken.insert(found.name.clone());
        fields.push(found);
    }
    fields
}

/// Is this the name of a known quantity in its SI unit?
pub(crate) fn is_si_name(name: &str) -> bool {
    field(name, false).is_ok_and(|field| field.known && field.name == name)
}

/// Unit at the end of a name, `_rad` or `_m_s`, in any case.
pub(crate) fn unit_of_name(name: &str) -> Option<&'static str> {
    let lower = name.to_ascii_lowercase();
    let ends_with = |unit: &&Unit| lower.strip_suffix(unit.name).is_some_and(|rest| rest.ends_with('_') && rest.len() > 1);
    UNITS.iter().filter(ends_with).max_by_key(|unit| unit.name.len()).map(|unit| unit.name)
}

fn unknown(name: &str) -> Field {
    // Truth comes at its own rate, also truth that the table does not name (orientation, cable forces).
    let truth = name.to_ascii_lowercase().contains("truth_");
    Field { name: name.to_owned(), known: false, truth, to_si: same }
}

/// Joint number and unit, if the name is that of the quantity. A quantity without a joint number also matches with any
/// one word for a unit (`t_ms`, `x_inch`: to be refused), but not with more words (`x_d_um` is another quantity).
fn matching<'a>(quantity: &'static Quantity, bare: &'a str) -> Option<(&'static Quantity, Option<&'a str>, &'a str)> {
    let rest = bare.strip_prefix(quantity.name)?;
    if quantity.indexed {
        let (number, rest) = leading_number(rest.strip_prefix('_')?)?;
        let unit = if rest.is_empty() { "" } else { rest.strip_prefix('_')? };
        return Some((quantity, Some(number), unit));
    }
    let unit = if rest.is_empty() { "" } else { rest.strip_prefix('_')? };
    (unit_of(unit).is_some() || !unit.contains('_')).then_some((quantity, None, unit))
}

fn leading_number(text: &str) -> Option<(&str, &str)> {
    let end = text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
    (end > 0).then(|| text.split_at(end))
}

fn unit_of(name: &str) -> Option<&'static Unit> {
    UNITS.iter().find(|unit| unit.name == name)
}

fn known(quantity: &'static Quantity, index: Option<&str>, unit: &str) -> Result<Field, CsvProblem> {
    let index = index.map(joint_number).transpose()?;
    let (name, allowed) = (quantity.name, quantity.allowed);
    if unit.is_empty() {
        return Err(CsvProblem::NoUnit { quantity: name, allowed });
    }
    let unit = unit_of(unit).filter(|unit| quantity.si.contains(&unit.si)).ok_or_else(|| CsvProblem::WrongUnit {
        quantity: name,
        found: unit.to_owned(),
        allowed,
    })?;
    let name = index.map_or_else(|| format!("{name}_{}", unit.si), |index| format!("{name}_{index}_{}", unit.si));
    Ok(Field { name, known: true, truth: quantity.name.starts_with("truth_"), to_si: unit.to_si })
}

fn joint_number(text: &str) -> Result<u32, CsvProblem> {
    match text.parse() {
        Ok(number) if (1..=99).contains(&number) => Ok(number),
        _ => Err(CsvProblem::JointNumber { found: text.to_owned() }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(name: &str) -> (String, bool, f64) {
        let field = field(name, false).unwrap_or_else(|problem| panic!("{name}: {problem}"));
        (field.name, field.known, (field.to_si)(180.0))
    }

    #[test]
    fn units_become_si() {
        let pi = std::f64::consts::PI;
        for (name, expected, value) in [
            ("t_s", "t_s", 180.0),
            ("mpos_1_deg", "mpos_1_rad", pi),
            ("MVEL_2_DEG_S", "mvel_2_rad_s", pi),
            ("sim_mvel_3_rad_s", "mvel_3_rad_s", 180.0),
            ("jpos_3_m", "jpos_3_m", 180.0),
            ("jpos_d_3_mm", "jpos_d_3_m", 0.18),
            ("jvel_3_m_s", "jvel_3_m_s", 180.0),
            ("truth_jpos_3_um", "truth_jpos_3_m", 180e-6),
            ("truth_x_cm", "truth_x_m", 1.8),
            ("tau_1_Nm", "tau_1_nm", 180.0),
            ("jtau_3_N", "jtau_3_n", 180.0),
            ("dac_07_counts", "dac_7_counts", 180.0),
            ("Z_MM", "z_m", 0.18),
        ] {
            let (found, known, converted) = parsed(name);
            assert_eq!((found.as_str(), known), (expected, true), "{name}");
            assert!((converted - value).abs() < 1e-15 * value.max(1.0), "{name}: {converted}");
        }
    }

    #[test]
    fn other_quantities_keep_their_name_and_value() {
        for name in
            ["x_d_um", "Q_1_deg", "dq_3_m_s", "mpos_raw", "t_rec_s", "tip_x_mm", "force_N", "sim_extra_deg", "s", "current_2_a"]
        {
            assert_eq!(parsed(name), (name.to_owned(), false, 180.0));
        }
    }

    #[test]
    fn torque_beside_joints_of_the_origin_is_not_motor_torque() {
        assert!(has_origin_names(&["t_s", "Q_1_rad"]));
        assert!(!has_origin_names(&["t_s", "q_des_1_rad", "mpos_1_rad"]));
        assert!(!field("tau_3_N", true).expect("kept").known);
        assert!(field("mpos_3_rad", true).expect("kept").known);
    }
}
