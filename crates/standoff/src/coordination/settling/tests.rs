use super::*;
use crate::angle::Angle;
use crate::coordination::event::FoundingReason;
use crate::estimation::track::Track;
use crate::frame::Velocity;
use crate::guidance::heading::OnOrbit;
use crate::message::{Cue, Report, TargetLabel};
use crate::team::{CentreEstimate, Discard, GroupCount, Margin};
use crate::uav::{UavId, UavState};

/// Targets on known positions, groups without UAVs' motion: a world in which only memberships change.
struct World {
    memberships: Memberships,
    team: Vec<Teammate>,
    params: TeamParams,
    previous: Vec<Group>,
    tick: i64,
    agenda: Agenda,
    room: Room,
    /// The number of the group that each UAV serves, once it is founded.
    serves: Vec<Option<u32>>,
}

impl World {
    /// Targets at rest at these places east, and so many UAVs at the origin.
    fn new(uavs: u32, x_m: &[f64]) -> Self {
        let state = UavState::straight(Position::from_m(0.0, -400.0), Angle::ZERO, 40.0);
        let boresight = Some(Angle::from_deg(90.0));
        let report = |id| Report { boresight, ..Report::of(UavId(id), Time::START, state) };
        let mate = |id| Teammate::heard(&report(id), None);
        let mut params = TeamParams::table_1();
        params.group.handoff_margin_m = 0.0;
        // A field of view so wide that all is always seen; what is seen is tested by itself.
        params.track.sensor.field_of_view_rad = crate::math::TAU;
        params.track.sensor.sensing_range_m = 1e5;
        params.group.margin = Margin::StandardDeviations(0.0);
        let mut memberships = Memberships::default();
        (0..).zip(x_m).for_each(|(id, x_m)| memberships.start(track(id, *x_m)));
        Self {
            memberships,
            team: (0..uavs).map(mate).collect(),
            params,
            previous: Vec::new(),
            tick: 0,
            agenda: Agenda::default(),
            room: Room::default(),
            serves: vec![None; uavs as usize],
        }
    }

    /// The id of the how many'th group, from 0.
    fn id(&self, number: u32) -> Option<GroupId> {
        self.memberships.id(number)
    }

    /// Settles half a second later; gives what happened.
    fn settle(&mut self) -> Vec<Event> {
        for (mate, number) in self.team.iter_mut().zip(&self.serves) {
            mate.group = number.and_then(|number| self.memberships.id(number));
        }
        let mut events = Vec::new();
        let tracks: Vec<Track> = self.memberships.known().iter().map(|known| known.track).collect();
        Settling {
            now: Time::from_us(self.tick * 500_000),
            memberships: &mut self.memberships,
            agenda: &mut self.agenda,
            previous: &self.previous,
            team: &self.team,
            params: &self.params,
            events: &mut events,
            room: &mut self.room,
        }
        .settle();
        self.tick += 1;
        assert!(
            self.memberships.known().iter().zip(tracks).all(|(known, track)| known.track == track),
            "a membership is no estimate"
        );
        events
    }

    /// A target appears.
    fn appear(&mut self, id: u32, x_m: f64) {
        self.memberships.start(track(id, x_m));
    }

    /// Settles; gives the kinds of events.
    fn kinds(&mut self) -> Vec<&'static str> {
        self.settle().iter().map(|event| event.kind.name()).collect()
    }

    fn place(&mut self, id: u32, x_m: f64) {
        *self.memberships.track_mut(id as usize) = track(id, x_m);
    }

    /// Members of each group by number, those in dwell to it included.
    fn groups(&self) -> Vec<(u32, Vec<u32>)> {
        let members = |id| {
            let belongs = |known: &&Known| known.membership.groups().any(|group| group == id);
            self.memberships.known().iter().filter(belongs).map(|known| known.track.id.0).collect::<Vec<_>>()
        };
        let founded = (0..).map_while(|number| Some((number, members(self.id(number)?))));
        founded.filter(|(_, members)| !members.is_empty()).collect()
    }

    /// The first group, as if it had just been founded.
    fn first_group(&self) -> Group {
        let id = self.id(0).unwrap();
        Group::found(id, self.memberships.known(), self.memberships.of(id), &self.params).unwrap()
    }

    /// Every UAV serves the group that its id, halved, counts to.
    fn in_pairs(mut self) -> Self {
        self.serves = self.team.iter().map(|mate| Some(mate.uav.0 / 2)).collect();
        self
    }
}

