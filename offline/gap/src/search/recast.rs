//! Two effects that are one, and one that is two: what was taken one by one may be said better otherwise, where no single swap leads there.

use super::likeliest::complexity;
use super::{Beyond, Effect, Scored, Search};
use crate::hypothesis::{Candidate, Part, SQUARED, STRIBECK, UNMODELLED, may_fade, part};

/// What another set of as many effects has to be better by, nats; and the share of what those chosen predict by which fewer may be behind: a law's form
/// is not known better.
const BETTER: f64 = 1.0;
const ALIKE: f64 = 0.02;

impl Search<'_, '_> {
    /// A set that predicts better than the one chosen, for what its numbers cost; with the best beside it.
    pub(super) fn recast(
        &mut self,
        chosen: &[Candidate],
        trace: &mut dyn FnMut(String),
    ) -> Option<(Vec<Candidate>, Vec<Effect>, Option<Scored>)> {
        let mut sets = self.one_for_two(chosen);
        sets.extend(self.drives_for_a_link(chosen));
        sets.extend(self.link_for_drives(chosen));
        sets.extend(self.curve_for_a_square(chosen));
        sets.extend(self.spring_and_more_for_a_memory(chosen));
        sets.extend(self.fading_for_an_end(chosen));
        let of_all = if sets.is_empty() { 0.0 } else { self.better_by(chosen, &[]).max(0.0) };
        // More effects have to be better by what is asked of each, or no worse if they fit fewer numbers, and as many at all; fewer, all with names, may be
        // behind by what is alike.
        let nats = self.thresholds.nats;
        let numbers = |set: &[Candidate]| set.iter().map(complexity).sum::<f64>();
        let asked = |set: &[Candidate]| match set.len().checked_sub(chosen.len()) {
            None if set.iter().all(|own| own.family.physics != UNMODELLED) => -ALIKE * of_all,
            Some(1..) if numbers(set) < numbers(chosen) => 0.0,
            more => nats * more.unwrap_or(0) as f64 + BETTER,
        };
        for mut others in sets {
            let better = self.better_by(&others, chosen);
            trace(format!("recast as {:?}: better by {better:.1} nats", others.iter().map(|c| &c.family).collect::<Vec<_>>()));
            // One for two may have room for more beside it, and only then be better.
            if better <= asked(&others) && others.len() >= chosen.len() {
                continue;
            }
            let Beyond { next, .. } = self.forward(&mut others, trace);
            let effects = self.settle(&mut others, trace);
            let better = self.better_by(&others, chosen);
            trace(format!("  settled: {} effects, better by {better:.1} nats", others.len()));
            if !others.is_empty() && better > asked(&others) {
                return Some((others, effects, next));
            }
        }
        None
    }

    /// For two effects of a joint, one of them without a name, the best that has one: half of a law may have been taken first, and what it lacks then has none.
    fn one_for_two(&mut self, chosen: &[Candidate]) -> Vec<Vec<Candidate>> {
        let mut sets = Vec::new();
        for nameless in chosen.iter().filter(|own| own.family.physics == UNMODELLED && !own.family.joints.is_empty()) {
            for other in chosen.iter().filter(|own| own.family.joints == nameless.family.joints && !own.same_claim(nameless)) {
                let mut rest: Vec<Candidate> =
                    chosen.iter().filter(|own| !own.same_claim(nameless) && !own.same_claim(other)).cloned().collect();
                let is_new = |one: &Scored| one.candidate.family.physics != UNMODELLED && !one.candidate.same_claim(other);
                if let Some(named) = self.rank(&rest).into_iter().find(is_new) {
                    rest.push(named.candidate);
                    sets.push(rest);
                }
            }
        }
        sets
    }

    /// For the inertia of a link, or a weight on one, those of two drives, of which its own may be one: a link loads the joints before it as well.
    fn drives_for_a_link(&self, chosen: &[Candidate]) -> Vec<Vec<Candidate>> {
        let drive = |joint: usize| self.candidates.iter().find(|c| c.is_of_a_drive() && c.family.joints == [joint]);
        let link_of = |own: &Candidate| match (own.family.physics, own.family.joints.first()) {
            _ if own.windows.is_some() || own.is_of_a_drive() => None,
            ("link_inertia", link) => link.copied(),
            ("payload", _) => Some(own.shape_of("link").map_or(self.problem.robot.joint_count() - 1, |link| link as usize)),
            _ => None,
        };
        let mut sets = Vec::new();
        for (own, link) in chosen.iter().filter_map(|own| Some((own, link_of(own)?))) {
            for before in 0..link {
                let rest = chosen.iter().filter(|other| !other.same_claim(own)).cloned();
                let there = |joint: &usize| !chosen.iter().any(|c| c.is_of_a_drive() && c.family.joints == [*joint]);
                let drives = [before, link].into_iter().filter(there).filter_map(drive).cloned();
                sets.push(rest.chain(drives).collect());
            }
        }
        sets
    }

