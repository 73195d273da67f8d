//! Pinhole camera with Brown-Conrady distortion (D. C. Brown, "Close-range camera calibration", 1971).
//!
//! World and camera frames in metres; camera z looks forward, x to the right, y down; pixels are counted from the image's
//! upper left corner: the centre of the first one is (0.5, 0.5).

use nalgebra::{Matrix2, Matrix2x3, Point2, Point3, Rotation3, Unit, Vector2, Vector3};

/// What a camera does to directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Intrinsics {
    /// Focal lengths along u and v, px.
    pub focal_px: [f64; 2],
    /// Principal point (u, v), px.
    pub centre_px: [f64; 2],
    /// k1, k2 (radial), p1, p2 (tangential), of normalised coordinates.
    pub distortion: [f64; 4],
}

/// A camera that knows where it stands.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// As in `rig.toml`.
    pub name: String,
    /// Turns world directions into the camera's frame.
    pub rotation: Rotation3<f64>,
    /// Optical centre in the world.
    pub centre_m: Point3<f64>,
    /// Lens and sensor.
    pub intrinsics: Intrinsics,
    /// Width and height of its images.
    pub size_px: [u32; 2],
}

impl Intrinsics {
    /// Distorted normalised coordinates of undistorted ones.
    pub fn distort(&self, ideal: Vector2<f64>) -> Vector2<f64> {
        let [k1, k2, p1, p2] = self.distortion;
        let (x, y) = (ideal.x, ideal.y);
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * k2);
        Vector2::new(
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        )
    }

    /// Undistorted normalised coordinates of distorted ones; fixed-point iteration, which converges for the lenses of webcams.
    pub fn undistort(&self, distorted: Vector2<f64>) -> Vector2<f64> {
        let mut ideal = distorted;
        for _ in 0..20 {
            let step = distorted - self.distort(ideal);
            ideal += step;
            if step.norm_squared() < 1e-26 {
                break;
            }
        }
        ideal
    }

    /// Pixel of a point in the camera's frame; `None` behind the camera.
    pub fn pixel(&self, point: &Vector3<f64>) -> Option<Point2<f64>> {
        if point.z <= 1e-9 || !point.z.is_finite() {
            return None;
        }
        let seen = self.distort(Vector2::new(point.x / point.z, point.y / point.z));
        Some(Point2::new(self.focal_px[0] * seen.x + self.centre_px[0], self.focal_px[1] * seen.y + self.centre_px[1]))
    }

    /// Direction in the camera's frame that a pixel looks along.
    pub fn direction(&self, pixel: Point2<f64>) -> Unit<Vector3<f64>> {
        let seen = Vector2::new((pixel.x - self.centre_px[0]) / self.focal_px[0], (pixel.y - self.centre_px[1]) / self.focal_px[1]);
        let ideal = self.undistort(seen);
        Unit::new_normalize(Vector3::new(ideal.x, ideal.y, 1.0))
    }
}

impl Camera {
    /// World point in the camera's frame.
    pub fn local(&self, point_m: &Point3<f64>) -> Vector3<f64> {
        self.rotation * (point_m - self.centre_m)
    }

    /// Pixel of a world point; `None` behind the camera.
    pub fn project(&self, point_m: &Point3<f64>) -> Option<Point2<f64>> {
        self.intrinsics.pixel(&self.local(point_m))
    }

    /// World direction that a pixel looks along.
    pub fn ray(&self, pixel: Point2<f64>) -> Unit<Vector3<f64>> {
        self.rotation.inverse() * self.intrinsics.direction(pixel)
    }

    /// Derivative of the pixel by the world point, px per m; central differences of a micrometre.
    pub fn pixel_by_point(&self, point_m: &Point3<f64>) -> Option<Matrix2x3<f64>> {
        let step_m = 1e-6;
        let mut by = Matrix2x3::zeros();
        for axis in 0..3 {
            let mut offset = Vector3::zeros();
            offset[axis] = step_m;
            let difference = self.project(&(point_m + offset))? - self.project(&(point_m - offset))?;
            by.set_column(axis, &(difference / (2.0 * step_m)));
        }
        Some(by)
    }

    /// Is a pixel inside the image?
    pub fn sees(&self, pixel: Point2<f64>) -> bool {
        (0.0..f64::from(self.size_px[0])).contains(&pixel.x) && (0.0..f64::from(self.size_px[1])).contains(&pixel.y)
    }

    /// Camera at a place that looks at another, its v axis as near to straight down as can be.
    pub fn looking_at(
        name: &str,
        centre_m: Point3<f64>,
        at_m: Point3<f64>,
        intrinsics: Intrinsics,
        size_px: [u32; 2],
    ) -> Option<Self> {
        let forward = Unit::try_new(at_m - centre_m, 1e-9)?;
        let helper = if forward.z.abs() > 0.999 { Vector3::y() } else { Vector3::z() };
        let right = Unit::try_new(forward.cross(&helper), 1e-9)?;
        let down = forward.cross(&right);
        let axes = nalgebra::Matrix3::from_rows(&[right.transpose(), down.transpose(), forward.transpose()]);
        let rotation = Rotation3::from_matrix_unchecked(axes);
        Some(Self { name: name.to_owned(), rotation, centre_m, intrinsics, size_px })
    }
}

/// Largest standard deviation of a plane covariance.
pub fn largest_deviation(covariance: &Matrix2<f64>) -> f64 {
    covariance.symmetric_eigenvalues().max().max(0.0).sqrt()
}
