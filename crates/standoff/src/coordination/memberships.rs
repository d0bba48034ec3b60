//! Every known target, and the groups that it belongs to.

use crate::coordination::handoff::Handoff;
use crate::estimation::information_filter::Estimate;
use crate::estimation::track::{Track, TrackId};
use crate::frame::Position;
use crate::group_id::GroupId;
use crate::time::{Duration, Time};

/// A target's place in the team's work.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Membership {
    /// In no group: new, its track was lost, or nobody can cover it.
    #[default]
    Unassigned,
    /// Member of a group.
    Member(GroupId),
    /// On its way into a group that makes room for it: from another group, to which it belongs too, or from none.
    Dwell(Handoff),
    /// Removed from its group, still predicted.
    Discarded,
}

impl Membership {
    /// The group whose duty it is to keep the target in view: in dwell, the passing one.
    pub fn group(&self) -> Option<GroupId> {
        match self {
            Self::Member(group) => Some(*group),
            Self::Dwell(handoff) => handoff.from,
            Self::Unassigned | Self::Discarded => None,
        }
    }

    /// In dwell, the receiving group.
    pub fn receiving_group(&self) -> Option<GroupId> {
        match self {
            Self::Dwell(handoff) => Some(handoff.to),
            _ => None,
        }
    }

    /// All groups it belongs to.
    pub fn groups(&self) -> impl Iterator<Item = GroupId> + use<> {
        [self.group(), self.receiving_group()].into_iter().flatten()
    }
}

/// A track and its place in the team's work.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Known {
    /// The track.
    pub track: Track,
    /// Its place.
    pub membership: Membership,
    /// A group that it is not to be handed to before a time: a handoff to it was withdrawn.
    barred: Option<(GroupId, Time)>,
}

impl Known {
    /// The group whose duty it is to keep the target in view: in dwell, the passing one.
    pub fn group(&self) -> Option<GroupId> {
        self.membership.group()
    }

    /// In dwell, the receiving group.
    pub fn receiving_group(&self) -> Option<GroupId> {
        self.membership.receiving_group()
    }

    /// Where clustering has put it last: in dwell, the receiving group.
    pub(crate) fn home(&self) -> Option<GroupId> {
        self.receiving_group().or(self.group())
    }

    /// It can be watched, and nobody means to.
    pub(crate) fn is_unassigned(&self) -> bool {
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

    pub(crate) fn is_barred_from(&self, group: GroupId, now: Time) -> bool {
        self.barred.is_some_and(|(barred, until)| barred == group && now < until)
    }
}

/// Who is in each group. A place is a target's index among the known ones.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Roster {
    /// Group and place of each membership, ascending; a target in dwell is there twice.
    entries: Vec<(GroupId, usize)>,
    /// The groups that have members, ascending.
    groups: Vec<GroupId>,
    /// Where the entries of each of them end.
    ends: Vec<usize>,
}

impl Roster {
    /// Becomes the same as another.
    pub(crate) fn copy(&mut self, other: &Self) {
        self.entries.clone_from(&other.entries);
        self.groups.clone_from(&other.groups);
        self.ends.clone_from(&other.ends);
    }

    /// The places of a group's members, ascending.
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

    fn change(&mut self, place: usize, before: &Membership, now: &Membership) {
        before.groups().for_each(|group| self.remove(group, place));
        now.groups().for_each(|group| self.add(group, place));
    }

    fn remove(&mut self, group: GroupId, place: usize) {
        let (Ok(entry), Ok(index)) = (self.entries.binary_search(&(group, place)), self.groups.binary_search(&group))
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

    fn add(&mut self, group: GroupId, place: usize) {
        let Err(entry) = self.entries.binary_search(&(group, place)) else { return };
        let index = self.groups.binary_search(&group).unwrap_or_else(|index| {
            self.groups.insert(index, group);
            self.ends.insert(index, entry);
            index
        });
        self.entries.insert(entry, (group, place));
        self.ends[index..].iter_mut().for_each(|end| *end += 1);
    }
}

/// The known targets by ascending track, each with its membership; and, always up to date, who is in each group.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct Memberships {
    known: Vec<Known>,
    #[serde(skip)]
    roster: Roster,
    /// How many groups were founded so far.
    founded: u32,
    /// The id that was given last.
    last: GroupId,
    /// Of each group that was there at the last instant or is now, by ascending id: the how many'th that was founded.
    numbers: Vec<(GroupId, u32)>,
}