fn cue(id: u32, x_m: f64) -> Cue {
    Cue {
        searcher: 0,
        said: Time::START,
        number: 0,
        label: TargetLabel(id),
        time: Time::START,
        position: Position::from_m(x_m, 0.0),
        velocity: Velocity::ZERO,
        position_sd_m: 1.0,
        velocity_sd_m_s: 1.0,
    }
}

/// A track that nobody has measured yet.
fn track(id: u32, x_m: f64) -> Track {
    Track::from_cue(&cue(id, x_m), &TeamParams::table_1().track, Time::START).unwrap()
}

/// Checks section IV.B.2, range rule: with Table I an orbit of 700 m holds a spread of 350 m; the furthest goes until
/// the rest fits.
#[test]
fn the_furthest_is_discarded_until_the_orbit_fits() {
    let mut world = World::new(2, &[0.0, 100.0, 200.0, 2000.0, 900.0]);
    assert_eq!(world.kinds(), ["group-founded", "discarded", "discarded"]);
    assert_eq!(world.groups(), [(0, vec![0, 1, 2])]);
    let mut fits = World::new(2, &[0.0, 699.0]);
    assert_eq!((fits.kinds(), fits.groups()), (vec!["group-founded"], vec![(0, vec![0, 1])]));
    let mut too_wide = World::new(2, &[0.0, 701.0]);
    assert_eq!(too_wide.kinds(), ["group-founded", "discarded"]);
}

/// Checks section IV.B.2, range rule, beyond the paper: a discarded target comes back when there is room to spare, not
/// as soon as it barely fits.
#[test]
fn a_discarded_target_is_taken_back_with_room_to_spare() {
    let mut world = World::new(2, &[0.0, 100.0, 1200.0]);
    assert_eq!(world.kinds(), ["group-founded", "discarded"]);
    // At 570 m the three need an orbit of some 693 m, more than 0.9 of 700 m; at 510 m, some 613 m.
    world.place(2, 570.0);
    assert_eq!((world.kinds(), world.groups()), (vec![], vec![(0, vec![0, 1])]));
    world.place(2, 510.0);
    assert_eq!((world.kinds(), world.groups()), (vec!["taken-back"], vec![(0, vec![0, 1, 2])]));
}

/// Four together and one far off: their centroid stands by the four, the smallest circle half-way. Its orbit of 640 m
/// holds all, where one about the centroid, 128 m from the four, needs 1024 m.
#[test]
fn the_smallest_circle_holds_what_the_centroid_lets_go() {
    let places = [0.0, 0.0, 0.0, 0.0, 640.0];
    let mut centroid = World::new(2, &places);
    assert_eq!(centroid.kinds(), ["group-founded", "discarded"]);
    let mut circle = World::new(2, &places);
    circle.params.group.centre = CentreEstimate::SmallestCircle;
    assert_eq!(circle.kinds(), ["group-founded"]);
    let group = circle.first_group();
    assert_eq!(group.centre.estimate().state.position(), Position::from_m(320.0, 0.0));
    assert!((group.standoff.unclamped_m - 640.0).abs() < 1e-9, "{:?}", group.standoff);
    // Too far off at 1200 m; taken back where the circle leaves room, 315 m about its centre.
    circle.place(4, 1200.0);
    assert_eq!(circle.kinds(), ["discarded"]);
    circle.place(4, 632.0);
    assert_eq!(circle.kinds(), [""; 0]);
    circle.place(4, 628.0);
    assert_eq!((circle.kinds(), circle.groups()), (vec!["taken-back"], vec![(0, vec![0, 1, 2, 3, 4])]));
}

/// Both ends of a row are as far from the middle, and the orbit of 800 m is too large. Without the last it needs 690 m,
/// without the first, who stands apart, 300 m.
#[test]
fn who_widens_the_orbit_most_is_let_go() {
    let row = |discard, x_m: &[f64]| {
        let mut world = World::new(2, x_m);
        (world.params.group.centre, world.params.group.discard) = (CentreEstimate::SmallestCircle, discard);
        let events = world.settle();
        let gone = events.iter().filter(|event| event.kind.name() == "discarded").filter_map(|event| event.track);
        gone.map(|track| track.0).collect::<Vec<_>>()
    };
    let apart = [0.0, 500.0, 600.0, 690.0, 800.0];
    assert_eq!(row(Discard::Furthest, &apart), [4]);
    assert_eq!(row(Discard::Widening, &apart), [0]);
    // Where it makes no difference, it is the same one.
    let even = [0.0, 400.0, 800.0];
    assert_eq!((row(Discard::Furthest, &even), row(Discard::Widening, &even)), (vec![2], vec![2]));
}

