//! Tables.

use arm::Raven2;

use super::channel::{Numbers, Words};
use super::standstill::{JOINT_STILL_M_S, JOINT_STILL_RAD_S, MOTOR_STILL_RAD_S, StillRows};
use super::timing::Times;
use super::{DamageAt, Description, Runlevels, Saturation, Stream, TruthCoverage, share};
use crate::csv;
use crate::stream::StreamError;
use crate::table::{self, Batch, ColumnCells, TableColumn, TableSource};

/// What is collected of a column.
enum Cells {
    Numbers(Numbers),
    Words(Words),
}

/// What the columns mean, found by their names.
struct Meaning {
    time: Option<usize>,
    runlevel: Option<usize>,
    /// Column of an amplifier command and RAVEN's limit for it.
    dac: Vec<(usize, u32)>,
    speeds: Vec<(usize, f64)>,
    rule: String,
    positions: Vec<usize>,
    /// Columns of true position, rotation, joints.
    truth: [Vec<usize>; 3],
}

impl Meaning {
    fn of(columns: &[TableColumn]) -> Self {
        let names: Vec<&str> = columns.iter().map(|column| column.name.as_str()).collect();
        // Names in SI, and how many of these one unit of the file is.
        let fields: Vec<(String, f64)> =
            csv::loose_fields(&names).into_iter().map(|field| (field.name.to_ascii_lowercase(), (field.to_si)(1.0))).collect();
        let is_number = |place: usize| !columns[place].text;
        let places = |test: &dyn Fn(&str) -> bool| -> Vec<usize> {
            (0..fields.len()).filter(|place| is_number(*place) && test(&fields[*place].0)).collect()
        };
        let limits = Raven2::nominal().plant().motor.dac_limit;
        let limit = |name: &str| limits.get(numbered(name, "dac")?.checked_sub(1)?).copied();
        let dac = places(&|name| limit(name).is_some()).into_iter().map(|place| (place, limit(&fields[place].0).unwrap_or(0)));
        let (speeds, rule) = speeds(&fields, &places);
        let first_of = |kinds: &[&str]| -> Vec<usize> {
            kinds
                .iter()
                .map(|kind| places(&|name| numbered(name, kind).is_some()))
                .find(|places| !places.is_empty())
                .unwrap_or_default()
        };
        let any_of = |name: &str, parts: &[&str]| parts.iter().any(|part| name.contains(part));
        Self {
            time: table::time_column(columns),
            runlevel: places(&|name| name == "runlevel").first().copied(),
            dac: dac.collect(),
            speeds,
            rule,
            positions: first_of(&["mpos", "jpos", "q", "q_act"]),
            truth: [
                places(&|name| any_of(name, &["truth_x_", "truth_y_", "truth_z_"])),
                places(&|name| any_of(name, &["truth_qw", "truth_qx", "truth_qy", "truth_qz"])),
                places(&|name| name.contains("truth_jpos_")),
            ],
        }
    }
}

/// `KIND_N_...` or, for one arm of two, `ARM_KIND_N_...`: the number.
fn numbered(name: &str, kind: &str) -> Option<usize> {
    let bare = name.strip_prefix("gold_").or_else(|| name.strip_prefix("green_")).unwrap_or(name);
    let rest = bare.strip_prefix(kind)?.strip_prefix('_')?;
    let (number, unit) = rest.split_once('_')?;
    (!unit.is_empty()).then(|| number.parse().ok()).flatten()
}

/// Finds the columns whose name passes a test.
type Places<'a> = dyn Fn(&dyn Fn(&str) -> bool) -> Vec<usize> + 'a;

