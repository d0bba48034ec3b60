//! A group of targets: its estimated centre and the orbit from which all of it is seen.

use nalgebra::{Matrix2, Vector6};

use crate::angle::Angle;
use crate::coordination::event::EventKind;
use crate::coordination::memberships::Known;
use crate::coordination::spread::{furthest_from, margin_m, spread_in};
use crate::coordination::wanted_centre::{WantedCentre, circle_in};
use crate::estimation::group_centre::{Centroid, GroupCentre, mean_position_covariance, relative_covariance};
use crate::estimation::track::TrackId;
use crate::frame::{Displacement, Position};
use crate::group_id::GroupId;
use crate::guidance::airspace::{Airspace, ZoneKind};
use crate::guidance::heading::{Lead, OnOrbit, Orbit};
use crate::guidance::orbit_motion::OrbitMotion;
use crate::guidance::spacing::speed_floor_m_s;
use crate::guidance::standoff_distance::{Ramp, Spread, StandoffDistance, moving_centre_limit_m, turn_limit_m};
use crate::math::TAU;
use crate::target::Transition;
use crate::team::{CentreEstimate, GroupParams, Margin, OnMembershipChange, TeamParams};
use crate::time::Duration;

/// A group and its orbit at one instant.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Group {
    /// Which group.
    pub id: GroupId,
    /// Number of members, those in dwell to or from it included.
    pub members: u32,
    /// The filtered centre.
    pub centre: GroupCentre,
    /// The member furthest from the centre.
    pub furthest: TrackId,
    /// How far that is.
    pub spread: Spread,
    /// Margin d_m added to it, m.
    pub margin_m: f64,
    /// The standoff distance.
    pub standoff: StandoffDistance,
    /// The standoff distance, or with [`Lead::Predicted`] that which is expected, smoothed.
    pub smoothed: Ramp,
    /// Smallest radius at which a UAV can turn about this centre, m; infinite if the centre is as fast as a UAV can be.
    pub turn_limit_m: f64,
    /// Smallest radius that field of view, turn rate and r_d,min allow, m; infinite if the centre is as fast.
    pub smallest_m: f64,
    /// Largest radius that r_d,max and the sensing range allow, m.
    pub largest_m: f64,
    /// Altitude of the orbit above the plane, m: no other group has the same.
    pub altitude_m: f64,
    /// Threshold of Lemma 3.1 for that of its UAVs which follows best, m2/s; `None`: no UAV, or a centre too fast.
    #[doc(alias = "xi_th")]
    pub threshold_m2_s: Option<f64>,
    /// For how long it has been below -xi_d.
    pub diverging: Duration,
    /// For how long its centre has been faster than the UAVs can be.
    pub outrun: Duration,
    /// Smallest distance between two of its UAVs, m.
    pub separation_m: Option<f64>,
    /// Number of its members when UAVs were last assigned.
    pub(crate) members_when_assigned: u32,
    /// What was reported of the group as a whole.
    pub(crate) alarms: Alarms,
}

/// What goes on from the last instant, if something does.
#[derive(Debug, Clone, Copy, Default)]
struct Since {
    /// How long ago that was.
    dt: Duration,
    /// The orbit whose centre has followed already, and whose radius shall.
    flown: Option<OrbitMotion>,
    /// What was steered for.
    smoothed: Option<Ramp>,
}

/// What was reported of a group as a whole, and not taken back yet.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(into = "(u8, bool)", try_from = "(u8, bool)")]
pub(crate) struct Alarms {
    pub(crate) infeasible: bool,
    pub(crate) close: bool,
    pub(crate) cut: Cut,
}

/// What zones leave of an orbit.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Cut {
    #[default]
    Clear,
    InPart,
    Barred,
}

/// Without zones the same bytes as before there were any.
impl From<Alarms> for (u8, bool) {
    fn from(alarms: Alarms) -> Self {
        (u8::from(alarms.infeasible) + 2 * alarms.cut as u8, alarms.close)
    }
}

impl TryFrom<(u8, bool)> for Alarms {
    type Error = &'static str;

    fn try_from((bits, close): (u8, bool)) -> Result<Self, Self::Error> {
        let cut = match bits / 2 {
            0 => Cut::Clear,
            1 => Cut::InPart,
            2 => Cut::Barred,
            _ => return Err("no such alarm"),
        };
        Ok(Self { infeasible: bits % 2 == 1, close, cut })
    }
}

impl Group {
    /// Its numbers are such as an orbit can have.
    pub(crate) fn is_sound(&self) -> bool {
        let Self { spread, margin_m, standoff, smoothed, altitude_m, .. } = self;
        let numbers = [
            spread.distance_m,
            spread.rate_m_s,
            *margin_m,
            standoff.distance_m,
            standoff.rate_m_s,
            smoothed.radius_m,
            smoothed.rate_m_s,
            *altitude_m,
        ];
        self.centre.is_sound() && numbers.iter().all(|number| number.is_finite()) && standoff.distance_m > 0.0
    }

