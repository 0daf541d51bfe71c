//! Rows of robots, recomputed by matrices.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::time::Duration;

use glam::{DMat4, DQuat, DVec3};
use ikiru_eval::robots::{Arm, Report, Settings, run};
use ikiru_testkit::reference::world_matrices;

#[test]
fn rows_hold_what_their_values_give() {
    // Time enough that a busy machine cannot make a solve fail.
    let settings = Settings { n: 200, time_limit: Duration::from_secs(20), ..Settings::default() };
    let mut all = Vec::new();
    for arm in Arm::all() {
        let mut n_done = 0;
        let rows = run(&arm, &settings, || n_done += 1).unwrap();
        assert_eq!((rows.len(), n_done), (200, 200));
        let loaded = ikiru_formats::read(&arm.rig).unwrap();
        let rig = &loaded.rig;
        let file_from_world = DMat4::from_quat(loaded.world_from_file().inverse());
        for row in &rows {
            let mut pose = rig.rest_pose();
            for (name, value) in row.joints.iter().zip(&row.values) {
                let joint = rig.joint(name).unwrap();
                let range = rig.get(joint).unwrap().motion.ranges()[0];
                assert!(*value >= range.min - 1e-9 && *value <= range.max + 1e-9, "{name}: {value}");
                pose.set_value(joint, *value).unwrap();
            }
            let tip = file_from_world * world_matrices(&pose)[rig.joint(&row.tip).unwrap().index()];
            let distance = tip.w_axis.truncate().distance(DVec3::from(row.target.position));
            let angle = DQuat::from_mat4(&tip).angle_between(DQuat::from_array(row.target.rotation));
            assert!((distance - row.position_error).abs() < 1e-9, "{}: {distance}", row.robot);
            assert!((angle - row.rotation_error).abs() < 1e-6, "{}: {angle}", row.robot);
            assert_eq!(row.success, row.position_error <= 1e-5 && row.rotation_error <= 1e-5);
            assert!(row.success, "{}: {} m, {} rad", row.robot, row.position_error, row.rotation_error);
        }
        all.extend(rows);
    }
    let markdown = Report::new(&all).markdown();
    assert!(markdown.lines().any(|l| l.starts_with("| panda | 7 | 200 | 100 |")), "{markdown}");
    // Different seeds, different targets; the same seed, the same.
    let ur5 = Arm::from_name("ur5").unwrap();
    let few = Settings { n: 5, ..settings };
    let targets = |s: &Settings| run(&ur5, s, || {}).unwrap().iter().map(|r| r.target).collect::<Vec<_>>();
    assert_eq!(targets(&few), targets(&few));
    assert_ne!(targets(&few), targets(&Settings { seed: 18, ..few }));
}

#[test]
fn arms_that_do_not_fit_say_why() {
    let panda = Arm::from_name("panda").unwrap();
    let few = Settings { n: 1, ..Settings::default() };
    let reason = |arm: Arm| run(&arm, &few, || {}).unwrap_err().to_string();
    let wrong_tip = reason(Arm { tip: "panda_link9".into(), ..panda.clone() });
    assert!(wrong_tip.contains("panda_link9") && wrong_tip.contains("did you mean"), "{wrong_tip}");
    let upside_down = reason(Arm { base: "panda_link8".into(), tip: "panda_link0".into(), ..panda.clone() });
    assert!(upside_down.contains("does not lie above"), "{upside_down}");
    let still = reason(Arm { base: "panda_link8".into(), tip: "panda_hand_tcp".into(), ..panda.clone() });
    assert!(still.contains("nothing moves"), "{still}");
    let no_file = reason(Arm { rig: "none.urdf".into(), ..panda });
    assert!(no_file.contains("none.urdf"), "{no_file}");
    let unknown = Arm::from_name("pandu").unwrap_err().to_string();
    assert!(unknown.contains("panda, ur5, xarm7, g1"), "{unknown}");
}
