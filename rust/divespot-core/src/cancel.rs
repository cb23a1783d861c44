//! Cancels long work, such as on Ctrl-C.
//!
//! The flag belongs to the thread that works; the threads of `parallel` inherit it. A long loop
//! calls [`poll`] at least every tenth of a second. Once the flag is set, `poll` unwinds to
//! [`unless_called_off`] without printing a panic's message. So no function has the flag among its
//! parameters, and memory held by a loop is freed. rust-analyzer cancels its queries in the same
//! way.

use std::any::Any;
use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::{Error, Result};

/// The flag that the caller sets to cancel the work.
pub type Flag = Arc<AtomicBool>;

/// The payload of the unwinding.
struct CalledOff;

thread_local! {
    static FLAG: RefCell<Option<Flag>> = const { RefCell::new(None) };
}

/// Runs `work`, which ends soon after `flag` is set.
///
/// # Errors
///
/// [`Error::Interrupted`] if the work was cancelled before it was done.
pub fn unless_called_off<T>(flag: &Flag, work: impl FnOnce() -> T) -> Result<T> {
    let caught = catch_unwind(AssertUnwindSafe(|| under(Some(Arc::clone(flag)), work)));
    caught.map_err(|payload| {
        panic_again(payload);
        Error::Interrupted
    })
}

/// Unwinds if this thread's work was cancelled.
#[inline]
pub fn poll() {
    if FLAG.with_borrow(|flag| flag.as_ref().is_some_and(|flag| flag.load(Ordering::Relaxed))) {
        resume_unwind(Box::new(CalledOff));
    }
}

/// Items between two checks of the flag. Decides no answer.
const EVERY: usize = 256;

/// Iterators of long loops.
pub(crate) trait Polled: Iterator + Sized {
    /// The same items; the flag is checked on the way.
    fn polled(self) -> impl Iterator<Item = Self::Item> {
        let mut left = 0;
        self.inspect(move |_| {
            if left == 0 {
                poll();
                left = EVERY;
            }
            left -= 1;
        })
    }
}

impl<I: Iterator> Polled for I {}

/// The flag of this thread's work.
pub(crate) fn current_flag() -> Option<Flag> {
    FLAG.with_borrow(Clone::clone)
}

/// Runs a part of the work under `flag` on another thread; returns early if it is cancelled.
pub(crate) fn part(flag: Option<Flag>, work: impl FnOnce()) {
    if let Err(payload) = catch_unwind(AssertUnwindSafe(|| under(flag, work))) {
        panic_again(payload);
    }
}

/// Resumes any panic except a cancellation.
fn panic_again(payload: Box<dyn Any + Send>) {
    if !payload.is::<CalledOff>() {
        resume_unwind(payload);
    }
}

fn under<T>(flag: Option<Flag>, work: impl FnOnce() -> T) -> T {
    struct Restored(Option<Flag>);
    impl Drop for Restored {
        fn drop(&mut self) {
            FLAG.set(self.0.take());
        }
    }
    let _restored = Restored(FLAG.replace(flag));
    work()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parallel::map_chunks;

    fn set(called_off: bool) -> Flag {
        Arc::new(AtomicBool::new(called_off))
    }

    #[test]
    fn work_ends_where_it_is_called_off_and_is_done_otherwise() {
        for threads in [1, 4] {
            let work = || map_chunks(1000, 1, threads, |range| range.start).len();
            assert_eq!(unless_called_off(&set(false), work), Ok(1000));
            assert_eq!(unless_called_off(&set(true), work), Err(Error::Interrupted));
        }
    }

    #[test]
    fn a_flag_set_meanwhile_ends_the_work_on_all_threads() {
        let flag = set(false);
        let work = || {
            map_chunks(1 << 20, 1, 4, |range| {
                flag.store(range.start > 1000, Ordering::Relaxed);
            })
        };
        assert!(unless_called_off(&flag, work).is_err());
    }

    #[test]
    fn nothing_is_called_off_afterwards() {
        assert!(unless_called_off(&set(true), poll).is_err());
        poll();
    }

    #[test]
    #[should_panic(expected = "its own")]
    fn a_panic_stays_one() {
        let _ = unless_called_off(&set(true), || panic!("its own"));
    }
}
