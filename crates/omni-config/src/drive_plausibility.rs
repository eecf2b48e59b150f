//! Notices about doubtful fault detection of a scenario's drive.

use crate::command::CommandFrame;
use crate::digits::digits;
use crate::drive_config::LEAST_COUNTS;
use crate::{EncoderVelocity, Scenario};

impl Scenario {
    /// Doubts about `[drive.faults]`, one line each: thresholds below the effect of encoder counts on readings of
    /// healthy wheels, which are then declared faulty; and a velocity that no wheel reaches under the command, so that
    /// a dead encoder is detected late.
    ///
    /// ```
    /// use omni_config::{Override, Scenario};
    /// let doubts = |faults: &str, counts: u32| {
    ///     let keys = ["vehicle=mecanum4", &format!("drive.faults={faults}"), &format!("sensors.encoder_counts={counts}")];
    ///     let keys = keys.into_iter().map(Override::parse).collect::<Result<Vec<_>, _>>()?;
    ///     Ok::<_, omni_config::Error>(Scenario::load("flat", &keys)?.drive_doubts())
    /// };
    /// let expected = "drive.faults.stuck_rad_s = 1, but one encoder count reads as 1.57 rad/s, so that single counts of other wheels make a \
    ///                 standing wheel faulty; use sensors.encoder_velocity, more sensors.encoder_counts or at least 3.14";
    /// assert_eq!(doubts("{ stuck_rad_s = 1.0 }", 4000)?, [expected]);
    /// assert_eq!(doubts("{}", 4000)?, Vec::<String>::new()); // it is 3.14 then
    /// let expected = "drive.faults.stuck_rad_s = 12.3, but no wheel turns faster than 3.95 rad/s under the command, so that the other wheels \
    ///                 show a dead encoder after 3.11 s or later; use sensors.encoder_velocity or more sensors.encoder_counts";
    /// assert_eq!(doubts("{}", 1024)?, [expected]);
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn drive_doubts(&self) -> Vec<String> {
        let Some(faults) = self.drive_faults() else {
            return Vec::new();
        };
        let count_rad_s = self.encoder_step_rad_s().unwrap_or(0.0);
        let least_counts = faults
            .stuck_periods
            .map_or(LEAST_COUNTS, |periods| self.least_counts(periods));
        let finer = match self.sensors.encoder_velocity {
            None => "sensors.encoder_velocity",
            Some(EncoderVelocity::Window { .. }) => "a longer window",
            Some(_) => "a lower bandwidth",
        };
        let thresholds = [
            (
                "jump_rad_s",
                faults.jump_rad_s,
                LEAST_COUNTS,
                "single counts are called jumps",
            ),
            (
                "stuck_rad_s",
                faults.stuck_rad_s,
                least_counts,
                "single counts of other wheels make a standing wheel faulty",
            ),
        ];
        let below = thresholds.into_iter().filter_map(|(key, value, counts, effect)| {
            let value = value.filter(|value| *value < counts * count_rad_s)?;
            Some(format!(
                "drive.faults.{key} = {value}, but one encoder count reads as {} rad/s, so that {effect}; use {finer}, more \
                 sensors.encoder_counts or at least {}",
                digits(count_rad_s),
                digits(counts * count_rad_s)
            ))
        });
        let mut doubts: Vec<_> = below.collect();
        let (Some(stuck_rad_s), Some(periods)) = (faults.stuck_rad_s, faults.stuck_periods) else {
            return doubts;
        };
        let counts = self.sensors.encoder_counts;
        let three_counts =
            (LEAST_COUNTS + 1.0) * std::f64::consts::TAU / (counts * stuck_rad_s * self.period_s());
        if counts > 0.0 && f64::from(periods) < three_counts {
            doubts.push(format!(
                "drive.faults.stuck_periods = {periods}, but a wheel of {} rad/s takes {} periods for three encoder counts, so that a wheel that \
                 begins to turn is faulty; leave it out or use more sensors.encoder_counts",
                digits(stuck_rad_s),
                three_counts.ceil()
            ));
        }
        if let Some(fastest_rad_s) = self.fastest_rad_s().filter(|fastest| *fastest < stuck_rad_s) {
            let after_s = 10.0 * f64::from(periods) * self.period_s() * stuck_rad_s / fastest_rad_s;
            let less = if fastest_rad_s > least_counts * count_rad_s {
                format!("less than {}", digits(fastest_rad_s))
            } else {
                format!("{finer} or more sensors.encoder_counts")
            };
            doubts.push(format!(
                "drive.faults.stuck_rad_s = {}, but no wheel turns faster than {} rad/s under the command, so that the other wheels show a dead \
                 encoder after {} s or later; use {less}",
                digits(stuck_rad_s),
                digits(fastest_rad_s),
                digits(after_s)
            ));
        }
        doubts
    }

