//! Development probe: rim against truth.
use std::path::Path;
use vision::*;
fn main() {
    for scene in ["easy", "occlusion", "hard"] {
        let dir = Path::new("/work/shared/data/vision-rendered").join(scene);
        let text =
            std::fs::read_to_string(dir.join("cameras_true.json")).unwrap().replace(['[', ']', '{', '}', '"', ',', '\n'], " ");
        let toks: Vec<f64> = text.split_whitespace().filter_map(|t| t.parse().ok()).collect();
        let truth: Vec<Vec<f64>> = std::fs::read_to_string(dir.join("truth.csv"))
            .unwrap()
            .lines()
            .skip(1)
            .map(|l| l.split(',').map(|c| c.parse().unwrap()).collect())
            .collect();
        let mut radial = Vec::new();
        let mut offs = Vec::new();
        let mut bins = vec![Vec::new(); 12];
        for row in &truth {
            for k in 0..4 {
                let t = &toks[19 * k..19 * k + 19];
                let c = nalgebra::Point3::new(t[0], t[1], t[2]) / 1000.0;
                let cam = Camera {
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
                let im = picture::read(&dir.join(format!("frames/cam{k}/{:06}.jpg", row[0] as u32)), [1280, 720]).unwrap();
                for b in 0..3 {
                    let p = nalgebra::Point3::new(row[9 + 3 * b], row[10 + 3 * b], row[11 + 3 * b]) / 1000.0;
                    let cone = edge::Cone::of_sphere(&cam.local(&p), 0.020).unwrap();
                    let pts = edge::rim(&im, &cam.intrinsics, &cone, 90, 2.0);
                    let res: Vec<(f64, f64, f64)> = pts
                        .iter()
                        .map(|q| {
                            let d = cam.intrinsics.direction(q.pixel);
                            (q.angle_rad, (d.angle(&cone.axis) - cone.opening_rad) * t[12], 0.0)
                        })
                        .filter(|r| r.1.abs() < 1.5)
                        .collect();
                    if res.len() < 80 {
                        continue;
                    }
                    // centre offset and radius offset by linear fit
                    let n = res.len() as f64;
                    let mut a = nalgebra::Matrix3::zeros();
                    let mut y = nalgebra::Vector3::zeros();
                    for r in &res {
                        let v = nalgebra::Vector3::new(r.0.cos(), r.0.sin(), 1.0);
                        a += v * v.transpose();
                        y += v * r.1;
                    }
                    let s = a.try_inverse().unwrap() * y;
                    let rest =
                        (res.iter().map(|r| (r.1 - s[0] * r.0.cos() - s[1] * r.0.sin() - s[2]).powi(2)).sum::<f64>() / n).sqrt();
                    radial.push(s[2]);
                    if scene == "hard" {
                        let f = row[0] as usize;
                        let (lo, hi) = (f.saturating_sub(1), (f + 1).min(truth.len() - 1));
                        let at = |q: usize| {
                            nalgebra::Point3::new(truth[q][9 + 3 * b], truth[q][10 + 3 * b], truth[q][11 + 3 * b]) / 1000.0
                        };
                        let v = (cam.project(&at(hi)).unwrap() - cam.project(&at(lo)).unwrap()) / (hi - lo) as f64;
                        println!(
                            "f{f} cam{k} b{b} off {:.3} {:.3} vel {:.3} {:.3}  tau {:.4} perp {:.3}",
                            s[0],
                            s[1],
                            v.x,
                            v.y,
                            (s[0] * v.x + s[1] * v.y) / v.norm_squared(),
                            (s[0] * v.y - s[1] * v.x) / v.norm()
                        );
                    }
                    offs.push((k, b, s[0], s[1], s[2], rest));
                    for r in &res {
                        bins[(r.0 / std::f64::consts::TAU * 12.0) as usize % 12].push(r.1);
                    }
                }
            }
        }
        println!("{scene} n {} mean radius off {:.3}", radial.len(), radial.iter().sum::<f64>() / radial.len() as f64);
        println!(
            "bins {:?}",
            bins.iter().map(|b| (1000.0 * b.iter().sum::<f64>() / b.len() as f64).round() / 1000.0).collect::<Vec<_>>()
        );
        for k in 0..4 {
            for b in 0..3 {
                let sel: Vec<_> = offs.iter().filter(|o| o.0 == k && o.1 == b).collect();
                let n = sel.len() as f64;
                let m = |f: &dyn Fn(&(usize, usize, f64, f64, f64, f64)) -> f64| sel.iter().map(|o| f(o)).sum::<f64>() / n;
                let sd = |f: &dyn Fn(&(usize, usize, f64, f64, f64, f64)) -> f64| {
                    let mm = m(f);
                    (sel.iter().map(|o| (f(o) - mm).powi(2)).sum::<f64>() / n).sqrt()
                };
                println!(
                    "  cam{k} ball{b} n {} mean {:.3} {:.3} {:.3} sd {:.3} {:.3} {:.3} rest {:.3}",
                    n,
                    m(&|o| o.2),
                    m(&|o| o.3),
                    m(&|o| o.4),
                    sd(&|o| o.2),
                    sd(&|o| o.3),
                    sd(&|o| o.4),
                    m(&|o| o.5)
                );
            }
        }
    }
}
