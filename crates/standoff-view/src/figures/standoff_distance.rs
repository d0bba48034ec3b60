//! Figure `standoff_distance`: how far each UAV is from its group's centre, and from its orbit.

use super::Setup;
use super::chart::{Drawn, Line, MOST_NAMED, ink, level, of_uavs, over_time, range, share};
use super::gather::Run;

/// Draws the figure.
pub(super) fn draw(run: &Run, setup: &Setup) -> Drawn<String> {
    let points = share(4 * run.groups.len());
    let mut lines = Vec::new();
    for (rank, (&id, group)) in run.groups.iter().enumerate() {
        let label = |text: &str| (2 * rank < MOST_NAMED).then(|| format!("{text}, group {id}"));
        let (thin, thick) = (ink(run.group_colour(id), 1.0), ink(run.group_colour(id), 2.5));
        lines.push(Line { runs: group.unclamped.runs(points), ink: thin, dashed: true, label: label("unbounded") });
        lines.push(Line { runs: group.standoff.runs(points), ink: thick, dashed: false, label: label("desired") });
    }
    lines.extend(of_uavs(run, 1.25, true, |uav| &uav.distance));
    // A bound far from anything flown would only flatten the curves.
    let flown = range(lines.iter().flat_map(|line| line.runs.iter().flatten()).map(|at| at.1), 1.0, 0.1);
    for (value, label) in [(setup.radius_min_m, "smallest allowed"), (setup.radius_max_m, "largest allowed")] {
        lines.extend(flown.contains(&value).then(|| level(run, value, Some(label))));
    }
    let mut errors = vec![level(run, 0.0, None)];
    errors.extend(of_uavs(run, 1.25, false, |uav| &uav.error));
    let panels = [("Distance to centre (m)", None, lines), ("Distance − desired (m)", None, errors)];
    over_time(run, "Distance of each UAV to the centre of its group", &setup.title, panels)
}
