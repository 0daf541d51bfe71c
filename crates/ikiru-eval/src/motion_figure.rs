//! A motion as a figure: angles, speeds and jerk over time, and the way of an effector.

use std::ops::Range;
use std::path::Path;

use ikiru_rig::{Clip, JointId, Rate};
use plotters::prelude::*;

use crate::chart::{Area, COLOURS, Drawn, FONT, Figure, save_as};
use crate::error::Error;

/// At most so many lines get a name: more would hide the figure.
const MOST_NAMED: usize = 12;

/// Draws the motion of some joints into an `.svg` or `.png` file: by its ending.
///
/// # Errors
/// Another ending, or a file that cannot be written.
pub fn write_motion_figure(
    clip: &Clip,
    joints: &[JointId],
    effector: Option<JointId>,
    path: &Path,
) -> Result<(), Error> {
    save_as(&MotionFigure::new(clip, joints, effector), path)
}

/// Lines over time.
#[derive(Debug)]
struct Panel {
    title: String,
    lines: Vec<(String, Vec<(f64, f64)>)>,
}

#[derive(Debug)]
struct MotionFigure {
    end: f64,
    panels: Vec<Panel>,
}

const AXES: [&str; 6] = ["x", "y", "z", "x", "y", "z"];

impl MotionFigure {
    fn new(clip: &Clip, joints: &[JointId], effector: Option<JointId>) -> Self {
        let rig = clip.rig();
        let times = clip.times();
        // Degrees of freedom as tangents from the rest pose: angles of hinges and Euler joints, rotation vectors of balls.
        let rest = rig.rest_pose();
        let values: Vec<Vec<f64>> =
            clip.poses().iter().map(|p| rest.difference(p).unwrap_or_default()).collect();
        let dofs: Vec<(String, usize)> = joints
            .iter()
            .filter_map(|j| Some((rig.get(*j)?, rig.dofs_of(*j))))
            .flat_map(|(joint, dofs)| {
                let n = dofs.len();
                dofs.enumerate().map(move |(i, dof)| {
                    let axis = if n > 1 { format!(" {}", AXES[i % 6]) } else { String::new() };
                    (format!("{}{axis}", joint.name), dof)
                })
            })
            .collect();
        let angles = dofs.iter().map(|(name, dof)| {
            let points = times.iter().zip(&values).filter_map(|(t, v)| Some((*t, v.get(*dof)?.to_degrees())));
            (name.clone(), points.collect())
        });
        let mut panels = vec![Panel { title: "angles, degrees from rest".into(), lines: angles.collect() }];
        for (rate, title) in [(Rate::Speed, "speed, degrees/s"), (Rate::Jerk, "jerk, degrees/s³")] {
            let rates = clip.rates(rate);
            let lines = dofs.iter().map(|(name, dof)| {
                let points = rates.times().iter().zip(rates.of_dof(*dof)).map(|(t, v)| (*t, v.to_degrees()));
                (name.clone(), points.collect())
            });
            panels.push(Panel { title: title.into(), lines: lines.collect() });
        }
        if let Some((joint, id)) = effector.and_then(|id| Some((rig.get(id)?, id))) {
            let places: Vec<[f64; 3]> =
                clip.poses().iter().filter_map(|p| Some(p.frame(id).ok()?.position.to_array())).collect();
            let line = |axis: usize| {
                let points = times.iter().zip(&places).map(|(t, p)| (*t, p[axis])).collect();
                (AXES[axis].to_owned(), points)
            };
            let title = format!("place of {}, m", joint.name);
            panels.push(Panel { title, lines: (0..3).map(line).collect() });
        }
        Self { end: times.last().copied().unwrap_or(1.0).max(1e-9), panels }
    }
}

/// From the least to the greatest of some lines, with room around.
fn extent(lines: &[(String, Vec<(f64, f64)>)]) -> Range<f64> {
    let values = lines.iter().flat_map(|l| &l.1).map(|p| p.1);
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    if low > high {
        return -1.0..1.0;
    }
    let room = 0.08 * (high - low).max(1e-3);
    low - room..high + room
}

impl Figure for MotionFigure {
    fn size(&self) -> (u32, u32) {
        (900, 230 * self.panels.len() as u32)
    }

    fn draw<B: DrawingBackend>(&self, area: &Area<B>) -> Drawn<B> {
        for (panel, area) in self.panels.iter().zip(area.split_evenly((self.panels.len(), 1))) {
            let mut chart = ChartBuilder::on(&area)
                .caption(&panel.title, (FONT, 16))
                .margin(8)
                .margin_right(16)
                .x_label_area_size(26)
                .y_label_area_size(64)
                .build_cartesian_2d(0.0..self.end, extent(&panel.lines))?;
            chart
                .configure_mesh()
                .x_label_formatter(&|x| format!("{x:.2} s"))
                .y_labels(5)
                .label_style((FONT, 13))
                .light_line_style(WHITE)
                .draw()?;
            let is_named = panel.lines.len() <= MOST_NAMED;
            for (idx, (name, points)) in panel.lines.iter().enumerate() {
                let colour = COLOURS[idx % COLOURS.len()];
                // Where colours begin again, lines get thinner.
                let width = if idx < COLOURS.len() { 2 } else { 1 };
                let line = LineSeries::new(points.iter().copied(), colour.stroke_width(width));
                let series = chart.draw_series(line)?;
                if is_named {
                    series.label(name).legend(move |(x, y)| {
                        PathElement::new([(x, y), (x + 14, y)], colour.stroke_width(width))
                    });
                }
            }
            if is_named {
                chart
                    .configure_series_labels()
                    .position(SeriesLabelPosition::UpperLeft)
                    .label_font((FONT, 11))
                    .background_style(WHITE.mix(0.8))
                    .draw()?;
            }
        }
        Ok(())
    }
}
