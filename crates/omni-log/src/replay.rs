//! Replay: the controller of a logged run, run again with the logged measurements.

use std::path::Path;

use omni_config::{Override, Scenario};
use omni_core::BodyTwist;
use omni_sim::controller::{AnyController, ControlSample};
use omni_sim::{ControlLoop, Sensed, WheelSignal};

use crate::ros2::{Sensors, Twist, VehicleState};
use crate::{Error, LogError, LogFile, LogMessage, read_log, topic};

/// A difference between the present controller and the log.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Difference {
    /// End of the control period \[ns\].
    pub time_ns: u64,
    /// Number of the control period, from 0.
    pub period: u64,
    /// The wheel; none for a signal of the whole vehicle.
    pub wheel: Option<String>,
    /// The signal, as `applied_n_m`.
    pub signal: &'static str,
    /// The log's value.
    pub logged: f64,
    /// The controller's value.
    pub replayed: f64,
}

/// Comparison of a wheel's torque.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct WheelReplay {
    /// The wheel.
    pub wheel: String,
    /// Control periods in which the log has its torque: all of them but of a recording.
    pub compared: u64,
    /// Root mean square of the logged torque \[N.m\].
    pub logged_rms_n_m: f64,
    /// And of the replayed one \[N.m\].
    pub replayed_rms_n_m: f64,
    /// Largest difference of the two \[N.m\].
    pub largest_n_m: f64,
    /// When that was \[ns\].
    pub largest_at_ns: u64,
}

/// A log replayed.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Replay {
    /// The log.
    pub file: LogFile,
    /// The policy that was replayed.
    pub policy: String,
    /// Control periods.
    pub periods: u64,
    /// Those in which a compared signal differs in any bit.
    pub differing: u64,
    /// The first difference.
    pub first: Option<Difference>,
    /// Control periods in which a recording has no command: the controller receives the last command.
    pub without_command: u64,
    /// Control periods in which a recording lacks the velocity of a wheel: for the controller no reading arrived.
    pub without_measurement: u64,
    /// Torques, wheel by wheel.
    pub wheels: Vec<WheelReplay>,
}

/// Replays the measurements of a log through its scenario's controller, or with other keys (`control.policy`,
/// `vehicle.gains...`), period by period, and compares the controller's signals of each wheel, the common factor and
/// the estimated twist with the log, bit for bit; not `/controller_signals` nor the limited command. The vehicle's
/// motion is unchanged: the result is the torque that the controller would have commanded. Of a
/// [`Recording`](crate::Recording) only torques are compared, if it contains them.
///
/// # Errors
/// As [`read_log`]; [`LogError::Lacks`] if the log lacks `/vehicle_state` or `/sensors` in a control period, or its
/// controller was the user's own; as [`AnyController::new`].
pub fn replay(path: impl AsRef<Path>, overrides: &[Override]) -> Result<Replay, Error> {
    let path = path.as_ref();
    let inputs = Inputs::read(path)?;
    let mut scenario = inputs
        .file
        .scenario
        .with(&path.display().to_string(), overrides)?;
    let sensed: Result<Vec<_>, _> = inputs
        .sensors
        .iter()
        .map(|(_, read)| read.sensed(scenario.vehicle()))
        .collect();
    let sensed = sensed.map_err(|reason| LogError::damaged(path, reason))?;
    if inputs.file.recorded && scenario.auto_policy().is_some() && !knows_the_body(&sensed, &scenario.sensors)
    {
        scenario = scenario.with_loops("without readings of hinges and inertial measurement unit")?;
    }
    inputs.check(path, &scenario, &sensed)?;
    inputs.compare(&scenario, &sensed)
}

/// What a log has for its controller, and what it says that the controller made of it.
struct Inputs {
    file: LogFile,
    states: Vec<(u64, VehicleState)>,
    sensors: Vec<(u64, Sensors)>,
}

