//! A clip slowed down where it must be, so that no joint is faster or more accelerated than it may be.

use super::edit::MOST_NUMBERS;
use super::rate_limit::{RateExcess, RateLimit, TOLERANCE};
use super::rates::Rate;
use super::tempo::{Share, Way};
use super::time_map::TimeMap;
use super::{Clip, ClipError};

/// How often the tempo is found anew because the curve through the slowed poses is not quite the one it was found for.
const ROUNDS: usize = 40;

/// How often the whole clip is then slowed down evenly, for what is left.
const EVEN_ROUNDS: usize = 16;

/// How many times as long a clip may become: beyond that, what is wrong is not its tempo.
const MOST_STRETCH: f64 = 1000.0;

/// A share of a limit shrinks by this much more than was asked for, so that rounding does not ask again: twice as much
/// each round, up to the second number, so that what is asked for again and again comes to an end.
const SPARE: [f64; 2] = [1e-4, 0.02];

/// A share of a limit shrinks to no less than this at once, since a peak that is many times too high is often very short.
const LEAST_FACTOR: f64 = 0.4;

/// Around a peak, shares of limits shrink within so many steps to either side, fully beside it.
const REACH_STEPS: f64 = 4.0;

/// A clip whose time was stretched, and how. See [`Clip::retime`].
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Retimed {
    /// The clip at its new times.
    pub clip: Clip,
    /// `None` where all times are as they were.
    map: Option<TimeMap>,
}

impl Retimed {
    /// Where a time of the original (seconds) lies in [`clip`](Self::clip). It rises strictly from its first time to
    /// its last, without jumps of tempo; beyond them, it is the first or last time of the clip (the first for a time
    /// that is not a number).
    #[must_use]
    pub fn at(&self, secs: f64) -> f64 {
        self.map.as_ref().map_or_else(|| self.unchanged(secs), |map| map.at(secs))
    }

    /// Which time of the original a time of [`clip`](Self::clip) (seconds) was: the inverse of [`at`](Self::at).
    #[must_use]
    pub fn was_at(&self, secs: f64) -> f64 {
        self.map.as_ref().map_or_else(|| self.unchanged(secs), |map| map.was_at(secs))
    }

    fn unchanged(&self, secs: f64) -> f64 {
        let times = self.clip.times();
        // A time that is not a number becomes the first: `max` drops it.
        secs.max(times[0]).min(times[times.len() - 1])
    }
}

impl Clip {
    /// This clip's way through the same poses, slowed down where it must be, so that limits hold anywhere on the curve of
    /// [`sample_cubic`](Self::sample_cubic).
    ///
    /// A clip that keeps them comes back as it is, at its own times. Any other comes back at even steps of about
    /// `1 / rate_hz` seconds, as [`resample`](Self::resample) chooses them, and each of its poses lies on the curve of
    /// this one. It is never faster than this one, and nearly as fast as the limits let it be: what keeps
    /// them keeps its tempo, but for the slowing down before and the speeding up after what does not. The tempo has no
    /// jumps; it changes as fast as the accelerations with limits let it, and from full to none in 8 steps at the
    /// soonest. The first time stays.
    ///
    /// That limits hold is measured with [`exceeded`](Self::exceeded) on the curve through the new poses. It
    /// differs a little from the old one, the more so the fewer poses a second there are: where it is
    /// above a limit, the tempo falls further until it is not.
    ///
    /// # Errors
    /// What [`exceeded`](Self::exceeded) refuses; a rate (poses a second) that is not finite or not above 0; more
    /// poses than fit into 2 GiB; and limits that do not hold at a thousandth of the tempo
    /// either ([`ClipError::Unkept`]), as where a cone stops a ball at once whose acceleration is limited.
    pub fn retime(&self, limits: &[RateLimit], rate_hz: f64) -> Result<Retimed, ClipError> {
        self.retime_while(limits, rate_hz, || true)
    }

    /// Slows the clip down as [`retime`](Self::retime) does, as long as `may_go_on` says so, which is asked between rounds, and
    /// before each limit that is measured in one: for who has little time.
    ///
    /// # Errors
    /// Those of [`retime`](Self::retime); [`ClipError::Unkept`] also where it was stopped.
    pub fn retime_while(
        &self,
        limits: &[RateLimit],
        rate_hz: f64,
        may_go_on: impl Fn() -> bool,
    ) -> Result<Retimed, ClipError> {
        if !rate_hz.is_finite() || rate_hz <= 0.0 {
            return Err(ClipError::Rate(rate_hz));
        }
        // Whether the limits are kept is known in any case: an error names the worst that is not.
        let Some(mut worst) = self.exceeded(limits)?.first().copied() else {
            return Ok(Retimed { clip: self.clone(), map: None });
        };
        let n_poses = self.duration_secs() * rate_hz + 1.0;
        self.check_length(n_poses)?;
        let share = MOST_NUMBERS as f64 / Way::n_numbers(self, limits, rate_hz);
        if share < 1.0 {
            return Err(ClipError::TooLong { n_poses, most: (share * n_poses) as usize });
        }
        let way = Way::new(self, limits, rate_hz);
        let mut shares = vec![Share { acceleration: 1.0 - SPARE[0], ..Share::FULL }; way.n_cells()];
        let (mut round, mut spare, mut stretch) = (0, SPARE[0], 1.0_f64);
        loop {
            let squared: Vec<f64> =
                way.squared_tempo(&shares).iter().map(|x| x / (stretch * stretch)).collect();
            let map = TimeMap::new(way.secs().to_vec(), &squared);
            let clip = self.slowed(&map, rate_hz)?;
            let measured = clip.exceeded_while(limits, &may_go_on)?;
            let was_stopped = measured.is_none();
            let excesses = measured.unwrap_or_default();
            if let Some(first) = excesses.first() {
                worst = *first;
            } else if !was_stopped {
                return Ok(Retimed { clip, map: Some(map) });
            }
            let is_too_long = map.duration_secs() > MOST_STRETCH * self.duration_secs();
            if was_stopped
                || !may_go_on()
                || is_too_long
                || shares.iter().any(Share::is_spent)
                || round == ROUNDS + EVEN_ROUNDS
            {
                let joint = self.rig().joints()[worst.limit.joint.index()].name.clone();
                return Err(ClipError::Unkept { joint, excess: worst });
            }
            if round < ROUNDS {
                clip.take_less(&mut shares, &map, &excesses, spare);
            } else {
                stretch *=
                    excesses.iter().map(RateExcess::needed_stretch).fold(1.0, f64::max) * (1.0 + spare);
            }
            round += 1;
            spare = if round == ROUNDS { SPARE[0] } else { (2.0 * spare).min(SPARE[1]) };
        }
    }

