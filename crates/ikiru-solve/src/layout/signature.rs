//! What a layout was made for: a problem with the same joints, terms and parts needs no other one.

use ikiru_rig::{JointId, Rig};

use crate::objective::{TermReads, Unfit, check_objective};
use crate::problem::Problem;

/// What a layout was made for. Solves compare it, so that a changed problem is laid out anew.
#[derive(Clone, Debug, Default)]
pub(crate) struct Signature {
    rig: Option<Rig>,
    active: Vec<bool>,
    /// Joints that matter though no term reads them.
    others: Vec<JointId>,
    /// What each term reads, and whether it is hard.
    pub(crate) terms: Vec<(TermReads, bool)>,
    /// Memory for what a term says now.
    now: TermReads,
}

impl Signature {
    /// The first term that reads earlier samples, which a single pose has not.
    pub(crate) fn check_pose(&self) -> Result<(), (usize, Unfit)> {
        let reads_earlier = |(reads, _): &(TermReads, bool)| reads.n_earlier > 0;
        match self.terms.iter().position(reads_earlier) {
            Some(term) => Err((term, "reads earlier samples: it belongs in a motion".into())),
            None => Ok(()),
        }
    }

    /// Checks a problem; says whether this is still its signature. Does not allocate as long as it is.
    ///
    /// # Errors
    /// The first term that is not usable, and why.
    pub(crate) fn check(&mut self, problem: &Problem, others: &[JointId]) -> Result<bool, (usize, Unfit)> {
        let rig = problem.rig();
        let mut fits = self.rig.as_ref().is_some_and(|own| own.is_same(rig))
            && self.active == problem.active_flags()
            && self.others == others
            && self.terms.len() == problem.terms().len();
        for (idx, term) in problem.terms().iter().enumerate() {
            let named = |unfit| (idx, unfit);
            term.check().map_err(named)?;
            check_objective(rig, term.objective(), &mut self.now).map_err(named)?;
            fits = fits
                && self.terms.get(idx).is_some_and(|(reads, hard)| *reads == self.now && *hard == term.hard);
        }
        Ok(fits)
    }

    /// The signature of a problem.
    ///
    /// # Errors
    /// The first term that is not usable, and why.
    pub(crate) fn of(problem: &Problem, others: &[JointId]) -> Result<Self, (usize, Unfit)> {
        let mut terms = Vec::with_capacity(problem.terms().len());
        for (idx, term) in problem.terms().iter().enumerate() {
            let mut reads = TermReads::default();
            term.check().map_err(|unfit| (idx, unfit))?;
            check_objective(problem.rig(), term.objective(), &mut reads).map_err(|unfit| (idx, unfit))?;
            terms.push((reads, term.hard));
        }
        let most = |of: fn(&TermReads) -> usize| terms.iter().map(|(reads, _)| of(reads)).max().unwrap_or(0);
        let now = TermReads {
            frames: Vec::with_capacity(most(|reads| reads.frames.len())),
            motions: Vec::with_capacity(most(|reads| reads.motions.len())),
            parts: Vec::with_capacity(most(|reads| reads.parts.len())),
            ..TermReads::default()
        };
        let (rig, active) = (Some(problem.rig().clone()), problem.active_flags().to_vec());
        Ok(Self { rig, active, others: others.to_vec(), terms, now })
    }
}
