//! Columns of the page that are taken from the record unchanged.

use standoff_record::{GroupRow, IntruderRow, PageColumns, TentativeRow, TrackRow, UavRow};

/// Columns of the record that the page contains.
#[derive(Debug, Default)]
pub(super) struct Recorded {
    pub(super) uavs: PageColumns<UavRow>,
    pub(super) groups: PageColumns<GroupRow>,
    pub(super) intruders: PageColumns<IntruderRow>,
    pub(super) tracks: PageColumns<TrackRow>,
    pub(super) tentative: PageColumns<TentativeRow>,
}
