//! The UAVs that share the work.

use crate::angle::Angle;
use crate::coordination::group_id::GroupId;
use crate::uav::{UavId, UavState};

/// A UAV heard of late.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Teammate {
    /// Which UAV.
    pub uav: UavId,
    /// Where it said it was, carried on along its course to now.
    pub state: UavState,
    /// It said so at this very instant.
    pub is_heard: bool,
    /// Where its sensor points, if it was heard at this very instant and looks.
    pub boresight: Option<Angle>,
    /// The group that it serves.
    pub group: Option<GroupId>,
}
