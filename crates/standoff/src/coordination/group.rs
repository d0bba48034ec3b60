//! A group of targets: its estimated centre, and the orbit that keeps all members in view.

use nalgebra::{Matrix2, Vector6};

use crate::angle::Angle;
use crate::coordination::desired_centre::DesiredCentre;
use crate::coordination::event::EventKind;
use crate::coordination::group_centre::{Centroid, GroupCentre, mean_position_covariance, relative_covariance};
use crate::coordination::memberships::GroupedTrack;
use crate::coordination::spread::{furthest_from, margin_m};
use crate::frame::{Displacement, Position};
use crate::group_id::GroupId;
use crate::guidance::heading::{Orbit, OrbitRelativeState};
use crate::guidance::law::GroupOrbit;
use crate::guidance::orbit_motion::OrbitMotion;
use crate::guidance::standoff_distance::{self, Ramp, Spread, StandoffDistance};
use crate::math::TAU;
use crate::params::{CentreEstimate, CentreJump, GroupingParams, Margin, TeamParams};
use crate::safety::geofence::{Geofence, ZoneKind, ZoneSet};
use crate::target::Transition;
use crate::time::Duration;
use crate::tracking::estimate::Estimate;
use crate::tracking::track::TrackId;

/// A group and its orbit at one time step.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub struct Group {
    /// Id of the group.
    pub id: GroupId,
    /// Number of members, including those in handoff to or from the group.
    pub members: u32,
    /// Filtered centre.
    pub(crate) centre: GroupCentre,
    /// Member furthest from the centre.
    pub(crate) furthest_member: TrackId,
    /// Distance of the furthest member from the centre, and its rate.
    pub(crate) spread: Spread,
    /// Margin d_m that is added to the spread, m.
    pub(crate) margin_m: f64,
    /// Standoff distance r_d and its rate.
    pub standoff: StandoffDistance,
    /// Radius that the UAVs steer for (22).
    pub(crate) steered: Ramp,
    /// Smallest radius at which a UAV can turn around this centre, m; infinite if the centre is as fast as a UAV can
    /// fly.
    pub(crate) turn_limit_m: f64,
    /// Smallest radius that field of view, turn rate and r_d,min allow, m; infinite if the centre is as fast as a UAV
    /// can fly.
    pub(crate) radius_min_m: f64,
    /// Largest radius that r_d,max and the sensing range allow, m.
    pub(crate) radius_max_m: f64,
    /// Altitude of the orbit above the plane, m; different for each group, except with `AltitudePolicy::Common`.
    pub altitude_m: f64,
    /// Threshold of Lemma 3.1 for the UAV that follows best, m2/s; `None` without UAVs or if the centre is too fast.
    #[doc(alias = "xi_th")]
    pub(crate) threshold_m2_s: Option<f64>,
    /// Duration since the threshold fell below -xi_d.
    pub(crate) diverging_for: Duration,
    /// Duration since the centre became faster than the UAVs can fly.
    pub(crate) outrun_for: Duration,
    /// Smallest distance between two UAVs of the group, m.
    pub nearest_groupmate_m: Option<f64>,
    /// Number of members at the last assignment of UAVs.
    pub(crate) members_when_assigned: u32,
    /// Alerts that are active for the group as a whole.
    pub(crate) alarms: Alarms,
}

/// Values carried over from the last time step, if any.
#[derive(Debug, Clone, Copy, Default)]
struct SinceLastStep {
    /// Time since the last time step.
    dt: Duration,
    /// Motion of the orbit; its centre has been advanced already, its radius not yet.
    flown: Option<OrbitMotion>,
}

/// Active alerts of a group as a whole.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(into = "(u8, bool)", try_from = "(u8, bool)")]
pub(crate) struct Alarms {
    pub(crate) infeasible: bool,
    pub(crate) close: bool,
    pub(crate) blockage: Blockage,
}

/// How far zones block an orbit.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Blockage {
    #[default]
    Clear,
    Partly,
    Blocked,
}

