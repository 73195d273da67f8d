//! Development probe.
use std::path::Path;
use vision::*;
fn main() {
    for scene in ["easy", "occlusion", "hard"] {
        let dir = Path::new("/work/shared/data/vision-rendered").join(scene);
        let rig = rig::read(&dir).unwrap();
        let names: Vec<String> = rig.cameras.iter().map(|c| c.name.clone()).collect();
        let picks = table::read_picks(&dir.join("markers.csv"), &names).unwrap();
        let firsts = localise::first_poses(&rig, &dir, &picks).unwrap();
        let text =
            std::fs::read_to_string(dir.join("cameras_true.json")).unwrap().replace(['[', ']', '{', '}', '"', ',', '\n'], " ");
        let toks: Vec<f64> = text.split_whitespace().filter_map(|t| t.parse().ok()).collect();
        let paper = localise::paper_poses(&rig, &firsts, &picks).unwrap();
        let joint = bundle::adjust(&rig, &firsts, &picks, &bundle::Priors::default()).unwrap();
        println!("{scene} {:?} {:?}", joint.reprojection_rms_px, joint.contradictions);
        for k in 0..4 {
            let t = &toks[19 * k..19 * k + 19];
            let c = nalgebra::Point3::new(t[0], t[1], t[2]) / 1000.0;
            let d = |cam: &Camera| {
                let i = cam.intrinsics;
                format!(
                    "C {:.2} mm f {:.2} c {:.2} {:.2} k {:.4} {:.4} px@240 {:.3}",
                    (cam.centre_m - c).norm() * 1e3,
                    i.focal_px[0] - t[12],
                    i.centre_px[0] - t[13],
                    i.centre_px[1] - t[14],
                    i.distortion[0] - t[15],
                    i.distortion[1] - t[16],
                    {
                        let tr = Camera {
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
                        let p = nalgebra::Point3::new(0.0, 0.0, 0.24);
                        (tr.project(&p).unwrap() - cam.project(&p).unwrap()).norm()
                    }
                )
            };
            println!(
                "  first {} | paper {} | joint {} sd {:?}",
                d(&firsts[k].camera),
                d(&paper[k]),
                d(&joint.cameras[k]),
                joint.centre_deviation_m.as_ref().map(|v| v[k].norm() * 1e3)
            );
        }
    }
}
