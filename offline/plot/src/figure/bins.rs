//! Samples into bins: histograms, medians and quantiles along an axis, and grids over two.

use super::Cells;
use super::scale::drawable;

/// Least and greatest finite value; low above high if there is none.
pub fn extent(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    values
        .into_iter()
        .filter(|value| drawable(*value))
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
}

/// Quantile of rising finite values, between neighbours by straight lines (as NumPy's default); NaN for none.
pub fn quantile(sorted: &[f64], share: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let place = share.clamp(0.0, 1.0) * last as f64;
    let low = place.floor() as usize;
    let high = (low + 1).min(last);
    sorted[low] + (place - low as f64) * (sorted[high] - sorted[low])
}

/// Quantile of finite values in any order, which it changes; NaN for none. As [`quantile`], without sorting all of them.
pub fn select(values: &mut [f64], share: f64) -> f64 {
    let Some(last) = values.len().checked_sub(1) else { return f64::NAN };
    let place = share.clamp(0.0, 1.0) * last as f64;
    let (_, low, above) = values.select_nth_unstable_by(place.floor() as usize, f64::total_cmp);
    let (low, high) = (*low, above.iter().copied().fold(f64::INFINITY, f64::min));
    if place.fract() > 0.0 { low + place.fract() * (high - low) } else { low }
}

/// Counts of equal bins between two limits; values outside are not counted.
#[derive(Debug, Clone, PartialEq)]
pub struct Histogram {
    /// Lower limit of the first bin.
    pub low: f64,
    /// Width of a bin.
    pub width: f64,
    /// One count per bin.
    pub counts: Vec<u64>,
}

/// Counts values between `low` and `high` in `bins` bins.
pub fn histogram(values: impl IntoIterator<Item = f64>, (low, high): (f64, f64), bins: usize) -> Histogram {
    let bins = bins.max(1);
    let width = if high > low { (high - low) / bins as f64 } else { 1.0 };
    let mut counts = vec![0; bins];
    for value in values.into_iter().filter(|value| *value >= low && *value <= high) {
        counts[(((value - low) / width) as usize).min(bins - 1)] += 1;
    }
    Histogram { low, width, counts }
}

/// What lies in one bin along x.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Summary {
    /// Middle of the bin.
    pub x: f64,
    /// 5th, 50th and 95th percentile of y.
    pub low: f64,
    /// Median of y.
    pub middle: f64,
    /// 95th percentile of y.
    pub high: f64,
    /// Samples in it.
    pub count: usize,
}

/// Quantiles of y in `bins` equal bins of x between two limits; bins with fewer than `least` samples are left out.
pub fn along(samples: impl IntoIterator<Item = (f64, f64)>, (low, high): (f64, f64), bins: usize, least: usize) -> Vec<Summary> {
    let bins = bins.max(1);
    let width = (high - low) / bins as f64;
    if width.is_nan() || width <= 0.0 {
        return Vec::new();
    }
    let mut sorted: Vec<Vec<f64>> = vec![Vec::new(); bins];
    for (x, y) in samples.into_iter().filter(|(x, y)| *x >= low && *x <= high && drawable(*y)) {
        sorted[(((x - low) / width) as usize).min(bins - 1)].push(y);
    }
    let summary = |(i, values): (usize, &mut Vec<f64>)| {
        values.sort_unstable_by(f64::total_cmp);
        (values.len() >= least.max(1)).then(|| Summary {
            x: low + (i as f64 + 0.5) * width,
            low: quantile(values, 0.05),
            middle: quantile(values, 0.5),
            high: quantile(values, 0.95),
            count: values.len(),
        })
    };
    sorted.iter_mut().enumerate().filter_map(summary).collect()
}

