//! One client: what it wants, what it asks for, what it is sent.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use foxglove::ws_protocol::client::{Advertise, ClientMessage, ServiceCallRequest, Subscription};
use foxglove::ws_protocol::parameter::{Parameter, ParameterValue};
use foxglove::ws_protocol::server::{
    MessageData, ParameterValues, ServiceCallFailure, ServiceCallResponse, Status,
};
use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{SinkExt, StreamExt};
use omni_config::shortened_line;
use tokio::sync::broadcast::error::RecvError;
use tokio::sync::{broadcast, mpsc};
use tokio::time::timeout;
use tokio_tungstenite::tungstenite::Message;

use super::http::Socket;
use super::hub::{Event, Hub, RESET};
use super::requests::{ClientId, Published, Setting};
use crate::topic;

/// Answers that wait until a client reads them; one more, and it is cut off.
const MOST_ANSWERS: usize = 64;
/// Channels that a client may announce to publish on.
const MOST_ANNOUNCED: usize = 64;
/// Time without reading after which a client is disconnected.
const SLOWEST: Duration = Duration::from_secs(10);

/// Serves a client until it goes, does not read, or the run ends.
pub(super) async fn serve(socket: Socket, id: ClientId, hub: Arc<Hub>) {
    let events = hub.listen();
    let (answers, inbox) = mpsc::channel(MOST_ANSWERS);
    let wants = Mutex::new(Wants {
        topics: vec![None; hub.topics],
        parameters: Vec::new(),
    });
    let viewer = Viewer {
        id,
        hub,
        answers,
        wants,
    };
    let (to, from) = socket.split();
    let gone = tokio::select! {
        gone = viewer.write(to, inbox, events) => gone,
        gone = viewer.read(from) => gone,
    };
    if let Err(TooSlow(why)) = gone {
        viewer
            .hub
            .warn(&format!("client {id} was disconnected: it did not read {why}"));
    }
    if viewer.hub.requests.leave(id) {
        viewer.hub.rests("the commanding client disconnected");
    }
    let wanted = viewer.wants().topics.clone();
    for (topic, _) in wanted.iter().enumerate().filter(|(_, wanted)| wanted.is_some()) {
        viewer.hub.wanted(topic, false);
    }
}

struct Viewer {
    id: ClientId,
    hub: Arc<Hub>,
    answers: mpsc::Sender<Message>,
    wants: Mutex<Wants>,
}

/// Messages to a client.
struct Wants {
    /// The subscription to each topic, if there is one.
    topics: Vec<Option<u32>>,
    /// Names of parameters.
    parameters: Vec<String>,
}

/// It does not read what it is sent: what of it.
struct TooSlow(String);

