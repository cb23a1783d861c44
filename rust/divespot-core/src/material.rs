//! The angles at which bulk material lies, as rise over run. All other angles in the core follow
//! from these.

/// The flattest angle of repose of any poured material: 15°.
pub(crate) const FLATTEST: f64 = 0.268;
/// The steepest slope of ground: 7.5°, half of the flattest angle of repose (15°).
pub(crate) const GENTLE: f64 = 0.13;
/// The steepest slope of any poured material: 50°.
pub(crate) const STEEPEST_POURED: f64 = 1.2;
/// The steepest face on which any bulk material stands: 60°, cohesive soil and damp fines included.
/// What is steeper is an edge between two surfaces.
pub(crate) const NEVER_STEEPER: f64 = 1.732;
