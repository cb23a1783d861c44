//! The angles at which bulk material lies, as rise over run.

/// Nothing poured lies flatter: 15°.
pub(crate) const FLATTEST: f64 = 0.268;
/// The steepest ground: 7.5°, half of the flattest angle of repose (15°).
pub(crate) const GENTLE: f64 = 0.13;
/// Nothing is poured steeper: 50°.
pub(crate) const STEEPEST_POURED: f64 = 1.2;
/// No bulk material stands steeper than 60°, cohesive soil and damp fines included. What is steeper
/// is an edge between two surfaces.
pub(crate) const NEVER_STEEPER: f64 = 1.732;
