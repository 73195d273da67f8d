//! What the arm carries and how hard it goes, as far as that differs from what was usual in training.
//!
//! A load shows in no single state: friction leaves more of the motors' torque unexplained than 200 g at the tip add. So what the
//! torques of motors 1 to 3 have beyond what posture, direction and speed explain is matched with the torque of a mass at the tip
//! (matched filter, North 1943), and averaged over each motor's own motion: at rest friction says one thing for ever.
//! The same torque with the sign of the motor's speed is its friction beyond the usual, averaged in the same way: it fades as grease warms
//! up and grows as cables wear, over minutes to months. `docs/models.md` has the formulas.

use ravenpose_wire::FEATURES;

/// Motors that hold the arm up.
pub const MOTORS: usize = 3;
/// First of their torques among the features.
pub const TAU: usize = 40;
/// First of their positions among the features.
pub const MPOS: usize = 48;
/// First of their speeds among the features.
pub const MVEL: usize = 64;
/// States less than this apart say nothing new, and an encoder that trembles by a count is no motion.
const STEP_NS: i64 = 33_000_000;
/// Largest weight of one state, however far a motor went since the one before: 40 s of usual motion are 1200 states.
const SHARE_MAX: f64 = 0.01;
/// After so long without a state that was used, ns, the next one only says where the motors are: how they came there nobody weighed.
pub const PAUSE_NS: i64 = 200_000_000;
/// Unexplained torque counts up to so many standard deviations: a push is no load.
const CLIP: f64 = 4.0;
/// The friction's average begins as if the usual had been seen for this share of the way over which it is taken: the square of how much an
/// average strays (2.5 mN·m) over that of how much friction differs from session to session (8 mN·m).
const PRIOR: f64 = 0.1;
/// A load that was seen is gone when less than this share of the limit is left.
const RELEASE: f64 = 0.6;

/// What the model's card says about torque and load.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadCard {
    /// Expected torque of each motor, N·m: first number + the others · (features, places of the memory, signs of the motors' speeds).
    pub expected: [Vec<f32>; MOTORS],
    /// Torque per kg at the tip, N·m/kg: first number + the others · tip in µm.
    pub pull: [[f32; 4]; MOTORS],
    /// Standard deviation of a single state's unexplained torque, N·m, of each motor.
    pub noise_nm: [f32; MOTORS],
    /// Weight of each motor: one over the variance of what is left of its torque once averaged, 1/(N·m)².
    pub weight: [f32; MOTORS],
    /// Travel of each motor over which its average is taken, degrees.
    pub travel_deg: [f32; MOTORS],
    /// Usual square of each pull, (N·m/kg)²: the averages begin as if no load had been seen for that long.
    pub information: [f32; MOTORS],
    /// Mass at which a load counts as unseen, kg.
    pub limit_kg: f32,
    /// Least and largest friction of each motor that the network knows, N·m beyond the usual; none if it is not told.
    pub friction: Option<[(f32, f32); MOTORS]>,
}

/// Follows one arm. Allocates nothing after [`LoadObserver::new`].
#[derive(Debug, Clone)]
pub struct LoadObserver {
    card: LoadCard,
    /// Averages of pull · unexplained torque, and of pull².
    matched: [f64; MOTORS],
    information: [f64; MOTORS],
    /// Of the last state that was used: time, ns, and motor positions, degrees.
    used_ns: i64,
    mpos: Option<[f32; MOTORS]>,
    /// Averages of the unexplained torque against the motion, N·m.
    friction: [f64; MOTORS],
    /// Travel of each motor since the start, in terms of that over which its average is taken.
    travelled: [f64; MOTORS],
    is_unseen: bool,
}

impl LoadObserver {
    /// One that believes that nothing is carried and all motors go as usual.
    pub fn new(card: LoadCard) -> Self {
        let information = card.information.map(f64::from);
        Self {
            card,
            matched: [0.0; MOTORS],
            information,
            used_ns: i64::MIN,
            mpos: None,
            friction: [0.0; MOTORS],
            travelled: [0.0; MOTORS],
            is_unseen: false,
        }
    }

    /// Would a state of this time be used?
    pub fn is_due(&self, time_ns: i64) -> bool {
        time_ns.saturating_sub(self.used_ns) >= STEP_NS
    }

