//! Feeds what was found back: the corrected model on a run that was not fitted, and the same with its main number 30 % off.
//! For development: `again FOLDER [PART OF A NAME]`, a folder of the generator.
use gap::analysis::analyse;
use gap::found::Outcome;
use gap::given::{Given, Options};
use gap_report::{Report, Role};
use simulator::model::RobotModel;
use simulator::physics::{Physics, Value};
use std::path::Path;

fn gap(model: &RobotModel, runs: &[(&Path, Option<&Path>)]) -> Outcome {
    let read = |path: &Path| recordings::csv::read(path).expect("run");
    let given: Vec<Given> = runs
        .iter()
        .map(|(real, sim)| Given {
            id: real.file_name().expect("name").to_string_lossy().into_owned(),
            real: read(real),
            real_sha256: "0".repeat(64),
            notes: Vec::new(),
            sim: sim.map(|sim| (read(sim), "0".repeat(64))),
        })
        .collect();
    let options = Options { trace: std::env::var_os("TRACE").is_some(), ..Options::default() };
    analyse(model, &given, &options, &mut |_| {}).expect("a report")
}

fn named(report: &Report) -> String {
    let names = report.verdicts.iter().filter(|v| v.role == Role::Primary).map(|v| {
        let size = v.parameters.first().map_or(f64::NAN, |p| p.value);
        format!("{} {:?} {size:.4}", v.physics, v.location.joint)
    });
    format!("{:?}: {}", report.status, names.collect::<Vec<_>>().join(" + "))
}

/// The model with the first number of its last effect 30 % off.
fn off(model: &RobotModel) -> RobotModel {
    let mut wrong = model.clone();
    let Some(effect) = wrong.effects_mut().last_mut() else { return wrong };
    let mut parameters = effect.physics.parameters();
    for (name, value) in &mut parameters.0 {
        let main = matches!(
            name.as_str(),
            "f_c"
                | "b"
                | "mu_l"
                | "kappa_T"
                | "m_p"
                | "kappa"
                | "k"
                | "J_k"
                | "c_ij"
                | "o"
                | "e"
                | "e_over_r"
                | "d_alpha"
                | "d_length"
                | "amp"
        );
        if let (true, Value::Number(value)) = (main, value) {
            *value = if name.as_str() == "kappa" { 1.0 + 1.3 * (*value - 1.0) } else { 1.3 * *value };
        }
    }
    if let Some(Ok(physics)) = Physics::new(effect.physics.name(), &parameters) {
        effect.physics = physics;
    }
    wrong
}

fn main() {
    let folder = std::env::args().nth(1).expect("folder");
    let only = std::env::args().nth(2).unwrap_or_default();
    let mut cases: Vec<_> = std::fs::read_dir(&folder).expect("folder").map(|e| e.expect("entry").path()).collect();
    cases.sort();
    for case in cases.into_iter().filter(|case| case.join("real_1.csv.gz").exists()) {
        let id = case.file_name().expect("name").to_string_lossy().into_owned();
        if !id.contains(&only) {
            continue;
        }
        let robot =
            [case.join("robot.urdf"), Path::new(&folder).join("robot.urdf")].into_iter().find(|p| p.exists()).expect("robot");
        let model = RobotModel::load(robot.to_str().expect("UTF-8")).expect("robot");
        let file = |kind: &str, k: usize| case.join(format!("{kind}_{k}.csv.gz"));
        let (real, sim) = ([file("real", 1), file("real", 2)], [file("sim", 1), file("sim", 2)]);
        let first = gap(&model, &[(&real[0], Some(&sim[0])), (&real[1], Some(&sim[1]))]);
        println!("{id}  first {}", named(&first.report));
        let Some(text) = &first.corrected else { continue };
        let corrected = RobotModel::from_toml(text, None).expect("a robot");
        println!("    {:?}", corrected.model_error);
        println!("    again {}", named(&gap(&corrected, &[(&real[1], None)]).report));
        println!("    30 % off {}", named(&gap(&off(&corrected), &[(&real[1], None)]).report));
    }
}
