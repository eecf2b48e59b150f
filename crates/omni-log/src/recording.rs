//! Measurements of a real vehicle, written as a log like a run's log.

use std::collections::BTreeMap;
use std::path::Path;

use omni_config::{Scenario, shortened};
use omni_core::BodyTwist;
use omni_sim::{LOGGED_SIGNALS, Sensed, WheelSignal};

use crate::base_pose::{BasePose, unknown_covariance};
use crate::logged_run::check_names;
use crate::message_rates::Pace;
use crate::messages::Sink;
use crate::ros2::{
    ControllerSignals, Header, JointState, Odometry, Point, Pose, PoseWithCovariance, Sensors, StringMessage,
    TwistStamped, TwistWithCovariance, VehicleState, WheelState,
};
use crate::run_log::{MAP, RECORDED, RUN, SCENARIO};
use crate::tree::{Placement, Roots, transforms};
use crate::urdf::{BASE_LINK, ODOM_LINK, WORLD_LINK, ground_urdf, vehicle_urdf, wheel_link};
use crate::{Error, FinishedLog, LogError, LogWriter, topic};

/// Columns of the whole vehicle that `/vehicle_state` has a place for.
const STATE: [&str; 6] = [
    "asked_vx_m_s",
    "asked_vy_m_s",
    "asked_wz_rad_s",
    "estimated_vx_m_s",
    "estimated_vy_m_s",
    "estimated_wz_rad_s",
];
/// And of each wheel, behind `wheel_NAME_`.
const WHEEL: [&str; 4] = ["reference_rad_s", "measured_rad_s", "applied_n_m", "torque_n_m"];
/// True pose of the vehicle, measured from outside: x, y, z \[m\], heading \[rad\].
const TRUTH: [&str; 4] = ["pose_x_m", "pose_y_m", "pose_z_m", "pose_yaw_rad"];
/// And its attitude as a quaternion x, y, z, w.
const ATTITUDE: [&str; 4] = ["pose_qx", "pose_qy", "pose_qz", "pose_qw"];
/// Pose by odometry: x, y \[m\], heading \[rad\].
const ODOMETRY: [&str; 3] = ["odom_x_m", "odom_y_m", "odom_yaw_rad"];

/// Measurements on a vehicle in every control period, by the column names of a [`Trace`](omni_sim::Trace).
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Recording {
    /// Its source, and further metadata of the log, by name: the metadata `run`.
    pub facts: BTreeMap<String, String>,
    /// Its column map: the attachment `map.toml`.
    pub map: String,
    /// One number a control period each, NaN if nothing is known: `asked_*`, `estimated_*`, of wheels
    /// `reference_rad_s`, `measured_rad_s`, `applied_n_m`, `torque_n_m`, and what the sensors said ([`Sensed::names`]).
    /// Others go to `/controller_signals`; of these `pose_*` are on `/ground_truth/odom` too and `odom_*` on `/odom`.
    pub columns: BTreeMap<String, Vec<f64>>,
}

impl Recording {
    /// A recording of these columns, about which nothing is said.
    #[must_use]
    pub fn new(columns: BTreeMap<String, Vec<f64>>) -> Self {
        Self {
            facts: BTreeMap::new(),
            map: String::new(),
            columns,
        }
    }

