//! Messages about what a scenario's `[drive]` found in a run.

use omni_config::shortened_line;

/// Lines at most: what comes after them is counted.
const MOST: usize = 12;
/// What is wrong with a wheel, by [`omni_core::drive::Fault::number`].
const FAULTS: [&str; 6] = [
    "is used again",
    "reports a value that is not a number",
    "reports an impossible jump",
    "reports a stuck value",
    "does not report",
    "is declared lost",
];

/// Something that is reported when it changes: its column, and what its values mean; nothing where that is not reported.
struct Watched {
    column: usize,
    last: f64,
    said: Box<dyn Fn(f64) -> Option<String>>,
    /// Which of them stop the vehicle, and as what.
    stops: &'static [(f64, &'static str)],
    /// As what and since when \[s\] it does now.
    stopped: Option<(f64, &'static str)>,
}

/// Notes of a run.
#[derive(Default)]
pub(crate) struct FaultMessages {
    watched: Vec<Watched>,
    lines: Vec<String>,
    more: usize,
}

impl FaultMessages {
    /// For a controller with these signals of its own; without a drive's there is nothing to note.
    pub(crate) fn new(signals: &[String]) -> Self {
        let watched = signals.iter().enumerate().filter_map(|(column, name)| {
            let said: Box<dyn Fn(f64) -> Option<String>> = match name.as_str() {
                "drive_mode" => Box::new(|mode| match mode {
                    2.0 => Some("safe stop: too few usable wheels to measure the vehicle's motion".into()),
                    3.0 => Some("emergency stop".into()),
                    _ => None,
                }),
                "drive_command_status" => {
                    Box::new(|status| (status == 3.0).then(|| "the command timed out".into()))
                }
                name => {
                    let wheel = name.strip_prefix("drive_fault_")?.to_owned();
                    Box::new(move |fault| Some(format!("wheel {wheel} {}", FAULTS.get(fault as usize)?)))
                }
            };
            let stops: &[_] = match name.as_str() {
                "drive_mode" => &[(2.0, "safe stop"), (3.0, "emergency stop")],
                "drive_command_status" => &[(3.0, "time-out")],
                _ => &[],
            };
            Some(Watched {
                column,
                last: 0.0,
                said,
                stops,
                stopped: None,
            })
        });
        Self {
            watched: watched.collect(),
            ..Self::default()
        }
    }

    /// Looks at what the controller's own signals were at a time \[ns\]; NaN where one is not known.
    pub(crate) fn look(&mut self, time_ns: u64, signals: &[f64]) {
        for watched in &mut self.watched {
            let Some(&now) = signals.get(watched.column) else {
                continue;
            };
            if now == watched.last || now.is_nan() {
                continue;
            }
            watched.last = now;
            let stop = watched.stops.iter().find(|(value, _)| *value == now);
            watched.stopped = stop.map(|(_, name)| (time_ns as f64 * 1e-9, *name));
            if let Some(said) = (watched.said)(now) {
                if self.lines.len() < MOST {
                    let time_s = time_ns as f64 * 1e-9;
                    self.lines.push(format!("{time_s:.3} s: {said}"));
                } else {
                    self.more += 1;
                }
            }
        }
    }

    /// What has stopped the vehicle for good, as far as the run went; of several what did it first.
    pub(crate) fn stopped(&self) -> Option<String> {
        let stops = self.watched.iter().filter_map(|watched| watched.stopped);
        let first = stops.min_by(|a, b| a.0.total_cmp(&b.0));
        first.map(|(time_s, name)| format!("{name} at {time_s:.2} s"))
    }

    /// A line each under a heading, which says `of` what run where that is not clear; nothing where nothing was found.
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
            // Names in a log are whatever somebody wrote there.
            text += &format!("  {}\n", shortened_line(&line));
        }
        text
    }
}
