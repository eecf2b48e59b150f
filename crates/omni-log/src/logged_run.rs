//! A whole log in memory: columns and frames.

use std::collections::BTreeMap;
use std::path::Path;

use omni_config::{Scenario, Vehicle};
use omni_core::BodyTwist;
use omni_sim::{Outcome, Rows, Trace};

use crate::frames::Frames;
use crate::reader::read_log_watched;
use crate::ros2::{Twist, VehicleState, WheelState};
use crate::{Error, LogError, LogFile, LogMessage};

/// Columns of a log that every vehicle has, named as in [`Trace`].
const COMMON: [&str; 9] = [
    "time_s",
    "asked_vx_m_s",
    "asked_vy_m_s",
    "asked_wz_rad_s",
    "gyro_rad_s",
    "estimated_vx_m_s",
    "estimated_vy_m_s",
    "estimated_wz_rad_s",
    "common_factor",
];

/// A signal of each wheel.
type WheelColumn = (&'static str, fn(&WheelState) -> f64);

const WHEEL: [WheelColumn; 15] = [
    ("reference_rad_s", |w| w.reference_rad_s),
    ("measured_rad_s", |w| w.measured_rad_s),
    ("p_n_m", |w| w.p_n_m),
    ("i_n_m", |w| w.i_n_m),
    ("d_n_m", |w| w.d_n_m),
    ("requested_n_m", |w| w.requested_n_m),
    ("applied_n_m", |w| w.applied_n_m),
    ("torque_n_m", |w| w.acted_n_m),
    ("limit_lower_n_m", |w| w.limit_lower_n_m),
    ("limit_upper_n_m", |w| w.limit_upper_n_m),
    ("saturated", |w| f64::from(u8::from(w.saturated))),
    ("disturbed_ratio", |w| w.disturbed_ratio),
    ("slip_ratio", |w| w.slip_ratio),
    ("force_normal_n", |w| w.contact_normal_n),
    ("force_along_n", |w| w.contact_along_n),
];

/// A run read back from its log.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct LoggedRun {
    /// What the log says of itself.
    pub file: LogFile,
    /// `/vehicle_state` as columns, one row a message, named as in the run's own [`Trace`]; with what was asked for and the gyro,
    /// without what the log does not hold at that rate: poses, hinges, energies.
    pub trace: Trace,
    /// Times of the messages on `/tf` \[s\].
    pub frame_time_s: Vec<f64>,
    /// Every frame of `/tf` in the world, by name: x, y, z \[m\] and the unit quaternion x, y, z, w, one row a time.
    pub frames: BTreeMap<String, Vec<[f64; 7]>>,
    /// The vehicle as URDF.
    pub urdf: String,
    /// The ground as URDF.
    pub terrain_urdf: String,
}

impl LoggedRun {
    /// Reads a log from start to end, finished or not. Where it is not finished, the trace's outcome is `unfinished` with nothing
    /// measured.
    ///
    /// ```
    /// use omni_log::{Error, LoggedRun, RunLog, run_logged};
    /// use omni_sim::config::{Override, Scenario};
    /// let path = std::env::temp_dir().join("omnistep-logged-run-example.mcap");
    /// let scenario = Scenario::load("flat", &[Override::parse("duration_s=0.1")?])?;
    /// let trace = run_logged::<Error>(&scenario, RunLog::create(&path, &scenario)?, |_, _| Ok(()))?;
    /// let logged = LoggedRun::read(&path)?;
    /// assert_eq!(logged.trace.wheels("applied_n_m"), trace.wheels("applied_n_m"));
    /// assert_eq!(logged.frames["wheel_4"].len(), logged.frame_time_s.len());
    /// # std::fs::remove_file(&path).ok();
    /// # Ok::<(), Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`read_log`](super::read_log).
    pub fn read(path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::read_watched(path, |_| true)
    }