/// Without zones, the encoding is the same as before zones existed.
impl From<Alarms> for (u8, bool) {
    fn from(alarms: Alarms) -> Self {
        (u8::from(alarms.infeasible) + 2 * alarms.blockage as u8, alarms.close)
    }
}

impl TryFrom<(u8, bool)> for Alarms {
    type Error = &'static str;

    fn try_from((bits, close): (u8, bool)) -> Result<Self, Self::Error> {
        let cut = match bits / 2 {
            0 => Blockage::Clear,
            1 => Blockage::Partly,
            2 => Blockage::Blocked,
            _ => return Err("invalid alarm bits"),
        };
        Ok(Self { infeasible: bits % 2 == 1, close, blockage: cut })
    }
}

impl Group {
    /// Radius r_d of the orbit, m.
    #[doc(alias = "r_d")]
    pub fn orbit_radius_m(&self) -> f64 {
        self.standoff.distance_m
    }

    /// State of the filtered centre, and its covariance.
    pub fn centre(&self) -> &Estimate {
        self.centre.estimate()
    }
}

/// State that records contain.
impl Group {
    /// Distance of the furthest member from the centre, and its rate.
    pub fn spread(&self) -> Spread {
        self.spread
    }

    /// Margin d_m that is added to the spread, m.
    pub fn margin_m(&self) -> f64 {
        self.margin_m
    }

    /// Smallest radius at which a UAV can turn around this centre, m; infinite if the centre is as fast as a UAV can
    /// fly.
    pub fn turn_limit_m(&self) -> f64 {
        self.turn_limit_m
    }

    /// Threshold of Lemma 3.1 for the UAV that follows best, m2/s; `None` without UAVs or if the centre is too fast.
    pub fn threshold_m2_s(&self) -> Option<f64> {
        self.threshold_m2_s
    }
}

impl Group {
    /// True if the orbit's numbers are possible.
    pub(crate) fn is_valid(&self) -> bool {
        let Self { spread, margin_m, standoff, steered, altitude_m, .. } = self;
        let numbers = [
            spread.distance_m,
            spread.rate_m_s,
            *margin_m,
            standoff.distance_m,
            standoff.rate_m_s,
            steered.radius_m,
            steered.rate_m_s,
            *altitude_m,
        ];
        self.centre.is_valid() && numbers.iter().all(|number| number.is_finite()) && standoff.distance_m > 0.0
    }

    /// Creates a group; `None` without members.
    pub(crate) fn create(
        id: GroupId,
        known: &[GroupedTrack],
        members: impl Iterator<Item = usize> + Clone,
        team: &TeamParams,
    ) -> Option<Self> {
        let centroid = Centroid::of(members.clone().map(|index| known[index].estimate()))?;
        let desired = DesiredCentre::of(team.group.centre, known, members.clone())?;
        let mut group = Self {
            id,
            members: centroid.members,
            centre: GroupCentre::start(&centroid.at(&desired.state))?,
            // The orbit is fitted below.
            furthest_member: TrackId(0),
            spread: Spread::default(),
            margin_m: 0.0,
            standoff: StandoffDistance::default(),
            steered: Ramp::default(),
            turn_limit_m: 0.0,
            radius_min_m: 0.0,
            radius_max_m: 0.0,
            altitude_m: team.group.altitude_lowest_m,
            threshold_m2_s: None,
            diverging_for: Duration::ZERO,
            outrun_for: Duration::ZERO,
            nearest_groupmate_m: None,
            members_when_assigned: 0,
            alarms: Alarms::default(),
        };
        group.fit_orbit(
            &desired,
            &centroid.mean.position_covariance(),
            known,
            members,
            SinceLastStep::default(),
            team,
        )?;
        Some(group)
    }

