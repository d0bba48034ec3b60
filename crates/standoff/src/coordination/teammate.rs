//! The UAVs of a team.

use crate::angle::Angle;
use crate::group_id::GroupId;
use crate::message::{Manoeuvre, Report};
use crate::params::LinkModel;
use crate::time::{Duration, Time};
use crate::uav::{UavId, UavState};

/// A UAV whose last report is within the teammate timeout.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub struct Teammate {
    /// Id of the UAV.
    pub uav: UavId,
    /// State of the UAV: as reported, or extrapolated to now from the last report.
    pub state: UavState,
    /// True if the UAV has reported at this time step.
    pub reported_now: bool,
    /// Boresight of its sensor; `None` without a report or scan at this time step.
    pub boresight: Option<Angle>,
    /// Assigned group of the UAV.
    pub group: Option<GroupId>,
    /// State in the last report.
    pub(crate) last_report: UavState,
    /// Time of the last report.
    pub(crate) last_report_at: Time,
    /// Assigned group according to the last report.
    pub(crate) reported_group: Option<GroupId>,
    /// True if the UAV has announced that it leaves.
    pub(crate) has_left: bool,
    /// Time from which its detections start tracks: [`WRONG_MAX_S`](crate::message::WRONG_MAX_S) after it has joined the
    /// team. Before, they only update the team's tracks.
    pub(crate) starts_tracks_from: Time,
    /// Manoeuvre according to the last report.
    #[serde(skip)]
    pub(crate) manoeuvre: Option<Manoeuvre>,
}

/// Group and index of each UAV that is assigned to a group.
pub(crate) fn groups_of(team: &[Teammate]) -> impl Iterator<Item = (GroupId, usize)> {
    team.iter().enumerate().filter_map(|(index, teammate)| Some((teammate.group?, index)))
}

impl Teammate {
    /// A UAV with a report of this time step; `group` is its assignment in the team state.
    pub(crate) fn from_report(report: &Report, group: Option<GroupId>, starts_tracks_from: Time) -> Self {
        let Report { uav, state, boresight, time, assigned_group, is_leaving, manoeuvre, .. } = *report;
        Self {
            uav,
            state,
            reported_now: true,
            boresight,
            group,
            last_report: state,
            last_report_at: time,
            reported_group: assigned_group,
            has_left: is_leaving,
            starts_tracks_from,
            manoeuvre,
        }
    }

    /// True if the last report is within the teammate timeout and did not announce that the UAV leaves.
    pub(crate) fn is_recent(&self, now: Time, teammate_timeout: Duration) -> bool {
        !self.has_left && now - self.last_report_at <= teammate_timeout
    }

    /// Extrapolates a UAV without a current report from its last one: straight ahead, or along its turn.
    pub(crate) fn extrapolated(&self, now: Time, radio: LinkModel) -> Self {
        let (last, after_s) = (&self.last_report, (now - self.last_report_at).s());
        let state = match radio {
            LinkModel::Ideal => {
                let straight = UavState { turn_rate_rad_s: 0.0, ..*last }.extrapolated(after_s);
                UavState { turn_rate_rad_s: last.turn_rate_rad_s, ..straight }
            }
            LinkModel::Lossy => last.extrapolated(after_s),
        };
        Self { state, reported_now: false, boresight: None, ..*self }
    }
}
