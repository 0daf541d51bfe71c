//! Target sets by the paper's protocol: sampled in a cube, kept where a method solves them, thinned by k-means.

use glam::DVec3;
use ikiru_scenario::Scenario;
use ikiru_solve::Solver;
use linfa::DatasetBase;
use linfa::traits::Fit;
use linfa_clustering::KMeans;
use ndarray::Array2;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::error::Error;
use crate::paper::contenders::Contender;
use crate::paper::run::set_target;
use crate::paper::targets::TargetSet;
use crate::paper::task::Task;

/// How many targets a set has: ten to warm up with, and a thousand.
pub const N_TARGETS: usize = 1010;

/// The middle of the cube, and half its side (metres).
const MIDDLE: DVec3 = DVec3::new(0.15, 0.0, 0.35);
const HALF_SIDE: f64 = 0.5;

/// Rounds of k-means; the clusters only spread the targets evenly, so that few are enough.
const MOST_ROUNDS: u64 = 50;

/// Makes a set from `n` uniform points of the cube: those that `lm` with restarts or `adam` solves, thinned to
/// [`N_TARGETS`] by k-means, each centroid replaced by the nearest kept point. The same seed gives the same set.
/// `done` is called after each point.
///
/// # Errors
/// Too few points that can be solved.
pub fn sample(
    task: Task,
    scenario: &mut Scenario,
    n: usize,
    seed: u64,
    restarts: usize,
    mut done: impl FnMut(),
) -> Result<TargetSet, Error> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let judges = [Contender::from_name("lm")?, Contender::from_name("adam")?];
    let mut kept = Vec::new();
    for _ in 0..n {
        let unit = DVec3::new(random.r#gen(), random.r#gen(), random.r#gen());
        let point = MIDDLE + (unit * 2.0 - 1.0) * HALF_SIDE;
        set_target(scenario, point);
        let solves = |contender: &Contender| {
            let solver = Solver::new(contender.options(restarts));
            let mut pose = scenario.start.clone();
            solver.solve(&scenario.problem, &mut pose, &mut solver.workspace(&scenario.problem)).success
        };
        if judges.iter().any(solves) {
            kept.push(point);
        }
        done();
    }
    if kept.len() < N_TARGETS {
        // Half as many again as the same yield would need.
        let advice = n.max(100) * N_TARGETS * 3 / 2 / kept.len().max(1);
        return Err(Error::TooFewKept { sampled: n, kept: kept.len(), wanted: N_TARGETS, advice });
    }
    let points = nearest_to_centroids(&kept, N_TARGETS, random)?;
    Ok(TargetSet { name: format!("{}_sampled", task.name()), points })
}

/// `n` of the points, spread as the centroids of k-means are: for each centroid the nearest point that is left.
fn nearest_to_centroids(points: &[DVec3], n: usize, random: Xoshiro256PlusPlus) -> Result<Vec<DVec3>, Error> {
    let flat = points.iter().flat_map(|p| p.to_array()).collect();
    let array =
        Array2::from_shape_vec((points.len(), 3), flat).map_err(|e| Error::Clustering(e.to_string()))?;
    let model = KMeans::params_with_rng(n, random)
        .n_runs(1)
        .max_n_iterations(MOST_ROUNDS)
        // Rounds that only move centroids by millimetres do not have to settle.
        .tolerance(1e-3)
        .fit(&DatasetBase::from(array));
    let model = model.map_err(|e| Error::Clustering(e.to_string()))?;
    let centroids = model.centroids();
    let mut taken = vec![false; points.len()];
    let mut chosen = Vec::with_capacity(n);
    for centroid in centroids.rows() {
        let centroid = DVec3::new(centroid[0], centroid[1], centroid[2]);
        let nearest = (0..points.len()).filter(|i| !taken[*i]).min_by(|a, b| {
            points[*a].distance_squared(centroid).total_cmp(&points[*b].distance_squared(centroid))
        });
        if let Some(nearest) = nearest {
            taken[nearest] = true;
            chosen.push(points[nearest]);
        }
    }
    Ok(chosen)
}
