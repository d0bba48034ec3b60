//! Names of groups.

use crate::time::Time;

/// Identifies a group, for as long as it lives and beyond: made from when it was founded and of whom, so that two halves of
/// a team that do not hear one another give two groups two ids, and one founding told twice the same. Later ones are higher.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub struct GroupId(pub u64);

impl GroupId {
    /// That of a group founded now of these tracks; above the `last` one that was given.
    ///
    /// Microseconds since the start of the mission, then 16 bits of who is in it: a hybrid logical clock (Kulkarni et al.,
    /// *Logical Physical Clocks*, 2014), whose counter is the last one given.
    pub(crate) fn founded(now: Time, members: impl Iterator<Item = u32>, last: Self) -> Self {
        let of_whom = members.fold(0xCBF2_9CE4_8422_2325_u64, |hash, track| {
            (hash ^ u64::from(track)).wrapping_mul(0x0000_0100_0000_01B3)
        });
        // What the last member changes in the low bits is to be told in the high ones, too.
        let of_whom = (of_whom ^ of_whom >> 32).wrapping_mul(0xFF51_AFD7_ED55_8CCD);
        let us = now.us().clamp(0, (1 << 47) - 1) as u64;
        Self((us << 16 | of_whom >> 48).max(last.0.saturating_add(1)))
    }

    /// It can have been given by now; or so much later as several founded at one instant may count on.
    pub(crate) fn is_given_by(self, now: Time) -> bool {
        self.0 >> 16 <= now.us().clamp(0, (1 << 47) - 1) as u64 + 1_000_000
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_id_tells_when_and_of_whom_and_never_comes_again() {
        let id = |us, tracks: &[u32], last| GroupId::founded(Time::from_us(us), tracks.iter().copied(), GroupId(last));
        assert_eq!(id(5, &[1, 2], 0), id(5, &[1, 2], 7));
        assert_ne!(id(5, &[1, 2], 0), id(5, &[1, 3], 0));
        assert!(id(5, &[1, 2], 0) < id(6, &[1, 2], 0));
        // Two at one instant, and a clock that goes back: still above the last.
        let first = id(5, &[9], 0);
        assert!(id(5, &[1], first.0) > first && id(-9, &[1], first.0) > first);
        // As large as a signed number may be, which other programs hold.
        assert!(id(i64::MAX, &[1], 0).0 <= i64::MAX as u64);
    }
}
