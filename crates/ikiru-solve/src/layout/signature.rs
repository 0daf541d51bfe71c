//! What a layout was made for: a problem with the same joints, terms and parts needs no other one.

use ikiru_rig::{JointId, Rig};

use crate::layout::joints_read;
use crate::objective::{Objective, Part};
use crate::problem::Problem;

/// What a term reads and gives.
#[derive(Clone, Debug)]
struct Reads {
    joints: Vec<JointId>,
    own_motions: Vec<JointId>,
    parts: Vec<Part>,
}

/// What a layout was made for. Solves compare it, so that a changed problem is laid out anew.
#[derive(Clone, Debug, Default)]
pub(crate) struct Signature {
    rig: Option<Rig>,
    active: Vec<bool>,
    terms: Vec<Reads>,
}

impl Signature {
    /// Whether it is still that of a problem. Does not allocate.
    pub(crate) fn fits(&self, problem: &Problem) -> bool {
        self.rig.as_ref().is_some_and(|rig| rig.is_same(problem.rig()))
            && self.active == problem.active_flags()
            && self.terms.len() == problem.terms().len()
            && self.terms.iter().zip(problem.terms()).all(|(reads, term)| {
                let o = &term.objective;
                reads.joints == o.joints()
                    && reads.own_motions == joints_read(&**o)
                    && reads.parts == o.parts()
            })
    }

    pub(crate) fn of(problem: &Problem) -> Self {
        let reads = |o: &dyn Objective| Reads {
            joints: o.joints().to_vec(),
            own_motions: joints_read(o).to_vec(),
            parts: o.parts().to_vec(),
        };
        Self {
            rig: Some(problem.rig().clone()),
            active: problem.active_flags().to_vec(),
            terms: problem.terms().iter().map(|t| reads(&*t.objective)).collect(),
        }
    }
}
