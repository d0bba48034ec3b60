//! A group of targets: its estimated centre and the orbit from which all of it is seen.

use nalgebra::{Matrix2, Vector6};

use crate::coordination::assignment::Objective;
use crate::coordination::event::EventKind;
use crate::coordination::membership::Known;
use crate::coordination::need::furthest_from;
use crate::estimation::group_centre::{
    Centroid, GroupCentre, mean_position_covariance, mean_state, relative_covariance,
};
use crate::frame::{Displacement, Position};
use crate::guidance::heading::{Lead, OnOrbit, Orbit};
use crate::guidance::spacing::speed_floor_m_s;
use crate::guidance::standoff_distance::{
    Ramp, Spread, StandoffDistance, StandoffParams, moving_centre_limit_m, turn_limit_m,
};
use crate::param::{Allowed, ParamError, errors_of};
use crate::target::{TargetId, TargetState, Transition};
use crate::team::TeamParams;
use crate::time::Duration;

/// Identifies a group for as long as it lives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct GroupId(pub u32);

/// What is added to the spread before the standoff distance is taken from it (16).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Margin {
    /// Eq. (16) as printed: a squared Mahalanobis distance, dimensionless, added to metres.
    Mahalanobis,
    /// So many standard deviations of the furthest member's position relative to the centre, along the line between
    /// them, from the members' fused covariances; metres. 1.645 is the one-sided 95 % quantile.
    StandardDeviations(f64),
}

/// Where a group's centre is taken to be.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum CentreEstimate {
    /// A filter of its own follows the centroid of the members' estimates (section II.C): it filters what is filtered
    /// already.
    #[default]
    Filtered,
    /// The centroid of the members' estimates itself, positions and velocities.
    Centroid,
}

/// What happens to the centre when a group's members change and the centroid jumps.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum OnMembershipChange {
    /// The centre moves by the jump, which is known exactly.
    #[default]
    Shift,
    /// The filter takes the jump for an innovation, as the paper does.
    Filter,
}

/// Parameters of groups.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroupParams {
    /// Bounds of the orbit.
    pub standoff: StandoffParams,
    /// Margin d_m.
    #[doc(alias = "d_m")]
    pub margin: Margin,
    /// Where the centre is.
    pub centre: CentreEstimate,
    /// Time constant with which the radius steered for follows r_d, s; at least 0; 0, as in the paper: at once.
    pub smoothing_s: f64,
    /// What a change of members does to the centre.
    pub on_membership_change: OnMembershipChange,
    /// A target outside is taken in when the orbit with it needs at most this fraction of the largest radius; above 0,
    /// at most 1.
    pub take_back_fraction: f64,
    /// Limit xi_d of the discard by convergence, m2/s: a group whose UAVs' xi_th all stay below -xi_d loses its furthest
    /// target; above 0.
    #[doc(alias = "xi_d")]
    pub convergence_limit_m2_s: f64,
    /// For how long they must stay below it, s; at least 0.
    pub convergence_patience_s: f64,
    /// A target is handed over when another group's centroid is nearer by more than this, m; at least 0. The paper has
    /// none.
    pub handoff_margin_m: f64,
    /// Shortest dwell T_hd of a handoff, s; at least 0.
    pub dwell_min_s: f64,
    /// Longest dwell, s; at least `dwell_min_s`; 0 switches the dwell off.
    pub dwell_max_s: f64,
    /// So often it is asked whether a group's UAVs could watch more targets by forming another, s; at least 0; 0
    /// switches it off, as in the paper.
    pub review_period_s: f64,
    /// UAVs are not sent to targets that they cannot have within sensing range after this time, s; at least 0.
    pub reach_ahead_s: f64,
    /// What the assignment of UAVs to groups maximises.
    pub objective: Objective,
    /// What staying where it is counts for a UAV under the default objective, in ln det per target of its group: nobody
    /// is moved in flight for less; at least 0. A UAV twice as far away tells 1.4 less.
    pub assignment_inertia: f64,
    /// Altitude of the lowest orbit above the plane, m; 1 to 20,000.
    pub altitude_lowest_m: f64,
    /// From one group's altitude to the next, m; 1 to 20,000.
    pub altitude_step_m: f64,
    /// Two UAVs of a group closer than this are reported, m; at least 0.
    pub separation_alarm_m: f64,
}

