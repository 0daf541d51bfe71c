//! A problem: which joints may move, and the weighted objectives that they should meet.

mod error;
pub(crate) mod motion;
mod motion_terms;
mod path;
pub(crate) mod sample_terms;
mod samples;
pub(crate) mod term;
mod timeline;
pub(crate) mod track;
mod when;

pub use error::MotionError;
pub use motion::MotionProblem;
pub use path::{TargetPath, TargetPathError};
pub use term::{Term, TermId, Tolerance};
pub use timeline::{Timeline, TimelineError};
pub use when::When;

use std::ops::{Index, IndexMut};

use ikiru_rig::{ForeignJoint, JointId, Rig, ShapeDifference};

use crate::objective::{Objective, TermReads, Unfit, check_objective};
use crate::problem::term::AnyObjective;

/// The joints that may move and the terms of the cost `J = Σ λ · ρ(r)` (the paper's equations 6 and 19).
///
/// Targets, weights and tolerances change between solves without rebuilding anything: index the problem by
/// the id that [`add`](Self::add) gave, or change the [term](Self::term_mut). A problem is a value: a clone has terms of
/// its own under the same ids.
#[derive(Clone, Debug)]
pub struct Problem {
    rig: Rig,
    active: Vec<bool>,
    /// In the order of their keys.
    terms: Vec<Term>,
    next_key: u32,
}

/// The terms that hold for one pose: those of a problem, or those of one sample of a motion.
pub(crate) trait Terms {
    /// Whether the term holds here.
    fn is_on(&self, term: usize) -> bool;
    /// How it counts.
    fn term(&self, term: usize) -> &Term;
    /// Its objective here.
    fn objective(&self, term: usize) -> &dyn Objective;
}

impl<T: Terms> Terms for &T {
    #[inline(always)]
    fn is_on(&self, term: usize) -> bool {
        (**self).is_on(term)
    }
    #[inline(always)]
    fn term(&self, term: usize) -> &Term {
        (**self).term(term)
    }
    #[inline(always)]
    fn objective(&self, term: usize) -> &dyn Objective {
        (**self).objective(term)
    }
}

impl Terms for Problem {
    #[inline(always)]
    fn is_on(&self, term: usize) -> bool {
        self.terms[term].is_on
    }
    #[inline(always)]
    fn term(&self, term: usize) -> &Term {
        &self.terms[term]
    }
    #[inline(always)]
    fn objective(&self, term: usize) -> &dyn Objective {
        &*self.terms[term].objective
    }
}

impl Problem {
    /// A problem without terms, in which the given joints of the rig may move; all others stay where the
    /// pose has them.
    ///
    /// # Errors
    /// The first id that the rig does not have.
    pub fn new(rig: &Rig, active: impl IntoIterator<Item = JointId>) -> Result<Self, ForeignJoint> {
        let mut flags = vec![false; rig.n_joints()];
        for joint in active {
            check_joint(rig, joint)?;
            flags[joint.index()] = true;
        }
        Ok(Self::of_active(rig, flags))
    }

    /// A problem without terms, in which every joint that has a degree of freedom may move.
    #[must_use]
    pub fn whole_body(rig: &Rig) -> Self {
        Self::of_active(rig, vec![true; rig.n_joints()])
    }

    fn of_active(rig: &Rig, active: Vec<bool>) -> Self {
        Self { rig: rig.clone(), active, terms: Vec::new(), next_key: 0 }
    }

    /// The rig.
    #[must_use]
    pub fn rig(&self) -> &Rig {
        &self.rig
    }

    /// This problem on another rig of the same shape: other limits, other ways of its joints to move. Joints, terms
    /// and ids stay as they are.
    ///
    /// # Errors
    /// The first joint whose name, parent or rest transform differs.
    pub fn with_rig(&self, rig: &Rig) -> Result<Self, ShapeDifference> {
        match self.rig.shape_difference(rig) {
            Some(difference) => Err(difference),
            None => Ok(Self { rig: rig.clone(), ..self.clone() }),
        }
    }

    /// Whether a joint may move.
    #[must_use]
    pub fn is_active(&self, joint: JointId) -> bool {
        self.active.get(joint.index()).copied().unwrap_or(false)
    }

