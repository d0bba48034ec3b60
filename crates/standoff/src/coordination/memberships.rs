//! All known targets and their group memberships.

use crate::coordination::dwell::Handoff;
use crate::frame::Position;
use crate::group_id::GroupId;
use crate::priority::{AreaOfInterest, PRIORITY, priority_at};
use crate::time::{Duration, Time};
use crate::tracking::estimate::Estimate;
use crate::tracking::track::{Track, TrackId};
use crate::tracking::track_table::{TrackRow, TrackTable};

/// Membership of a target in the groups of the team.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Membership {
    /// In no group: the target is new, its track was lost, or no UAV can cover it.
    #[default]
    Ungrouped,
    /// Member of a group.
    Member(GroupId),
    /// In handoff to a group that makes room for it: from another group, where it is still a member, or from none.
    InHandoff(Handoff),
    /// Removed from its group; the track is still predicted.
    Removed,
}

impl Membership {
    /// Group responsible for keeping the target in view; in a handoff, the passing group.
    pub fn group(&self) -> Option<GroupId> {
        match self {
            Self::Member(group) => Some(*group),
            Self::InHandoff(handoff) => handoff.from,
            Self::Ungrouped | Self::Removed => None,
        }
    }

    /// Receiving group of a handoff.
    pub fn receiving_group(&self) -> Option<GroupId> {
        match self {
            Self::InHandoff(handoff) => Some(handoff.to),
            _ => None,
        }
    }

    /// All groups of the target.
    pub fn groups(&self) -> impl Iterator<Item = GroupId> + use<> {
        [self.group(), self.receiving_group()].into_iter().flatten()
    }
}

/// A track with its membership.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct GroupedTrack {
    /// The track.
    pub track: Track,
    /// Membership of the target.
    pub membership: Membership,
    /// Priority that a cue has given the target; 1 otherwise. Priorities other than 1 are serialised apart.
    #[serde(skip, default = "one")]
    pub(crate) own_priority: f64,
    /// Priority of the target at its position ([`priority_at`]), which all decisions use.
    #[serde(skip, default = "one")]
    pub priority: f64,
    /// Blocked group and the end of the block: after a cancelled handoff, no new one to that group may start before.
    blocked_groups: Option<(GroupId, Time)>,
}

impl TrackRow for GroupedTrack {
    fn new(track: Track) -> Self {
        Self { track, membership: Membership::Ungrouped, own_priority: 1.0, priority: 1.0, blocked_groups: None }
    }

    fn track(&self) -> &Track {
        &self.track
    }

    fn track_mut(&mut self) -> &mut Track {
        &mut self.track
    }

    fn own_priority_mut(&mut self) -> &mut f64 {
        &mut self.own_priority
    }
}

fn one() -> f64 {
    1.0
}

impl GroupedTrack {
    /// Group responsible for keeping the target in view; in a handoff, the passing group.
    pub(crate) fn group(&self) -> Option<GroupId> {
        self.membership.group()
    }

    /// Receiving group of a handoff.
    pub(crate) fn receiving_group(&self) -> Option<GroupId> {
        self.membership.receiving_group()
    }

    /// Group according to the last clustering; in a handoff, the receiving group.
    pub(crate) fn home(&self) -> Option<GroupId> {
        self.receiving_group().or(self.group())
    }

    /// True if the target is not lost and in no group.
    pub(crate) fn is_ungrouped(&self) -> bool {
        !self.track.is_lost() && self.home().is_none()
    }

    pub(crate) fn estimate(&self) -> &Estimate {
        self.track.estimate()
    }

    pub(crate) fn position(&self) -> Position {
        self.estimate().state.position()
    }

    pub(crate) fn speed_m_s(&self) -> f64 {
        self.estimate().state.velocity().speed_m_s()
    }

    pub(crate) fn is_blocked_from(&self, group: GroupId, now: Time) -> bool {
        self.blocked_groups.is_some_and(|(blocked_group, until)| blocked_group == group && now < until)
    }
}

