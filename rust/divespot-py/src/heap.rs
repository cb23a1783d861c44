//! The heap that all threads share.

use pyo3::prelude::*;

/// Lets all threads of this process share one heap, which is for a program and not for a library.
///
/// The C library of most Linux systems gives each thread a heap of its own, and keeps in each what
/// was freed there: kernels run on threads, and would hold memory that the next one cannot use.
#[pyfunction]
#[allow(unsafe_code)] // a number is handed to the C library
pub(crate) fn share_heap() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        unsafe extern "C" {
            fn mallopt(parameter: std::ffi::c_int, value: std::ffi::c_int) -> std::ffi::c_int;
        }
        const M_ARENA_MAX: std::ffi::c_int = -8;
        // SAFETY: as malloc.h declares it; any parameter and value may be given.
        unsafe { mallopt(M_ARENA_MAX, 1) };
    }
}