    /// Advances the group from the last time step, at which its members were `before`, to the current one; `None`
    /// without members.
    pub(crate) fn advance(
        &mut self,
        known: &[GroupedTrack],
        before: impl Iterator<Item = usize> + Clone,
        members: impl Iterator<Item = usize> + Clone,
        transition: &Transition,
        team: &TeamParams,
    ) -> Option<()> {
        let estimates = members.clone().map(|index| known[index].estimate());
        let desired = DesiredCentre::of(team.group.centre, known, members.clone())?;
        self.members = desired.members;
        let flown = OrbitMotion::start(&self.centre.estimate().state, &self.standoff, self.turn_limit_m);
        let is_unchanged = before.clone().eq(members.clone());
        if !is_unchanged {
            // A change of members changes the orbit, so that the timers restart.
            (self.diverging_for, self.outrun_for) = (Duration::ZERO, Duration::ZERO);
            if team.group.centre_jump == CentreJump::ShiftState {
                self.centre = self.centre.shifted(&membership_shift(known, before, &desired, team));
            }
        }
        // The covariance is only computed if it is needed.
        let filters = team.group.centre == CentreEstimate::Filtered || team.group.margin == Margin::Mahalanobis;
        let centroid_m2 = match filters || team.group.margin_takes_covariance() {
            true => mean_position_covariance(estimates.clone(), desired.members),
            false => Matrix2::zeros(),
        };
        let is_valid = filters && self.centre.follow(transition, desired.state.position(), &centroid_m2);
        match team.group.centre {
            CentreEstimate::Filtered if is_valid => {}
            CentreEstimate::Filtered => self.centre = GroupCentre::start(&Centroid::of(estimates)?)?,
            CentreEstimate::EnclosingCircle if !filters => {
                self.centre = self.centre.with_centre_at(&desired.state);
            }
            CentreEstimate::EnclosingCircle => {
                let innovation_distance = if is_valid { self.centre.innovation_distance } else { 0.0 };
                self.centre = GroupCentre::at(&Centroid::of(estimates)?.at(&desired.state), innovation_distance)?;
            }
        }
        let motion = &team.group.motion;
        let flown = (!motion.is_instantaneous())
            .then(|| flown.with_centre(&self.centre.estimate().state, motion, transition.dt.s()));
        if let Some(flown) = &flown {
            self.centre = self.centre.with_centre_at(&flown.state());
        }
        let since = SinceLastStep { dt: transition.dt, flown };
        self.fit_orbit(&desired, &centroid_m2, known, members, since, team)
    }

    /// Fits the orbit to the current centre and members. `centroid_m2` is the covariance of the centroid's position,
    /// m2.
    fn fit_orbit(
        &mut self,
        desired: &DesiredCentre,
        centroid_m2: &Matrix2<f64>,
        known: &[GroupedTrack],
        members: impl Iterator<Item = usize> + Clone,
        SinceLastStep { dt, flown }: SinceLastStep,
        team: &TeamParams,
    ) -> Option<()> {
        let (params, uav, sensor) = (&team.group, &team.uav, &team.track.sensor);
        let at = self.centre.estimate().state;
        let furthest = &known[furthest_from(at.position(), known, members.clone())?];
        let spread = match flown {
            // Around the centre of the moving orbit.
            Some(_) => Spread::of(&furthest.estimate().state, &at),
            None => desired.spread(&furthest.estimate().state, &at),
        };
        let furthest_rel_centre = furthest.position() - at.position();
        let relative_m2 = || relative_covariance(furthest.estimate(), centroid_m2, self.members);
        let margin_m = margin_m(params, self.centre.innovation_distance, relative_m2, furthest_rel_centre);
        // At the members' mean velocity: after a jump of the desired centre, the flown one is faster for some seconds.
        let turn_limit_m = team.turn_limit_about_m(desired.state.velocity().speed_m_s());
        let flown = flown.map(|flown| flown.with_turn_limit(turn_limit_m, dt.s()));
        let turn_limit_m = flown.map_or(turn_limit_m, |flown| flown.turn_limit_m);
        let bounds = team.orbit_bounds(turn_limit_m);
        let mut standoff = bounds.distance(spread, margin_m, sensor);
        let flown = flown.map(|flown| flown.with_radius(standoff.distance_m, &bounds, &params.motion, dt.s()));
        if let Some(flown) = flown {
            (standoff.distance_m, standoff.rate_m_s) = (flown.radius_m, flown.rate_m_s);
        }
        self.steered = team.guidance.law().steered(&GroupOrbit { team, bounds, spread, margin_m, standoff, flown });
        self.turn_limit_m = match params.radius_above_turn_limit {
            true => turn_limit_m,
            // As in the paper: (27) at the present rate.
            false => {
                let speed_m_s = team.orbit_speed_m_s(at.velocity().speed_m_s());
                let limit_m = standoff_distance::turn_limit_m(speed_m_s, standoff.rate_m_s, uav.turn_rate_max_rad_s);
                limit_m.max(team.turn_limit_about_m(at.velocity().speed_m_s()))
            }
        };
        // While an orbit shrinks gradually, it is larger than its members require.
        let required_radius_m = match flown {
            Some(_) => {
                let spread = desired.spread(&furthest.estimate().state, &desired.state);
                params.standoff.distance(spread, margin_m, sensor)
            }
            None => standoff,
        }
        .unclamped_m;
        self.radius_min_m = required_radius_m.max(params.standoff.radius_min_m).max(self.turn_limit_m);
        self.radius_max_m = params.standoff.radius_max_m.min(sensor.sensing_range_m - spread.distance_m);
        (self.furthest_member, self.spread, self.margin_m, self.standoff) =
            (furthest.track.id, spread, margin_m, standoff);
        Some(())
    }