/// Checks section IV.B.2, convergence rule: an orbit that has run away for long enough loses its furthest target, which
/// does not come back while it moves away as fast.
#[test]
fn the_furthest_is_discarded_where_the_orbit_runs_away() {
    let mut world = World::new(2, &[0.0, 100.0, 300.0]);
    world.settle();
    let form = |world: &World, diverging_s| Group {
        diverging: Duration::from_s(diverging_s),
        threshold_m2_s: Some(-9000.0),
        ..world.first_group()
    };
    world.previous = vec![form(&world, 3.0)];
    assert_eq!(world.kinds(), [""; 0]);
    world.previous = vec![form(&world, 3.5)];
    let events = world.settle();
    assert_eq!(events.len(), 1, "{events:?}");
    assert_eq!((events[0].kind.name(), events[0].track), ("discarded", Some(TrackId(2))));
    let EventKind::DiscardedDiverging { threshold_m2_s, .. } = events[0].kind else { panic!("{events:?}") };
    assert_eq!(threshold_m2_s, -9000.0);
}

/// Checks Algorithm 1: 4 UAVs watch two groups; where there is but one target, one.
#[test]
fn half_as_many_groups_as_uavs() {
    let mut world = World::new(4, &[0.0, 900.0, 30.0, 930.0]);
    assert_eq!(world.kinds(), ["group-founded", "group-founded"]);
    assert_eq!(world.groups(), [(0, vec![0, 2]), (1, vec![1, 3])]);
    let mut alone = World::new(4, &[5.0]);
    assert_eq!((alone.kinds(), alone.groups()), (vec!["group-founded"], vec![(0, vec![0])]));
    let mut nothing = World::new(4, &[]);
    assert_eq!((nothing.kinds(), nothing.groups()), (vec![], vec![]));
}

/// Checks section IV.B.1 and Eq. (34)'s place in it: requested, in both groups for the dwell, completed.
#[test]
fn a_target_that_drives_over_is_handed_over() {
    let mut world = World::new(4, &[0.0, 40.0, 80.0, 600.0, 640.0]).in_pairs();
    world.settle();
    assert_eq!(world.groups(), [(0, vec![0, 1, 2]), (1, vec![3, 4])]);
    world.place(2, 420.0);
    let events = world.settle();
    assert_eq!((events.len(), events[0].kind.name(), events[0].group, events[0].to), {
        (1, "handoff-requested", world.id(0), world.id(1))
    });
    let EventKind::HandoffRequested { dwell_s } = events[0].kind else { panic!("{events:?}") };
    assert!((3.0..30.0).contains(&dwell_s), "{dwell_s}");
    assert_eq!(world.groups(), [(0, vec![0, 1, 2]), (1, vec![2, 3, 4])]);
    assert_eq!(
        (world.memberships.known()[2].group(), world.memberships.known()[2].receiving_group()),
        (world.id(0), world.id(1))
    );
    let mut waited_s = 0.5;
    while waited_s < dwell_s {
        assert_eq!(world.kinds(), [""; 0], "after {waited_s} s");
        waited_s += 0.5;
    }
    assert_eq!(world.kinds(), ["handoff-completed"]);
    assert_eq!(world.groups(), [(0, vec![0, 1]), (1, vec![2, 3, 4])]);
}

/// A target that is back where it came from at the end of the dwell stays there.
#[test]
fn a_handoff_is_withdrawn_where_the_target_comes_back() {
    let mut world = World::new(4, &[0.0, 40.0, 80.0, 600.0, 640.0]).in_pairs();
    world.settle();
    world.place(2, 420.0);
    assert_eq!(world.kinds(), ["handoff-requested"]);
    world.place(2, 60.0);
    let kinds: Vec<_> = (0..60).flat_map(|_| world.kinds()).collect();
    assert_eq!(kinds, ["handoff-withdrawn"]);
    assert_eq!(world.groups(), [(0, vec![0, 1, 2]), (1, vec![3, 4])]);
}

/// A target that no receiving UAV gets into view stays where it was, and it is tried again.
#[test]
fn a_handoff_is_withdrawn_where_nobody_sees_the_target() {
    let mut world = World::new(4, &[0.0, 40.0, 80.0, 600.0, 640.0]).in_pairs();
    world.settle();
    world.params.track.sensor.sensing_range_m = 300.0;
    world.place(2, 420.0);
    assert_eq!(world.kinds(), ["handoff-requested"]);
    let events: Vec<_> = (0..60).flat_map(|_| world.settle()).collect();
    assert_eq!(events[0].kind, EventKind::HandoffWithdrawn(WithdrawalReason::NotSeen), "{events:?}");
}