/// Members of each group, by their indices in the list of known targets.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct GroupIndex {
    /// Group and target index of each membership, ascending; a target in handoff has two entries.
    entries: Vec<(GroupId, usize)>,
    /// Groups with members, ascending.
    groups: Vec<GroupId>,
    /// End index of each group's entries.
    ends: Vec<usize>,
}

impl GroupIndex {
    /// Rebuilds the index for these tracks.
    fn rebuild(&mut self, tracks: &[GroupedTrack]) {
        let Self { entries, groups, ends } = self;
        entries.clear();
        for (track_index, track) in tracks.iter().enumerate() {
            entries.extend(track.membership.groups().map(|group| (group, track_index)));
        }
        entries.sort_unstable();
        entries.dedup();
        groups.clear();
        ends.clear();
        let mut end = 0;
        for of_one_group in entries.chunk_by(|a, b| a.0 == b.0) {
            end += of_one_group.len();
            groups.push(of_one_group[0].0);
            ends.push(end);
        }
    }

    /// Copies another index and reuses the buffers.
    pub(crate) fn copy(&mut self, other: &Self) {
        self.entries.clone_from(&other.entries);
        self.groups.clone_from(&other.groups);
        self.ends.clone_from(&other.ends);
    }

    /// Indices of a group's members, ascending.
    pub(crate) fn of(&self, group: GroupId) -> impl Iterator<Item = usize> + Clone + '_ {
        let members = match self.groups.binary_search(&group) {
            Ok(index) => &self.entries[self.start(index)..self.ends[index]],
            Err(_) => &[],
        };
        members.iter().map(|entry| entry.1)
    }

    fn start(&self, index: usize) -> usize {
        index.checked_sub(1).map_or(0, |before| self.ends[before])
    }

    fn change(&mut self, track_index: usize, before: &Membership, now: &Membership) {
        before.groups().for_each(|group| self.remove(group, track_index));
        now.groups().for_each(|group| self.add(group, track_index));
    }

    fn remove(&mut self, group: GroupId, track_index: usize) {
        let (Ok(entry), Ok(index)) =
            (self.entries.binary_search(&(group, track_index)), self.groups.binary_search(&group))
        else {
            return;
        };
        self.entries.remove(entry);
        self.ends[index..].iter_mut().for_each(|end| *end -= 1);
        if self.start(index) == self.ends[index] {
            self.groups.remove(index);
            self.ends.remove(index);
        }
    }

    fn add(&mut self, group: GroupId, track_index: usize) {
        let Err(entry) = self.entries.binary_search(&(group, track_index)) else { return };
        let index = self.groups.binary_search(&group).unwrap_or_else(|index| {
            self.groups.insert(index, group);
            self.ends.insert(index, entry);
            index
        });
        self.entries.insert(entry, (group, track_index));
        self.ends[index..].iter_mut().for_each(|end| *end += 1);
    }
}

/// Known targets by ascending track, each with its membership, and an index of the members of each group that is always
/// current.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct Memberships {
    tracks: TrackTable<GroupedTrack>,
    #[serde(skip)]
    roster: GroupIndex,
    /// Number of groups created so far.
    created_count: u32,
    /// Last group id given.
    last: GroupId,
    /// Zero-based creation index of each group that exists now or existed at the last time step, by ascending id.
    numbers: Vec<(GroupId, u32)>,
}

impl Memberships {
    /// Rebuilds the index of members; returns `false` if the memberships are impossible at time `now` with dwells of at
    /// most `dwell_max`.
    pub(crate) fn rebuild_index(&mut self, now: Time, dwell_max: Duration) -> bool {
        let is_valid = |known: &GroupedTrack| {
            let GroupedTrack { track, membership, blocked_groups: blocked_group, .. } = known;
            let is_apart = membership.receiving_group().is_none_or(|to| membership.group() != Some(to));
            let has_begun = match membership {
                Membership::InHandoff(handoff) => handoff.requested_at <= now,
                _ => true,
            };
            let is_in_time = blocked_group.is_none_or(|(_, until)| until <= now + dwell_max);
            track.is_valid() && is_apart && has_begun && is_in_time
        };
        let is_whole = self.tracks().is_sorted_by(|a, b| a.track.id < b.track.id)
            && self.tracks().iter().all(is_valid)
            && self.numbers.is_sorted_by(|a, b| a.0 < b.0)
            // Otherwise, ids would run out or be given twice.
            && self.numbers.last().is_none_or(|(id, _)| *id <= self.last)
            && self.last.is_not_after(now);
        self.roster.rebuild(self.tracks.rows());
        is_whole && self.groups().iter().all(|group| self.number(*group).is_some())
    }

