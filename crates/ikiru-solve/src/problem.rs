//! A problem: which joints may move, and the weighted objectives that they should meet.

use std::any::Any;
use std::marker::PhantomData;
use std::ops::{Index, IndexMut};

use ikiru_rig::{JointId, Rig};

use crate::layout::joints_read;
use crate::objective::{MOST_PARTS, Objective, Unit};

/// The joints that may move and the terms of the cost `J = Σ λ · ρ(r)` (the paper's equations 6 and 19).
///
/// Targets, weights and tolerances change between solves without rebuilding anything: index the problem by
/// the id that [`add`](Self::add) gave.
#[derive(Debug)]
pub struct Problem {
    rig: Rig,
    active: Vec<bool>,
    terms: Vec<Term>,
}

/// One objective inside a problem.
#[derive(Debug)]
pub(crate) struct Term {
    pub(crate) weight: f64,
    pub(crate) tolerance: Tolerance,
    pub(crate) mandatory: bool,
    pub(crate) objective: Box<dyn AnyObjective>,
}

impl Term {
    /// Whether success asks for it.
    pub(crate) fn counts(&self) -> bool {
        self.mandatory && self.weight > 0.0
    }
}

/// How near is near enough, by unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// For parts in metres; 1 mm by default.
    pub metres: f64,
    /// For parts in radians; 0.5° by default.
    pub radians: f64,
}

impl Default for Tolerance {
    fn default() -> Self {
        Self { metres: 1e-3, radians: 0.5_f64.to_radians() }
    }
}

impl Tolerance {
    pub(crate) fn of(&self, unit: Unit) -> f64 {
        match unit {
            Unit::Metres => self.metres,
            Unit::Radians => self.radians,
        }
    }

    fn is_valid(&self) -> bool {
        [self.metres, self.radians].iter().all(|t| *t >= 0.0)
    }
}

/// An objective that can be seen as what it is.
pub(crate) trait AnyObjective: Objective {
    fn as_any(&self) -> &dyn Any;
    fn as_any_mut(&mut self) -> &mut dyn Any;
}

impl<T: Objective> AnyObjective for T {
    fn as_any(&self) -> &dyn Any {
        self
    }
    fn as_any_mut(&mut self) -> &mut dyn Any {
        self
    }
}

/// The terms that hold for one pose: those of a problem, or those of one frame of a motion.
pub(crate) trait Terms {
    /// Whether the term holds here.
    fn is_on(&self, term: usize) -> bool;
    /// Its weight λ.
    fn weight(&self, term: usize) -> f64;
    /// Its objective.
    fn objective(&self, term: usize) -> &dyn Objective;
}

impl Terms for Problem {
    #[inline(always)]
    fn is_on(&self, _: usize) -> bool {
        true
    }
    #[inline(always)]
    fn weight(&self, term: usize) -> f64 {
        self.terms[term].weight
    }
    #[inline(always)]
    fn objective(&self, term: usize) -> &dyn Objective {
        &*self.terms[term].objective
    }
}

/// The id of a term that knows what objective it is: `problem[id]` is that objective.
pub struct TermId<T> {
    idx: usize,
    objective: PhantomData<fn() -> T>,
}

impl<T> TermId<T> {
    /// Its position among the terms, as reports list them.
    #[must_use]
    pub fn index(self) -> usize {
        self.idx
    }
}

impl<T> Clone for TermId<T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for TermId<T> {}

impl<T> std::fmt::Debug for TermId<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "TermId({})", self.idx)
    }
}

impl Problem {
    /// A problem without terms, in which the given joints of the rig may move; all others stay where the
    /// pose has them. Ids that the rig does not have are left out.
    #[must_use]
    pub fn new(rig: &Rig, active: impl IntoIterator<Item = JointId>) -> Self {
        let mut flags = vec![false; rig.n_joints()];
        for joint in active {
            if let Some(flag) = flags.get_mut(joint.index()) {
                *flag = true;
            }
        }
        Self { rig: rig.clone(), active: flags, terms: Vec::new() }
    }

    /// A problem without terms, in which every joint that has a degree of freedom may move.
    #[must_use]
    pub fn whole_body(rig: &Rig) -> Self {
        Self::new(rig, rig.ids())
    }

