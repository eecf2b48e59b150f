//! What is doubtful of the fault detection of a scenario's drive.

use crate::Scenario;
use crate::derived_gains::digits;

/// A reading toggles between two counts at an edge, and another wheel's may do so at the same time: with 1.2 counts a standing wheel of chugo7
/// was called stuck in each of four drives, with 1.5 counts in none.
const LEAST_COUNTS: f64 = 2.0;

impl Scenario {
    /// What is doubtful of `[drive.faults]`, a line each: thresholds below what two counts of the encoders read as, with
    /// `sensors.encoder_velocity` where it is set. Healthy wheels are then called faulty.
    ///
    /// ```
    /// use omni_config::{Override, Scenario};
    /// let doubts = |counts: u32| {
    ///     let keys = ["vehicle=mecanum4", "drive.faults={ jump_rad_s = 4.0 }"].map(Override::parse);
    ///     let keys = keys.into_iter().collect::<Result<Vec<_>, _>>()?;
    ///     let counts = Override::new("sensors.encoder_counts", i64::from(counts));
    ///     Ok::<_, omni_config::Error>(Scenario::load("flat", &[keys, vec![counts]].concat())?.drive_doubts())
    /// };
    /// let expected = "drive.faults.stuck_rad_s = 1, but one encoder count reads as 1.57 rad/s, so that single counts of other wheels make a \
    ///                 standing wheel faulty; use at least 3.14, more sensors.encoder_counts or a slower sensors.encoder_velocity";
    /// assert_eq!(doubts(4000)?, [expected]);
    /// assert_eq!(doubts(16384)?, Vec::<String>::new());
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn drive_doubts(&self) -> Vec<String> {
        let (Some(faults), Some(count_rad_s)) = (self.drive_faults(), self.encoder_step_rad_s()) else {
            return Vec::new();
        };
        let thresholds = [
            ("jump_rad_s", faults.jump_rad_s, "single counts are called jumps"),
            (
                "stuck_rad_s",
                Some(faults.stuck_rad_s),
                "single counts of other wheels make a standing wheel faulty",
            ),
        ];
        let below = thresholds.into_iter().filter_map(|(key, value, effect)| {
            let value = value.filter(|value| *value < LEAST_COUNTS * count_rad_s)?;
            Some(format!(
                "drive.faults.{key} = {value}, but one encoder count reads as {} rad/s, so that {effect}; use at least {}, more \
                 sensors.encoder_counts or a slower sensors.encoder_velocity",
                digits(count_rad_s),
                digits(LEAST_COUNTS * count_rad_s)
            ))
        });
        below.collect()
    }
}
