use super::*;
use crate::angle::Angle;
use crate::coordination::event::GroupCreatedReason;
use crate::frame::Velocity;
use crate::guidance::heading::OrbitRelativeState;
use crate::message::{Cue, Report};
use crate::params::{CentreEstimate, GroupCount, Margin, RemovalRule};
use crate::tracking::track::Track;
use crate::uav::{UavId, UavState};

/// Targets in known positions and groups without motion of the UAVs: only memberships change.
struct World {
    memberships: Memberships,
    team: Vec<Teammate>,
    params: TeamParams,
    previous: Vec<Group>,
    tick: i64,
    agenda: GroupingState,
    room: GroupingBuffers,
    /// Creation index of each UAV's assigned group, once it is created.
    serves: Vec<Option<u32>>,
}

impl World {
    /// Stationary targets at these positions east, and this number of UAVs at one position 400 m south of the origin.
    fn new(uavs: u32, x_m: &[f64]) -> Self {
        let state = UavState::level_flight(Position::from_m(0.0, -400.0), Angle::ZERO, 40.0);
        let boresight = Some(Angle::from_deg(90.0));
        let report = |id| Report { boresight, ..Report::position_only(UavId(id), Time::EPOCH, state) };
        let teammate = |id| Teammate::from_report(&report(id), None, Time::EPOCH);
        let mut params = TeamParams::paper();
        params.group.regrouping_period_s = 30.0;
        // A field of view so wide that every target is always in view; the effect of the view is tested separately.
        params.track.sensor.field_of_view_rad = crate::math::TAU;
        // The orbits remain those of a usable field of view of 60 degrees.
        params.group.standoff.field_of_view_margin_rad = crate::math::TAU - 60f64.to_radians();
        params.track.sensor.sensing_range_m = 1e5;
        (params.group.margin, params.group.margin_sds) = (Margin::StandardDeviations, 0.0);
        let mut memberships = Memberships::default();
        (0..).zip(x_m).for_each(|(id, x_m)| memberships.start(track(id, *x_m)));
        Self {
            memberships,
            team: (0..uavs).map(teammate).collect(),
            params,
            previous: Vec::new(),
            tick: 0,
            agenda: GroupingState::default(),
            room: GroupingBuffers::default(),
            serves: vec![None; uavs as usize],
        }
    }

    /// Id of a group from its creation index.
    fn id(&self, number: u32) -> Option<GroupId> {
        self.memberships.id(number)
    }

    /// Updates the memberships half a second later; returns the events.
    fn settle(&mut self) -> Vec<Event> {
        for (teammate, number) in self.team.iter_mut().zip(&self.serves) {
            teammate.group = number.and_then(|number| self.memberships.id(number));
        }
        let mut events = Vec::new();
        let tracks: Vec<Track> = self.memberships.tracks().iter().map(|known| known.track).collect();
        Grouping {
            now: Time::from_us(self.tick * 500_000),
            memberships: &mut self.memberships,
            state: &mut self.agenda,
            previous: &self.previous,
            team: &self.team,
            params: &self.params,
            events: &mut events,
            buffers: &mut self.room,
        }
        .update();
        self.tick += 1;
        assert!(
            self.memberships.tracks().iter().zip(tracks).all(|(known, track)| known.track == track),
            "memberships must not change tracks"
        );
        events
    }

    /// Adds a target.
    fn appear(&mut self, id: u32, x_m: f64) {
        self.memberships.start(track(id, x_m));
    }

    /// Updates the memberships; returns the kinds of the events.
    fn kinds(&mut self) -> Vec<&'static str> {
        self.settle().iter().map(|event| event.kind.name()).collect()
    }

    fn track_index(&mut self, id: u32, x_m: f64) {
        *self.memberships.track_mut(id as usize) = track(id, x_m);
    }

    /// Members of each group by creation index, including those in handoff to it.
    fn groups(&self) -> Vec<(u32, Vec<u64>)> {
        let members = |id| {
            let belongs = |known: &&GroupedTrack| known.membership.groups().any(|group| group == id);
            self.memberships.tracks().iter().filter(belongs).map(|known| known.track.id.0).collect::<Vec<_>>()
        };
        let groups = (0..).map_while(|number| Some((number, members(self.id(number)?))));
        groups.filter(|(_, members)| !members.is_empty()).collect()
    }

    /// The first group, as if it had just been created.
    fn first_group(&self) -> Group {
        let id = self.id(0).unwrap();
        Group::create(id, self.memberships.tracks(), self.memberships.of(id), &self.params).unwrap()
    }

    /// Sets the priorities of some targets.
    fn with_priorities(mut self, priorities: &[(u64, f64)]) -> Self {
        let priorities: Vec<_> = priorities.iter().map(|(id, priority)| (TrackId(*id), *priority)).collect();
        assert!(self.memberships.restore_priorities(&priorities));
        self.memberships.update_priorities(&[]);
        self
    }

    /// Assigns every UAV to the group whose index is half the UAV's id.
    fn in_pairs(mut self) -> Self {
        self.serves = self.team.iter().map(|teammate| Some(teammate.uav.0 / 2)).collect();
        self
    }
}

