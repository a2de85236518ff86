//! Work on a thread of its own while the calling thread stays Python's.

use crate::refused;
use anyhow::Result;
use gyro_model::diagnose;
use pyo3::{exceptions::PyRuntimeWarning, prelude::*};
use std::{
    ffi::CString,
    sync::{
        Arc,
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
/// signals, which Python handles on its main thread alone. An exception there is raised at once. The work then ends where it next looks
/// whether it should; nobody waits for it, which is why it owns all that it needs.
pub(crate) fn watched<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(&diagnose::Options) -> Result<T> + Send + 'static,
) -> PyResult<T> {
    let ended = Arc::new(AtomicBool::new(false));
    let (sender, messages) = mpsc::channel();
    let seen = Arc::clone(&ended);
    // The channel closes when the work ends.
    let work = move || {
        // A receiver that is gone needs no message.
        let tell = |message| sender.send(message).unwrap_or_default();
        work(&diagnose::Options {
            progress: &|what| tell(Message::Progress(what.to_owned())),
            failed: &|error| tell(Message::Failed(error.to_string())),
            stop: &|| seen.load(Ordering::Relaxed),
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
        let worker = thread::spawn(work);
        loop {
            let heard = match messages.recv_timeout(ASKED) {
                Ok(message) => hear(message),
                Err(RecvTimeoutError::Timeout) => Ok(()),
                Err(RecvTimeoutError::Disconnected) => break,
            };
            if let Err(error) = heard.and_then(|()| Python::attach(|py| py.check_signals())) {
                ended.store(true, Ordering::Relaxed);
                return Err(error);
            }
        }
        match worker.join() {
            Ok(result) => result.map_err(refused),
            Err(panic) => std::panic::resume_unwind(panic),
        }
    })
}
