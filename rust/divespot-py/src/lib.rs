//! The Python face of divespot-core.
