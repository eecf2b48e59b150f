//! The port: connections that wait for a handshake, and what happens when there are too many of them.

use std::collections::VecDeque;
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::time::{Duration, Instant};

use tokio::net::{TcpListener, TcpStream};
use tokio::runtime::{Builder, Runtime};
use tokio::sync::OwnedSemaphorePermit;
use tokio::task::AbortHandle;
use tokio::time::{sleep, timeout};

use super::guard::Guard;
use super::hub::{Event, Hub, MOST_VIEWERS, Topic};
use super::requests::Requests;
use super::warn::Warn;
use super::{client, http};

/// Connections that wait for the end of their handshake; one more, and the oldest is closed.
const MOST_WAITING: usize = 16;
/// Pause after the system rejected a connection, or after a handshake was ended to make room for it.
const PAUSE: Duration = Duration::from_millis(100);
const TAKE: Duration = Duration::from_millis(1);
/// Time between warnings that the system rejects connections.
const SILENCE: Duration = Duration::from_secs(60);
/// Time limit of clients for the last messages at the end.
const FAREWELL: Duration = Duration::from_secs(1);

/// The open port.
pub(super) struct Server {
    pub(super) hub: Arc<Hub>,
    pub(super) port: u16,
    runtime: Runtime,
}

impl Server {
    /// Opens a port on 127.0.0.1, or says why not. `warn` receives messages for the user who started the run.
    pub(super) fn start(
        port: u16,
        requests: Arc<Requests>,
        topics: &[Topic],
        (allow_control, guard): (bool, Guard),
        warn: Warn,
    ) -> std::io::Result<Self> {
        let runtime = Builder::new_multi_thread()
            .worker_threads(1)
            .thread_name("live")
            .enable_all()
            .build()?;
        let listener = runtime.block_on(TcpListener::bind(SocketAddr::from((Ipv4Addr::LOCALHOST, port))))?;
        let port = listener.local_addr()?.port();
        let hub = Arc::new(Hub::new(requests, topics, (allow_control, guard), warn));
        runtime.spawn(accept(listener, hub.clone()));
        Ok(Self { hub, port, runtime })
    }

    /// Lets clients have what is left, and closes the port.
    pub(super) fn stop(self) {
        self.hub.send(Event::End);
        let all = self.hub.places.acquire_many(MOST_VIEWERS as u32);
        // Clients that do not read in time miss the remaining messages.
        let _ = self
            .runtime
            .block_on(async { timeout(FAREWELL, all).await.is_ok() });
        self.runtime.shutdown_background();
    }
}

/// Accepts connections for as long as the run goes on, whatever happens.
async fn accept(listener: TcpListener, hub: Arc<Hub>) {
    let mut waiting: VecDeque<AbortHandle> = VecDeque::new();
    let mut said: Option<Instant> = None;
    loop {
        match listener.accept().await {
            Ok((stream, _)) => {
                waiting.retain(|handshake| !handshake.is_finished());
                if waiting.len() >= MOST_WAITING
                    && let Some(oldest) = waiting.pop_front()
                {
                    oldest.abort();
                }
                waiting.push_back(tokio::spawn(connect(stream, hub.clone())).abort_handle());
            }
            // As when the process may open no more files: the system keeps the connection until there is room.
            Err(error) => {
                if said.is_none_or(|said| said.elapsed() > SILENCE) {
                    hub.warn(&format!("new connections wait until others end: {error}"));
                    said = Some(Instant::now());
                }
                waiting.retain(|handshake| !handshake.is_finished());
                match waiting.pop_front() {
                    Some(oldest) => {
                        oldest.abort();
                        sleep(TAKE).await;
                    }
                    None => sleep(PAUSE).await,
                }
            }
        }
    }
}

/// Reads what a connection wants, and makes a viewer of it if it may be one.
async fn connect(stream: TcpStream, hub: Arc<Hub>) {
    // Without it small messages wait for others.
    let _ = stream.set_nodelay(true);
    if let Some((socket, place)) = http::answer(stream, &hub).await {
        // On its own: it waits no longer, and is none of those that are closed for others.
        tokio::spawn(async move {
            let _place: OwnedSemaphorePermit = place;
            let id = hub.next_id();
            client::serve(socket, id, hub).await;
        });
    }
}
