//! What the paper reports in its tables 2 to 4, to stand beside our rows.

use crate::paper::task::Task;

/// Mean and standard deviation.
pub(crate) type Spread = (f64, f64);

/// A row of the paper's tables.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Published {
    /// The authors' name for it.
    pub(crate) name: &'static str,
    pub(crate) time_ms: Spread,
    pub(crate) iterations: Spread,
    pub(crate) time_per_iteration_ms: Spread,
    pub(crate) success_percent: Spread,
}

const fn row(
    name: &'static str,
    time_ms: Spread,
    iterations: Spread,
    time_per_iteration_ms: Spread,
    success_percent: Spread,
) -> Published {
    Published { name, time_ms, iterations, time_per_iteration_ms, success_percent }
}

/// Table 2, its rows of the simple and of the combined task.
const TABLE_2: [[Published; 4]; 2] = [
    [
        row("TensorFlow", (8.06, 3.38), (36.99, 17.52), (0.22, 0.02), (100.0, 0.0)),
        row("CCD", (25.44, 62.61), (53.57, 139.19), (0.69, 0.27), (91.19, 28.34)),
        row("FABRIK", (85.28, 26.92), (453.38, 144.18), (0.23, 0.16), (96.12, 29.47)),
        row("IPOPT", (164.73, 132.25), (13.24, 3.30), (12.41, 8.97), (99.80, 4.47)),
    ],
    [
        row("TensorFlow", (43.55, 30.03), (67.40, 46.00), (0.65, 0.10), (99.60, 6.32)),
        row("CCD", (570.49, 54.95), (496.11, 43.27), (1.15, 0.08), (0.80, 8.91)),
        row("FABRIK", (439.90, 40.93), (496.08, 43.69), (0.89, 0.05), (0.80, 8.91)),
        row("IPOPT", (2759.28, 8045.75), (44.52, 88.44), (45.31, 17.13), (96.50, 18.39)),
    ],
];

/// The paper's row for a contender: its own solver (TensorFlow) for `lm-local` and `adam`. `lm` with restarts
/// has no counterpart there.
pub(crate) fn published(task: Task, contender: &str) -> Option<&'static Published> {
    let rows = &TABLE_2[usize::from(task == Task::Combined)];
    match contender {
        "lm-local" | "adam" => Some(&rows[0]),
        "ccd" => Some(&rows[1]),
        "fabrik" => Some(&rows[2]),
        "ipopt" => Some(&rows[3]),
        _ => None,
    }
}
