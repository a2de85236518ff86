//! A domain for the measurement alone, which is gone afterwards, and the other process.

use super::{
    End, Way,
    bytes::Bytes,
    ports::{Bare, Ours},
};
use crate::{domain::Claim, supervisor::room};
use anyhow::{Context, bail};
use ipc_types::{
    Estimate, Sample,
    port::{Held, Hub},
    topic,
};
use std::{
    fs::File,
    io::Read,
    os::{
        fd::OwnedFd,
        unix::{net::UnixStream, process::CommandExt},
    },
    process::{Child, Command, Stdio},
};

/// The domain.
pub struct Place {
    claim: Option<Claim>,
    hub: Option<(Held, Hub)>,
}

impl Place {
    /// Makes it.
    ///
    /// # Errors
    /// Where there is no room, or the folder is not ours.
    pub fn make() -> anyhow::Result<Self> {
        let claim = Claim::take(&format!("bench-{}", std::process::id()))?;
        let mut place = Self { claim: Some(claim), hub: None };
        let domain = place.claim()?.domain();
        room::check(domain)?;
        domain.begin_generation()?;
        let hub = Hub::join(domain, "bench")?;
        place.hub = Some((hub.create_all()?, hub));
        Ok(place)
    }

    fn claim(&self) -> anyhow::Result<&Claim> {
        self.claim.as_ref().context("the domain is gone")
    }

    /// Starts the other process and opens this one's end.
    ///
    /// # Errors
    /// Where the machine refuses either.
    pub fn open(&self, way: Way) -> anyhow::Result<(Box<dyn End>, Echo)> {
        let domain = self.claim()?.domain();
        let (_, hub) = self.hub.as_ref().context("the domain is gone")?;
        let mut command = Command::new("/proc/self/exe");
        command
            .arg0("truerate")
            .args(["bench", "--echo", way.name(), "--instance", domain.name()])
            // Ctrl-C is for the one that measures; it ends the other.
            .process_group(0);
        let (taken, given) = (vec![0; size_of::<Estimate>()], vec![0; size_of::<Sample>()]);
        match way {
            Way::Pipe => {
                let mut echo = Echo::start(command.stdin(Stdio::piped()).stdout(Stdio::piped()))?;
                let (input, output) = (echo.0.stdout.take().context("a pipe")?, echo.0.stdin.take().context("a pipe")?);
                let (input, output) = (File::from(OwnedFd::from(input)), File::from(OwnedFd::from(output)));
                Ok((Box::new(Bytes { input, output, taken, given }), echo))
            }
            Way::Socket => {
                let (ours, theirs) = UnixStream::pair().context("a socket")?;
                let twice = theirs.try_clone().context("a socket")?;
                let echo = Echo::start(command.stdin(OwnedFd::from(theirs)).stdout(OwnedFd::from(twice)))?;
                let input = File::from(OwnedFd::from(ours.try_clone().context("a socket")?));
                let output = File::from(OwnedFd::from(ours));
                Ok((Box::new(Bytes { input, output, taken, given }), echo))
            }
            Way::Event | Way::Spin | Way::Iceoryx2 => {
                let end: Box<dyn End> = match way.wait() {
                    Some(wait) => {
                        Box::new(Ours::<Sample, Estimate>::open(hub, &topic::SAMPLE, &topic::ESTIMATE, wait)?)
                    }
                    None => Box::new(Bare::<Sample, Estimate>::open(domain, &topic::SAMPLE, &topic::ESTIMATE)?),
                };
                let mut echo = Echo::start(command.stdin(Stdio::null()).stdout(Stdio::piped()))?;
                let mut ready = [0];
                let said = echo.0.stdout.take().context("a pipe")?.read_exact(&mut ready);
                said.context("the other process did not begin")?;
                Ok((end, echo))
            }
        }
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.hub = None;
        if let Some(Err(error)) = self.claim.take().map(Claim::remove) {
            tracing::warn!("something of the measurement is left behind: {error:#}");
        }
    }
}

/// The other process; it is ended where it is dropped.
pub struct Echo(Child);

impl Echo {
    fn start(command: &mut Command) -> anyhow::Result<Self> {
        Ok(Self(command.spawn().context("the other process")?))
    }

    /// Waits for its end.
    ///
    /// # Errors
    /// Where it failed.
    pub fn wait(mut self) -> anyhow::Result<()> {
        let status = self.0.wait().context("the other process")?;
        if !status.success() {
            bail!("the other process failed ({status})");
        }
        Ok(())
    }
}

impl Drop for Echo {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}