impl Memberships {
    /// Works out who is in each group; `false`: these are no memberships that could be at an instant, where dwells are no
    /// longer than so long.
    pub(crate) fn make_whole(&mut self, now: Time, dwell_max: Duration) -> bool {
        let is_sound = |known: &Known| {
            let Known { track, membership, barred } = known;
            let is_apart = membership.receiving_group().is_none_or(|to| membership.group() != Some(to));
            let has_begun = match membership {
                Membership::Dwell(handoff) => handoff.requested_at <= now,
                _ => true,
            };
            let is_in_time = barred.is_none_or(|(_, until)| until <= now + dwell_max);
            track.is_sound() && is_apart && has_begun && is_in_time
        };
        let is_whole = self.known.is_sorted_by(|a, b| a.track.id < b.track.id)
            && self.known.iter().all(is_sound)
            && self.numbers.is_sorted_by(|a, b| a.0 < b.0)
            // Else ids would run out, or come again.
            && self.numbers.last().is_none_or(|(id, _)| *id <= self.last)
            && self.last.is_given_by(now);
        self.roster = Roster::default();
        for place in 0..self.known.len() {
            let membership = self.known[place].membership;
            self.roster.change(place, &Membership::Unassigned, &membership);
        }
        is_whole && self.groups().iter().all(|group| self.number(*group).is_some())
    }

    /// The known targets, by ascending track.
    pub(crate) fn known(&self) -> &[Known] {
        &self.known
    }

    /// The place of a track; where it would have to be, if it is not known.
    pub(crate) fn place(&self, track: TrackId) -> Result<usize, usize> {
        self.known.binary_search_by_key(&track, |known| known.track.id)
    }

    pub(crate) fn roster(&self) -> &Roster {
        &self.roster
    }

    /// The groups that have members, ascending.
    pub(crate) fn groups(&self) -> &[GroupId] {
        &self.roster.groups
    }