/// Means of z over a grid of `columns` by `rows` cells in x and y; cells with fewer than `least` samples are NaN.
pub fn grid(
    samples: impl IntoIterator<Item = (f64, f64, f64)>,
    x: (f64, f64),
    y: (f64, f64),
    (columns, rows): (usize, usize),
    least: usize,
) -> Cells {
    let (columns, rows) = (columns.max(1), rows.max(1));
    let (mut sums, mut counts) = (vec![0.0; columns * rows], vec![0_usize; columns * rows]);
    let place = |value: f64, (low, high): (f64, f64), bins: usize| {
        let inside = value >= low && value <= high && high > low;
        inside.then(|| (((value - low) / (high - low) * bins as f64) as usize).min(bins - 1))
    };
    for (a, b, z) in samples.into_iter().filter(|(_, _, z)| drawable(*z)) {
        if let (Some(column), Some(row)) = (place(a, x, columns), place(b, y, rows)) {
            sums[row * columns + column] += z;
            counts[row * columns + column] += 1;
        }
    }
    let mean = |(sum, count): (&f64, &usize)| if *count >= least.max(1) { sum / *count as f64 } else { f64::NAN };
    Cells { x, y, columns, values: sums.iter().zip(&counts).map(mean).collect() }
}

/// As [`grid`], with the number of samples in each cell instead of a mean; empty cells are NaN.
pub fn density(
    samples: impl IntoIterator<Item = (f64, f64)>,
    x: (f64, f64),
    y: (f64, f64),
    (columns, rows): (usize, usize),
) -> Cells {
    let (columns, rows) = (columns.max(1), rows.max(1));
    let mut counts = vec![0.0; columns * rows];
    let inside = |(a, b): &(f64, f64)| *a >= x.0 && *a <= x.1 && *b >= y.0 && *b <= y.1 && x.1 > x.0 && y.1 > y.0;
    for (a, b) in samples.into_iter().filter(inside) {
        let column = (((a - x.0) / (x.1 - x.0) * columns as f64) as usize).min(columns - 1);
        let row = (((b - y.0) / (y.1 - y.0) * rows as f64) as usize).min(rows - 1);
        counts[row * columns + column] += 1.0;
    }
    Cells { x, y, columns, values: counts.into_iter().map(|count| if count > 0.0 { count } else { f64::NAN }).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_finite_value_is_counted_once() {
        let values = [0.0, 0.5, 1.0, 1.0, f64::NAN, 2.0, 3.0];
        assert_eq!(histogram(values, (0.0, 2.0), 2).counts, [2, 3]);
        assert_eq!(extent(values), (0.0, 3.0));
        assert!(extent([f64::NAN]).0 > extent([f64::NAN]).1);
        assert_eq!(histogram([1.0, 1.0], (1.0, 1.0), 4).counts.iter().sum::<u64>(), 2);
    }

    #[test]
    fn quantiles_are_those_of_numpy() {
        // numpy.quantile([1, 2, 4, 8], [0, 0.25, 0.5, 0.95, 1]) = 1, 1.75, 3, 7.4, 8
        for (share, expected) in [(0.0, 1.0), (0.25, 1.75), (0.5, 3.0), (0.95, 7.4), (1.0, 8.0)] {
            assert!((quantile(&[1.0, 2.0, 4.0, 8.0], share) - expected).abs() < 1e-12);
            assert!((select(&mut [4.0, 1.0, 8.0, 2.0], share) - expected).abs() < 1e-12);
        }
        assert!(quantile(&[], 0.5).is_nan());
    }

    #[test]
    fn grids_average_and_leave_thin_cells_blank() {
        let samples = [(0.1, 0.1, 2.0), (0.2, 0.2, 4.0), (0.9, 0.9, 7.0), (0.9, 0.1, f64::NAN)];
        let cells = grid(samples, (0.0, 1.0), (0.0, 1.0), (2, 2), 1);
        assert!(cells.values[0] == 3.0 && cells.values[1].is_nan() && cells.values[2].is_nan() && cells.values[3] == 7.0);
        assert!(grid(samples, (0.0, 1.0), (0.0, 1.0), (2, 2), 2).values[3].is_nan());
        let middles: Vec<f64> = along([(0.0, 1.0), (0.1, 3.0), (0.9, 5.0)], (0.0, 1.0), 2, 1).iter().map(|s| s.middle).collect();
        assert_eq!(middles, [2.0, 5.0]);
    }
}
