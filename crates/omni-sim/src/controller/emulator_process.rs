//! The process of an emulator: why it ended, and its end.

use std::io::{BufRead, BufReader, Read};
use std::process::Child;
use std::sync::mpsc::{self, Receiver};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use crate::config::shortened;

/// Its program.
pub(super) const QEMU: &str = "qemu-system-arm";
/// How long an emulator that has closed its end may take to say why.
const LAST_WORDS: Duration = Duration::from_secs(2);
/// Bytes of the emulator's first line that are kept.
const COMPLAINT: u64 = 200;

/// A running emulator; killed when dropped.
pub(super) struct EmulatorProcess {
    child: Child,
    /// The first line it wrote to standard error.
    complaint: Mutex<Receiver<String>>,
}

impl EmulatorProcess {
    pub(super) fn new(mut child: Child) -> Self {
        let (sender, complaint) = mpsc::sync_channel(1);
        if let Some(stderr) = child.stderr.take() {
            std::thread::spawn(move || {
                let (mut stderr, mut line) = (BufReader::new(stderr), Vec::new());
                // A line without an end is not waited for, nor kept.
                if let Ok(1..) = stderr.by_ref().take(COMPLAINT).read_until(b'\n', &mut line) {
                    // It may not be wanted any more.
                    let _ = sender.send(shortened(String::from_utf8_lossy(&line).trim_end()).into_owned());
                }
                // Reads on: a full pipe would stop the emulator.
                let _ = std::io::copy(&mut stderr, &mut std::io::sink());
            });
        }
        Self {
            child,
            complaint: Mutex::new(complaint),
        }
    }

    /// Why it has ended.
    pub(super) fn obituary(&mut self) -> String {
        let until = Instant::now() + LAST_WORDS;
        let status = loop {
            match self.child.try_wait() {
                Ok(Some(status)) => break format!("the firmware has ended ({QEMU}: {status}"),
                _ if Instant::now() < until => std::thread::sleep(Duration::from_millis(5)),
                _ => break format!("the firmware has closed its console ({QEMU} still runs"),
            }
        };
        let complaint = self.complaint.get_mut().unwrap_or_else(PoisonError::into_inner);
        match complaint.recv_timeout(until.saturating_duration_since(Instant::now())) {
            Ok(line) => format!("{status}, {line})"),
            Err(_) => format!("{status})"),
        }
    }
}

impl Drop for EmulatorProcess {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
