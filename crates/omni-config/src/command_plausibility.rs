//! Notices about commands that are allowed but doubtful.

use crate::digits::digits;
use crate::{Error, Scenario};

/// A speed beyond what the motors reach by less than this part is none to speak of.
const SLACK: f64 = 1.001;
/// Units of a twist's parts.
const AXES: [&str; 3] = ["m/s forward", "m/s sideways", "rad/s in yaw"];

impl Scenario {
    /// Doubts about the command, one line each: a request beyond the motors' speed or the vehicle's `[limits]`, and
    /// rows of its table after the end of the run.
    ///
    /// # Errors
    /// As [`Vehicle::speeds_at`](crate::Vehicle::speeds_at); a loaded scenario has been checked.
    ///
    /// ```
    /// use omni_config::{Override, Scenario};
    /// let doubts = |vx| Scenario::load("flat", &[Override::new("command.vx_m_s", vx)])?.command_doubts();
    /// assert_eq!(doubts(0.3)?, Vec::<String>::new());
    /// let expected = "command: up to 7 m/s forward, but the vehicle's [limits] allow only 1";
    /// assert_eq!(doubts(7.0)?, [expected]);
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn command_doubts(&self) -> Result<Vec<String>, Error> {
        let mut doubts = Vec::new();
        let vehicle = self.vehicle();
        let motors = vehicle.motor_speeds()?;
        let limits = vehicle.limits.map(|limits| limits.speeds());
        for (axis, asked) in self.command.largest().into_iter().enumerate() {
            let unit = AXES[axis];
            let beyond = |top: [f64; 3]| (asked > SLACK * top[axis]).then_some(top[axis]);
            let why = match (limits.and_then(beyond), motors.and_then(beyond)) {
                (Some(most), _) => format!("the vehicle's [limits] allow only {}", digits(most)),
                (None, Some(most)) => format!("its motors reach only {} without load", digits(most)),
                (None, None) => continue,
            };
            doubts.push(format!("command: up to {asked} {unit}, but {why}"));
        }
        if doubts.is_empty()
            && let Some(no_load) = vehicle.no_load_rad_s()
        {
            let (rows, _) = vehicle.actuators()?;
            let rate = |twist: &[f64; 3], row: &[f64; 3]| {
                (0..3).map(|axis| twist[axis] * row[axis]).sum::<f64>().abs()
            };
            let fastest = |twist: &[f64; 3]| rows.iter().map(|row| rate(twist, row)).fold(0.0, f64::max);
            let twists = self.command.twists().map(|twist| (fastest(&twist), twist));
            if let Some((needed, [vx, vy, wz])) = twists.max_by(|a, b| a.0.total_cmp(&b.0))
                && needed > SLACK * no_load
            {
                doubts.push(format!(
                    "command: {vx} m/s forward, {vy} m/s sideways and {wz} rad/s in yaw together turn a wheel's motor at {} rad/s; the motors reach \
                     {} without load",
                    digits(needed),
                    digits(no_load)
                ));
            }
        }
        let times = self.command.file.iter().flat_map(|file| file.rows());
        let late = times.map(|row| row[0]).filter(|time_s| *time_s > self.duration_s);
        if let Some(last_s) = late.clone().reduce(f64::max) {
            doubts.push(format!(
                "command.file: {} rows come after the run's end at {} s, the last at {last_s} s",
                late.count(),
                self.duration_s
            ));
        }
        Ok(doubts)
    }
}
