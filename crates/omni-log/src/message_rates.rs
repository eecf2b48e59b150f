//! The rates of the messages.

use omni_config::LogRates;

/// When a topic is due.
#[derive(Clone, Copy)]
pub(crate) struct Pace {
    /// None: never.
    period_ns: Option<u64>,
    next_ns: u64,
}

impl Pace {
    fn every(period_ns: u64) -> Self {
        let period_ns = Some(period_ns);
        Self {
            period_ns,
            next_ns: 0,
        }
    }

    /// That often \[Hz\]; 0 for never.
    pub(crate) fn hz(rate: f64) -> Self {
        let period_ns = (rate > 0.0).then(|| (1e9 / rate).round() as u64);
        Self {
            period_ns,
            next_ns: 0,
        }
    }

    /// Time from one to the next \[s\]; none: never.
    pub(crate) fn period_s(&self) -> Option<f64> {
        self.period_ns.map(|period_ns| period_ns as f64 * 1e-9)
    }

    pub(crate) fn due(&mut self, time_ns: u64) -> bool {
        let Some(period_ns) = self.period_ns else {
            return false;
        };
        if time_ns < self.next_ns {
            return false;
        }
        self.next_ns = time_ns - time_ns % period_ns.max(1) + period_ns;
        true
    }
}

/// The pace of each topic that a run sends again and again.
#[derive(Clone, Copy)]
pub(crate) struct Rates {
    pub vehicle_state: Pace,
    pub tf: Pace,
    pub joint_states: Pace,
    pub odom: Pace,
    pub cmd_vel: Pace,
    pub markers: Pace,
}

impl Rates {
    /// Those of a log, for control periods of that length.
    pub(crate) fn of_log(rates: &LogRates, control_period_ns: u64) -> Self {
        Self {
            vehicle_state: rates
                .vehicle_state_hz
                .map_or(Pace::every(control_period_ns), Pace::hz),
            tf: Pace::hz(rates.tf_hz),
            joint_states: Pace::hz(rates.joint_states_hz),
            odom: Pace::hz(rates.odom_hz),
            cmd_vel: Pace::hz(rates.cmd_vel_hz),
            markers: Pace::hz(rates.markers_hz),
        }
    }
}
