//! A run as columns, one row for each control period.

use serde::{Deserialize, Serialize};

use crate::config::Vehicle;
use crate::following::error_of;
use crate::report::ReportColumns;
use crate::sensed::Sensed;
use crate::{Outcome, Period, WheelSignal};

/// Columns of every vehicle, in order.
const COMMON: [&str; 39] = [
    "time_s",
    "command_vx_m_s",
    "command_vy_m_s",
    "command_wz_rad_s",
    "estimated_vx_m_s",
    "estimated_vy_m_s",
    "estimated_wz_rad_s",
    "common_factor",
    "pose_x_m",
    "pose_y_m",
    "pose_z_m",
    "pose_qx",
    "pose_qy",
    "pose_qz",
    "pose_qw",
    "pose_yaw_rad",
    "twist_vx_m_s",
    "twist_vy_m_s",
    "twist_wz_rad_s",
    "odom_x_m",
    "odom_y_m",
    "odom_yaw_rad",
    "odom_var_x_m2",
    "odom_cov_xy_m2",
    "odom_var_y_m2",
    "odom_var_yaw_rad2",
    "force_x_n",
    "force_y_n",
    "force_z_n",
    "newton_residual_n",
    "work_in_j",
    "turnover_j",
    "kinetic_j",
    "potential_j",
    "friction_loss_j",
    "impact_loss_j",
    "joint_loss_j",
    "drag_loss_j",
    "energy_residual_j",
];

/// Columns of a run that follows a path: after the reference pose, the position error and the heading error.
const PATH_ERRORS: [&str; 2] = ["path_error_m", "path_error_rad"];

/// A run as named columns of `f64`, all in one block: column after column, one row per control period.
///
/// Columns: `time_s` (end of the period; the controller measured at its start), the command, the twist estimated
/// from the encoders, `common_factor`, pose and twist of the base, the pose by odometry with its covariance, the
/// total ground force, Newton's residual and the energy balance ([`crate::observation::Energy`]); `row_1_load_n`,
/// the front row's, and so on; `body_NAME_nose_up_rad`; `hinge_NAME_angle_rad`, `hinge_NAME_rate_rad_s`; what the
/// sensors said at the start of the period ([`Sensed::names`]); what the controller reports of itself
/// ([`ReportColumns`]); and for each signal of [`Trace::wheel_signals`] one column per wheel, `wheel_NAME_SIGNAL`, side
/// by side. Ratios are the safe forms of [`omni_core::metrics`]; a wheel in the air slips 0.
///
/// ```
/// use omni_sim::{config::Scenario, run};
/// let trace = run(&Scenario::load("flat", &[])?)?;
/// assert_eq!(trace.rows(), 4000); // 4 s at 1 kHz
/// assert_eq!(trace.column("time_s").map(|t| t[3999]), Some(4.0));
/// assert!(trace.wheel("measured_rad_s", 2).is_some_and(|w| w[3999] < -4.5)); // wheel 3, on the left
/// assert!(trace.column("speed").is_none());
/// # Ok::<(), omni_sim::Error>(())
/// ```
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(try_from = "Unchecked")]
pub struct Trace {
    #[serde(with = "crate::outcome::as_json")]
    outcome: Outcome,
    names: Vec<String>,
    rows: usize,
    data: Vec<f64>,
    wheel_names: Vec<String>,
    signals: Vec<String>,
    first_wheel_column: usize,
}

/// A trace as it was written, by any program.
#[derive(Deserialize)]
struct Unchecked {
    #[serde(with = "crate::outcome::as_json")]
    outcome: Outcome,
    names: Vec<String>,
    rows: usize,
    data: Vec<f64>,
    wheel_names: Vec<String>,
    signals: Vec<String>,
    first_wheel_column: usize,
}

impl TryFrom<Unchecked> for Trace {
    type Error = &'static str;

    /// Every column has its numbers: what asks for one need not look.
    fn try_from(read: Unchecked) -> Result<Self, Self::Error> {
        let columns = read.names.len();
        let of_wheels = read.signals.len().checked_mul(read.wheel_names.len());
        if of_wheels.and_then(|of_wheels| of_wheels.checked_add(read.first_wheel_column)) != Some(columns) {
            return Err("columns without a name, or names without a column");
        }
        if columns.checked_mul(read.rows) != Some(read.data.len()) {
            return Err("not as many numbers as columns times rows");
        }
        Ok(Self {
            outcome: read.outcome,
            names: read.names,
            rows: read.rows,
            data: read.data,
            wheel_names: read.wheel_names,
            signals: read.signals,
            first_wheel_column: read.first_wheel_column,
        })
    }
}

/// Equal names and columns; NaN equals NaN. The outcome is not compared.
impl PartialEq for Trace {
    fn eq(&self, other: &Self) -> bool {
        let equal = |(a, b): (&f64, &f64)| a == b || (a.is_nan() && b.is_nan());
        self.names == other.names
            && self.wheel_names == other.wheel_names
            && self.data.len() == other.data.len()
            && self.data.iter().zip(&other.data).all(equal)
    }
}

