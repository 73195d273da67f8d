//! Text from a hostile file, made fit for one line of a log.

/// Longest run of characters that is taken over from a file's name.
const NAME_CHARS_MAX: usize = 60;
/// Longest run of characters that is taken over from a message of tract.
const REASON_CHARS_MAX: usize = 240;

/// A node's or tensor's name: control characters escaped, cut to 60 characters.
pub(crate) fn name(raw: &str) -> String {
    one_line(raw, NAME_CHARS_MAX)
}

/// A message of another library, which quotes names from the file: escaped and cut to 240 characters.
pub(crate) fn reason(raw: &str) -> String {
    one_line(raw, REASON_CHARS_MAX)
}

/// Up to four names, for messages that list what was found.
pub(crate) fn names<'a>(raw: impl Iterator<Item = &'a str>) -> String {
    let mut raw = raw.map(|n| format!("`{}`", name(n)));
    let shown: Vec<String> = raw.by_ref().take(4).collect();
    let rest = if raw.next().is_some() { ", and more" } else { "" };
    shown.join(", ") + rest
}

fn one_line(raw: &str, chars_max: usize) -> String {
    let mut line = String::new();
    for (count, c) in raw.chars().enumerate() {
        if count == chars_max {
            line.push('…');
            break;
        }
        // Quotes stay readable; everything that could move a terminal's cursor or reverse its text is escaped.
        if c == '"' || c == '\'' { line.push(c) } else { line.extend(c.escape_debug()) }
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hostile_name_stays_one_short_line() {
        let hostile = format!("a\nb\u{1b}[2J\u{202e}{}", "x".repeat(500));
        let shown = name(&hostile);
        assert!(shown.chars().all(|c| !c.is_control() && c != '\u{202e}'), "{shown}");
        assert!(shown.chars().count() < 100);
    }

    #[test]
    fn many_names_are_cut() {
        assert_eq!(names(["a", "b", "c", "d", "e", "f"].into_iter()), "`a`, `b`, `c`, `d`, and more");
    }
}
