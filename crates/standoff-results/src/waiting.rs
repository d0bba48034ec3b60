//! Work that somebody waits for, unless something comes that ends the waiting.

use std::panic::resume_unwind;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

/// How often is looked whether it has come.
pub const GLANCE: Duration = Duration::from_millis(50);

/// Does what nobody needs any more once something has come: `None` then, and the work is left where it is, to end with the
/// process at the latest.
///
/// Where no thread can be started, it is done here, to its end.
pub fn done_unless<T: Send + 'static>(
    has_come: impl Fn() -> bool,
    work: impl FnOnce() -> T + Send + 'static,
) -> Option<T> {
    done_on(thread::Builder::new(), has_come, work)
}

fn done_on<T: Send + 'static>(
    thread: thread::Builder,
    has_come: impl Fn() -> bool,
    work: impl FnOnce() -> T + Send + 'static,
) -> Option<T> {
    if has_come() {
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
            Err(RecvTimeoutError::Timeout) if has_come() => return None,
            Err(RecvTimeoutError::Timeout) => {}
            // It has panicked: here, too, then.
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
        let has_come = || stop.load(Ordering::Relaxed);
        assert_eq!(done_unless(has_come, || 7), Some(7));
        let set = Arc::clone(&stop);
        let endless = move || loop {
            set.store(true, Ordering::Relaxed);
            thread::park();
        };
        assert_eq!(done_unless(has_come, endless), None::<()>);
        assert_eq!(done_unless(has_come, || 7), None);
    }

    /// As much stack as there is no room for keeps a thread from being started, whoever asks.
    #[test]
    fn work_is_done_where_no_thread_can_be_started() {
        let here = thread::current().id();
        let endless = thread::Builder::new().stack_size(1 << 60);
        let done = done_on(endless, || false, move || thread::current().id() == here);
        assert_eq!(done, Some(true));
    }

    #[test]
    #[should_panic(expected = "a fault")]
    fn a_fault_of_the_work_is_not_taken_for_an_interruption() {
        done_unless(|| false, || panic!("a fault"));
    }
}
