//! The metrics of an outcome as people read them: title, unit, what each says.

use super::{Outcome, Verdict};

/// One metric of an [`Outcome`], for tables and reports.
///
/// ```
/// use omni_sim::{Metric, Outcome, config::Scenario};
/// let crossing = Metric::ALL.iter().find(|metric| metric.key == "crossing_s").ok_or("none")?;
/// assert_eq!(crossing.heading(), "crossing time [s]");
/// let mut outcome = Outcome::unfinished(&Scenario::load("step", &[])?);
/// assert_eq!(crossing.shown(&outcome), None); // not measured
/// outcome.crossing_s = Some(2.194_7);
/// assert_eq!(crossing.shown(&outcome).as_deref(), Some("2.19"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct Metric {
    /// Its name in JSON, logs, Parquet and Python: the field of [`Outcome`].
    pub key: &'static str,
    /// Its name in tables.
    pub title: &'static str,
    /// The unit that tables show it in, empty for a ratio or a count.
    pub unit: &'static str,
    /// Its meaning, in one or two sentences.
    pub meaning: &'static str,
    /// Which way is better.
    pub better: Better,
    /// Largest number of decimals in tables: finer ones are not significant.
    decimals: usize,
    /// Significant digits that a table shows.
    digits: i32,
    value: fn(&Outcome) -> Option<f64>,
    shown_of: fn(&Outcome) -> bool,
}

/// Which way a [`Metric`] is better.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Better {
    /// The lower of two values is better.
    Lower,
    /// The value nearer to zero is better.
    NearerToZero,
    /// Neither way.
    Neither,
}

impl Better {
    /// Its name for other languages: `lower`, `zero`, or empty if neither way is better.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Lower => "lower",
            Self::NearerToZero => "zero",
            Self::Neither => "",
        }
    }
}

/// Significant digits of a metric, and of a position, which is to the millimetre however far away it is.
const DIGITS: i32 = 3;
const POSITION_DIGITS: i32 = 9;

impl Metric {
    /// All, in the order of tables.
    pub const ALL: [Self; 23] = [
        Self::new("stalled_at_m", "stalled at x", "m", 2, |o| o.stalled_at_m)
            .says("Where the base stood when the vehicle made no more progress."),
        Self::new("stalled_row", "stalled row", "", 0, |o| o.stalled_row.map(|row| row as f64))
            .says("The foremost row of wheels that had not passed the obstacle. Row 1 is the front."),
        Self::new("crossing_s", "crossing time", "s", 2, |o| o.crossing_s)
            .says("Time from the first wheel at the obstacle to the last wheel on the ground beyond it.").lower(),
        Self::new("retries", "retries", "", 0, |o| o.retries.map(f64::from))
            .says("How often traction control backed off and tried again.")
            .of(|o| o.retries.is_some_and(|retries| retries > 0)).lower(),
        Self::new("stall_s", "stall at full torque", "s", 2, |o| Some(o.stall_s))
            .says("Longest time in which a motor gave at least 90 % of its stall torque while the vehicle stayed within 2 cm.")
            .of(stalled_long).lower(),
        Self::new("stall_from_s", "stall from", "s", 2, |o| o.stall_from_s)
            .says("When that began, from the start of the run.")
            .of(stalled_long),
        Self::new("final_x_m", "final x", "m", 3, |o| Some(o.final_x_m))
            .says("True position of the base at the end of the run, along the world's x axis.")
            .to_the_millimetre()
            .of(on_flat_ground),
        Self::new("final_y_m", "final y", "m", 3, |o| Some(o.final_y_m))
            .says("The same along the world's y axis. Left is positive.")
            .to_the_millimetre()
            .of(on_flat_ground),
        Self::new("final_yaw_rad", "final heading", "deg", 1, |o| Some(o.final_yaw_rad.to_degrees()))
            .says("True heading of the base at the end of the run. Counter-clockwise is positive.")
            .of(on_flat_ground),
        Self::new("odometry_error_m", "odometry error", "m", 4, |o| Some(o.odometry_error_m))
            .says("Distance between the true position and the position that the odometry estimates, at the end of the run.")
            .of(on_flat_ground).lower(),
        Self::new("path_error_rms_m", "path error, rms", "m", 4, |o| o.path_error_rms_m)
            .says("Root mean square of the distance between the base and its reference on the path.").lower(),
        Self::new("path_error_peak_m", "path error, peak", "m", 4, |o| o.path_error_peak_m)
            .says("Largest distance between the base and its reference on the path.").lower(),
        Self::new("arrived_s", "arrived", "s", 2, |o| o.arrived_s)
            .says("Since when the vehicle was at the end of its path, from the start of the run.").lower(),
        Self::new("pitch_peak_deg", "peak nose-up", "deg", 1, |o| Some(o.pitch_peak_deg))
            .says("Largest nose-up angle of any body.").lower(),
        Self::new("nose_down_peak_deg", "peak nose-down", "deg", 1, |o| Some(o.nose_down_peak_deg))
            .says("Largest nose-down angle of any body.")
            .of(|o| o.nose_down_peak_deg > o.pitch_peak_deg.max(1.0)).lower(),
        Self::new("yaw_error_deg", "heading error", "deg", 1, |o| Some(o.yaw_error_deg))
            .says("Heading minus commanded heading at the end. Left is positive.").nearer_to_zero(),
        Self::new("slip_rms", "slip rms", "", 3, |o| Some(o.slip_rms))
            .says("Slip ratio of the driven wheels that touch the ground. At 0 every wheel rolls.").lower(),
        Self::new("speed_error_rms", "speed error rms", "", 3, |o| Some(o.speed_error_rms))
            .says("Difference between reference and measured speed of the driven wheels, as a part of the larger of the two.").lower(),
        Self::new("speed_ratio_std", "speed ratio std", "", 3, |o| Some(o.speed_ratio_std))
            .says("Standard deviation, over the driven wheels, of measured speed over reference speed; root mean square over time.").lower(),
        Self::new("slip_speed_std", "slip speed std", "", 3, |o| Some(o.slip_speed_std))
            .says(
                "Standard deviation, over the driven wheels, of their slip speeds, as a part of their reference speeds; root mean square over \
                 time. Speed differences that the hinges cause in rolling wheels do not count.",
            ).lower(),
        Self::new("torque_squared_n2m2s", "torque squared", "N2m2s", 2, |o| Some(o.torque_squared_n2m2s))
            .says("Time integral of torque squared, summed over the wheels. The heat in the windings is proportional to it.").lower(),
        Self::new("work_j", "work", "J", 2, |o| Some(o.work_j)).says("Mechanical work of the motors.").lower(),
        // Reports have it; the command's tables are of the runs' results.
        Self::new("required_friction", "required friction", "", 2, |o| Some(o.required_friction))
            .says("The 95th percentile of the friction coefficient that loaded wheels needed, as averages over 10 ms.")
            .lower()
            .of(|_| false),
    ];

