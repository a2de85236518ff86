//! Shared memory: through our ports, and through iceoryx2 alone with the same quality of service.

use super::{End, NAP};
use anyhow::anyhow;
use iceoryx2::{
    node::Node,
    port::{listener::Listener, notifier::Notifier, publisher::Publisher, subscriber::Subscriber},
    prelude::{NodeBuilder, ServiceName, SignalHandlingMode, ZeroCopySend, ipc},
};
use ipc_types::{
    Estimate, Sample,
    domain::Domain,
    port::{Hub, Reader, Writer},
    topic::Topic,
    wait::Wait,
};
use std::fmt::Debug;

/// A message with a number.
pub trait Numbered: Debug + Copy + ZeroCopySend + 'static {
    fn of(number: u64) -> Self;
    fn number(&self) -> u64;
}

impl Numbered for Sample {
    fn of(sequence: u64) -> Self {
        Self { sequence, ..Self::EMPTY }
    }
    fn number(&self) -> u64 {
        self.sequence
    }
}

impl Numbered for Estimate {
    fn of(sequence: u64) -> Self {
        Self { sequence, ..Self::default() }
    }
    fn number(&self) -> u64 {
        self.sequence
    }
}

/// An end of the pipeline's own hop.
pub struct Ours<G: Numbered, T: Numbered> {
    writer: Writer<G>,
    reader: Reader<T>,
}

impl<G: Numbered, T: Numbered> Ours<G, T> {
    pub fn open(hub: &Hub, give: &Topic<G>, take: &Topic<T>, wait: Wait) -> anyhow::Result<Self> {
        let ours = Self { writer: hub.writer(give)?, reader: hub.reader(take, None, wait)? };
        ours.reader.newest()?;
        Ok(ours)
    }
}

impl<G: Numbered, T: Numbered> End for Ours<G, T> {
    fn give(&mut self, number: u64) -> anyhow::Result<()> {
        self.writer.give(G::of(number))?;
        Ok(())
    }

    fn take(&mut self) -> anyhow::Result<Option<u64>> {
        if let Some(message) = self.reader.take()? {
            return Ok(Some(message.number()));
        }
        self.reader.wait(NAP)?;
        Ok(self.reader.take()?.map(|message| message.number()))
    }
}

/// An end of the same without our ports. The node is dropped last.
pub struct Bare<G: Numbered, T: Numbered> {
    publisher: Publisher<ipc::Service, G, ()>,
    notifier: Notifier<ipc::Service>,
    subscriber: Subscriber<ipc::Service, T, ()>,
    listener: Listener<ipc::Service>,
    _node: Node<ipc::Service>,
}

fn refused(cause: impl Debug) -> anyhow::Error {
    anyhow!("iceoryx2: {cause:?}")
}

impl<G: Numbered, T: Numbered> Bare<G, T> {
    pub fn open(domain: &Domain, give: &Topic<G>, take: &Topic<T>) -> anyhow::Result<Self> {
        let node = NodeBuilder::new()
            .config(&domain.config()?)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<ipc::Service>()
            .map_err(refused)?;
        let named = |name: &str| ServiceName::new(&format!("bare {name}")).map_err(refused);
        let (there, back) = (named(give.name)?, named(take.name)?);
        let event = |name| node.service_builder(name).event().open_or_create().map_err(refused);
        macro_rules! stream {
            ($message:ty, $name:expr, $topic:expr) => {
                node.service_builder($name)
                    .publish_subscribe::<$message>()
                    .subscriber_max_buffer_size($topic.buffer)
                    .open_or_create()
                    .map_err(refused)?
            };
        }
        Ok(Self {
            publisher: stream!(G, &there, give).publisher_builder().max_loaned_samples(1).create().map_err(refused)?,
            notifier: event(&there)?.notifier_builder().create().map_err(refused)?,
            subscriber: stream!(T, &back, take).subscriber_builder().create().map_err(refused)?,
            listener: event(&back)?.listener_builder().create().map_err(refused)?,
            _node: node,
        })
    }

    fn look(&self) -> anyhow::Result<Option<u64>> {
        Ok(self.subscriber.receive().map_err(refused)?.map(|message| message.number()))
    }
}

impl<G: Numbered, T: Numbered> End for Bare<G, T> {
    fn give(&mut self, number: u64) -> anyhow::Result<()> {
        let loan = self.publisher.loan_uninit().map_err(refused)?;
        loan.write_payload(G::of(number)).send().map_err(refused)?;
        self.notifier.notify().map_err(refused)?;
        Ok(())
    }

    fn take(&mut self) -> anyhow::Result<Option<u64>> {
        if let Some(number) = self.look()? {
            return Ok(Some(number));
        }
        // A signal ends the wait early, and whoever waits looks whether it is to stop.
        let _ = self.listener.timed_wait(|_| {}, NAP);
        self.look()
    }
}