    /// Forms a group that comes into being; `None` without members.
    pub(crate) fn found(
        id: GroupId,
        known: &[Known],
        members: impl Iterator<Item = usize> + Clone,
        team: &TeamParams,
    ) -> Option<Self> {
        let centroid = Centroid::of(members.clone().map(|index| known[index].estimate()))?;
        let wanted = WantedCentre::of(team.group.centre, known, members.clone())?;
        let mut group = Self {
            id,
            members: centroid.members,
            centre: GroupCentre::start(&centroid.at(&wanted.state))?,
            // What the orbit is like follows below.
            furthest: TrackId(0),
            spread: Spread::default(),
            margin_m: 0.0,
            standoff: StandoffDistance::default(),
            smoothed: Ramp::default(),
            turn_limit_m: 0.0,
            smallest_m: 0.0,
            largest_m: 0.0,
            altitude_m: team.group.altitude_lowest_m,
            threshold_m2_s: None,
            diverging: Duration::ZERO,
            outrun: Duration::ZERO,
            separation_m: None,
            members_when_assigned: 0,
            alarms: Alarms::default(),
        };
        group.fit_orbit(&wanted, &centroid.mean.position_covariance(), known, members, Since::default(), team)?;
        Some(group)
    }

    /// Carries the group on from the last instant, when its members were `before`, to this one; `None` without members.
    pub(crate) fn carry_on(
        &mut self,
        known: &[Known],
        before: impl Iterator<Item = usize> + Clone,
        members: impl Iterator<Item = usize> + Clone,
        transition: &Transition,
        team: &TeamParams,
    ) -> Option<()> {
        let estimates = members.clone().map(|index| known[index].estimate());
        let wanted = WantedCentre::of(team.group.centre, known, members.clone())?;
        self.members = wanted.members;
        let flown = OrbitMotion::start(&self.centre.estimate().state, &self.standoff);
        let is_unchanged = before.clone().eq(members.clone());
        if !is_unchanged {
            // With other members it is another orbit, and patience begins anew.
            (self.diverging, self.outrun) = (Duration::ZERO, Duration::ZERO);
            if team.group.on_membership_change == OnMembershipChange::Shift {
                self.centre = self.centre.shifted(&membership_shift(known, before, &wanted, team));
            }
        }
        // What nothing is taken from is not worked out.
        let filters = team.group.centre == CentreEstimate::Filtered || team.group.margin == Margin::Mahalanobis;
        let centroid_m2 = match filters || team.group.margin.takes_covariance() {
            true => mean_position_covariance(estimates.clone(), wanted.members),
            false => Matrix2::zeros(),
        };
        let is_sound = filters && self.centre.follow(transition, wanted.state.position(), &centroid_m2);
        match team.group.centre {
            CentreEstimate::Filtered if is_sound => {}
            CentreEstimate::Filtered => self.centre = GroupCentre::start(&Centroid::of(estimates)?)?,
            CentreEstimate::Centroid | CentreEstimate::SmallestCircle if !filters => {
                self.centre = self.centre.moved_to(&wanted.state);
            }
            CentreEstimate::Centroid | CentreEstimate::SmallestCircle => {
                let innovation_distance = if is_sound { self.centre.innovation_distance } else { 0.0 };
                self.centre = GroupCentre::at(&Centroid::of(estimates)?.at(&wanted.state), innovation_distance)?;
            }
        }
        let motion = &team.group.motion;
        let flown =
            (!motion.is_at_once()).then(|| flown.centred_on(&self.centre.estimate().state, motion, transition.dt.s()));
        if let Some(flown) = &flown {
            self.centre = self.centre.moved_to(&flown.state());
        }
        let smoothed = (is_unchanged || flown.is_some()).then_some(self.smoothed);
        let since = Since { dt: transition.dt, flown, smoothed };
        self.fit_orbit(&wanted, &centroid_m2, known, members, since, team)
    }

