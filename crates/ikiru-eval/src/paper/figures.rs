//! The figures: times on a log axis, success, and how the cost falls over iterations.

use std::path::{Path, PathBuf};

use ikiru_scenario::Scenario;
use ikiru_solve::{Solver, SolverOptions};
use plotters::prelude::*;

use crate::chart::{Area, COLOURS, Drawn, FONT, Figure, save};
use crate::error::Error;
use crate::paper::contenders::Contender;
use crate::paper::published::published;
use crate::paper::run::{Row, set_target};
use crate::paper::targets::TargetSet;
use crate::paper::task::{COST_BELOW, Task};
use crate::statistics::quantile;

/// How many targets the curves of the cost are the median of.
const SAMPLE: usize = 100;
/// Up to where those curves go.
const MOST_ITERATIONS: usize = 100;

/// Draws three figures of one task into a folder, as SVG and PNG: the files that were written.
///
/// # Errors
/// A file that cannot be written.
pub fn write_figures(
    task: Task,
    scenario: &mut Scenario,
    set: &TargetSet,
    contenders: &[Contender],
    rows: &[Row],
    folder: &Path,
) -> Result<Vec<PathBuf>, Error> {
    let methods: Vec<Method> = contenders.iter().map(|c| Method::new(task, c.name, rows)).collect();
    let title = |what: &str| format!("{what}, {} objective on {}", task.name(), set.name);
    let times = Times { title: title("Solving time"), methods: &methods };
    let success = Success { title: title("Success"), methods: &methods };
    // From one start `lm` is `lm-local`: one line for both.
    let is_twin = |c: &&Contender| {
        contenders
            .iter()
            .any(|other| other.name != c.name && other.options(0) == c.options(0) && c.has_restarts)
    };
    let curves =
        contenders.iter().filter(|c| !is_twin(c)).map(|c| (c.name, curve(scenario, set, c))).collect();
    let costs = Costs { title: title("Cost over iterations, one start (median)"), curves };
    let stem = |what: &str| format!("{}_{what}", task.name());
    let mut written = Vec::new();
    written.extend(save(&times, folder, &stem("times"))?);
    written.extend(save(&success, folder, &stem("success"))?);
    written.extend(save(&costs, folder, &stem("costs"))?);
    Ok(written)
}

/// What the figures show of one method.
#[derive(Debug)]
struct Method {
    name: &'static str,
    /// Microseconds, sorted.
    times: Vec<f64>,
    success_percent: f64,
    /// The paper's mean time in microseconds, and its success in percent.
    paper: Option<(f64, f64)>,
}

impl Method {
    fn new(task: Task, name: &'static str, rows: &[Row]) -> Self {
        let rows: Vec<&Row> = rows.iter().filter(|r| r.method == name).collect();
        let mut times: Vec<f64> = rows.iter().map(|r| r.time_us).collect();
        times.sort_unstable_by(f64::total_cmp);
        let successes = rows.iter().filter(|r| r.success).count();
        Self {
            name,
            times,
            success_percent: 100.0 * successes as f64 / rows.len().max(1) as f64,
            paper: published(task, 0, name).map(|p| (1e3 * p.time_ms.0, p.success_percent.0)),
        }
    }
}

/// The median cost after each number of iterations, over some targets, from one start. Solves repeat
/// themselves, so that a solve of k iterations is the head of a longer one.
fn curve(scenario: &mut Scenario, set: &TargetSet, contender: &Contender) -> Vec<(f64, f64)> {
    let every = (set.points.len() / SAMPLE).max(1);
    let targets: Vec<_> = set.points.iter().step_by(every).copied().collect();
    let mut points = Vec::new();
    let mut step = 1;
    let mut max_iterations = 0;
    while max_iterations <= MOST_ITERATIONS {
        let options = SolverOptions { max_iterations, ..contender.options(0) };
        let solver = Solver::new(options);
        let mut workspace = solver.workspace(&scenario.problem);
        let mut costs = Vec::with_capacity(targets.len());
        for &target in &targets {
            set_target(scenario, target);
            let mut pose = scenario.start.clone();
            costs.push(solver.solve(&scenario.problem, &mut pose, &mut workspace).cost);
        }
        costs.sort_unstable_by(f64::total_cmp);
        points.push((max_iterations as f64, quantile(&costs, 0.5)));
        if max_iterations >= 20 {
            step = 5;
        }
        max_iterations += step;
    }
    points
}

