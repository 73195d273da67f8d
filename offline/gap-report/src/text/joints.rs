//! Joints in sentences.

/// A joint in a sentence, by its name alone: `the insertion joint`, `joint J3`, `joint 2`.
pub(crate) fn joint(name: &str) -> String {
    let plain = name.replace('_', " ");
    let lower = plain.to_lowercase();
    let numbered = |text: &str| {
        let rest = text.strip_prefix(['j', 'J']).unwrap_or(text).trim();
        !rest.is_empty() && rest.chars().all(|c| c.is_ascii_digit())
    };
    if numbered(&plain) {
        return format!("joint {plain}");
    }
    match lower.strip_prefix("joint") {
        // joint_1, joint3: spaced, and without an article.
        Some(rest) if numbered(rest) => format!("joint {}", rest.trim()),
        _ if lower.contains("joint") => format!("the {plain}"),
        _ => format!("the {plain} joint"),
    }
}

/// Several joints: `the shoulder and elbow joints`; none: `the arm`.
pub(crate) fn joints(names: &[String]) -> String {
    match names {
        [] => "the arm".to_owned(),
        [one] => joint(one),
        several => {
            let named: Vec<String> = several.iter().map(|name| joint(name)).collect();
            let stripped: Option<Vec<&str>> =
                named.iter().map(|text| text.strip_prefix("the ").and_then(|text| text.strip_suffix(" joint"))).collect();
            match stripped {
                Some(stripped) => format!("the {} joints", listed(&stripped, "and")),
                None => listed(&named, "and"),
            }
        }
    }
}

/// `a`, `a and b`, `a, b and c`.
pub(crate) fn listed<T: AsRef<str>>(items: &[T], last: &str) -> String {
    match items {
        [] => String::new(),
        [one] => one.as_ref().to_owned(),
        [first @ .., end] => {
            let first: Vec<&str> = first.iter().map(AsRef::as_ref).collect();
            format!("{} {last} {}", first.join(", "), end.as_ref())
        }
    }
}

/// With a capital letter.
pub(crate) fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joints_read_as_people_say_them() {
        for (name, text) in [
            ("insertion", "the insertion joint"),
            ("J3", "joint J3"),
            ("2", "joint 2"),
            ("joint_1", "joint 1"),
            ("shoulder_pitch", "the shoulder pitch joint"),
            ("elbow_joint", "the elbow joint"),
        ] {
            assert_eq!(joint(name), text);
        }
        let names = |names: &[&str]| joints(&names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>());
        assert_eq!(names(&[]), "the arm");
        assert_eq!(names(&["shoulder", "elbow"]), "the shoulder and elbow joints");
        assert_eq!(names(&["J1", "J2", "J3"]), "joint J1, joint J2 and joint J3");
    }
}
