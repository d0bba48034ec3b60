//! Observation of a UAV for the policy: features of the team state at the current time step, scaled to similar ranges.
//! It contains no ground truth.

use standoff::math;
use standoff::math::TAU;
use standoff::{Angle, Covariance, TeamParams, UavParams};
use standoff_record::{Frame, GroupRow, TrackRow, UavRow};

/// Name, bounds and description of one feature.
pub(super) struct Feature {
    pub(super) name: &'static str,
    pub(super) low: f32,
    pub(super) high: f32,
    pub(super) meaning: &'static str,
}

const fn feature(name: &'static str, (low, high): (f32, f32), meaning: &'static str) -> Feature {
    Feature { name, low, high, meaning }
}

const SHARE: (f32, f32) = (0.0, 1.0);
const SIGNED: (f32, f32) = (-1.0, 1.0);

/// Features of a UAV's observation, in order. Without a group, those from `off_orbit` to `nearest_uav` are 0 unless
/// their description states another value. Values are clipped to the bounds.
pub(super) const FEATURES: [Feature; 19] = [
    feature("speed", SIGNED, "own speed minus nominal speed, in speed_change_max_m_s; 0 if that is 0"),
    feature("turn_rate", SIGNED, "own turn rate, positive anticlockwise, in turn_rate_max_rad_s"),
    feature("sensor_pointed", SHARE, "1 if the sensor is pointed, otherwise 0"),
    feature("has_group", SHARE, "1 if assigned to a group, otherwise 0"),
    feature(
        "off_orbit",
        (-1.0, 4.0),
        "(r - r_d) / r_d, with distance r from the estimated centre of its group and standoff distance r_d",
    ),
    feature("centre_ahead", SIGNED, "cosine of the direction to the centre, relative to own heading"),
    feature("centre_left", SIGNED, "sine of the direction to the centre, relative to own heading; positive: left"),
    feature("centre_velocity_ahead", (-2.0, 2.0), "velocity of the centre along own heading, in nominal speeds"),
    feature("centre_velocity_left", (-2.0, 2.0), "velocity of the centre to the left, in nominal speeds"),
    feature("standoff_distance", SHARE, "r_d of its group, in radius_max_m"),
    feature("standoff_rate", SIGNED, "rate of change of r_d, in nominal speeds"),
    feature("spread", SHARE, "distance from the centre to the furthest member, in radius_max_m"),
    feature("uncertainty", SHARE, "largest position standard deviation of a group member, in radius_min_m"),
    feature("members", SHARE, "fraction of the targets with a live track that are members of its group"),
    feature("gap_ahead", SHARE, "phase difference to the next UAV ahead on the orbit, in turns; 1 if alone"),
    feature("gap_behind", SHARE, "phase difference to the next UAV behind on the orbit, in turns; 1 if alone"),
    feature("nearest_uav", SHARE, "distance to the nearest other UAV of its group, in radius_max_m; 1 if alone"),
    feature("ungrouped", SHARE, "fraction of the targets with a live track that are in no group"),
    feature("lost", SHARE, "fraction of the targets that once had a live track but have none now"),
];

/// Number of features of a UAV's observation.
pub(super) const LENGTH: usize = FEATURES.len();

/// Appends the observation of each UAV of a frame. `ever_known`: number of live tracks so far.
pub(super) fn of(frame: &Frame, ever_known: usize, team: &TeamParams, observations: &mut Vec<f32>) {
    let live = frame.tracks.len();
    let share = |part: usize, of: usize| if of > 0 { part as f64 / of as f64 } else { 0.0 };
    let is_ungrouped = |track: &&TrackRow| track.group.is_none() && track.receiving_group.is_none();
    let ungrouped = share(frame.tracks.iter().filter(is_ungrouped).count(), live);
    let lost = share(ever_known.saturating_sub(live), ever_known);
    for uav in &frame.uavs {
        let group = frame.groups.iter().find(|group| Some(group.group) == uav.group);
        let of_orbit = group.map_or(ALONE, |group| of_orbit(frame, uav, group, team));
        let own = [
            speed_change(uav.speed_m_s, &team.uav),
            uav.turn_rate_rad_s / team.uav.turn_rate_max_rad_s,
            f64::from(uav.boresight_rad.is_some()),
            f64::from(group.is_some()),
        ];
        let numbers = own.into_iter().chain(of_orbit).chain([ungrouped, lost]).zip(&FEATURES);
        observations.extend(numbers.map(|(number, Feature { low, high, .. })| (number as f32).clamp(*low, *high)));
    }
}