/// Columns of speed with the size, in the unit of the file, below which they stand; and the rule in words.
fn speeds(fields: &[(String, f64)], places: &Places<'_>) -> (Vec<(usize, f64)>, String) {
    for (kind, turning) in [("mvel", MOTOR_STILL_RAD_S), ("dq", JOINT_STILL_RAD_S), ("jvel", JOINT_STILL_RAD_S)] {
        let found = places(&|name| numbered(name, kind).is_some());
        if found.is_empty() {
            continue;
        }
        let threshold = |place: usize| {
            let (name, si) = &fields[place];
            let still = if name.ends_with("_m_s") { JOINT_STILL_M_S } else { turning };
            // Names of the origin (dq) are not converted: degrees stay degrees.
            let unit = if name.ends_with("_deg_s") { 1_f64.to_radians() } else { *si };
            still / unit
        };
        let rule = match kind {
            "mvel" => format!("all {kind} below {turning} rad/s"),
            _ => format!("all {kind} below {turning} rad/s, {JOINT_STILL_M_S} m/s"),
        };
        return (found.into_iter().map(|place| (place, threshold(place))).collect(), rule);
    }
    (Vec::new(), "positions as in the row before".to_owned())
}

/// Everything that is collected from a table.
struct Rows {
    meaning: Meaning,
    cells: Vec<Cells>,
    times: Times,
    count: u64,
    repeated: u64,
    before: Vec<f64>,
    before_words: Vec<String>,
    still: StillRows,
    at_limit: Vec<u64>,
    runlevels: Runlevels,
    truth: [u64; 3],
    /// Times that are missing or beyond what nanoseconds hold.
    bad_times: u64,
}

impl Rows {
    fn new(columns: &[TableColumn]) -> Self {
        let meaning = Meaning::of(columns);
        let cells =
            |column: &TableColumn| if column.text { Cells::Words(Words::default()) } else { Cells::Numbers(Numbers::default()) };
        Self {
            at_limit: vec![0; meaning.dac.len()],
            meaning,
            cells: columns.iter().map(cells).collect(),
            times: Times::default(),
            count: 0,
            repeated: 0,
            before: Vec::new(),
            before_words: Vec::new(),
            still: StillRows::default(),
            runlevels: Runlevels::default(),
            truth: [0; 3],
            bad_times: 0,
        }
    }

    fn see(&mut self, batch: &Batch) {
        for (cells, values) in self.cells.iter_mut().zip(&batch.columns) {
            match (cells, values) {
                (Cells::Numbers(numbers), ColumnCells::Numbers(values)) => values.iter().for_each(|value| numbers.see(*value)),
                (Cells::Words(words), ColumnCells::Texts(texts)) => texts.iter().for_each(|text| words.see(text)),
                _ => {}
            }
        }
        let words: Vec<Vec<&str>> = batch
            .columns
            .iter()
            .filter_map(|cells| if let ColumnCells::Texts(texts) = cells { Some(texts.iter().collect()) } else { None })
            .collect();
        let mut row = Vec::with_capacity(batch.columns.len());
        for index in 0..batch.rows() {
            row.clear();
            row.extend(batch.columns.iter().map(|cells| match cells {
                ColumnCells::Numbers(values) => values[index],
                ColumnCells::Texts(_) => f64::NAN,
            }));
            self.see_row(&row);
            let same_words = words.iter().map(|words| words[index]).eq(self.before_words.iter().map(String::as_str));
            self.repeated += u64::from(self.is_repeated(&row) && same_words);
            if !same_words {
                self.before_words = words.iter().map(|words| words[index].to_owned()).collect();
            }
            std::mem::swap(&mut self.before, &mut row);
        }
    }

    /// Is everything but the time as in the row before?
    fn is_repeated(&self, row: &[f64]) -> bool {
        let same = |(place, (now, before)): (usize, (&f64, &f64))| {
            Some(place) == self.meaning.time || now == before || (now.is_nan() && before.is_nan())
        };
        self.before.len() == row.len() && row.len() > 1 && row.iter().zip(&self.before).enumerate().all(same)
    }

