//! Traction control of a scenario's vehicle, built from its file.

use omni_core::linkage::MAX_HINGES;
use omni_core::linkage::{CarriedWheel, HingeGeometry, Linkage};
use omni_core::traction::{
    Supervisor, SupervisorConfig, Traction, TractionConfig, TractionPolicy, TractionSensors, TractionWheel,
};
use omni_core::{ConfigError, Coordination, Kinematics, Real};

use crate::control::TractionPreset;
use crate::microseconds::seconds;
use crate::{Error, Gains, Scenario, Vehicle};

/// A supervisor and its law.
pub(crate) type Parts<R, const N: usize> = (Supervisor<R, N>, Traction<R, N>);

/// Speed of run-ups if the vehicle has no limits \[m/s\].
const MOST_M_S: f64 = 1.0;
/// Part of the motors' speed without load up to which wheels are spun.
const SPUN_PART: f64 = 0.9;
/// On Earth \[m/s^2\]: what a vehicle's motors are for.
const GRAVITY_M_S2: f64 = 9.81;
/// Less spin than this \[m/s\] is of no use: 5 rad/s of a wheel of 66 mm.
const LEAST_SPIN_M_S: f64 = 0.33;

impl Scenario {
    /// Whether the controller is traction control (`traction`, `traction_runup`), which has no loops of single wheels.
    ///
    /// ```
    /// use omni_config::Scenario;
    /// let step = Scenario::load("step", &[])?;
    /// assert!(step.with_policy("traction")?.has_traction() && !step.with_policy("scale_torques")?.has_traction());
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn has_traction(&self) -> bool {
        self.control.traction().is_some()
    }

    /// Tries at each row of wheels that the scenario's traction control has; none if the policy is one of the wheels'
    /// loops.
    ///
    /// ```
    /// use omni_config::{Override, Scenario};
    /// assert_eq!(Scenario::load("step", &[Override::new("control.max_retries", 3)])?.max_retries(), Some(3));
    /// assert_eq!(Scenario::load("step", &[])?.with_policy("scale_torques")?.max_retries(), None);
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn max_retries(&self) -> Option<u32> {
        let preset = self.control.traction()?;
        let given = self.control.max_retries;
        Some(given.unwrap_or_else(|| preset.supervisor::<f64>(self.period_s()).retry.retries.into()))
    }

    /// Rejects traction control if only loops of single wheels are possible: `place` states the use, as "allowed
    /// {place}" in the message.
    ///
    /// # Errors
    /// [`Error::Key`] if [`Scenario::has_traction`].
    ///
    /// ```
    /// use omni_config::Scenario;
    /// let traction = Scenario::load("step", &[])?.with_policy("traction")?;
    /// let error = traction.without_traction("here").unwrap_err();
    /// assert!(error.to_string().ends_with(": \"traction\", allowed here: independent, scale_torques, scale_references, shared_integral"));
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn without_traction(&self, place: &str) -> Result<(), Error> {
        if !self.has_traction() {
            return Ok(());
        }
        let loops = Coordination::<f64>::PRESETS.join(", ");
        Err(Error::Key {
            file: format!("scenario {}", self.name),
            key: "control.policy".into(),
            message: format!("{:?}, allowed {place}: {loops}", self.control.policy),
        })
    }

    /// Traction control of the scenario's vehicle, in the scalar `R`; none if its policy is one of the wheels' loops.
    ///
    /// # Errors
    /// As [`Scenario::controller`]; [`Error::Key`] for a vehicle of more than 8 hinges.
    ///
    /// ```
    /// use omni_config::Scenario;
    /// use omni_core::{BodyTwist, Policy, Readings};
    /// let mut policy = Scenario::load("step", &[])?.with_policy("traction")?.traction::<f64, 7>()?.expect("traction");
    /// let ahead = BodyTwist { vx_m_s: 0.3, ..BodyTwist::ZERO };
    /// let mut torques_n_m = [0.0; 7];
    /// policy.step(&Readings::new(ahead, &[0.0; 7]), &mut torques_n_m);
    /// assert!(torques_n_m[3] > 0.0 && torques_n_m[5] == 0.0); // wheel 4 points ahead, wheel 6 across
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn traction<R: Real, const N: usize>(&self) -> Result<Option<TractionPolicy<R, N>>, Error> {
        let Some((supervisor, traction)) = self.traction_parts()? else {
            return Ok(None);
        };
        let policy = TractionPolicy::new(self.limiter()?, supervisor, traction);
        let policy = policy.with_rest(self.control.rest.rule());
        policy.map(Some).map_err(|error| self.vehicle().refuse(&error))
    }

