//! Tables of measurements.

use std::fmt;

/// Median, 99 %, 99.9 % and largest, in µs, of times in ns; sorts them.
pub(crate) fn quantiles(times_ns: &mut [i64]) -> [f64; 4] {
    times_ns.sort_unstable();
    let at = |q: f64| {
        let index = ((times_ns.len() as f64 * q) as usize).min(times_ns.len().saturating_sub(1));
        times_ns.get(index).map_or(f64::NAN, |&ns| ns as f64 / 1000.0)
    };
    [at(0.5), at(0.99), at(0.999), at(1.0)]
}

/// A table with one heading, named rows and numbers.
pub(crate) struct Table {
    title: String,
    columns: Vec<String>,
    rows: Vec<(String, Vec<f64>)>,
}

impl Table {
    pub(crate) fn new(title: &str, columns: &[&str]) -> Self {
        Self { title: title.to_owned(), columns: columns.iter().map(|&c| c.to_owned()).collect(), rows: Vec::new() }
    }

    /// The first row of this name.
    pub(crate) fn find(&self, name: &str) -> Option<&[f64]> {
        self.rows.iter().find(|(row, _)| row == name).map(|(_, values)| values.as_slice())
    }

    /// The first row whose name starts so.
    pub(crate) fn find_starting(&self, start: &str) -> Option<&[f64]> {
        self.find_with(start, "")
    }

    /// The first row whose name starts and ends so.
    pub(crate) fn find_with(&self, start: &str, end: &str) -> Option<&[f64]> {
        self.rows.iter().find(|(row, _)| row.starts_with(start) && row.ends_with(end)).map(|(_, values)| values.as_slice())
    }

    /// From the row on whose name starts so, up to the next that is not one of its parts (indented further).
    pub(crate) fn rows_after(&self, start: &str) -> &[(String, Vec<f64>)] {
        let Some(first) = self.rows.iter().position(|(row, _)| row.starts_with(start)) else { return &[] };
        let parts = self.rows[first + 1..].iter().take_while(|(row, _)| row.starts_with(' ')).count();
        &self.rows[first..=first + parts]
    }

    /// The title without its unit.
    pub(crate) fn heading(&self) -> &str {
        self.title.split(", us").next().unwrap_or(&self.title)
    }

    /// Name and first number of each row.
    pub(crate) fn firsts(&self) -> impl Iterator<Item = (&str, f64)> {
        self.rows.iter().filter_map(|(name, values)| Some((name.trim(), *values.first()?)))
    }

    /// Rows by name, cells by column; what was not measured is null.
    pub(crate) fn json(&self) -> serde_json::Value {
        let cells = |values: &[f64]| {
            self.columns.iter().cloned().zip(values.iter().map(|value| serde_json::json!(value))).collect::<serde_json::Map<_, _>>()
        };
        let rows: Vec<_> =
            self.rows.iter().map(|(name, values)| serde_json::json!({ "name": name.trim(), "values": cells(values) })).collect();
        serde_json::json!({ "title": self.title, "rows": rows })
    }

    pub(crate) fn row(&mut self, name: &str, values: &[f64]) {
        self.rows.push((name.to_owned(), values.to_vec()));
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:58}", self.title)?;
        for column in &self.columns {
            write!(f, " {column:>9}")?;
        }
        writeln!(f)?;
        for (name, values) in &self.rows {
            write!(f, "  {name:56}")?;
            for value in values {
                if value.is_nan() { write!(f, " {:>9}", "-")? } else { write!(f, " {value:9.2}")? }
            }
            writeln!(f)?;
        }
        Ok(())
    }
}
