//! Simulated time beside the clock.

use std::time::{Duration, Instant};

/// Largest lead of a run over the clock before it waits.
const AHEAD: Duration = Duration::from_millis(2);
/// Largest lag before it continues from its present time: a machine that slept, or that is too slow, does not chase the
/// clock.
const BEHIND: Duration = Duration::from_millis(500);

/// Keeps a run in step with the clock.
pub(super) struct Pacer {
    /// Simulated seconds per second.
    speed: f64,
    /// When it was, by the clock, and then in the simulation \[s\].
    start: (Instant, f64),
    /// Time by the clock that was given up \[s\].
    lost_s: f64,
}

impl Pacer {
    /// From now and the beginning.
    pub(super) fn new(speed: f64, now: Instant) -> Self {
        Self {
            speed,
            start: (now, 0.0),
            lost_s: 0.0,
        }
    }

    /// The run is at that time \[s\] now, and makes up for nothing.
    pub(super) fn hold(&mut self, time_s: f64, now: Instant) {
        self.start = (now, time_s);
    }

    /// Waiting time of a run at that time \[s\]; none if it is late.
    pub(super) fn wait(&mut self, time_s: f64, now: Instant) -> Option<Duration> {
        let (start, from_s) = self.start;
        let due = Duration::try_from_secs_f64((time_s - from_s) / self.speed).unwrap_or(Duration::MAX);
        let elapsed = now.saturating_duration_since(start);
        let late = elapsed.saturating_sub(due);
        if late > BEHIND && self.speed.is_finite() {
            self.lost_s += late.as_secs_f64();
            self.start = (now, time_s);
        }
        let ahead = due.saturating_sub(elapsed);
        (ahead > AHEAD).then_some(ahead)
    }

    /// Time by the clock that the run did not keep up with \[s\].
    pub(super) fn lost_s(&self) -> f64 {
        self.lost_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_waits_for_the_clock_and_gives_up_what_it_is_half_a_second_late() {
        let start = Instant::now();
        let after = |seconds| start + Duration::from_secs_f64(seconds);
        let mut pacer = Pacer::new(2.0, start);
        // A second of simulation is half a second on the clock; a lead of 2 ms is no reason to wait.
        assert_eq!(pacer.wait(1.0, after(0.4)), Some(Duration::from_secs_f64(0.1)));
        assert_eq!(pacer.wait(1.0, after(0.4985)), None);
        // 0.4 s late: it catches up.
        assert_eq!((pacer.wait(2.0, after(1.4)), pacer.lost_s()), (None, 0.0));
        assert_eq!(pacer.wait(3.0, after(1.4)), Some(Duration::from_secs_f64(0.1)));
        // The machine slept for 7 s: from there it goes on at its pace.
        assert_eq!(pacer.wait(3.0, after(8.5)), None);
        assert!((pacer.lost_s() - 7.0).abs() < 1e-9);
        let wait = pacer.wait(4.0, after(8.5)).expect("half a second of clock");
        assert!((wait.as_secs_f64() - 0.5).abs() < 1e-9);
    }

    #[test]
    fn as_fast_as_it_goes_waits_for_nothing_and_loses_nothing() {
        let start = Instant::now();
        let mut pacer = Pacer::new(f64::INFINITY, start);
        assert_eq!(pacer.wait(1e6, start + Duration::from_secs(9)), None);
        assert_eq!(pacer.lost_s(), 0.0);
    }
}