    /// The joints that may move and have degrees of freedom of their own, parents first.
    pub fn active(&self) -> impl Iterator<Item = JointId> + '_ {
        self.rig
            .ids()
            .filter(|j| self.is_active(*j) && self.rig.get(*j).is_some_and(|joint| joint.n_dofs() > 0))
    }

    /// Adds an objective with its weight λ, squared loss, the default tolerance, and the objective's own word on whether
    /// success asks for it. What is wrong with its numbers is found when a solve starts.
    pub fn add<T: Objective + Clone>(&mut self, weight: f64, objective: T) -> TermId<T> {
        let key = self.next_key;
        self.next_key += 1;
        self.terms.push(Term::new(key, weight, objective));
        TermId::new(key)
    }

    /// Adds an objective as a constraint: [hard](Term::hard), within [`Tolerance::HARD`].
    pub fn add_hard<T: Objective + Clone>(&mut self, objective: T) -> TermId<T> {
        let id = self.add(1.0, objective);
        let term = self.term_mut(id);
        (term.hard, term.tolerance) = (true, Tolerance::HARD);
        id
    }

    /// Takes a term out for good; `None` where it is gone already. To do without it for a while, switch it
    /// [off](Term::is_on): nothing is then laid out anew.
    pub fn remove<T: Objective + Clone>(&mut self, id: TermId<T>) -> Option<T> {
        self.get(id)?;
        let term = self.terms.remove(self.position(id)?);
        term.objective.as_any().downcast_ref::<T>().cloned()
    }

    /// The terms, in the order in which they were added, as reports list them.
    #[must_use]
    pub fn terms(&self) -> &[Term] {
        &self.terms
    }

    /// The position of a term among [`terms`](Self::terms) and in reports; `None` where there is no such term.
    #[must_use]
    pub fn position<T>(&self, id: TermId<T>) -> Option<usize> {
        // As long as none was removed, the key is the position.
        let at = id.key as usize;
        if self.terms.get(at).is_some_and(|term| term.key == id.key) {
            return Some(at);
        }
        self.terms.binary_search_by_key(&id.key, |term| term.key).ok()
    }

    /// What a term reads, and the rows that it may open.
    ///
    /// # Errors
    /// What does not fit the rig, or is not usable otherwise.
    pub fn reads(&self, term: &Term) -> Result<TermReads, Unfit> {
        let mut reads = TermReads::default();
        check_objective(&self.rig, term.objective(), &mut reads)?;
        Ok(reads)
    }

    /// The objective of a term; `None` where the id is of another problem and does not fit.
    #[must_use]
    pub fn get<T: Objective>(&self, id: TermId<T>) -> Option<&T> {
        self.terms[self.position(id)?].objective.as_any().downcast_ref()
    }

    /// The objective of a term, to change it; `None` where the id is of another problem and does not fit.
    #[must_use]
    pub fn get_mut<T: Objective>(&mut self, id: TermId<T>) -> Option<&mut T> {
        let at = self.position(id)?;
        self.terms[at].objective.as_any_mut().downcast_mut()
    }

    /// A term: its weight, loss and tolerance.
    ///
    /// # Panics
    /// When the problem has no such term; [`position`](Self::position) does not.
    #[must_use]
    #[expect(clippy::expect_used, reason = "a wrong id is a programming error, as for a slice")]
    pub fn term<T>(&self, id: TermId<T>) -> &Term {
        &self.terms[self.position(id).expect("the id belongs to another problem, or its term was removed")]
    }

    /// A term, to change how it counts.
    ///
    /// # Panics
    /// When the problem has no such term; [`position`](Self::position) does not.
    #[must_use]
    #[expect(clippy::expect_used, reason = "a wrong id is a programming error, as for a slice")]
    pub fn term_mut<T>(&mut self, id: TermId<T>) -> &mut Term {
        let at = self.position(id).expect("the id belongs to another problem, or its term was removed");
        &mut self.terms[at]
    }

    /// The terms, to change how they count: they stay as many, in the same order.
    pub fn terms_mut(&mut self) -> &mut [Term] {
        &mut self.terms
    }

    /// Leaves only some terms, each with another objective of its own kind.
    pub(crate) fn keep(&mut self, mut objective: impl FnMut(usize) -> Option<Box<dyn AnyObjective>>) {
        let terms = std::mem::take(&mut self.terms);
        self.terms = terms
            .into_iter()
            .enumerate()
            .filter_map(|(idx, term)| Some(Term { objective: objective(idx)?, ..term }))
            .collect();
    }

    pub(crate) fn active_flags(&self) -> &[bool] {
        &self.active
    }
}

/// Whether a joint is one of the rig's.
fn check_joint(rig: &Rig, joint: JointId) -> Result<(), ForeignJoint> {
    let (joint, n_joints) = (joint.index(), rig.n_joints());
    if joint < n_joints { Ok(()) } else { Err(ForeignJoint { joint, n_joints }) }
}

impl<T: Objective> Index<TermId<T>> for Problem {
    type Output = T;
    /// # Panics
    /// When the id is of another problem and does not fit; [`Problem::get`] does not.
    #[expect(clippy::expect_used, reason = "indexing with a wrong id is a programming error, as for a slice")]
    fn index(&self, id: TermId<T>) -> &T {
        self.get(id).expect("the id belongs to another problem, or its term was removed")
    }
}

impl<T: Objective> IndexMut<TermId<T>> for Problem {
    /// # Panics
    /// When the id is of another problem and does not fit; [`Problem::get_mut`] does not.
    #[expect(clippy::expect_used, reason = "indexing with a wrong id is a programming error, as for a slice")]
    fn index_mut(&mut self, id: TermId<T>) -> &mut T {
        self.get_mut(id).expect("the id belongs to another problem, or its term was removed")
    }
}