    /// Fits the orbit to the centre and the members as they are now. `centroid_m2` is the covariance of their centroid's
    /// position, m2.
    fn fit_orbit(
        &mut self,
        wanted: &WantedCentre,
        centroid_m2: &Matrix2<f64>,
        known: &[Known],
        members: impl Iterator<Item = usize> + Clone,
        Since { dt, flown, smoothed }: Since,
        team: &TeamParams,
    ) -> Option<()> {
        let (params, uav) = (&team.group, &team.uav);
        let at = self.centre.estimate().state;
        let furthest = &known[furthest_from(at.position(), known, members.clone())?];
        let spread = match flown {
            // About the centre as it is flown.
            Some(_) => Spread::of(&furthest.estimate().state, &at),
            None => wanted.spread(&furthest.estimate().state, &at),
        };
        let furthest_rel_centre = furthest.position() - at.position();
        let relative_m2 = || relative_covariance(furthest.estimate(), centroid_m2, self.members);
        let margin_m = margin_m(params.margin, self.centre.innovation_distance, relative_m2, furthest_rel_centre);
        let mut standoff = params.standoff.distance(spread, margin_m);
        if let Some(flown) = flown {
            let flown = flown.widened_to(standoff.distance_m, &params.standoff, &params.motion, dt.s());
            (standoff.distance_m, standoff.rate_m_s) = (flown.radius_m, flown.rate_m_s);
        }
        let steered = match team.guidance.lead {
            Lead::Constant(_) | Lead::Scheduled => standoff,
            Lead::Predicted => {
                let lead_s = team.guidance.lead_s(standoff.distance_m, uav.speed_m_s);
                match flown {
                    None => {
                        let states = members.map(|index| known[index].estimate().state);
                        let expected = match params.centre {
                            CentreEstimate::SmallestCircle => circle_in(lead_s, states)?.1,
                            CentreEstimate::Filtered | CentreEstimate::Centroid => spread_in(lead_s, states, &at),
                        };
                        params.standoff.distance(expected, margin_m)
                    }
                    // What is flown by then is still on its way to what is expected.
                    Some(_) => {
                        let expected = params.standoff.distance(spread.after(lead_s), margin_m).distance_m;
                        let OrbitMotion { radius_m: distance_m, rate_m_s, .. } = OrbitMotion::start(&at, &standoff)
                            .widened_to(expected, &params.standoff, &params.motion, lead_s);
                        StandoffDistance { distance_m, rate_m_s, ..standoff }
                    }
                }
            }
        };
        self.smoothed = Ramp::smoothed(smoothed, &steered, params.smoothing_s, dt.s());
        let centre_speed_m_s = at.velocity().speed_m_s();
        let speed_m_s = uav.speed_m_s.max(speed_floor_m_s(centre_speed_m_s)).min(uav.speed_max_m_s());
        self.turn_limit_m = turn_limit_m(speed_m_s, standoff.rate_m_s, uav.turn_rate_max_rad_s)
            .max(moving_centre_limit_m(speed_m_s, centre_speed_m_s, uav.turn_rate_max_rad_s));
        // An orbit on its way is wider for a while than its members need.
        let needed_m = match flown {
            Some(_) => params.standoff.distance(wanted.spread(&furthest.estimate().state, &wanted.state), margin_m),
            None => standoff,
        }
        .unclamped_m;
        self.smallest_m = needed_m.max(params.standoff.radius_min_m).max(self.turn_limit_m);
        self.largest_m = params.standoff.radius_max_m.min(team.track.sensor.sensing_range_m - spread.distance_m);
        (self.furthest, self.spread, self.margin_m, self.standoff) = (furthest.track.id, spread, margin_m, standoff);
        Some(())
    }

    /// Judges how the group's UAVs follow its orbit, `dt` after the last time.
    ///
    /// Implements Lemma 3.1 as section IV.B.2, convergence rule, uses it.
    pub(crate) fn judge<'a>(
        &mut self,
        crew: impl Iterator<Item = (Position, &'a OnOrbit)> + Clone,
        dt: Duration,
        team: &TeamParams,
    ) {
        let threshold = |(_, on_orbit): (Position, &OnOrbit)| on_orbit.threshold_m2_s(team.uav.speed_m_s);
        // Discarding a target makes no centre slower.
        self.threshold_m2_s = crew.clone().filter_map(threshold).reduce(f64::max);
        let longer = |past: Duration, still: bool| {
            if still { past + dt } else { Duration::ZERO }
        };
        let centre_m_s = self.centre.estimate().state.velocity().speed_m_s();
        self.outrun = longer(self.outrun, centre_m_s > team.uav.speed_max_m_s());
        // An orbit that takes its time also shrinks for a while: no target is let go for that.
        let runs_away = team.group.motion.is_at_once() || self.standoff.rate_m_s > 0.0;
        let diverges =
            runs_away && self.threshold_m2_s.is_some_and(|threshold| threshold < -team.group.convergence_limit_m2_s);
        self.diverging = longer(self.diverging, diverges);
        self.separation_m = None;
        let mut others = crew.clone();
        while let Some((one, _)) = others.next() {
            for (other, _) in others.clone() {
                let distance_m = one.distance_m(other);
                self.separation_m = Some(self.separation_m.map_or(distance_m, |least| least.min(distance_m)));
            }
        }
    }

