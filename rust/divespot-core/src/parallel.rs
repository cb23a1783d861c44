//! Shares work among scoped threads, with results that do not depend on their number.
//!
//! There is no global pool: it would deadlock in a process that forks.

use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::cancel::{current_flag, part, poll};

/// The number of threads to run: `asked`, or for 0 all that this process may use.
#[must_use]
pub fn thread_count(asked: usize) -> usize {
    if asked > 0 {
        return asked;
    }
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Applies `job` to the consecutive ranges of length `chunk` that make up `0..len`.
///
/// The results come in the order of the ranges, on whichever threads they were computed.
pub(crate) fn map_chunks<T: Send>(
    len: usize,
    chunk: usize,
    threads: usize,
    job: impl Fn(Range<usize>) -> T + Sync,
) -> Vec<T> {
    let count = len.div_ceil(chunk);
    let range = |i: usize| i * chunk..len.min((i + 1) * chunk);
    if threads < 2 || count < 2 {
        return (0..count).map(|i| polled(&job, range(i))).collect();
    }
    let next = AtomicUsize::new(0);
    let done = Mutex::new(std::iter::repeat_with(|| None).take(count).collect::<Vec<_>>());
    run(threads.min(count), &|| {
        let take = || Some(next.fetch_add(1, Ordering::Relaxed)).filter(|&i| i < count);
        let mine: Vec<_> = std::iter::from_fn(take).map(|i| (i, polled(&job, range(i)))).collect();
        let mut done = lock(&done);
        mine.into_iter().for_each(|(i, result)| done[i] = Some(result));
    });
    into_inner(done).into_iter().flatten().collect()
}

/// Applies `job` to each of `items`, one at a time, for work whose items take very different times.
pub(crate) fn map_each<T, R: Send>(
    items: impl IntoIterator<Item = T, IntoIter: ExactSizeIterator + Send>,
    threads: usize,
    job: impl Fn(T) -> R + Sync,
) -> Vec<R> {
    let items = items.into_iter();
    let mut out: Vec<Option<R>> = (0..items.len()).map(|_| None).collect();
    share(items.zip(&mut out), threads, |(item, slot)| *slot = Some(job(item)));
    out.into_iter().flatten().collect()
}

/// Runs two jobs at the same time.
pub fn both<A: Send, B: Send>(
    threads: usize,
    a: impl FnOnce() -> A + Send,
    b: impl FnOnce() -> B + Send,
) -> (A, B) {
    let (mut first, mut second) = (None, None);
    let jobs: [Box<dyn FnOnce() + Send + '_>; 2] =
        [Box::new(|| first = Some(a())), Box::new(|| second = Some(b()))];
    share(jobs.into_iter(), thread_count(threads), |job| job());
    first.zip(second).unwrap_or_else(|| unreachable!("share does every job"))
}

/// Passes `out` to `job` in pieces of length `chunk`, each with the index of its first element.
pub(crate) fn fill_chunks<T: Send>(
    out: &mut [T],
    chunk: usize,
    threads: usize,
    job: impl Fn(usize, &mut [T]) + Sync,
) {
    share(out.chunks_mut(chunk).enumerate(), threads, |(i, piece)| job(i * chunk, piece));
}

/// Splits `out` into consecutive pieces of the given lengths, whose sum is at most its own.
pub(crate) fn split_by<T>(
    mut out: &mut [T],
    lengths: impl IntoIterator<Item = usize>,
) -> Vec<&mut [T]> {
    let cut = lengths.into_iter().map(|length| {
        let (piece, rest) = std::mem::take(&mut out).split_at_mut(length);
        out = rest;
        piece
    });
    cut.collect()
}

/// Passes each of `items` to `job`, on whichever thread is free.
pub(crate) fn share<T>(
    items: impl ExactSizeIterator<Item = T> + Send,
    threads: usize,
    job: impl Fn(T) + Sync,
) {
    let threads = threads.min(items.len());
    let items = Mutex::new(items);
    run(threads, &|| {
        let take = || lock(&items).next();
        std::iter::from_fn(take).for_each(|item| polled(&job, item));
    });
}

/// Runs `worker` on this many threads, or on fewer if the system starts no more. It is compiled once,
/// not for every kind of work: the code that starts threads is long.
fn run(threads: usize, worker: &(dyn Fn() + Sync)) {
    std::thread::scope(|scope| {
        for _ in 1..threads {
            let flag = current_flag();
            let helper = || part(flag, worker);
            if std::thread::Builder::new().spawn_scoped(scope, helper).is_err() {
                break;
            }
        }
        worker();
    });
    poll();
}

/// Runs a job unless the work was cancelled.
fn polled<T, R>(job: impl Fn(T) -> R, item: T) -> R {
    poll();
    job(item)
}

pub(crate) fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

pub(crate) fn into_inner<T>(mutex: Mutex<T>) -> T {
    mutex.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_come_in_order_at_any_thread_count() {
        for threads in [1, 2, 7] {
            let ranges = map_chunks(10, 3, threads, |r| r);
            assert_eq!(ranges, [0..3, 3..6, 6..9, 9..10]);
        }
        assert!(map_chunks(0, 3, 2, |r| r).is_empty());
    }

    #[test]
    fn results_come_in_the_order_of_what_was_used_up() {
        for threads in [1, 2, 7] {
            let words: Vec<String> = (0..50).map(|i| i.to_string()).collect();
            let lengths: Vec<usize> = words.iter().map(String::len).collect();
            assert_eq!(map_each(words, threads, |word| word.len()), lengths);
        }
    }

    #[test]
    fn every_element_is_filled_once() {
        let mut out = vec![0; 1001];
        fill_chunks(&mut out, 10, 3, |first, piece| {
            piece.iter_mut().enumerate().for_each(|(k, v)| *v += first + k);
        });
        assert!(out.iter().enumerate().all(|(i, &v)| i == v));
    }
}
