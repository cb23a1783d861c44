//! The Python face of divespot-core: borrow, check, detach, call, convert.

mod errors;
mod hdbscan;
mod interrupt;
mod neighbors;
mod points;
mod voxel;

/// The compiled kernels of divespot.
#[pyo3::pymodule]
mod _native {
    #[pymodule_export]
    use crate::hdbscan::hdbscan;
    #[pymodule_export]
    use crate::neighbors::radius_outlier_mask;
    #[pymodule_export]
    use crate::voxel::voxel_downsample;

    #[pymodule_export]
    #[allow(non_upper_case_globals)]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