    /// The other way round: for the inertia of two drives that of the further one's link, which the joint before it moves as well.
    fn link_for_drives(&self, chosen: &[Candidate]) -> Vec<Vec<Candidate>> {
        let is_turned = |own: &&Candidate| own.is_of_a_drive() && own.windows.is_none();
        let mut sets = Vec::new();
        for drive in chosen.iter().filter(is_turned) {
            let is_link =
                |c: &&Candidate| c.family.physics == "link_inertia" && !c.is_of_a_drive() && c.family.joints == drive.family.joints;
            // Of its forms the first: the other ones take part once it is settled.
            let Some(link) = self.candidates.iter().find(is_link) else { continue };
            for before in chosen.iter().filter(is_turned).filter(|other| other.family.joints < drive.family.joints) {
                let rest =
                    chosen.iter().filter(|own| !(own.is_of_a_drive() && [drive, before].iter().any(|one| one.same_claim(own))));
                sets.push(rest.cloned().chain([link.clone()]).collect());
            }
        }
        sets
    }

    /// For dry friction and what grows with the square of the speed, a Stribeck curve and viscous friction: neither of the two alone says what dry
    /// friction leaves of them.
    fn curve_for_a_square(&mut self, chosen: &[Candidate]) -> Vec<Vec<Candidate>> {
        let mut sets = Vec::new();
        for square in chosen.iter().filter(|own| own.family.form == SQUARED) {
            let there = |physics: &str, own: &Candidate| own.is_of(physics, &square.family.joints);
            let is_dry = |own: &Candidate| part(own) == Some(Part::Dry) && own.family.joints == square.family.joints;
            let viscous = self.candidates.iter().find(|c| there("viscous_friction", c)).cloned();
            if !chosen.iter().any(is_dry) || chosen.iter().any(|own| there("viscous_friction", own)) {
                continue;
            }
            let Some(viscous) = viscous else { continue };
            let mut rest: Vec<Candidate> = chosen.iter().filter(|own| !own.same_claim(square) && !is_dry(own)).cloned().collect();
            rest.push(viscous);
            if let Some(curve) = self.rank(&rest).into_iter().find(|one| there(STRIBECK, &one.candidate)) {
                rest.push(curve.candidate);
                self.polish(&mut rest);
                sets.push(rest);
            }
        }
        sets
    }

    /// For a memory of a joint's cable, a spring and play, or a spring and a zero that is off: its many numbers are both.
    fn spring_and_more_for_a_memory(&mut self, chosen: &[Candidate]) -> Vec<Vec<Candidate>> {
        let mut sets = Vec::new();
        for memory in chosen.iter().filter(|own| own.family.physics == "cable_hysteresis" && own.windows.is_none()) {
            let rest: Vec<Candidate> = chosen.iter().filter(|own| !own.same_claim(memory)).cloned().collect();
            let of_joint = |all: &[Scored], physics: &str| {
                all.iter().find(|one| one.candidate.is_of(physics, &memory.family.joints)).map(|one| one.candidate.clone())
            };
            let Some(spring) = of_joint(&self.rank(&rest), "cable_stretch") else { continue };
            let with: Vec<Candidate> = rest.iter().cloned().chain([spring]).collect();
            let beside = self.rank(&with);
            // Under a load that never changes sides play is a zero that is off; the latter is told first.
            for physics in ["joint_offset", "backlash"] {
                if !rest.iter().any(|own| own.is_of(physics, &memory.family.joints))
                    && let Some(more) = of_joint(&beside, physics)
                {
                    let mut set: Vec<Candidate> = with.iter().cloned().chain([more]).collect();
                    self.polish(&mut set);
                    sets.push(set);
                }
            }
        }
        sets
    }

    /// For dry friction that ends or begins on the way, dry friction all the time that fades: what has faded half looks like an end.
    fn fading_for_an_end(&mut self, chosen: &[Candidate]) -> Vec<Vec<Candidate>> {
        let is_dry = |own: &Candidate| part(own) == Some(Part::Dry);
        let mut sets = Vec::new();
        let mut tried: Vec<&[usize]> = Vec::new();
        for ends in chosen.iter().filter(|own| is_dry(own) && own.windows.is_some()) {
            let joints = ends.family.joints.as_slice();
            if tried.contains(&joints) {
                continue;
            }
            tried.push(joints);
            let mut set: Vec<Candidate> =
                chosen.iter().filter(|own| !(is_dry(own) && own.family.joints == joints)).cloned().collect();
            let both = set.len() + 2;
            for physics in ["coulomb_friction", "thermal_drift"] {
                let grams = self.grams(&set, None);
                let base = self.scorer.fit(&grams);
                let is_start = |c: &&Candidate| {
                    let family = &c.family;
                    (family.physics, family.channel) == (physics, ends.family.channel)
                        && family.joints == joints
                        && may_fade(c, &set)
                };
                let scored = self.candidates.iter().filter(is_start).filter_map(|start| self.score(&grams, &base, start));
                let Some(mut best) = scored.max_by(|a, b| a.score.total_cmp(&b.score)) else { break };
                self.settle_shape(&grams, &base, &mut best);
                set.push(best.candidate);
            }
            if set.len() == both {
                self.polish(&mut set);
                sets.push(set);
            }
        }
        sets
    }
}
