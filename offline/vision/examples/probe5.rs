//! Development probe: tracking.
use std::path::Path;
use vision::*;
fn main() {
    for scene in ["easy", "occlusion", "hard"] {
        for mode in [track::Mode::Default, track::Mode::Paper] {
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
            let cameras = if mode == track::Mode::Default {
                bundle::adjust(&rig, &firsts, &picks, &bundle::Priors::default()).unwrap().cameras
            } else {
                localise::paper_poses(&rig, &firsts, &picks).unwrap()
            };
            let t0 = std::time::Instant::now();
            let tracked = track::track(&cameras, &[0.25; 4], &rig, &dir, mode, &mut |_, _| {}).unwrap();
            let dt = t0.elapsed().as_secs_f64();
            let (mut sum, mut n) = (0.0, 0.0);
            for (row, t) in tracked.rows.iter().zip(&truth) {
                match &row.found {
                    Ok(f) => {
                        let d = f.pose.translation.vector * 1e3 - nalgebra::Vector3::new(t[2], t[3], t[4]);
                        sum += d.norm_squared();
                        n += 1.0;
                        print!(" {:.2}", d.norm());
                    }
                    Err(e) => print!(" {e:?}"),
                }
            }
            println!(
                "\n{scene} {mode:?} rms {:.3} n {n} of {} {:.1} frames/s",
                f64::sqrt(sum / n),
                truth.len(),
                truth.len() as f64 / dt
            );
        }
    }
}