fn cue(id: u32, x_m: f64) -> Cue {
    Cue { position_sd_m: 1.0, velocity_sd_m_s: 1.0, ..Cue::at(id, Position::from_m(x_m, 0.0)) }
}

/// A track without measurements.
fn track(id: u32, x_m: f64) -> Track {
    Track::from_cue(&cue(id, x_m), &TeamParams::paper().track, Time::EPOCH).unwrap()
}

/// Checks section IV.B.2, range rule: with Table I, an orbit of 700 m contains a spread of 350 m; the furthest target
/// is removed until the rest fits.
#[test]
fn the_furthest_target_is_removed_until_the_orbit_fits() {
    let mut world = World::new(2, &[0.0, 100.0, 200.0, 2000.0, 900.0]);
    assert_eq!(world.kinds(), ["group-created", "removed", "removed"]);
    assert_eq!(world.groups(), [(0, vec![0, 1, 2])]);
    let mut fits = World::new(2, &[0.0, 699.0]);
    assert_eq!((fits.kinds(), fits.groups()), (vec!["group-created"], vec![(0, vec![0, 1])]));
    let mut too_wide = World::new(2, &[0.0, 701.0]);
    assert_eq!(too_wide.kinds(), ["group-created", "removed"]);
}

/// Checks section IV.B.2, range rule, beyond the paper: a removed target is readmitted when there is room to spare, not
/// as soon as it barely fits.
#[test]
fn a_removed_target_is_readmitted_with_room_to_spare() {
    let mut world = World::new(2, &[0.0, 100.0, 1200.0]);
    assert_eq!(world.kinds(), ["group-created", "removed"]);
    // At 570 m the three need an orbit of some 693 m, more than 0.9 of 700 m; at 510 m, some 613 m.
    world.track_index(2, 570.0);
    assert_eq!((world.kinds(), world.groups()), (vec![], vec![(0, vec![0, 1])]));
    world.track_index(2, 510.0);
    assert_eq!((world.kinds(), world.groups()), (vec!["readmitted"], vec![(0, vec![0, 1, 2])]));
}

/// Four targets are together and one is far away: their centroid is near the four, the centre of the minimum enclosing
/// circle halfway. Its orbit of 640 m contains all, while one around the centroid, 128 m from the four, needs 1024 m.
#[test]
fn the_minimum_enclosing_circle_keeps_targets_that_the_centroid_removes() {
    let track_indices = [0.0, 0.0, 0.0, 0.0, 640.0];
    let mut centroid = World::new(2, &track_indices);
    assert_eq!(centroid.kinds(), ["group-created", "removed"]);
    let mut circle = World::new(2, &track_indices);
    circle.params.group.centre = CentreEstimate::EnclosingCircle;
    assert_eq!(circle.kinds(), ["group-created"]);
    let group = circle.first_group();
    assert_eq!(group.centre.estimate().state.position(), Position::from_m(320.0, 0.0));
    assert!((group.standoff.unclamped_m - 640.0).abs() < 1e-9, "{:?}", group.standoff);
    // Too far at 1200 m; readmitted when the circle leaves room, 315 m around its centre.
    circle.track_index(4, 1200.0);
    assert_eq!(circle.kinds(), ["removed"]);
    circle.track_index(4, 632.0);
    assert_eq!(circle.kinds(), [""; 0]);
    circle.track_index(4, 628.0);
    assert_eq!((circle.kinds(), circle.groups()), (vec!["readmitted"], vec![(0, vec![0, 1, 2, 3, 4])]));
}

/// Both ends of a row are equally far from the middle, and the orbit of 800 m is too large. Without the last target it
/// needs 690 m, without the first one, which is isolated, 300 m.
#[test]
fn the_target_that_widens_the_orbit_most_is_removed() {
    let row = |removal, x_m: &[f64]| {
        let mut world = World::new(2, x_m);
        (world.params.group.centre, world.params.group.removal) = (CentreEstimate::EnclosingCircle, removal);
        let events = world.settle();
        let removed = events.iter().filter(|event| event.kind.name() == "removed").filter_map(|event| event.track);
        removed.map(|track| track.0).collect::<Vec<_>>()
    };
    let apart = [0.0, 500.0, 600.0, 690.0, 800.0];
    assert_eq!(row(RemovalRule::FurthestFromCentre, &apart), [4]);
    assert_eq!(row(RemovalRule::LargestRadiusReduction, &apart), [0]);
    // If it makes no difference, both rules remove the same target.
    let even = [0.0, 400.0, 800.0];
    assert_eq!(
        (row(RemovalRule::FurthestFromCentre, &even), row(RemovalRule::LargestRadiusReduction, &even)),
        (vec![2], vec![2])
    );
}

