//! Decompresses LZF, the compression of PCD files (format of Marc Lehmann's liblzf).
//!
//! A byte below 32 starts a run of that many literals plus one. Any other byte starts a reference
//! back: its upper three bits are the length less 2, with one more byte added if all three are set;
//! its lower five bits and the next byte are the distance less 1.

use crate::cancel::poll;
use crate::{Error, Result, memory_for};

/// Largest ratio of decompressed to compressed bytes: a reference of 3 bytes yields at most 264.
const LARGEST_RATIO: usize = 88;

/// Bytes between two checks for cancellation. Decides no answer.
const PIECE: usize = 1 << 20;

/// Decompresses `packed` into `size` bytes.
///
/// # Errors
///
/// [`Error::Corrupt`] if the data end within a run, refer back to before their start or do not hold
/// `size` bytes; [`Error::Memory`] if memory is too small for the most they can hold.
pub fn decompress(packed: &[u8], size: usize) -> Result<Vec<u8>> {
    let most = size.min(packed.len().saturating_mul(LARGEST_RATIO));
    memory_for(most, || format!("{most} bytes of compressed data"))?;
    let mut output = Vec::with_capacity(most);
    let mut input = packed;
    let mut next_poll = 0;
    while let Some((&control, rest)) = input.split_first() {
        input = if control < 32 {
            literals(rest, usize::from(control) + 1, size, &mut output)?
        } else {
            reference(rest, control, size, &mut output)?
        };
        if output.len() >= next_poll {
            poll();
            next_poll = output.len() + PIECE;
        }
    }
    if output.len() < size { Err(Error::Corrupt("hold less than promised")) } else { Ok(output) }
}

/// Copies `count` bytes of the input; returns the rest.
fn literals<'a>(
    input: &'a [u8],
    count: usize,
    size: usize,
    output: &mut Vec<u8>,
) -> Result<&'a [u8]> {
    let (run, rest) = input.split_at_checked(count).ok_or(ENDS_WITHIN)?;
    require_room(output.len(), count, size)?;
    output.extend_from_slice(run);
    Ok(rest)
}

/// Copies the bytes that a reference points at, which may overlap those it writes; returns the
/// rest.
fn reference<'a>(
    input: &'a [u8],
    control: u8,
    size: usize,
    output: &mut Vec<u8>,
) -> Result<&'a [u8]> {
    let mut length = usize::from(control >> 5) + 2;
    let mut rest = input;
    if length == 9 {
        let (&more, after) = rest.split_first().ok_or(ENDS_WITHIN)?;
        length += usize::from(more);
        rest = after;
    }
    let (&low, rest) = rest.split_first().ok_or(ENDS_WITHIN)?;
    let distance = (usize::from(control & 31) << 8) + usize::from(low) + 1;
    let start = output.len().checked_sub(distance).ok_or(BEFORE_START)?;
    require_room(output.len(), length, size)?;
    if distance >= length {
        output.extend_from_within(start..start + length);
    } else {
        (start..start + length).for_each(|at| output.push(output[at]));
    }
    Ok(rest)
}

const ENDS_WITHIN: Error = Error::Corrupt("end within a run");
const BEFORE_START: Error = Error::Corrupt("refer back to before their start");

fn require_room(held: usize, more: usize, size: usize) -> Result<()> {
    if more > size - held { Err(Error::Corrupt("hold more than promised")) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn what_liblzf_packed_is_read() {
        // "aaaaaaaaaa": a literal, then nine bytes from one before.
        assert_eq!(decompress(&[0, b'a', 0xe0, 0, 0], 10), Ok(b"aaaaaaaaaa".to_vec()));
        assert_eq!(decompress(&[2, b'a', b'b', b'c', 0x20, 2], 6), Ok(b"abcabc".to_vec()));
        assert_eq!(decompress(&[], 0), Ok(vec![]));
    }

    #[test]
    fn what_is_corrupt_is_told() {
        let corrupt = |text| Err(Error::Corrupt(text));
        assert_eq!(decompress(&[5, b'a'], 6), corrupt("end within a run"));
        assert_eq!(decompress(&[0, b'a', 0x20], 4), corrupt("end within a run"));
        assert_eq!(decompress(&[0, b'a', 0xe0, 0], 10), corrupt("end within a run"));
        assert_eq!(decompress(&[0x20, 0], 3), Err(BEFORE_START));
        assert_eq!(decompress(&[0, b'a', 0x20, 1], 4), Err(BEFORE_START));
        assert_eq!(decompress(&[1, b'a', b'b'], 1), corrupt("hold more than promised"));
        assert_eq!(decompress(&[0, b'a', 0xe0, 255, 0], 9), corrupt("hold more than promised"));
        assert_eq!(decompress(&[0, b'a'], 2), corrupt("hold less than promised"));
    }

    #[test]
    fn a_size_that_cannot_be_takes_no_memory() {
        assert_eq!(
            decompress(&[0, b'a'], usize::MAX),
            Err(Error::Corrupt("hold less than promised"))
        );
    }

    proptest! {
        #[test]
        fn any_bytes_end_in_a_result(
            packed in prop::collection::vec(any::<u8>(), 0..300), size in 0_usize..5000
        ) {
            if let Ok(output) = decompress(&packed, size) {
                prop_assert_eq!(output.len(), size);
            }
        }
    }
}
