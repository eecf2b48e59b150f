//! A whole log in memory: columns and frames.

use std::collections::BTreeMap;
use std::path::Path;

use omni_config::Scenario;
use omni_core::BodyTwist;
use omni_sim::controller::MOST_SIGNALS;
use omni_sim::{LOGGED_SIGNALS, Outcome, Rows, Sensed, Trace, WheelSignal};

use crate::frames::Frames;
use crate::reader::read_log_watched;
use crate::ros2::{ControllerSignals, Sensors, Twist, VehicleState, WheelState};
use crate::{Error, LogError, LogFile, LogMessage, Track, topic};

/// Columns of every vehicle's log, named as in [`Trace`].
const COMMON: [&str; 8] = [
    "time_s",
    "asked_vx_m_s",
    "asked_vy_m_s",
    "asked_wz_rad_s",
    "estimated_vx_m_s",
    "estimated_vy_m_s",
    "estimated_wz_rad_s",
    "common_factor",
];

/// A run read back from its log.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct LoggedRun {
    /// The log's metadata.
    pub file: LogFile,
    /// `/vehicle_state`, `/sensors` and `/controller_signals` as columns, one row a message, named as in the run's own
    /// [`Trace`]; with what was asked for, without what the log does not hold at that rate: poses, hinges, energies.
    pub trace: Trace,
    /// Times of the messages on `/tf` \[s\].
    pub frame_time_s: Vec<f64>,
    /// Every frame of `/tf` in the world, by name: x, y, z \[m\] and the unit quaternion x, y, z, w, one row a time.
    pub frames: BTreeMap<String, Vec<[f64; 7]>>,
    /// Pose by `/odom`.
    pub odometry: Track,
    /// Pose by `/ground_truth/odom`.
    pub ground_truth: Track,
    /// The vehicle as URDF.
    pub urdf: String,
    /// The ground as URDF.
    pub terrain_urdf: String,
}

impl LoggedRun {
    /// Reads a log from start to end, finished or not. If it is not finished, the trace's outcome is `unfinished` with
    /// nothing measured.
    ///
    /// ```
    /// use omni_log::{Error, LogRun, LoggedRun, RunLog};
    /// use omni_sim::{Run, config::{Override, Scenario}, controller::AnyController};
    /// let path = std::env::temp_dir().join("omnistep-logged-run-example.mcap");
    /// let scenario = Scenario::load("flat", &[Override::parse("duration_s=0.1")?])?;
    /// let controller = AnyController::new(&scenario)?;
    /// let log = RunLog::create(&path, &scenario, &controller)?;
    /// let trace = Run::new(&scenario).controller(controller).log::<Error>(log)?;
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

