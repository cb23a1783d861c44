//! Kernels that Ctrl-C ends.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

/// How often signals are looked for.
const PATIENCE: Duration = Duration::from_millis(50);

/// Runs `kernel` on a thread of its own, detached from the interpreter, while this thread looks
/// for signals. A signal whose handler raises sets the flag that the kernel was given; the
/// exception is raised once the kernel has returned.
pub(crate) fn interruptible<T: Send>(
    py: Python<'_>,
    kernel: impl FnOnce(&AtomicBool) -> T + Send,
) -> PyResult<T> {
    let cancel = AtomicBool::new(false);
    let waiting = Mutex::new(Some(kernel));
    let run = || {
        let kernel = waiting.lock().unwrap_or_else(PoisonError::into_inner).take();
        kernel.map(|kernel| kernel(&cancel))
    };
    let found = py.detach(|| {
        thread::scope(|scope| {
            let (running, ended) = channel::<()>();
            let work = || {
                let _running = running;
                run()
            };
            let Ok(worker) = thread::Builder::new().spawn_scoped(scope, work) else {
                return Ok(run()); // no thread can start: without a look for signals
            };
            let mut outcome = Ok(());
            while ended.recv_timeout(PATIENCE) == Err(RecvTimeoutError::Timeout) {
                if outcome.is_ok() {
                    outcome = Python::attach(|py| py.check_signals());
                    cancel.store(outcome.is_err(), Ordering::Relaxed);
                }
            }
            let result = worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            outcome.map(|()| result)
        })
    })?;
    found.ok_or_else(|| PyRuntimeError::new_err("the kernel did not run"))
}