    /// Takes in a state: its features, and behind them the places of the memory. States too near to the last are left out.
    pub fn follow(&mut self, input: &[f32], time_ns: i64) {
        let at = |start: usize| input.get(start..).and_then(|rest| rest.first_chunk::<MOTORS>());
        let (Some(tau), Some(mpos), Some(mvel)) = (at(TAU), at(MPOS), at(MVEL)) else { return };
        if !self.is_due(time_ns) {
            return;
        }
        let paused = time_ns.saturating_sub(self.used_ns) > PAUSE_NS;
        self.used_ns = time_ns;
        let Some(before) = self.mpos.replace(*mpos).filter(|_| !paused) else { return };
        let signs = mvel.map(sign);
        for motor in 0..MOTORS {
            let share = f64::from((mpos[motor] - before[motor]).abs() / self.card.travel_deg[motor]);
            let unexplained = f64::from(tau[motor]) - affine(&self.card.expected[motor], input.iter().chain(&signs));
            let pull = affine(&self.card.pull[motor], input.iter());
            let most = CLIP * f64::from(self.card.noise_nm[motor]);
            let counted = unexplained.max(-most).min(most);
            let (matched, information) = (pull * counted, pull * pull);
            // A number beyond all others would stay in the average for ever.
            if [share, unexplained, matched, information].iter().all(|number| number.is_finite()) {
                let share = share.min(SHARE_MAX);
                self.matched[motor] += share * (matched - self.matched[motor]);
                self.information[motor] += share * (information - self.information[motor]);
                self.travelled[motor] += share;
                let against = counted * f64::from(signs[motor]);
                self.friction[motor] += share / (PRIOR + self.travelled[motor]).min(1.0) * (against - self.friction[motor]);
            }
        }
        self.is_unseen = self.mass_kg().abs() > f64::from(self.limit_kg());
    }

    /// Estimated mass at the tip, beyond what was carried in training, kg; negative if the arm pulls less than it did then.
    pub fn mass_kg(&self) -> f64 {
        let weighted = |averages: [f64; MOTORS]| averages.iter().zip(self.card.weight).map(|(a, w)| a * f64::from(w)).sum::<f64>();
        let information = weighted(self.information);
        if information > 0.0 { weighted(self.matched) / information } else { 0.0 }
    }

    /// Friction of each motor beyond the usual, N·m.
    pub fn friction_nm(&self) -> [f32; MOTORS] {
        self.friction.map(|friction| friction as f32)
    }

    /// The largest of them, from the middle of what the network knows in units of half its width; above 1 it is unseen. 0 until it has
    /// weighed, since a young average strays; none for a network that is not told.
    pub fn friction_score(&self) -> Option<f32> {
        let off = |(friction, (least, largest)): (f32, &(f32, f32))| {
            let (middle, half) = (0.5 * (least + largest), 0.5 * (largest - least));
            ((friction - middle) / half).abs()
        };
        let known = self.card.friction.as_ref()?;
        if !self.has_weighed() {
            return Some(0.0);
        }
        Some(self.friction_nm().into_iter().zip(known).map(off).fold(0.0, f32::max))
    }

    /// Have the motors moved far enough since the start for a load to show?
    pub fn has_weighed(&self) -> bool {
        self.travelled.iter().all(|travelled| *travelled >= 1.0)
    }

    /// Estimated mass over the mass at which it counts as unseen; above 1 it does. Once it does, less of it is enough.
    pub fn score(&self) -> f32 {
        (self.mass_kg().abs() / f64::from(self.limit_kg())) as f32
    }

    fn limit_kg(&self) -> f32 {
        if self.is_unseen { self.card.limit_kg * RELEASE as f32 } else { self.card.limit_kg }
    }
}

/// The sign of a speed, 0 at rest.
pub fn sign(speed: f32) -> f32 {
    if speed == 0.0 { 0.0 } else { speed.signum() }
}

/// `terms[0] + terms[1..] · input`; as many as both have.
fn affine<'a>(terms: &[f32], input: impl Iterator<Item = &'a f32>) -> f64 {
    let Some((first, terms)) = terms.split_first() else { return 0.0 };
    f64::from(*first) + terms.iter().zip(input).map(|(term, value)| f64::from(*term) * f64::from(*value)).sum::<f64>()
}

