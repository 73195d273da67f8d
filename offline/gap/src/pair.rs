//! Recording and simulation of one run, and where their drives are held.

use crate::motion::Motion;
use crate::series::rms;

/// Share of its RMS speed below which a drive is held, and for how long it has to be, s.
const HELD: f64 = 0.01;
const HELD_S: f64 = 0.1;
/// How far from where it was held a drive has to be to be free, in s at its RMS speed: until then its friction keeps what it held.
const FREE_S: f64 = 0.03;

/// The samples at which a drive is held, with a margin for what smoothing carries over.
pub(crate) fn held(motion: &Motion, drive: usize) -> Vec<bool> {
    let speed = &motion.quick_velocity[drive];
    let usual = rms(speed.iter().copied());
    let (least, margin) = ((HELD_S / motion.run.dt_s) as usize, (0.5 * HELD_S / motion.run.dt_s) as usize);
    let mut held = vec![false; speed.len()];
    let mut from = 0;
    for i in 0..=speed.len() {
        if i == speed.len() || speed[i].abs() > HELD * usual {
            if i - from > least {
                let free = i + speed[i..]
                    .iter()
                    .scan(0.0, |way, v| {
                        *way += v * motion.run.dt_s;
                        Some(*way)
                    })
                    .take_while(|way| way.abs() < FREE_S * usual)
                    .count();
                held[from.saturating_sub(margin)..(free + margin).min(speed.len())].fill(true);
            }
            from = i + 1;
        }
    }
    held
}

/// Recording and simulation of one run on the same clock.
#[derive(Debug, Clone)]
pub struct Pair {
    /// The recording.
    pub real: Motion,
    /// The simulation of the same commands.
    pub sim: Option<Motion>,
}

impl Pair {
    /// Both of one run. A frame of the recording's camera with none of the simulation's near is left out: some with what the simulation does and some
    /// without are no one residual.
    pub fn new(mut real: Motion, sim: Option<Motion>) -> Self {
        if let Some(frames) = sim.as_ref().and_then(Frames::of) {
            real.tip_rows.retain(|i| frames.around(*i).is_some());
        }
        Self { real, sim }
    }

    /// The same, whose links shake on their cables: where the recording's are seen to, accelerations of both are those of the links.
    #[must_use]
    pub fn shaken(mut self) -> Self {
        let believed = self.real.shakes();
        [Some(&mut self.real), self.sim.as_mut()].into_iter().flatten().for_each(|motion| motion.shake(&believed));
        self
    }
}

/// Samples, at most, between two frames between which a line is drawn.
const FRAMES_APART: usize = 100;

/// Samples with a measured tip.
pub(crate) struct Frames(Vec<usize>);

impl Frames {
    pub(crate) fn of(motion: &Motion) -> Option<Self> {
        let [x, ..] = motion.run.tip.as_ref()?;
        Some(Self((0..x.len()).filter(|i| x[*i].is_finite()).collect()))
    }

    /// The frames before and after a sample, which are one where there is one at it.
    pub(crate) fn around(&self, i: usize) -> Option<[usize; 2]> {
        let after = self.0.partition_point(|frame| *frame < i);
        let last = *self.0.get(after)?;
        let first = if last == i { last } else { self.0[after.checked_sub(1)?] };
        (last - first <= FRAMES_APART).then_some([first, last])
    }
}
