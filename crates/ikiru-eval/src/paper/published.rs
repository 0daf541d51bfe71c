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

/// Tables 3 and 4 (and the text about them): the authors' own solver at 5 and at 10 points, of the simple and of the combined
/// task. There is no time per iteration.
const TABLES_3_AND_4: [[Published; 2]; 2] = [
    [
        row("TensorFlow", (17.12, 11.01), (83.01, 57.81), NONE, (99.30, 8.34)),
        row("TensorFlow", (21.16, 16.92), (102.65, 87.65), NONE, (97.40, 15.92)),
    ],
    [
        row("TensorFlow", (88.88, 77.82), (128.19, 113.24), NONE, (94.99, 21.80)),
        row("TensorFlow", (162.83, 125.96), (229.62, 178.41), NONE, (83.67, 44.04)),
    ],
];

/// Not published.
const NONE: Spread = (f64::NAN, f64::NAN);

/// The paper's row for a contender: its own solver (TensorFlow) for `lm-local` and `adam`. `lm` with restarts
/// has no counterpart there.
pub(crate) fn published(task: Task, points: usize, contender: &str) -> Option<&'static Published> {
    let task = usize::from(task == Task::Combined);
    match (contender, points) {
        ("lm-local" | "adam", 0) => Some(&TABLE_2[task][0]),
        ("lm-local" | "adam", 5) => Some(&TABLES_3_AND_4[task][0]),
        ("lm-local" | "adam", 10) => Some(&TABLES_3_AND_4[task][1]),
        ("ccd", 0) => Some(&TABLE_2[task][1]),
        ("fabrik", 0) => Some(&TABLE_2[task][2]),
        ("ipopt", 0) => Some(&TABLE_2[task][3]),
        _ => None,
    }
}