/// Numbers of a row of [`LoadCard::expected`] for a network with so many plays.
pub fn expected_len(plays: usize) -> usize {
    1 + FEATURES + plays + MOTORS
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP: i64 = 34_000_000;

    /// Expects 2 N·m, pulls 0.05 N·m/kg on each motor, a fade of 1800 steps of 10 degrees.
    fn observer() -> LoadObserver {
        let mut expected = vec![0.0; expected_len(0)];
        expected[0] = 2.0;
        let weight = [400.0; MOTORS];
        LoadObserver::new(LoadCard {
            expected: std::array::from_fn(|_| expected.clone()),
            pull: [[0.05, 0.0, 0.0, 0.0]; MOTORS],
            noise_nm: [1.0; MOTORS],
            weight,
            travel_deg: [18_000.0; MOTORS],
            information: [0.05 * 0.05; MOTORS],
            limit_kg: 0.1,
            friction: None,
        })
    }

    fn input(torque: f32, mpos: f32) -> [f32; FEATURES] {
        let mut input = [0.0; FEATURES];
        input[TAU..TAU + MOTORS].fill(torque);
        input[MPOS..MPOS + MOTORS].fill(mpos);
        input
    }

    /// So many states with the torque of a mass, 10 degrees apart to and fro; how many it took until it was unseen, if ever.
    fn carry(observer: &mut LoadObserver, mass_kg: f32, states: usize) -> Option<usize> {
        let mut unseen = None;
        for k in 0..states {
            let time_ns = observer.used_ns.max(0) + STEP;
            observer.follow(&input(2.0 + 0.05 * mass_kg, 10.0 * (k % 2) as f32), time_ns);
            if observer.score() > 1.0 && unseen.is_none() {
                unseen = Some(k);
            }
        }
        unseen
    }

    #[test]
    fn a_mass_shows_after_the_motion_that_its_size_asks_for_and_is_gone_again() {
        let mut watched = observer();
        assert_eq!(carry(&mut watched, 0.0, 5000), None);
        assert!(watched.mass_kg().abs() < 1e-6);
        // 0.2 (1 - exp(-k/1800)) > 0.1: k = 1800 ln 2 = 1248.
        let seen = carry(&mut watched, 0.2, 20_000).expect("seen");
        assert!((1240..1260).contains(&seen), "{seen}");
        assert!((watched.mass_kg() - 0.2).abs() < 1e-4, "{}", watched.mass_kg());
        // It is gone at 0.06 = 0.2 exp(-k/1800): k = 2167; not at 0.1 (1248).
        assert_eq!(carry(&mut watched, 0.0, 2100), Some(0));
        assert!(watched.score() > 1.0);
        let _ = carry(&mut watched, 0.0, 100);
        assert!(watched.score() < 1.0, "{}", watched.score());
        // What pulls less than in training is as unknown.
        assert!(carry(&mut watched, -0.2, 5000).is_some());
        assert!(watched.mass_kg() < -0.1);
    }

    /// So many states of the usual motion under gravity's torque and this friction beyond the usual, N·m.
    fn rub(observer: &mut LoadObserver, friction_nm: f32, states: usize) {
        for k in 0..states {
            let (there, back) = (10.0 * (k % 2) as f32, k % 2 == 0);
            let speed: f32 = if back { -90.0 } else { 90.0 };
            let mut seen = input(2.0 + friction_nm * speed.signum(), there);
            seen[MVEL..MVEL + MOTORS].fill(speed);
            observer.follow(&seen, observer.used_ns.max(0) + STEP);
        }
    }

    #[test]
    fn friction_is_the_unexplained_torque_against_the_motion_averaged_over_the_way() {
        let mut watched = observer();
        watched.card.friction = Some([(-0.1, 0.3); MOTORS]);
        let scores =
            |watched: &LoadObserver, wanted: f32| watched.friction_score().is_some_and(|score| (score - wanted).abs() < 0.01);
        assert_eq!((watched.friction_nm(), watched.friction_score()), ([0.0; MOTORS], Some(0.0)));
        // Soon after the start what is seen counts more than what was believed: 0.2 (a third over a tenth and a third).
        rub(&mut watched, 0.2, 600);
        let early = watched.friction_nm();
        assert!(early.iter().all(|friction| (friction - 0.154).abs() < 0.01), "{early:?}");
        assert_eq!(watched.friction_score(), Some(0.0), "too little motion");
        rub(&mut watched, 0.2, 20_000);
        assert!(watched.friction_nm().iter().all(|friction| (friction - 0.2).abs() < 1e-3), "{:?}", watched.friction_nm());
        // It is no load, and what is beyond the range is unseen: 0.31 is.
        assert!(watched.mass_kg().abs() < 0.01 && watched.score() < 0.1, "{}", watched.mass_kg());
        assert!(scores(&watched, 0.5));
        rub(&mut watched, 0.31, 20_000);
        assert!(watched.friction_score().is_some_and(|score| score > 1.0));
        rub(&mut watched, -0.05, 20_000);
        assert!(scores(&watched, 0.75));
        // A mass is no friction.
        let mut carrying = observer();
        let _ = carry(&mut carrying, 0.2, 20_000);
        assert_eq!((carrying.friction_nm(), carrying.friction_score()), ([0.0; MOTORS], None));
    }

    #[test]
    fn an_arm_at_rest_says_nothing_however_long() {
        let mut watched = observer();
        for k in 1..1_000_000 {
            watched.follow(&input(5.0, 3.0), k * STEP);
        }
        assert_eq!(watched.score(), 0.0);
    }

    #[test]
    fn what_counts_is_the_way_not_the_number_of_states() {
        // The rows of training, at 30 and at 10 Hz, and the states of the service.
        let weighed = [1_i64, 33, 100].map(|period_ms| {
            let mut watched = observer();
            for ms in (0..60_000).step_by(period_ms as usize) {
                watched.follow(&input(2.02, (0.001 * ms as f32).sin() * 300.0), ms * 1_000_000);
            }
            watched.mass_kg()
        });
        assert!(weighed[0] > 0.05, "{weighed:?}");
        assert!(weighed.iter().all(|mass_kg| (mass_kg / weighed[0] - 1.0).abs() < 0.02), "{weighed:?}");
    }

    #[test]
    fn what_happened_in_a_pause_is_no_travel() {
        let mut watched = observer();
        let _ = carry(&mut watched, 0.2, 100);
        let before = watched.clone();
        watched.follow(&input(2.05, 5e3), before.used_ns + PAUSE_NS + 1);
        assert_eq!((watched.mass_kg(), watched.travelled), (before.mass_kg(), before.travelled));
        watched.follow(&input(2.05, 5e3 + 10.0), watched.used_ns + STEP);
        assert!(watched.mass_kg() > before.mass_kg());
    }

    #[test]
    fn it_has_weighed_after_one_travel_of_each_motor() {
        let mut watched = observer();
        let _ = carry(&mut watched, 0.0, 1790);
        assert!(!watched.has_weighed());
        let _ = carry(&mut watched, 0.0, 20);
        assert!(watched.has_weighed());
    }

    #[test]
    fn a_push_counts_no_more_than_what_friction_leaves() {
        let mut watched = observer();
        let _ = carry(&mut watched, 0.0, 10);
        watched.follow(&input(100.0, 20.0), watched.used_ns + STEP);
        // 4 of 1 N·m in place of 98: 4/0.05 kg, of which 20 or 10 of 18,000 degrees count.
        assert!(watched.mass_kg() < 4.0 / 0.05 * 20.0 / 18_000.0 + 1e-3, "{}", watched.mass_kg());
    }

    #[test]
    fn one_state_weighs_little_however_far_the_motors_went_and_what_is_no_number_nothing() {
        let mut watched = observer();
        let _ = carry(&mut watched, 0.0, 10);
        watched.follow(&input(2.05, 1e6), watched.used_ns + STEP);
        let after = watched.mass_kg();
        // The torque of 1 kg.
        assert!((after - 0.01).abs() < 1e-4, "{after}");
        for torque in [f32::NAN, f32::INFINITY] {
            watched.follow(&input(torque, 0.0), watched.used_ns + STEP);
        }
        assert_eq!(watched.mass_kg(), after);
    }
}