    /// That a dead encoder of some wheel is never noticed, where it is so: no other wheel shows its
    /// motion, and the torque that would make its reading stuck is more than its motor has, or than
    /// its loop asks for behind a reading of 0.
    ///
    /// ```
    /// use omni_config::{Override, Scenario};
    /// let said = |key: &str| {
    ///     let keys = ["vehicle=omni3", "drive={}", key].map(Override::parse);
    ///     let keys = keys.into_iter().collect::<Result<Vec<_>, _>>()?;
    ///     Scenario::load("flat", &keys).map(|scenario| scenario.unseen_encoders())
    /// };
    /// assert_eq!(said("drive.faults.stuck_torque_n_m=0.5")?, None);
    /// assert_eq!(said("drive.faults.stuck_torque_n_m=100")?.as_deref(), Some("wheels 1, 2, 3: a dead encoder is never noticed, because no \
    ///     other wheel tells of it and drive.faults.stuck_torque_n_m = 100; use less than the motor's 1 N.m"));
    /// assert_eq!(said("vehicle.gains={ kp_n_m_s_rad = 0.05, ki_n_m_rad = 0.0, kd_n_m_s2_rad = 0.0 }")?.as_deref(), Some("wheels 1, 2, 3: a \
    ///     dead encoder is never noticed, because no other wheel tells of it and drive.faults.stuck_torque_n_m = 0.5; use less than the 0.26 N.m \
    ///     that the loop asks for at most, or an integral"));
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn unseen_encoders(&self) -> Option<String> {
        let (vehicle, wheels) = (self.vehicle(), self.unchecked_wheels());
        let least_n_m = self.drive_faults()?.stuck_torque_n_m?;
        let stall_n_m = vehicle.motor.peak_torque_n_m();
        let asked_n_m = self.most_asked_n_m().unwrap_or(f64::INFINITY);
        let mend = if least_n_m >= stall_n_m {
            format!("use less than the motor's {stall_n_m} N.m")
        } else if least_n_m > asked_n_m {
            let asked = digits(asked_n_m);
            format!("use less than the {asked} N.m that the loop asks for at most, or an integral")
        } else {
            return None;
        };
        let names: Vec<_> = wheels.iter().map(|i| vehicle.wheel[*i].name.as_str()).collect();
        let plural = match names.len() {
            0 => return None,
            1 => "",
            _ => "s",
        };
        Some(format!(
            "wheel{plural} {}: a dead encoder is never noticed, because no other wheel tells of it and drive.faults.stuck_torque_n_m = \
             {least_n_m}; {mend}",
            names.join(", ")
        ))
    }

    /// The most that a loop asks for behind a reading of 0 \[N.m\]; none if its integral asks for ever more, and if
    /// nothing limits the command.
    fn most_asked_n_m(&self) -> Option<f64> {
        let gains = self.vehicle().gains_at(self.period_s()).ok()?;
        let fastest_rad_s = self.fastest_rad_s()?;
        let zone_rad_s = self.control.integral_zone_rad_s.unwrap_or(f64::INFINITY);
        let most_n_m = self.control.proportional_limit_n_m.unwrap_or(f64::INFINITY);
        let integrates = gains.ki_n_m_rad > 0.0 && fastest_rad_s <= zone_rad_s;
        (!integrates).then(|| (gains.kp_n_m_s_rad * fastest_rad_s).min(most_n_m))
    }

    /// The fastest that a wheel's actuator turns under the command \[rad/s\]; none if nothing says so. Where commands
    /// are not the vehicle's own twists, or all rest, what its limits allow.
    fn fastest_rad_s(&self) -> Option<f64> {
        let top_rad_s = self.vehicle().top_rad_s().ok()?;
        let largest = self.command.largest();
        let own = self.command.path.is_none()
            && self.command.frame == CommandFrame::Body
            && self.heading_hold.is_none();
        if !own || largest == [0.0; 3] {
            return top_rad_s;
        }
        let limits = self
            .vehicle()
            .limits
            .map_or([f64::INFINITY; 3], |limits| limits.speeds());
        let (rows, _) = self.vehicle().actuators().ok()?;
        let of = |row: &[f64; 3]| -> f64 {
            let parts = [0, 1, 2].map(|axis| row[axis].abs() * largest[axis].min(limits[axis]));
            parts.into_iter().sum()
        };
        let commanded = rows.iter().map(of).fold(0.0, f64::max);
        let motor = self.vehicle().no_load_rad_s().unwrap_or(f64::INFINITY);
        let limit = self
            .drive
            .and_then(|drive| drive.speed_limit_rad_s)
            .unwrap_or(f64::INFINITY);
        Some(commanded.min(motor).min(limit))
    }
}
