//! Replay: the controller of a logged run, run again with the logged measurements.

use std::path::Path;

use omni_config::Override;
use omni_core::BodyTwist;
use omni_sim::controller::{AnyController, ControlSample};
use omni_sim::{ControlLoop, Sensed, WheelSignal};

use crate::ros2::{Twist, VehicleState};
use crate::{Error, LogError, LogFile, LogMessage, read_log};

/// Where the controller of today says something else than the log.
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
    /// What the log says.
    pub logged: f64,
    /// What the controller says.
    pub replayed: f64,
}

/// What became of a wheel's torque.
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
    /// Those in which any signal differs in any bit.
    pub differing: u64,
    /// The first difference.
    pub first: Option<Difference>,
    /// Control periods in which a recording has no command: the controller gets the last one.
    pub without_command: u64,
    /// Control periods in which a recording lacks the velocity of a wheel: for the controller no reading arrived.
    pub without_measurement: u64,
    /// Torques, wheel by wheel.
    pub wheels: Vec<WheelReplay>,
}

/// Feeds the measurements of a log to its scenario's controller, or with other keys (`control.policy`, `vehicle.gains...`), period by
/// period, and compares every signal with the log, bit for bit. The vehicle does not move otherwise than it did: what is shown is
/// what the controller would have commanded. Of a [`Recording`](crate::Recording) only torques are compared, where it has them.
///
/// # Errors
/// As [`read_log`]; [`LogError::Lacks`] where the log has no `/vehicle_state` every control period, or its controller was one of
/// somebody's own; as [`AnyController::new`].
pub fn replay(path: impl AsRef<Path>, overrides: &[Override]) -> Result<Replay, Error> {
    let path = path.as_ref();
    let (mut states, mut signals) = (Vec::new(), Vec::new());
    let file = read_log(path, |time_ns, message| {
        match message {
            LogMessage::VehicleState(state) => states.push((time_ns, state)),
            LogMessage::ControllerSignals(message) => signals.push((time_ns, message)),
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
        return Err(LogError::Lacks {
            path: path.to_path_buf(),
            what,
        }
        .into());
    }
    let period_ns = file.scenario.control.period_us * 1000;
    let missing = (1..)
        .map(|k| k * period_ns)
        .zip(states.iter().map(|(time_ns, _)| Some(*time_ns)).chain([None]))
        .find(|(expected, time_ns)| *time_ns != Some(*expected))
        .map_or(0, |(expected, _)| expected);
    // The first period that is missing is the one after the last message of all, and there is one before it.
    if missing <= file.until_ns || states.is_empty() {
        let what = format!(
            "no /vehicle_state at t = {} s, but replay needs one every control period: record the run without log.vehicle_state_hz",
            missing as f64 / 1e9
        );
        return Err(LogError::Lacks {
            path: path.to_path_buf(),
            what,
        }
        .into());
    }
    let scenario = file.scenario.with(&path.display().to_string(), overrides)?;
    let mut control = ControlLoop::new(&scenario, AnyController::new(&scenario)?);
    let mut sample = ControlSample::default();
    let mut measured = Vec::new();
    let mut sensed = Sensed::at_rest(scenario.vehicle());
    let (mut differing, mut first) = (0, None);
    let (mut without_command, mut without_measurement) = (0, 0);
    let mut asked = BodyTwist::ZERO;
    let names = scenario.vehicle().wheel.iter().map(|wheel| wheel.name.clone());
    let mut wheels: Vec<_> = names.map(Sums::new).collect();
    for (period, (time_ns, state)) in states.iter().enumerate() {
        if state.wheels.len() != wheels.len() {
            return Err(LogError::Damaged {
                path: path.to_path_buf(),
                reason: format!(
                    "{} wheels in /vehicle_state, {} in the scenario",
                    state.wheels.len(),
                    wheels.len()
                ),
            }
            .into());
        }
        measured.clear();
        measured.extend(state.wheels.iter().map(|wheel| wheel.signal("measured_rad_s")));
        sensed.wheels_rad_s.clone_from(&measured);
        sensed.gyro_rad_s = state.gyro_rad_s;
        if scenario.has_traction() {
            let found = signals.get(period).filter(|(at_ns, _)| at_ns == time_ns);
            if !found
                .is_some_and(|(_, found)| sensed.take_signals(scenario.vehicle(), &found.name, &found.value))
            {
                let what = format!(
                    "no readings of hinges and inertial measurement unit at t = {} s, but {} needs them, \
                     allowed: a log of traction or traction_runup, or a policy of wheel speed loops",
                    *time_ns as f64 / 1e9,
                    scenario.control.law()
                );
                return Err(LogError::Lacks {
                    path: path.to_path_buf(),
                    what,
                }
                .into());
            }
        }
        if file.recorded {
            if scenario.heading_hold.is_some() && state.gyro_rad_s.is_nan() {
                let what = format!(
                    "no gyro reading at t = {} s, but control.heading_hold needs one, allowed: a log with gyro readings throughout, or no heading hold",
                    *time_ns as f64 / 1e9
                );
                return Err(LogError::Lacks {
                    path: path.to_path_buf(),
                    what,
                }
                .into());
            }
            without_measurement += u64::from(measured.iter().any(|measured| measured.is_nan()));
        }
        let commanded = planar(&state.asked_twist);
        // A recording may not know; the controller gets its last command.
        if file.recorded && commanded.to_array().iter().any(|part| part.is_nan()) {
            without_command += 1;
        } else {
            asked = commanded;
        }
        control.step(&asked, &sensed, &mut sample)?;
        let differs = if file.recorded {
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
            if file.recorded && torque_n_m.is_nan() {
                torque_n_m = logged.signal("torque_n_m");
            }
            if !(file.recorded && torque_n_m.is_nan()) {
                sums.add(*time_ns, torque_n_m, replayed.applied_n_m);
            }
        }
    }
    Ok(Replay {
        policy: scenario.control.law(),
        periods: states.len() as u64,
        differing,
        first,
        without_command,
        without_measurement,
        wheels: wheels.into_iter().map(Sums::finish).collect(),
        file,
    })
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
