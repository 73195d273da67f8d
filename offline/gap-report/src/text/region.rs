//! A region in words.

use super::joints::listed;
use super::number::{percent, with_unit};
use crate::{Region, RegionKind};

/// `x of the tip is 12.0 mm to 80.1 mm and z of the tip is ... (93 % of what is explained)`; none of what shows everywhere.
pub(crate) fn region(region: &Region) -> Option<String> {
    let (axes, min, max) = (region.axes.as_ref()?, region.min.as_ref()?, region.max.as_ref()?);
    let of = match region.kind {
        RegionKind::Box => " of the tip",
        RegionKind::JointBox => "",
        RegionKind::All | RegionKind::Sphere => return None,
    };
    let unit = region.unit.as_deref().unwrap_or_default();
    let limits = axes.iter().zip(min.iter().zip(max));
    let each: Vec<String> = limits
        .map(|(axis, (low, high))| format!("{axis}{of} is {} to {}", with_unit(*low, unit), with_unit(*high, unit)))
        .collect();
    let each: Vec<&str> = each.iter().map(String::as_str).collect();
    let share = region.energy_share.map_or_else(String::new, |share| format!(" ({} of what is explained)", percent(share)));
    (!each.is_empty()).then(|| format!("{}{share}", listed(&each, "and")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_is_told_by_its_limits_and_everywhere_is_not_told() {
        let tip = Region {
            energy_share: Some(0.931),
            ..Region::tip_box(vec!["x".to_owned(), "z".to_owned()], vec![0.012, -0.2], vec![0.0801, 0.05])
        };
        let said = region(&tip).expect("words").replace('\u{a0}', " ");
        assert_eq!(
            said,
            "x of the tip is 12.0 mm to 80.1 mm and z of the tip is \u{2212}200 mm to 50.0 mm (93 % of what is explained)"
        );
        let joint = Region::joint_box(vec!["elbow".to_owned()], vec![0.5], vec![1.0], "rad");
        assert!(region(&joint).expect("words").starts_with("elbow is "));
        assert_eq!(region(&Region::all()), None);
    }
}
