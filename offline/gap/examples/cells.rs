//! RMS of every residual cell of one example.
use gap::motion::{Band, Motion};
use gap::nominal::Nominal;
use gap::pair::Pair;
use gap::problem::Problem;
use gap::robot::Robot;
use gap::run::{Run, common};
use gap::series::rms;
use std::path::Path;

fn main() {
    let folder = std::env::args().nth(1).expect("folder");
    let folder = Path::new(&folder);
    let urdf = [folder.join("robot.urdf"), folder.join("../robot.urdf")].into_iter().find(|p| p.exists()).expect("robot.urdf");
    let robot = Robot::from_urdf(&std::fs::read_to_string(urdf).expect("text")).expect("robot");
    let read = |name: String| Run::new(&recordings::csv::read(&folder.join(name)).expect("run"), &robot).expect("columns");
    let pairs: Vec<Pair> = (1..=2)
        .map(|k| {
            let (real, sim) = common(&read(format!("real_{k}.csv.gz")), &read(format!("sim_{k}.csv.gz"))).expect("overlap");
            Pair { real: Motion::new(real, Band::SLOW), sim: Some(Motion::new(sim, Band::SLOW)) }
        })
        .collect();
    let sims: Vec<Motion> = pairs.iter().filter_map(|p| p.sim.clone()).collect();
    let nominal = Nominal::learn(&robot, &sims);
    println!("learnt: drives {:?} compliance {:?} torque error {:?}", nominal.drives, nominal.compliance, nominal.torque_error);
    let problem = Problem::new(&robot, &nominal, &pairs, 2.0);
    for cell in &problem.cells {
        println!("{:?} {} rows {} rms {:.3e}", cell.channel, cell.index + 1, cell.rows.len(), rms(cell.residual.iter().copied()));
    }
    let mut dictionary = gap::hypothesis::Dictionary::new(&problem);
    let answer =
        gap::search::search(&problem, &mut dictionary, &gap::search::Thresholds::default(), &mut |line| println!("{line}"));
    println!("{} effects", answer.effects.len());
    for effect in &answer.effects {
        println!("{} share {:.3}", gap::search::describe(&effect.chosen), effect.share);
        effect.rivals.iter().take(3).for_each(|r| println!("   rival {}", gap::search::describe(r)));
    }
}
