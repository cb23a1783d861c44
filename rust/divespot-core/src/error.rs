//! What can be wrong with an input, each in one sentence: what was given, what is needed.

/// The result of a kernel.
pub type Result<T> = std::result::Result<T, Error>;

/// Why a kernel could not work.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A setting outside its range.
    #[error("{name} is {given}: {needed} is needed")]
    Setting {
        /// The setting's name as the caller knows it.
        name: &'static str,
        /// The value that was given.
        given: f64,
        /// The values that are accepted.
        needed: &'static str,
    },
    /// Fewer usable points than the kernel needs.
    #[error("{given} usable points were given: {what} needs at least {needed}")]
    TooFewPoints {
        /// The task.
        what: &'static str,
        /// Usable points given.
        given: usize,
        /// Points needed.
        needed: usize,
    },
    /// Points from which the wanted shape does not follow.
    #[error("{0}")]
    Degenerate(&'static str),
    /// An outline inside of which nothing can be measured.
    #[error("outline {number} {problem}")]
    Outline {
        /// Its place among all, from 1.
        number: usize,
        /// What it does and what is needed.
        problem: &'static str,
    },
    /// A grid with more cells than fit.
    #[error(
        "the points would spread over a grid of {cells:.1e} cells: a larger {name}, or a crop to where most points lie, is needed"
    )]
    GridTooLarge {
        /// The setting that decides the number of cells.
        name: &'static str,
        /// The number of cells that the setting leads to.
        cells: f64,
    },
    /// Compressed data that are none, or not all of them.
    #[error("the compressed data {0}: they are corrupt")]
    Corrupt(&'static str),
    /// There is no memory for what a kernel holds at once.
    #[error("there is no memory for {0}")]
    Memory(String),
    /// The caller asked to stop.
    #[error("interrupted")]
    Interrupted,
}

/// Asks for memory that will be needed, so that its lack is an error: an allocation that fails ends
/// the process.
///
/// # Errors
///
/// [`Error::Memory`] where there is none for `bytes` more.
pub fn memory_for(bytes: usize, what: impl FnOnce() -> String) -> Result<()> {
    Vec::<u8>::new().try_reserve_exact(bytes).map_err(|_| Error::Memory(what()))
}

/// Passes a finite value above zero; names the setting otherwise.
pub(crate) fn positive(name: &'static str, value: f64) -> Result<f64> {
    if value.is_finite() && value > 0.0 {
        return Ok(value);
    }
    Err(Error::Setting { name, given: value, needed: "a finite number above 0" })
}
