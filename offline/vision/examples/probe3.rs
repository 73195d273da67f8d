//! Development probe: Hough against truth.
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
        let ims: Vec<_> =
            (0..4).map(|k| picture::read(&dir.join(format!("frames/cam{k}/000002.jpg")), [1280, 720]).unwrap()).collect();
        let names = ["green".to_string(), "yellow".into(), "red".into()];
        let ranges = colour::learn(&names, ims.iter());
        println!("{scene} {ranges:?}");
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
                    let px = cam.project(&p).unwrap();
                    let t0 = std::time::Instant::now();
                    let found =
                        hough::extent(&im, &ranges[b], 12).map(|w| (w, hough::circles(&im, w, &ranges[b], [34.0, 62.0], 3)));
                    let dt = t0.elapsed();
                    let Some((w, cs)) = found else {
                        println!("f{} cam{k} b{b} nothing", row[0]);
                        continue;
                    };
                    println!(
                        "f{} cam{k} b{b} {:?} {:.1}ms {}",
                        row[0],
                        (w.width, w.height),
                        dt.as_secs_f64() * 1e3,
                        cs.iter()
                            .map(|c| format!("[{:.1} r {:.1} s {:.2}]", (c.centre - px).norm(), c.radius_px, c.support))
                            .collect::<String>()
                    );
                }
            }
        }
    }
}
