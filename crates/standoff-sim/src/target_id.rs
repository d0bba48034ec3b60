//! Names of the targets that there are.

use standoff::TargetLabel;

/// A target as the world knows it: in the scenario and in the record, apart from what sensors and the team call it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct TargetId(pub u32);

impl TargetId {
    /// What sensors and cues call it: association is solved, so it is the same number.
    pub fn label(self) -> TargetLabel {
        TargetLabel(self.0)
    }
}
