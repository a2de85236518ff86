//! The one place that opens ports.
//!
//! The supervisor creates every topic with its full quality of service and holds it ([`Hub::create_all`]); all others
//! only open, so that a process that is killed while opening never leaves a half-made topic behind.

pub use crate::{
    ask::{Answerer, Caller},
    bytes::{BytesReader, BytesWriter},
    port_error::PortError,
    stream::{Reader, Writer},
};

use crate::{
    domain::Domain,
    doorbell::Doorbell,
    port_error::refused,
    topic::{self, Service, Topic},
    wait::Wait,
};
use iceoryx2::{
    node::Node,
    prelude::{
        AllocationStrategy, AttributeVerifier, CallbackProgression, NodeBuilder, NodeState, ServiceName,
        SignalHandlingMode, ZeroCopySend, ipc,
    },
};
use std::{any::Any, fmt::Debug};

const NODES: usize = 48;
const SCHEMA: &str = "schema";

/// One process' place in a domain. Not `Send`: ports stay on the thread that opened them.
#[derive(Debug)]
pub struct Hub {
    node: Node<ipc::Service>,
    /// Names of the domain's shared memory begin so.
    prefix: String,
}

/// Topics kept alive.
#[derive(Debug)]
pub struct Held(#[allow(dead_code, reason = "held for its drop")] Vec<Box<dyn Any>>);

fn service_name(name: &'static str) -> Result<ServiceName, PortError> {
    name.try_into().map_err(refused("the name", name))
}

fn check(schema: u64, name: &'static str) -> Result<AttributeVerifier, PortError> {
    let key = SCHEMA.try_into().map_err(refused("the attribute", name))?;
    let value = format!("{schema:016x}").as_str().try_into().map_err(refused("the attribute", name))?;
    AttributeVerifier::new().require(&key, &value).map_err(refused("the attribute", name))
}

impl Hub {
    /// Joins the domain under a name.
    ///
    /// # Errors
    /// Where the domain's folder cannot be used.
    pub fn join(domain: &Domain, name: &'static str) -> Result<Self, PortError> {
        let config = domain.config()?;
        let prefix = config.global.prefix.to_string();
        let node = NodeBuilder::new()
            .name(&name.try_into().map_err(refused("the node's name", name))?)
            .config(&config)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<ipc::Service>()
            .map_err(refused("the node", name))?;
        Ok(Self { node, prefix })
    }

    /// Creates (or, adopting a running pipeline, opens) every topic. They live as long as the result.
    ///
    /// # Errors
    /// Where a topic exists in another form, or is broken.
    pub fn create_all(&self) -> Result<Held, PortError> {
        let mut held: Vec<Box<dyn Any>> = Vec::new();
        self.create(&topic::SAMPLE, &mut held)?;
        self.create(&topic::ESTIMATE, &mut held)?;
        self.create(&topic::PARAMETERS, &mut held)?;
        self.create(&topic::DIAGNOSIS, &mut held)?;
        self.create(&topic::HEALTH, &mut held)?;
        self.create(&topic::STATUS, &mut held)?;
        let report = &topic::REPORT;
        let bytes = self
            .node
            .service_builder(&service_name(report.name)?)
            .publish_subscribe::<[u8]>()
            .max_publishers(report.writers)
            .max_subscribers(report.readers)
            .max_nodes(NODES)
            .subscriber_max_buffer_size(report.buffer)
            .history_size(report.history)
            .open_or_create_with_attributes(&check(report.schema, report.name)?)
            .map_err(refused("creation", report.name))?;
        held.push(Box::new(bytes));
        for service in [&topic::CONTROL, &topic::INJECTION] {
            self.create_service(service, &mut held)?;
        }
        Ok(Held(held))
    }

    fn create<M>(&self, topic: &Topic<M>, held: &mut Vec<Box<dyn Any>>) -> Result<(), PortError>
    where
        M: Debug + Copy + ZeroCopySend + 'static,
    {
        let name = service_name(topic.name)?;
        let verifier = check(topic.schema, topic.name)?;
        let stream = self
            .node
            .service_builder(&name)
            .publish_subscribe::<M>()
            .max_publishers(topic.writers)
            .max_subscribers(topic.readers)
            .max_nodes(NODES)
            .subscriber_max_buffer_size(topic.buffer)
            .subscriber_max_borrowed_samples(2)
            .history_size(topic.history)
            .enable_safe_overflow(true)
            .open_or_create_with_attributes(&verifier)
            .map_err(refused("creation", topic.name))?;
        held.push(Box::new(stream));
        if topic.wakes {
            Doorbell::hang(&self.prefix, topic.name).map_err(refused("the doorbell", topic.name))?;
        }
        Ok(())
    }

    fn create_service<Q, A>(&self, service: &Service<Q, A>, held: &mut Vec<Box<dyn Any>>) -> Result<(), PortError>
    where
        Q: Debug + Copy + ZeroCopySend + 'static,
        A: Debug + Copy + ZeroCopySend + 'static,
    {
        let verifier = check(service.schema, service.name)?;
        let factory = self
            .node
            .service_builder(&service_name(service.name)?)
            .request_response::<Q, A>()
            .max_clients(8)
            .max_servers(3)
            .max_nodes(NODES)
            .max_active_requests_per_client(2)
            .max_response_buffer_size(4)
            .open_or_create_with_attributes(&verifier)
            .map_err(refused("creation", service.name))?;
        held.push(Box::new(factory));
        Ok(())
    }

    /// A port to give messages on `topic`.
    ///
    /// # Errors
    /// Where the topic is not there, is of another kind, or has all its writers.
    pub fn writer<M>(&self, topic: &Topic<M>) -> Result<Writer<M>, PortError>
    where
        M: Debug + Copy + ZeroCopySend + 'static,
    {
        let name = service_name(topic.name)?;
        let stream = self
            .node
            .service_builder(&name)
            .publish_subscribe::<M>()
            .open_with_attributes(&check(topic.schema, topic.name)?)
            .map_err(refused("opening", topic.name))?;
        let publisher =
            stream.publisher_builder().max_loaned_samples(1).create().map_err(refused("a writer", topic.name))?;
        let doorbell = topic.wakes.then(|| self.doorbell(topic.name)).transpose()?;
        Ok(Writer { publisher, doorbell, topic: topic.name })
    }

    /// A port to take messages of `topic`, `buffer` of which wait at most (none said: all that the topic allows).
    ///
    /// # Errors
    /// Where the topic is not there, is of another kind, or has all its readers.
    pub fn reader<M>(&self, topic: &Topic<M>, buffer: Option<usize>, wait: Wait) -> Result<Reader<M>, PortError>
    where
        M: Debug + Copy + ZeroCopySend + 'static,
    {
        let name = service_name(topic.name)?;
        let stream = self
            .node
            .service_builder(&name)
            .publish_subscribe::<M>()
            .open_with_attributes(&check(topic.schema, topic.name)?)
            .map_err(refused("opening", topic.name))?;
        let subscriber = stream
            .subscriber_builder()
            .buffer_size(buffer.unwrap_or(topic.buffer).min(topic.buffer))
            .create()
            .map_err(refused("a reader", topic.name))?;
        let sleeps = topic.wakes && wait != Wait::Spin;
        let doorbell = sleeps.then(|| self.doorbell(topic.name)).transpose()?;
        Ok(Reader { subscriber, doorbell, wait, topic: topic.name })
    }

    fn doorbell(&self, topic: &'static str) -> Result<Doorbell, PortError> {
        Doorbell::open(&self.prefix, topic).map_err(refused("the doorbell", topic))
    }

    /// A port to give reports.
    ///
    /// # Errors
    /// As [`Hub::writer`].
    pub fn bytes_writer(&self, topic: &Topic<[u8]>, longest: usize) -> Result<BytesWriter, PortError> {
        let stream = self
            .node
            .service_builder(&service_name(topic.name)?)
            .publish_subscribe::<[u8]>()
            .open_with_attributes(&check(topic.schema, topic.name)?)
            .map_err(refused("opening", topic.name))?;
        let publisher = stream
            .publisher_builder()
            .initial_max_slice_len(longest)
            .allocation_strategy(AllocationStrategy::Static)
            .create()
            .map_err(refused("a writer", topic.name))?;
        Ok(BytesWriter(publisher))
    }

    /// A port to take reports.
    ///
    /// # Errors
    /// As [`Hub::reader`].
    pub fn bytes_reader(&self, topic: &Topic<[u8]>) -> Result<BytesReader, PortError> {
        let stream = self
            .node
            .service_builder(&service_name(topic.name)?)
            .publish_subscribe::<[u8]>()
            .open_with_attributes(&check(topic.schema, topic.name)?)
            .map_err(refused("opening", topic.name))?;
        Ok(BytesReader(stream.subscriber_builder().create().map_err(refused("a reader", topic.name))?))
    }

    /// A port to ask.
    ///
    /// # Errors
    /// As [`Hub::writer`].
    pub fn caller<Q, A>(&self, service: &Service<Q, A>) -> Result<Caller<Q, A>, PortError>
    where
        Q: Debug + Copy + ZeroCopySend + 'static,
        A: Debug + Copy + ZeroCopySend + 'static,
    {
        let factory = self
            .node
            .service_builder(&service_name(service.name)?)
            .request_response::<Q, A>()
            .open_with_attributes(&check(service.schema, service.name)?)
            .map_err(refused("opening", service.name))?;
        let client = factory.client_builder().create().map_err(refused("a client", service.name))?;
        Ok(Caller { client, topic: service.name })
    }

    /// A port to answer.
    ///
    /// # Errors
    /// As [`Hub::writer`].
    pub fn answerer<Q, A>(&self, service: &Service<Q, A>) -> Result<Answerer<Q, A>, PortError>
    where
        Q: Debug + Copy + ZeroCopySend + 'static,
        A: Debug + Copy + ZeroCopySend + 'static,
    {
        let factory = self
            .node
            .service_builder(&service_name(service.name)?)
            .request_response::<Q, A>()
            .open_with_attributes(&check(service.schema, service.name)?)
            .map_err(refused("opening", service.name))?;
        let server = factory.server_builder().create().map_err(refused("a server", service.name))?;
        Ok(Answerer { server, topic: service.name })
    }

    /// Clears what dead processes left: how many, and how many resisted.
    #[must_use]
    pub fn sweep(&self) -> (u64, u64) {
        let state = self.node.try_cleanup_dead_nodes();
        (state.cleanups, state.failed_cleanups)
    }
}

/// Whether a living process has joined the domain.
///
/// # Errors
/// Where its folder cannot be read.
pub fn inhabited(domain: &Domain) -> Result<bool, PortError> {
    let mut alive = false;
    Node::<ipc::Service>::list(&domain.config()?, |state| {
        alive |= matches!(state, NodeState::Alive(_));
        CallbackProgression::Continue
    })
    .map_err(refused("the list of nodes", "domain"))?;
    Ok(alive)
}