impl Inputs {
    /// Reads a log that has both every control period.
    fn read(path: &Path) -> Result<Self, Error> {
        let (mut states, mut sensors) = (Vec::new(), Vec::new());
        let file = read_log(path, |time_ns, message| {
            match message {
                LogMessage::VehicleState(state) => states.push((time_ns, state)),
                LogMessage::Sensors(read) => sensors.push((time_ns, read)),
                _ => {}
            }
            Ok(())
        })?;
        if file.own_controller {
            let policy = file.run.get("policy").map_or("a custom one", String::as_str);
            let what = format!(
                "its controller, {}, is not in the log, allowed: logs of omnistep's own controllers",
                omni_config::shortened(policy)
            );
            return Err(LogError::lacks(path, what).into());
        }
        let period_ns = file.scenario.control.period_us * 1000;
        let mut until_ns = file.until_ns;
        if !file.complete && states.len() == sensors.len() + 1 {
            // Of a run that was killed the last message may be missing.
            states.pop();
            until_ns = until_ns.saturating_sub(period_ns);
        }
        if sensors.is_empty() && !states.is_empty() {
            let topic = topic::SENSORS;
            let what =
                format!("no {topic}, which has what the controller read, allowed: a log of this version");
            return Err(LogError::lacks(path, what).into());
        }
        let of_states = first_missing(states.iter().map(|(time_ns, _)| *time_ns), period_ns, until_ns);
        let of_sensors = first_missing(sensors.iter().map(|(time_ns, _)| *time_ns), period_ns, until_ns);
        for (topic, missing) in [(topic::VEHICLE_STATE, of_states), (topic::SENSORS, of_sensors)] {
            if let Some(missing_ns) = missing {
                let what = format!(
                    "no {topic} at t = {} s, but replay needs one every control period: run it without \
                     log.vehicle_state_hz",
                    missing_ns as f64 / 1e9
                );
                return Err(LogError::lacks(path, what).into());
            }
        }
        Ok(Self {
            file,
            states,
            sensors,
        })
    }

    /// Refuses what the controller of a scenario cannot be fed with.
    fn check(&self, path: &Path, scenario: &Scenario, sensed: &[Sensed]) -> Result<(), Error> {
        let wheels = scenario.vehicle().wheel.len();
        if let Some((_, state)) = self.states.iter().find(|(_, state)| state.wheels.len() != wheels) {
            let found = state.wheels.len();
            let reason = format!("{found} wheels in /vehicle_state, {wheels} in the scenario");
            return Err(LogError::damaged(path, reason).into());
        }
        if !self.file.recorded {
            return Ok(());
        }
        if scenario.has_traction() && !knows_the_body(sensed, &scenario.sensors) {
            let (readings, with) = match scenario.vehicle().hinge.is_empty() {
                true => ("gyro and attitude", "them ([gyro] and [attitude] of the map)"),
                false => ("hinges and inertial measurement unit", "both"),
            };
            let what = format!(
                "no readings of {readings}, but {} needs them, allowed: a recording with {with}, or a policy of wheel speed \
                 loops",
                scenario.control.law()
            );
            return Err(LogError::lacks(path, what).into());
        }
        let mut both = self.states.iter().zip(sensed);
        let silent = both.find(|(_, sensed)| sensed.gyro_rad_s.is_nan());
        if let Some(((time_ns, _), _)) = silent.filter(|_| scenario.heading_hold.is_some()) {
            let what = format!(
                "no gyro reading at t = {} s, but control.heading_hold needs one, allowed: a log with gyro readings \
                 throughout, or no heading hold",
                *time_ns as f64 / 1e9
            );
            return Err(LogError::lacks(path, what).into());
        }
        Ok(())
    }

    /// Feeds a scenario's controller, and compares what it makes of it.
    fn compare(self, scenario: &Scenario, sensed: &[Sensed]) -> Result<Replay, Error> {
        let recorded = self.file.recorded;
        let mut control = ControlLoop::new(scenario, AnyController::new(scenario)?);
        let mut sample = ControlSample::default();
        let (mut differing, mut first) = (0, None);
        let (mut without_command, mut without_measurement) = (0, 0);
        let mut asked = BodyTwist::ZERO;
        let names = scenario.vehicle().wheel.iter().map(|wheel| wheel.name.clone());
        let mut wheels: Vec<_> = names.map(Sums::new).collect();
        for (period, ((time_ns, state), sensed)) in self.states.iter().zip(sensed).enumerate() {
            let commanded = planar(&state.asked_twist);
            // A recording may not know; the controller gets its last command.
            if recorded && commanded.to_array().iter().any(|part| part.is_nan()) {
                without_command += 1;
            } else {
                asked = commanded;
            }
            let silent = sensed.wheels_rad_s.iter().any(|measured| measured.is_nan());
            without_measurement += u64::from(recorded && silent);
            control.step(&asked, sensed, &mut sample)?;
            let differs = if recorded {
                None
            } else {
                difference(state, &sample)
            };
            if let Some((wheel, signal, [logged, replayed])) = differs {
                differing += 1;
                first.get_or_insert(Difference {
                    time_ns: *time_ns,
                    period: period as u64,
                    wheel,
                    signal,
                    logged,
                    replayed,
                });
            }
            for (sums, (logged, replayed)) in wheels.iter_mut().zip(state.wheels.iter().zip(&sample.wheels)) {
                // A recording may know the torques by their currents alone, or not at all.
                let mut torque_n_m = logged.signal("applied_n_m");
                if recorded && torque_n_m.is_nan() {
                    torque_n_m = logged.signal("torque_n_m");
                }
                if !(recorded && torque_n_m.is_nan()) {
                    sums.add(*time_ns, torque_n_m, replayed.applied_n_m);
                }
            }
        }
        Ok(Replay {
            policy: scenario.control.law(),
            periods: self.states.len() as u64,
            differing,
            first,
            without_command,
            without_measurement,
            wheels: wheels.into_iter().map(Sums::finish).collect(),
            file: self.file,
        })
    }
}