impl Viewer {
    /// No thread panics while writing; if one did, what is there is still whole.
    fn wants(&self) -> MutexGuard<'_, Wants> {
        self.wants.lock().unwrap_or_else(PoisonError::into_inner)
    }

    async fn write(
        &self,
        mut to: SplitSink<Socket, Message>,
        mut inbox: mpsc::Receiver<Message>,
        mut events: broadcast::Receiver<Event>,
    ) -> Result<(), TooSlow> {
        let mut greeting = self.hub.greeting.iter().cloned();
        loop {
            let message = if let Some(greeting) = greeting.next() {
                greeting
            } else {
                tokio::select! {
                    biased;
                    Some(answer) = inbox.recv() => answer,
                    event = events.recv() => match event {
                        Ok(event) => match self.wanted(&event) {
                            Some(message) => message,
                            None => continue,
                        },
                        // Too slow for all of them: it goes on with what is there.
                        Err(RecvError::Lagged(_)) => continue,
                        Err(RecvError::Closed) => Message::Close(None),
                    },
                }
            };
            let last = matches!(message, Message::Close(_));
            match timeout(SLOWEST, to.send(message)).await {
                Ok(Ok(())) if !last => {}
                Ok(_) => return Ok(()),
                Err(_) => return Err(TooSlow(format!("anything for {} s", SLOWEST.as_secs()))),
            }
        }
    }

    /// An event in this client's format, if it subscribes.
    fn wanted(&self, event: &Event) -> Option<Message> {
        match event {
            Event::Message(topic, time_ns, data) => {
                let subscription = self.wants().topics[*topic]?;
                Some(Message::from(&MessageData::new(
                    subscription,
                    *time_ns,
                    &data[..],
                )))
            }
            Event::Parameters(all) => {
                let wants = self.wants();
                let known = all
                    .iter()
                    .filter(|parameter| wants.parameters.contains(&parameter.name));
                let known: Vec<Parameter> = known.cloned().collect();
                (!known.is_empty()).then(|| Message::from(&ParameterValues::new(known)))
            }
            Event::Status(status) => Some(Message::from(&**status)),
            Event::End => Some(Message::Close(None)),
        }
    }

    async fn read(&self, mut from: SplitStream<Socket>) -> Result<(), TooSlow> {
        let mut announced = HashMap::new();
        while let Some(Ok(message)) = from.next().await {
            match message {
                Message::Text(_) | Message::Binary(_) => match ClientMessage::try_from(&message) {
                    Ok(message) => self.take(message, &mut announced),
                    Err(error) => self.refuse(&format!("not a message of the protocol: {error}")),
                },
                // The library answers pings and closing.
                _ => Ok(()),
            }?;
        }
        Ok(())
    }

    fn take(&self, message: ClientMessage<'_>, announced: &mut Announced) -> Result<(), TooSlow> {
        match message {
            ClientMessage::Subscribe(message) => {
                message.subscriptions.iter().try_for_each(|s| self.subscribe(s))
            }
            ClientMessage::Unsubscribe(message) => {
                for (topic, wanted) in self.wants().topics.iter_mut().enumerate() {
                    if wanted.is_some_and(|id| message.subscription_ids.contains(&id)) {
                        *wanted = None;
                        self.hub.wanted(topic, false);
                    }
                }
                Ok(())
            }
            // What steers, or shows what could be steered, is not there without --allow-control.
            _ if !self.hub.allow_control => {
                self.refuse("you can only watch this run: to steer it, start it with --allow-control")
            }
            ClientMessage::Advertise(message) => self.announce(message, announced),
            ClientMessage::Unadvertise(message) => {
                let before = announced.len();
                announced.retain(|id, _| !message.channel_ids.contains(id));
                if announced.len() < before && self.hub.requests.leave(self.id) {
                    self.hub.rests("the commanding client stopped publishing");
                }
                Ok(())
            }
            ClientMessage::MessageData(message) => {
                let Some(published) = announced.get(&message.channel_id) else {
                    return self.refuse(&format!("channel {}: not announced", message.channel_id));
                };
                match self
                    .hub
                    .requests
                    .publish(self.id, published, &message.data, Instant::now())
                {
                    Ok(()) => Ok(()),
                    Err(why) => self.refuse(&format!("{}: {why}", topic::CMD_VEL)),
                }
            }
            ClientMessage::GetParameters(message) => {
                let mut all = self.hub.parameters();
                let names = message.parameter_names;
                all.retain(|parameter| names.is_empty() || names.contains(&parameter.name));
                self.answer(&parameters(all, message.id))
            }
            ClientMessage::SetParameters(message) => {
                let asked: Vec<_> = message.parameters.into_iter().map(setting).collect();
                let refused = self.hub.requests.set(self.id, &asked, Instant::now());
                refused.iter().try_for_each(|why| self.refuse(why))?;
                let now = self.hub.parameters();
                self.hub.send(Event::Parameters(Arc::new(now.clone())));
                message
                    .id
                    .map_or(Ok(()), |id| self.answer(&parameters(now, Some(id))))
            }
            ClientMessage::SubscribeParameterUpdates(message) => {
                let known = self.hub.requests.settings().map(|(name, _)| name);
                let mut wants = self.wants();
                for name in message.parameter_names {
                    if known.contains(&name.as_str()) && !wants.parameters.contains(&name) {
                        wants.parameters.push(name);
                    }
                }
                Ok(())
            }
            ClientMessage::UnsubscribeParameterUpdates(message) => {
                self.wants()
                    .parameters
                    .retain(|name| !message.parameter_names.contains(name));
                Ok(())
            }
            ClientMessage::ServiceCallRequest(call) => self.call(call),
            _ => self.refuse("not offered: assets, graph and playback"),
        }
    }

    fn subscribe(&self, subscription: &Subscription) -> Result<(), TooSlow> {
        let topic = usize::try_from(subscription.channel_id).unwrap_or(usize::MAX);
        let mut wants = self.wants();
        let taken = wants.topics.contains(&Some(subscription.id));
        let why = match wants.topics.get_mut(topic) {
            None => format!("channel {}: it does not exist", subscription.channel_id),
            Some(Some(_)) => format!("channel {topic}: already subscribed to"),
            Some(None) if taken => format!("subscription {}: already used", subscription.id),
            Some(wanted) => {
                *wanted = Some(subscription.id);
                self.hub.wanted(topic, true);
                self.hub.requests.subscribe();
                return Ok(());
            }
        };
        drop(wants);
        self.refuse(&why)
    }

    fn announce(&self, message: Advertise<'_>, announced: &mut Announced) -> Result<(), TooSlow> {
        for channel in message.channels {
            if channel.topic != topic::CMD_VEL {
                self.refuse(&format!(
                    "{}: the run does not subscribe to this topic, allowed: {}",
                    channel.topic,
                    topic::CMD_VEL
                ))?;
            } else if announced.len() >= MOST_ANNOUNCED {
                self.refuse(&format!(
                    "channel {}: {MOST_ANNOUNCED} channels are announced already, the largest number allowed",
                    channel.id
                ))?;
            } else {
                let published = Published {
                    encoding: channel.encoding.into_owned(),
                    schema: channel.schema_name.into_owned(),
                };
                announced.insert(channel.id, published);
            }
        }
        Ok(())
    }

    /// Begins the run anew, and answers that it does.
    fn call(&self, call: ServiceCallRequest<'_>) -> Result<(), TooSlow> {
        let (reset, name, _) = RESET;
        if call.service_id != reset {
            let why = format!(
                "service {}: it does not exist, allowed: {reset}, {name}",
                call.service_id
            );
            return self.answer(&ServiceCallFailure::new(call.service_id, call.call_id, why));
        }
        self.hub.requests.controls.start_again();
        // A response without fields.
        let empty: &[u8] = if call.encoding == "json" {
            b"{}"
        } else {
            &[0, 1, 0, 0]
        };
        self.answer(&ServiceCallResponse {
            service_id: reset,
            call_id: call.call_id,
            encoding: call.encoding,
            payload: empty.into(),
        })
    }

    /// Sends this client the reason why something was not done.
    fn refuse(&self, why: &str) -> Result<(), TooSlow> {
        self.answer(&Status::error(shortened_line(why)))
    }

    fn answer<'a, M>(&self, message: &'a M) -> Result<(), TooSlow>
    where
        Message: From<&'a M>,
    {
        let waiting = |_| TooSlow(format!("the {MOST_ANSWERS} answers to what it sent"));
        self.answers.try_send(message.into()).map_err(waiting)
    }
}

/// What a client publishes on, by its own numbers.
type Announced = HashMap<u32, Published>;

/// What a client sets, in the run's terms.
fn setting(parameter: Parameter) -> (String, Setting) {
    let value = match parameter.value {
        Some(ParameterValue::Float64(value)) => Setting::Number(value),
        Some(ParameterValue::Integer(value)) => Setting::Number(value as f64),
        Some(ParameterValue::String(text)) => Setting::Text(text),
        Some(other) => Setting::Other(format!("{other:?}")),
        None => Setting::Other("nothing".into()),
    };
    (parameter.name, value)
}

fn parameters(values: Vec<Parameter>, id: Option<String>) -> ParameterValues {
    let values = ParameterValues::new(values);
    match id {
        Some(id) => values.with_id(id),
        None => values,
    }
}
