//! Figure `standoff_distance`: how far each UAV is from its group's centre, and from its orbit.

use super::chart::{Drawn, Line, Panel, of_uavs, per_group};
use super::curve::{MOST_POINTS, range};
use super::figure::Setup;
use super::gather::{Group, Run};
use super::ink::ink;

/// Draws the figure.
pub(super) fn draw(run: &Run, setup: &Setup) -> Drawn<Option<String>> {
    let panel = |id: u32, group: &Group| {
        let (thin, thick) = (ink(run.group_colour(id), 1.0), ink(run.group_colour(id), 2.5));
        let (mut unbounded, desired) = (group.unclamped.runs(MOST_POINTS), group.standoff.runs(MOST_POINTS));
        // The printed margin (16) runs to kilometres where members change: what is flown would be a flat line.
        let cut_m = 1.3 * setup.radius_max_m;
        unbounded.iter_mut().flatten().for_each(|at| at.1 = at.1.min(cut_m));
        let label = |text: &str| Some(format!("{text}, group {id}"));
        let mut lines = vec![
            Line {
                dashed: true,
                label: label(&format!("unbounded, up to {cut_m:.0} m")),
                ..Line::new(unbounded, thin)
            },
            Line { label: label("desired"), ..Line::new(desired, thick) },
        ];
        lines.extend(of_uavs(run, 1.25, group.distances.iter().map(|(&uav, curve)| (uav, curve))));
        // A bound far from anything flown would only flatten the curves.
        let flown = range(lines.iter().flat_map(|line| line.runs.iter().flatten()).map(|at| at.1), 1.0, 0.1);
        let bounds = [(setup.radius_min_m, "smallest allowed"), (setup.radius_max_m, "largest allowed")];
        let near = bounds.into_iter().filter(|(value, _)| flown.contains(value));
        Panel {
            axis: run.axis("Distance to centre", id, "m"),
            lines,
            levels: near.map(|(value, label)| (value, Some(label.to_owned()))).collect(),
            marks: group.marks(),
            ..Panel::default()
        }
    };
    let errors = Panel {
        axis: "Distance − desired (m)".to_owned(),
        lines: of_uavs(run, 1.25, run.each(|uav| &uav.error)),
        levels: vec![(0.0, None)],
        ..Panel::default()
    };
    per_group(run, "Distance of each UAV to the centre of its group", &setup.title, panel, Some(errors))
}
