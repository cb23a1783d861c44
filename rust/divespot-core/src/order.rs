//! A radix sort of rows by integer keys.

use crate::cancel::{Polled, poll};
use crate::parallel::fill_chunks;
use crate::{Places, Point};

/// A row of the input and its key.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Keyed {
    pub(crate) key: u64,
    pub(crate) row: u32,
}

/// Points for a thread at a time. Decides no answer.
const CHUNK: usize = 4096;

/// Each row with the key of its point.
pub(crate) fn keyed_by<'a>(
    points: impl Into<Places<'a>>,
    threads: usize,
    key: impl Fn(&Point) -> u64 + Sync,
) -> Vec<Keyed> {
    let points = points.into();
    let mut keyed = vec![Keyed::default(); points.len()];
    fill_chunks(&mut keyed, CHUNK, threads, |first, piece| {
        let places = points.within(first..first + piece.len());
        for ((keyed, row), p) in piece.iter_mut().zip(first as u32..).zip(places) {
            *keyed = Keyed { key: key(&p), row };
        }
    });
    keyed
}

/// Bits of a digit: few passes, and counters that fit in the cache. Decides no answer.
const DIGIT_BITS: u32 = 11;
const BUCKETS: usize = 1 << DIGIT_BITS;

/// Rows in ascending order of keys; stable.
pub(crate) fn sort_by_key(rows: Vec<Keyed>) -> Vec<Keyed> {
    sort_by(rows, |row| row.key)
}

/// Values in ascending order of their keys; stable.
///
/// A radix sort, least significant digit first, with as many passes as the largest key has digits.
pub(crate) fn sort_by<T: Copy + Default>(mut rows: Vec<T>, key: impl Fn(&T) -> u64) -> Vec<T> {
    let largest = rows.iter().map(&key).max().unwrap_or(0);
    let mut sorted = vec![T::default(); rows.len()];
    let mut shift = 0;
    while shift < u64::BITS && largest >> shift > 0 {
        poll();
        scatter(&rows, &mut sorted, |row| (key(row) >> shift) as usize & (BUCKETS - 1));
        std::mem::swap(&mut rows, &mut sorted);
        shift += DIGIT_BITS;
    }
    rows
}

fn scatter<T: Copy>(rows: &[T], sorted: &mut [T], digit: impl Fn(&T) -> usize) {
    let mut next = [0_usize; BUCKETS];
    rows.iter().polled().for_each(|row| next[digit(row)] += 1);
    let mut start = 0;
    for slot in &mut next {
        start += std::mem::replace(slot, start);
    }
    for row in rows.iter().polled() {
        let slot = &mut next[digit(row)];
        sorted[*slot] = *row;
        *slot += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::mix;

    #[test]
    fn the_order_is_that_of_a_stable_sort() {
        for (count, mask) in [(0, 0), (1, u64::MAX), (5000, 0), (5000, 0xfff), (5000, u64::MAX)] {
            let rows: Vec<Keyed> =
                (0..count).map(|row| Keyed { key: mix(u64::from(row)) & mask, row }).collect();
            let mut expected = rows.clone();
            expected.sort_by_key(|r| r.key);
            assert_eq!(sort_by_key(rows), expected);
        }
    }
}
