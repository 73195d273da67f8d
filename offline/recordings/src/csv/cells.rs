//! Rows into cells: commas, and quotes as RFC 4180 has them (a comma, a line end or a doubled quote may stand inside).

use std::borrow::Cow;

use crate::file::Lines;

/// Reads the further lines of a row in which a quoted cell goes over several.
pub(super) fn complete_row(lines: &mut Lines) -> Result<(), String> {
    let (mut seen, mut quotes) = (0, 0);
    loop {
        // Only what was appended is looked at: a quote that is never closed must not cost the square of the file.
        let line = lines.line();
        quotes += line.get(seen..).unwrap_or_default().split(|byte| *byte == b'"').count() - 1;
        seen = line.len();
        if quotes % 2 == 0 {
            return Ok(());
        }
        if !lines.append().map_err(|problem| problem.what())? {
            return Err("a quoted cell is not closed before the end of the file".to_owned());
        }
    }
}

/// The present row as text.
pub(super) fn row_text(lines: &Lines) -> Result<&str, String> {
    let line = lines.line();
    if line.contains(&0) {
        return Err("zero bytes stand where text should be".to_owned());
    }
    std::str::from_utf8(line).map_err(|_| "is not UTF-8 text".to_owned())
}

/// The cells of a row, without blanks round them and without quotes.
pub(super) struct Split<'a> {
    rest: Option<&'a str>,
    quoted: bool,
}

impl<'a> Split<'a> {
    /// All cells, however many.
    pub(super) fn all(row: &'a str) -> Self {
        Self { rest: Some(row), quoted: row.contains('"') }
    }

    /// Are there quotes in the row?
    pub(super) fn is_quoted(&self) -> bool {
        self.quoted
    }

    /// The cells of a row that must have so many; one empty cell too many (a comma at the end) is passed over.
    pub(super) fn of(row: &'a str, expected: usize) -> Result<Self, String> {
        let split = Self::all(row);
        let found = if split.quoted { Self::all(row).count() } else { 1 + row.bytes().filter(|byte| *byte == b',').count() };
        if found == expected || (found == expected + 1 && row.trim_end().ends_with(',')) {
            return Ok(split);
        }
        Err(format!("has {found} cells where the header has {expected}"))
    }
}

impl<'a> Iterator for Split<'a> {
    type Item = Cow<'a, str>;

    fn next(&mut self) -> Option<Cow<'a, str>> {
        let rest = self.rest?;
        if self.quoted
            && let Some(inside) = rest.trim_start().strip_prefix('"')
        {
            let (cell, after) = unquoted(inside);
            self.rest = after;
            return Some(cell);
        }
        let end = rest.bytes().position(|byte| byte == b',').unwrap_or(rest.len());
        self.rest = rest.get(end + 1..);
        Some(Cow::Borrowed(rest[..end].trim()))
    }
}

/// The cell up to its closing quote, and what follows the next comma.
fn unquoted(inside: &str) -> (Cow<'_, str>, Option<&str>) {
    let bytes = inside.as_bytes();
    let (mut at, mut doubled) = (0, false);
    while at < bytes.len() {
        if bytes[at] == b'"' {
            if bytes.get(at + 1) != Some(&b'"') {
                break;
            }
            doubled = true;
            at += 1;
        }
        at += 1;
    }
    let at = at.min(bytes.len());
    let cell = if doubled { Cow::Owned(inside[..at].replace("\"\"", "\"")) } else { Cow::Borrowed(&inside[..at]) };
    // Whatever stands between the closing quote and the comma belongs to nothing.
    let after = inside.get(at + 1..).and_then(|after| after.split_once(',')).map(|(_, after)| after);
    (cell, after)
}

/// Appends a cell of words, quoted where it would not come back the same.
pub(super) fn push_text(out: &mut Vec<u8>, text: &str) {
    let plain = !text.contains([',', '"', '\n', '\r']) && text.trim() == text && !text.starts_with('#');
    if plain {
        out.extend_from_slice(text.as_bytes());
        return;
    }
    out.push(b'"');
    out.extend_from_slice(text.replace('"', "\"\"").as_bytes());
    out.push(b'"');
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotes_hide_commas_and_other_quotes() {
        for (row, expected) in [
            ("a,b", vec!["a", "b"]),
            (" a , b ", vec!["a", "b"]),
            ("", vec![""]),
            ("a,", vec!["a", ""]),
            ("\"a,b\",c", vec!["a,b", "c"]),
            ("\"say \"\"no\"\"\",1", vec!["say \"no\"", "1"]),
            ("1, \" x \" ,2", vec!["1", " x ", "2"]),
            ("\"\",1", vec!["", "1"]),
            ("\"a\"b,1", vec!["a", "1"]),
            ("\"two\nlines\",1", vec!["two\nlines", "1"]),
            ("a\"b\",1", vec!["a\"b\"", "1"]),
        ] {
            assert_eq!(Split::all(row).collect::<Vec<_>>(), expected, "{row:?}");
        }
    }

    #[test]
    fn words_come_back_as_they_were() {
        for word in ["ok", "a,b", "say \"no\"", " edge ", "#1", "two\nlines", "", "\"", "ä", "cr\rlf\n"] {
            let mut out = Vec::new();
            push_text(&mut out, word);
            out.extend_from_slice(b",1");
            let row = String::from_utf8(out).expect("text");
            assert_eq!(Split::all(&row).next().as_deref(), Some(word), "{row:?}");
        }
    }
}
