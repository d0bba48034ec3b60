//! Actions that are repeated with a period.

use standoff::{Duration, Time};

/// True if an action is due that was last done at `last`: after a period, if it was never done, or if the clock was set
/// back.
pub(crate) fn is_due(last: Option<Time>, now: Time, period: Duration) -> bool {
    last.is_none_or(|at| now < at || now - at >= period)
}