    /// Evaluates how the group's UAVs follow its orbit, `dt` after the last time step.
    ///
    /// Implements Lemma 3.1 as section IV.B.2, convergence rule, uses it.
    pub(crate) fn check<'a>(
        &mut self,
        uavs: impl Iterator<Item = (Position, &'a OrbitRelativeState)> + Clone,
        dt: Duration,
        team: &TeamParams,
    ) {
        let threshold = |(_, on_orbit): (Position, &OrbitRelativeState)| on_orbit.threshold_m2_s(team.uav.speed_m_s);
        // A centre that is too fast has no threshold: removing a target would not make it slower.
        self.threshold_m2_s = uavs.clone().filter_map(threshold).reduce(f64::max);
        let prolonged = |past: Duration, holds: bool| {
            if holds { past + dt } else { Duration::ZERO }
        };
        let centre_m_s = self.centre.estimate().state.velocity().speed_m_s();
        self.outrun_for = prolonged(self.outrun_for, centre_m_s > team.uav.speed_max_m_s());
        // With a motion model, the orbit also shrinks gradually; this is no reason to remove a target.
        let runs_away = team.group.motion.is_instantaneous() || self.standoff.rate_m_s > 0.0;
        let diverges =
            runs_away && self.threshold_m2_s.is_some_and(|threshold| threshold < -team.group.divergence_limit_m2_s);
        self.diverging_for = prolonged(self.diverging_for, diverges);
        self.nearest_groupmate_m = None;
        let mut others = uavs.clone();
        while let Some((one, _)) = others.next() {
            for (other, _) in others.clone() {
                let distance_m = one.distance_m(other);
                self.nearest_groupmate_m =
                    Some(self.nearest_groupmate_m.map_or(distance_m, |least| least.min(distance_m)));
            }
        }
    }

    /// True if the group has at least twice or at most half as many members as at the last assignment, with a
    /// difference of at least two.
    pub(crate) fn has_changed(&self) -> bool {
        let (now, then) = (self.members, self.members_when_assigned);
        now.abs_diff(then) >= 2 && (now / 2 >= then || then / 2 >= now)
    }

