//! Clouds that the benches share.
