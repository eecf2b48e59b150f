//! The time-out of a link: hold, then stop, while frames are missing.

#[cfg(test)]
mod tests;

use serde::{Deserialize, Serialize};

use crate::FrameError;
use crate::wire::plain;

/// Missed periods in a row in which the last torques are held; with the next one the loop stops.
pub const HOLD_PERIODS: u32 = 10;

/// Action in a control period.
///
/// ```
/// use omni_link::{Action, Guard, HOLD_PERIODS};
/// let mut guard = Guard::new();
/// assert_eq!(guard.missed(), Action::Stop); // nothing moves before a command
/// guard.restart(0);
/// let actions: Vec<_> = (0..=HOLD_PERIODS).map(|_| guard.missed()).collect();
/// assert_eq!(actions[..10], [Action::Hold; 10]);
/// assert_eq!(actions[10], Action::Stop);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Action {
    /// A fresh message is there: step the loops, apply their torques.
    Step,
    /// Apply the torques of the last step once more; the loops rest.
    Hold,
    /// No torque, until a restart.
    Stop,
}

/// Frames that did not arrive as they were sent, since the guard was made: a restart keeps the counts, and they stay at
/// their greatest value.
///
/// ```
/// use omni_link::{Counters, FrameError, Guard};
/// let mut guard = Guard::new();
/// guard.restart(0);
/// guard.damaged(FrameError::Corrupted);
/// guard.received(4); // 1 was the corrupted one, 2 and 3 never came
/// assert_eq!(guard.counters(), Counters { lost: 2, truncated: 0, corrupted: 1 });
/// assert!(!guard.counters().is_zero());
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counters {
    /// Frames that never came.
    #[serde(with = "plain")]
    pub lost: u32,
    /// Frames of which bytes were missing.
    #[serde(with = "plain")]
    pub truncated: u32,
    /// Frames with wrong bytes.
    #[serde(with = "plain")]
    pub corrupted: u32,
}

impl Counters {
    /// Everything arrived so far.
    ///
    /// ```
    /// assert!(omni_link::Counters::none().is_zero());
    /// ```
    #[must_use]
    pub const fn none() -> Self {
        Self {
            lost: 0,
            truncated: 0,
            corrupted: 0,
        }
    }

    /// All arrived.
    #[must_use]
    pub fn is_zero(&self) -> bool {
        *self == Self::default()
    }
}

/// Counts missing messages and states the action, identically on both sides. Starts stopped.
///
/// | what happens in a period                                  | counted                   | what to do                        |
/// |-----------------------------------------------------------|---------------------------|-----------------------------------|
/// | [`restart`](Guard::restart)                               | -                         | start afresh, then step           |
/// | [`received`](Guard::received): the next number            | -                         | step                              |
/// | `received`: g numbers were left out, g <= 10              | lost: g - those known     | step                              |
/// | `received`: g numbers were left out, g > 10               | lost: g - those known     | stop                              |
/// | `received`: a number that was there before                | lost: 1                   | a missed period                   |
/// | [`missed`](Guard::missed): nothing came                   | lost: 1                   | a missed period                   |
/// | [`damaged`](Guard::damaged): a truncated, corrupted frame | truncated or corrupted: 1 | a missed period                   |
/// | [`held`](Guard::held): the other side missed one          | - (the other side does)   | a missed period                   |
/// | a missed period, up to the 10th since the last step       |                           | hold                              |
/// | a missed period, the 11th since the last step             |                           | stop                              |
/// | anything but `restart` while stopped                      | damaged frames only       | stop                              |
///
/// Numbers count up by one per period and wrap round; one of the 2^31 up to the last one was there before. "Those
/// known" are the missed periods since the last step: they are counted already.
///
/// ```
/// use omni_link::{Action, Guard};
/// let mut guard = Guard::new();
/// guard.restart(5);
/// assert_eq!(guard.received(6), Action::Step);
/// assert_eq!(guard.received(9), Action::Step); // 7 and 8 are lost, the controller catches up
/// assert_eq!(guard.received(21), Action::Stop); // 11 are lost
/// assert_eq!(guard.received(22), Action::Stop); // and stopped it stays
/// assert_eq!(guard.counters().lost, 2 + 11);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Guard {
    counters: Counters,
    /// Number of the last step, or of the restart.
    last: u32,
    /// Missed periods since, 0 to 11.
    missed: u32,
    stopped: bool,
}

impl Guard {
    /// Stopped, nothing counted.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            counters: Counters::none(),
            last: 0,
            missed: 0,
            stopped: true,
        }
    }

    /// Runs (again) with the message of this number. The loops are to start afresh with it.
    pub fn restart(&mut self, sequence: u32) {
        (self.last, self.missed, self.stopped) = (sequence, 0, false);
    }

    /// A whole message with this number has come.
    pub fn received(&mut self, sequence: u32) -> Action {
        let ahead = sequence.wrapping_sub(self.last);
        if ahead == 0 || ahead > u32::MAX / 2 {
            return self.missed();
        }
        let gap = ahead - 1;
        if !self.stopped {
            let lost = gap.saturating_sub(self.missed);
            self.counters.lost = self.counters.lost.saturating_add(lost);
            (self.last, self.missed) = (sequence, 0);
            self.stopped = gap > HOLD_PERIODS;
        }
        if self.stopped { Action::Stop } else { Action::Step }
    }

    /// Nothing has come within the period: to be called by a timer, or after a time-out.
    pub fn missed(&mut self) -> Action {
        if !self.stopped {
            self.counters.lost = self.counters.lost.saturating_add(1);
        }
        self.held()
    }

    /// A frame has come that is no message.
    pub fn damaged(&mut self, error: FrameError) -> Action {
        let count = match error {
            FrameError::Truncated => &mut self.counters.truncated,
            FrameError::Corrupted => &mut self.counters.corrupted,
        };
        *count = count.saturating_add(1);
        self.held()
    }

    /// The other side says that it has nothing fresh to go on.
    pub fn held(&mut self) -> Action {
        if !self.stopped {
            self.missed += 1;
            self.stopped = self.missed > HOLD_PERIODS;
        }
        if self.stopped { Action::Stop } else { Action::Hold }
    }

    /// The other side says that it has stopped.
    pub fn stop(&mut self) {
        self.stopped = true;
    }

    /// Stopped, until a restart?
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.stopped
    }

    /// Number of the last period there was, stepped or missed.
    #[must_use]
    pub fn sequence(&self) -> u32 {
        self.last.wrapping_add(self.missed)
    }

    /// The counts.
    #[must_use]
    pub fn counters(&self) -> Counters {
        self.counters
    }
}

impl Default for Guard {
    fn default() -> Self {
        Self::new()
    }
}