/// Boxes of the times of each method on a log axis, and the paper's means.
#[derive(Debug)]
struct Times<'a> {
    title: String,
    methods: &'a [Method],
}

const MARGIN: u32 = 12;
const CAPTION: u32 = 20;
const LABEL: u32 = 15;

impl Figure for Times<'_> {
    fn size(&self) -> (u32, u32) {
        (820, 420)
    }

    fn draw<B: DrawingBackend>(&self, area: &Area<B>) -> Drawn<B> {
        let values = self
            .methods
            .iter()
            .flat_map(|m| [quantile(&m.times, 0.05), quantile(&m.times, 0.95), m.paper.map_or(1.0, |p| p.0)]);
        let (low, high) =
            values.filter(|v| *v > 0.0).fold((1.0_f64, 1e3_f64), |(l, h), v| (l.min(v), h.max(v)));
        let n = self.methods.len() as f64;
        let mut chart = ChartBuilder::on(area)
            .caption(&self.title, (FONT, CAPTION))
            .margin(MARGIN)
            .x_label_area_size(34)
            .y_label_area_size(70)
            .build_cartesian_2d(0.0..n, (low * 0.7..high * 2.0).log_scale())?;
        let names = |x: &f64| self.methods.get(x.floor() as usize).map_or("", |m| m.name).to_owned();
        chart
            .configure_mesh()
            .disable_x_mesh()
            .x_labels(self.methods.len() + 1)
            .x_label_offset(((820 - 100) as f64 / n / 2.0) as i32)
            .x_label_formatter(&names)
            .x_label_style((FONT, LABEL))
            .y_label_formatter(&|us| time_text(*us))
            .y_label_style((FONT, LABEL))
            .light_line_style(WHITE)
            .draw()?;
        for (idx, m) in self.methods.iter().enumerate() {
            let (x, colour) = (idx as f64, COLOURS[idx % COLOURS.len()]);
            let q = |part| quantile(&m.times, part).max(1e-3);
            let line = |a, b| PathElement::new(vec![a, b], colour.stroke_width(2));
            chart.draw_series([line((x + 0.5, q(0.05)), (x + 0.5, q(0.95)))])?;
            let corners = [(x + 0.3, q(0.25)), (x + 0.7, q(0.75))];
            chart.draw_series([Rectangle::new(corners, WHITE.filled())])?;
            chart.draw_series([Rectangle::new(corners, colour.mix(0.35).filled())])?;
            chart.draw_series([line((x + 0.3, q(0.5)), (x + 0.7, q(0.5)))])?;
            if let Some((mean, _)) = m.paper {
                chart.draw_series([Cross::new((x + 0.5, mean), 5, BLACK.stroke_width(2))])?;
            }
        }
        let note = "box: half of all solves, line: 90 %, x: mean of the paper's counterpart on its machine";
        area.draw_text(note, &(FONT, 13).into_text_style(area), (80, 400))
    }
}

fn time_text(us: f64) -> String {
    match us {
        us if us >= 1e6 => format!("{} s", us / 1e6),
        us if us >= 1e3 => format!("{} ms", us / 1e3),
        us => format!("{us} µs"),
    }
}

/// Bars of success, and the paper's.
#[derive(Debug)]
struct Success<'a> {
    title: String,
    methods: &'a [Method],
}