    /// The places of a group's members, ascending.
    pub(crate) fn of(&self, group: GroupId) -> impl Iterator<Item = usize> + Clone + '_ {
        self.roster.of(group)
    }

    /// Becomes the same as another; what it holds of it is used again. Groups that had no members there are forgotten.
    pub(crate) fn copy(&mut self, other: &Self) {
        self.known.clone_from(&other.known);
        self.roster.copy(&other.roster);
        (self.founded, self.last) = (other.founded, other.last);
        self.numbers.clear();
        self.numbers.extend(other.numbers.iter().filter(|(id, _)| other.groups().binary_search(id).is_ok()));
    }

    /// The id of a group that is founded of the targets in these places.
    pub(crate) fn new_group(&mut self, now: Time, places: impl Iterator<Item = usize>) -> GroupId {
        self.last = GroupId::founded(now, places.map(|place| self.known[place].track.id.0), self.last);
        self.numbers.push((self.last, self.founded));
        self.founded = self.founded.saturating_add(1);
        self.last
    }

    /// The id of the how many'th group.
    #[cfg(test)]
    pub(crate) fn id(&self, number: u32) -> Option<GroupId> {
        self.numbers.iter().find(|(_, known)| *known == number).map(|(id, _)| *id)
    }

    /// The how many'th group it is that was founded, from 0.
    pub(crate) fn number(&self, group: GroupId) -> Option<u32> {
        self.numbers.binary_search_by_key(&group, |(id, _)| *id).ok().map(|index| self.numbers[index].1)
    }

    /// The tracks, to be carried on; they keep their ids.
    pub(crate) fn tracks_mut(&mut self) -> impl Iterator<Item = &mut Track> {
        self.known.iter_mut().map(|known| &mut known.track)
    }

    /// One of them.
    pub(crate) fn track_mut(&mut self, place: usize) -> &mut Track {
        &mut self.known[place].track
    }

    /// A target that was not known, or whose track was lost, is in no group yet.
    pub(crate) fn start(&mut self, track: Track) {
        let known = Known { track, membership: Membership::Unassigned, barred: None };
        match self.place(track.id) {
            Ok(place) => {
                self.set(place, Membership::Unassigned);
                self.known[place] = known;
            }
            Err(place) => {
                self.known.insert(place, known);
                self.roster.entries.iter_mut().for_each(|entry| entry.1 += usize::from(entry.1 >= place));
            }
        }
    }

    /// Tracks that have been lost for longer than `after` are known no more.
    pub(crate) fn forget_lost(&mut self, after: Duration) {
        let is_old = |known: &Known| known.track.lost_for() > after;
        for place in (0..self.known.len()).rev() {
            if is_old(&self.known[place]) {
                self.set(place, Membership::Unassigned);
                self.known.remove(place);
                self.roster.entries.iter_mut().for_each(|entry| entry.1 -= usize::from(entry.1 > place));
            }
        }
    }

    /// Gives a target its place in the team's work.
    pub(crate) fn set(&mut self, place: usize, membership: Membership) {
        let before = core::mem::replace(&mut self.known[place].membership, membership);
        self.roster.change(place, &before, &membership);
    }

    /// The target is not to be handed to a group until then.
    pub(crate) fn bar(&mut self, place: usize, group: GroupId, until: Time) {
        self.known[place].barred = Some((group, until));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Velocity;
    use crate::message::{Cue, TargetLabel};
    use crate::team::TeamParams;

    fn track(label: u32) -> Track {
        let cue = Cue {
            searcher: 0,
            said: Time::START,
            number: 0,
            label: TargetLabel(label),
            time: Time::START,
            position: Position::ORIGIN,
            velocity: Velocity::ZERO,
            position_sd_m: 1.0,
            velocity_sd_m_s: 1.0,
        };
        Track::from_cue(&cue, &TeamParams::table_1().track, Time::START).unwrap()
    }

    /// The roster, worked out anew.
    fn roster(memberships: &Memberships) -> Vec<(GroupId, usize)> {
        let of = |(place, known): (usize, &Known)| known.membership.groups().map(move |group| (group, place));
        let mut roster: Vec<_> = memberships.known().iter().enumerate().flat_map(of).collect();
        roster.sort_unstable();
        roster
    }

    #[test]
    fn the_roster_follows_whatever_is_done() {
        let mut memberships = Memberships::default();
        let mut seed = 1u64;
        let mut draw = |n: u64| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) % n
        };
        let mut lost_and_forgotten = 0;
        for _ in 0..2000 {
            let n = memberships.known().len();
            match draw(5) {
                0 => memberships.start(track(draw(12) as u32)),
                1 if n > 0 => {
                    memberships.known[draw(n as u64) as usize].track.give_up();
                    let transition = TeamParams::table_1().track.transition(Duration::from_s(1.0));
                    memberships.tracks_mut().for_each(|track| track.predict(&transition));
                    memberships.forget_lost(Duration::from_s(2.5));
                    lost_and_forgotten += n - memberships.known().len();
                }
                _ if n > 0 => {
                    let group = GroupId;
                    let handoff = Handoff {
                        from: Some(group(draw(3))).filter(|_| draw(3) > 0),
                        to: group(3 + draw(2)),
                        requested_at: Time::START,
                        dwell: Duration::ZERO,
                    };
                    let all = [
                        Membership::Unassigned,
                        Membership::Member(group(draw(5))),
                        Membership::Dwell(handoff),
                        Membership::Discarded,
                    ];
                    memberships.set(draw(n as u64) as usize, all[draw(4) as usize]);
                }
                _ => {}
            }
            let expected = roster(&memberships);
            assert_eq!(memberships.roster.entries, expected);
            assert!(memberships.known().is_sorted_by(|a, b| a.track.id < b.track.id));
            let groups: Vec<GroupId> = expected.chunk_by(|a, b| a.0 == b.0).map(|chunk| chunk[0].0).collect();
            assert_eq!(memberships.groups(), groups);
            for group in groups {
                let places: Vec<usize> =
                    expected.iter().filter(|entry| entry.0 == group).map(|entry| entry.1).collect();
                assert_eq!(memberships.of(group).collect::<Vec<_>>(), places);
            }
        }
        assert!(lost_and_forgotten > 50, "{lost_and_forgotten}");
    }
}