    /// Known targets, by ascending track.
    pub(crate) fn tracks(&self) -> &[GroupedTrack] {
        self.tracks.rows()
    }

    pub(crate) fn track_table(&self) -> &TrackTable<GroupedTrack> {
        &self.tracks
    }

    /// Index of a track, or the index at which to insert it.
    pub(crate) fn track_index(&self, track: TrackId) -> Result<usize, usize> {
        self.tracks.index(track)
    }

    /// Changes tracks. `update` returns true if it started or removed tracks: then the index of members is rebuilt.
    pub(crate) fn update_tracks(&mut self, update: impl FnOnce(&mut TrackTable<GroupedTrack>) -> bool) {
        if update(&mut self.tracks) {
            self.roster.rebuild(self.tracks.rows());
        }
    }

    /// Computes the priorities of all targets at their positions.
    pub(crate) fn update_priorities(&mut self, areas: &[AreaOfInterest]) {
        for row in self.tracks.rows_mut() {
            row.priority = priority_at(row.own_priority, row.position(), areas);
        }
    }

    /// Priorities other than 1 that cues have given, by ascending track.
    pub(crate) fn own_priorities(&self) -> Vec<(TrackId, f64)> {
        let rows = self.tracks().iter().filter(|row| row.own_priority != 1.0);
        rows.map(|row| (row.track.id, row.own_priority)).collect()
    }

    /// Restores priorities that cues have given; returns `false` if they are impossible.
    pub(crate) fn restore_priorities(&mut self, priorities: &[(TrackId, f64)]) -> bool {
        priorities.iter().for_each(|(track, priority)| self.tracks.set_priority(*track, Some(*priority)));
        self.own_priorities() == priorities && priorities.iter().all(|(_, priority)| PRIORITY.contains(*priority))
    }

    /// Starts or restarts a track; the target is in no group.
    #[cfg(test)]
    pub(crate) fn start(&mut self, track: Track) {
        self.update_tracks(|tracks| tracks.start(track, usize::MAX));
    }

    /// The track with an index; its id must not change.
    #[cfg(test)]
    pub(crate) fn track_mut(&mut self, track_index: usize) -> &mut Track {
        self.tracks.rows_mut()[track_index].track_mut()
    }

    pub(crate) fn index(&self) -> &GroupIndex {
        &self.roster
    }

    /// Groups with members, ascending.
    pub(crate) fn groups(&self) -> &[GroupId] {
        &self.roster.groups
    }

