//! Who searches for a lost target, and where it can be by now.
//!
//! ```text
//! reach  = sd + max(v, v_0) t      v: last speed; v_0: that of a track of which nothing is known; t: since the loss
//! radius = reach / sin(half the field of view), within the bounds of the orbit
//! ```
//!
//! A searcher circles about where the target was lost: at a radius from which it sees all of the disc that the target
//! can have reached, while there is one. Beyond, the boresight swings over the disc. It goes on until the target is
//! measured, until the disc is larger than the sensor reaches, or until a group needs the UAV: whoever searches has left
//! others who hold every member of its group in view, and there is a UAV for every group.

use crate::angle::Angle;
use crate::coordination::event::{Event, EventKind, SearchEnd};
use crate::coordination::memberships::Memberships;
use crate::coordination::teammate::Teammate;
use crate::estimation::track::{LossReason, Track, TrackId, TrackStatus};
use crate::frame::Position;
use crate::math::{self, PI};
use crate::team::TeamParams;
use crate::time::{Duration, Time};
use crate::uav::UavId;

/// From one side of the disc to the other and back: at most 45 degrees in a second, so that a field of view of 70 has each
/// place in view for more than a second.
const SWING_PERIOD: Duration = Duration::from_us(16_000_000);
/// What one UAV swings later than the last: by the golden section of the period, so that no two swing alike.
const SWING_DELAY_US: i64 = 9_888_544;

/// One UAV's lost target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct SearchDuty {
    /// Which UAV.
    pub uav: UavId,
    /// The lost track that it searches for.
    pub track: TrackId,
}

/// Where a lost target can be by now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchArea {
    /// Where its track was lost.
    pub about: Position,
    /// How far from there it can be, m.
    pub reach_m: f64,
    /// Radius of the circle that a searcher flies, m.
    pub radius_m: f64,
}

impl SearchArea {
    /// Where the target of a lost track can be in `later_s` seconds; `None`: it is not lost, or the place is larger than
    /// the sensor reaches.
    pub fn of(track: &Track, later_s: f64, params: &TeamParams) -> Option<Self> {
        let estimate = track.estimate();
        let speed_m_s = estimate.state.velocity().speed_m_s().max(params.track.start_velocity_sd_m_s);
        let reach_m = estimate.position_sd_max_m() + speed_m_s * (track.lost_for().s() + later_s);
        let is_worth_it = track.is_lost() && reach_m <= params.track.sensor.sensing_range_m;
        let standoff = &params.group.standoff;
        is_worth_it.then(|| Self {
            about: estimate.state.position(),
            reach_m,
            radius_m: (reach_m * standoff.radius_per_spread()).clamp(standoff.radius_min_m, standoff.radius_max_m),
        })
    }

    /// Where a searcher at a place looks: at the middle, while it has all of the disc in view; else to and fro over all of
    /// it.
    pub fn boresight(&self, uav: UavId, at: Position, now: Time, field_of_view_rad: f64) -> Angle {
        let to_middle = self.about - at;
        let tangent_m2 = to_middle.length_m() * to_middle.length_m() - self.reach_m * self.reach_m;
        let half_rad = if tangent_m2 > 0.0 { math::atan2(self.reach_m, tangent_m2.sqrt()) } else { PI };
        // A quarter more than it takes: what is at the edge stays in view for a while, too.
        let swing_rad = 1.25 * (half_rad - field_of_view_rad / 2.0).max(0.0);
        // In whole microseconds: late in a mission it swings as early on.
        let (period_us, delay_us) = (SWING_PERIOD.us(), i64::from(uav.0) * SWING_DELAY_US);
        let into_us = (now.us().rem_euclid(period_us) + delay_us).rem_euclid(period_us);
        let triangle = 4.0 * (into_us as f64 / period_us as f64 - 0.5).abs() - 1.0;
        to_middle.direction() + Angle::from_rad(swing_rad * triangle)
    }
}

/// One instant's settling of who searches.
pub(crate) struct Searching<'a> {
    pub(crate) memberships: &'a Memberships,
    /// By ascending UAV, each with the group that it served until now.
    pub(crate) team: &'a mut [Teammate],
    pub(crate) params: &'a TeamParams,
    /// Those of the last instant, by ascending UAV.
    pub(crate) duties: &'a mut Vec<SearchDuty>,
    pub(crate) events: &'a mut Vec<Event>,
}

