//! The errors of the kernels, each one sentence: what was given, and what is needed.

/// The result of a kernel.
pub type Result<T> = std::result::Result<T, Error>;

/// Why a kernel could not work.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A setting outside its range.
    #[error("{name} is {given}: {needed} is needed")]
    Setting {
        /// The setting's name, as the caller knows it.
        name: &'static str,
        /// The value that was given.
        given: f64,
        /// The values that are accepted.
        needed: &'static str,
    },
    /// Fewer usable points than the kernel needs.
    #[error("{given} usable points were given: at least {needed} are needed for {what}")]
    TooFewPoints {
        /// What the points are needed for.
        what: &'static str,
        /// Number of usable points given.
        given: usize,
        /// Number of points needed.
        needed: usize,
    },
    /// Points or arrays from which the result cannot be computed.
    #[error("{0}")]
    Degenerate(&'static str),
    /// Arrays that do not fit a grid.
    #[error("{given} {what} were given for {needed} cells: one for each is needed")]
    Cells {
        /// What the array holds.
        what: &'static str,
        /// Number of values given.
        given: usize,
        /// Number of cells.
        needed: usize,
    },
    /// An outline inside which nothing can be measured.
    #[error("outline {number} {problem}")]
    Outline {
        /// Its number among all, from 1.
        number: usize,
        /// What is wrong with it, and what is needed.
        problem: &'static str,
    },
    /// A grid with too many cells.
    #[error(
        "the points would spread over a grid of {cells:.1e} cells: a larger {name}, or a crop to where most points lie, is needed"
    )]
    GridTooLarge {
        /// The setting that decides the number of cells.
        name: &'static str,
        /// The number of cells that the setting leads to.
        cells: f64,
    },
    /// Encoded data that are damaged or incomplete.
    #[error("the data {0}: intact data are needed")]
    Corrupt(&'static str),
    /// Not enough memory for a kernel's working set.
    #[error("there is no memory for {0}: less of it, or more memory, is needed")]
    Memory(String),
    /// The caller cancelled the work.
    #[error("interrupted")]
    Interrupted,
}

/// Checks that `bytes` of memory can be allocated, so that a lack of memory is an error. A failed
/// allocation would end the process.
///
/// # Errors
///
/// [`Error::Memory`] if they cannot.
pub fn memory_for(bytes: usize, what: impl FnOnce() -> String) -> Result<()> {
    Vec::<u8>::new().try_reserve_exact(bytes).map_err(|_| Error::Memory(what()))
}

/// Returns a finite value above zero; any other is an error that names the setting.
pub(crate) fn positive(name: &'static str, value: f64) -> Result<f64> {
    if value.is_finite() && value > 0.0 {
        return Ok(value);
    }
    Err(Error::Setting { name, given: value, needed: "a finite number above 0" })
}