impl GroupParams {
    /// Every parameter that is out of range.
    pub fn errors(&self) -> Vec<ParamError> {
        let mut errors = errors_of([("standoff", self.standoff.errors())]);
        if let Margin::StandardDeviations(sds) = self.margin {
            Allowed::at_least(0.0).at_most(100.0).check("margin_sds", sds, &mut errors);
        }
        let fraction = Allowed::above(0.0).at_most(1.0);
        fraction.check("take_back_fraction", self.take_back_fraction, &mut errors);
        Allowed::above(0.0).at_most(1e9).check("convergence_limit_m2_s", self.convergence_limit_m2_s, &mut errors);
        Allowed::at_least(0.0).at_most(1e5).check("handoff_margin_m", self.handoff_margin_m, &mut errors);
        let seconds = Allowed::at_least(0.0).at_most(3600.0);
        seconds.check("convergence_patience_s", self.convergence_patience_s, &mut errors);
        seconds.check("dwell_min_s", self.dwell_min_s, &mut errors);
        Allowed::at_least(self.dwell_min_s).at_most(3600.0).because("not shorter than dwell_min_s").check(
            "dwell_max_s",
            self.dwell_max_s,
            &mut errors,
        );
        seconds.check("smoothing_s", self.smoothing_s, &mut errors);
        seconds.check("review_period_s", self.review_period_s, &mut errors);
        seconds.check("reach_ahead_s", self.reach_ahead_s, &mut errors);
        Allowed::at_least(0.0).at_most(100.0).check("assignment_inertia", self.assignment_inertia, &mut errors);
        let altitude = Allowed::at_least(1.0).at_most(2e4);
        altitude.check("altitude_lowest_m", self.altitude_lowest_m, &mut errors);
        altitude.check("altitude_step_m", self.altitude_step_m, &mut errors);
        Allowed::at_least(0.0).at_most(1e4).check("separation_alarm_m", self.separation_alarm_m, &mut errors);
        errors
    }

    /// Largest distance from the centre, without any margin, of a target that a group with room to spare holds, m.
    pub(crate) fn reach_m(&self) -> f64 {
        self.take_back_fraction * self.standoff.radius_max_m / self.standoff.radius_per_spread()
    }
}

/// A group and its orbit at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Group {
    /// Which group.
    pub id: GroupId,
    /// Number of members, those in dwell to or from it included.
    pub members: u32,
    /// The filtered centre.
    pub centre: GroupCentre,
    /// The member furthest from the centre.
    pub furthest: TargetId,
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

/// What was reported of a group as a whole, and not taken back yet.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Alarms {
    pub(crate) infeasible: bool,
    pub(crate) close: bool,
}

