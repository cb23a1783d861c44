//! The Python binding of divespot-core: borrow, check, detach, call, convert.

mod accumulator;
mod array;
mod bases;
mod e57;
mod errors;
mod frames;
mod ground;
mod hdbscan;
mod heap;
mod heightmap;
mod histogram;
mod interrupt;
mod lzf;
mod neighbors;
mod piles;
mod plane;
mod points;
mod polygon;
mod surface;
mod voxel;

/// The compiled kernels of divespot.
#[pyo3::pymodule]
mod _native {
    #[pymodule_export]
    use crate::accumulator::RawAccumulator;
    #[pymodule_export]
    use crate::bases::{RawBase, plane_base, surface_base};
    #[pymodule_export]
    use crate::e57::read_e57;
    #[pymodule_export]
    use crate::frames::{
        RawCamera, RawCutter, RawFusion, RawJoint, RawPatches, RawStill, RawTracker,
    };
    #[pymodule_export]
    use crate::ground::{find_ground, leveling, survey, unevenness_of_rays};
    #[pymodule_export]
    use crate::hdbscan::hdbscan;
    #[pymodule_export]
    use crate::heap::{share_heap, trim_heap};
    #[pymodule_export]
    use crate::heightmap::{RawHeightMap, height_map, integrate};
    #[pymodule_export]
    use crate::histogram::{ground_height, height_histogram};
    #[pymodule_export]
    use crate::lzf::lzf_decompress;
    #[pymodule_export]
    use crate::neighbors::{radius_outlier_mask, surface_mask};
    #[pymodule_export]
    use crate::piles::{
        RawObject, label_components, measure_difference, measure_inside, measure_objects,
    };
    #[pymodule_export]
    use crate::plane::{fit_plane, level, rotation_to_z};
    #[pymodule_export]
    use crate::points::{outermost, seen};
    #[pymodule_export]
    use crate::polygon::{first_crossing, inside};
    #[pymodule_export]
    use crate::surface::{hills, surface_and_clusters};
    #[pymodule_export]
    use crate::voxel::voxel_downsample;

    #[pymodule_export]
    #[allow(non_upper_case_globals)] // the name that Python knows
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