/// A target that jumps over the border and back at every instant changes groups at most once in a dwell.
#[test]
fn an_oscillating_target_changes_groups_at_most_once_in_a_dwell() {
    let mut world = World::new(4, &[0.0, 40.0, 310.0, 600.0, 640.0]).in_pairs();
    world.settle();
    let mut requests = 0;
    for tick in 0..400 {
        world.place(2, if tick % 2 == 0 { 420.0 } else { 220.0 });
        requests += world.kinds().iter().filter(|kind| **kind == "handoff-requested").count();
    }
    // 200 s at 3 s or more each.
    assert!((1..=66).contains(&requests), "{requests}");
}

/// Without the dwell, as in figure 11a, groups change at once.
#[test]
fn without_a_dwell_the_group_changes_at_once() {
    let mut world = World::new(4, &[0.0, 40.0, 80.0, 600.0, 640.0]).in_pairs();
    (world.params.group.dwell_min_s, world.params.group.dwell_max_s) = (0.0, 0.0);
    world.settle();
    world.place(2, 420.0);
    assert_eq!(world.kinds(), ["handoff-requested", "handoff-completed"]);
    assert_eq!(world.groups(), [(0, vec![0, 1]), (1, vec![2, 3, 4])]);
}

/// A group that cannot hold a target it is passing on passes it at once; one that cannot hold a target it is receiving
/// gives it back.
#[test]
fn a_dwell_ends_early_where_an_orbit_cannot_hold_both() {
    let handed_over = || {
        let mut world = World::new(4, &[0.0, 40.0, 80.0, 600.0, 640.0]).in_pairs();
        world.settle();
        world.place(2, 420.0);
        world.settle();
        world
    };
    let mut passing = handed_over();
    passing.place(2, 700.0);
    let events = passing.settle();
    assert_eq!(events[0].kind, EventKind::HandoffCompleted(CompletionReason::PassingCannotHold), "{events:?}");
    // Where orbits take their time, only if the other one's UAVs see it by now; else it is let go.
    let mut unseen = handed_over();
    unseen.params.group.motion.response_s = 1.5;
    unseen.team.iter_mut().for_each(|mate| mate.boresight = None);
    unseen.place(2, 700.0);
    let events = unseen.settle();
    assert!(matches!(events[0].kind, EventKind::Discarded { .. }), "{events:?}");
    let mut receiving = handed_over();
    receiving.place(4, 1300.0);
    let events = receiving.settle();
    assert_eq!(events[0].kind, EventKind::HandoffWithdrawn(WithdrawalReason::ReceivingCannotHold), "{events:?}");
}

/// A newcomer nearby joins; far away it stays outside while all groups are in use.
#[test]
fn a_newcomer_joins_if_it_fits_and_stays_outside_if_not() {
    let mut world = World::new(2, &[0.0, 100.0]);
    world.settle();
    world.appear(2, 300.0);
    world.appear(3, 3000.0);
    assert_eq!((world.kinds(), world.groups()), (vec!["joined"], vec![(0, vec![0, 1, 2])]));
}

/// Out of view of the group's UAVs a newcomer is not their duty yet: the orbit makes room for it first.
#[test]
fn a_newcomer_out_of_view_is_received_when_it_is_seen() {
    let mut world = World::new(2, &[0.0, 100.0]).in_pairs();
    world.settle();
    world.params.track.sensor.sensing_range_m = 10.0;
    world.appear(2, 300.0);
    assert_eq!(world.kinds(), ["joined"]);
    assert_eq!(
        (world.memberships.known()[2].group(), world.memberships.known()[2].receiving_group()),
        (None, world.id(0))
    );
    world.params.track.sensor.sensing_range_m = 1e5;
    assert_eq!((world.kinds(), world.memberships.known()[2].group()), (vec![], world.id(0)));
    // One that is never seen is left out in the end.
    world.params.track.sensor.sensing_range_m = 10.0;
    world.appear(3, 310.0);
    let kinds: Vec<_> = (0..62).flat_map(|_| world.kinds()).collect();
    assert_eq!(kinds[..2], ["joined", "left-out"]);
}

/// When targets appear that make room for another group, the widest one splits; its larger part stays itself.
#[test]
fn with_uavs_to_spare_the_widest_group_splits() {
    let mut world = World::new(4, &[0.0]).in_pairs();
    world.settle();
    for (id, x_m) in [(1, 300.0), (2, 310.0)] {
        world.appear(id, x_m);
    }
    assert_eq!(world.kinds(), ["joined", "joined", "regrouped", "group-founded"]);
    assert_eq!(world.groups(), [(0, vec![1, 2]), (1, vec![0])]);
}

