//! Which targets belong to which group.

use crate::coordination::group::GroupId;
use crate::coordination::membership::{Known, Membership};

/// Places of the known targets by group, ascending; a target in dwell is there twice.
#[derive(Debug, Clone, Default)]
pub(crate) struct Roster {
    entries: Vec<(GroupId, usize)>,
}

impl Roster {
    /// Becomes the roster of `known`.
    pub(crate) fn fill(&mut self, known: &[Known]) {
        self.entries.clear();
        for (index, target) in known.iter().enumerate() {
            match target.membership {
                Membership::Member(group) => self.entries.push((group, index)),
                Membership::Dwell(handoff) => {
                    self.entries.extend(handoff.from.map(|group| (group, index)));
                    self.entries.push((handoff.to, index));
                }
                Membership::Unassigned | Membership::Discarded => {}
            }
        }
        // Of one group, they are in order already.
        if !self.entries.is_sorted_by_key(|entry| entry.0) {
            self.entries.sort_unstable();
        }
    }

    /// Becomes the same as another.
    pub(crate) fn copy(&mut self, other: &Self) {
        self.entries.clone_from(&other.entries);
    }

    /// The places of a group's members among the known targets.
    pub(crate) fn of(&self, group: GroupId) -> impl Iterator<Item = usize> + Clone + '_ {
        // Often there is but one group.
        let is_group = |entry: Option<&(GroupId, usize)>| entry.is_some_and(|entry| entry.0 == group);
        let members = if is_group(self.entries.first()) && is_group(self.entries.last()) {
            &self.entries[..]
        } else {
            let start = self.entries.partition_point(|entry| entry.0 < group);
            let length = self.entries[start..].partition_point(|entry| entry.0 == group);
            &self.entries[start..start + length]
        };
        members.iter().map(|entry| entry.1)
    }

    /// The groups that have members, ascending.
    pub(crate) fn groups(&self) -> impl Iterator<Item = GroupId> + '_ {
        self.entries.chunk_by(|a, b| a.0 == b.0).map(|chunk| chunk[0].0)
    }
}