    /// Writes it as a log: the messages of a run, without the forces, which were not measured (`/markers`), and
    /// without an outcome. `/tf` has the base at its true pose where that was measured, else at odometry's, and
    /// no message where neither is known; hinges that were not measured are shown straight. `scenario` says
    /// vehicle, ground and control period, and what a simulation would be given. Row k ends at (k + 1) periods.
    ///
    /// ```
    /// use std::collections::BTreeMap;
    /// use omni_log::{Error, LoggedRun, Recording};
    /// use omni_sim::config::Scenario;
    /// let path = std::env::temp_dir().join(format!("omnistep-recording-{}.mcap", std::process::id()));
    /// let columns = BTreeMap::from([("wheel_1_measured_rad_s".to_owned(), vec![0.5, f64::NAN, 0.7])]);
    /// Recording::new(columns).write(&path, &Scenario::load("flat", &[])?)?;
    /// let logged = LoggedRun::read(&path)?;
    /// assert!(logged.file.recorded && logged.file.outcome.is_none());
    /// let measured = logged.trace.column("wheel_1_measured_rad_s").expect("a column");
    /// assert!(measured[0] == 0.5 && measured[1].is_nan() && measured[2] == 0.7);
    /// # std::fs::remove_file(&path).ok();
    /// # Ok::<(), Error>(())
    /// ```
    ///
    /// # Errors
    /// [`LogError::Lacks`] if columns have different lengths or a name that cannot be, as [`LogWriter::create`] and
    /// [`LogWriter::write`].
    pub fn write(&self, path: impl AsRef<Path>, scenario: &Scenario) -> Result<FinishedLog, Error> {
        let path = path.as_ref();
        let columns = Columns::new(&self.columns, scenario).map_err(|what| LogError::Lacks {
            path: path.to_path_buf(),
            what,
        })?;
        let mut log = LogWriter::create(path)?;
        let (key, value) = RECORDED;
        let own = [
            ("omnistep", omni_sim::VERSION.to_owned()),
            ("scenario", scenario.name.clone()),
            ("vehicle", scenario.vehicle().name.clone()),
            ("policy", RECORDED.1.to_owned()),
            ("engine", RECORDED.1.to_owned()),
            ("seed", scenario.seed.to_string()),
            (key, value.to_owned()),
        ];
        let mut facts = self.facts.clone();
        facts.extend(own.map(|(key, value)| (key.to_owned(), value)));
        log.metadata(RUN, facts)?;
        log.attachment(SCENARIO, "application/toml", scenario.to_toml()?.as_bytes())?;
        log.attachment(MAP, "application/toml", self.map.as_bytes())?;
        let data = vehicle_urdf(scenario.vehicle());
        log.send(topic::ROBOT_DESCRIPTION, 0, &StringMessage { data })?;
        let data = ground_urdf(scenario);
        log.send(topic::TERRAIN, 0, &StringMessage { data })?;
        columns.write(&mut log, scenario)?;
        Ok(log.finish()?)
    }
}