/// Fewer UAVs serve fewer groups: the smallest ends, and its target joins another if it can.
#[test]
fn with_fewer_uavs_the_smallest_group_ends() {
    let mut world = World::new(4, &[0.0, 100.0, 500.0]);
    world.settle();
    assert_eq!(world.groups(), [(0, vec![0, 1]), (1, vec![2])]);
    world.team.truncate(2);
    assert_eq!(world.kinds(), ["group-dissolved", "left-out", "joined"]);
    assert_eq!(world.groups(), [(0, vec![0, 1, 2])]);
}

/// Where far more targets can be watched together than a group has, its UAVs go there half a minute later; but not to
/// targets that they may never reach.
#[test]
fn uavs_go_where_more_can_be_watched() {
    let gone = |x_m: f64| {
        let mut world = World::new(2, &[0.0, 40.0]).in_pairs();
        world.params.track.sensor.sensing_range_m = 1200.0;
        world.settle();
        for id in 2..6 {
            world.appear(id, x_m + 10.0 * f64::from(id));
        }
        let mut kinds: Vec<_> = (0..59).flat_map(|_| world.kinds()).collect();
        assert_eq!(kinds, [""; 0]);
        kinds.extend((0..10).flat_map(|_| world.kinds()));
        kinds.dedup();
        (kinds, world.groups())
    };
    let (kinds, groups) = gone(2000.0);
    assert_eq!(kinds, ["group-dissolved", "left-out", "joined", "group-founded"]);
    assert_eq!(groups, [(1, vec![2, 3, 4, 5])]);
    // 1,200 m of range and half a minute at 40 m/s are 2,400 m.
    assert_eq!(gone(2500.0).0, [""; 0]);
}

/// Two groups side by side are one where the other's UAVs can watch somebody who is in no group.
#[test]
fn a_group_that_a_neighbour_can_hold_makes_way() {
    let mut world = World::new(4, &[0.0, 30.0, 130.0, 160.0]).in_pairs();
    world.settle();
    assert_eq!(world.groups(), [(0, vec![0, 1]), (1, vec![2, 3])]);
    world.appear(4, 1000.0);
    let events: Vec<_> = (0..65).flat_map(|_| world.settle()).collect();
    let kinds: Vec<_> = events.iter().map(|event| event.kind.name()).collect();
    assert_eq!(kinds, ["group-dissolved", "regrouped", "regrouped", "joined", "group-founded"]);
    let merged = DissolutionReason::Merged { into: world.id(1).unwrap(), together: 1 };
    assert_eq!(events[0].kind, EventKind::GroupDissolved(merged));
    assert_eq!(world.groups(), [(1, vec![0, 1, 2, 3]), (2, vec![4])]);
}

/// A handoff that was withdrawn is not requested again at once.
#[test]
fn a_withdrawn_handoff_waits_for_a_dwell() {
    let mut world = World::new(4, &[0.0, 40.0, 80.0, 600.0, 640.0]).in_pairs();
    world.settle();
    world.place(2, 420.0);
    world.settle();
    // The receiving group spreads until it cannot hold the target with its own.
    world.place(4, 1300.0);
    assert_eq!(world.kinds(), ["handoff-withdrawn", "discarded"]);
    world.place(4, 640.0);
    let kinds: Vec<_> = (0..5).map(|_| world.kinds()).collect();
    assert!(kinds[..2].iter().all(|kinds| !kinds.contains(&"handoff-requested")), "{kinds:?}");
}

/// Beyond section IV.B.2: of a group that outruns the UAVs the fastest goes first.
#[test]
fn the_fastest_is_discarded_where_the_group_outruns_the_uavs() {
    let mut world = World::new(2, &[0.0, 30.0, 60.0]).in_pairs();
    world.settle();
    let fast = |id, x_m, speed_m_s| {
        let cue = Cue { velocity: Velocity::from_m_s(speed_m_s, 0.0), ..cue(id, x_m) };
        Track::from_cue(&cue, &TeamParams::table_1().track, Time::START).unwrap()
    };
    for (id, speed_m_s) in [(0, 80.0), (1, 10.0), (2, 90.0)] {
        *world.memberships.track_mut(id as usize) = fast(id, 30.0 * f64::from(id), speed_m_s);
    }
    let mut group = world.first_group();
    for _ in 0..7 {
        let (guidance, orbit) = (&world.params.guidance, group.orbit(&world.params));
        let place = |mate: &Teammate| (mate.state.position, OnOrbit::of(guidance, mate.state.position, &orbit));
        let crew: Vec<_> = world.team.iter().map(place).collect();
        let crew = crew.iter().map(|(position, on_orbit)| (*position, on_orbit));
        group.judge(crew, Duration::from_s(0.5), &world.params);
    }
    assert_eq!(group.outrun, Duration::from_s(3.5));
    world.previous = vec![group];
    let events = world.settle();
    assert_eq!((events.len(), events[0].kind.name(), events[0].track), (1, "discarded", Some(TrackId(2))));
    assert!(matches!(events[0].kind, EventKind::DiscardedTooFast { speed_m_s: 90.0, .. }), "{events:?}");
    // It is not taken back while it is that fast.
    world.previous.clear();
    assert!(!world.kinds().contains(&"taken-back"));
}

