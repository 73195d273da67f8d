//! What a message definition says: its fields, their types, how to step over one. A definition comes from a file, so
//! everything about it is bounded.

use std::collections::HashMap;

use super::bytes::{Cursor, MessageError};

/// Longest definition, bytes; the largest of ROS's own have some 50 kB.
const TEXT_MAX: usize = 1 << 20;
/// Types within types.
const DEPTH_MAX: usize = 16;
/// Fields of all types of a definition, each counted as often as it is used.
const FIELDS_MAX: usize = 1_000;
/// Size of a message's fixed part, bytes.
const SIZE_MAX: usize = 1 << 28;

/// Why a message definition cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DefinitionError {
    /// Too long to be a definition.
    #[error("has {0} bytes, at most {TEXT_MAX} are taken")]
    TextTooLong(usize),
    /// A line that is neither field, constant, comment nor separator.
    #[error("line {line} is no field: {text:?}")]
    Line {
        /// From 1.
        line: usize,
        /// The line, cut at 80 characters.
        text: String,
    },
    /// A field of a type that is not defined.
    #[error("has no definition of {0}")]
    UnknownType(String),
    /// Nested too deeply (or in itself), or too large.
    #[error("is nested too deeply or too large at {0}")]
    TooLarge(String),
    /// Two fields of one name.
    #[error("has field {0} twice")]
    Twice(String),
    /// A field that is needed and not there.
    #[error("lacks {0}")]
    Missing(String),
    /// A field of another type than needed.
    #[error("has {name} as {found}, not as {needed}")]
    OtherType {
        /// The field.
        name: String,
        /// Its type.
        found: String,
        /// The type that is needed.
        needed: String,
    },
}

/// How many values a field has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Count {
    One,
    Fixed(usize),
    /// As many as a number before them says.
    Said,
}

/// One value of a field.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A number, or a time or duration of two: its size, bytes.
    Plain(usize),
    String,
    Message(Layout),
}

/// A field of a message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Field {
    pub(crate) name: String,
    /// As a definition has it, with the package where it has one: `float32[16]`.
    pub(crate) type_name: String,
    pub(crate) kind: Kind,
    pub(crate) count: Count,
}

/// The fields of a message in their order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Layout {
    pub(crate) fields: Vec<Field>,
    /// Size of one message where it is always the same, bytes.
    fixed_size: Option<usize>,
}

impl Layout {
    /// Reads a definition of a type of the given name (`package/Type`).
    pub(crate) fn parse(type_name: &str, text: &str) -> Result<Self, DefinitionError> {
        if text.len() > TEXT_MAX {
            return Err(DefinitionError::TextTooLong(text.len()));
        }
        let (main, used) = split(type_name, text)?;
        let mut fields_left = FIELDS_MAX;
        Resolver { used: &used }.layout(type_name, &main, DEPTH_MAX, &mut fields_left)
    }

    /// Names and types of all fields, those of types within after a point, for a comparison with what is known.
    pub(crate) fn flat(&self) -> Vec<(String, String)> {
        let mut flat = Vec::new();
        self.flatten("", &mut flat);
        flat
    }

    fn flatten(&self, prefix: &str, flat: &mut Vec<(String, String)>) {
        for field in &self.fields {
            let name = format!("{prefix}{}", field.name);
            match (&field.kind, field.count) {
                (Kind::Message(layout), Count::One) => layout.flatten(&format!("{name}."), flat),
                _ => flat.push((name, field.type_name.clone())),
            }
        }
    }

    fn skip(&self, cursor: &mut Cursor<'_>, field: &str) -> Result<(), MessageError> {
        if let Some(size) = self.fixed_size {
            return cursor.take(size, field).map(|_| ());
        }
        self.fields.iter().try_for_each(|inner| inner.skip(cursor))
    }
}

impl Field {
    /// Steps over the field. Values without a fixed size are stepped over one by one; each has four bytes or more, so a
    /// number that lies soon meets the end of the message.
    pub(crate) fn skip(&self, cursor: &mut Cursor<'_>) -> Result<(), MessageError> {
        let count = match self.count {
            Count::One => 1,
            Count::Fixed(count) => count,
            Count::Said => cursor.u32(&self.name)? as usize,
        };
        if let Some(size) = self.kind.fixed_size() {
            return cursor.take(size.saturating_mul(count), &self.name).map(|_| ());
        }
        for _ in 0..count {
            match &self.kind {
                Kind::Message(layout) => layout.skip(cursor, &self.name)?,
                Kind::String => drop(cursor.string(&self.name)?),
                // Has a fixed size, handled above.
                Kind::Plain(size) => drop(cursor.take(*size, &self.name)?),
            }
        }
        Ok(())
    }

    fn fixed_size(&self) -> Option<usize> {
        let one = self.kind.fixed_size()?;
        match self.count {
            Count::One => Some(one),
            Count::Fixed(count) => one.checked_mul(count),
            Count::Said => None,
        }
    }
}

impl Kind {
    fn fixed_size(&self) -> Option<usize> {
        match self {
            Self::Plain(size) => Some(*size),
            Self::String => None,
            Self::Message(layout) => layout.fixed_size,
        }
    }
}

/// `type name` of a line.
type Line = (String, String);
/// Lines of the types that a definition uses, by name.
type Sections = HashMap<String, Vec<Line>>;

