//! Development probe: frames.
use std::path::Path;
use vision::*;
fn main() {
    let debug = std::env::args().nth(1).is_some();
    for scene in ["easy", "occlusion", "hard"] {
        let dir = Path::new("/work/shared/data/vision-rendered").join(scene);
        let truth: Vec<Vec<f64>> = std::fs::read_to_string(dir.join("truth.csv"))
            .unwrap()
            .lines()
            .skip(1)
            .map(|l| l.split(',').map(|c| c.parse().unwrap()).collect())
            .collect();
        let rig = rig::read(&dir).unwrap();
        let names: Vec<String> = rig.cameras.iter().map(|c| c.name.clone()).collect();
        let picks = table::read_picks(&dir.join("markers.csv"), &names).unwrap();
        let firsts = localise::first_poses(&rig, &dir, &picks).unwrap();
        let mut cal = bundle::adjust(&rig, &firsts, &picks, &bundle::Priors::default()).unwrap();
        if std::env::args().nth(1).as_deref() == Some("true") {
            let text =
                std::fs::read_to_string(dir.join("cameras_true.json")).unwrap().replace(['[', ']', '{', '}', '"', ',', '\n'], " ");
            let toks: Vec<f64> = text.split_whitespace().filter_map(|t| t.parse().ok()).collect();
            for k in 0..4 {
                let t = &toks[19 * k..19 * k + 19];
                let c = nalgebra::Point3::new(t[0], t[1], t[2]) / 1000.0;
                cal.cameras[k] = Camera {
                    name: String::new(),
                    rotation: nalgebra::Rotation3::from_matrix_unchecked(nalgebra::Matrix3::from_row_slice(&t[3..12])),
                    centre_m: c,
                    intrinsics: Intrinsics {
                        focal_px: [t[12]; 2],
                        centre_px: [t[13], t[14]],
                        distortion: [t[15], t[16], t[17], t[18]],
                    },
                    size_px: [1280, 720],
                };
            }
        }
        let fixture = rig.fixture.clone().unwrap();
        let load = |f: usize| -> Vec<Option<image::RgbImage>> {
            (0..4).map(|k| picture::read(&dir.join(format!("frames/cam{k}/{f:06}.jpg")), [1280, 720]).ok()).collect()
        };
        let ims: Vec<_> = (0..truth.len()).step_by(3).flat_map(|f| load(f).into_iter().flatten()).collect();
        let ranges = colour::learn(&fixture.balls, ims.iter());
        let mut s = frame::Scene {
            cameras: &cal.cameras,
            bearing_px: vec![0.25; 4],
            fixture: &fixture,
            ranges,
            radius_px: vec![[34.0, 62.0]; 4],
            halo_px: [0.15, 0.2],
        };
        let mut halos = vec![];
        let (mut sum, mut osum, mut n) = (0.0, 0.0, 0.0);
        let mut mean = nalgebra::Vector3::zeros();
        let mut pool: Vec<(f64, f64)> = vec![];
        let mut pool2: Vec<(f64, f64, f64, f64, usize, usize)> = vec![];
        let mut prev: Option<nalgebra::Isometry3<f64>> = None;
        for (f, row) in truth.iter().enumerate() {
            let images = load(f);
            let t0 = std::time::Instant::now();
            let r = s.measure(&images, prev.as_ref().map(|p| (p, 14.0)));
            let dt = t0.elapsed().as_secs_f64() * 1e3;
            match r {
                Err(e) => println!("{scene} f{f} lost {e:?}"),
                Ok(m) => {
                    let p = m.fitted.pose.translation.vector * 1e3;
                    let d = p - nalgebra::Vector3::new(row[2], row[3], row[4]);
                    let q = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(row[5], row[6], row[7], row[8]));
                    let a = q.angle_to(&m.fitted.pose.rotation).to_degrees();
                    let h = s.halos_px(&m);
                    halos.extend(h);
                    sum += d.norm_squared();
                    osum += a * a;
                    n += 1.0;
                    mean += d;
                    let sd: Vec<f64> = (0..3).map(|k| m.fitted.covariance[(3 + k, 3 + k)].sqrt() * 1e3).collect();
                    println!(
                        "{scene} f{f} err {:.3} ({:.2} {:.2} {:.2}) ang {a:.3} res {:.3} sd {:.2} chi {:.1} views {:?} {dt:.0}ms",
                        d.norm(),
                        d.x,
                        d.y,
                        d.z,
                        m.residual_m * 1e3,
                        sd.iter().map(|v| v * v).sum::<f64>().sqrt(),
                        m.fitted.chi_square,
                        m.views
                            .iter()
                            .map(|v| v
                                .iter()
                                .map(|v| match v {
                                    frame::View::Effective(_) => 'E',
                                    frame::View::Suspended(s) => format!("{s:?}").to_lowercase().chars().next().unwrap(),
                                })
                                .collect::<String>())
                            .collect::<Vec<_>>()
                    );
                    {
                        let (lo, hi) = (f.saturating_sub(1), (f + 1).min(truth.len() - 1));
                        let (mut a, mut y) = (nalgebra::Matrix2::<f64>::zeros(), nalgebra::Vector2::zeros());
                        let mut all = vec![];
                        for b in 0..3 {
                            for k in 0..4 {
                                if let frame::View::Effective(g) = &m.views[b][k] {
                                    let at = |q: usize| {
                                        nalgebra::Point3::new(truth[q][9 + 3 * b], truth[q][10 + 3 * b], truth[q][11 + 3 * b])
                                            / 1000.0
                                    };
                                    let v = (cal.cameras[k].project(&at(hi)).unwrap() - cal.cameras[k].project(&at(lo)).unwrap())
                                        / (hi - lo) as f64;
                                    for q in &g.points {
                                        if q.width_px.is_finite() {
                                            if (q.width_px / 0.8416).powi(2) < 5.0 {
                                                pool2.push((
                                                    v.dot(&q.normal).powi(2),
                                                    (q.width_px / 0.8416).powi(2),
                                                    q.normal.x,
                                                    q.normal.y,
                                                    4 * b + k,
                                                    f,
                                                ));
                                            }
                                            all.push((v.dot(&q.normal).powi(2), (q.width_px / 0.8416).powi(2)));
                                        }
                                    }
                                }
                            }
                        }
                        pool.extend(all.iter().copied());
                        for _ in 0..1 {
                            for (x, w) in &all {
                                if *w < 4.0 {
                                    let r = nalgebra::Vector2::new(1.0, *x);
                                    a += r * r.transpose();
                                    y += r * *w;
                                }
                            }
                        }
                        let s2 = a.try_inverse().unwrap() * y;
                        let rest = (all.iter().filter(|q| q.1 < 4.0).map(|q| (q.1 - s2[0] - s2[1] * q.0).powi(2)).sum::<f64>()
                            / all.len() as f64)
                            .sqrt();
                        println!(
                            "   base {:.2} slope {:.4} sd {:.4} T {:.3} n {}",
                            s2[0],
                            s2[1],
                            rest * a.try_inverse().unwrap()[(1, 1)].sqrt(),
                            (12.0 * s2[1].max(0.0)).sqrt(),
                            all.len()
                        );
                    }
                    if debug {
                        for b in 0..3 {
                            for k in 0..4 {
                                if let frame::View::Effective(g) = &m.views[b][k] {
                                    let c = nalgebra::Point3::new(row[9 + 3 * b], row[10 + 3 * b], row[11 + 3 * b]) / 1000.0;
                                    let e = cal.cameras[k].project(&c).unwrap();
                                    let lr = edge::Cone::of_sphere(&cal.cameras[k].local(&c), 0.02).unwrap().opening_rad;
                                    println!(
                                        "    b{b} cam{k} off {:.2} {:.2} open {:.2} vis {:.2} scat {:.2}",
                                        g.pixel.x - e.x,
                                        g.pixel.y - e.y,
                                        (g.cone.opening_rad - lr) * 1420.0,
                                        g.visible,
                                        g.scatter_px
                                    );
                                }
                            }
                        }
                    }
                    prev = Some(m.fitted.pose);
                    let mut hs = halos.clone();
                    hs.sort_by(f64::total_cmp);
                    if hs.len() > 10 {
                        s.halo_px = [hs[hs.len() / 2], 0.1];
                    }
                }
            }
        }
        let nf = truth.len();
        for per_frame in [false, true] {
            let ns = if per_frame { nf } else { 1 };
            let nn = 60 + ns;
            let mut sol = nalgebra::DVector::<f64>::zeros(nn);
            let mut sd = vec![0.0; ns];
            for it in 0..8 {
                let mut a = nalgebra::DMatrix::<f64>::identity(nn, nn) * 1e-9;
                let mut y = nalgebra::DVector::zeros(nn);
                let (mut rr, mut cc) = (0.0, 0.0);
                for q in &pool2 {
                    let mut r = nalgebra::DVector::<f64>::zeros(nn);
                    r[if per_frame { q.5 } else { 0 }] = q.0;
                    let o = ns + 5 * q.4;
                    r[o] = 1.0;
                    r[o + 1] = q.2 * q.2 - q.3 * q.3;
                    r[o + 2] = q.2 * q.3;
                    r[o + 3] = q.2;
                    r[o + 4] = q.3;
                    let res = q.1 - r.dot(&sol);
                    let w = if it == 0 {
                        1.0
                    } else {
                        let u = res / 1.0;
                        if u.abs() > 1.0 { 0.0 } else { (1.0 - u * u).powi(2) }
                    };
                    rr += w * res * res;
                    cc += w;
                    a += &r * r.transpose() * w;
                    y += &r * (q.1 * w);
                }
                let inv = a.try_inverse().unwrap();
                sol = &inv * &y;
                for k in 0..ns {
                    sd[k] = (rr / cc * inv[(k, k)]).sqrt();
                }
            }
            println!("   robust {:?}", (0..ns).map(|k| format!("{:.4}+-{:.4}", sol[k], sd[k])).collect::<Vec<_>>());
        }
        println!(
            "== {scene} rms {:.3} mm, {:.3} deg, mean {:?} n {n} halo {:?}",
            f64::sqrt(sum / n),
            f64::sqrt(osum / n),
            (mean / n).as_slice(),
            s.halo_px
        );
    }
}
