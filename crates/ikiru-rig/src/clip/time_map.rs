//! How time runs in a slowed clip: which of its times belongs to which time of the original.

/// Times of the original and of the slowed clip, with the tempo between them. In each piece the tempo changes evenly
/// over time, so that it has no jumps anywhere.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TimeMap {
    /// Times of the original, in seconds.
    original: Vec<f64>,
    /// Times of the slowed clip at those moments, in seconds.
    slowed: Vec<f64>,
    /// Seconds of the original a second of the slowed clip, from 0 to 1.
    tempo: Vec<f64>,
}

impl TimeMap {
    /// From at least two increasing times of the original and the square of the tempo at each, of which no two
    /// neighbours may be 0. The first time stays.
    pub(super) fn new(original: Vec<f64>, squared_tempo: &[f64]) -> Self {
        let tempo: Vec<f64> = squared_tempo.iter().map(|x| x.sqrt()).collect();
        let mut slowed = Vec::with_capacity(original.len());
        let mut now = original[0];
        slowed.push(now);
        for (times, tempo) in original.windows(2).zip(tempo.windows(2)) {
            now += 2.0 * (times[1] - times[0]) / (tempo[0] + tempo[1]);
            slowed.push(now);
        }
        Self { original, slowed, tempo }
    }

    /// The times of the slowed clip that belong to the moments that it was made of.
    pub(super) fn slowed(&self) -> &[f64] {
        &self.slowed
    }

    /// How long the slowed clip is, in seconds.
    pub(super) fn duration_secs(&self) -> f64 {
        self.slowed[self.slowed.len() - 1] - self.slowed[0]
    }

    /// The time in the slowed clip of a time of the original.
    pub(super) fn at(&self, secs: f64) -> f64 {
        let piece = match locate(&self.original, secs) {
            Ok(piece) => piece,
            Err(end) => return self.slowed[end],
        };
        let (a, b) = (self.tempo[piece], self.tempo[piece + 1]);
        let done = secs - self.original[piece];
        if done <= 0.0 {
            return self.slowed[piece];
        }
        // By distance, the square of the tempo is a straight line.
        let part = done / (self.original[piece + 1] - self.original[piece]);
        let here = (a * a + (b * b - a * a) * part).max(0.0).sqrt();
        (self.slowed[piece] + 2.0 * done / (a + here)).min(self.slowed[piece + 1])
    }

    /// The time in the original of a time of the slowed clip.
    pub(super) fn was_at(&self, secs: f64) -> f64 {
        let piece = match locate(&self.slowed, secs) {
            Ok(piece) => piece,
            Err(end) => return self.original[end],
        };
        let (a, b) = (self.tempo[piece], self.tempo[piece + 1]);
        let since = secs - self.slowed[piece];
        let part = since / (self.slowed[piece + 1] - self.slowed[piece]);
        (self.original[piece] + since * (a + 0.5 * part * (b - a))).min(self.original[piece + 1])
    }
}

/// The piece that a time lies in, or the end that it lies at or beyond; a time that is not a number counts as the
/// first.
fn locate(times: &[f64], secs: f64) -> Result<usize, usize> {
    let last = times.len() - 1;
    if secs.is_nan() || secs <= times[0] {
        Err(0)
    } else if secs >= times[last] {
        Err(last)
    } else {
        Ok(times.partition_point(|time| *time <= secs) - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn it_rises_without_jumps_of_tempo_and_has_an_inverse(
            pieces in prop::collection::vec((0.001..2.0f64, 0.0001..1.0f64), 2..20), start in -5.0..5.0f64,
        ) {
            let mut original = vec![start];
            for (secs, _) in &pieces[1..] {
                original.push(original[original.len() - 1] + secs);
            }
            let squared: Vec<f64> = pieces.iter().map(|(_, x)| *x).collect();
            let last = original.len() - 1;
            let map = TimeMap::new(original.clone(), &squared);
            prop_assert_eq!(map.slowed()[0], start);
            let mut previous = f64::NEG_INFINITY;
            for i in 0..=500 {
                let secs = start + (original[last] - start) * (f64::from(i) / 500.0);
                let now = map.at(secs);
                prop_assert!(now > previous && now >= secs - 1e-12);
                prop_assert!((map.was_at(now) - secs).abs() < 1e-10, "{} {}", map.was_at(now), secs);
                previous = now;
            }
            for i in 1..last {
                // The tempo on either side of a moment, by differences.
                let (now, step) = (map.slowed()[i], 1e-6);
                let [before, after] = [-step, step].map(|step| (map.was_at(now + step) - original[i]) / step);
                prop_assert!((before - squared[i].sqrt()).abs() < 1e-2 && (after - before).abs() < 2e-2);
            }
            for (beyond, end) in [(f64::NEG_INFINITY, 0), (start - 1.0, 0), (f64::NAN, 0), (1e9, last)] {
                prop_assert_eq!(map.at(beyond), map.slowed()[end]);
                prop_assert_eq!(map.was_at(beyond), original[end]);
            }
        }
    }

    #[test]
    fn it_starts_from_and_comes_to_a_stop() {
        let map = TimeMap::new(vec![0.0, 1.0, 2.0], &[0.0, 1.0, 0.0]);
        assert_eq!(map.slowed(), [0.0, 2.0, 4.0]);
        assert!((map.at(0.25) - 1.0).abs() < 1e-12 && (map.was_at(3.0) - 1.75).abs() < 1e-12);
        assert_eq!((map.at(0.0), map.at(2.0)), (0.0, 4.0));
    }
}