impl Trace {
    /// The run's metrics.
    #[must_use]
    pub fn outcome(&self) -> &Outcome {
        &self.outcome
    }

    /// Rows: control periods.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Names of the columns, in order.
    #[must_use]
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Names of the wheels, in order.
    #[must_use]
    pub fn wheel_names(&self) -> &[String] {
        &self.wheel_names
    }

    /// Names of the signals of every wheel.
    #[must_use]
    pub fn wheel_signals(&self) -> &[String] {
        &self.signals
    }

    /// A column by name.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        self.names
            .iter()
            .position(|n| n == name)
            .map(|index| self.column_at(index))
    }

    /// A signal of the wheel with index `wheel`, from 0.
    #[must_use]
    pub fn wheel(&self, signal: &str, wheel: usize) -> Option<&[f64]> {
        let all = self.wheels(signal)?;
        (wheel < self.wheel_names.len()).then(|| &all[wheel * self.rows..][..self.rows])
    }

    /// A signal of all wheels: one wheel's column after the other.
    #[must_use]
    pub fn wheels(&self, signal: &str) -> Option<&[f64]> {
        let index = self.signals.iter().position(|name| name == signal)?;
        let wheels = self.wheel_names.len();
        let start = (self.first_wheel_column + index * wheels) * self.rows;
        self.data.get(start..start + wheels * self.rows)
    }

    /// All columns, one after the other.
    #[must_use]
    pub fn data(&self) -> &[f64] {
        &self.data
    }

    /// A column by its place in [`Trace::names`].
    ///
    /// # Panics
    /// If there is no such column.
    #[must_use]
    pub fn column_at(&self, index: usize) -> &[f64] {
        &self.data[index * self.rows..(index + 1) * self.rows]
    }
}

/// A trace that grows row by row, of any columns: first the columns of the vehicle, then for each signal one per wheel.
///
/// ```
/// use omni_sim::{Outcome, Rows, Run, config::Scenario};
/// let scenario = Scenario::load("flat", &[])?;
/// let (outcome, _) = Run::new(&scenario).outcome()?;
/// let mut rows = Rows::new(scenario.vehicle(), vec!["time_s".into()], vec!["heat_j"]);
/// rows.push([0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
/// let trace = rows.finish(outcome);
/// assert_eq!(trace.wheel("heat_j", 2), Some([3.0].as_slice()));
/// # Ok::<(), omni_sim::Error>(())
/// ```
pub struct Rows {
    names: Vec<String>,
    wheel_names: Vec<String>,
    signals: Vec<&'static str>,
    first_wheel_column: usize,
    /// Row after row, each with one number per name.
    rows: Vec<f64>,
}

/// Rows that become columns together.
const ROWS_AT_ONCE: usize = 32;

impl Rows {
    /// No rows yet; `names` are the columns of the vehicle, `signals` those that each of its wheels has.
    #[must_use]
    pub fn new(vehicle: &Vehicle, mut names: Vec<String>, signals: Vec<&'static str>) -> Self {
        let first_wheel_column = names.len();
        for signal in &signals {
            names.extend(vehicle.wheel.iter().map(|w| format!("wheel_{}_{signal}", w.name)));
        }
        Self {
            wheel_names: vehicle.wheel.iter().map(|w| w.name.clone()).collect(),
            names,
            signals,
            first_wheel_column,
            rows: Vec::new(),
        }
    }

    /// Adds numbers behind the last one: a row has one a column of the vehicle, then for each
    /// signal one per wheel. A row may come in pieces; what is no whole row at the end is left out.
    pub fn push(&mut self, numbers: impl IntoIterator<Item = f64>) {
        self.rows.extend(numbers);
    }

    /// All rows as columns.
    #[must_use]
    pub fn finish(self, outcome: Outcome) -> Trace {
        let columns = self.names.len();
        let rows = self.rows.len() / columns;
        let mut data = vec![0.0; rows * columns];
        // A few rows at a time, which stay in the processor's cache until each column has its part.
        for (block, some) in self.rows.chunks(ROWS_AT_ONCE * columns).enumerate() {
            for (c, column) in data.chunks_exact_mut(rows).enumerate() {
                let part = column.iter_mut().skip(ROWS_AT_ONCE * block);
                for (value, row) in part.zip(some.chunks_exact(columns)) {
                    *value = row[c];
                }
            }
        }
        Trace {
            outcome,
            names: self.names,
            rows,
            data,
            wheel_names: self.wheel_names,
            signals: self.signals.into_iter().map(String::from).collect(),
            first_wheel_column: self.first_wheel_column,
        }
    }
}

/// The trace of a run in progress: the controller's results and the resulting states, row by row.
///
/// ```
/// use omni_sim::{Error, Run, TraceBuilder, config::Scenario};
/// let scenario = Scenario::load("flat", &[])?.with_policy("independent")?;
/// let mut trace = TraceBuilder::new(scenario.vehicle());
/// let watch = |simulation: &omni_sim::Simulation, _| {
///     trace.push(simulation.period());
///     Ok::<(), Error>(())
/// };
/// let (outcome, _) = Run::new(&scenario).watch(watch).outcome()?;
/// assert_eq!(trace.finish(outcome), omni_sim::run(&scenario)?);
/// # Ok::<(), Error>(())
/// ```
pub struct TraceBuilder {
    rows: Rows,
    /// Report columns of its controller.
    report: ReportColumns,
}