    /// This clip at even steps of about `1 / rate_hz` seconds of another time.
    fn slowed(&self, map: &TimeMap, rate_hz: f64) -> Result<Self, ClipError> {
        let duration = map.duration_secs();
        let n_steps = (duration * rate_hz).round().max(1.0);
        self.check_length(n_steps + 1.0)?;
        let [start, end] = [map.slowed()[0], map.slowed()[map.slowed().len() - 1]];
        let n = n_steps as usize;
        let times: Vec<f64> =
            (0..=n).map(|i| if i < n { start + duration * (i as f64 / n_steps) } else { end }).collect();
        let poses = times.iter().map(|secs| self.sample_cubic(map.was_at(*secs))).collect();
        Self::new(self.name.clone(), times, poses)
    }

    /// Lowers the shares of limits wherever this slowed clip exceeds one, by as much and `spare` more.
    fn take_less(&self, shares: &mut [Share], map: &TimeMap, excesses: &[RateExcess], spare: f64) {
        let step = self.times[1] - self.times[0];
        // Of several that are exceeded in one place the worst counts.
        let mut factors = vec![Share::FULL; shares.len()];
        for excess in excesses {
            for (before, ratio) in self.excesses_between(excess) {
                let secs = self.times[before] + 0.5 * step;
                let least = (1.0 / (ratio * (1.0 + spare))).max(LEAST_FACTOR);
                shrink(&mut factors, map, secs, step, excess.limit.rate, least);
            }
        }
        for (share, factor) in shares.iter_mut().zip(factors) {
            share.speed *= factor.speed;
            share.acceleration *= factor.acceleration;
        }
    }

    /// Between which poses a limit does not hold that the clip does not keep: the first pose's position, and the peak
    /// as a multiple of the limit.
    fn excesses_between(&self, excess: &RateExcess) -> Vec<(usize, f64)> {
        let RateLimit { joint, part, rate, most } = excess.limit;
        let dofs = part.dofs(self.rig(), joint);
        let worst = self.times.partition_point(|secs| *secs < excess.peak.secs).saturating_sub(1);
        (0..self.times.len() - 1)
            .map(|before| {
                // Where the peak is known to be, it is not looked for less thoroughly.
                let known = if before == worst { excess.peak.value } else { 0.0 };
                (before, self.peak_between(joint, &dofs, rate, before, most).value.max(known) / most)
            })
            .filter(|(_, ratio)| *ratio > 1.0 + TOLERANCE)
            .collect()
    }
}

impl Share {
    /// Whether so little is left that a tempo of 1 / [`MOST_STRETCH`] would not help either.
    fn is_spent(&self) -> bool {
        self.speed < 1.0 / MOST_STRETCH || self.acceleration < MOST_STRETCH.powi(-2)
    }
}

/// Lowers shares to `least` around a time of the slowed clip, and less and less so further away from it.
fn shrink(shares: &mut [Share], map: &TimeMap, secs: f64, step: f64, rate: Rate, least: f64) {
    let slowed = map.slowed();
    let here = slowed.partition_point(|time| *time <= secs).clamp(1, slowed.len() - 1);
    // Where cells are longer than steps, a share that falls from cell to cell would be a jump itself.
    let step = step.max(slowed[here] - slowed[here - 1]);
    let reach = REACH_STEPS * step;
    let first = slowed.partition_point(|time| *time <= secs - reach).saturating_sub(1);
    for (cell, share) in shares.iter_mut().enumerate().skip(first) {
        let (from, to) = (slowed[cell], slowed[cell + 1]);
        if from >= secs + reach {
            break;
        }
        // How many steps away the nearest moment of the cell is.
        let away = (from - secs).max(secs - to).max(0.0) / step;
        let weight = ((REACH_STEPS - away) / (REACH_STEPS - 1.0)).clamp(0.0, 1.0);
        let factor = 1.0 - weight * (1.0 - least);
        let of_rate = if rate == Rate::Speed { &mut share.speed } else { &mut share.acceleration };
        *of_rate = of_rate.min(factor);
    }
}
