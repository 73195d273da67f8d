//! Two effects that are one, and one that is two: what was taken one by one may be said better otherwise, where no single swap leads there.

use super::{Beyond, Effect, Scored, Search};
use crate::hypothesis::{Candidate, UNMODELLED};

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
        let of_all = if sets.is_empty() { 0.0 } else { self.better_by(chosen, &[]).max(0.0) };
        // More effects have to be better by what is asked of each, and as many at all; fewer, all with names, may be behind by what is alike.
        let nats = self.thresholds.nats;
        let asked = |set: &[Candidate]| match set.len().checked_sub(chosen.len()) {
            None if set.iter().all(|own| own.family.physics != UNMODELLED) => -ALIKE * of_all,
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
}