    /// Returns the events for alerts that start or end. Alerts end with a hysteresis. `geofence` contains the zones that
    /// bind a UAV of the group.
    pub(crate) fn alarm(
        &mut self,
        params: &GroupingParams,
        geofence: Option<(&Geofence, ZoneSet)>,
    ) -> [Option<EventKind>; 3] {
        let (smallest_m, largest_m) = (self.radius_min_m, self.radius_max_m);
        let infeasible = !self.has_feasible_orbit() || (self.alarms.infeasible && smallest_m > 0.95 * largest_m);
        let closest_m = self.nearest_groupmate_m.unwrap_or(f64::INFINITY);
        let hysteresis = if self.alarms.close { 1.2 } else { 1.0 };
        let close = closest_m < hysteresis * params.proximity_alert_m;
        let unblocked = geofence.map(|(geofence, binding)| self.clear_part_of_orbit(geofence, binding));
        let cut = unblocked.map_or(Blockage::Clear, |(clear_fraction, _)| self.alarms.blockage.at(clear_fraction));
        let before = core::mem::replace(&mut self.alarms, Alarms { infeasible, close, blockage: cut });
        [
            (infeasible != before.infeasible).then_some(match infeasible {
                true => EventKind::OrbitInfeasible { radius_min_m: smallest_m, radius_max_m: largest_m },
                false => EventKind::OrbitFeasible,
            }),
            (close != before.close).then_some(match close {
                true => EventKind::ProximityAlert { distance_m: closest_m },
                false => EventKind::ProximityCleared,
            }),
            unblocked.filter(|_| cut != before.blockage).map(|(clear_fraction, zone)| match (cut, zone) {
                (Blockage::Partly, Some((zone, kind))) => EventKind::OrbitPartlyBlocked { clear_fraction, zone, kind },
                (Blockage::Blocked, Some((zone, kind))) => EventKind::OrbitBlocked { zone, kind },
                _ => EventKind::OrbitUnblocked,
            }),
        ]
    }

    /// Fraction of the circle of radius r_d around the centre at which UAVs may fly, and a zone of a set that blocks part
    /// of the rest.
    fn clear_part_of_orbit(&self, geofence: &Geofence, binding: ZoneSet) -> (f64, Option<(u32, ZoneKind)>) {
        let (centre, radius_m) = (self.centre.estimate().state.position(), self.standoff.distance_m);
        let point = |nth: u32| {
            let direction = Angle::from_rad(TAU * f64::from(nth) / f64::from(PLACES));
            centre + Displacement::from_polar(radius_m, direction)
        };
        // Far from all outlines, one point represents all.
        let sample_count = if geofence.has_side_near(centre, radius_m * 1.01) { PLACES } else { 1 };
        let (mut clear, mut first) = (0, None);
        for nth in 0..sample_count {
            match geofence.violated_zones_of(binding, point(nth)).next() {
                None => clear += 1,
                Some(zone) => first = first.or(Some(zone)),
            }
        }
        let kind = |zone: usize| geofence.zone(zone).map(|of| (zone as u32, of.kind));
        (f64::from(clear) / f64::from(sample_count), first.and_then(kind))
    }

    /// True if some orbit satisfies every constraint: turn rate, field of view, radius bounds, sensing range.
    pub fn has_feasible_orbit(&self) -> bool {
        self.radius_min_m <= self.radius_max_m
    }

    /// Returns the orbit around this group.
    pub fn orbit(&self) -> Orbit {
        Orbit::about(&self.centre.estimate().state, &self.standoff, self.steered)
    }
}

/// Number of sample points on an orbit.
const PLACES: u32 = 72;

impl Blockage {
    /// Blockage after the next check, with hysteresis.
    fn at(self, clear_fraction: f64) -> Self {
        let (blocked_below, cut) = match self {
            Self::Clear => (0.05, 0.95),
            Self::Partly => (0.05, 0.99),
            Self::Blocked => (0.15, 0.99),
        };
        if clear_fraction < blocked_below {
            Self::Blocked
        } else if clear_fraction < cut {
            Self::Partly
        } else {
            Self::Clear
        }
    }
}

/// Shift of the desired centre that the change of members alone causes.
fn membership_shift(
    known: &[GroupedTrack],
    before: impl Iterator<Item = usize> + Clone,
    desired: &DesiredCentre,
    team: &TeamParams,
) -> Vector6<f64> {
    let old = DesiredCentre::of(team.group.centre, known, before);
    old.map_or(Vector6::zeros(), |old| desired.state.0 - old.state.0)
}
