//! The way to a controller that runs somewhere else: bytes out, frames in, time-outs, what was lost.

use std::io::{Read, Write};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, SyncSender, TrySendError};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use omni_link::{
    Answer, FrameError, FromController, MAX_ANSWER_FRAME, MAX_REQUEST_FRAME, ToController, decode, encode,
};

use super::emulator_process::EmulatorProcess;

/// Greetings sent, one a time-out, before a controller is given up.
pub(super) const GREETINGS: u32 = 5;
/// Frames that wait, either way: more than there are without an answer in the longest hold, and no
/// memory to speak of. A peer that sends more waits until they are read.
const QUEUE: usize = 64;
/// Bytes of what is no message that are shown.
const SHOWN: usize = 24;

/// A way to a controller and back: bytes out, frames in, and how long to wait for one.
pub struct Link {
    pub(super) name: String,
    frames: Mutex<Receiver<Vec<u8>>>,
    /// To the thread that writes: who does not read what it is sent must not stop the host.
    requests: SyncSender<Vec<u8>>,
    received: Arc<Mutex<Received>>,
    pub(super) time_out: Duration,
    process: Option<EmulatorProcess>,
}

/// Bytes that came so far.
#[derive(Default)]
struct Received {
    count: u64,
    first: Vec<u8>,
}

/// The data received within the time-out.
pub(super) enum Event<const N: usize> {
    Message(FromController<Answer<N>>),
    Damaged(FrameError),
    Nothing,
    /// And nothing will ever come.
    Closed,
}

impl Link {
    /// A link over any two streams. An answer is waited for no longer than `time_out`: nothing else shows that
    /// a frame was lost, and one that is only late counts as lost. `name` is what messages call the other end.
    pub fn new(
        name: impl Into<String>,
        reader: impl Read + Send + 'static,
        writer: impl Write + Send + Sync + 'static,
        time_out: Duration,
    ) -> Self {
        let (sender, frames) = mpsc::sync_channel(QUEUE);
        let (requests, outgoing) = mpsc::sync_channel(QUEUE);
        let received = Arc::new(Mutex::new(Received::default()));
        let counted = received.clone();
        // End with their streams, or with the first frame that is not wanted any more.
        std::thread::spawn(move || receive(reader, &sender, &counted));
        std::thread::spawn(move || transmit(writer, &outgoing));
        Self {
            name: name.into(),
            frames: Mutex::new(frames),
            requests,
            received,
            time_out,
            process: None,
        }
    }

    /// The same, with the process at the other end: it is killed with the link.
    pub(super) fn with_process(self, process: EmulatorProcess) -> Self {
        let process = Some(process);
        Self { process, ..self }
    }

    /// Sends a message on its way; says why nothing can be sent any more.
    pub(super) fn send<const N: usize>(&mut self, message: &ToController<N>) -> Result<(), String> {
        let mut buffer = [0; MAX_REQUEST_FRAME];
        let frame = encode(message, &mut buffer).unwrap_or_default();
        match self.requests.try_send(frame.to_vec()) {
            Ok(()) => Ok(()),
            Err(TrySendError::Full(_)) => Err("the firmware does not read the messages sent to it".into()),
            Err(TrySendError::Disconnected(_)) => Err(self.why_it_ended()),
        }
    }

    /// The next message, waited for no longer than `until`, however many there are.
    pub(super) fn next_message<const N: usize>(&mut self, until: Instant) -> Event<N> {
        let frames = self.frames.get_mut().unwrap_or_else(PoisonError::into_inner);
        let left = until.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Event::Nothing;
        }
        match frames.recv_timeout(left) {
            Ok(mut frame) => decode(&mut frame).map_or_else(Event::Damaged, Event::Message),
            Err(RecvTimeoutError::Timeout) => Event::Nothing,
            Err(RecvTimeoutError::Disconnected) => Event::Closed,
        }
    }

    /// Why nothing comes any more.
    pub(super) fn why_it_ended(&mut self) -> String {
        let ended = self.process.as_mut().map(EmulatorProcess::obituary);
        ended.unwrap_or_else(|| "the other end has closed it".into())
    }

    /// Why no peer was met.
    pub(super) fn why_no_peer_was_met(&self) -> String {
        let received = self.received.lock().unwrap_or_else(PoisonError::into_inner);
        if received.count == 0 {
            let waited = (self.time_out * GREETINGS).as_secs_f64();
            return format!(
                "no answer within {waited} s: check that it is the image that serves omni-link frames"
            );
        }
        let (count, first) = (received.count, received.first.escape_ascii());
        format!(
            "the answer is no omni-link message ({count} bytes, first \"{first}\"): check that it is the image that \
             serves omni-link frames"
        )
    }
}

fn receive(mut reader: impl Read, frames: &SyncSender<Vec<u8>>, received: &Mutex<Received>) {
    let mut receiver = omni_link::Receiver::<MAX_ANSWER_FRAME>::new();
    let mut bytes = [0; 1024];
    loop {
        let read = match reader.read(&mut bytes) {
            Ok(0) => return,
            Ok(read) => read,
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => continue,
            Err(_) => return,
        };
        {
            let mut received = received.lock().unwrap_or_else(PoisonError::into_inner);
            let more = read.min(SHOWN.saturating_sub(received.first.len()));
            received.first.extend_from_slice(&bytes[..more]);
            received.count += read as u64;
        }
        for &byte in bytes.iter().take(read) {
            if let Some(frame) = receiver.push(byte)
                && frames.send(frame.to_vec()).is_err()
            {
                return;
            }
        }
    }
}

fn transmit(mut writer: impl Write, requests: &Receiver<Vec<u8>>) {
    while let Ok(frame) = requests.recv() {
        if writer.write_all(&frame).and_then(|()| writer.flush()).is_err() {
            return;
        }
    }
}