impl Figure for Success<'_> {
    fn size(&self) -> (u32, u32) {
        (820, 360)
    }

    fn draw<B: DrawingBackend>(&self, area: &Area<B>) -> Drawn<B> {
        let n = self.methods.len() as f64;
        let mut chart = ChartBuilder::on(area)
            .caption(&self.title, (FONT, CAPTION))
            .margin(MARGIN)
            .x_label_area_size(34)
            .y_label_area_size(60)
            .build_cartesian_2d(0.0..n, 0.0..112.0)?;
        let names = |x: &f64| self.methods.get(x.floor() as usize).map_or("", |m| m.name).to_owned();
        chart
            .configure_mesh()
            .disable_x_mesh()
            .x_labels(self.methods.len() + 1)
            .x_label_offset(((820 - 90) as f64 / n / 2.0) as i32)
            .x_label_formatter(&names)
            .x_label_style((FONT, LABEL))
            .y_label_formatter(&|v| format!("{v:.0} %"))
            .y_label_style((FONT, LABEL))
            .light_line_style(WHITE)
            .draw()?;
        for (idx, m) in self.methods.iter().enumerate() {
            let (x, colour) = (idx as f64, COLOURS[idx % COLOURS.len()]);
            let bar = [(x + 0.25, 0.0), (x + 0.75, m.success_percent)];
            chart.draw_series([Rectangle::new(bar, colour.mix(0.6).filled())])?;
            let text = format!("{:.1}", m.success_percent);
            let style = (FONT, LABEL).into_text_style(area);
            chart.draw_series([Text::new(text, (x + 0.4, m.success_percent + 7.0), style)])?;
            if let Some((_, percent)) = m.paper {
                chart.draw_series([Cross::new((x + 0.5, percent), 5, BLACK.stroke_width(2))])?;
            }
        }
        area.draw_text(
            "x: the paper's counterpart, on its own targets",
            &(FONT, 13).into_text_style(area),
            (70, 338),
        )
    }
}

/// Lines of the median cost.
#[derive(Debug)]
struct Costs {
    title: String,
    curves: Vec<(&'static str, Vec<(f64, f64)>)>,
}

impl Figure for Costs {
    fn size(&self) -> (u32, u32) {
        (820, 460)
    }

    fn draw<B: DrawingBackend>(&self, area: &Area<B>) -> Drawn<B> {
        let least = 1e-4;
        let costs = self.curves.iter().flat_map(|c| &c.1).map(|p| p.1);
        let most = costs.fold(0.1, f64::max) * 1.5;
        let mut chart = ChartBuilder::on(area)
            .caption(&self.title, (FONT, CAPTION))
            .margin(MARGIN)
            .x_label_area_size(40)
            .y_label_area_size(70)
            .build_cartesian_2d(0.0..MOST_ITERATIONS as f64, (least..most).log_scale())?;
        chart
            .configure_mesh()
            .x_desc("iterations")
            .x_label_formatter(&|x| format!("{x:.0}"))
            .y_label_formatter(&|y| format!("{y}"))
            .label_style((FONT, LABEL))
            .axis_desc_style((FONT, LABEL))
            .light_line_style(WHITE)
            .draw()?;
        let bar = [(0.0, COST_BELOW), (MOST_ITERATIONS as f64, COST_BELOW)];
        chart
            .draw_series(DashedLineSeries::new(bar, 6, 4, BLACK.mix(0.6).into()))?
            .label("success")
            .legend(|(x, y)| PathElement::new([(x, y), (x + 18, y)], BLACK.mix(0.6)));
        for (idx, (name, points)) in self.curves.iter().enumerate() {
            let colour = COLOURS[idx % COLOURS.len()];
            let points = points.iter().map(|(x, y)| (*x, y.max(least)));
            chart
                .draw_series(LineSeries::new(points, colour.stroke_width(2)))?
                .label(*name)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .label_font((FONT, LABEL))
            .background_style(WHITE.mix(0.85))
            .border_style(BLACK.mix(0.3))
            .draw()
    }
}