    const fn new(
        key: &'static str,
        title: &'static str,
        unit: &'static str,
        decimals: usize,
        value: fn(&Outcome) -> Option<f64>,
    ) -> Self {
        Self {
            key,
            title,
            unit,
            meaning: "",
            better: Better::Neither,
            decimals,
            digits: DIGITS,
            value,
            shown_of: |_| true,
        }
    }

    const fn says(self, meaning: &'static str) -> Self {
        Self { meaning, ..self }
    }

    const fn lower(self) -> Self {
        Self {
            better: Better::Lower,
            ..self
        }
    }

    const fn nearer_to_zero(self) -> Self {
        Self {
            better: Better::NearerToZero,
            ..self
        }
    }

    const fn to_the_millimetre(self) -> Self {
        Self {
            digits: POSITION_DIGITS,
            ..self
        }
    }

    /// Tables show it only for such outcomes.
    const fn of(self, shown_of: fn(&Outcome) -> bool) -> Self {
        Self { shown_of, ..self }
    }

    /// Title and unit, as `crossing time [s]`.
    #[must_use]
    pub fn heading(&self) -> String {
        match self.unit {
            "" => self.title.to_owned(),
            unit => format!("{} [{unit}]", self.title),
        }
    }

    /// Its value in the table's unit; none if it was not measured.
    #[must_use]
    pub fn value(&self, outcome: &Outcome) -> Option<f64> {
        (self.value)(outcome).filter(|value| value.is_finite())
    }

    /// Does a table of this run need it? A final pose says nothing of a climb, a count of no retries nothing at all.
    #[must_use]
    pub fn is_of(&self, outcome: &Outcome) -> bool {
        self.value(outcome).is_some() && (self.shown_of)(outcome)
    }

    /// Its value with three significant digits, and no more decimals than mean something (a
    /// position to the millimetre); none if it was not measured.
    #[must_use]
    pub fn shown(&self, outcome: &Outcome) -> Option<String> {
        self.value(outcome)
            .map(|value| significant(value, self.digits, self.decimals))
    }
}

/// Or went where it was not commanded to.
fn on_flat_ground(outcome: &Outcome) -> bool {
    matches!(
        outcome.verdict,
        Verdict::Completed
            | Verdict::WrongWay
            | Verdict::DroveOn
            | Verdict::RolledOn
            | Verdict::OffCourse
            | Verdict::FellShort
    )
}

/// Longer than any climb that succeeds pushes at a riser.
fn stalled_long(outcome: &Outcome) -> bool {
    outcome.stall_s > 1.0
}

/// A number with so many significant digits and at most so many decimals; never a negative zero.
fn significant(value: f64, digits: i32, most: usize) -> String {
    let whole = if value == 0.0 {
        0
    } else {
        value.abs().log10().floor() as i32 + 1
    };
    let decimals = usize::try_from(digits - whole).unwrap_or(0).min(most);
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(rest) if rest.bytes().all(|digit| matches!(digit, b'0' | b'.')) => rest.to_owned(),
        _ => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_significant_digits_no_needless_decimals_and_no_negative_zero() {
        assert_eq!(significant(12.345_6, POSITION_DIGITS, 3), "12.346");
        for (value, most, shown) in [
            (2.194_7, 2, "2.19"),
            (0.158_4, 3, "0.158"),
            (0.001_64, 3, "0.002"),
            (15.44, 2, "15.4"),
            (1544.4, 2, "1544"),
            (-0.004, 1, "0.0"),
            (-0.06, 1, "-0.1"),
            (0.0, 3, "0.000"),
            (9.996, 2, "10.00"),
            (7.0, 0, "7"),
        ] {
            assert_eq!(significant(value, DIGITS, most), shown, "{value} with {most}");
        }
    }

    #[test]
    fn every_metric_has_a_key_of_the_outcome_and_a_sentence() {
        let scenario = crate::config::Scenario::load("flat", &[]).expect("built in");
        let json = serde_json::to_value(Outcome::unfinished(&scenario)).expect("plain data");
        for metric in Metric::ALL {
            assert!(json.get(metric.key).is_some(), "{}", metric.key);
            assert!(metric.meaning.ends_with('.'), "{}", metric.key);
        }
    }
}
