//! Group ids.

use crate::time::Time;

/// Id of a group, unique for all time. It is made from the creation time and the members, so that two halves of a team
/// that do not receive each other create different ids, and agents that process the same creation twice get the same
/// id. Later ids are higher.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub struct GroupId(pub u64);

impl GroupId {
    /// Returns the id of a group that is created now with these tracks; it is higher than `last`, the last id given.
    ///
    /// The id consists of the microseconds since the start of the mission, then 16 bits that depend on the members: a
    /// hybrid logical clock (Kulkarni et al., *Logical Physical Clocks*, 2014), whose counter is the last id given.
    pub(crate) fn founded(now: Time, members: impl Iterator<Item = u64>, last: Self) -> Self {
        let members_hash =
            members.fold(0xCBF2_9CE4_8422_2325_u64, |hash, track| (hash ^ track).wrapping_mul(0x0000_0100_0000_01B3));
        // A change of the last member, in the low bits, must also change the high bits.
        let members_hash = (members_hash ^ members_hash >> 32).wrapping_mul(0xFF51_AFD7_ED55_8CCD);
        let us = now.us().clamp(0, (1 << 47) - 1) as u64;
        Self((us << 16 | members_hash >> 48).max(last.0.saturating_add(1)))
    }

    /// True if the id's timestamp is not later than `now`, with a tolerance. Several groups created in one time step
    /// may have slightly later ids.
    pub(crate) fn is_not_after(self, now: Time) -> bool {
        self.0 >> 16 <= now.us().clamp(0, (1 << 47) - 1) as u64 + 1_000_000
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_id_depends_on_time_and_members_and_is_never_reused() {
        let id = |us, tracks: &[u64], last| GroupId::founded(Time::from_us(us), tracks.iter().copied(), GroupId(last));
        assert_eq!(id(5, &[1, 2], 0), id(5, &[1, 2], 7));
        assert_ne!(id(5, &[1, 2], 0), id(5, &[1, 3], 0));
        assert!(id(5, &[1, 2], 0) < id(6, &[1, 2], 0));
        // Two creations at one time, and a clock that runs backward: the id is still above the last one.
        let first = id(5, &[9], 0);
        assert!(id(5, &[1], first.0) > first && id(-9, &[1], first.0) > first);
        // Other programs store the id as a signed number.
        assert!(id(i64::MAX, &[1], 0).0 <= i64::MAX as u64);
    }
}
