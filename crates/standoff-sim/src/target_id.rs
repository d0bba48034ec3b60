//! Ids of the true targets.

use standoff::TargetLabel;

/// Id of a target in the scenario and in the record, independent of the ids that sensors and the team use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct TargetId(pub u32);

impl TargetId {
    /// Returns the identity that sensors and cues report if they identify targets: the same number.
    pub fn label(self) -> TargetLabel {
        TargetLabel(self.0)
    }
}