    fn see_row(&mut self, row: &[f64]) {
        self.count += 1;
        if let Some(time) = self.meaning.time {
            match nanoseconds(row[time]) {
                Some(time_ns) => self.times.see(time_ns),
                None => self.bad_times += 1,
            }
        }
        if let Some(runlevel) = self.meaning.runlevel
            && row[runlevel].is_finite()
        {
            self.runlevels.see(row[runlevel] as i64);
        }
        for ((place, limit), count) in self.meaning.dac.iter().zip(&mut self.at_limit) {
            *count += u64::from(row[*place].abs() >= f64::from(*limit));
        }
        for (places, count) in self.meaning.truth.iter().zip(&mut self.truth) {
            *count += u64::from(!places.is_empty() && places.iter().any(|place| !row[*place].is_nan()));
        }
        let is_still = if self.meaning.speeds.is_empty() {
            let same = |place: &usize| self.before.get(*place) == Some(&row[*place]);
            self.meaning.positions.iter().all(same)
        } else {
            self.meaning.speeds.iter().all(|(place, threshold)| row[*place].abs() < *threshold)
        };
        self.still.see(is_still);
    }

    fn tells_standstill(&self) -> bool {
        !self.meaning.speeds.is_empty() || !self.meaning.positions.is_empty()
    }
}

/// Nanoseconds of a time in seconds, none where they do not fit.
fn nanoseconds(seconds: f64) -> Option<i64> {
    let whole = seconds.floor();
    if !seconds.is_finite() || whole.abs() > 9e9 {
        return None;
    }
    Some(whole as i64 * 1_000_000_000 + ((seconds - whole) * 1e9).round() as i64)
}

pub(super) fn describe(
    name: &str,
    source: &mut dyn TableSource,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Description, StreamError> {
    let mut rows = Rows::new(source.columns());
    let mut batch = Batch::new(source.columns());
    while source.next(&mut batch)? {
        rows.see(&batch);
        let (done, total) = source.progress();
        progress(done, total);
    }
    Ok(result(name, source, rows))
}

fn result(name: &str, source: &dyn TableSource, rows: Rows) -> Description {
    let mut findings = source.findings();
    if rows.bad_times > 0 {
        findings.push(format!("{} rows have no time that can be used", rows.bad_times));
    }
    let saturation = rows.meaning.dac.iter().zip(&rows.at_limit).map(|((place, limit), count)| Saturation {
        channel: source.columns()[*place].name.clone(),
        limit_counts: *limit,
        share: share(*count, rows.count),
        at_extreme_share: match &rows.cells[*place] {
            Cells::Numbers(numbers) => share(numbers.at_extremes(), rows.count),
            Cells::Words(_) => 0.0,
        },
    });
    let saturation = saturation.collect();
    let [position_share, rotation_share, joints_share] = rows.truth.map(|count| share(count, rows.count));
    let has_truth = rows.meaning.truth.iter().any(|places| !places.is_empty());
    let truth = TruthCoverage { arm: String::new(), position_share, rotation_share, joints_share };
    let standstill = rows.tells_standstill().then(|| rows.still.result("", &rows.meaning.rule));
    let timing = if rows.meaning.time.is_some() { rows.times.timing() } else { None };
    let channel = |(cells, column): (Cells, &TableColumn)| match cells {
        Cells::Numbers(numbers) => numbers.channel(column.name.clone(), column.unit().unwrap_or("")),
        Cells::Words(words) => words.channel(column.name.clone()),
    };
    Description {
        file: name.to_owned(),
        format: source.format().to_owned(),
        bytes: source.progress().1,
        metadata: source.metadata().to_vec(),
        topics: Vec::new(),
        streams: vec![Stream { name: "rows".to_owned(), count: rows.count, timing }],
        channels: rows.cells.into_iter().zip(source.columns()).map(channel).collect(),
        repeated_rows: rows.repeated,
        standstill: standstill.into_iter().collect(),
        saturation,
        runlevels: rows.runlevels.shares(rows.count),
        truth: has_truth.then_some(truth).into_iter().collect(),
        findings,
        damage: source.damage().map(DamageAt::from),
    }
}