    /// The configuration of [`Scenario::traction`], for firmware.
    pub(crate) fn traction_parts<R: Real, const N: usize>(&self) -> Result<Option<Parts<R, N>>, Error> {
        let Some(preset) = self.control.traction() else {
            return Ok(None);
        };
        let vehicle = self.vehicle();
        let refuse = |error: ConfigError| vehicle.refuse(&error);
        let (gains, period) = (vehicle.gains_at(self.period_s())?, R::of(self.period_s()));
        let (kp, ki) = (R::of(gains.kp_n_m_s_rad), R::of(gains.ki_n_m_rad));
        let mut config = match preset {
            TractionPreset::Traction => TractionConfig::traction(kp, ki, period),
            TractionPreset::TractionRunup => TractionConfig::traction_runup(kp, ki, period),
        };
        config = config.with_sensors(self.traction_sensors());
        let supervisor = self.supervisor(preset.supervisor(self.period_s()));
        let limit = vehicle.motor.limit().map_err(refuse)?;
        let layout = vehicle.layout::<R, N>().map_err(refuse)?; // checks the count
        let wheels = std::array::from_fn(|i| {
            let wheel = &vehicle.wheel[i];
            TractionWheel {
                limit,
                inertia_kg_m2: R::of(wheel.inertia_kg_m2 * wheel.gear * wheel.gear),
                carrier: wheel.carrier().map(R::of),
                place_m: wheel.position_m.map(R::of),
            }
        });
        let built = Traction::new(
            Kinematics::new(&layout).map_err(refuse)?,
            vehicle.linkage()?,
            wheels,
            config,
        );
        let supervisor = Supervisor::new(&wheels.map(|wheel| wheel.place_m), supervisor).map_err(refuse)?;
        Ok(Some((
            supervisor,
            built.map_err(|error| self.refuse_by_key(&error, &gains))?,
        )))
    }

    /// Errors of traction control, by the key of the files that causes them.
    fn refuse_by_key(&self, error: &ConfigError, gains: &Gains) -> Error {
        let (key, value, allowed) = match error.parameter {
            "lag_s" => (
                "actuators.torque_lag_s",
                self.actuators.torque_lag_s,
                error.allowed,
            ),
            "delay_s" => ("sensors.delay_s", seconds(self.sensors.delay_us), error.allowed),
            // It multiplies them.
            "thrust_gain_n_m_s_rad" => ("vehicle.gains.kp_n_m_s_rad", gains.kp_n_m_s_rad, "0 to 4e5"),
            "thrust_integral_n_m_rad" => ("vehicle.gains.ki_n_m_rad", gains.ki_n_m_rad, "0 to 5e5"),
            _ => return self.vehicle().refuse(error),
        };
        Error::Key {
            file: format!("scenario {}", self.name),
            key: key.into(),
            message: format!("{value}, allowed with traction control: {allowed}"),
        }
    }

    /// The scenario's known properties of sensors and motors.
    fn traction_sensors<R: Real>(&self) -> TractionSensors<R> {
        let (given, mut sensors) = (&self.sensors, TractionSensors::perfect());
        // What is made of counts by something else is no multiple of them.
        if given.encoder_velocity.is_none() {
            sensors.encoder_counts = R::of(given.encoder_counts);
        }
        sensors.encoder_noise_rad_s = R::of(given.encoder_noise_rad_s);
        sensors.gyro_noise_rad_s = R::of(given.gyro_noise_rad_s);
        sensors.delay_s = R::of(given.delay_us as f64 * 1e-6);
        sensors.lag_s = R::of(self.actuators.torque_lag_s);
        sensors
    }

    fn supervisor<R: Real>(&self, preset: SupervisorConfig<R>) -> SupervisorConfig<R> {
        let mut config = preset;
        config.max_m_s = match self.vehicle().limits {
            Some(limits) => [limits.vx_m_s, limits.vy_m_s].map(R::of),
            None => [R::of(MOST_M_S); 2],
        };
        if let Some(retries) = self.control.max_retries {
            config.retry.retries = u16::try_from(retries).unwrap_or(u16::MAX);
        }
        if let Some(climbs_m) = self.control.climbs_m {
            config.climbs_m = R::of(climbs_m);
        }
        if let Some(times) = self.weight_thrust() {
            config.weight_thrust = R::of(times);
        }
        let spare = self.spin_to_spare_m_s(config.retry.run_up_m_s.as_f64());
        if spare < config.retry.spin_m_s.as_f64() {
            config.retry.spin_m_s = R::of(if spare < LEAST_SPIN_M_S { 0.0 } else { spare });
            config.retry.spin_more_m_s = R::zero();
        }
        config
    }

    /// Multiple of the largest thrust that pushes with the weight, in the direction that takes more of it; none without
    /// wheels that push.
    fn weight_thrust(&self) -> Option<f64> {
        let vehicle = self.vehicle();
        let (rows, _) = vehicle.actuators().ok()?;
        let force_n = |axis: usize| {
            let largest = rows.iter().fold(0.0, |most, row| f64::max(most, row[axis].abs()));
            let squares: f64 = rows.iter().map(|row| row[axis] * row[axis]).sum();
            vehicle.motor.peak_torque_n_m() * squares / largest
        };
        let weight_n = GRAVITY_M_S2 * vehicle.mass_kg();
        Some(weight_n / f64::min(force_n(0), force_n(1))).filter(|times| times.is_finite())
    }

