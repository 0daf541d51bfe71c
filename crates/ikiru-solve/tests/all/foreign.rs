//! The id of a joint that a rig does not have: an error where a problem is told of it, as everywhere.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use ikiru_rig::{ForeignJoint, JointId};
use ikiru_solve::{MotionError, MotionProblem, Problem, Timeline};
use ikiru_testkit::rigs::random_rig;

const FOREIGN: ForeignJoint = ForeignJoint { joint: 5, n_joints: 5 };

#[test]
fn a_foreign_joint_is_none_that_may_move() {
    let rig = random_rig(5, 1);
    let (own, foreign) = (JointId::from_index(4), JointId::from_index(5));
    let timeline = Timeline::points(2).unwrap();
    for active in [vec![foreign], vec![own, foreign], vec![foreign, own]] {
        assert_eq!(Problem::new(&rig, active.clone()).map(drop), Err(FOREIGN));
        let motion = MotionProblem::new(&rig, active, timeline).map(drop);
        assert_eq!(motion, Err(MotionError::NoJoint(FOREIGN)));
    }
    assert!(Problem::new(&rig, [own]).unwrap().is_active(own));
    assert!(MotionProblem::new(&rig, [own], timeline).unwrap().terms().is_active(own));
    // What is asked of it is answered by none.
    assert!(!Problem::whole_body(&rig).is_active(foreign));
}

#[test]
fn a_foreign_joint_has_no_smoothness() {
    let rig = random_rig(5, 1);
    let mut motion = MotionProblem::whole_body(&rig, Timeline::points(2).unwrap());
    let refused = motion.set_joint_smoothness(JointId::from_index(5), [0.1; 3]);
    assert_eq!(refused, Err(MotionError::NoJoint(FOREIGN)));
    assert_eq!(refused.unwrap_err().to_string(), FOREIGN.to_string());
    motion.set_joint_smoothness(JointId::from_index(4), [0.1; 3]).unwrap();
}