impl TraceBuilder {
    /// No rows yet; of a controller that reports nothing beside the wheels' signals.
    #[must_use]
    pub fn new(vehicle: &Vehicle) -> Self {
        Self::with_report(vehicle, &ReportColumns::default())
    }

    /// No rows yet; `report` is what the controller reports
    /// ([`crate::controller::AnyController::columns`]), columns before the wheels' columns.
    #[must_use]
    pub fn with_report(vehicle: &Vehicle, report: &ReportColumns) -> Self {
        let mut names: Vec<String> = COMMON.map(String::from).into();
        names.extend((1..=vehicle.rows().len()).map(|row| format!("row_{row}_load_n")));
        names.extend(
            vehicle
                .body
                .iter()
                .map(|b| format!("body_{}_nose_up_rad", b.name)),
        );
        for hinge in &vehicle.hinge {
            names.extend([
                format!("hinge_{}_angle_rad", hinge.name),
                format!("hinge_{}_rate_rad_s", hinge.name),
            ]);
        }
        names.extend(Sensed::names(vehicle));
        names.extend_from_slice(report.names());
        if report.follows_a_path() {
            names.extend(PATH_ERRORS.map(String::from));
        }
        let signals = WheelSignal::all().map(|signal| signal.name).collect();
        Self {
            rows: Rows::new(vehicle, names, signals),
            report: report.clone(),
        }
    }

    /// Names of the columns, in order.
    pub(crate) fn names(&self) -> &[String] {
        &self.rows.names
    }

    /// Adds a control period.
    pub fn push(&mut self, period: &Period) {
        let (sample, seen) = (&period.control, &period.observed);
        let mut force = [0.0; 3];
        for wheel in &seen.wheels {
            for k in 0..3 {
                force[k] += wheel.force_n[k];
            }
        }
        let rows = &mut self.rows.rows;
        rows.push(seen.time_ns as f64 * 1e-9);
        rows.extend(sample.command.to_array());
        rows.extend(sample.estimated.to_array());
        rows.push(sample.common_factor);
        rows.extend(seen.pose.position_m);
        rows.extend(seen.pose.rotation_xyzw);
        rows.push(seen.pose.yaw_rad());
        rows.extend(seen.twist.to_array());
        let odometry = &seen.odometry;
        rows.extend([odometry.pose.x_m, odometry.pose.y_m, odometry.pose.yaw_rad]);
        let [[xx, xy, _], [_, yy, _], [_, _, yaw]] = odometry.covariance;
        rows.extend([xx, xy, yy, yaw]);
        rows.extend(force);
        rows.push(seen.newton_residual_n);
        let e = &seen.energy;
        rows.extend([e.work_in_j, e.turnover_j, e.kinetic_j, e.potential_j]);
        rows.extend([e.friction_loss_j, e.impact_loss_j, e.joint_loss_j, e.drag_loss_j]);
        rows.push(e.residual_j());
        rows.extend(&seen.row_loads_n);
        rows.extend(&seen.body_nose_up_rad);
        for hinge in &seen.hinges {
            rows.extend([hinge.angle_rad, hinge.rate_rad_s]);
        }
        rows.extend(period.sensed.values());
        rows.extend(self.report.values(&sample.report));
        if self.report.follows_a_path() {
            let path = sample.report.path.as_ref();
            rows.extend(path.map_or([f64::NAN; 2], |path| error_of(&path.pose, seen)));
        }
        for signal in WheelSignal::all() {
            let wheels = sample.wheels.iter().zip(&seen.wheels);
            rows.extend(wheels.map(|(signals, wheel)| signal.value(signals, wheel)));
        }
    }

    /// All rows as columns.
    #[must_use]
    pub fn finish(self, outcome: Outcome) -> Trace {
        self.rows.finish(outcome)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{Override, Scenario};

    #[test]
    fn a_trace_whose_columns_and_numbers_disagree_is_refused_not_read_beyond_its_end() {
        let overrides = [
            Override::new("duration_s", 0.01),
            Override::new("vehicle", "omni3"),
        ];
        let scenario = Scenario::load("flat", &overrides).expect("a scenario");
        let trace = crate::run(&scenario).expect("a run");
        let read = |changed: &Trace| {
            let bytes = postcard::to_allocvec(changed).expect("plain numbers and names");
            postcard::from_bytes::<Trace>(&bytes)
        };
        assert_eq!(read(&trace), Ok(trace.clone()));
        for rows in [0, 9, 11, usize::MAX, 1 << 62] {
            let changed = Trace {
                rows,
                ..trace.clone()
            };
            assert!(read(&changed).is_err(), "{rows} rows");
        }
        for first_wheel_column in [0, trace.first_wheel_column + 1, usize::MAX] {
            let changed = Trace {
                first_wheel_column,
                ..trace.clone()
            };
            assert!(read(&changed).is_err(), "wheels from {first_wheel_column}");
        }
    }
}
