//! Criterion benches, one a kernel.

fn main() {}
