//! Shared state of all clients of a live run: its topics, settings and slots, and their messages.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::{SystemTime, UNIX_EPOCH};

use foxglove::ws_protocol::server::advertise::Channel;
use foxglove::ws_protocol::server::advertise_services::Service;
use foxglove::ws_protocol::server::server_info::Capability;
use foxglove::ws_protocol::server::{Advertise, AdvertiseServices, ServerInfo, Status};
use foxglove::ws_protocol::{parameter::Parameter, schema::Schema};
use tokio::sync::{Semaphore, broadcast};
use tokio_tungstenite::tungstenite::Message;

use super::guard::Guard;
use super::requests::{ClientId, Requests, Setting};
use super::warn::Warn;

/// Clients at a time; one more is rejected.
pub(super) const MOST_VIEWERS: usize = 16;
/// The service that begins the run anew: its number, name and type.
pub(super) const RESET: (u32, &str, &str) = (1, "/omnistep/reset", "std_srvs/srv/Empty");
/// Messages that a slow client may be behind before it misses some.
const BACKLOG: usize = 1024;
/// Lines about connections that were rejected, in a run.
const MOST_LINES: usize = 20;

/// A topic that is served.
pub(super) struct Topic {
    pub(super) name: &'static str,
    /// How its messages are bytes: `cdr`, or `json`, which needs no schema.
    pub(super) encoding: &'static str,
    pub(super) schema_name: &'static str,
    pub(super) schema: &'static str,
}

/// Messages for every client that subscribes.
#[derive(Clone)]
pub(super) enum Event {
    /// A message of the topic with this index, at a simulated time \[ns\].
    Message(usize, u64, Arc<[u8]>),
    /// What parameters are now.
    Parameters(Arc<Vec<Parameter>>),
    /// Something that clients should know.
    Status(Arc<Status>),
    /// The run is over.
    End,
}

/// What the run, the port and every client share.
pub(super) struct Hub {
    pub(super) requests: Arc<Requests>,
    pub(super) allow_control: bool,
    pub(super) greeting: Vec<Message>,
    pub(super) topics: usize,
    events: broadcast::Sender<Event>,
    subscribers: Vec<AtomicUsize>,
    pub(super) guard: Guard,
    pub(super) places: Arc<Semaphore>,
    next: AtomicU64,
    lines: AtomicUsize,
    warn: Warn,
}

impl Hub {
    pub(super) fn new(
        requests: Arc<Requests>,
        topics: &[Topic],
        (allow_control, guard): (bool, Guard),
        warn: Warn,
    ) -> Self {
        Self {
            requests,
            allow_control,
            greeting: greeting(allow_control, topics),
            topics: topics.len(),
            events: broadcast::Sender::new(BACKLOG),
            subscribers: topics.iter().map(|_| AtomicUsize::new(0)).collect(),
            guard,
            places: Arc::new(Semaphore::new(MOST_VIEWERS)),
            next: AtomicU64::new(1),
            lines: AtomicUsize::new(0),
            warn,
        }
    }

    /// The number of another client.
    pub(super) fn next_id(&self) -> ClientId {
        self.next.fetch_add(1, Ordering::Relaxed)
    }

    pub(super) fn listen(&self) -> broadcast::Receiver<Event> {
        self.events.subscribe()
    }

    /// Sends to all; having no client is no fault.
    pub(super) fn send(&self, event: Event) {
        let _ = self.events.send(event);
    }

    /// A client begins to want a topic, or no longer does.
    pub(super) fn wanted(&self, topic: usize, more: bool) {
        let count = &self.subscribers[topic];
        if more {
            count.fetch_add(1, Ordering::Relaxed);
        } else {
            count.fetch_sub(1, Ordering::Relaxed);
        }
    }

    pub(super) fn is_wanted(&self, topic: usize) -> bool {
        self.subscribers[topic].load(Ordering::Relaxed) > 0
    }

    /// The run's settings, in the protocol's terms.
    pub(super) fn parameters(&self) -> Vec<Parameter> {
        let settings = self.requests.settings().map(|(name, value)| match value {
            Setting::Number(number) => Parameter::float64(name, number),
            Setting::Text(text) | Setting::Other(text) => Parameter::string(name, text),
        });
        settings.into()
    }

    /// Informs all clients, and all that show parameters, that no client commands the vehicle any more.
    pub(super) fn rests(&self, why: &str) {
        self.send(Event::Status(Arc::new(Status::warning(format!(
            "{why}: the vehicle is commanded to stop"
        )))));
        self.send(Event::Parameters(Arc::new(self.parameters())));
    }

    /// A line for the user who started the run; others must not fill the screen.
    pub(super) fn warn(&self, line: &str) {
        match self.lines.fetch_add(1, Ordering::Relaxed) {
            n if n < MOST_LINES => (self.warn)(line),
            MOST_LINES => (self.warn)("more connections are rejected; further rejections are not reported"),
            _ => {}
        }
    }
}

/// Server, topics and services, as first sent to clients.
fn greeting(allow_control: bool, topics: &[Topic]) -> Vec<Message> {
    let since_1970 = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let mut info = ServerInfo::new(concat!("omnistep ", env!("CARGO_PKG_VERSION")))
        .with_session_id(since_1970.as_millis().to_string());
    if allow_control {
        info = info
            .with_capabilities([
                Capability::ClientPublish,
                Capability::Parameters,
                Capability::ParametersSubscribe,
                Capability::Services,
            ])
            .with_supported_encodings(["cdr", "json"]);
    }
    let channels = topics.iter().enumerate().filter_map(|(k, topic)| {
        let channel = Channel::builder(k as u64, topic.name, topic.encoding);
        let schema = (!topic.schema.is_empty())
            .then(|| Schema::new(topic.schema_name, "ros2msg", topic.schema.as_bytes()));
        // Only a schema that is no text has no form in JSON.
        match schema {
            Some(schema) => channel.with_schema(schema).build().ok(),
            None => channel.build().ok(),
        }
    });
    let mut greeting = vec![Message::from(&info), Message::from(&Advertise::new(channels))];
    if allow_control {
        let (number, name, kind) = RESET;
        let reset = Service::new(number, name, kind);
        greeting.push(Message::from(&AdvertiseServices::new([reset])));
    }
    greeting
}