    /// Speed of the slowest rim beyond a run-up \[m/s\]; infinite if no motor's torque falls with its speed.
    fn spin_to_spare_m_s(&self, run_up_m_s: f64) -> f64 {
        let Some(fastest) = self.vehicle().no_load_rad_s() else {
            return f64::INFINITY;
        };
        let rims = self
            .vehicle()
            .wheel
            .iter()
            .map(|wheel| wheel.gear * wheel.radius_m);
        rims.fold(f64::INFINITY, f64::min) * SPUN_PART * fastest - run_up_m_s
    }

    /// Notes on traction control that the file names, one line each: sensors that the vehicle lacks, motors that are
    /// too slow. Of a policy that was chosen, [`Scenario::auto_policy`] says it.
    ///
    /// ```
    /// use omni_config::{Override, Scenario};
    /// let keys = ["control.policy=traction_runup", "vehicle.motor.slope_n_m_s_rad=0.1", "sensors.no_imu=true"];
    /// let keys = keys.iter().map(|key| Override::parse(key)).collect::<Result<Vec<_>, _>>()?;
    /// let notes = Scenario::load("step", &keys)?.traction_notes();
    /// assert!(notes[0].starts_with("traction_runup without an inertial measurement unit: "));
    /// assert!(notes[1].starts_with("traction_runup with motors of 20.0 rad/s without load: "));
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn traction_notes(&self) -> Vec<String> {
        match self.auto_policy() {
            Some(_) => Vec::new(),
            None => self.missed_by_traction(),
        }
    }

    pub(crate) fn missed_by_traction(&self) -> Vec<String> {
        let Some(preset) = self.control.traction() else {
            return Vec::new();
        };
        let policy = &self.control.policy;
        let mut notes = Vec::new();
        if self.sensors.no_imu {
            notes.push(format!(
                "{policy} without an inertial measurement unit: it takes the base as level and estimates the yaw rate from the wheels"
            ));
        }
        if self.sensors.no_hinge_encoders && !self.vehicle().hinge.is_empty() {
            notes.push(format!(
                "{policy} without hinge encoders: it cannot tell a climbing row from slipping wheels"
            ));
        }
        let wanted = SupervisorConfig::<f64>::traction_runup(self.period_s()).retry;
        let spare = self.spin_to_spare_m_s(wanted.run_up_m_s);
        if preset == TractionPreset::TractionRunup && spare < wanted.spin_m_s {
            let fastest = self.vehicle().no_load_rad_s().unwrap_or(f64::INFINITY);
            let spun = if spare < LEAST_SPIN_M_S {
                "wheels are not spun up before a retry, which is weaker then".to_owned()
            } else {
                format!(
                    "before a retry wheels are spun up by {spare:.2} m/s instead of {:.2}, so that its retries are weaker",
                    wanted.spin_m_s
                )
            };
            notes.push(format!(
                "{policy} with motors of {fastest:.1} rad/s without load: {spun}"
            ));
        }
        notes
    }
}

impl TractionPreset {
    fn supervisor<R: Real>(self, period_s: f64) -> SupervisorConfig<R> {
        match self {
            Self::Traction => SupervisorConfig::traction(R::of(period_s)),
            Self::TractionRunup => SupervisorConfig::traction_runup(R::of(period_s)),
        }
    }
}

impl Vehicle {
    /// The tree of its bodies and what carries its wheels.
    ///
    /// # Errors
    /// [`Error::Key`] for more than 8 hinges, or if `N` is not the number of wheels.
    ///
    /// ```
    /// let linkage = omni_config::Vehicle::load("chugo7")?.linkage::<f64, 7>()?;
    /// assert_eq!(linkage.hinge_count(), 2);
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn linkage<R: Real, const N: usize>(&self) -> Result<Linkage<R, N>, Error> {
        let body = |name: &String| {
            self.body
                .iter()
                .position(|body| body.name == *name)
                .unwrap_or_default()
        };
        if self.hinge.len() > MAX_HINGES {
            return Err(Error::Key {
                file: format!("vehicle {}", self.name),
                key: "hinge".into(),
                message: format!(
                    "{} hinges, allowed: {MAX_HINGES} at most with traction and traction_runup",
                    self.hinge.len()
                ),
            });
        }
        let hinges = self.hinge.iter().map(|hinge| {
            let length = hinge.axis.iter().map(|each| each * each).sum::<f64>().sqrt();
            HingeGeometry {
                parent: body(&hinge.parent),
                child: body(&hinge.child),
                axis: hinge.axis.map(|each| R::of(each / length)),
                anchor_m: hinge.anchor_m.map(R::of),
            }
        });
        let hinges: Vec<_> = hinges.collect();
        if self.wheel.len() != N {
            return Err(self.refuse(&crate::wheel_count_refused(self.wheel.len())));
        }
        let wheels = std::array::from_fn(|i| {
            let wheel = &self.wheel[i];
            let [x, y] = wheel.position_m;
            CarriedWheel {
                body: body(&wheel.body),
                centre_m: [x, y, wheel.radius_m].map(R::of),
            }
        });
        Linkage::new(&hinges, &wheels).map_err(|error| self.refuse(&error))
    }
}
