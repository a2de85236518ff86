//! Questions with their answers.

use crate::port_error::{PortError, refused};
use iceoryx2::{
    port::{client::Client, server::Server},
    prelude::{ZeroCopySend, ipc},
};
use std::{
    fmt::Debug,
    time::{Duration, Instant},
};

/// Asks.
#[derive(Debug)]
pub struct Caller<Q, A>
where
    Q: Debug + Copy + ZeroCopySend + 'static,
    A: Debug + Copy + ZeroCopySend + 'static,
{
    pub(crate) client: Client<ipc::Service, Q, (), A, ()>,
    pub(crate) topic: &'static str,
}

/// Answers.
#[derive(Debug)]
pub struct Answerer<Q, A>
where
    Q: Debug + Copy + ZeroCopySend + 'static,
    A: Debug + Copy + ZeroCopySend + 'static,
{
    pub(crate) server: Server<ipc::Service, Q, (), A, ()>,
    pub(crate) topic: &'static str,
}

impl<Q, A> Caller<Q, A>
where
    Q: Debug + Copy + ZeroCopySend + 'static,
    A: Debug + Copy + ZeroCopySend + 'static,
{
    /// Asks, and asks again where no answer comes within `patience`, `attempts` times in all. The question must carry
    /// an id by which the other side knows a repetition; `fits` tells an answer to this question from an older one.
    ///
    /// # Errors
    /// Where nobody answers, or the plumbing is broken.
    pub fn ask(
        &self,
        question: Q,
        patience: Duration,
        attempts: u32,
        fits: impl Fn(&A) -> bool,
    ) -> Result<A, PortError> {
        for _ in 0..attempts {
            let pending = self.client.send_copy(question).map_err(refused("asking", self.topic))?;
            let start = Instant::now();
            while start.elapsed() < patience {
                while let Some(answer) = pending.receive().map_err(refused("the answer", self.topic))? {
                    if fits(&answer) {
                        return Ok(*answer);
                    }
                }
                std::thread::sleep(Duration::from_millis(2));
            }
        }
        Err(PortError::Silent { topic: self.topic, seconds: patience.as_secs_f64() * f64::from(attempts) })
    }
}

impl<Q, A> Answerer<Q, A>
where
    Q: Debug + Copy + ZeroCopySend + 'static,
    A: Debug + Copy + ZeroCopySend + 'static,
{
    /// Answers every question that waits; one without an answer yet will be asked again.
    ///
    /// # Errors
    /// Where the plumbing is broken. Nobody left to hear an answer is no error.
    pub fn serve(&self, mut answer: impl FnMut(&Q) -> Option<A>) -> Result<(), PortError> {
        while let Some(request) = self.server.receive().map_err(refused("a question", self.topic))? {
            if let Some(answer) = answer(&request) {
                let _ = request.send_copy(answer);
            }
        }
        Ok(())
    }
}
