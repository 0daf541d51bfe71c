//! Courses can be met where they say so, and rows are what came of them.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::path::Path;

use ikiru_eval::track::{self, CLIPS, Course, Report, Settings};
use ikiru_solve::SolverOptions;
use ikiru_testkit::reference::world_matrices;

#[test]
fn targets_of_a_course_are_where_its_pose_has_them() {
    let (_, clip) = Course::clip(Path::new("walk")).unwrap();
    let courses = [
        Course::g1(3, 60.0, 90).unwrap(),
        Course::human("walk", &clip, 30.0, 90).unwrap(),
        Course::reference("walk", &clip, 30.0, 90).unwrap(),
    ];
    for (course, n_targets) in courses.iter().zip([6, 6, 17]) {
        assert_eq!((course.frames.len(), course.targets.len()), (90, n_targets), "{}", course.name);
        assert!(course.start.limit_violation() < 1e-9 && course.own_turn > 0.0 && course.own_turn < 1.0);
        let places = world_matrices(&course.start);
        for ((joint, _), to) in course.targets.iter().zip(&course.frames[0]) {
            assert!(places[joint.index()].w_axis.truncate().distance(to.position) < 1e-9, "{}", course.name);
        }
    }
    let rig = courses[2].start.rig();
    // With the two at the tips of its index fingers.
    assert_eq!(rig.joints().iter().filter(|joint| joint.n_dofs() > 0).count(), 57);
    // The walk is one cycle of 38 frames: two cycles later, to and fro, it is at the same place.
    let [a, b] = [0, 76].map(|frame| courses[1].frames[frame][4].position);
    assert!(a.distance(b) < 1e-3, "{a} {b}");
}

#[test]
fn away_targets_are_out_of_reach_each_other_second() {
    let course = Course::g1(3, 10.0, 40).unwrap();
    let away = course.clone().away();
    for frame in 0..40 {
        let is_near = (frame / 10) % 2 == 0;
        assert_eq!(away.can_be_met[frame], is_near);
        let (was, is) = (&course.frames[frame], &away.frames[frame]);
        let way = |frames: &[ikiru_rig::JointFrame]| frames[2].position.distance(frames[0].position);
        let ratio = way(is) / way(was);
        assert!((ratio - if is_near { 1.0 } else { 1.15 }).abs() < 1e-9, "{frame}: {ratio}");
    }
}

#[test]
fn rows_say_what_came_of_every_frame() {
    let course = Course::g1(5, 60.0, 20).unwrap();
    let mut n_done = 0;
    let rows = track::run(&course, &Settings { runs: 2, ..Settings::default() }, || n_done += 1).unwrap();
    assert_eq!((rows.len(), n_done), (20, 40));
    assert!(rows.iter().all(|row| row.success && row.position_error < 1e-3 && row.time_us > 0.0));
    assert!(rows[1..].iter().any(|row| row.turn > 1e-3) && rows.iter().any(|row| row.iterations > 0));
    // Without iterations the body stays where it began, and is told to have missed.
    let options = SolverOptions { max_iterations: 0, ..SolverOptions::default() };
    let still = track::run(&course, &Settings { options, ..Settings::default() }, || ()).unwrap();
    assert!(!still[19].success && still[19].turn == 0.0 && still[19].position_error > 1e-3);
    let report = Report::new(&[rows, still].concat()).markdown();
    assert!(report.contains("| G1, sines | 60 | 40 |"), "{report}");
}

#[test]
fn clips_ship_and_others_are_refused_by_name() {
    for (name, _) in CLIPS {
        assert!(Course::clip(Path::new(name)).unwrap().1.poses().len() > 20, "{name}");
    }
    let unknown = Course::clip(Path::new("wlak")).unwrap_err().to_string();
    assert!(unknown.contains("wlak") && unknown.contains("cmu_01_01, walk, run, dance"), "{unknown}");
    assert!(Course::clip(Path::new("none/walk.bvh")).unwrap_err().to_string().contains("none/walk.bvh"));
}