impl Searching<'_> {
    /// Calls UAVs back, and sends others.
    pub(crate) fn settle(&mut self) {
        self.call_back();
        self.send();
    }

    /// How many UAVs there are beside one for each group.
    fn spare(&self) -> usize {
        self.team.len().saturating_sub(self.memberships.groups().len())
    }

    fn track(&self, id: TrackId) -> Option<&Track> {
        self.memberships.place(id).ok().map(|place| &self.memberships.known()[place].track)
    }

    fn call_back(&mut self) {
        let mut duties = core::mem::take(self.duties);
        let mate = |uav: UavId| self.team.iter().find(|mate| mate.uav == uav);
        duties.retain(|duty| mate(duty.uav).is_some());
        let reach_m = |duty: &SearchDuty| {
            let area = self.track(duty.track).and_then(|track| SearchArea::of(track, 0.0, self.params));
            area.map_or(f64::INFINITY, |area| area.reach_m)
        };
        let mut ended: Vec<(SearchDuty, SearchEnd)> = Vec::new();
        duties.retain(|duty| {
            let is_found = self.track(duty.track).is_some_and(|track| !track.is_lost());
            let end = if is_found { SearchEnd::Found } else { SearchEnd::GivenUp };
            let goes_on = reach_m(duty).is_finite();
            ended.extend((!goes_on).then_some((*duty, end)));
            goes_on
        });
        // The largest place is the least hopeful.
        while duties.len() > self.spare() {
            let least = (0..duties.len()).max_by(|a, b| reach_m(&duties[*a]).total_cmp(&reach_m(&duties[*b])));
            ended.extend(least.map(|index| (duties.remove(index), SearchEnd::Needed)));
        }
        *self.duties = duties;
        for (duty, end) in ended {
            let event = Event::of_track(EventKind::SearchEnded(end), duty.track, None);
            self.events.push(Event { uav: Some(duty.uav), ..event });
        }
    }

    /// Each lost target that nobody searches for gets the nearest UAV that can be spared and is there in time.
    fn send(&mut self) {
        if self.duties.len() >= self.spare() {
            return;
        }
        let mut pairs: Vec<(f64, usize, TrackId)> = Vec::new();
        let lost = self.memberships.known().iter().map(|known| &known.track).filter(|track| track.is_lost());
        for track in lost.filter(|track| self.duties.iter().all(|duty| duty.track != track.id)) {
            for (index, mate) in self.team.iter().enumerate() {
                let distance_m = track.estimate().state.position().distance_m(mate.state.position);
                let in_time = SearchArea::of(track, distance_m / self.params.uav.speed_m_s, self.params);
                pairs.extend(in_time.map(|_| (distance_m, index, track.id)));
            }
        }
        pairs.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        for (_, index, track) in pairs {
            let (uav, group) = (self.team[index].uav, self.team[index].group);
            let is_taken = self.duties.iter().any(|duty| duty.uav == uav || duty.track == track);
            if is_taken || self.duties.len() >= self.spare() || !self.can_leave(index, track) {
                continue;
            }
            self.team[index].group = None;
            let place = self.duties.partition_point(|duty| duty.uav < uav);
            self.duties.insert(place, SearchDuty { uav, track });
            let event = Event::of_track(EventKind::SearchStarted, track, group);
            self.events.push(Event { uav: Some(uav), ..event });
        }
    }

    /// There are no groups; or others of its group have every member in view, and nobody has looked there in vain: what
    /// vanished in plain view may have left the roads, and a second UAV of a group tells more.
    fn can_leave(&self, index: usize, for_track: TrackId) -> bool {
        if self.memberships.groups().is_empty() {
            return true;
        }
        if self.track(for_track).is_none_or(|track| track.status != TrackStatus::Lost(LossReason::Widened)) {
            return false;
        }
        let Some(group) = self.team[index].group else { return true };
        let sensor = &self.params.track.sensor;
        let others = || self.team.iter().filter(|mate| mate.group == Some(group) && mate.uav != self.team[index].uav);
        self.memberships.of(group).all(|place| {
            let at = self.memberships.known()[place].position();
            let sees = |mate: &Teammate| {
                mate.boresight.is_some_and(|boresight| sensor.in_view(mate.state.position, boresight, at))
            };
            others().any(sees)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coordination::memberships::Membership;
    use crate::frame::Velocity;
    use crate::group_id::GroupId;
    use crate::message::{Cue, Report, TargetLabel};
    use crate::uav::UavState;

    fn params() -> TeamParams {
        TeamParams::table_1()
    }

    fn track(id: u32, x_m: f64, vx_m_s: f64) -> Track {
        let cue = Cue {
            searcher: 0,
            said: Time::START,
            number: 0,
            label: TargetLabel(id),
            time: Time::START,
            position: Position::from_m(x_m, 0.0),
            velocity: Velocity::from_m_s(vx_m_s, 0.0),
            position_sd_m: 20.0,
            velocity_sd_m_s: 2.0,
        };
        Track::from_cue(&cue, &params().track, Time::START).unwrap()
    }

    fn lost(id: u32, x_m: f64, vx_m_s: f64, lost_for_s: f64) -> Track {
        let mut track = track(id, x_m, vx_m_s);
        track.status = TrackStatus::Lost(LossReason::Widened);
        track.predict(&params().track.transition(Duration::from_s(lost_for_s)));
        track
    }

    /// 20 m of doubt, and 10 m/s, or more if it drove faster; the orbit of a disc is twice as wide (60 degrees are planned
    /// with), within 250 and 700 m; no sensor reaches beyond 1,200 m.
    #[test]
    fn where_it_can_be_grows_by_its_speed_until_it_is_too_large() {
        let area = |vx_m_s, lost_for_s, later_s| {
            let area = SearchArea::of(&lost(0, 40.0, vx_m_s, lost_for_s), later_s, &params());
            area.map(|area| (area.about.x_m(), area.reach_m.round(), area.radius_m.round()))
        };
        assert_eq!(area(0.0, 0.0, 0.0), Some((40.0, 20.0, 250.0)));
        assert_eq!(area(-8.0, 20.0, 0.0), Some((40.0, 220.0, 440.0)));
        assert_eq!(area(15.0, 20.0, 0.0), Some((40.0, 320.0, 640.0)));
        assert_eq!(area(15.0, 20.0, 30.0), Some((40.0, 770.0, 700.0)));
        assert_eq!(area(8.0, 110.0, 7.9), Some((40.0, 1199.0, 700.0)));
        assert_eq!(area(8.0, 110.0, 8.1), None);
        assert_eq!(SearchArea::of(&track(0, 40.0, 8.0), 0.0, &params()), None);
    }

    /// From 700 m a disc of 350 m spans 60 degrees, all in a field of view of 70; one of 606.2 m spans 120, so that its
    /// middle is 25 degrees off when an edge of the view is on an edge of the disc, and a quarter more at most; from within
    /// the disc it is all around.
    #[test]
    fn the_boresight_swings_over_all_of_the_disc() {
        let at = Position::from_m(-700.0, 0.0);
        let off_deg = |reach_m: f64, uav: u32, s: f64| {
            let area = SearchArea { about: Position::ORIGIN, reach_m, radius_m: 700.0 };
            area.boresight(UavId(uav), at, Time::START + Duration::from_s(s), 70f64.to_radians()).deg()
        };
        let wide_m = 700.0 * 0.75f64.sqrt();
        for (reach_m, uav, s, expected_deg) in [
            (350.0, 0, 0.0, 0.0),
            (wide_m, 0, 0.0, 31.25),
            (wide_m, 0, 4.0, 0.0),
            (wide_m, 0, 8.0, -31.25),
            (wide_m, 0, 14.0, 15.625),
            (wide_m, 1, 0.0, 31.25 * (4.0 * 0.118_034 - 1.0)),
            (800.0, 0, 2.0, 90.625),
        ] {
            assert!((off_deg(reach_m, uav, s) - expected_deg).abs() < 1e-6, "{reach_m} m, UAV {uav}, {s} s");
        }
        // Whatever is in reach is in view twice in a row at some time, twice a second.
        for direction_deg in -180..180 {
            let sees = |half_s: u32| {
                let off = Angle::from_deg(f64::from(direction_deg) - off_deg(800.0, 3, f64::from(half_s) / 2.0));
                off.abs_rad() <= 35f64.to_radians()
            };
            assert!((0..32).any(|half_s| sees(half_s) && sees(half_s + 1)), "{direction_deg}");
        }
    }

    /// Of each event the UAV, and what is told of it.
    type Told = Vec<(u32, &'static str)>;

    struct World {
        memberships: Memberships,
        team: Vec<Teammate>,
        duties: Vec<SearchDuty>,
    }

    impl World {
        /// UAVs at places on the x axis, all of one group; its target in the origin, at which they look.
        fn new(uavs: &[f64]) -> Self {
            let mut memberships = Memberships::default();
            memberships.start(track(0, 0.0, 0.0));
            memberships.set(0, Membership::Member(GroupId(0)));
            let mate = |(id, x_m): (usize, &f64)| {
                let position = Position::from_m(*x_m, 0.0);
                let state = UavState::straight(position, Angle::ZERO, 40.0);
                let boresight = Some((Position::ORIGIN - position).direction());
                let report = Report { boresight, ..Report::of(UavId(id as u32), Time::START, state) };
                Teammate::heard(&report, Some(GroupId(0)))
            };
            Self { memberships, team: uavs.iter().enumerate().map(mate).collect(), duties: Vec::new() }
        }

        /// Who searches for what, and what is told of it.
        fn settle(&mut self) -> (Vec<(u32, u32)>, Told) {
            let Self { memberships, team, duties } = self;
            let mut events = Vec::new();
            Searching { memberships, team, params: &params(), duties, events: &mut events }.settle();
            let told = |event: &Event| (event.uav.unwrap().0, event.kind.cause().unwrap_or(event.kind.name()));
            (self.duties.iter().map(|duty| (duty.uav.0, duty.track.0)).collect(), events.iter().map(told).collect())
        }
    }

    #[test]
    fn the_nearest_that_the_others_can_spare_searches_for_each() {
        let mut world = World::new(&[300.0, -300.0, 400.0]);
        world.memberships.start(lost(1, 900.0, 0.0, 0.0));
        world.memberships.start(lost(2, -900.0, 0.0, 0.0));
        world.memberships.start(lost(3, 2000.0, 0.0, 0.0));
        // 500 m to the first, 600 m to the second; a third UAV stays.
        assert_eq!(world.settle(), (vec![(1, 2), (2, 1)], vec![(2, "search-started"), (1, "search-started")]));
        assert_eq!(world.team.iter().filter(|mate| mate.group.is_some()).count(), 1);
        // Each goes on with its own.
        world.team.swap(1, 2);
        (world.team[1].uav, world.team[2].uav) = (UavId(1), UavId(2));
        assert_eq!(world.settle(), (vec![(1, 2), (2, 1)], vec![]));
    }

    #[test]
    fn nobody_leaves_whom_the_others_do_not_see_or_for_what_was_looked_for_in_vain() {
        let world = |uavs: &[f64], track: Track| {
            let mut world = World::new(uavs);
            world.memberships.start(track);
            world
        };
        let near = lost(1, 900.0, 0.0, 0.0);
        assert_eq!(world(&[300.0, -300.0], near).settle().0, [(0, 1)]);
        assert_eq!(world(&[300.0], near).settle().0, []);
        let mut away = world(&[300.0, -300.0], near);
        away.team[1].boresight = Some(Angle::from_deg(90.0));
        // The one that sees stays, the other goes.
        assert_eq!(away.settle().0, [(1, 1)]);
        away = world(&[300.0, -300.0], near);
        away.team.iter_mut().for_each(|mate| mate.boresight = None);
        assert_eq!(away.settle().0, []);
        let mut vanished = near;
        vanished.status = TrackStatus::Lost(LossReason::Vanished);
        let mut idle = world(&[300.0, -300.0], vanished);
        assert_eq!(idle.settle().0, []);
        idle.team[1].group = None;
        assert_eq!(idle.settle().0, []);
        idle.memberships.set(0, Membership::Unassigned);
        assert_eq!(idle.settle().0, [(0, 1)]);
        // There only when the place is too large: 20 m + 10 m/s for 104 s, and 600 m at 40 m/s.
        assert_eq!(world(&[300.0, -300.0], lost(1, 900.0, 0.0, 104.0)).settle().0, []);
        assert_eq!(world(&[300.0, -300.0], lost(1, 900.0, 0.0, 102.0)).settle().0, [(0, 1)]);
    }

    #[test]
    fn a_searcher_is_called_back_when_its_target_is_found_or_hopeless_or_a_group_needs_it() {
        let searching = |tracks: &[Track]| {
            let mut world = World::new(&[300.0, -300.0, 400.0]);
            tracks.iter().for_each(|track| world.memberships.start(*track));
            world.duties =
                vec![SearchDuty { uav: UavId(1), track: TrackId(1) }, SearchDuty { uav: UavId(2), track: TrackId(2) }];
            (world.team[1].group, world.team[2].group) = (None, None);
            world
        };
        let both = [lost(1, 900.0, 0.0, 50.0), lost(2, -900.0, 0.0, 60.0)];
        let mut found = searching(&both);
        *found.memberships.track_mut(1) = track(1, 950.0, 0.0);
        assert_eq!(found.settle(), (vec![(2, 2)], vec![(1, "found")]));
        let mut hopeless = searching(&[both[0], lost(2, -900.0, 0.0, 119.0)]);
        assert_eq!(hopeless.settle(), (vec![(1, 1)], vec![(2, "given-up")]));
        let mut forgotten = searching(&both[..1]);
        assert_eq!(forgotten.settle(), (vec![(1, 1)], vec![(2, "given-up")]));
        // A second group: one of three UAVs may search, and the larger place is given up.
        let mut needed = searching(&both);
        needed.memberships.start(track(3, 100.0, 0.0));
        needed.memberships.set(3, Membership::Member(GroupId(1)));
        assert_eq!(needed.settle(), (vec![(1, 1)], vec![(2, "needed")]));
        let mut silent = searching(&both);
        silent.team.remove(2);
        assert_eq!(silent.settle(), (vec![(1, 1)], vec![]));
    }
}