    /// The rig.
    #[must_use]
    pub fn rig(&self) -> &Rig {
        &self.rig
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

    /// Adds an objective with its weight λ, the default tolerance, and the objective's own word on whether
    /// success asks for it. What is wrong with its numbers is found when a solve starts.
    pub fn add<T: Objective>(&mut self, weight: f64, objective: T) -> TermId<T> {
        let mandatory = objective.mandatory();
        self.terms.push(Term {
            weight,
            tolerance: Tolerance::default(),
            mandatory,
            objective: Box::new(objective),
        });
        TermId { idx: self.terms.len() - 1, objective: PhantomData }
    }

    /// How many terms there are.
    #[must_use]
    pub fn n_terms(&self) -> usize {
        self.terms.len()
    }

    /// The objective of a term, whatever it is; `None` beyond the last.
    #[must_use]
    pub fn objective(&self, term: usize) -> Option<&dyn Objective> {
        self.terms.get(term).map(|t| &*t.objective as &dyn Objective)
    }

    /// The weight λ of a term; `None` beyond the last.
    #[must_use]
    pub fn weight(&self, term: usize) -> Option<f64> {
        self.terms.get(term).map(|t| t.weight)
    }

    /// The objective of a term; `None` where the id is of another problem and does not fit.
    #[must_use]
    pub fn get<T: Objective>(&self, id: TermId<T>) -> Option<&T> {
        self.terms.get(id.idx)?.objective.as_any().downcast_ref()
    }

    /// The objective of a term, to change it; `None` where the id is of another problem and does not fit.
    #[must_use]
    pub fn get_mut<T: Objective>(&mut self, id: TermId<T>) -> Option<&mut T> {
        self.terms.get_mut(id.idx)?.objective.as_any_mut().downcast_mut()
    }

    /// Changes the weight λ of a term; 0 switches it off.
    pub fn set_weight<T>(&mut self, id: TermId<T>, weight: f64) {
        if let Some(term) = self.terms.get_mut(id.idx) {
            term.weight = weight;
        }
    }

    /// Changes the tolerance of a term.
    pub fn set_tolerance<T>(&mut self, id: TermId<T>, tolerance: Tolerance) {
        if let Some(term) = self.terms.get_mut(id.idx) {
            term.tolerance = tolerance;
        }
    }

    /// Says whether success asks for a term. It never asks for one of weight 0, which is as good as not there.
    pub fn set_mandatory<T>(&mut self, id: TermId<T>, mandatory: bool) {
        if let Some(term) = self.terms.get_mut(id.idx) {
            term.mandatory = mandatory;
        }
    }

    pub(crate) fn terms(&self) -> &[Term] {
        &self.terms
    }

    pub(crate) fn active_flags(&self) -> &[bool] {
        &self.active
    }

    /// The first term whose numbers are wrong, and what is wrong.
    pub(crate) fn check(&self) -> Result<(), (usize, &'static str)> {
        for (idx, term) in self.terms.iter().enumerate() {
            let objective = &term.objective;
            if !(term.weight.is_finite() && term.weight >= 0.0) {
                return Err((idx, "has a weight that is not a finite number of at least 0"));
            }
            if !term.tolerance.is_valid() {
                return Err((idx, "has a tolerance that is not a number of at least 0"));
            }
            if !objective.loss().is_valid() {
                return Err((idx, "has a Huber loss whose width is not finite and positive"));
            }
            let n_joints = self.rig.n_joints();
            let own = joints_read(&**objective);
            if objective.joints().iter().chain(own).any(|j| j.index() >= n_joints) {
                return Err((idx, "names a joint that the rig does not have"));
            }
            let follows = |joint: &JointId| self.rig.get(*joint).is_some_and(|data| data.mimic.is_some());
            if own.iter().any(follows) {
                return Err((idx, "reads the motion of a joint that follows another: name its leader"));
            }
            check_objective(&self.rig, &**objective).map_err(|reason| (idx, reason))?;
        }
        Ok(())
    }
}

/// Whether an objective's numbers are usable, and fit the rig.
pub(crate) fn check_objective(rig: &Rig, objective: &dyn Objective) -> Result<(), &'static str> {
    objective.check()?;
    let n_joint_parts = match objective.joint_rows() {
        Some(rows) => {
            rows.check(rig)?;
            2
        }
        None => 0,
    };
    if objective.parts().len() + n_joint_parts > MOST_PARTS {
        return Err("has more parts than reports have room for: at most 4, its joint rows count for 2");
    }
    Ok(())
}

impl<T: Objective> Index<TermId<T>> for Problem {
    type Output = T;

    /// # Panics
    /// When the id is of another problem and does not fit; [`Problem::get`] does not.
    #[expect(clippy::expect_used, reason = "indexing with a wrong id is a programming error, as for a slice")]
    fn index(&self, id: TermId<T>) -> &T {
        self.get(id).expect("the id belongs to another problem")
    }
}

impl<T: Objective> IndexMut<TermId<T>> for Problem {
    /// # Panics
    /// When the id is of another problem and does not fit; [`Problem::get_mut`] does not.
    #[expect(clippy::expect_used, reason = "indexing with a wrong id is a programming error, as for a slice")]
    fn index_mut(&mut self, id: TermId<T>) -> &mut T {
        self.get_mut(id).expect("the id belongs to another problem")
    }
}
