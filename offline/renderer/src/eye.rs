//! An eye: which line of sight belongs to which place on the sensor. Pixels count from the image's upper left corner.

use nalgebra::{Matrix3, Vector3};

/// A lens: pinhole with radial (k1, k2) and tangential (p1, p2) distortion.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lens {
    pub(crate) focal_px: f64,
    pub(crate) centre_px: [f64; 2],
    pub(crate) bend: [f64; 4],
}

impl Lens {
    /// Slopes of a line of sight to where it meets the sensor, px.
    fn meets(&self, sx: f64, sy: f64) -> [f64; 2] {
        let [k1, k2, p1, p2] = self.bend;
        let square = sx * sx + sy * sy;
        let stretch = 1.0 + k1 * square + k2 * square * square;
        let u = sx * stretch + 2.0 * p1 * sx * sy + p2 * (square + 2.0 * sx * sx);
        let v = sy * stretch + p1 * (square + 2.0 * sy * sy) + 2.0 * p2 * sx * sy;
        [self.focal_px * u + self.centre_px[0], self.focal_px * v + self.centre_px[1]]
    }

    /// Slopes of the line of sight of a place on the sensor: Newton's method with slopes by differences.
    fn slopes(&self, u: f64, v: f64) -> [f64; 2] {
        let mut s = [(u - self.centre_px[0]) / self.focal_px, (v - self.centre_px[1]) / self.focal_px];
        for _ in 0..12 {
            let h = 1e-6;
            let here = self.meets(s[0], s[1]);
            let (dx, dy) = (self.meets(s[0] + h, s[1]), self.meets(s[0], s[1] + h));
            let (a, b) = ((dx[0] - here[0]) / h, (dy[0] - here[0]) / h);
            let (c, d) = ((dx[1] - here[1]) / h, (dy[1] - here[1]) / h);
            let (off_u, off_v) = (u - here[0], v - here[1]);
            let determinant = a * d - b * c;
            if determinant.abs() < 1e-9 {
                break;
            }
            s[0] += (d * off_u - b * off_v) / determinant;
            s[1] += (a * off_v - c * off_u) / determinant;
            if off_u.hypot(off_v) < 1e-9 {
                break;
            }
        }
        s
    }
}

/// An eye in the world.
#[derive(Debug, Clone)]
pub(crate) struct Eye {
    pub(crate) name: String,
    /// Rows: right, down, forward.
    pub(crate) axes: Matrix3<f64>,
    pub(crate) place_m: Vector3<f64>,
    pub(crate) lens: Lens,
    pub(crate) size_px: [u32; 2],
}

impl Eye {
    /// Where a point is seen; `None` behind the eye or outside the image.
    pub(crate) fn sees(&self, point_m: &Vector3<f64>) -> Option<[f64; 2]> {
        let seen = self.axes * (point_m - self.place_m);
        if seen.z < 1e-3 {
            return None;
        }
        let [u, v] = self.lens.meets(seen.x / seen.z, seen.y / seen.z);
        let inside = u >= 0.0 && v >= 0.0 && u < f64::from(self.size_px[0]) && v < f64::from(self.size_px[1]);
        inside.then_some([u, v])
    }

    /// Where a sphere is seen at most: columns and rows, first and behind the last; `None` outside the image.
    pub(crate) fn box_of(&self, centre_m: &Vector3<f64>, radius_m: f64) -> Option<[i64; 4]> {
        let seen = self.axes * (centre_m - self.place_m);
        if seen.z <= radius_m {
            return None;
        }
        let middle = self.lens.meets(seen.x / seen.z, seen.y / seen.z);
        // Off the axis outlines are longer than wide; a quarter more and some pixels hold them, and blur.
        let slant = (seen.x.hypot(seen.y) / seen.z).hypot(1.0);
        let reach = 1.25 * slant * self.lens.focal_px * radius_m / (seen.z - radius_m) + 4.0;
        let [w, h] = self.size_px.map(i64::from);
        let limits = [
            ((middle[0] - reach) as i64).clamp(0, w),
            ((middle[1] - reach) as i64).clamp(0, h),
            ((middle[0] + reach) as i64 + 1).clamp(0, w),
            ((middle[1] + reach) as i64 + 1).clamp(0, h),
        ];
        (limits[0] < limits[2] && limits[1] < limits[3]).then_some(limits)
    }

    /// Lines of sight at all corners of pixels.
    pub(crate) fn sights(&self) -> Sights {
        let [w, h] = self.size_px.map(|n| n as usize);
        let mut slopes = Vec::with_capacity((w + 1) * (h + 1));
        for v in 0..=h {
            for u in 0..=w {
                slopes.push(self.lens.slopes(u as f64, v as f64));
            }
        }
        Sights { columns: w + 1, slopes, axes: self.axes }
    }
}

/// Lines of sight at all corners of pixels; distortion is straight enough within one.
pub(crate) struct Sights {
    columns: usize,
    slopes: Vec<[f64; 2]>,
    axes: Matrix3<f64>,
}

impl Sights {
    /// World direction of a place within a pixel, of length one.
    pub(crate) fn direction(&self, column: usize, row: usize, a: f64, b: f64) -> Vector3<f64> {
        let at = row * self.columns + column;
        let corners = [at, at + 1, at + self.columns, at + self.columns + 1].map(|k| self.slopes[k]);
        let mixed = |k: usize| {
            (corners[0][k] * (1.0 - a) + corners[1][k] * a) * (1.0 - b) + (corners[2][k] * (1.0 - a) + corners[3][k] * a) * b
        };
        (self.axes.transpose() * Vector3::new(mixed(0), mixed(1), 1.0)).normalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_of_sight_leads_back_to_its_pixel() {
        let lens = Lens { focal_px: 500.0, centre_px: [330.0, 235.0], bend: [-0.25, 0.08, 0.001, -0.002] };
        let eye = Eye {
            name: "a".into(),
            axes: *nalgebra::Rotation3::from_euler_angles(0.3, -0.2, 1.0).matrix(),
            place_m: Vector3::new(0.1, 0.2, 0.3),
            lens,
            size_px: [640, 480],
        };
        let sights = eye.sights();
        for (column, row) in [(0, 0), (639, 479), (100, 400), (320, 240)] {
            let point = eye.place_m + sights.direction(column, row, 0.3, 0.7) * 0.8;
            let [u, v] = eye.sees(&point).unwrap();
            assert!((u - column as f64 - 0.3).abs() < 5e-4 && (v - row as f64 - 0.7).abs() < 5e-4, "{u} {v}");
        }
    }
}
