//! Work on a thread of its own while the calling thread stays Python's.

use crate::refused;
use anyhow::Result;
use gyro_model::diagnose;
use pyo3::{exceptions::PyRuntimeWarning, prelude::*};
use std::{
    ffi::CString,
    sync::{
        atomic::{AtomicBool, Ordering},
        mpsc::{self, RecvTimeoutError},
    },
    thread,
    time::Duration,
};

/// How often the interpreter is asked whether somebody wants an end.
const ASKED: Duration = Duration::from_millis(100);

/// A message of the thread that works to the one that called.
enum Message {
    Progress(String),
    Failed(String),
}

/// Runs `work` on a thread of its own. The calling thread stays Python's: it hands on progress, warns of axes that failed, and looks for
/// signals, which Python handles on its main thread alone. An exception there ends the work and is raised.
pub(crate) fn watched<T: Send>(
    py: Python<'_>,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(&diagnose::Options) -> Result<T> + Send,
) -> PyResult<T> {
    let ended = &AtomicBool::new(false);
    let (sender, messages) = mpsc::channel();
    let is_ended = || ended.load(Ordering::Relaxed);
    // The channel closes when the work ends.
    let work = move || {
        // A receiver that is gone needs no message.
        let tell = |message| sender.send(message).unwrap_or_default();
        work(&diagnose::Options {
            progress: &|what| tell(Message::Progress(what.to_owned())),
            failed: &|error| tell(Message::Failed(error.to_string())),
            stop: &is_ended,
            ..diagnose::Options::default()
        })
    };
    let hear = |message| {
        Python::attach(|py| match (message, &progress) {
            (Message::Progress(what), Some(progress)) => progress.call1(py, (what,)).map(drop),
            (Message::Progress(_), None) => Ok(()),
            (Message::Failed(why), _) => {
                PyErr::warn(py, &py.get_type::<PyRuntimeWarning>(), &CString::new(why).unwrap_or_default(), 2)
            }
        })
    };
    py.detach(move || {
        thread::scope(|scope| {
            let worker = scope.spawn(work);
            let mut raised = None;
            loop {
                let heard = match messages.recv_timeout(ASKED) {
                    Ok(_) if raised.is_some() => continue,
                    Ok(message) => hear(message),
                    Err(RecvTimeoutError::Timeout) => Ok(()),
                    Err(RecvTimeoutError::Disconnected) => break,
                };
                if let Err(error) = heard.and_then(|()| Python::attach(|py| py.check_signals())) {
                    ended.store(true, Ordering::Relaxed);
                    raised = Some(error);
                }
            }
            match (raised, worker.join()) {
                (Some(error), _) => Err(error),
                (None, Ok(result)) => result.map_err(refused),
                (None, Err(panic)) => std::panic::resume_unwind(panic),
            }
        })
    })
}
