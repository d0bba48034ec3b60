//! The UAVs that share the work.

use crate::angle::Angle;
use crate::group_id::GroupId;
use crate::message::Report;
use crate::team::Radio;
use crate::time::{Duration, Time};
use crate::uav::{UavId, UavState};

/// A UAV heard of late.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Teammate {
    /// Which UAV.
    pub uav: UavId,
    /// Where it is: as it says, or carried on to now from where it last said it was.
    pub state: UavState,
    /// It said so at this very instant.
    pub is_heard: bool,
    /// Where its sensor points, if it was heard at this very instant and looks.
    pub boresight: Option<Angle>,
    /// The group that it serves.
    pub group: Option<GroupId>,
    /// What it last said of where it was.
    pub(crate) said: UavState,
    /// When.
    pub(crate) said_at: Time,
    /// The group that it said it serves: what it does.
    pub(crate) does: Option<GroupId>,
    /// It said that it leaves.
    pub(crate) has_left: bool,
}

impl Teammate {
    /// A UAV that is heard at this instant; `group` is what the team believes that it serves.
    pub(crate) fn heard(report: &Report, group: Option<GroupId>) -> Self {
        let Report { uav, state, boresight, time, duty, leaves, .. } = *report;
        let (said, said_at, does, has_left) = (state, time, duty, leaves);
        Self { uav, state, is_heard: true, boresight, group, said, said_at, does, has_left }
    }

    /// It has been heard within the lease, and has not said that it leaves.
    pub(crate) fn is_of_late(&self, now: Time, lease: Duration) -> bool {
        !self.has_left && now - self.said_at <= lease
    }

    /// The same, not heard now, carried on from where it last said it was: straight on, or with the turn that it flew.
    pub(crate) fn carried_on(&self, now: Time, radio: Radio) -> Self {
        let (said, after_s) = (&self.said, (now - self.said_at).s());
        let state = match radio {
            Radio::Perfect => {
                let straight = UavState { turn_rate_rad_s: 0.0, ..*said }.carried_on(after_s);
                UavState { turn_rate_rad_s: said.turn_rate_rad_s, ..straight }
            }
            Radio::Fallible => said.carried_on(after_s),
        };
        Self { state, is_heard: false, boresight: None, ..*self }
    }
}
