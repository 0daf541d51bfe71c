//! What is proven to be out of reach, and what would help.

use ikiru_rig::JointId;

use crate::layout::{Layout, NONE, TermLayout};
use crate::objective::Reach;
use crate::problem::Terms;
use crate::report::explain::reach::{Chain, common};
use crate::report::force::Hint;
use crate::report::here::Here;

/// The node, the joint and where it is wanted, of a term that wants a point at a place.
fn wanted(layout: &Layout, terms: &impl Terms, t: &TermLayout) -> Option<(u32, JointId, Reach)> {
    let reach = terms.objective(t.term).reach()?;
    let node = *t.nodes.get(reach.frame)?;
    let joint = *layout.signature.terms.get(t.term)?.0.frames.get(reach.frame)?;
    Some((node, joint, reach))
}

/// How far out of reach a term is, where that is proven; else 0.
pub(super) fn missed_distance(here: &Here<'_, impl Terms>, t: &TermLayout) -> f64 {
    let Here { layout, state, ref terms, .. } = *here;
    let Some((node, _, reach)) = wanted(layout, terms, t) else { return 0.0 };
    Chain::above(layout, state, node, reach.point, NONE).map_or(0.0, |chain| chain.misses(reach.target))
}

/// What would help a term that is proven to be out of reach.
pub(super) fn hint(here: &Here<'_, impl Terms>, term: usize) -> Option<Hint> {
    let Here { layout, rig, state, ref terms, .. } = *here;
    let t = layout.terms.get(term)?;
    let (node, joint, reach) = wanted(layout, terms, t)?;
    let root = rig.root().filter(|root| rig.ancestors(joint).any(|above| above == *root))?;
    // What else is to be at some place must be near enough.
    let others = layout.terms.iter().filter(|other| other.term != term && terms.is_on(other.term));
    for (other, joint, wants) in others.filter_map(|other| wanted(layout, terms, other)) {
        let top = common(layout, node, other);
        let ends = [(node, reach.point), (other, wants.point)];
        let [Some(a), Some(b)] = ends.map(|(node, point)| Chain::above(layout, state, node, point, top))
        else {
            continue;
        };
        let is_carried = rig.ancestors(joint).any(|above| above == root);
        let span = a.centre.distance(b.centre) + a.longest + b.longest;
        if !is_carried || reach.target.distance(wants.target) > span {
            return None;
        }
    }
    Some(if rig.floating_root() == Some(root) { Hint::MoveRoot(root) } else { Hint::FreeRoot(root) })
}