#[test]
fn coinciding_targets_are_no_trouble() {
    let mut world = World::new(6, &[5.0, 5.0, 5.0]);
    assert_eq!(world.kinds(), ["group-founded", "group-founded", "group-founded"]);
    assert_eq!(world.kinds(), [""; 0]);
}

/// Targets in groups of these numbers, one UAV to each, groups by need.
fn by_need(uavs: u32, x_m: &[f64], groups: &[u32]) -> World {
    let mut world = World::new(uavs, x_m);
    world.params.group.count = GroupCount::Needed;
    for number in 0..groups.iter().max().map_or(0, |last| last + 1) {
        let places: Vec<usize> = (0..groups.len()).filter(|place| groups[*place] == number).collect();
        let id = world.memberships.new_group(Time::START, places.iter().copied());
        places.iter().for_each(|place| world.memberships.set(*place, Membership::Member(id)));
    }
    let ids = world.memberships.groups().to_vec();
    let found = |id| Group::found(id, world.memberships.known(), world.memberships.of(id), &world.params);
    world.previous = ids.into_iter().filter_map(found).collect();
    world.serves = world.team.iter().map(|mate| Some(mate.uav.0)).collect();
    world
}

/// Two clusters 2 km apart are two groups for two UAVs, where half as many would be one; one cluster is one group of
/// two; a third cluster waits, for there are no UAVs.
#[test]
fn there_are_as_many_groups_as_it_takes() {
    let mut two = by_need(2, &[0.0, 30.0, 2000.0, 2030.0], &[]);
    assert_eq!(two.kinds(), ["joined", "joined", "group-founded", "joined", "joined", "group-founded"]);
    assert_eq!(two.groups(), [(0, vec![0, 1]), (1, vec![2, 3])]);
    let reason = |world: &mut World| {
        world.memberships.start(track(9, 9000.0));
        world.settle().iter().find_map(|event| match event.kind {
            EventKind::GroupFounded { members: 1, reason } => Some(reason),
            _ => None,
        })
    };
    // The second of two groups takes a UAV from the first; of four UAVs each has two.
    assert_eq!(reason(&mut by_need(2, &[0.0], &[0])), Some(FoundingReason::Scarce));
    assert_eq!(reason(&mut by_need(4, &[0.0], &[0])), Some(FoundingReason::Unassigned));
    two.appear(4, 4000.0);
    assert_eq!((two.kinds(), two.groups().len()), (vec![], 2));
    let mut one = by_need(2, &[0.0, 30.0, 60.0, 90.0], &[]);
    one.settle();
    assert_eq!(one.groups(), [(0, vec![0, 1, 2, 3])]);
}

/// Two targets 300 m apart need one orbit of 300 m; four UAVs are a pair to each all the same, and no more groups than
/// that while nobody is left outside.
#[test]
fn where_everybody_is_held_each_group_has_two_uavs() {
    let world = by_need(4, &[0.0, 300.0, 310.0], &[]);
    assert_eq!(world.groups(), []);
    let mut world = world;
    world.settle();
    assert_eq!(world.groups(), [(0, vec![0]), (1, vec![1, 2])]);
}

/// Two targets need an orbit of 590 m, at most 0.85 of 700 m: one group is enough while a third target, far away, has no
/// UAV. The other ends once the first holds its target, and whoever appears meanwhile joins the first.
#[test]
fn a_group_that_others_hold_is_wound_up() {
    let with_a_third = |at_m: f64| {
        let mut world = by_need(2, &[0.0, at_m], &[0, 1]);
        world.params.group.centre = CentreEstimate::SmallestCircle;
        world.appear(9, 9000.0);
        world
    };
    // An orbit of 600 m is too full for that; the review merges the two at once.
    assert_eq!(with_a_third(600.0).kinds()[0], "group-dissolved");
    let mut world = with_a_third(590.0);
    assert_eq!(world.kinds(), ["handoff-requested"]);
    let passed = |world: &World| world.memberships.known()[1].membership;
    assert_eq!((passed(&world).group(), passed(&world).receiving_group()), (world.id(1), world.id(0)));
    world.appear(2, 589.0);
    assert_eq!((world.kinds(), world.groups()), (vec!["joined"], vec![(0, vec![0, 1, 2]), (1, vec![1])]));
    let events: Vec<_> = (0..60).flat_map(|_| world.settle()).take(2).collect();
    assert_eq!(events[0].kind, EventKind::HandoffCompleted(CompletionReason::Received));
    assert_eq!(events[1].kind, EventKind::GroupDissolved(DissolutionReason::NotNeeded));
    world.settle();
    assert_eq!(world.groups(), [(0, vec![0, 1, 2]), (2, vec![9])]);
}