    /// It has twice, or half, as many members as when UAVs were last assigned, and two more or fewer.
    pub(crate) fn has_changed(&self) -> bool {
        let (now, then) = (self.members, self.members_when_assigned);
        now.abs_diff(then) >= 2 && (now / 2 >= then || then / 2 >= now)
    }

    /// What is to be reported of the group as a whole. What was reported is taken back with some room to spare.
    pub(crate) fn alarm(&mut self, params: &GroupParams, airspace: Option<&Airspace>) -> [Option<EventKind>; 3] {
        let (smallest_m, largest_m) = (self.smallest_m, self.largest_m);
        let infeasible = !self.is_feasible() || (self.alarms.infeasible && smallest_m > 0.95 * largest_m);
        let closest_m = self.separation_m.unwrap_or(f64::INFINITY);
        let room = if self.alarms.close { 1.2 } else { 1.0 };
        let close = closest_m < room * params.separation_alarm_m;
        let left = airspace.map(|airspace| self.left_of_orbit(airspace));
        let cut = left.map_or(Cut::Clear, |(clear_fraction, _)| self.alarms.cut.at(clear_fraction));
        let was = core::mem::replace(&mut self.alarms, Alarms { infeasible, close, cut });
        [
            (infeasible != was.infeasible).then_some(match infeasible {
                true => EventKind::OrbitInfeasible { smallest_m, largest_m },
                false => EventKind::OrbitFeasible,
            }),
            (close != was.close).then_some(match close {
                true => EventKind::UavsClose { distance_m: closest_m },
                false => EventKind::UavsApart,
            }),
            left.filter(|_| cut != was.cut).map(|(clear_fraction, zone)| match (cut, zone) {
                (Cut::InPart, Some((zone, by))) => EventKind::OrbitCut { clear_fraction, zone, by },
                (Cut::Barred, Some((zone, by))) => EventKind::OrbitBarred { zone, by },
                _ => EventKind::OrbitClear,
            }),
        ]
    }

    /// Which share of the circle of r_d about the centre is where UAVs may be, and a zone that takes some of it.
    fn left_of_orbit(&self, airspace: &Airspace) -> (f64, Option<(u32, ZoneKind)>) {
        let (centre, radius_m) = (self.centre.estimate().state.position(), self.standoff.distance_m);
        let place = |nth: u32| {
            let direction = Angle::from_rad(TAU * f64::from(nth) / f64::from(PLACES));
            centre + Displacement::from_polar(radius_m, direction)
        };
        // Far from all outlines one place tells of all.
        let looked_at = if airspace.has_side_near(centre, radius_m * 1.01) { PLACES } else { 1 };
        let (mut clear, mut first) = (0, None);
        for nth in 0..looked_at {
            match airspace.forbidding(place(nth)).next() {
                None => clear += 1,
                Some(zone) => first = first.or(Some(zone)),
            }
        }
        let kind = |zone: usize| airspace.zones().nth(zone).map(|of| (zone as u32, of.kind));
        (f64::from(clear) / f64::from(looked_at), first.and_then(kind))
    }

    /// Some orbit satisfies every constraint: turn rate, field of view, radius bounds, sensing range.
    pub fn is_feasible(&self) -> bool {
        self.smallest_m <= self.largest_m
    }

    /// The orbit about this group.
    pub fn orbit(&self, team: &TeamParams) -> Orbit {
        let steered = match team.guidance.lead {
            Lead::Predicted => self.smoothed,
            Lead::Constant(_) | Lead::Scheduled => {
                let lead_s = team.guidance.lead_s(self.standoff.distance_m, team.uav.speed_m_s);
                self.smoothed.led(lead_s, &team.group.standoff)
            }
        };
        Orbit::about(&self.centre.estimate().state, &self.standoff, steered)
    }
}

/// So many places of an orbit are looked at.
const PLACES: u32 = 72;

impl Cut {
    /// What zones leave of an orbit now: what was told is taken back with some room to spare.
    fn at(self, clear_fraction: f64) -> Self {
        let (barred, cut) = match self {
            Self::Clear => (0.05, 0.95),
            Self::InPart => (0.05, 0.99),
            Self::Barred => (0.15, 0.99),
        };
        if clear_fraction < barred {
            Self::Barred
        } else if clear_fraction < cut {
            Self::InPart
        } else {
            Self::Clear
        }
    }
}

/// What the change of members alone moved the wanted centre, all else as it is now.
fn membership_shift(
    known: &[Known],
    before: impl Iterator<Item = usize> + Clone,
    wanted: &WantedCentre,
    team: &TeamParams,
) -> Vector6<f64> {
    let old = WantedCentre::of(team.group.centre, known, before);
    old.map_or(Vector6::zeros(), |old| wanted.state.0 - old.state.0)
}
