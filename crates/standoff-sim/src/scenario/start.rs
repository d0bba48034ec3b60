//! Starts of the UAVs: as listed, on a ring about the initial targets, or on orbits about groups of the initial
//! targets.

use standoff::coordination::clustering::KMeans;
use standoff::coordination::clustering::group_count;
use standoff::guidance::standoff_distance::Spread;
use standoff::{Angle, Displacement, Position, TeamParams, UavId, UavState, Vertical};

use super::resolved::{Intruder, Targets};
use super::schema_types::{self, Ring, UavAt, Uavs, uav_of};

/// Returns the initial states of the UAVs; replaces the ring, or nothing, by `[[uavs.start]]`.
pub(super) fn states(uavs: &mut Uavs, team: &TeamParams, targets: &Targets) -> Vec<UavState> {
    let ring = uavs.start_ring.take();
    if uavs.start.is_empty() {
        let count = uavs.count as usize;
        let positions = first_positions(targets);
        uavs.start = match ring {
            Some(ring) => {
                let (centre, standoff_m) = first_orbit(&positions, team);
                on_ring(&ring, count, centre, standoff_m, team)
            }
            None => on_orbits(count, &positions, team),
        };
    }
    let states = uavs.start.iter().zip((0..).map(UavId)).map(|(at, id)| UavState {
        position: start_of(at),
        heading: Angle::from_deg(at.heading_deg),
        speed_m_s: at.speed_m_s,
        turn_rate_rad_s: 0.0,
        vertical: team.uav.climb.map(|_| {
            let altitude_m = at.altitude_m.unwrap_or_else(|| team.initial_altitude_m(id));
            Vertical { altitude_m, climb_rate_m_s: 0.0 }
        }),
    });
    states.collect()
}

/// Returns the intruders with their initial states; adds the starts that the user did not specify to the tables.
pub(super) fn intruders(typed: &mut [schema_types::Intruder], uavs: &[UavState], team: &TeamParams) -> Vec<Intruder> {
    let intruder = |intruder: &mut schema_types::Intruder| {
        let pursued_uav = intruder.pursued_uav.map(uav_of);
        let pursued = pursued_uav.and_then(|uav| uavs.get(uav.0 as usize));
        let from = pursued.map_or(Position::ORIGIN, |uav| uav.position);
        let distance_m = intruder.distance_m.take().unwrap_or(INTRUDER_FROM_M);
        let direction = Angle::from_deg(intruder.bearing_deg.take().unwrap_or(0.0));
        let away = from + Displacement::from_polar(distance_m, direction);
        let x_m = *intruder.x_m.get_or_insert(away.x_m());
        let position = Position::from_m(x_m, *intruder.y_m.get_or_insert(away.y_m()));
        let towards_uav = || pursued.map_or(0.0, |uav| (uav.position - position).direction().deg());
        let heading = Angle::from_deg(*intruder.heading_deg.get_or_insert_with(towards_uav));
        let lowest_m = || team.initial_altitude_m(UavId(0));
        let fixed_altitude_m = intruder.altitude_m.or_else(|| pursued.is_none().then(lowest_m));
        let altitude_m = fixed_altitude_m.or(pursued.and_then(|uav| uav.vertical).map(|vertical| vertical.altitude_m));
        let vertical = team.uav.climb.and(altitude_m).map(|altitude_m| Vertical { altitude_m, climb_rate_m_s: 0.0 });
        let turn_rate_rad_s = intruder.turn_rate_deg_s.unwrap_or(0.0).to_radians();
        Intruder {
            start: UavState { vertical, ..UavState::level_flight(position, heading, intruder.speed_m_s) },
            pursued_uav,
            turn_rate_rad_s,
            altitude_m: fixed_altitude_m,
            transponder_off_s: intruder
                .transponder_off
                .iter()
                .map(|silence| [silence.from_s, silence.until_s])
                .collect(),
        }
    };
    typed.iter_mut().map(intruder).collect()
}

/// Default distance between the start of an intruder and the start of the UAV that it pursues, m.
const INTRUDER_FROM_M: f64 = 1000.0;

/// Minimum distance between the starts of two UAVs, m.
const APART_M: f64 = 100.0;

