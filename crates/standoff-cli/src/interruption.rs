//! Ctrl-C: work is ended in order, where it would otherwise end in the middle.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Instant;

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use standoff_results::{Failure, GLANCE, done_unless};

/// Ctrl-C, asked for.
pub(crate) struct Interruption(Arc<AtomicBool>);

impl Interruption {
    /// From now on Ctrl-C is noticed instead of ending the program; a second one ends it.
    pub(crate) fn expected() -> Result<Self, Failure> {
        let stop = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM] {
            flag::register_conditional_shutdown(signal, 1, Arc::clone(&stop)).map_err(Failure::running)?;
            flag::register(signal, Arc::clone(&stop)).map_err(Failure::running)?;
        }
        Ok(Self(stop))
    }

    pub(crate) fn has_come(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// Set when it has come.
    pub(crate) fn flag(&self) -> &AtomicBool {
        &self.0
    }

    /// Waits until it comes, or until a point in time.
    pub(crate) fn wait(&self, until: Option<Instant>) {
        while !self.has_come() {
            let left = until.map_or(GLANCE, |until| until.saturating_duration_since(Instant::now()));
            if left.is_zero() {
                return;
            }
            thread::sleep(left.min(GLANCE));
        }
    }

    /// Does what nobody needs any more once it has come: `None` then.
    pub(crate) fn unless_come<T: Send + 'static>(&self, work: impl FnOnce() -> T + Send + 'static) -> Option<T> {
        done_unless(|| self.has_come(), work)
    }
}
