//! The Python face of divespot-core: borrow, check, detach, call, convert.

mod errors;
mod histogram;
mod neighbors;
mod points;
mod spacing;
mod voxel;

/// The compiled kernels of divespot.
#[pyo3::pymodule]
mod _native {
    #[pymodule_export]
    use crate::histogram::{ground_height, height_histogram};
    #[pymodule_export]
    use crate::neighbors::radius_outlier_mask;
    #[pymodule_export]
    use crate::spacing::point_spacing;
    #[pymodule_export]
    use crate::voxel::voxel_downsample;

    #[pymodule_export]
    #[allow(non_upper_case_globals)] // the name that Python knows
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