/// An orbit contains targets up to 700 m apart. The order of removal is used that keeps the higher total priority.
#[test]
fn the_lower_total_priority_is_removed() {
    let removed = |x_m: &[f64], priority: f64, removal| {
        let mut world = World::new(2, x_m).with_priorities(&[(0, priority)]);
        (world.params.group.centre, world.params.group.removal) = (CentreEstimate::EnclosingCircle, removal);
        let removed = world.settle().into_iter().filter(|event| event.kind.name() == "removed");
        removed.filter_map(|event| event.track).map(|track| track.0).collect::<Vec<_>>()
    };
    let isolated = [0.0, 500.0, 600.0, 690.0, 800.0];
    let distant = [0.0, 800.0, 810.0, 820.0, 830.0];
    for rule in [RemovalRule::LargestRadiusReduction, RemovalRule::FurthestFromCentre] {
        assert_eq!(removed(&isolated, 1.5, rule), [4]);
        assert_eq!(removed(&distant, 3.0, rule), [0]);
        let mut others = removed(&distant, 5.0, rule);
        others.sort_unstable();
        assert_eq!(others, [1, 2, 3, 4]);
        // A target of low priority is removed although another one widens the orbit more.
        assert_eq!(removed(&[800.0, 0.0, 400.0, 500.0, 690.0], 0.5, rule), [0]);
    }
}

/// A group admits a target of higher priority instead of one that then does not fit. A target far from all members
/// gets a new group only if its priority exceeds theirs.
#[test]
fn a_target_displaces_others_of_lower_total_priority() {
    let settled = |x_m: f64, priority: f64| {
        let mut world = World::new(1, &[-300.0, 0.0, 20.0]);
        world.params.group.centre = CentreEstimate::EnclosingCircle;
        world.params.group.count = GroupCount::AsNeeded;
        world.settle();
        world.serves = vec![Some(0)];
        world.appear(3, x_m);
        let mut world = if priority == 1.0 { world } else { world.with_priorities(&[(3, priority)]) };
        (world.kinds(), world.groups())
    };
    let (kinds, groups) = settled(500.0, 1.0);
    assert_eq!((kinds, groups), (vec![""; 0], vec![(0, vec![0, 1, 2])]));
    assert_eq!(settled(500.0, 1.5), (vec!["admitted", "removed"], vec![(0, vec![1, 2, 3])]));
    assert_eq!(settled(1500.0, 3.0).1, [(0, vec![0, 1, 2])]);
    let (kinds, groups) = settled(1500.0, 3.5);
    assert_eq!((kinds[0], groups), ("group-retired", vec![(1, vec![3])]));
    // UAVs cannot bring it within sensing range soon.
    assert_eq!(settled(110_000.0, 3.5).1, [(0, vec![0, 1, 2])]);
}

/// Two targets of high priority drive apart. Before one orbit cannot contain both, one is handed off to a group that
/// makes room for it by removing a target that is far from both.
#[test]
fn targets_of_high_priority_are_handed_off_before_they_are_removed() {
    let mut world = World::new(4, &[0.0, 500.0, 900.0, 1400.0]).in_pairs();
    world.params.group.centre = CentreEstimate::EnclosingCircle;
    world.settle();
    assert_eq!(world.groups(), [(0, vec![0, 1]), (1, vec![2, 3])]);
    let mut world = world.with_priorities(&[(0, 9.0), (1, 9.0)]);
    assert_eq!(world.kinds(), [""; 0]);
    world.track_index(1, 600.0);
    assert_eq!(world.kinds(), ["handoff-started", "removed"]);
    assert_eq!(world.groups(), [(0, vec![0, 1]), (1, vec![1, 2])]);
    assert_eq!(world.memberships.tracks()[1].group(), world.id(0));
}

/// Checks section IV.B.2, convergence rule: a group whose orbit has diverged for long enough removes its furthest
/// target, which is not readmitted while it moves away equally fast.
#[test]
fn the_furthest_target_is_removed_if_the_orbit_diverges() {
    let mut world = World::new(2, &[0.0, 100.0, 300.0]);
    world.settle();
    let form = |world: &World, diverging_s| Group {
        diverging_for: Duration::from_s(diverging_s),
        threshold_m2_s: Some(-9000.0),
        ..world.first_group()
    };
    world.previous = vec![form(&world, 3.0)];
    assert_eq!(world.kinds(), [""; 0]);
    world.previous = vec![form(&world, 3.5)];
    let events = world.settle();
    assert_eq!(events.len(), 1, "{events:?}");
    assert_eq!((events[0].kind.name(), events[0].track), ("removed", Some(TrackId(2))));
    let EventKind::RemovedDiverging { threshold_m2_s, .. } = events[0].kind else { panic!("{events:?}") };
    assert_eq!(threshold_m2_s, -9000.0);
}

/// Checks Algorithm 1: 4 UAVs form two groups; with only one target, one.
#[test]
fn half_as_many_groups_as_uavs_are_created() {
    let mut world = World::new(4, &[0.0, 900.0, 30.0, 930.0]);
    assert_eq!(world.kinds(), ["group-created", "group-created"]);
    assert_eq!(world.groups(), [(0, vec![0, 2]), (1, vec![1, 3])]);
    let mut alone = World::new(4, &[5.0]);
    assert_eq!((alone.kinds(), alone.groups()), (vec!["group-created"], vec![(0, vec![0])]));
    let mut nothing = World::new(4, &[]);
    assert_eq!((nothing.kinds(), nothing.groups()), (vec![], vec![]));
}

