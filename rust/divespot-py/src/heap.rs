//! One malloc heap for all threads.

use pyo3::prelude::*;

/// Makes all threads of this process share one heap. A program may decide so, a library should not.
///
/// The C library of most Linux systems gives each thread a heap of its own and keeps freed memory
/// in it. Kernels run on threads, and would hold memory that the next kernel cannot use.
#[pyfunction]
#[allow(unsafe_code)] // a number is handed to the C library
pub(crate) fn share_heap() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        unsafe extern "C" {
            fn mallopt(parameter: std::ffi::c_int, value: std::ffi::c_int) -> std::ffi::c_int;
        }
        // Largest number of heaps, in glibc's malloc.h.
        const M_ARENA_MAX: std::ffi::c_int = -8;
        // SAFETY: declared as in malloc.h; any parameter and value may be given.
        unsafe { mallopt(M_ARENA_MAX, 1) };
    }
}

/// Gives what was freed back to the system.
///
/// Kernels leave it in the heaps of threads that have ended: where they run a hundred times, on a
/// hundred parts of a survey, it adds up.
#[pyfunction]
#[allow(unsafe_code)] // the C library is called
pub(crate) fn trim_heap() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        unsafe extern "C" {
            fn malloc_trim(pad: usize) -> std::ffi::c_int;
        }
        // SAFETY: as malloc.h declares it; what is in use stays.
        unsafe { malloc_trim(0) };
    }
}
