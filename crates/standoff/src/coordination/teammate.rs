//! The UAVs that share the work.

use crate::angle::Angle;
use crate::frame::Displacement;
use crate::group_id::GroupId;
use crate::math;
use crate::message::Report;
use crate::team::Radio;
use crate::time::{Duration, Time};
use crate::uav::{UavId, UavState, Vertical};

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
        let (said, dt_s) = (&self.said, (now - self.said_at).s());
        let mut state = *said;
        state.vertical = said
            .vertical
            .map(|vertical| Vertical { altitude_m: vertical.altitude_m + vertical.climb_rate_m_s * dt_s, ..vertical });
        let turned_rad = said.turn_rate_rad_s * dt_s;
        if radio == Radio::Perfect || turned_rad.abs() < 1e-9 {
            state.position = said.position + said.velocity() * dt_s;
        } else {
            // The chord of the arc, half of the turn from where it began.
            let chord_m = 2.0 * said.speed_m_s / said.turn_rate_rad_s * math::sin(0.5 * turned_rad);
            let along = said.heading + Angle::from_rad(0.5 * turned_rad);
            state.position = said.position + Displacement::from_polar(chord_m, along);
            state.heading = said.heading + Angle::from_rad(turned_rad);
        }
        Self { state, is_heard: false, boresight: None, ..*self }
    }
}