    /// [`LoggedRun::read`] that calls `watch` with the part done, 0 to 1, every some milliseconds,
    /// and stops where that says false.
    ///
    /// # Errors
    /// As [`read_log`](super::read_log), and [`LogError::Stopped`].
    pub fn read_watched(path: impl AsRef<Path>, mut watch: impl FnMut(f64) -> bool) -> Result<Self, Error> {
        // The columns need the vehicle, which a finished log names at its end too, but messages come before.
        let (mut states, mut sensors) = (Vec::new(), Vec::<(u64, Sensors)>::new());
        let mut own = Own::default();
        let mut frames = Frames::default();
        let [mut odometry, mut ground_truth] = [Track::default(), Track::default()];
        let [mut urdf, mut terrain_urdf] = [String::new(), String::new()];
        let path = path.as_ref();
        let damaged = |reason| LogError::damaged(path, reason);
        let file = read_log_watched(path, &mut watch, |time_ns, message| {
            match message {
                LogMessage::VehicleState(state) => states.push((time_ns, state)),
                LogMessage::Sensors(read) => sensors.push((time_ns, read)),
                LogMessage::ControllerSignals(signals) => own.add(time_ns, signals).map_err(damaged)?,
                LogMessage::Tf(message) => frames.add(time_ns, message).map_err(damaged)?,
                LogMessage::Odom(message) => odometry.add(time_ns, &message),
                LogMessage::GroundTruth(message) => ground_truth.add(time_ns, &message),
                LogMessage::RobotDescription(text) => urdf = text.data,
                LogMessage::Terrain(text) => terrain_urdf = text.data,
                _ => {}
            }
            Ok(())
        })?;
        let vehicle = file.scenario.vehicle();
        let states_ns: Vec<_> = states.iter().map(|(time_ns, _)| *time_ns).collect();
        let sensors_ns: Vec<_> = sensors.iter().map(|(time_ns, _)| *time_ns).collect();
        for (topic, times_ns) in [
            (topic::SENSORS, &sensors_ns),
            (topic::CONTROLLER_SIGNALS, &own.times_ns),
        ] {
            one_a_state(topic, times_ns, &states_ns, file.complete).map_err(damaged)?;
        }
        let sensed_names = Sensed::names(vehicle);
        if let Some(taken) = own.names.iter().find(|name| sensed_names.contains(name)) {
            let topic = topic::CONTROLLER_SIGNALS;
            return Err(damaged(format!("{topic}: {taken}, allowed: names of no sensor")).into());
        }
        let unknown = vec![f64::NAN; sensed_names.len()];
        let common = COMMON.map(String::from).into_iter();
        let mut rows = Rows::new(
            vehicle,
            common.chain(sensed_names).chain(own.names.clone()).collect(),
            WheelSignal::logged().map(|signal| signal.name).into(),
        );
        for (i, (time_ns, state)) in states.iter().enumerate() {
            if i % ROWS_PER_LOOK == 0 && !watch(1.0) {
                return Err(LogError::Stopped { path: file.path }.into());
            }
            push_state(&mut rows, *time_ns, state);
            match sensors.get(i) {
                Some((_, sensors)) => rows.push(sensors.sensed(vehicle).map_err(damaged)?.values()),
                None => rows.push(unknown.iter().copied()),
            }
            rows.push(own.row(i));
            push_wheels(&mut rows, state, vehicle.wheel.len());
        }
        let (frame_time_s, frames) = frames.of(vehicle).map_err(damaged)?;
        // A run that was killed has none.
        let outcome = file
            .outcome
            .unwrap_or_else(|| Outcome::unfinished(&file.scenario));
        Ok(Self {
            trace: rows.finish(outcome),
            frame_time_s,
            frames,
            odometry,
            ground_truth,
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

/// What no controller would be allowed: a name that is there twice, or that of a column that every
/// log has, would be read in its place.
pub(crate) fn check_names(names: &[String]) -> Result<(), String> {
    let twice = |(i, name): (usize, &String)| names[..i].contains(name);
    let taken = |name: &String| COMMON.contains(&name.as_str()) || name.starts_with("wheel_");
    if names.len() > MOST_SIGNALS || names.iter().enumerate().any(twice) || names.iter().any(taken) {
        return Err(format!(
            "{}: {} names, allowed: up to {MOST_SIGNALS} different names, none of a column that every log has",
            topic::CONTROLLER_SIGNALS,
            names.len()
        ));
    }
    Ok(())
}

/// What only the run's controller said.
#[derive(Default)]
struct Own {
    names: Vec<String>,
    times_ns: Vec<u64>,
    /// Row after row, each with one number per name.
    values: Vec<f64>,
}

impl Own {
    fn add(&mut self, time_ns: u64, message: ControllerSignals) -> Result<(), String> {
        let topic = topic::CONTROLLER_SIGNALS;
        if self.times_ns.is_empty() {
            check_names(&message.name)?;
            self.names = message.name;
        } else if self.names != message.name {
            return Err(format!("{topic}: a message with other signals than the first"));
        }
        if self.names.len() != message.value.len() {
            let (names, values) = (self.names.len(), message.value.len());
            return Err(format!(
                "{topic}: a message with {names} names and {values} values"
            ));
        }
        self.times_ns.push(time_ns);
        self.values.extend(message.value);
        Ok(())
    }

    /// One number per name; NaN if the message is missing.
    fn row(&self, i: usize) -> impl Iterator<Item = f64> + '_ {
        let count = self.names.len();
        (0..count).map(move |k| self.values.get(i * count + k).copied().unwrap_or(f64::NAN))
    }
}

/// One message a state, or none at all: else there would be columns out of nothing. Of a run that
/// was killed the last may be missing.
fn one_a_state(topic: &str, times_ns: &[u64], states_ns: &[u64], complete: bool) -> Result<(), String> {
    let (found, states) = (times_ns.len(), states_ns.len());
    let all = found == states || (!complete && found + 1 == states);
    if found == 0 || all && times_ns == &states_ns[..found] {
        return Ok(());
    }
    let state = topic::VEHICLE_STATE;
    Err(format!("{found} messages on {topic}, but {states} on {state}"))
}

fn push_state(rows: &mut Rows, time_ns: u64, state: &VehicleState) {
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
    rows.push(planar(&state.estimated_twist));
    rows.push([state.common_factor]);
}

fn push_wheels(rows: &mut Rows, state: &VehicleState, wheels: usize) {
    for k in 0..LOGGED_SIGNALS {
        // As many as the vehicle has, whatever a message holds.
        let signal = |i| {
            state
                .wheels
                .get(i)
                .map_or(f64::NAN, |wheel: &WheelState| wheel.signals[k])
        };
        rows.push((0..wheels).map(signal));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{LogRun, RunLog};
    use omni_core::{Policy, Readings};
    use omni_sim::Run;
    use omni_sim::controller::AnyController;

    #[test]
    fn frames_and_columns_are_those_of_the_run() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("x.mcap");
        let shorter = omni_config::Override::new("duration_s", 2.0);
        let scenario = Scenario::load("step", &[shorter]).expect("built-in");
        let controller = AnyController::new(&scenario).expect("valid");
        let log = RunLog::create(&path, &scenario, &controller).expect("writable");
        let mut seen = Vec::new();
        Run::new(&scenario)
            .controller(controller)
            .watch(|simulation, _| {
                seen.push(simulation.observation().clone());
                Ok::<(), Error>(())
            })
            .log::<Error>(log)
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

    /// Pushes with what is missing of 3 rad/s, and says what that was.
    struct Push(f64);

    impl Policy<f64> for Push {
        fn reset(&mut self) {}

        fn step(&mut self, readings: &Readings<'_, f64>, torques_n_m: &mut [f64]) {
            self.0 = 3.0 - readings.wheels_rad_s[0];
            torques_n_m[0] = 0.1 * self.0;
        }

        fn name(&self) -> &str {
            "push"
        }

        fn signal_name(&self, index: usize) -> Option<&str> {
            ["missing_rad_s", "third"].get(index).copied()
        }

        fn signals(&self, values: &mut [f64]) {
            values.copy_from_slice(&[self.0, self.0 / 3.0]);
        }
    }

    fn pushed(keys: &[&str]) -> (tempfile::TempDir, std::path::PathBuf, Trace) {
        let keys: Vec<_> = keys
            .iter()
            .map(|key| omni_config::Override::parse(key).expect("KEY=VALUE"))
            .collect();
        let scenario = Scenario::load("flat", &keys).expect("built-in");
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("x.mcap");
        let controller = AnyController::own(&scenario, Box::new(Push(0.0))).expect("valid");
        let log = RunLog::create(&path, &scenario, &controller).expect("writable");
        let trace = Run::new(&scenario)
            .controller(controller)
            .log::<Error>(log)
            .expect("runs");
        (folder, path, trace)
    }

    #[test]
    fn own_signals_come_back_in_every_bit_and_the_log_names_the_policy() {
        let (_folder, path, trace) = pushed(&["duration_s=0.3"]);
        let logged = LoggedRun::read(&path).expect("a log");
        for name in ["missing_rad_s", "third"] {
            let (read, run) = (logged.trace.column(name), trace.column(name));
            assert_eq!(read.map(<[f64]>::len), Some(300));
            assert_eq!(read, run);
        }
        assert_eq!(logged.trace.column("missing_rad_s").map(|c| c[0]), Some(3.0)); // at rest
        assert_eq!(logged.file.run["policy"], "push");
        assert_eq!(logged.file.counts["/controller_signals"], 300);
        let refused = crate::replay(&path, &[])
            .expect_err("its controller is not there")
            .to_string();
        assert!(
            refused.ends_with(
                "x.mcap: its controller, push, is not in the log, allowed: logs of omnistep's own controllers"
            ),
            "{refused}"
        );
    }

    #[test]
    fn own_signals_are_as_rare_as_the_states_and_no_topic_where_there_are_none() {
        let (_folder, path, _) = pushed(&["duration_s=0.3", "log.vehicle_state_hz=100"]);
        let logged = LoggedRun::read(&path).expect("a log");
        let counts = &logged.file.counts;
        // The first period, and then one in ten.
        assert_eq!(
            (counts["/vehicle_state"], counts["/controller_signals"]),
            (31, 31)
        );
        let keys = ["duration_s=0.1", "control.policy=independent"];
        let keys = keys.map(|key| omni_config::Override::parse(key).expect("KEY=VALUE"));
        let scenario = Scenario::load("flat", &keys).expect("built-in");
        let controller = AnyController::new(&scenario).expect("valid");
        let log = RunLog::create(&path, &scenario, &controller).expect("writable");
        Run::new(&scenario)
            .controller(controller)
            .log::<Error>(log)
            .expect("runs");
        let counts = LoggedRun::read(&path).expect("a log").file.counts;
        assert!(!counts.contains_key("/controller_signals") && counts["/vehicle_state"] == 100);
    }

    #[test]
    fn own_signals_that_do_not_fit_the_states_are_damage() {
        let message = |names: &[&str], values: &[f64]| ControllerSignals {
            name: names.iter().map(|name| (*name).to_owned()).collect(),
            value: values.to_vec(),
            ..ControllerSignals::default()
        };
        for names in [&["a", "a"][..], &["time_s"], &["wheel_1_applied_n_m"]] {
            assert!(
                Own::default()
                    .add(1, message(names, &[1.0; 2][..names.len()]))
                    .is_err(),
                "{names:?}"
            );
        }
        let mut own = Own::default();
        own.add(1, message(&["a", "b"], &[1.0, 2.0])).expect("the first");
        assert!(own.add(2, message(&["a"], &[1.0])).is_err());
        assert!(own.add(2, message(&["a", "b"], &[1.0])).is_err());
        let fits =
            |states_ns: &[u64], complete| one_a_state("/x", &own.times_ns, states_ns, complete).is_ok();
        assert!(fits(&[1], true));
        assert!(!fits(&[2], true)); // another time
        assert!(!fits(&[1, 2], true));
        assert!(fits(&[1, 2], false)); // killed between the two
        assert!(!fits(&[1, 2, 3], false));
        assert!(own.row(1).all(f64::is_nan) && own.row(0).eq([1.0, 2.0]));
    }
}