    /// Indices of a group's members, ascending.
    pub(crate) fn of(&self, group: GroupId) -> impl Iterator<Item = usize> + Clone + '_ {
        self.roster.of(group)
    }

    /// Copies other memberships and reuses the buffers. Groups that have no members there are dropped.
    pub(crate) fn copy(&mut self, other: &Self) {
        self.tracks.copy(&other.tracks);
        self.roster.copy(&other.roster);
        (self.created_count, self.last) = (other.created_count, other.last);
        self.numbers.clear();
        self.numbers.extend(other.numbers.iter().filter(|(id, _)| other.groups().binary_search(id).is_ok()));
    }

    /// Returns a new id for a group of the targets with these indices.
    pub(crate) fn new_group(&mut self, now: Time, track_indices: impl Iterator<Item = usize>) -> GroupId {
        self.last =
            GroupId::founded(now, track_indices.map(|track_index| self.tracks()[track_index].track.id.0), self.last);
        self.numbers.push((self.last, self.created_count));
        self.created_count = self.created_count.saturating_add(1);
        self.last
    }

    /// Returns the id of a group from its creation index.
    #[cfg(test)]
    pub(crate) fn id(&self, number: u32) -> Option<GroupId> {
        self.numbers.iter().find(|(_, known)| *known == number).map(|(id, _)| *id)
    }

    /// Zero-based creation index of the group.
    pub(crate) fn number(&self, group: GroupId) -> Option<u32> {
        self.numbers.binary_search_by_key(&group, |(id, _)| *id).ok().map(|index| self.numbers[index].1)
    }

    /// Sets the membership of a target.
    pub(crate) fn set(&mut self, track_index: usize, membership: Membership) {
        let before = core::mem::replace(&mut self.tracks.rows_mut()[track_index].membership, membership);
        self.roster.change(track_index, &before, &membership);
    }

    /// Blocks handoffs of the target to a group until a time.
    pub(crate) fn block(&mut self, track_index: usize, group: GroupId, until: Time) {
        self.tracks.rows_mut()[track_index].blocked_groups = Some((group, until));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::Cue;
    use crate::params::TeamParams;

    fn track(label: u32) -> Track {
        Track::from_cue(&Cue::at(label, Position::ORIGIN), &TeamParams::paper().track, Time::EPOCH).unwrap()
    }

    /// The index of members, recomputed from scratch.
    fn roster(memberships: &Memberships) -> Vec<(GroupId, usize)> {
        let of = |(track_index, known): (usize, &GroupedTrack)| {
            known.membership.groups().map(move |group| (group, track_index))
        };
        let mut roster: Vec<_> = memberships.tracks().iter().enumerate().flat_map(of).collect();
        roster.sort_unstable();
        roster
    }

    #[test]
    fn the_index_of_members_follows_every_change() {
        let mut memberships = Memberships::default();
        let mut seed = 1u64;
        let mut draw = |n: u64| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) % n
        };
        let mut lost_and_forgotten = 0;
        for _ in 0..2000 {
            let n = memberships.tracks().len();
            match draw(5) {
                0 => memberships.start(track(draw(12) as u32)),
                1 if n > 0 => {
                    memberships.track_mut(draw(n as u64) as usize).give_up();
                    let transition = TeamParams::paper().track.transition(Duration::from_s(1.0));
                    (0..n).for_each(|track_index| memberships.track_mut(track_index).predict(&transition));
                    memberships.update_tracks(|tracks| tracks.remove_lost(Duration::from_s(2.5)));
                    lost_and_forgotten += n - memberships.tracks().len();
                }
                _ if n > 0 => {
                    let group = GroupId;
                    let handoff = Handoff {
                        from: Some(group(draw(3))).filter(|_| draw(3) > 0),
                        to: group(3 + draw(2)),
                        requested_at: Time::EPOCH,
                        dwell: Duration::ZERO,
                    };
                    let all = [
                        Membership::Ungrouped,
                        Membership::Member(group(draw(5))),
                        Membership::InHandoff(handoff),
                        Membership::Removed,
                    ];
                    memberships.set(draw(n as u64) as usize, all[draw(4) as usize]);
                }
                _ => {}
            }
            let expected = roster(&memberships);
            assert_eq!(memberships.roster.entries, expected);
            assert!(memberships.tracks().is_sorted_by(|a, b| a.track.id < b.track.id));
            let groups: Vec<GroupId> = expected.chunk_by(|a, b| a.0 == b.0).map(|chunk| chunk[0].0).collect();
            assert_eq!(memberships.groups(), groups);
            for group in groups {
                let track_indices: Vec<usize> =
                    expected.iter().filter(|entry| entry.0 == group).map(|entry| entry.1).collect();
                assert_eq!(memberships.of(group).collect::<Vec<_>>(), track_indices);
            }
        }
        assert!(lost_and_forgotten > 50, "{lost_and_forgotten}");
    }
}
