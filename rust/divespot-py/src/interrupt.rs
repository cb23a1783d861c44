//! Runs kernels so that Ctrl-C ends them.

#![allow(clippy::disallowed_methods)] // the only file that may use them

use std::sync::atomic::Ordering;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use divespot_core::cancel::{Flag, unless_called_off};
use pyo3::prelude::*;

use crate::errors::raise;

/// Interval at which signals are checked. Decides no answer.
const PATIENCE: Duration = Duration::from_millis(50);

/// As [`detached`], for a kernel that may fail.
pub(crate) fn attempted<T: Send>(
    py: Python<'_>,
    kernel: impl FnOnce() -> divespot_core::Result<T> + Send,
) -> PyResult<T> {
    detached(py, kernel)?.map_err(raise)
}

/// Runs `kernel` on a thread of its own, detached from the interpreter, while this thread checks
/// for signals. If a signal's handler raises, the kernel is cancelled, and the exception is raised
/// once it has ended. If no thread can be started, the kernel runs on this one and cannot be
/// interrupted.
pub(crate) fn detached<T: Send>(py: Python<'_>, kernel: impl FnOnce() -> T + Send) -> PyResult<T> {
    let (mut kernel, mut result) = (Some(kernel), None);
    attended(py, &mut || result = kernel.take().map(|kernel| kernel()))?;
    result.ok_or(divespot_core::Error::Interrupted).map_err(raise)
}

/// As `detached`, compiled once and not for every kernel.
fn attended(py: Python<'_>, kernel: &mut (dyn FnMut() + Send)) -> PyResult<()> {
    let flag = Flag::default();
    let waiting = Mutex::new(Some(kernel));
    let run = || {
        let kernel = waiting.lock().unwrap_or_else(PoisonError::into_inner).take();
        kernel.map_or(Ok(()), |kernel| unless_called_off(&flag, kernel))
    };
    let ended = py.detach(|| {
        thread::scope(|scope| {
            let (running, ended) = channel::<()>();
            let work = || {
                let _running = running;
                run()
            };
            let Ok(worker) = thread::Builder::new().spawn_scoped(scope, work) else {
                return Ok(run());
            };
            let mut outcome = Ok(());
            while ended.recv_timeout(PATIENCE) == Err(RecvTimeoutError::Timeout) {
                if outcome.is_ok() {
                    outcome = Python::attach(|py| py.check_signals());
                    flag.store(outcome.is_err(), Ordering::Relaxed);
                }
            }
            let result = worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            outcome.map(|()| result)
        })
    })?;
    ended.map_err(raise)
}
