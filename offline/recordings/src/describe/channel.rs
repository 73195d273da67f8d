//! One column or field: range, ends, what is missing.

use serde::Serialize;

/// A column or field.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Channel {
    /// Name.
    pub name: String,
    /// Unit as the file has it; empty for none or an unknown one.
    pub unit: String,
    /// Cells that hold something.
    pub count: u64,
    /// Cells that are empty or NaN.
    pub missing: u64,
    /// Cells that are infinite.
    pub infinite: u64,
    /// Smallest finite number.
    pub min: Option<f64>,
    /// Largest finite number.
    pub max: Option<f64>,
    /// First number.
    pub first: Option<f64>,
    /// Last number.
    pub last: Option<f64>,
    /// Is it the same number or word in every row (of at least two)?
    pub constant: bool,
    /// For a channel of words: the first sixteen different ones.
    pub words: Vec<Word>,
    /// Cells with other words than these.
    pub other_words: u64,
}

/// A word and how often it stands in the channel.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Word {
    /// The word, cut after 60 characters.
    pub text: String,
    /// Cells.
    pub count: u64,
}

/// Collects numbers.
#[derive(Debug, Clone)]
pub(super) struct Numbers {
    count: u64,
    missing: u64,
    infinite: u64,
    min: f64,
    max: f64,
    first: f64,
    last: f64,
    at_min: u64,
    at_max: u64,
}

impl Default for Numbers {
    fn default() -> Self {
        let (min, max) = (f64::INFINITY, f64::NEG_INFINITY);
        Self { count: 0, missing: 0, infinite: 0, min, max, first: f64::NAN, last: f64::NAN, at_min: 0, at_max: 0 }
    }
}

impl Numbers {
    pub(super) fn see(&mut self, value: f64) {
        if value.is_nan() {
            self.missing += 1;
            return;
        }
        if self.count == 0 {
            self.first = value;
        }
        self.count += 1;
        self.last = value;
        if value.is_infinite() {
            self.infinite += 1;
            return;
        }
        if value < self.min {
            (self.min, self.at_min) = (value, 0);
        }
        if value > self.max {
            (self.max, self.at_max) = (value, 0);
        }
        self.at_min += u64::from(value == self.min);
        self.at_max += u64::from(value == self.max);
    }

    /// Cells at the largest or the smallest value, if these differ.
    pub(super) fn at_extremes(&self) -> u64 {
        if self.min < self.max { self.at_min + self.at_max } else { 0 }
    }

    pub(super) fn channel(&self, name: String, unit: &str) -> Channel {
        let finite = |value: f64| value.is_finite().then_some(value);
        let known = |value: f64| (!value.is_nan()).then_some(value);
        Channel {
            name,
            unit: unit.to_owned(),
            count: self.count,
            missing: self.missing,
            infinite: self.infinite,
            min: finite(self.min),
            max: finite(self.max),
            first: known(self.first).and_then(finite),
            last: known(self.last).and_then(finite),
            constant: self.count > 1 && self.missing == 0 && self.infinite == 0 && self.min == self.max,
            words: Vec::new(),
            other_words: 0,
        }
    }
}

/// Different words that are kept.
const WORDS_MAX: usize = 16;

/// Characters of a word that are kept.
const WORD_CHARS: usize = 60;

/// Collects words.
#[derive(Debug, Clone, Default)]
pub(super) struct Words {
    seen: Vec<Word>,
    others: u64,
    count: u64,
    missing: u64,
}

impl Words {
    pub(super) fn see(&mut self, text: &str) {
        if text.is_empty() {
            self.missing += 1;
            return;
        }
        self.count += 1;
        let end = text.char_indices().nth(WORD_CHARS).map_or(text.len(), |(end, _)| end);
        let text = &text[..end];
        let has_room = self.seen.len() < WORDS_MAX;
        match self.seen.iter_mut().find(|word| word.text == text) {
            Some(word) => word.count += 1,
            None if has_room => self.seen.push(Word { text: text.to_owned(), count: 1 }),
            None => self.others += 1,
        }
    }

    pub(super) fn channel(self, name: String) -> Channel {
        Channel {
            name,
            unit: String::new(),
            count: self.count,
            missing: self.missing,
            infinite: 0,
            min: None,
            max: None,
            first: None,
            last: None,
            constant: self.count > 1 && self.missing == 0 && self.seen.len() == 1,
            words: self.seen,
            other_words: self.others,
        }
    }
}