/// The columns, each where it goes.
struct Columns<'a> {
    rows: usize,
    state: [Option<&'a [f64]>; STATE.len()],
    /// Of each wheel in the vehicle's order, as its message has them.
    wheels: Vec<[Option<&'a [f64]>; LOGGED_SIGNALS]>,
    truth: [Option<&'a [f64]>; TRUTH.len()],
    /// The true pose was measured at some time.
    has_truth: bool,
    attitude: [Option<&'a [f64]>; ATTITUDE.len()],
    odometry: [Option<&'a [f64]>; ODOMETRY.len()],
    /// In the order of [`Sensed::names`].
    sensed: Vec<Option<&'a [f64]>>,
    own: Vec<(String, &'a [f64])>,
}

impl<'a> Columns<'a> {
    fn new(columns: &'a BTreeMap<String, Vec<f64>>, scenario: &Scenario) -> Result<Self, String> {
        let rows = columns.values().next().map_or(0, Vec::len);
        if let Some((name, column)) = columns.iter().find(|(_, column)| column.len() != rows) {
            let (name, found) = (shortened(name), column.len());
            return Err(format!(
                "column {name}: {found} rows, allowed: {rows}, as in the other columns"
            ));
        }
        let of = |name: &str| columns.get(name).map(Vec::as_slice);
        let wheels = &scenario.vehicle().wheel;
        let of_wheel = |wheel: &str, signal: &str| format!("wheel_{wheel}_{signal}");
        let sensed = Sensed::names(scenario.vehicle());
        let mut known: Vec<String> = STATE.map(String::from).into();
        known.extend(sensed.iter().cloned());
        for wheel in wheels {
            known.extend(WHEEL.map(|signal| of_wheel(&wheel.name, signal)));
        }
        let own: Vec<_> = columns
            .iter()
            .filter(|(name, _)| !known.contains(name))
            .map(|(name, column)| (name.clone(), column.as_slice()))
            .collect();
        let names: Vec<_> = own.iter().map(|(name, _)| name.clone()).collect();
        check_names(&names)?;
        Ok(Self {
            rows,
            state: STATE.map(of),
            wheels: wheels
                .iter()
                .map(|wheel| {
                    WheelSignal::logged().map(|signal| {
                        let measured = WHEEL.contains(&signal.name);
                        measured
                            .then(|| of(&of_wheel(&wheel.name, signal.name)))
                            .flatten()
                    })
                })
                .collect(),
            truth: TRUTH.map(of),
            has_truth: of(TRUTH[0]).is_some_and(|column| column.iter().any(|x| x.is_finite())),
            attitude: ATTITUDE.map(of),
            odometry: ODOMETRY.map(of),
            sensed: sensed.iter().map(|name| of(name)).collect(),
            own,
        })
    }

    fn write(&self, log: &mut LogWriter, scenario: &Scenario) -> Result<(), LogError> {
        let rates = &scenario.log;
        let mut paces = [
            rates.joint_states_hz,
            rates.odom_hz,
            rates.cmd_vel_hz,
            rates.tf_hz,
        ]
        .map(Pace::hz);
        let mut angles_rad = vec![0.0; self.wheels.len()];
        let mut hinges_rad = vec![0.0; scenario.vehicle().hinge.len()];
        let mut sensed = Sensed::at_rest(scenario.vehicle());
        for row in 0..self.rows {
            let time = (row as u64 + 1) * scenario.control.period_us * 1000;
            let state = self.vehicle_state(row, time, scenario);
            for (angle, wheel) in angles_rad.iter_mut().zip(&state.wheels) {
                let measured_rad_s = wheel.signal("measured_rad_s");
                // As of a run: a wheel without a measurement is shown where it was.
                if measured_rad_s.is_finite() {
                    *angle += measured_rad_s * scenario.period_s();
                }
            }
            let values: Vec<_> = self.sensed.iter().map(|column| at(*column, row)).collect();
            sensed.set_values(&values);
            let turned = sensed.wheels_rad_s.iter_mut().zip(&mut sensed.increments_rad);
            for ((read, increment), wheel) in turned.zip(&state.wheels) {
                *read = wheel.signal("measured_rad_s");
                if !increment.is_finite() {
                    *increment = *read * scenario.period_s();
                }
            }
            for (angle, sensed) in hinges_rad.iter_mut().zip(&sensed.hinges_rad) {
                if sensed.is_finite() {
                    *angle = *sensed;
                }
            }
            log.send(topic::VEHICLE_STATE, time, &state)?;
            log.send(topic::SENSORS, time, &Sensors::new(time, &sensed))?;
            if !self.own.is_empty() {
                log.send(topic::CONTROLLER_SIGNALS, time, &self.own_signals(row, time))?;
            }
            let [joints, odometry, command, frames] = &mut paces;
            if let Some((base, odometry)) = self.base(row)
                && frames.due(time)
            {
                let placement = Placement {
                    base,
                    odometry,
                    hinges_rad: &mut hinges_rad.iter().copied(),
                    wheels_rad: &angles_rad,
                };
                log.send(
                    topic::TF,
                    time,
                    &transforms(scenario.vehicle(), time, Roots::World, placement),
                )?;
            }
            if joints.due(time) {
                log.send(
                    topic::JOINT_STATES,
                    time,
                    &joint_states(&state, &angles_rad, scenario),
                )?;
            }
            if odometry.due(time) {
                if let Some(reckoned) = self.reckoned(row) {
                    log.send(topic::ODOM, time, &placed(time, ODOM_LINK, reckoned))?;
                }
                if let Some(seen) = self.seen(row) {
                    log.send(topic::GROUND_TRUTH, time, &placed(time, WORLD_LINK, seen))?;
                }
            }
            let asked = state.asked_twist;
            if command.due(time) && known([asked.linear.x, asked.linear.y, asked.angular.z]).is_some() {
                let header = Header::new(time, BASE_LINK);
                log.send(topic::CMD_VEL, time, &TwistStamped { header, twist: asked })?;
            }
        }
        Ok(())
    }

    fn vehicle_state(&self, row: usize, time: u64, scenario: &Scenario) -> VehicleState {
        let [vx, vy, wz, e_vx, e_vy, e_wz] = self.state.map(|column| at(column, row));
        let unknown = f64::NAN;
        let wheels = scenario.vehicle().wheel.iter().zip(&self.wheels);
        VehicleState {
            header: Header::new(time, BASE_LINK),
            policy: RECORDED.1.into(),
            asked_twist: BodyTwist::from_array([vx, vy, wz]).into(),
            common_factor: unknown,
            estimated_twist: BodyTwist::from_array([e_vx, e_vy, e_wz]).into(),
            wheels: wheels
                .map(|(wheel, columns)| WheelState {
                    name: wheel.name.clone(),
                    signals: columns.map(|column| at(column, row)),
                })
                .collect(),
        }
    }

    fn own_signals(&self, row: usize, time: u64) -> ControllerSignals {
        ControllerSignals {
            header: Header::new(time, ""),
            name: self.own.iter().map(|(name, _)| name.clone()).collect(),
            value: self.own.iter().map(|(_, column)| column[row]).collect(),
        }
    }

    /// The base in the world and by odometry: the one for the other where only one of them is
    /// known, none if neither is.
    fn base(&self, row: usize) -> Option<(BasePose, BasePose)> {
        let (seen, reckoned) = (self.seen(row), self.reckoned(row));
        // If the true pose was measured, odometry's pose is in a separate frame.
        let base = seen.or(if self.has_truth { None } else { reckoned })?;
        Some((base, reckoned.unwrap_or(base)))
    }

    /// As measured from outside; none if it is not known.
    fn seen(&self, row: usize) -> Option<BasePose> {
        let [x, y, z, yaw] = self.truth.map(|column| at(column, row));
        let [x, y] = known([x, y])?;
        // A pose in the plane has neither height nor tilt.
        let z = if z.is_finite() { z } else { 0.0 };
        let attitude = known(self.attitude.map(|column| at(column, row)));
        let turn = attitude.or_else(|| known([yaw]).map(|[yaw]| about_z(yaw)))?;
        Some(([x, y, z], turn))
    }

    fn reckoned(&self, row: usize) -> Option<BasePose> {
        let [x, y, yaw] = known(self.odometry.map(|column| at(column, row)))?;
        Some(([x, y, 0.0], about_z(yaw)))
    }
}

fn at(column: Option<&[f64]>, row: usize) -> f64 {
    column
        .and_then(|column| column.get(row))
        .copied()
        .unwrap_or(f64::NAN)
}

fn about_z(yaw_rad: f64) -> [f64; 4] {
    [0.0, 0.0, libm::sin(yaw_rad / 2.0), libm::cos(yaw_rad / 2.0)]
}

fn known<const N: usize>(values: [f64; N]) -> Option<[f64; N]> {
    values.iter().all(|value| value.is_finite()).then_some(values)
}

/// A pose whose twist was not measured.
fn placed(time: u64, frame: &str, ([x, y, z], turn): BasePose) -> Odometry {
    let orientation = turn.into();
    let unknown = BodyTwist::from_array([f64::NAN; 3]);
    Odometry {
        header: Header::new(time, frame),
        child_frame_id: BASE_LINK.into(),
        pose: PoseWithCovariance {
            pose: Pose {
                position: Point { x, y, z },
                orientation,
            },
            covariance: unknown_covariance(),
        },
        twist: TwistWithCovariance {
            twist: unknown.into(),
            covariance: unknown_covariance(),
        },
    }
}

/// The wheels; hinges are left out, which the vehicle's encoders need not have.
fn joint_states(state: &VehicleState, angles_rad: &[f64], scenario: &Scenario) -> JointState {
    let wheels = scenario.vehicle().wheel.iter().zip(&state.wheels);
    let mut joints = JointState {
        header: state.header.clone(),
        ..JointState::default()
    };
    for ((wheel, measured), angle) in wheels.zip(angles_rad) {
        joints.name.push(wheel_link(&wheel.name));
        joints.position.push(angle * wheel.gear);
        joints
            .velocity
            .push(measured.signal("measured_rad_s") * wheel.gear);
        joints.effort.push(measured.signal("torque_n_m") / wheel.gear);
    }
    joints
}

#[cfg(test)]
#[path = "recording_tests.rs"]
mod tests;
