//! What a motion problem says of its samples: which are given, and which terms want something of which.

use ikiru_rig::{JointId, Pose};

use crate::problem::motion::MotionProblem;
use crate::problem::sample_terms::SampleTerms;
use crate::problem::track::Track;

impl MotionProblem {
    /// The pose of a sample that is given.
    pub(crate) fn given(&self, sample: usize) -> Option<&Pose> {
        let is_last = sample + 1 == self.timeline.n_samples();
        self.history.get(sample).or(self.end.as_ref().filter(|_| is_last))
    }

    /// Whether a term is on and holds at a sample.
    fn holds(&self, term: usize, sample: usize) -> bool {
        self.base.terms()[term].is_on && self.tracks[term].holds(sample)
    }

    /// Whether all samples are given that a term reads when it holds at one.
    fn reads_given(&self, track: &Track, sample: usize) -> bool {
        (sample - track.n_earlier.min(sample)..=sample).all(|read| self.given(read).is_some())
    }

    /// Whether a term wants something of a sample: it does at its samples but for those that are given, where there is
    /// nothing to plan.
    pub(crate) fn wants(&self, term: usize, sample: usize) -> bool {
        self.holds(term, sample) && !self.reads_given(&self.tracks[term], sample)
    }

    /// Whether all samples of a term are given: what it costs is then a constant of the motion.
    pub(crate) fn is_settled(&self, term: usize) -> bool {
        let track = &self.tracks[term];
        let samples = &track.samples;
        if track.n_earlier > 0 {
            let mut held = samples.clone().filter(|sample| track.holds(*sample));
            return held.all(|sample| self.reads_given(track, sample));
        }
        // Those that are given are the first, and perhaps the last.
        let n_samples = self.timeline.n_samples();
        let ends_given = self.end.is_some() && samples.end == n_samples;
        let planned_end = if ends_given { n_samples - 1 } else { samples.end };
        samples.start.max(self.history.len()) >= planned_end
    }

    /// Whether a settled term holds at a sample.
    pub(crate) fn settles(&self, term: usize, sample: usize) -> bool {
        self.holds(term, sample) && self.is_settled(term)
    }

    /// Active joints that the given samples lead from one place to another, whether or not a term reads them.
    pub(crate) fn led(&self, joints: &mut Vec<JointId>) {
        let rig = self.rig();
        let given = || self.history.iter().chain(&self.end);
        let differs = |joint: &JointId| {
            let at = rig.coords_of(*joint);
            let next = given().skip(1);
            given().zip(next).any(|(a, b)| a.coords()[at.clone()] != b.coords()[at.clone()])
        };
        joints.clear();
        joints.extend(self.base.active().filter(differs));
    }

    /// The first sample that is given, if there is one.
    pub(crate) fn first_given(&self) -> Option<&Pose> {
        self.history.first().or(self.end.as_ref())
    }

    /// How many first samples are given.
    pub(crate) fn n_history(&self) -> usize {
        self.history.len()
    }

    /// Whether joints that are not active differ between two poses.
    pub(crate) fn moves_others(&self, a: &Pose, b: &Pose) -> bool {
        let rig = self.rig();
        rig.ids().filter(|joint| !self.base.is_active(*joint)).any(|joint| {
            let at = rig.coords_of(joint);
            a.coords()[at.clone()] != b.coords()[at]
        })
    }

    /// The terms that a plan can still do something for at one sample.
    pub(crate) fn wanted_at(&self, sample: usize) -> SampleTerms<'_> {
        SampleTerms::wanted(self, sample)
    }

    /// Whether a term would hold at a sample, were it not switched off.
    pub(crate) fn is_off_at(&self, term: usize, sample: usize) -> bool {
        !self.base.terms()[term].is_on && self.tracks[term].holds(sample)
    }

    /// The terms of one sample that are switched off.
    pub(crate) fn off_at(&self, sample: usize) -> SampleTerms<'_> {
        SampleTerms::off(self, sample)
    }

    /// The settled terms of one sample.
    pub(crate) fn settled_at(&self, sample: usize) -> SampleTerms<'_> {
        SampleTerms::settled(self, sample)
    }
}
