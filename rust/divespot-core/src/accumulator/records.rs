//! Reads LAS point records (LAS 1.4 R15), as in a file or decompressed from LAZ, into an
//! accumulator.

use crate::cancel::Polled;
use crate::{Error, Point, Result};

use super::accumulate::Accumulator;

/// Bytes of a record that are read: x, y, z, intensity, returns, flags and class.
const LEAST: usize = 17;

/// What to do with the points of a class.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Class {
    /// Take them.
    Wanted,
    /// Count them as noise.
    Noise,
    /// Leave them out: they were not asked for.
    Unwanted,
}

/// Which returns of a pulse are wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Returns {
    /// All.
    All,
    /// The first.
    First,
    /// The last.
    Last,
}

/// Which points are wanted.
#[derive(Debug, Clone)]
pub struct Wanted {
    /// By class.
    pub classes: [Class; 256],
    /// By return.
    pub returns: Returns,
    /// Inside the box between two corners, in m.
    pub within: Option<[Point; 2]>,
}

/// Records of one length, and how their integers become metres.
#[derive(Debug, Clone, Copy)]
pub struct Records<'a> {
    /// The records.
    pub bytes: &'a [u8],
    /// Bytes of a record.
    pub stride: usize,
    /// Whether their format is 6 or higher (LAS 1.4 R15, tables 7 and 15).
    pub is_extended: bool,
    /// Scale factor of each coordinate, in the file's unit.
    pub scales: Point,
    /// Offset of each coordinate, in the file's unit.
    pub offsets: Point,
    /// Length of the file's unit along each axis, in m.
    pub metres: Point,
}

/// How many points were taken and left out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Told {
    /// Points that are wanted.
    pub kept: u64,
    /// Of those, points outside the box.
    pub outside: u64,
    /// Withheld (deleted) points (LAS 1.4 R15, table 16).
    pub withheld: u64,
    /// Points in noise classes.
    pub noise: u64,
    /// Points of classes and returns that were not asked for.
    pub unwanted: u64,
    /// Points of each class.
    pub classes: [u64; 256],
}

impl Default for Told {
    fn default() -> Self {
        Self { kept: 0, outside: 0, withheld: 0, noise: 0, unwanted: 0, classes: [0; 256] }
    }
}

impl Records<'_> {
    fn point(&self, record: &[u8]) -> Point {
        let (whole, _) = record.as_chunks::<4>();
        std::array::from_fn(|k| {
            let in_file =
                f64::from(i32::from_le_bytes(whole[k])) * self.scales[k] + self.offsets[k];
            in_file * self.metres[k]
        })
    }

    /// Class, number of the return, number of returns of its pulse, and whether it is withheld.
    fn marks(&self, record: &[u8]) -> (u8, u8, u8, bool) {
        let returns = record[14];
        if self.is_extended {
            (record[16], returns & 15, returns >> 4, record[15] & 4 > 0)
        } else {
            (record[15] & 31, returns & 7, returns >> 3 & 7, record[15] & 128 > 0)
        }
    }
}

impl Wanted {
    fn return_is_wanted(&self, number: u8, of: u8) -> bool {
        match self.returns {
            Returns::All => true,
            Returns::First => number <= 1,
            Returns::Last => number >= of,
        }
    }

    fn holds(&self, p: &Point) -> bool {
        self.within.is_none_or(|[low, high]| (0..3).all(|k| low[k] <= p[k] && p[k] <= high[k]))
    }
}

impl Accumulator {
    /// Adds the wanted points of records.
    ///
    /// # Errors
    ///
    /// As [`Accumulator::add`]; [`Error::Corrupt`] for records too short for a point.
    pub fn add_records(&mut self, records: &Records<'_>, wanted: &Wanted) -> Result<Told> {
        if records.stride < LEAST || !records.bytes.len().is_multiple_of(records.stride) {
            return Err(Error::Corrupt("are no whole LAS records"));
        }
        let mut told = Told::default();
        let points = records.bytes.chunks_exact(records.stride).polled().filter_map(|record| {
            let (class, number, of, withheld) = records.marks(record);
            told.classes[class as usize] += 1;
            match wanted.classes[class as usize] {
                _ if withheld => told.withheld += 1,
                Class::Noise => told.noise += 1,
                Class::Wanted if wanted.return_is_wanted(number, of) => {
                    told.kept += 1;
                    let p = records.point(record);
                    if wanted.holds(&p) {
                        return Some(p);
                    }
                    told.outside += 1;
                }
                _ => told.unwanted += 1,
            }
            None
        });
        self.add(points)?;
        Ok(told)
    }
}