/// Of two groups that could hold each other's target, that ends which is nearer to whoever is unwatched: its UAV has less
/// far to fly. So it is where one is wound up, and where the review merges two.
#[test]
fn the_group_that_is_nearest_to_who_is_unwatched_makes_way() {
    let first = |apart_m: f64, unwatched_m: f64| {
        let mut world = by_need(2, &[0.0, apart_m], &[0, 1]);
        world.params.group.centre = CentreEstimate::SmallestCircle;
        world.appear(9, unwatched_m);
        let event = world.settle()[0];
        (event.kind.name(), event.group.and_then(|group| world.memberships.number(group)))
    };
    let passes = |unwatched_m| first(590.0, unwatched_m);
    assert_eq!(passes(9000.0), ("handoff-requested", Some(1)));
    assert_eq!(passes(-9000.0), ("handoff-requested", Some(0)));
    let ends = |unwatched_m| first(600.0, unwatched_m);
    assert_eq!(ends(9000.0), ("group-dissolved", Some(1)));
    assert_eq!(ends(-9000.0), ("group-dissolved", Some(0)));
}

/// One unwatched target of eleven is not worth a UAV's way, one of ten is; so are two that one orbit holds, and two apart
/// are not. So it is where one group could be wound up, and where two could be merged.
#[test]
fn no_group_makes_way_for_one_of_many() {
    let happens = |apart_m: f64, watched: usize, unwatched_m: &[f64]| {
        let mut places: Vec<f64> = vec![0.0; watched - 1];
        places.push(apart_m);
        let mut groups = vec![0; watched - 1];
        groups.push(1);
        let mut world = by_need(2, &places, &groups);
        world.params.group.centre = CentreEstimate::SmallestCircle;
        (50..).zip(unwatched_m).for_each(|(id, x_m)| world.appear(id, *x_m));
        world.kinds().first().copied()
    };
    for (apart_m, first) in [(590.0, "handoff-requested"), (600.0, "group-dissolved")] {
        assert_eq!(happens(apart_m, 10, &[9000.0]), None);
        assert_eq!(happens(apart_m, 9, &[9000.0]), Some(first));
        assert_eq!(happens(apart_m, 19, &[9000.0, 9100.0]), Some(first));
        assert_eq!(happens(apart_m, 19, &[9000.0, -9000.0]), None);
    }
}

/// Where nobody is unwatched, a UAV to each group stays where it is: nothing is flown for a pair alone. Nor is that a
/// review: whoever is unwatched later does not wait for the next one.
#[test]
fn no_group_is_wound_up_for_nobody() {
    let mut world = by_need(2, &[0.0, 590.0], &[0, 1]);
    world.params.group.centre = CentreEstimate::SmallestCircle;
    assert_eq!(world.kinds(), [""; 0]);
    world.appear(9, 9000.0);
    assert_eq!(world.kinds(), ["handoff-requested"]);
}

/// A target that the other group's UAVs do not see is not passed on: its group stays, and it takes in again.
#[test]
fn a_group_whose_target_nobody_else_sees_stays() {
    let mut world = by_need(2, &[0.0, 590.0], &[0, 1]);
    world.appear(9, 9000.0);
    world.params.track.sensor.sensing_range_m = 10.0;
    // The longest dwell is half a minute, the next review as long after it.
    let kinds: Vec<_> = (0..115).flat_map(|_| world.kinds()).collect();
    assert_eq!(kinds, ["handoff-requested", "handoff-withdrawn"]);
    assert_eq!(world.agenda.winding_up, None);
    assert_eq!(world.groups(), [(0, vec![0]), (1, vec![1])]);
}

