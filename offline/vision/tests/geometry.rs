//! Camera, triangulation and pose on made-up numbers.

use nalgebra::{Isometry3, Matrix2, Point2, Point3, Translation3, UnitQuaternion, Vector2, Vector3};
use vision::bundle::collinear;
use vision::edge::{Cone, crosswise};
use vision::pose::{by_simplex, closed_form, from_bearings, paper_cost_m};
use vision::simplex;
use vision::triangulate::{Bearing, Ray, mean_of_midpoints, midpoint, weighted};
use vision::{Camera, Intrinsics};

const LENS: Intrinsics =
    Intrinsics { focal_px: [1420.0, 1415.0], centre_px: [643.0, 355.0], distortion: [-0.11, 0.03, 0.0005, -0.0008] };
const FIXTURE_M: [Vector3<f64>; 3] = [Vector3::new(0.038, 0.0, 0.0), Vector3::new(0.0, 0.038, 0.0), Vector3::new(-0.038, 0.0, 0.0)];

fn rig() -> Vec<Camera> {
    let places = [(0.43, -0.43), (0.43, 0.43), (-0.43, 0.43), (-0.43, -0.43)];
    let at = |(x, y): (f64, f64)| Camera::looking_at("c", Point3::new(x, y, 0.03), Point3::new(0.0, 0.0, 0.24), LENS, [1280, 720]);
    places.into_iter().filter_map(at).collect()
}

fn pose() -> Isometry3<f64> {
    let turn = UnitQuaternion::from_euler_angles(0.3, -0.2, 1.1);
    Isometry3::from_parts(Translation3::new(0.01, -0.02, 0.25), turn)
}

fn balls() -> [Point3<f64>; 3] {
    FIXTURE_M.map(|ball| pose() * Point3::from(ball))
}

#[test]
fn a_pixel_is_where_its_ray_is_seen() {
    for camera in rig() {
        for (u, v) in [(20.0, 30.0), (640.0, 360.0), (1270.0, 700.0), (100.0, 690.0)] {
            let point = camera.centre_m + camera.ray(Point2::new(u, v)).into_inner() * 0.6;
            let back = camera.project(&point).expect("before the camera");
            assert!((back - Point2::new(u, v)).norm() < 1e-8, "{back}");
        }
        assert!(camera.project(&(camera.centre_m - camera.ray(Point2::new(640.0, 360.0)).into_inner())).is_none());
    }
}

#[test]
fn the_image_of_a_sphere_is_not_centred_on_the_image_of_its_centre() {
    let camera = &rig()[0];
    let centre = camera.centre_m + camera.ray(Point2::new(1100.0, 600.0)).into_inner() * 0.6;
    let cone = Cone::of_sphere(&camera.local(&centre), 0.02).expect("outside");
    let rim: Vec<Vector2<f64>> =
        (0..360).filter_map(|k| camera.intrinsics.pixel(&cone.ray(f64::from(k).to_radians()))).map(|p| p.coords).collect();
    let mean = rim.iter().sum::<Vector2<f64>>() / 360.0;
    let off = (mean - camera.project(&centre).expect("seen").coords).norm();
    assert!(off > 0.1 && off < 2.0, "{off}");
    let (a, b) = crosswise(&cone.axis);
    assert!(a.dot(&cone.axis).abs() < 1e-12 && b.dot(&cone.axis).abs() < 1e-12 && a.dot(&b).abs() < 1e-12);
}

#[test]
fn rays_that_meet_give_their_meeting_point() {
    let point = Point3::new(0.02, -0.01, 0.26);
    let rays: Vec<Ray> =
        rig().iter().map(|c| Ray { origin_m: c.centre_m, direction: c.ray(c.project(&point).expect("seen")) }).collect();
    assert!((mean_of_midpoints(&rays).expect("a point") - point).norm() < 1e-9);
    let parallel = Ray { origin_m: Point3::origin(), ..rays[0] };
    assert!(midpoint(&rays[0], &parallel).is_none());
    let behind = Ray { direction: -rays[0].direction, ..rays[0] };
    assert!(midpoint(&behind, &rays[1]).is_none());
}