/// Difference from the nominal speed, as a fraction of the allowed speed change; 0 if no change is allowed.
pub(super) fn speed_change(speed_m_s: f64, uav: &UavParams) -> f64 {
    let change_m_s = uav.speed_change_max_m_s;
    if change_m_s > 0.0 { (speed_m_s - uav.speed_m_s) / change_m_s } else { 0.0 }
}

/// Orbit features of a UAV without a group.
const ALONE: [f64; LENGTH - 6] = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0];

/// Orbit features of a UAV in a group.
fn of_orbit(frame: &Frame, uav: &UavRow, group: &GroupRow, team: &TeamParams) -> [f64; LENGTH - 6] {
    let (sin, cos) = math::sin_cos(uav.heading_rad);
    let to_own_axes = |x: f64, y: f64| (cos * x + sin * y, cos * y - sin * x);
    let (ahead_m, left_m) = to_own_axes(group.x_m - uav.x_m, group.y_m - uav.y_m);
    let (ahead_m_s, left_m_s) = to_own_axes(group.vx_m_s, group.vy_m_s);
    let centre_distance_m = (ahead_m * ahead_m + left_m * left_m).sqrt();
    let along = |part_m: f64| if centre_distance_m > 0.0 { part_m / centre_distance_m } else { 0.0 };
    let (standoff, nominal_m_s) = (&team.group.standoff, team.uav.speed_m_s);
    let standoff_distance_m = group.standoff_distance_m;
    let members = frame.tracks.iter().filter(|track| [track.group, track.receiving_group].contains(&uav.group));
    let sd_m = |track: &TrackRow| Covariance::from_upper_triangle(&track.covariance).position_sd_max_m();
    let sd_max_m = members.map(sd_m).fold(0.0, f64::max);
    let teammates = || frame.uavs.iter().filter(|teammate| teammate.group == uav.group && teammate.uav != uav.uav);
    let direction = team.guidance.orbit_direction.sign();
    let gap = |sign: f64| {
        let gaps = teammates().filter_map(|teammate| Some(turns(sign * (teammate.phase_rad? - uav.phase_rad?))));
        gaps.fold(1.0, f64::min)
    };
    let squared_m2 = |teammate: &UavRow| {
        let (x_m, y_m) = (teammate.x_m - uav.x_m, teammate.y_m - uav.y_m);
        x_m * x_m + y_m * y_m
    };
    let nearest_m = teammates().map(squared_m2).reduce(f64::min).map_or(standoff.radius_max_m, f64::sqrt);
    [
        (centre_distance_m - standoff_distance_m) / standoff_distance_m,
        along(ahead_m),
        along(left_m),
        ahead_m_s / nominal_m_s,
        left_m_s / nominal_m_s,
        standoff_distance_m / standoff.radius_max_m,
        group.standoff_rate_m_s / nominal_m_s,
        group.spread_m / standoff.radius_max_m,
        sd_max_m / standoff.radius_min_m,
        f64::from(group.members) / frame.tracks.len().max(1) as f64,
        gap(direction),
        gap(-direction),
        nearest_m / standoff.radius_max_m,
    ]
}

/// Converts an angle to a fraction of a turn, 0 to 1.
fn turns(angle_rad: f64) -> f64 {
    let wrapped_rad = Angle::from_rad(angle_rad).rad();
    (if wrapped_rad < 0.0 { wrapped_rad + TAU } else { wrapped_rad }) / TAU
}
