//! The time of another run or simulator, which this one keeps step with.

use std::sync::Arc;
use std::time::{Duration, Instant};

use ros2_client::{Node, QosProfile, Subscription};

use super::commands::decoded;
use super::listener::{Listener, MOST};
use super::node::absolute;
use super::payload::{Whole, type_name};
use crate::live::controls::Controls;
use crate::live::warn::Warn;
use crate::ros2::{Clock, RosMessage};
use crate::topic;

/// Farther back than messages overtake each other, time begins anew \[ns\].
const BACK_NS: u64 = 100_000_000;
/// A clock that says nothing for so long has stopped.
const SILENT: Duration = Duration::from_secs(5);

/// What the messages of a clock mean.
struct Followed {
    controls: Arc<Controls>,
    can_start_again: bool,
    /// When the last message came, and whether its silence was said since.
    last_message: Instant,
    silence_said: bool,
}

impl Followed {
    fn new(controls: Arc<Controls>, can_start_again: bool, now: Instant) -> Self {
        Self {
            controls,
            can_start_again,
            last_message: now,
            silence_said: false,
        }
    }

    /// A message says that time \[ns\]. A line about it, if there is one to say.
    fn take(&mut self, time_ns: u64, now: Instant) -> Option<&'static str> {
        (self.last_message, self.silence_said) = (now, false);
        let last_ns = self.controls.clock_ns();
        if time_ns > last_ns {
            self.controls.set_clock_ns(time_ns);
            return None;
        }
        if last_ns - time_ns <= BACK_NS {
            return None;
        }
        self.controls.set_clock_ns(time_ns);
        if !self.can_start_again {
            return Some(
                "the time went back: the run waits until it comes again, because it cannot begin anew",
            );
        }
        self.controls.start_again();
        None
    }

    /// No message has come since. A line, once.
    fn silent(&mut self, now: Instant) -> Option<&'static str> {
        if self.silence_said || now.saturating_duration_since(self.last_message) < SILENT {
            return None;
        }
        self.silence_said = true;
        Some("no message for 5 s: the run waits; is another run or simulator in this domain?")
    }
}

/// Follows the clock until the listener is dropped.
pub(super) fn follow(
    node: &mut Node,
    (controls, can_start_again): (Arc<Controls>, bool),
    warn: Warn,
) -> Result<Listener, String> {
    // Clocks of other simulators may be best effort.
    let qos = QosProfile::subscription_default();
    let topic = node
        .create_topic(&absolute("/", topic::CLOCK)?, type_name(Clock::TYPE), &qos)
        .map_err(|error| error.to_string())?;
    let subscription: Subscription<Vec<u8>> = node
        .create_subscription(&topic, Some(qos))
        .map_err(|error| error.to_string())?;
    let mut followed = Followed::new(controls, can_start_again, Instant::now());
    let say = move |line: &str| warn(&format!("{}: {line}", topic::CLOCK));
    Listener::start("ros2 clock", move || {
        let came = std::iter::from_fn(|| subscription.take_seed(Whole).ok().flatten());
        for message in came.take(MOST) {
            let clock = decoded::<Clock>(&message.0).ok();
            if let Some(line) = clock.and_then(|clock| followed.take(clock.clock.to_ns(), Instant::now())) {
                say(line);
            }
        }
        if let Some(line) = followed.silent(Instant::now()) {
            say(line);
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    #[test]
    fn time_goes_on_with_the_clock_and_begins_anew_with_it() {
        let (controls, start) = (Arc::<Controls>::default(), Instant::now());
        let mut followed = Followed::new(controls.clone(), true, start);
        for (time_ns, is, again) in [
            (5 * MS, 5 * MS, false),
            (400 * MS, 400 * MS, false),
            // One message overtook another: nothing goes back.
            (390 * MS, 400 * MS, false),
            (0, 0, true),
            (10 * MS, 10 * MS, false),
        ] {
            assert_eq!(followed.take(time_ns, start), None);
            assert_eq!((controls.clock_ns(), controls.take_start_again()), (is, again));
        }
        // A run with a log cannot: that has one time.
        let mut logged = Followed::new(controls.clone(), false, start);
        assert_eq!(logged.take(900 * MS, start), None);
        assert!(
            logged
                .take(0, start)
                .is_some_and(|line| line.contains("cannot begin anew"))
        );
        assert!(!controls.starts_again());
    }

    #[test]
    fn a_silent_clock_is_said_once_until_its_next_message() {
        let (controls, start) = (Arc::<Controls>::default(), Instant::now());
        let mut followed = Followed::new(controls, true, start);
        let after = |seconds| start + Duration::from_secs(seconds);
        assert_eq!(followed.silent(after(4)), None);
        assert!(followed.silent(after(6)).is_some());
        assert_eq!(followed.silent(after(7)), None);
        followed.take(MS, after(8));
        assert_eq!(followed.silent(after(9)), None);
        assert!(followed.silent(after(14)).is_some());
    }
}
