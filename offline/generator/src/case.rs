//! One case: its files and its truth, made and written.

use crate::arm::DryLaw;
use crate::bench::Bench;
use crate::effect::Effect;
use crate::logger::{Faults, Logging};
use crate::order::{Kind, Order, Sealed, Truth};
use crate::random::Random;
use crate::robots::{self, Pair};
use crate::run::{Robot, Signals, play};
use crate::scene::Scene;
use crate::sensors::{Noise, record};
use crate::table::FRAME;
use crate::trajectory::{self, Trajectory};
use crate::{seal, table, urdf};
use std::collections::BTreeMap;
use std::path::Path;

/// A finished case in memory.
pub struct Case {
    /// What happened.
    pub truth: Truth,
    /// Name and bytes of every file.
    pub files: BTreeMap<String, Vec<u8>>,
}

impl Order {
    /// Opaque identifier: twelve hexadecimal digits.
    pub fn id(&self) -> String {
        self.random("id").hex(6)
    }

    fn random(&self, purpose: &str) -> Random {
        Random::new(self.seed, &format!("{}/{purpose}", self.label))
    }

    fn pair(&self) -> Pair {
        let mut random = self.random("robot");
        match self.robot {
            Kind::Raven => robots::raven(&mut random),
            Kind::Variant => robots::variant(&mut random),
            Kind::Six => robots::six(&mut random),
            Kind::Planar => robots::planar(&mut random),
            Kind::Gantry => robots::gantry(&mut random),
        }
    }

    /// Plays the case.
    ///
    /// # Errors
    ///
    /// For physics or joints that do not exist, and for no run at all.
    pub fn make(&self) -> Result<Case, String> {
        if self.runs == 0 {
            return Err("runs must be 1 or more".into());
        }
        let pair = self.pair();
        let noise = Noise::scaled(self.noise);
        let trajectories: Vec<Trajectory> = (0..self.runs)
            .map(|run| trajectory::draw(&pair.truth, self.seconds, self.excitation, &mut self.random(&format!("run {run}"))))
            .collect();
        let robot = |stepped| Robot { truth: &pair.truth, model: &pair.model, stepped };
        let sims: Vec<Signals> = trajectories.iter().map(|trajectory| play(&robot(false), &[], trajectory)).collect();
        let (exact, stepped) = (robot(false), robot(true));
        // noise in each channel, which only a severity needs
        let null = if self.effects.is_empty() {
            Signals::default()
        } else {
            record(&play(&stepped, &[], &trajectories[0]), &pair.truth, &[], Some((&noise, &mut self.random("noise 0"))))
        };
        let clean = record(&sims[0], &pair.truth, &[], None);
        let scene = Scene { arm: &pair.truth, runs: &sims, noise: &noise };
        let bench = Bench {
            exact,
            trajectory: &trajectories[0],
            scene,
            null: &null,
            clean: &clean,
            seconds: self.seconds,
            runs: self.runs,
        };
        let effects: Vec<Sealed> = self
            .effects
            .iter()
            .enumerate()
            .map(|(index, wanted)| bench.fit(wanted, &mut self.random(&format!("effect {index}"))))
            .collect::<Result<_, _>>()?;
        let plain: Vec<Effect> = effects.iter().map(|sealed| sealed.effect.clone()).collect();

        let faults = (self.logging == Logging::Faulty).then(|| Faults::draw(&mut self.random("logger")));
        let mut files = BTreeMap::from([("robot.urdf".to_owned(), urdf::text(&pair.model).into_bytes())]);
        for (run, trajectory) in trajectories.iter().enumerate() {
            let plain: Vec<Effect> = plain.iter().map(|effect| effect.in_run(run)).collect();
            let mut seen = record(
                &play(&stepped, &plain, trajectory),
                &pair.truth,
                &plain,
                Some((&noise, &mut self.random(&format!("noise {run}")))),
            );
            if let Some(faults) = &faults {
                faults.damage(&mut seen, FRAME, &mut self.random(&format!("logger {run}")));
            }
            let sim = record(&sims[run], &pair.truth, &[], None);
            let write = |signals, every_row| table::csv_gz(signals, &pair.model, every_row).map_err(|error| error.to_string());
            files.insert(format!("real_{}.csv.gz", run + 1), write(&seen, faults.is_some_and(|faults| faults.tip_repeated))?);
            files.insert(format!("sim_{}.csv.gz", run + 1), write(&sim, true)?);
        }
        let truth = Truth {
            schema: "ravenpose-truth-1".into(),
            case: self.id(),
            block: self.block.clone(),
            severity: self.effects.iter().filter_map(|wanted| wanted.severity).fold(0.0, f64::max),
            effects,
            noise: self.noise,
            seed: self.seed,
            excitation: self.excitation,
            robot: self.robot,
            logging: self.logging,
            joints: pair.model.joints.iter().map(|joint| joint.name.clone()).collect(),
            dry_law: match pair.truth.dry_law {
                DryLaw::Smooth(_) => "smooth".into(),
                DryLaw::Bristle(_) => "bristle".into(),
            },
            files: files.iter().map(|(name, bytes)| (name.clone(), seal::sha256(bytes))).collect(),
            salt: self.random("salt").hex(16),
        };
        Ok(Case { truth, files })
    }

    /// True if the case stands whole under `out`.
    pub fn is_done(&self, out: &Path) -> bool {
        let id = self.id();
        out.join("cases").join(&id).is_dir() && out.join("sealed").join(format!("{id}.json")).is_file()
    }

    /// Plays the case and writes it under `out`: the truth first, so that no case ever stands without one.
    ///
    /// # Errors
    ///
    /// Those of `make`, and of the disk.
    pub fn write(&self, out: &Path) -> Result<(), String> {
        let case = self.make()?;
        let trouble = |error: std::io::Error| error.to_string();
        let id = &case.truth.case;
        let (folder, part) = (out.join("cases").join(id), out.join("cases").join(format!(".{id}.part")));
        std::fs::create_dir_all(&part).map_err(trouble)?;
        for (name, bytes) in &case.files {
            seal::write_undated(&part.join(name), bytes).map_err(trouble)?;
        }
        let sealed = out.join("sealed");
        std::fs::create_dir_all(&sealed).map_err(trouble)?;
        seal::write_whole(&sealed.join(format!("{id}.json")), seal::canonical(&case.truth).as_bytes()).map_err(trouble)?;
        if folder.exists() {
            std::fs::remove_dir_all(&folder).map_err(trouble)?;
        }
        std::fs::rename(&part, &folder).map_err(trouble)
    }
}
