//! A controller's firmware in QEMU: a Cortex-M4F (board mps2-an386) whose semihosting console is the link.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use super::emulator_process::{EmulatorProcess, QEMU};
use super::link::Link;
use crate::Error;
use crate::config::open_regular;

/// Path of the image from the workspace in `firmware/`, relative to the top of the repository.
pub const DEFAULT_FIRMWARE: &str = "firmware/target/thumbv7em-none-eabihf/release/loop";

/// A firmware image, to be run in QEMU.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Firmware {
    /// The image: an ELF file for a Cortex-M4F that serves omni-link frames on the semihosting console.
    pub image: PathBuf,
    /// Time limit for an answer. The emulator loses none: 2 s by default, so that a busy machine is not taken for a
    /// broken one.
    pub time_out: Duration,
}

impl Firmware {
    /// An image, with the default time-out.
    #[must_use]
    pub fn new(image: impl Into<PathBuf>) -> Self {
        Self {
            image: image.into(),
            time_out: Duration::from_secs(2),
        }
    }

    /// Starts the emulator, which runs until the link is dropped.
    ///
    /// # Errors
    /// [`Error::Firmware`] if the image or the emulator is missing.
    pub fn start(&self) -> Result<Link, Error> {
        let name = self.image.display().to_string();
        let refuse = |reason: String| Error::Firmware {
            name: name.clone(),
            reason,
        };
        if let Err(error) = open_regular(&self.image) {
            return Err(refuse(match error.kind() {
                ErrorKind::NotFound => {
                    "no such firmware image: build the one in firmware/, or set another with --firmware FILE"
                        .into()
                }
                _ => error.to_string(),
            }));
        }
        let mut child = emulator(&self.image).spawn().map_err(|error| {
            refuse(match error.kind() {
                ErrorKind::NotFound => {
                    format!(
                        "{QEMU} is not installed: install Debian's package of that name, or use --controller host"
                    )
                }
                _ => format!("{QEMU} cannot be started: {error}"),
            })
        })?;
        let streams = child.stdout.take().zip(child.stdin.take());
        let process = EmulatorProcess::new(child);
        let (reader, writer) =
            streams.ok_or_else(|| refuse(format!("{QEMU} cannot be started: it has no pipes")))?;
        Ok(Link::new(name, reader, writer, self.time_out).with_process(process))
    }
}

/// The emulator with an image, its console being standard input and output; [`Firmware::start`] runs it.
///
/// ```
/// let command = omni_sim::controller::emulator("image.elf".as_ref());
/// assert_eq!(command.get_program(), "qemu-system-arm");
/// assert!(command.get_args().any(|argument| argument == "mps2-an386")); // the machine: a Cortex-M4F
/// ```
#[must_use]
pub fn emulator(image: &Path) -> Command {
    let mut command = Command::new(QEMU);
    command
        .args([
            "-M",
            "mps2-an386",
            "-display",
            "none",
            "-monitor",
            "none",
            "-serial",
            "none",
        ])
        // Without a chardev: the guest's reads and writes of the console are the emulator's own of
        // its standard streams.
        .args(["-semihosting-config", "enable=on,target=native"])
        .arg("-kernel")
        .arg(image)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}
