//! Several wishes at once, and what the report says about each: a hand reaches, its palm faces down, the head looks.
//!
//! `cargo run --release -p ikiru --example 02_look_and_reach`
#![allow(clippy::print_stdout, reason = "an example talks by printing")]

use ikiru::{
    DVec3, Direction, Force, ForceBy, LookAt, Position, Problem, RestPose, Search, Solver, SolverOptions,
    formats,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let loaded = formats::read("builtin:human")?;
    let rig = &loaded.rig;
    let (hand, head) = (rig.joint("leftHand")?, rig.joint("head")?);
    let mut joints = rig.chain("spine", "leftHand")?;
    joints.extend(rig.chain("neck", "head")?);

    let cup = DVec3::new(0.25, 1.15, 0.45);
    let mut problem = Problem::new(rig, joints.iter().copied())?;
    let reach = problem.add(1.0, Position::new(hand, cup));
    problem.add(0.1, Direction::new(hand, DVec3::NEG_Y, DVec3::NEG_Y)); // this rig's palm faces -y at rest
    problem.add(0.1, LookAt::new(head, DVec3::Z, cup));
    problem.add(1e-4, RestPose::new(&joints, rig.rest_pose())); // decides among the many poses that do it

    let search = Search::Global { max_restarts: 16 };
    let solver = Solver::new(SolverOptions { search, ..SolverOptions::default() });
    let mut workspace = solver.workspace(&problem);
    for target in [cup, DVec3::new(1.5, 1.15, 0.45)] {
        problem[reach].target = target;
        let mut pose = rig.rest_pose();
        let report = solver.solve(&problem, &mut pose, &mut workspace);
        println!("hand to {target}: {}, cost {:.3e}", report.stop.name(), report.cost);
        for term in report.terms.iter() {
            let verdict = if term.satisfied { "ok" } else { "not met" };
            println!("  {:<10} {:9.5} {:<3} {verdict}", term.kind, term.residual, term.unit.symbol());
        }
        // The worst term first, and what is most in its way.
        for Force { on, by, share, amount, .. } in report.forces.iter() {
            let Some(term) = on else { continue };
            let what = match by {
                ForceBy::Reach { is_proven: true } => format!("{amount:.2} m out of reach"),
                ForceBy::Reach { is_proven: false } => "out of reach from here".to_owned(),
                ForceBy::Term(other) => format!("term {other}, which pulls the other way"),
                ForceBy::Limit { joint, kind } => {
                    format!("{kind:?} limit of {}", rig.get(*joint).map_or("", |joint| &joint.name))
                }
                other => format!("{other:?}"),
            };
            println!("  in the way of term {term}: {what} ({:.0} %)", 100.0 * share);
        }
    }
    Ok(())
}