/// Of a group that is wound up, the target at 520 m goes where it is held: with five at 0 m the circle takes an orbit of
/// 520 m, with those at 700 m and 1,200 m one of 680 m, though their centroid, at 950 m, is nearer than that of the six,
/// at 87 m.
#[test]
fn clustering_has_no_say_in_a_winding_up() {
    let mut world = by_need(3, &[0.0, 0.0, 0.0, 0.0, 0.0, 700.0, 1200.0, 520.0], &[0, 0, 0, 0, 0, 1, 1, 2]);
    world.params.group.centre = CentreEstimate::SmallestCircle;
    world.appear(9, 9000.0);
    let mut kinds: Vec<_> = (0..60).flat_map(|_| world.kinds()).collect();
    kinds.truncate(3);
    assert_eq!(kinds, ["handoff-requested", "handoff-completed", "group-dissolved"]);
    assert_eq!(world.groups(), [(0, vec![0, 1, 2, 3, 4, 7]), (1, vec![5, 6]), (3, vec![9])]);
}

/// About a group's orbit of 250 m a sensor that sees all round holds whoever is within 250 m of its centre: further out
/// a target that is seen is no member yet. Nor is it while its UAV, 400 m from the centre, might get out of the sensor's
/// range by flying on and turning, 267 m further; unless it is near the orbit, to a turn's radius.
#[test]
fn a_target_is_held_where_the_orbit_as_flown_holds_it() {
    let member = |x_m: f64, sensing_range_m: f64, away_m: f64| {
        let mut world = by_need(1, &[0.0], &[0]);
        world.team[0].state.position = Position::from_m(0.0, -away_m);
        world.params.group.motion.response_s = 1.5;
        world.params.track.sensor.sensing_range_m = sensing_range_m;
        world.appear(1, x_m);
        assert_eq!(world.kinds(), ["joined"]);
        world.memberships.known()[1].group().and_then(|group| world.memberships.number(group))
    };
    let held = Some(0);
    assert_eq!((member(249.0, 1e5, 400.0), member(251.0, 1e5, 400.0)), (held, None));
    assert_eq!((member(0.0, 670.0, 400.0), member(0.0, 660.0, 400.0)), (held, None));
    assert_eq!((member(0.0, 450.0, 383.0), member(0.0, 450.0, 384.0)), (held, None));
}

/// Two whom an orbit held a moment ago: from 700 m apart on it does no longer, however near one of them still is to where
/// its centre was.
#[test]
fn a_group_that_fitted_is_judged_again() {
    let kinds = |apart_m: f64| {
        let mut world = by_need(1, &[0.0, 200.0], &[0, 0]);
        world.params.group.centre = CentreEstimate::SmallestCircle;
        world.previous = vec![world.first_group()];
        world.place(1, apart_m);
        world.kinds()
    };
    assert_eq!((kinds(699.0), kinds(701.0)), (vec![], vec!["discarded"]));
}

/// A circle that needs an orbit of 660 m has no room to spare, 0.9 of 700 m; but whoever is inside widens nothing.
#[test]
fn whoever_is_inside_the_circle_is_taken_in() {
    let kinds = |x_m: f64| {
        let mut world = by_need(1, &[0.0, 660.0], &[0, 0]);
        world.params.group.centre = CentreEstimate::SmallestCircle;
        world.appear(2, x_m);
        world.kinds()
    };
    assert_eq!((kinds(330.0), kinds(-1.0)), (vec!["joined"], vec![]));
}

/// An orbit that shrinks by 100 m/s leaves its UAV behind (Lemma 3.1), but no target would be kept by letting another go.
#[test]
fn an_orbit_that_shrinks_runs_away_from_nobody() {
    let diverging_s = |rate_m_s: f64, response_s: f64| {
        let world = by_need(1, &[0.0, 200.0], &[0, 0]);
        let mut params = world.params;
        params.group.motion.response_s = response_s;
        let mut group =
            Group::found(world.id(0).unwrap(), world.memberships.known(), [0, 1].into_iter(), &params).unwrap();
        group.standoff.rate_m_s = rate_m_s;
        // Outside an orbit of 250 m about (100, 0) that shrinks, inside one that grows.
        let uav = Position::from_m(if rate_m_s < 0.0 { 360.0 } else { 300.0 }, 10.0);
        let on_orbit = OnOrbit::of(&params.guidance, uav, &group.orbit(&params));
        group.judge([(uav, &on_orbit)].into_iter(), Duration::from_s(0.5), &params);
        (group.threshold_m2_s.unwrap() < -params.group.convergence_limit_m2_s, group.diverging.s())
    };
    assert_eq!((diverging_s(-100.0, 0.0), diverging_s(-100.0, 1.5)), ((true, 0.5), (true, 0.0)));
    assert_eq!((diverging_s(100.0, 0.0), diverging_s(100.0, 1.5)), ((true, 0.5), (true, 0.5)));
}