impl Group {
    /// Forms a group that comes into being; `None` without members.
    pub(crate) fn found(
        id: GroupId,
        known: &[Known],
        members: impl Iterator<Item = usize> + Clone,
        team: &TeamParams,
    ) -> Option<Self> {
        let centroid = Centroid::of(members.clone().map(|index| known[index].track.estimate()))?;
        let mut group = Self {
            id,
            members: centroid.members,
            centre: GroupCentre::start(&centroid)?,
            // What the orbit is like follows below.
            furthest: TargetId(0),
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
        group.fit_orbit(&centroid.mean.position_covariance(), known, members, None, team)?;
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
        let estimates = members.clone().map(|index| known[index].track.estimate());
        let (centroid, n) = mean_state(estimates.clone())?;
        let centroid_m2 = mean_position_covariance(estimates.clone(), n);
        self.members = n;
        let is_unchanged = before.clone().eq(members.clone());
        if !is_unchanged {
            // With other members it is another orbit, and patience begins anew.
            (self.diverging, self.outrun) = (Duration::ZERO, Duration::ZERO);
            if team.group.on_membership_change == OnMembershipChange::Shift {
                self.centre = self.centre.shifted(&membership_shift(known, before, &centroid));
            }
        }
        let is_sound = self.centre.follow(transition, centroid.position(), &centroid_m2);
        match team.group.centre {
            CentreEstimate::Filtered if is_sound => {}
            CentreEstimate::Filtered => self.centre = GroupCentre::start(&Centroid::of(estimates)?)?,
            CentreEstimate::Centroid => {
                let innovation_distance = if is_sound { self.centre.innovation_distance } else { 0.0 };
                self.centre = GroupCentre::at(&Centroid::of(estimates)?, innovation_distance)?;
            }
        }
        let smoothed = is_unchanged.then_some((self.smoothed, transition.dt));
        self.fit_orbit(&centroid_m2, known, members, smoothed, team)
    }

    /// Fits the orbit to the centre and the members as they are now. `centroid_m2` is the covariance of their centroid's
    /// position, m2; `smoothed` what was steered for before, and how long ago.
    fn fit_orbit(
        &mut self,
        centroid_m2: &Matrix2<f64>,
        known: &[Known],
        members: impl Iterator<Item = usize> + Clone,
        smoothed: Option<(Ramp, Duration)>,
        team: &TeamParams,
    ) -> Option<()> {
        let (params, uav) = (&team.group, &team.uav);
        let at = self.centre.estimate().state;
        let furthest = &known[furthest_from(at.position(), known, members.clone())?];
        let spread = spread_of(&furthest.track.estimate().state, &at);
        let furthest_rel_centre = furthest.position() - at.position();
        let relative_m2 = || relative_covariance(furthest.track.estimate(), centroid_m2, self.members);
        let margin_m = margin_m(params.margin, self.centre.innovation_distance, relative_m2, furthest_rel_centre);
        let standoff = params.standoff.distance(spread, margin_m);
        let wanted = match team.guidance.lead {
            Lead::Constant(_) | Lead::Scheduled => standoff,
            Lead::Predicted => {
                let lead_s = team.guidance.lead_s(standoff.distance_m, uav.speed_m_s);
                let states = members.map(|index| known[index].track.estimate().state);
                params.standoff.distance(spread_in(lead_s, states, &at), margin_m)
            }
        };
        let (before, dt) = smoothed.unzip();
        self.smoothed = Ramp::smoothed(before, &wanted, params.smoothing_s, dt.unwrap_or_default().s());
        let centre_speed_m_s = at.velocity().speed_m_s();
        let speed_m_s = uav.speed_m_s.max(speed_floor_m_s(centre_speed_m_s)).min(uav.speed_max_m_s());
        self.turn_limit_m = turn_limit_m(speed_m_s, standoff.rate_m_s, uav.turn_rate_max_rad_s)
            .max(moving_centre_limit_m(speed_m_s, centre_speed_m_s, uav.turn_rate_max_rad_s));
        self.smallest_m = standoff.unclamped_m.max(params.standoff.radius_min_m).max(self.turn_limit_m);
        self.largest_m = params.standoff.radius_max_m.min(team.track.sensor.sensing_range_m - spread.distance_m);
        (self.furthest, self.spread, self.margin_m, self.standoff) =
            (furthest.track.target, spread, margin_m, standoff);
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
            if still { Duration::from_us(past.us().saturating_add(dt.us())) } else { Duration::ZERO }
        };
        let centre_m_s = self.centre.estimate().state.velocity().speed_m_s();
        self.outrun = longer(self.outrun, centre_m_s > team.uav.speed_max_m_s());
        let diverges = self.threshold_m2_s.is_some_and(|threshold| threshold < -team.group.convergence_limit_m2_s);
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
        now.abs_diff(then) >= 2 && (now >= 2 * then || then >= 2 * now)
    }