/// Splits a definition into the lines of the main type and those of the types that it uses.
fn split(type_name: &str, text: &str) -> Result<(Vec<Line>, Sections), DefinitionError> {
    let mut main = Vec::new();
    let mut used = Sections::new();
    let mut current: Option<String> = None;
    for (index, raw) in text.lines().enumerate() {
        let line = raw.split('#').next().unwrap_or_default().trim();
        if line.is_empty() || line.bytes().all(|byte| byte == b'=') {
            continue;
        }
        if let Some(name) = line.strip_prefix("MSG:") {
            current = Some(name.trim().to_owned());
            let _ = used.entry(name.trim().to_owned()).or_default();
            continue;
        }
        let refused = || DefinitionError::Line { line: index + 1, text: raw.chars().take(80).collect() };
        let (type_text, rest) = line.split_once(char::is_whitespace).ok_or_else(refused)?;
        // A constant takes no room in a message.
        if rest.contains('=') {
            continue;
        }
        let name = rest.trim();
        if name.contains(char::is_whitespace) {
            return Err(refused());
        }
        let lines = match &current {
            Some(section) if section != type_name => used.entry(section.clone()).or_default(),
            _ => &mut main,
        };
        lines.push((type_text.to_owned(), name.to_owned()));
    }
    // Some writers leave it out, since every ROS has it.
    let header = [("uint32", "seq"), ("time", "stamp"), ("string", "frame_id")];
    let own = || header.iter().map(|(kind, name)| ((*kind).to_owned(), (*name).to_owned())).collect();
    let _ = used.entry("std_msgs/Header".to_owned()).or_insert_with(own);
    Ok((main, used))
}

/// Builds layouts out of lines.
struct Resolver<'a> {
    used: &'a Sections,
}

impl Resolver<'_> {
    fn layout(&self, owner: &str, lines: &[Line], depth: usize, fields_left: &mut usize) -> Result<Layout, DefinitionError> {
        let mut fields: Vec<Field> = Vec::with_capacity(lines.len());
        let mut names = std::collections::HashSet::with_capacity(lines.len());
        for (type_text, name) in lines {
            if !names.insert(name.as_str()) {
                return Err(DefinitionError::Twice(name.clone()));
            }
            *fields_left = fields_left.checked_sub(1).ok_or_else(|| DefinitionError::TooLarge(name.clone()))?;
            fields.push(self.field(owner, type_text, name, depth, fields_left)?);
        }
        let fixed_size = fields.iter().try_fold(0_usize, |sum, field| sum.checked_add(field.fixed_size()?));
        if fixed_size.is_some_and(|size| size > SIZE_MAX) {
            return Err(DefinitionError::TooLarge(owner.to_owned()));
        }
        Ok(Layout { fields, fixed_size })
    }

    fn field(&self, owner: &str, text: &str, name: &str, depth: usize, fields_left: &mut usize) -> Result<Field, DefinitionError> {
        let (element, count) = element_and_count(text).ok_or_else(|| DefinitionError::UnknownType(text.to_owned()))?;
        if matches!(count, Count::Fixed(count) if count > SIZE_MAX) {
            return Err(DefinitionError::TooLarge(name.to_owned()));
        }
        let kind = match plain_size(element) {
            Some(size) => Kind::Plain(size),
            None if element == "string" => Kind::String,
            None => {
                let (full, lines) = self.find(owner, element)?;
                let depth = depth.checked_sub(1).ok_or_else(|| DefinitionError::TooLarge(full.to_owned()))?;
                Kind::Message(self.layout(full, lines, depth, fields_left)?)
            }
        };
        Ok(Field { name: name.to_owned(), type_name: text.to_owned(), kind, count })
    }

    /// `Header` is that of `std_msgs`; a name without package is of the package that uses it, or of whatever package has it.
    fn find(&self, owner: &str, name: &str) -> Result<(&str, &[Line]), DefinitionError> {
        let package = owner.split('/').next().unwrap_or_default();
        let candidates = match name {
            "Header" => ["std_msgs/Header".to_owned(), name.to_owned()],
            _ => [name.to_owned(), format!("{package}/{name}")],
        };
        let found = candidates.iter().find_map(|candidate| self.used.get_key_value(candidate));
        let anywhere =
            || self.used.iter().filter(|(full, _)| full.split('/').nth(1) == Some(name)).min_by_key(|(full, _)| full.as_str());
        let (full, lines) = found.or_else(anywhere).ok_or_else(|| DefinitionError::UnknownType(name.to_owned()))?;
        Ok((full, lines))
    }
}

/// `float32[16]` is (`float32`, 16).
fn element_and_count(text: &str) -> Option<(&str, Count)> {
    let Some((element, rest)) = text.split_once('[') else { return Some((text, Count::One)) };
    let inside = rest.strip_suffix(']')?;
    let count = if inside.is_empty() { Count::Said } else { Count::Fixed(inside.parse().ok()?) };
    Some((element, count))
}

/// Size of a type that is always of one size, bytes.
fn plain_size(name: &str) -> Option<usize> {
    Some(match name {
        "bool" | "int8" | "uint8" | "byte" | "char" => 1,
        "int16" | "uint16" => 2,
        "int32" | "uint32" | "float32" => 4,
        "int64" | "uint64" | "float64" | "time" | "duration" => 8,
        _ => return None,
    })
}