/// The end of the first control period without a message, if there is one before the log's end \[ns\].
fn first_missing(mut found: impl Iterator<Item = u64>, period_ns: u64, until_ns: u64) -> Option<u64> {
    let missing = (1..)
        .map(|k| k * period_ns)
        .find(|expected| found.next() != Some(*expected))?;
    // The first period that is missing is the one after the last message of all, and there is one before it.
    (missing <= until_ns.max(period_ns)).then_some(missing)
}

/// Has every sensor that traction control reads, and that the scenario has, a reading at some time?
fn knows_the_body(sensed: &[Sensed], sensors: &omni_config::Sensors) -> bool {
    let some = |value: &dyn Fn(&Sensed) -> f64| sensed.iter().any(|sensed| value(sensed).is_finite());
    let hinges = sensed.first().map_or(0, |first| first.hinges_rad.len());
    let imu: [fn(&Sensed) -> f64; 5] = [
        |s| s.imu.rate_rad_s[0],
        |s| s.imu.rate_rad_s[1],
        |s| s.imu.rate_rad_s[2],
        |s| s.imu.roll_rad,
        |s| s.imu.pitch_rad,
    ];
    (sensors.no_imu || imu.iter().all(|value| some(value)))
        && (sensors.no_hinge_encoders
            || (0..hinges).all(|i| some(&|s| s.hinges_rad[i]) && some(&|s| s.hinges_rad_s[i])))
}

fn planar(twist: &Twist) -> BodyTwist<f64> {
    BodyTwist {
        vx_m_s: twist.linear.x,
        vy_m_s: twist.linear.y,
        wz_rad_s: twist.angular.z,
    }
}

/// The first signal that differs in any bit: its wheel, its name, what the log says and what the controller says.
fn difference(
    state: &VehicleState,
    sample: &ControlSample,
) -> Option<(Option<String>, &'static str, [f64; 2])> {
    let differ = |[a, b]: [f64; 2]| a.to_bits() != b.to_bits();
    for (logged, replayed) in state.wheels.iter().zip(&sample.wheels) {
        for (signal, logged_value) in WheelSignal::logged().into_iter().zip(&logged.signals) {
            let Some(value) = signal.of_control(replayed) else {
                continue; // of the physics
            };
            let both = [*logged_value, value];
            if differ(both) {
                return Some((Some(logged.name.clone()), signal.name, both));
            }
        }
    }
    let (estimated, own) = (planar(&state.estimated_twist), &sample.estimated);
    [
        ("common_factor", [state.common_factor, sample.common_factor]),
        ("estimated_vx_m_s", [estimated.vx_m_s, own.vx_m_s]),
        ("estimated_vy_m_s", [estimated.vy_m_s, own.vy_m_s]),
        ("estimated_wz_rad_s", [estimated.wz_rad_s, own.wz_rad_s]),
    ]
    .into_iter()
    .find(|(_, both)| differ(*both))
    .map(|(name, both)| (None, name, both))
}

/// A wheel's torques, summed up.
struct Sums {
    wheel: String,
    count: u64,
    logged: f64,
    replayed: f64,
    largest: f64,
    largest_at_ns: u64,
}

impl Sums {
    fn new(wheel: String) -> Self {
        Self {
            wheel,
            count: 0,
            logged: 0.0,
            replayed: 0.0,
            largest: 0.0,
            largest_at_ns: 0,
        }
    }

    fn add(&mut self, time_ns: u64, logged: f64, replayed: f64) {
        self.count += 1;
        self.logged += logged * logged;
        self.replayed += replayed * replayed;
        let off = (logged - replayed).abs();
        if off > self.largest {
            (self.largest, self.largest_at_ns) = (off, time_ns);
        }
    }

    fn finish(self) -> WheelReplay {
        let rms = |sum: f64| (sum / self.count.max(1) as f64).sqrt();
        WheelReplay {
            compared: self.count,
            logged_rms_n_m: rms(self.logged),
            replayed_rms_n_m: rms(self.replayed),
            largest_n_m: self.largest,
            largest_at_ns: self.largest_at_ns,
            wheel: self.wheel,
        }
    }
}