    /// What is to be reported of the group as a whole. What was reported is taken back with some room to spare.
    pub(crate) fn alarm(&mut self, params: &GroupParams) -> [Option<EventKind>; 2] {
        let (smallest_m, largest_m) = (self.smallest_m, self.largest_m);
        let infeasible = !self.is_feasible() || (self.alarms.infeasible && smallest_m > 0.95 * largest_m);
        let closest_m = self.separation_m.unwrap_or(f64::INFINITY);
        let room = if self.alarms.close { 1.2 } else { 1.0 };
        let close = closest_m < room * params.separation_alarm_m;
        let was = core::mem::replace(&mut self.alarms, Alarms { infeasible, close });
        [
            (infeasible != was.infeasible).then_some(match infeasible {
                true => EventKind::OrbitInfeasible { smallest_m, largest_m },
                false => EventKind::OrbitFeasible,
            }),
            (close != was.close).then_some(match close {
                true => EventKind::UavsClose { distance_m: closest_m },
                false => EventKind::UavsApart,
            }),
        ]
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

/// What the change of members alone moved the centroid, all else as it is now.
fn membership_shift(known: &[Known], before: impl Iterator<Item = usize>, centroid: &TargetState) -> Vector6<f64> {
    let old = mean_state(before.map(|index| known[index].track.estimate()));
    old.map_or(Vector6::zeros(), |(old, _)| centroid.0 - old.0)
}

pub(crate) fn spread_of(furthest: &TargetState, centre: &TargetState) -> Spread {
    let member_rel_centre = (furthest.position() - centre.position()).vector();
    let velocity_rel_centre = (furthest.velocity() - centre.velocity()).vector();
    let distance_m = (furthest.position() - centre.position()).length_m();
    let rate_m_s = if distance_m > 0.0 { member_rel_centre.dot(&velocity_rel_centre) / distance_m } else { 0.0 };
    Spread { distance_m, rate_m_s }
}

/// The largest spread of members about their centre `in_s` seconds from now, if they keep their velocities.
fn spread_in(in_s: f64, members: impl Iterator<Item = TargetState>, centre: &TargetState) -> Spread {
    let later = |state: &TargetState| {
        TargetState::new(state.position() + state.velocity() * in_s, state.velocity(), [0.0, 0.0])
    };
    let centre = later(centre);
    let spreads = members.map(|member| spread_of(&later(&member), &centre));
    spreads.max_by(|a, b| a.distance_m.total_cmp(&b.distance_m)).unwrap_or_default()
}

/// The margin d_m: printed (16), taken as if in metres, or metres from the covariance of the furthest member's position
/// relative to the centroid, m2.
///
/// Implements Eq. (16).
pub(crate) fn margin_m(
    margin: Margin,
    innovation_distance: f64,
    relative_m2: impl FnOnce() -> Matrix2<f64>,
    furthest_rel_centre: Displacement,
) -> f64 {
    match margin {
        Margin::Mahalanobis => innovation_distance,
        Margin::StandardDeviations(sds) => {
            let distance_m = furthest_rel_centre.length_m();
            if distance_m <= 0.0 {
                return 0.0;
            }
            let towards = furthest_rel_centre.vector() / distance_m;
            let variance = towards.dot(&(relative_m2() * towards));
            sds * variance.max(0.0).sqrt()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Velocity;

    /// One member stands at 100 m, another moves outwards from 90 m at 5 m/s: in 4 s it is the furthest, at 110 m.
    #[test]
    fn the_expected_spread_is_that_of_whoever_will_be_furthest() {
        let member =
            |x_m, vx_m_s| TargetState::new(Position::from_m(x_m, 0.0), Velocity::from_m_s(vx_m_s, 0.0), [0.0, 0.0]);
        let centre = TargetState::new(Position::ORIGIN, Velocity::ZERO, [0.0, 0.0]);
        let spread = |in_s| spread_in(in_s, [member(-100.0, 0.0), member(90.0, 5.0)].into_iter(), &centre);
        assert_eq!(spread(0.0), Spread { distance_m: 100.0, rate_m_s: 0.0 });
        assert_eq!(spread(4.0), Spread { distance_m: 110.0, rate_m_s: 5.0 });
    }
}
