//! Ctrl-C: ends work in an orderly way instead of stopping the process in the middle of it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Instant;

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use standoff_app::{Failure, POLL, run_interruptible};

/// Handler of Ctrl-C (SIGINT) and SIGTERM.
pub(crate) struct Interruption(Arc<AtomicBool>);

impl Interruption {
    /// Installs the handler: the first Ctrl-C sets a flag, a second one ends the program.
    pub(crate) fn install() -> Result<Self, Failure> {
        let stop = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM] {
            flag::register_conditional_shutdown(signal, 1, Arc::clone(&stop)).map_err(Failure::running)?;
            flag::register(signal, Arc::clone(&stop)).map_err(Failure::running)?;
        }
        Ok(Self(stop))
    }

    /// True once a signal has arrived.
    pub(crate) fn is_interrupted(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// Flag that a signal sets.
    pub(crate) fn flag(&self) -> &AtomicBool {
        &self.0
    }

    /// Waits for a signal, at most until the given time.
    pub(crate) fn wait(&self, until: Option<Instant>) {
        while !self.is_interrupted() {
            let left = until.map_or(POLL, |until| until.saturating_duration_since(Instant::now()));
            if left.is_zero() {
                return;
            }
            thread::sleep(left.min(POLL));
        }
    }

    /// Runs `work` unless a signal arrives first; returns `None` if it does.
    pub(crate) fn run_interruptible<T: Send + 'static>(&self, work: impl FnOnce() -> T + Send + 'static) -> Option<T> {
        run_interruptible(|| self.is_interrupted(), work)
    }
}
