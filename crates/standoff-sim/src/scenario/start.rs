//! Where the UAVs start: as listed, or on a ring about the targets that are there first.

use standoff::{Angle, Displacement, Position, Spread, TeamParams, UavState};

use super::Targets;
use super::file::{ScenarioFile, UavAt};
use super::number::value;

/// The UAVs' first states; a ring is spelt out in the file as `[[uavs.at]]`.
pub(super) fn uavs(file: &mut ScenarioFile, team: &TeamParams, targets: &Targets) -> Vec<UavState> {
    if file.uavs.at.is_empty() {
        file.uavs.at = ring(file, team, targets);
        file.uavs.ring = None;
    }
    let states = file.uavs.at.iter().map(|at| UavState {
        position: Position::from_m(value(&at.x_m), value(&at.y_m)),
        heading: Angle::from_deg(value(&at.heading_deg)),
        speed_m_s: value(&at.speed_m_s),
        turn_rate_rad_s: 0.0,
    });
    states.collect()
}

fn ring(file: &ScenarioFile, team: &TeamParams, targets: &Targets) -> Vec<UavAt> {
    let (centre, standoff_m) = first_orbit(&first_positions(targets), team);
    let ring = file.uavs.ring.clone().unwrap_or_default();
    let radius_m = ring.radius_m.as_ref().map_or(standoff_m, value);
    let first = Angle::from_deg(ring.phase_deg.as_ref().map_or(0.0, value));
    let count = file.uavs.count.as_ref().map_or(1.0, value) as u32;
    let even_deg = match count {
        2 => team.guidance.separation_rad.to_degrees(),
        _ => 360.0 / f64::from(count),
    };
    let spacing_deg = ring.spacing_deg.as_ref().map_or(even_deg, value);
    let at = |index: u32| {
        let phase = first + Angle::from_deg(f64::from(index) * spacing_deg);
        let position = centre + Displacement::from_polar(radius_m, phase);
        let along = phase + Angle::from_deg(90.0 * team.guidance.sense.sign());
        UavAt {
            x_m: position.x_m().into(),
            y_m: position.y_m().into(),
            heading_deg: along.deg().into(),
            speed_m_s: team.uav.speed_m_s.into(),
        }
    };
    (0..count).map(at).collect()
}

fn first_positions(targets: &Targets) -> Vec<Position> {
    match targets {
        Targets::Random { start, .. } => start.iter().map(|state| state.position()).collect(),
        Targets::Traffic(traffic) => traffic
            .vehicles
            .iter()
            .filter_map(|vehicle| vehicle.at(traffic.begin_us))
            .map(|state| Position::from_m(state.x_m, state.y_m))
            .collect(),
    }
}

/// Centre and radius of an orbit that holds as many of the positions as fit: the furthest is left out until the rest
/// does.
fn first_orbit(positions: &[Position], team: &TeamParams) -> (Position, f64) {
    let mut kept = positions.to_vec();
    loop {
        let n = kept.len().max(1) as f64;
        let sum = kept.iter().fold((0.0, 0.0), |(x, y), p| (x + p.x_m(), y + p.y_m()));
        let centre = Position::from_m(sum.0 / n, sum.1 / n);
        let furthest = kept
            .iter()
            .enumerate()
            .map(|(index, position)| (index, position.distance_m(centre)))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        let spread = Spread { distance_m: furthest.map_or(0.0, |(_, distance_m)| distance_m), rate_m_s: 0.0 };
        let standoff = team.group.standoff.distance(spread, 0.0);
        match furthest {
            Some((index, _)) if standoff.unclamped_m > team.group.standoff.radius_max_m && kept.len() > 1 => {
                kept.remove(index);
            }
            _ => return (centre, standoff.distance_m),
        }
    }
}
