//! Cancellable work: stops waiting for it when an interruption arrives.

use std::panic::resume_unwind;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

/// Period of the checks for an interruption.
pub const POLL: Duration = Duration::from_millis(50);

/// Runs `work` on a thread; returns `None` if `is_interrupted` returns true first. The abandoned work then continues in
/// the background, at most until the process ends.
///
/// If no thread can be started, the work runs to its end on the calling thread.
pub fn run_interruptible<T: Send + 'static>(
    is_interrupted: impl Fn() -> bool,
    work: impl FnOnce() -> T + Send + 'static,
) -> Option<T> {
    run_on(thread::Builder::new(), is_interrupted, work)
}

fn run_on<T: Send + 'static>(
    thread: thread::Builder,
    is_interrupted: impl Fn() -> bool,
    work: impl FnOnce() -> T + Send + 'static,
) -> Option<T> {
    if is_interrupted() {
        return None;
    }
    let (give, result) = channel();
    // A thread that fails to start drops its closure. The work is shared, so that it can still run here.
    let work = Arc::new(Mutex::new(Some(work)));
    let take = |work: &Mutex<Option<_>>| work.lock().unwrap_or_else(PoisonError::into_inner).take();
    let shared = Arc::clone(&work);
    let Ok(worker) = thread.spawn(move || take(&shared).map(|work| give.send(work()))) else {
        return take(&work).map(|work| work());
    };
    loop {
        match result.recv_timeout(POLL) {
            Ok(done) => return Some(done),
            Err(RecvTimeoutError::Timeout) if is_interrupted() => return None,
            Err(RecvTimeoutError::Timeout) => {}
            // The worker panicked: propagate the panic.
            Err(RecvTimeoutError::Disconnected) => resume_unwind(worker.join().err()?),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicBool, Ordering};

    use super::*;

    #[test]
    fn work_is_done_unless_it_is_interrupted() {
        let stop = Arc::new(AtomicBool::new(false));
        let is_interrupted = || stop.load(Ordering::Relaxed);
        assert_eq!(run_interruptible(is_interrupted, || 7), Some(7));
        let set = Arc::clone(&stop);
        let endless = move || loop {
            set.store(true, Ordering::Relaxed);
            thread::park();
        };
        assert_eq!(run_interruptible(is_interrupted, endless), None::<()>);
        assert_eq!(run_interruptible(is_interrupted, || 7), None);
    }

    /// A stack that is too large for the address space makes the start of a thread fail for every user.
    #[test]
    fn work_runs_on_the_calling_thread_if_no_thread_can_be_started() {
        let here = thread::current().id();
        let endless = thread::Builder::new().stack_size(1 << 60);
        let done = run_on(endless, || false, move || thread::current().id() == here);
        assert_eq!(done, Some(true));
    }

    #[test]
    #[should_panic(expected = "a fault")]
    fn a_panic_of_the_work_is_propagated() {
        run_interruptible(|| false, || panic!("a fault"));
    }
}
