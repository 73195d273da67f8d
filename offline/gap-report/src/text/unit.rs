//! Units as people read them, and the multiple in which a size reads best.

/// A unit and how much of it makes one of the unit it stands for: a value in the report times `per_unit` is in `name`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Scale {
    /// The unit as written, such as `mN m`; empty for plain numbers.
    pub(crate) name: String,
    /// Multiples per unit of the report.
    pub(crate) per_unit: f64,
}

/// Prefixes and how many of their multiples make one.
const PREFIXES: [(&str, f64); 6] = [("n", 1e9), ("µ", 1e6), ("m", 1e3), ("", 1.0), ("k", 1e-3), ("M", 1e-6)];

/// Below and above these a unit takes a prefix. Newtons read well from 0.01 on, metres and seconds do not.
fn plain_range(unit: &str) -> Option<(f64, f64)> {
    match unit {
        "s" | "m" | "m/s" | "kg" | "V" | "A" => Some((1.0, 1e4)),
        "rad" | "rad/s" => Some((0.1, 1e4)),
        "N" | "N.m" | "N.m.s/rad" | "N.s/m" | "N.m/rad" | "N/m" | "rad/(N.m)" | "m/N" => Some((0.01, 1e4)),
        _ => None,
    }
}

/// How to write a value of about `size` in a unit of the report.
pub(crate) fn scale(size: f64, unit: &str) -> Scale {
    let size = size.abs();
    if unit == "kg" && size < 1.0 && size > 0.0 {
        return Scale { name: "g".to_owned(), per_unit: 1e3 };
    }
    let unscaled = Scale { name: written(unit), per_unit: 1.0 };
    match plain_range(unit) {
        Some((low, high)) if size > 0.0 && size.is_finite() && !(low..high).contains(&size) && unit != "kg" => {
            // One to three digits before the point; the outermost prefixes take what is beyond.
            let fitting = PREFIXES.iter().find(|prefix| (0.9995..999.5).contains(&(size * prefix.1)));
            let outermost = if size < 1.0 { &PREFIXES[0] } else { &PREFIXES[PREFIXES.len() - 1] };
            let (prefix, per_unit) = fitting.unwrap_or(outermost);
            Scale { name: format!("{prefix}{}", unscaled.name), per_unit: *per_unit }
        }
        _ => unscaled,
    }
}

/// A unit of the report as people write it: `N.m.s/rad` is `N m s/rad`, `kg.m2` is `kg m²`, `1` is nothing.
pub(crate) fn written(unit: &str) -> String {
    if unit == "1" {
        return String::new();
    }
    unit.replace("m2", "m²").replace("m3", "m³").replace('.', " ").replace("(N m)", "N m").replace("/N m", "/(N m)")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_get_the_multiple_that_reads_well() {
        for (size, unit, name, per_unit) in [
            (0.0231, "s", "ms", 1e3),
            (42.0, "s", "s", 1.0),
            (12.1, "N", "N", 1.0),
            (0.81, "N.m", "N m", 1.0),
            (0.0051, "N.m", "mN m", 1e3),
            (18_500.0, "N/m", "kN/m", 1e-3),
            (0.0021, "rad", "mrad", 1e3),
            (-0.0031, "m", "mm", 1e3),
            (0.000_02, "m", "µm", 1e6),
            (0.105, "kg", "g", 1e3),
            (1.5, "kg", "kg", 1.0),
            (0.31, "1", "", 1.0),
            (1.2, "kg.m2", "kg m²", 1.0),
            (2e-7, "rad/(N.m)", "nrad/(N m)", 1e9),
            (2e-6, "rad/(N.m)", "µrad/(N m)", 1e6),
            (0.0, "m", "m", 1.0),
            (3e-12, "s", "ns", 1e9),
            (6.0, "%", "%", 1.0),
        ] {
            let scale = scale(size, unit);
            assert_eq!((scale.name.as_str(), scale.per_unit), (name, per_unit), "{size} {unit}");
        }
    }
}