/// Checks section IV.B.1 and Eq. (34)'s place in it: requested, in both groups for the dwell, completed.
#[test]
fn a_target_that_moves_to_another_group_is_handed_off() {
    let mut world = World::new(4, &[0.0, 40.0, 80.0, 600.0, 640.0]).in_pairs();
    world.settle();
    assert_eq!(world.groups(), [(0, vec![0, 1, 2]), (1, vec![3, 4])]);
    world.track_index(2, 420.0);
    let events = world.settle();
    assert_eq!((events.len(), events[0].kind.name(), events[0].group, events[0].to_group), {
        (1, "handoff-started", world.id(0), world.id(1))
    });
    let EventKind::HandoffStarted { dwell_s } = events[0].kind else { panic!("{events:?}") };
    assert!((3.0..30.0).contains(&dwell_s), "{dwell_s}");
    assert_eq!(world.groups(), [(0, vec![0, 1, 2]), (1, vec![2, 3, 4])]);
    assert_eq!(
        (world.memberships.tracks()[2].group(), world.memberships.tracks()[2].receiving_group()),
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

/// A target that has returned by the end of the dwell stays in its group.
#[test]
fn a_handoff_is_cancelled_if_the_target_returns() {
    let mut world = World::new(4, &[0.0, 40.0, 80.0, 600.0, 640.0]).in_pairs();
    world.settle();
    world.track_index(2, 420.0);
    assert_eq!(world.kinds(), ["handoff-started"]);
    world.track_index(2, 60.0);
    let kinds: Vec<_> = (0..60).flat_map(|_| world.kinds()).collect();
    assert_eq!(kinds, ["handoff-cancelled"]);
    assert_eq!(world.groups(), [(0, vec![0, 1, 2]), (1, vec![3, 4])]);
}

/// A target that no receiving UAV gets into view stays in its group, and a new handoff is tried.
#[test]
fn a_handoff_is_cancelled_if_no_receiving_uav_has_the_target_in_view() {
    let mut world = World::new(4, &[0.0, 40.0, 80.0, 600.0, 640.0]).in_pairs();
    world.settle();
    world.params.track.sensor.sensing_range_m = 300.0;
    world.track_index(2, 420.0);
    assert_eq!(world.kinds(), ["handoff-started"]);
    let events: Vec<_> = (0..60).flat_map(|_| world.settle()).collect();
    assert_eq!(events[0].kind, EventKind::HandoffCancelled(HandoffCancelledReason::NotInView), "{events:?}");
}

/// A target that jumps over the border and back at every time step changes groups at most once in a dwell.
#[test]
fn an_oscillating_target_changes_groups_at_most_once_in_a_dwell() {
    let mut world = World::new(4, &[0.0, 40.0, 310.0, 600.0, 640.0]).in_pairs();
    world.settle();
    let mut requests = 0;
    for tick in 0..400 {
        world.track_index(2, if tick % 2 == 0 { 420.0 } else { 220.0 });
        requests += world.kinds().iter().filter(|kind| **kind == "handoff-started").count();
    }
    // 200 s, with at least 3 s each.
    assert!((1..=66).contains(&requests), "{requests}");
}

/// Without the dwell, as in figure 11a, groups change immediately.
#[test]
fn without_a_dwell_the_group_changes_immediately() {
    let mut world = World::new(4, &[0.0, 40.0, 80.0, 600.0, 640.0]).in_pairs();
    (world.params.group.dwell_min_s, world.params.group.dwell_max_s) = (0.0, 0.0);
    world.settle();
    world.track_index(2, 420.0);
    assert_eq!(world.kinds(), ["handoff-started", "handoff-completed"]);
    assert_eq!(world.groups(), [(0, vec![0, 1]), (1, vec![2, 3, 4])]);
}

/// A passing group that cannot contain the target hands it off immediately; a receiving group that cannot contain it
/// returns it.
#[test]
fn a_dwell_ends_early_if_an_orbit_cannot_contain_both() {
    let in_handoff = || {
        let mut world = World::new(4, &[0.0, 40.0, 80.0, 600.0, 640.0]).in_pairs();
        world.settle();
        world.track_index(2, 420.0);
        world.settle();
        world
    };
    let mut passing = in_handoff();
    passing.track_index(2, 700.0);
    let events = passing.settle();
    assert_eq!(
        events[0].kind,
        EventKind::HandoffCompleted(HandoffCompletedReason::PassingGroupCannotCover),
        "{events:?}"
    );
    // With an orbit motion model, this requires that the receiving UAVs have it in view by now; otherwise it is
    // removed.
    let mut out_of_view = in_handoff();
    out_of_view.params.group.motion.time_constant_s = 1.5;
    out_of_view.team.iter_mut().for_each(|teammate| teammate.boresight = None);
    out_of_view.track_index(2, 700.0);
    let events = out_of_view.settle();
    assert!(matches!(events[0].kind, EventKind::Removed { .. }), "{events:?}");
    let mut receiving = in_handoff();
    receiving.track_index(4, 1300.0);
    let events = receiving.settle();
    assert_eq!(
        events[0].kind,
        EventKind::HandoffCancelled(HandoffCancelledReason::ReceivingGroupCannotCover),
        "{events:?}"
    );
}

/// A new target nearby is admitted; one far away stays outside while all groups are in use.
#[test]
fn a_new_target_is_admitted_if_it_fits() {
    let mut world = World::new(2, &[0.0, 100.0]);
    world.settle();
    world.appear(2, 300.0);
    world.appear(3, 3000.0);
    assert_eq!((world.kinds(), world.groups()), (vec!["admitted"], vec![(0, vec![0, 1, 2])]));
}

/// A new target out of view of the group's UAVs is not a member yet: the orbit makes room for it first.
#[test]
fn a_new_target_out_of_view_becomes_a_member_once_in_view() {
    let mut world = World::new(2, &[0.0, 100.0]).in_pairs();
    world.settle();
    world.params.track.sensor.sensing_range_m = 10.0;
    world.appear(2, 300.0);
    assert_eq!(world.kinds(), ["admitted"]);
    assert_eq!(
        (world.memberships.tracks()[2].group(), world.memberships.tracks()[2].receiving_group()),
        (None, world.id(0))
    );
    world.params.track.sensor.sensing_range_m = 1e5;
    assert_eq!((world.kinds(), world.memberships.tracks()[2].group()), (vec![], world.id(0)));
    // The admission of a target that never comes into view is cancelled in the end.
    world.params.track.sensor.sensing_range_m = 10.0;
    world.appear(3, 310.0);
    let kinds: Vec<_> = (0..62).flat_map(|_| world.kinds()).collect();
    assert_eq!(kinds[..2], ["admitted", "not-admitted"]);
}

/// When new targets allow another group, the most scattered group is split; its larger part keeps the id.
#[test]
fn with_uavs_to_spare_the_widest_group_splits() {
    let mut world = World::new(4, &[0.0]).in_pairs();
    world.settle();
    for (id, x_m) in [(1, 300.0), (2, 310.0)] {
        world.appear(id, x_m);
    }
    assert_eq!(world.kinds(), ["admitted", "admitted", "regrouped", "group-created"]);
    assert_eq!(world.groups(), [(0, vec![1, 2]), (1, vec![0])]);
}

/// Fewer UAVs form fewer groups: the smallest one is retired, and its target is admitted to another if possible.
#[test]
fn with_fewer_uavs_the_smallest_group_is_retired() {
    let mut world = World::new(4, &[0.0, 100.0, 500.0]);
    world.settle();
    assert_eq!(world.groups(), [(0, vec![0, 1]), (1, vec![2])]);
    world.team.truncate(2);
    assert_eq!(world.kinds(), ["group-retired", "not-admitted", "admitted"]);
    assert_eq!(world.groups(), [(0, vec![0, 1, 2])]);
}

/// If far more targets can be covered together than a group has, its UAVs move there half a minute later; but not to
/// targets that they may never reach.
#[test]
fn uavs_move_to_where_they_can_cover_more_targets() {
    let result = |x_m: f64| {
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
    let (kinds, groups) = result(2000.0);
    assert_eq!(kinds, ["group-retired", "not-admitted", "admitted", "group-created"]);
    assert_eq!(groups, [(1, vec![2, 3, 4, 5])]);
    // 1,200 m of range and half a minute at 40 m/s are 2,400 m.
    assert_eq!(result(2500.0).0, [""; 0]);
}

/// Two neighbouring groups are merged if the UAVs of one can then cover an ungrouped target.
#[test]
fn a_group_that_fits_into_a_neighbour_is_merged() {
    let mut world = World::new(4, &[0.0, 30.0, 130.0, 160.0]).in_pairs();
    world.settle();
    assert_eq!(world.groups(), [(0, vec![0, 1]), (1, vec![2, 3])]);
    world.appear(4, 1000.0);
    let events: Vec<_> = (0..65).flat_map(|_| world.settle()).collect();
    let kinds: Vec<_> = events.iter().map(|event| event.kind.name()).collect();
    assert_eq!(kinds, ["group-retired", "regrouped", "regrouped", "admitted", "group-created"]);
    let merged = GroupRetiredReason::Merged { into: world.id(1).unwrap(), coverable_targets: 1 };
    assert_eq!(events[0].kind, EventKind::GroupRetired(merged));
    assert_eq!(world.groups(), [(1, vec![0, 1, 2, 3]), (2, vec![4])]);
}

/// A cancelled handoff is not started again immediately.
#[test]
fn a_cancelled_handoff_is_blocked_for_a_dwell() {
    let mut world = World::new(4, &[0.0, 40.0, 80.0, 600.0, 640.0]).in_pairs();
    world.settle();
    world.track_index(2, 420.0);
    world.settle();
    // The receiving group spreads until it cannot contain the target together with its members.
    world.track_index(4, 1300.0);
    assert_eq!(world.kinds(), ["handoff-cancelled", "removed"]);
    world.track_index(4, 640.0);
    let kinds: Vec<_> = (0..5).map(|_| world.kinds()).collect();
    assert!(kinds[..2].iter().all(|kinds| !kinds.contains(&"handoff-started")), "{kinds:?}");
}

/// Beyond section IV.B.2: if a group is faster than the UAVs, the fastest target is removed first.
#[test]
fn the_fastest_target_is_removed_if_the_group_outruns_the_uavs() {
    let mut world = World::new(2, &[0.0, 30.0, 60.0]).in_pairs();
    world.settle();
    let fast = |id, x_m, speed_m_s| {
        let cue = Cue { velocity: Velocity::from_m_s(speed_m_s, 0.0), ..cue(id, x_m) };
        Track::from_cue(&cue, &TeamParams::paper().track, Time::EPOCH).unwrap()
    };
    for (id, speed_m_s) in [(0, 80.0), (1, 10.0), (2, 90.0)] {
        *world.memberships.track_mut(id as usize) = fast(id, 30.0 * f64::from(id), speed_m_s);
    }
    let mut group = world.first_group();
    for _ in 0..7 {
        let (guidance, orbit) = (&world.params.guidance, group.orbit());
        let track_index = |teammate: &Teammate| {
            (teammate.state.position, OrbitRelativeState::of(guidance, teammate.state.position, &orbit))
        };
        let uavs: Vec<_> = world.team.iter().map(track_index).collect();
        let uavs = uavs.iter().map(|(position, on_orbit)| (*position, on_orbit));
        group.check(uavs, Duration::from_s(0.5), &world.params);
    }
    assert_eq!(group.outrun_for, Duration::from_s(3.5));
    world.previous = vec![group];
    let events = world.settle();
    assert_eq!((events.len(), events[0].kind.name(), events[0].track), (1, "removed", Some(TrackId(2))));
    assert!(matches!(events[0].kind, EventKind::RemovedTooFast { speed_m_s: 90.0, .. }), "{events:?}");
    // It is not readmitted while it is that fast.
    world.previous.clear();
    assert!(!world.kinds().contains(&"readmitted"));
}

#[test]
fn coinciding_targets_form_separate_groups() {
    let mut world = World::new(6, &[5.0, 5.0, 5.0]);
    assert_eq!(world.kinds(), ["group-created", "group-created", "group-created"]);
    assert_eq!(world.kinds(), [""; 0]);
}

/// Targets in groups with these indices, one UAV to each, with groups as needed.
fn as_needed(uavs: u32, x_m: &[f64], groups: &[u32]) -> World {
    let mut world = World::new(uavs, x_m);
    world.params.group.count = GroupCount::AsNeeded;
    for number in 0..groups.iter().max().map_or(0, |last| last + 1) {
        let track_indices: Vec<usize> =
            (0..groups.len()).filter(|track_index| groups[*track_index] == number).collect();
        let id = world.memberships.new_group(Time::EPOCH, track_indices.iter().copied());
        track_indices.iter().for_each(|track_index| world.memberships.set(*track_index, Membership::Member(id)));
    }
    let ids = world.memberships.groups().to_vec();
    let create = |id| Group::create(id, world.memberships.tracks(), world.memberships.of(id), &world.params);
    world.previous = ids.into_iter().filter_map(create).collect();
    world.serves = world.team.iter().map(|teammate| Some(teammate.uav.0)).collect();
    world
}

/// Two clusters 2 km apart are two groups for two UAVs, while half the number of UAVs would be one; one cluster is one
/// group of two UAVs; a third cluster waits, because there are no UAVs for it.
#[test]
fn the_number_of_groups_follows_the_need() {
    let mut two = as_needed(2, &[0.0, 30.0, 2000.0, 2030.0], &[]);
    assert_eq!(two.kinds(), ["admitted", "admitted", "group-created", "admitted", "admitted", "group-created"]);
    assert_eq!(two.groups(), [(0, vec![0, 1]), (1, vec![2, 3])]);
    let reason = |world: &mut World| {
        world.memberships.start(track(9, 9000.0));
        world.settle().iter().find_map(|event| match event.kind {
            EventKind::GroupCreated { members: 1, reason } => Some(reason),
            _ => None,
        })
    };
    // The second of two groups takes a UAV from the first; with four UAVs, each group has two.
    assert_eq!(reason(&mut as_needed(2, &[0.0], &[0])), Some(GroupCreatedReason::UavShortage));
    assert_eq!(reason(&mut as_needed(4, &[0.0], &[0])), Some(GroupCreatedReason::Ungrouped));
    two.appear(4, 4000.0);
    assert_eq!((two.kinds(), two.groups().len()), (vec![], 2));
    let mut one = as_needed(2, &[0.0, 30.0, 60.0, 90.0], &[]);
    one.settle();
    assert_eq!(one.groups(), [(0, vec![0, 1, 2, 3])]);
}

/// Two targets 300 m apart need one orbit of 300 m. Four UAVs nevertheless form two pairs, but no more groups while no
/// target is outside.
#[test]
fn if_all_targets_are_grouped_each_group_has_two_uavs() {
    let world = as_needed(4, &[0.0, 300.0, 310.0], &[]);
    assert_eq!(world.groups(), []);
    let mut world = world;
    world.settle();
    assert_eq!(world.groups(), [(0, vec![0]), (1, vec![1, 2])]);
}

/// Two targets need an orbit of 590 m, at most 0.85 of 700 m: one group is enough while a third target, far away, has
/// no UAV. The other group is retired once the first contains its target; new targets are meanwhile admitted to the
/// first.
#[test]
fn a_group_that_fits_into_others_is_retired() {
    let with_a_third = |at_m: f64| {
        let mut world = as_needed(2, &[0.0, at_m], &[0, 1]);
        world.params.group.centre = CentreEstimate::EnclosingCircle;
        world.appear(9, 9000.0);
        world
    };
    // An orbit of 600 m is too large for that; the regrouping merges the two groups immediately.
    assert_eq!(with_a_third(600.0).kinds()[0], "group-retired");
    let mut world = with_a_third(590.0);
    assert_eq!(world.kinds(), ["handoff-started"]);
    let membership = |world: &World| world.memberships.tracks()[1].membership;
    assert_eq!((membership(&world).group(), membership(&world).receiving_group()), (world.id(1), world.id(0)));
    world.appear(2, 589.0);
    assert_eq!((world.kinds(), world.groups()), (vec!["admitted"], vec![(0, vec![0, 1, 2]), (1, vec![1])]));
    let events: Vec<_> = (0..60).flat_map(|_| world.settle()).take(2).collect();
    assert_eq!(events[0].kind, EventKind::HandoffCompleted(HandoffCompletedReason::Received));
    assert_eq!(events[1].kind, EventKind::GroupRetired(GroupRetiredReason::Redundant));
    world.settle();
    assert_eq!(world.groups(), [(0, vec![0, 1, 2]), (2, vec![9])]);
}

/// Of two groups that could contain each other's target, the one nearer to the ungrouped target is retired, because its
/// UAV has the shorter way. This applies to retirement and to merging by regrouping.
#[test]
fn the_group_nearest_to_an_ungrouped_target_is_retired() {
    let first = |apart_m: f64, ungrouped_m: f64| {
        let mut world = as_needed(2, &[0.0, apart_m], &[0, 1]);
        world.params.group.centre = CentreEstimate::EnclosingCircle;
        world.appear(9, ungrouped_m);
        let event = world.settle()[0];
        (event.kind.name(), event.group.and_then(|group| world.memberships.number(group)))
    };
    let hands_off = |ungrouped_m| first(590.0, ungrouped_m);
    assert_eq!(hands_off(9000.0), ("handoff-started", Some(1)));
    assert_eq!(hands_off(-9000.0), ("handoff-started", Some(0)));
    let retires = |ungrouped_m| first(600.0, ungrouped_m);
    assert_eq!(retires(9000.0), ("group-retired", Some(1)));
    assert_eq!(retires(-9000.0), ("group-retired", Some(0)));
}

/// One ungrouped target of eleven does not justify moving a UAV, one of ten does; two within one orbit do, two apart do
/// not. This applies to retirement and to merging.
#[test]
fn no_group_is_retired_for_one_of_many_targets() {
    let first_event = |apart_m: f64, grouped: usize, ungrouped_m: &[f64]| {
        let mut track_indices: Vec<f64> = vec![0.0; grouped - 1];
        track_indices.push(apart_m);
        let mut groups = vec![0; grouped - 1];
        groups.push(1);
        let mut world = as_needed(2, &track_indices, &groups);
        world.params.group.centre = CentreEstimate::EnclosingCircle;
        (50..).zip(ungrouped_m).for_each(|(id, x_m)| world.appear(id, *x_m));
        world.kinds().first().copied()
    };
    for (apart_m, first) in [(590.0, "handoff-started"), (600.0, "group-retired")] {
        assert_eq!(first_event(apart_m, 10, &[9000.0]), None);
        assert_eq!(first_event(apart_m, 9, &[9000.0]), Some(first));
        assert_eq!(first_event(apart_m, 19, &[9000.0, 9100.0]), Some(first));
        assert_eq!(first_event(apart_m, 19, &[9000.0, -9000.0]), None);
    }
}

/// If no target is ungrouped, one UAV per group stays: no UAV moves only to form a pair. This check does not count as a
/// regrouping, so that a target that is ungrouped later does not wait for the next one.
#[test]
fn no_group_is_retired_without_ungrouped_targets() {
    let mut world = as_needed(2, &[0.0, 590.0], &[0, 1]);
    world.params.group.centre = CentreEstimate::EnclosingCircle;
    assert_eq!(world.kinds(), [""; 0]);
    world.appear(9, 9000.0);
    assert_eq!(world.kinds(), ["handoff-started"]);
}

/// A target that the other group's UAVs do not have in view is not handed off: its group stays, and admits targets
/// again.
#[test]
fn a_group_stays_if_no_other_uav_has_its_target_in_view() {
    let mut world = as_needed(2, &[0.0, 590.0], &[0, 1]);
    world.appear(9, 9000.0);
    world.params.track.sensor.sensing_range_m = 10.0;
    // The maximum dwell is half a minute, the next regrouping another half-minute later.
    let kinds: Vec<_> = (0..115).flat_map(|_| world.kinds()).collect();
    assert_eq!(kinds, ["handoff-started", "handoff-cancelled"]);
    assert_eq!(world.agenda.retiring, None);
    assert_eq!(world.groups(), [(0, vec![0]), (1, vec![1])]);
}

/// The target at 520 m of the retiring group is handed off to the group that can contain it: with the five at 0 m, the
/// circle needs an orbit of 520 m; with those at 700 m and 1,200 m, it needs 680 m, although their centroid, at 950 m,
/// is nearer than that of the six, at 87 m.
#[test]
fn clustering_does_not_affect_a_retirement() {
    let mut world = as_needed(3, &[0.0, 0.0, 0.0, 0.0, 0.0, 700.0, 1200.0, 520.0], &[0, 0, 0, 0, 0, 1, 1, 2]);
    world.params.group.centre = CentreEstimate::EnclosingCircle;
    world.appear(9, 9000.0);
    let mut kinds: Vec<_> = (0..60).flat_map(|_| world.kinds()).collect();
    kinds.truncate(3);
    assert_eq!(kinds, ["handoff-started", "handoff-completed", "group-retired"]);
    assert_eq!(world.groups(), [(0, vec![0, 1, 2, 3, 4, 7]), (1, vec![5, 6]), (3, vec![9])]);
}

/// With an orbit of 250 m, an omnidirectional sensor contains every target within 250 m of the group's centre; a target
/// farther out is not a member yet, although it is in view. It is also not a member while its UAV, 400 m from the
/// centre, might leave the sensing range by flying on and turning, 267 m farther; unless the UAV is near the orbit,
/// within a turn radius.
#[test]
fn a_target_becomes_a_member_once_the_current_orbit_contains_it() {
    let member = |x_m: f64, sensing_range_m: f64, away_m: f64| {
        let mut world = as_needed(1, &[0.0], &[0]);
        world.team[0].state.position = Position::from_m(0.0, -away_m);
        world.params.group.motion.time_constant_s = 1.5;
        world.params.track.sensor.sensing_range_m = sensing_range_m;
        world.appear(1, x_m);
        assert_eq!(world.kinds(), ["admitted"]);
        world.memberships.tracks()[1].group().and_then(|group| world.memberships.number(group))
    };
    let member_of = Some(0);
    assert_eq!((member(249.0, 1e5, 400.0), member(251.0, 1e5, 400.0)), (member_of, None));
    assert_eq!((member(0.0, 670.0, 400.0), member(0.0, 660.0, 400.0)), (member_of, None));
    assert_eq!((member(0.0, 450.0, 383.0), member(0.0, 450.0, 384.0)), (member_of, None));
}

/// Two targets that an orbit contained a moment ago: from 700 m apart on it no longer does, even if one of them is
/// still near the former centre.
#[test]
fn a_target_is_removed_if_the_group_outgrows_its_orbit() {
    let kinds = |apart_m: f64| {
        let mut world = as_needed(1, &[0.0, 200.0], &[0, 0]);
        world.params.group.centre = CentreEstimate::EnclosingCircle;
        world.previous = vec![world.first_group()];
        world.track_index(1, apart_m);
        world.kinds()
    };
    assert_eq!((kinds(699.0), kinds(701.0)), (vec![], vec!["removed"]));
}

/// A circle that needs an orbit of 660 m has no room to spare, 0.9 of 700 m; but a target inside the circle does not
/// enlarge it.
#[test]
fn targets_inside_the_circle_are_admitted() {
    let kinds = |x_m: f64| {
        let mut world = as_needed(1, &[0.0, 660.0], &[0, 0]);
        world.params.group.centre = CentreEstimate::EnclosingCircle;
        world.appear(2, x_m);
        world.kinds()
    };
    assert_eq!((kinds(330.0), kinds(-1.0)), (vec!["admitted"], vec![]));
}

/// An orbit that shrinks at 100 m/s leaves its UAV behind (Lemma 3.1), but the removal of a target would not help.
#[test]
fn a_shrinking_orbit_does_not_count_as_diverging() {
    let diverging_s = |rate_m_s: f64, time_constant_s: f64| {
        let world = as_needed(1, &[0.0, 200.0], &[0, 0]);
        let mut params = world.params;
        params.group.motion.time_constant_s = time_constant_s;
        let mut group =
            Group::create(world.id(0).unwrap(), world.memberships.tracks(), [0, 1].into_iter(), &params).unwrap();
        group.standoff.rate_m_s = rate_m_s;
        // Outside an orbit of 250 m about (100, 0) that shrinks, inside one that grows.
        let uav = Position::from_m(if rate_m_s < 0.0 { 360.0 } else { 300.0 }, 10.0);
        let on_orbit = OrbitRelativeState::of(&params.guidance, uav, &group.orbit());
        group.check([(uav, &on_orbit)].into_iter(), Duration::from_s(0.5), &params);
        (group.threshold_m2_s.unwrap() < -params.group.divergence_limit_m2_s, group.diverging_for.s())
    };
    assert_eq!((diverging_s(-100.0, 0.0), diverging_s(-100.0, 1.5)), ((true, 0.5), (true, 0.0)));
    assert_eq!((diverging_s(100.0, 0.0), diverging_s(100.0, 1.5)), ((true, 0.5), (true, 0.5)));
}