    /// [`LoggedRun::read`] that tells `watch` the part done, 0 to 1, every some milliseconds, and stops where that says false.
    ///
    /// # Errors
    /// As [`read_log`](super::read_log), and [`LogError::Stopped`].
    pub fn read_watched(path: impl AsRef<Path>, mut watch: impl FnMut(f64) -> bool) -> Result<Self, Error> {
        // The columns need the vehicle, which a finished log names at its end too, but messages come before.
        let mut states = Vec::new();
        let mut frames = Frames::default();
        let [mut urdf, mut terrain_urdf] = [String::new(), String::new()];
        let path = path.as_ref();
        let damaged = |reason| LogError::Damaged {
            path: path.to_path_buf(),
            reason,
        };
        let file = read_log_watched(path, &mut watch, |time_ns, message| {
            match message {
                LogMessage::VehicleState(state) => states.push((time_ns, state)),
                LogMessage::Tf(message) => frames.add(time_ns, message).map_err(damaged)?,
                LogMessage::RobotDescription(text) => urdf = text.data,
                LogMessage::Terrain(text) => terrain_urdf = text.data,
                _ => {}
            }
            Ok(())
        })?;
        let mut rows = Rows::new(
            file.scenario.vehicle(),
            COMMON.map(String::from).into(),
            WHEEL.iter().map(|(name, _)| *name).collect(),
        );
        for (i, (time_ns, state)) in states.iter().enumerate() {
            if i % ROWS_PER_LOOK == 0 && !watch(1.0) {
                return Err(LogError::Stopped { path: file.path }.into());
            }
            push(&mut rows, *time_ns, state, file.scenario.vehicle());
        }
        let (frame_time_s, frames) = frames.of(file.scenario.vehicle()).map_err(damaged)?;
        // A run that was killed has none.
        let outcome = file
            .outcome
            .unwrap_or_else(|| Outcome::unfinished(&file.scenario));
        Ok(Self {
            trace: rows.finish(outcome),
            frame_time_s,
            frames,
            urdf,
            terrain_urdf,
            file,
        })
    }

    /// The scenario as it was run.
    #[must_use]
    pub fn scenario(&self) -> &Scenario {
        &self.file.scenario
    }
}

/// Rows between two looks at whether to go on.
const ROWS_PER_LOOK: usize = 4096;

fn push(rows: &mut Rows, time_ns: u64, state: &VehicleState, vehicle: &Vehicle) {
    let planar = |t: &Twist| {
        let (vx_m_s, vy_m_s, wz_rad_s) = (t.linear.x, t.linear.y, t.angular.z);
        BodyTwist {
            vx_m_s,
            vy_m_s,
            wz_rad_s,
        }
        .to_array()
    };
    rows.push([time_ns as f64 * 1e-9]);
    rows.push(planar(&state.asked_twist));
    rows.push([state.gyro_rad_s]);
    rows.push(planar(&state.estimated_twist));
    rows.push([state.common_factor]);
    for (_, signal) in &WHEEL {
        // As many as the vehicle has, whatever a message holds.
        rows.push((0..vehicle.wheel.len()).map(|i| state.wheels.get(i).map_or(f64::NAN, signal)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{RunLog, run_logged};
    use omni_sim::Simulation;

    #[test]
    fn frames_and_columns_are_those_of_the_run() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("x.mcap");
        let shorter = omni_config::Override::new("duration_s", 2.0);
        let scenario = Scenario::load("step", &[shorter]).expect("built-in");
        let log = RunLog::create(&path, &scenario).expect("writable");
        let mut seen = Vec::new();
        run_logged::<Error>(&scenario, log, |simulation: &Simulation, _| {
            seen.push(simulation.observation().clone());
            Ok(())
        })
        .expect("runs");
        let logged = LoggedRun::read(&path).expect("a log");
        assert_eq!((logged.trace.rows(), logged.frame_time_s.len()), (2000, 101));
        for (row, time) in logged.frame_time_s.iter().enumerate() {
            let at = &seen[(time * 1e3).round() as usize - 1];
            for (wheel, o) in scenario.vehicle().wheel.iter().zip(&at.wheels) {
                let pose = logged.frames[&format!("wheel_{}", wheel.name)][row];
                for k in 0..3 {
                    // Hinges give by micrometres under an impact.
                    assert!((pose[k] - o.centre_m[k]).abs() < 1e-4, "wheel {}", wheel.name);
                }
            }
        }
    }
}