/// Distributes the UAVs over orbits about the groups into which the targets' starts fall.
fn on_orbits(count: usize, positions: &[Position], team: &TeamParams) -> Vec<UavAt> {
    let groups = group_count(count, positions.len()).max(1);
    let mut clusters = KMeans::default();
    clusters.seed(positions, groups);
    let mut starts: Vec<UavAt> = Vec::new();
    for group in 0..groups {
        let members: Vec<Position> = positions
            .iter()
            .zip(&clusters.cluster_of)
            .filter(|(_, of)| **of == group)
            .map(|(position, _)| *position)
            .collect();
        let uavs_of_group = (group..count).step_by(groups).count();
        let (centre, mut radius_m) = first_orbit(&members, team);
        let mut number = 0;
        while number < uavs_of_group {
            let at = on_ring(&Ring::default(), uavs_of_group, centre, radius_m, team).swap_remove(number);
            // Orbits may cross: increase the radius until the start is free.
            if starts.iter().any(|other| start_of(other).squared_distance_m2(start_of(&at)) < APART_M * APART_M) {
                radius_m += APART_M;
            } else {
                starts.push(at);
                number += 1;
            }
        }
    }
    starts
}

fn start_of(at: &UavAt) -> Position {
    Position::from_m(at.x_m, at.y_m)
}

/// Places the UAVs on a ring about a centre; `standoff_m` is its radius unless the ring has one.
fn on_ring(ring: &Ring, count: usize, centre: Position, standoff_m: f64, team: &TeamParams) -> Vec<UavAt> {
    let radius_m = ring.radius_m.unwrap_or(standoff_m);
    let first = Angle::from_deg(ring.phase_deg.unwrap_or(0.0));
    let even_deg = match count {
        2 => team.guidance.desired_phase_rad.to_degrees(),
        _ => 360.0 / count as f64,
    };
    let spacing_deg = ring.spacing_deg.unwrap_or(even_deg);
    let at = |index: usize| {
        let phase = first + Angle::from_deg(index as f64 * spacing_deg);
        let position = centre + Displacement::from_polar(radius_m, phase);
        let along = phase + Angle::from_deg(90.0 * team.guidance.orbit_direction.sign());
        UavAt {
            x_m: position.x_m(),
            y_m: position.y_m(),
            heading_deg: along.deg(),
            speed_m_s: team.uav.speed_m_s,
            altitude_m: None,
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

/// Returns centre and radius of an orbit about as many of the positions as fit: the furthest is left out until the rest
/// fits.
fn first_orbit(positions: &[Position], team: &TeamParams) -> (Position, f64) {
    let mut covered = positions.to_vec();
    loop {
        let n = covered.len().max(1) as f64;
        let sum = covered.iter().fold((0.0, 0.0), |(x, y), p| (x + p.x_m(), y + p.y_m()));
        let centre = Position::from_m(sum.0 / n, sum.1 / n);
        let furthest = covered
            .iter()
            .enumerate()
            .map(|(index, position)| (index, position.distance_m(centre)))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        let spread = Spread { distance_m: furthest.map_or(0.0, |(_, distance_m)| distance_m), rate_m_s: 0.0 };
        let standoff = team.stationary_orbit_bounds().distance(spread, 0.0, &team.track.sensor);
        match furthest {
            Some((index, _)) if standoff.unclamped_m > team.group.standoff.radius_max_m && covered.len() > 1 => {
                covered.remove(index);
            }
            _ => return (centre, standoff.distance_m),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// For any number of UAVs and any positions of the targets, including all in one place.
    #[test]
    fn uavs_start_apart_from_each_other() {
        let at = |points: &[(f64, f64)]| points.iter().map(|(x, y)| Position::from_m(*x, *y)).collect::<Vec<_>>();
        let worlds = [at(&[]), at(&[(0.0, 0.0); 12]), at(&[(0.0, 0.0), (90.0, 5.0), (4000.0, 0.0), (30.0, 700.0)])];
        for (count, positions) in (1..=30).flat_map(|count| worlds.iter().map(move |positions| (count, positions))) {
            let starts: Vec<Position> =
                on_orbits(count, positions, &TeamParams::paper()).iter().map(start_of).collect();
            assert_eq!(starts.len(), count);
            for (index, one) in starts.iter().enumerate() {
                assert!(starts[..index].iter().all(|other| other.distance_m(*one) > 99.9), "{count} UAVs: {starts:?}");
            }
        }
    }
}
