//! The end of the processes of a run.

use super::process::Process;
use std::time::{Duration, Instant};

/// How long a process may take to end when asked to.
const PATIENCE: Duration = Duration::from_secs(3);

/// Ends processes one after the other, in the order of the flow, so that each takes in what the one before it gave:
/// asked first, killed when they take too long. `meanwhile` is called again and again.
pub(super) fn end(processes: &mut [Process], mut meanwhile: impl FnMut()) {
    for process in processes {
        process.ask_to_end();
        let start = Instant::now();
        let mut killed = false;
        while !process.has_ended() && start.elapsed() < 2 * PATIENCE {
            if start.elapsed() > PATIENCE && !killed {
                tracing::warn!("{} does not end and is killed", process.service.name());
                process.kill();
                killed = true;
            }
            meanwhile();
            std::thread::sleep(Duration::from_millis(2));
        }
    }
    meanwhile();
}
