//! Names that the engine gives to every case of a folder of the generator, beside the truth: for development only.
use gap::hypothesis::Dictionary;
use gap::motion::{Band, Motion};
use gap::nominal::Nominal;
use gap::pair::Pair;
use gap::problem::Problem;
use gap::robot::Robot;
use gap::run::{Run, common};
use gap::search::{Thresholds, search};
use std::fmt::Write as _;
use std::path::Path;

fn main() {
    let folder = std::env::args().nth(1).expect("folder");
    let only = std::env::args().nth(2);
    let verbose = std::env::args().nth(3).is_some();
    let mut cases: Vec<_> =
        std::fs::read_dir(Path::new(&folder).join("cases")).expect("cases").map(|e| e.expect("entry").path()).collect();
    cases.sort();
    let mut lines = Vec::new();
    for case in cases {
        let id = case.file_name().expect("name").to_string_lossy().into_owned();
        let truth: serde_json::Value =
            serde_json::from_str(&std::fs::read_to_string(Path::new(&folder).join(format!("sealed/{id}.json"))).expect("truth"))
                .expect("json");
        let effects: Vec<(String, String)> = truth["effects"]
            .as_array()
            .expect("effects")
            .iter()
            .map(|e| (e["physics"].as_str().unwrap_or("?").to_owned(), e["joint"].to_string()))
            .collect();
        let name = effects.iter().map(|e| e.0.clone()).collect::<Vec<_>>().join("+");
        let name = if name.is_empty() { "none".to_owned() } else { name };
        if only.as_ref().is_some_and(|only| !only.is_empty() && !name.contains(only.as_str()) && !id.contains(only.as_str())) {
            continue;
        }
        let begun = std::time::Instant::now();
        let robot = Robot::from_urdf(&std::fs::read_to_string(case.join("robot.urdf")).expect("text")).expect("robot");
        let read = |name: String| Run::new(&recordings::csv::read(&case.join(name)).expect("run"), &robot).expect("columns");
        let pairs: Vec<Pair> = (1..=2)
            .map(|k| {
                let (real, sim) = common(&read(format!("real_{k}.csv.gz")), &read(format!("sim_{k}.csv.gz"))).expect("overlap");
                Pair { real: Motion::new(real, Band::SLOW), sim: Some(Motion::new(sim, Band::SLOW)) }
            })
            .collect();
        let sims: Vec<Motion> = pairs.iter().filter_map(|p| p.sim.clone()).collect();
        let nominal = Nominal::learn(&robot, &sims);
        let problem = Problem::new(&robot, &nominal, &pairs, 2.0);
        let mut dictionary = Dictionary::new(&problem);
        if verbose {
            println!("compliance {:?}", nominal.compliance);
            if let Ok(path) = std::env::var("DUMP") {
                let mut text = String::new();
                for &(r, i, k) in &dictionary.grid {
                    let _ = write!(text, "{r} {:.3}", i as f64 * 1e-3);
                    for j in 0..robot.joint_count() {
                        let m = &problem.pairs[r].real;
                        let d = m.deflection.as_ref().map_or(0.0, |d| d[j][i]);
                        let s = problem.pairs[r].sim.as_ref().and_then(|s| s.deflection.as_ref()).map_or(0.0, |d| d[j][i]);
                        let _ = write!(
                            text,
                            " {:.6e} {:.6e} {:.6e} {:.6e} {:.6e}",
                            problem.loads[r][k].link[j], d, s, m.position[j][i], m.velocity[j][i]
                        );
                    }
                    text.push('\n');
                }
                std::fs::write(path, text).expect("dump");
            }
            for cell in &problem.cells {
                println!("{:?} {} rms {:.3e}", cell.channel, cell.index + 1, gap::series::rms(cell.residual.iter().copied()));
            }
        }
        let mut answer = search(&problem, &mut dictionary, &Thresholds::default(), &mut |line| {
            if verbose {
                println!("{line}");
            }
        });
        let found: Vec<String> = answer
            .effects
            .iter()
            .map(|e| {
                let c = &e.chosen.candidate;
                format!("{}{:?}", c.family.physics, c.family.joints.iter().map(|j| j + 1).collect::<Vec<_>>())
            })
            .collect();
        let right = match (effects.as_slice(), answer.effects.as_slice()) {
            ([], []) => true,
            (told, named) => {
                let mut told: Vec<&str> = told.iter().map(|e| e.0.as_str()).collect();
                let mut named: Vec<&str> = named.iter().map(|e| e.chosen.candidate.family.physics).collect();
                told.sort_unstable();
                named.sort_unstable();
                told == named
            }
        };
        let mut line = String::new();
        let severity = truth["severity"].as_f64().unwrap_or(0.0);
        let _ = write!(
            line,
            "{} {name:<24} j{} sev {severity:<5.1} {id}: {}",
            if right { "ok " } else { "BAD" },
            effects.first().map_or("-", |e| &e.1),
            found.join(" + ")
        );
        if let Some(effect) = answer.effects.first() {
            let rivals = effect.rivals.iter().take(2).map(|r| {
                format!(
                    "{}{:?} {:.0}",
                    r.candidate.family.physics,
                    r.candidate.family.joints.iter().map(|j| j + 1).collect::<Vec<_>>(),
                    r.score
                )
            });
            let _ = write!(
                line,
                "  [{:.0} nats, share {:.2}; {}]",
                effect.chosen.score,
                effect.share,
                rivals.collect::<Vec<_>>().join(", ")
            );
        } else if let Some(next) = &answer.next {
            let _ = write!(line, "  [next {}{:?} {:.1}]", next.candidate.family.physics, next.candidate.family.joints, next.score);
        }
        let left: Vec<String> = (0..problem.cells.len())
            .map(|c| {
                let mut left = problem.cells[c].residual.clone();
                let mut start = 0;
                for effect in &answer.effects {
                    let columns = effect.chosen.candidate.columns.len();
                    let theta = &answer.fit.coefficients[start..start + columns];
                    start += columns;
                    effect.chosen.candidate.take_off(c, theta, &mut left);
                }
                let floor = gap::floors::floor(&problem.cells[c]);
                let before = gap::series::rms(problem.cells[c].residual.iter().copied());
                format!("{:.2}/{:.2}", before / floor, gap::series::rms(left.into_iter()) / floor)
            })
            .collect();
        let _ = write!(line, " controller {:?}", gap::controller::changed(&problem, &[]));
        let ceiling =
            gap::flexible::ceiling(&dictionary, &mut answer.scorer, &answer.grams, &answer.none, Thresholds::default().nats);
        let _ = write!(
            line,
            " ceiling: library {:.0} together {:.0} least {:.0} cell {:?} by {:?}; left {}",
            ceiling.library_nats,
            ceiling.together_nats,
            ceiling.least_nats,
            ceiling.cell,
            ceiling.depends_on,
            left.join(" ")
        );
        let _ = write!(line, " {:.1} s", begun.elapsed().as_secs_f64());
        if verbose {
            println!("truth {truth}");
        }
        println!("{line}");
        lines.push((name, right));
    }
    println!("{} of {} right", lines.iter().filter(|l| l.1).count(), lines.len());
}
