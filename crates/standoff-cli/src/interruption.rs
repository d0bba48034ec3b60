//! Ctrl-C: work is ended in order, where it would otherwise end in the middle.

use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use standoff_results::Failure;

/// How often is looked whether it has come.
const GLANCE: Duration = Duration::from_millis(50);

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

    /// Does what nobody needs any more once it has come: `None` then, and the work is left where it is, to end with the
    /// process at the latest.
    ///
    /// Where no thread can be started, it is done here, to its end.
    pub(crate) fn unless_come<T: Send + 'static>(&self, work: impl FnOnce() -> T + Send + 'static) -> Option<T> {
        self.unless_come_on(thread::Builder::new(), work)
    }

    fn unless_come_on<T: Send + 'static>(
        &self,
        thread: thread::Builder,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Option<T> {
        if self.has_come() {
            return None;
        }
        let (give, result) = channel();
        // A thread that does not start takes what it was given with it.
        let work = Arc::new(Mutex::new(Some(work)));
        let take = |work: &Mutex<Option<_>>| work.lock().unwrap_or_else(PoisonError::into_inner).take();
        let given = Arc::clone(&work);
        let Ok(worker) = thread.spawn(move || take(&given).map(|work| give.send(work()))) else {
            return take(&work).map(|work| work());
        };
        loop {
            match result.recv_timeout(GLANCE) {
                Ok(done) => return Some(done),
                Err(RecvTimeoutError::Timeout) if self.has_come() => return None,
                Err(RecvTimeoutError::Timeout) => {}
                // It has panicked: here, too, then.
                Err(RecvTimeoutError::Disconnected) => resume_unwind(worker.join().err()?),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_is_done_unless_it_is_interrupted() {
        let stop = Arc::new(AtomicBool::new(false));
        let interruption = Interruption(Arc::clone(&stop));
        assert_eq!(interruption.unless_come(|| 7), Some(7));
        let endless = move || loop {
            stop.store(true, Ordering::Relaxed);
            thread::park();
        };
        assert_eq!(interruption.unless_come(endless), None::<()>);
        assert_eq!(interruption.unless_come(|| 7), None);
    }

    /// As much stack as there is no room for keeps a thread from being started, whoever asks.
    #[test]
    fn work_is_done_where_no_thread_can_be_started() {
        let here = thread::current().id();
        let endless = thread::Builder::new().stack_size(1 << 60);
        let done = Interruption(Arc::default()).unless_come_on(endless, move || thread::current().id() == here);
        assert_eq!(done, Some(true));
    }

    #[test]
    #[should_panic(expected = "a fault")]
    fn a_fault_of_the_work_is_not_taken_for_an_interruption() {
        Interruption(Arc::default()).unless_come(|| panic!("a fault"));
    }
}
