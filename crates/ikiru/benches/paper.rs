//! The paper's two tasks: mean time of one target, cold from the rest pose, restarts included, one thread.
#![allow(
    missing_docs,
    clippy::expect_used,
    reason = "a bench: its macros make undocumented items, and a bench that cannot start ends"
)]

use std::time::Instant;

use criterion::{Criterion, criterion_group, criterion_main};
use ikiru::glam::DVec3;
use ikiru::scenario::Scenario;

fn targets(name: &str) -> Vec<DVec3> {
    let path = format!("{}/../ikiru-eval/targets/{name}.json", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read(path).expect("the target sets lie in crates/ikiru-eval/targets");
    let points: Vec<[f64; 3]> = serde_json::from_slice(&text).expect("a list of points");
    points.into_iter().map(DVec3::from).collect()
}

fn bench(c: &mut Criterion) {
    for (task, set) in
        [("paper_simple", "reachable"), ("paper_simple", "simple_box"), ("paper_combined", "combined_box")]
    {
        let path = format!("{}/../../scenarios/{task}.toml", env!("CARGO_MANIFEST_DIR"));
        let mut scenario = Scenario::read(path).expect("the scenario ships");
        let mut workspace = scenario.workspace();
        let targets = targets(set);
        let mut pose = scenario.start.clone();
        let mut next = 0;
        c.bench_function(&format!("{task} on {set}"), |b| {
            // One target after the other, round and round, so that the mean is that of the whole set.
            b.iter_custom(|n| {
                let start = Instant::now();
                for _ in 0..n {
                    scenario.set_target(0, targets[next % targets.len()]).expect("a position");
                    pose.clone_from(&scenario.start);
                    std::hint::black_box(scenario.solve(&mut pose, &mut workspace));
                    next += 1;
                }
                start.elapsed()
            });
        });
    }
}

criterion_group!(benches, bench);
criterion_main!(benches);
