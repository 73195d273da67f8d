//! From any number of samples to what the pixels can show: least and greatest value per column.

/// A finite sample (x, y).
pub type Point = (f64, f64);

/// Strokes of a line over rising `x`: per column of `columns` between the ends of `span` the least and the greatest value in
/// their order, and the line's first and last point. Samples that are not finite are left out; where the distance in x between
/// two samples exceeds `gap`, a new stroke begins.
pub fn min_max(samples: impl IntoIterator<Item = Point>, span: (f64, f64), columns: usize, gap: f64) -> Vec<Vec<Point>> {
    let width = (span.1 - span.0) / columns.max(1) as f64;
    let mut strokes: Vec<Vec<Point>> = Vec::new();
    let mut column = Column::default();
    let mut last: Option<Point> = None;
    let finite = |(x, y): &Point| super::scale::drawable(*x) && super::scale::drawable(*y);
    for point in samples.into_iter().filter(finite).filter(|(x, _)| *x >= span.0 && *x <= span.1) {
        let number = if width > 0.0 { ((point.0 - span.0) / width) as usize } else { 0 };
        let broken = last.is_none_or(|last| point.0 - last.0 > gap);
        if broken || number != column.number {
            column.flush(strokes.last_mut());
            column = Column { number, ..Column::default() };
        }
        if broken {
            if let (Some(stroke), Some(last)) = (strokes.last_mut(), last) {
                push(stroke, last);
            }
            strokes.push(vec![point]);
        }
        column.see(point);
        last = Some(point);
    }
    column.flush(strokes.last_mut());
    if let (Some(stroke), Some(last)) = (strokes.last_mut(), last) {
        push(stroke, last);
    }
    strokes
}

#[derive(Default)]
struct Column {
    number: usize,
    least: Option<Point>,
    most: Option<Point>,
}

impl Column {
    fn see(&mut self, point: Point) {
        if self.least.is_none_or(|least| point.1 < least.1) {
            self.least = Some(point);
        }
        if self.most.is_none_or(|most| point.1 > most.1) {
            self.most = Some(point);
        }
    }

    fn flush(&self, stroke: Option<&mut Vec<Point>>) {
        if let (Some(stroke), Some(least), Some(most)) = (stroke, self.least, self.most) {
            let (first, second) = if least.0 <= most.0 { (least, most) } else { (most, least) };
            push(stroke, first);
            push(stroke, second);
        }
    }
}

fn push(stroke: &mut Vec<Point>, point: Point) {
    if stroke.last() != Some(&point) {
        stroke.push(point);
    }
}

/// At most `most` of the samples, evenly chosen, finite ones only.
pub fn every(samples: impl ExactSizeIterator<Item = Point>, most: usize) -> Vec<Point> {
    let stride = samples.len() / most.max(1) + 1;
    samples.step_by(stride).filter(|(x, y)| super::scale::drawable(*x) && super::scale::drawable(*y)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extremes_survive_and_the_size_is_bounded() {
        let value = |i: usize| if i == 123_456 { 9.0 } else { (i as f64 * 0.01).sin() };
        let strokes = min_max((0..1_000_000).map(|i| (i as f64, value(i))), (0.0, 999_999.0), 300, 10.0);
        assert_eq!(strokes.len(), 1);
        assert!(strokes[0].len() <= 602, "{}", strokes[0].len());
        assert!(strokes[0].contains(&(123_456.0, 9.0)));
        assert_eq!(strokes[0].first(), Some(&(0.0, 0.0)));
        assert_eq!(strokes[0].last().map(|point| point.0), Some(999_999.0));
        assert!(strokes[0].windows(2).all(|pair| pair[0].0 <= pair[1].0));
    }

    #[test]
    fn gaps_break_and_missing_values_do_not() {
        let samples = [(0.0, 1.0), (1.0, f64::NAN), (2.0, 1.5), (9.0, 2.0), (10.0, f64::INFINITY), (11.0, 3.0)];
        let strokes = min_max(samples, (0.0, 11.0), 100, 3.0);
        assert_eq!(strokes, [vec![(0.0, 1.0), (2.0, 1.5)], vec![(9.0, 2.0), (11.0, 3.0)]]);
        assert!(min_max([], (0.0, 1.0), 10, 1.0).is_empty());
        assert_eq!(min_max([(2.0, 1.0)], (2.0, 2.0), 10, 1.0), [vec![(2.0, 1.0)]]);
    }
}