fn bearing<'a>(camera: &'a Camera, point: &Point3<f64>, deviation_rad: f64) -> Bearing<'a> {
    let axis = nalgebra::Unit::new_normalize(camera.local(point));
    Bearing { camera, axis, covariance: Matrix2::identity() * deviation_rad.powi(2) }
}

#[test]
fn a_bad_bearing_with_a_large_deviation_hardly_moves_the_point() {
    let cameras = rig();
    let point = Point3::new(0.02, -0.01, 0.26);
    let off = point + Vector3::new(0.004, 0.0, 0.0);
    let mut bearings: Vec<Bearing> = cameras.iter().map(|c| bearing(c, &point, 1e-4)).collect();
    bearings[2] = bearing(&cameras[2], &off, 1e-1);
    let found = weighted(&bearings, off).expect("a point");
    assert!((found.point_m - point).norm() < 1e-6, "{}", found.point_m);
    assert!(found.covariance.diagonal().iter().all(|v| *v > 0.0 && v.sqrt() < 2e-4));
    assert!(weighted(&bearings[..1], off).is_none());
}

#[test]
fn three_balls_give_the_pose_in_closed_form_and_by_the_simplex() {
    let found = closed_form(&FIXTURE_M, &balls()).expect("a pose");
    assert!((found.translation.vector - pose().translation.vector).norm() < 1e-12);
    assert!(found.rotation.angle_to(&pose().rotation) < 1e-7);
    let mut moved = balls();
    moved[0].x += 0.3e-3;
    moved[2].z -= 0.2e-3;
    let least = by_simplex(&FIXTURE_M, &moved).expect("a pose");
    let closed = closed_form(&FIXTURE_M, &moved).expect("a pose");
    assert!(paper_cost_m(&FIXTURE_M, &moved, &least) <= paper_cost_m(&FIXTURE_M, &moved, &closed));
    assert!((least.translation.vector - pose().translation.vector).norm() < 0.5e-3);
}

#[test]
fn bearings_of_all_balls_give_pose_and_covariance() {
    let cameras = rig();
    let bearings = balls().map(|ball| cameras.iter().map(|c| bearing(c, &ball, 2e-4)).collect::<Vec<_>>());
    let start = Isometry3::from_parts(Translation3::new(0.012, -0.018, 0.249), pose().rotation);
    let found = from_bearings(&FIXTURE_M, &bearings, &start).expect("a pose");
    assert!((found.pose.translation.vector - pose().translation.vector).norm() < 1e-8);
    // Three balls of four cameras, 0.64 m away, 0.2 mrad: 0.13 mm across each ray.
    let deviation_m = found.covariance[(3, 3)].sqrt();
    assert!(deviation_m > 1e-5 && deviation_m < 1e-4, "{deviation_m}");
}

#[test]
fn the_simplex_finds_rosenbrocks_valley() {
    let found =
        simplex::minimise([-1.2, 1.0], [0.1, 0.1], 5000, 1e-16, |x| (1.0 - x[0]).powi(2) + 100.0 * (x[1] - x[0] * x[0]).powi(2));
    assert!((found[0] - 1.0).abs() < 1e-5 && (found[1] - 1.0).abs() < 1e-5, "{found:?}");
}

#[test]
fn cameras_on_one_line_are_known_as_such() {
    assert!(!collinear(&rig()));
    let row = |k: i32| {
        let place = Point3::new(-0.4 + 0.2 * f64::from(k), -0.5, 0.1);
        Camera::looking_at("c", place, Point3::new(0.0, 0.0, 0.24), LENS, [1280, 720])
    };
    assert!(collinear(&(0..3).filter_map(row).collect::<Vec<_>>()));
}
