//! Messages about what a scenario's `[drive]` found in a run.

use omni_config::shortened_line;
use omni_core::DriveMode;
use omni_core::drive::Fault;
use omni_core::shaping::CommandStatus;
use omni_sim::Report;

/// Lines at most: what comes after them is counted.
const MOST: usize = 12;

/// Why the vehicle stands, and since when \[s\].
type Stop = Option<(f64, &'static str)>;

/// Notes of a run.
pub(crate) struct FaultMessages {
    wheels: Vec<String>,
    mode: DriveMode,
    command: CommandStatus,
    faults: Vec<Option<Fault>>,
    /// By the mode, and by the command.
    stopped: [Stop; 2],
    lines: Vec<String>,
    more: usize,
}

/// What is said of a wheel.
fn fault_message(fault: Option<Fault>) -> &'static str {
    match fault {
        None => "is used again",
        Some(Fault::NotANumber) => "reports a value that is not a number",
        Some(Fault::Jump) => "reports an impossible jump",
        Some(Fault::Stuck) => "reports a stuck value",
        Some(Fault::Silent) => "does not report",
        Some(Fault::Lost) => "is declared lost",
        Some(_) => "is faulty",
    }
}

impl FaultMessages {
    /// For a drive of wheels of these names; without a drive there is nothing to note.
    pub(crate) fn new(wheels: &[String]) -> Self {
        Self {
            wheels: wheels.to_vec(),
            mode: DriveMode::Normal,
            command: CommandStatus::Idle,
            faults: vec![None; wheels.len()],
            stopped: [None; 2],
            lines: Vec::new(),
            more: 0,
        }
    }

    /// Looks at what the controller reported at a time \[ns\].
    pub(crate) fn look(&mut self, time_ns: u64, report: &Report) {
        let Some(drive) = &report.drive else {
            return;
        };
        let time_s = time_ns as f64 * 1e-9;
        if drive.mode != self.mode {
            self.mode = drive.mode;
            let (stop, said) = match drive.mode {
                DriveMode::SafeStop => (
                    Some((time_s, "safe stop")),
                    Some("safe stop: too few usable wheels to measure the vehicle's motion"),
                ),
                DriveMode::EmergencyStop => (Some((time_s, "emergency stop")), Some("emergency stop")),
                _ => (None, None),
            };
            self.stopped[0] = stop;
            if let Some(said) = said {
                self.say(time_s, said);
            }
        }
        if let Some(command) = drive.command.filter(|command| *command != self.command) {
            self.command = command;
            self.stopped[1] = None;
            if command == CommandStatus::TimedOut {
                self.stopped[1] = Some((time_s, "time-out"));
                self.say(time_s, "the command timed out");
            }
        }
        for (i, wheel) in drive.wheels.iter().enumerate().take(self.faults.len()) {
            if wheel.fault != self.faults[i] {
                self.faults[i] = wheel.fault;
                let said = format!("wheel {} {}", self.wheels[i], fault_message(wheel.fault));
                self.say(time_s, &said);
            }
        }
    }

    fn say(&mut self, time_s: f64, said: &str) {
        if self.lines.len() < MOST {
            self.lines.push(format!("{time_s:.3} s: {said}"));
        } else {
            self.more += 1;
        }
    }

    /// What has stopped the vehicle for good, as far as the run went; of several what did it first.
    pub(crate) fn stopped(&self) -> Option<String> {
        let first = self.stopped.iter().flatten().min_by(|a, b| a.0.total_cmp(&b.0));
        first.map(|(time_s, name)| format!("{name} at {time_s:.2} s"))
    }

    /// A line each under a heading, which says `of` what run where that is not clear; nothing if nothing was found.
    pub(crate) fn text(&self, of: &str) -> String {
        let mut lines = self.lines.clone();
        if self.more > 0 {
            lines.push(format!("and {} more, in the log", self.more));
        }
        if lines.is_empty() {
            return String::new();
        }
        let mut text = format!("events of the drive{of}:\n");
        for line in lines {
            // Names in a log may be any text.
            text += &format!("  {}\n", shortened_line(&line));
        }
        text
    }
}
