//! The estimators of the core, with the noise of a scenario's sensors.

use omni_core::estimate::{Estimator, EstimatorConfig, GroundOdometry, GroundOdometryConfig};
use omni_core::{ConfigError, Kinematics, Real, WheelLayout};

use crate::{Error, Scenario, Sensors};

/// Period of the odometry in three dimensions \[s\]: it takes the mean readings of so long.
const GROUND_PERIOD_S: f64 = 0.005;

impl Scenario {
    /// An estimator of pose and velocity for the scenario's vehicle, in the scalar `R`, with the noise of its
    /// sensors, at least that of [`EstimatorConfig::new`].
    ///
    /// # Errors
    /// [`Error::Key`] if the control period is longer than 0.3 s, or if `N` is not the number of wheels.
    ///
    /// ```
    /// use omni_config::Scenario;
    /// use omni_core::estimate::EstimatorInput;
    /// use omni_core::WheelVelocities;
    /// let estimator = Scenario::load("step", &[])?.estimator::<f32, 7>()?;
    /// let mut state = estimator.start();
    /// let step = estimator.step(&mut state, &EstimatorInput::new(&WheelVelocities::zero()));
    /// assert_eq!((step.readings, state.pose().x_m), (7, 0.0));
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn estimator<R: Real, const N: usize>(&self) -> Result<Estimator<R, N>, Error> {
        let config = self.estimator_config(1);
        let build = || Estimator::new(config, &Kinematics::new(&self.rolling_layout()?)?);
        build().map_err(|error| self.vehicle().refuse(&error))
    }

    /// Odometry in three dimensions for the scenario's vehicle, in the scalar `R`, with the noise of its sensors, and
    /// the number of control periods whose mean readings it takes.
    ///
    /// # Errors
    /// As [`Scenario::estimator`]; [`Error::Key`] for a vehicle of more than 8 hinges.
    ///
    /// ```
    /// let (odometry, periods) = omni_config::Scenario::load("step", &[])?.ground_odometry::<f32, 7>()?;
    /// assert_eq!((odometry.start().pose().position_m, periods), ([0.0; 3], 5)); // 200 Hz of 1 kHz
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn ground_odometry<R: Real, const N: usize>(&self) -> Result<(GroundOdometry<R, N>, u32), Error> {
        let vehicle = self.vehicle();
        let periods = (GROUND_PERIOD_S / self.period_s()).round().max(1.0) as u32;
        let (config, linkage) = (self.estimator_config(periods), vehicle.linkage()?);
        let mut ground = GroundOdometryConfig::new();
        ground.mass_kg = R::of(vehicle.mass_kg());
        let build = || GroundOdometry::new(ground, config, &self.rolling_layout()?, linkage);
        Ok((build().map_err(|error| vehicle.refuse(&error))?, periods))
    }

    /// The vehicle's wheels as they roll under the scenario's wheel model, for odometry: with
    /// [`Wheel::with_rollers`](omni_core::geometry::Wheel::with_rollers).
    ///
    /// # Errors
    /// If `N` is not the number of wheels.
    ///
    /// ```
    /// use omni_config::{Override, Scenario};
    /// let keys = [Override::new("vehicle", "mecanum4"), Override::new("physics.wheel_model", "rollers")];
    /// let scenario = Scenario::load("flat", &keys)?;
    /// let angle = scenario.rolling_layout::<f64, 4>().expect("four wheels").wheels()[0].roller_angle_rad;
    /// assert!((angle.tan().abs() - 1.0206).abs() < 1e-4); // of 45 degrees, with nine rollers
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn rolling_layout<R: Real, const N: usize>(&self) -> Result<WheelLayout<R, N>, ConfigError> {
        let wheels = *self.vehicle().layout()?.wheels();
        let mut index = 0..N;
        WheelLayout::new(wheels.map(|wheel| {
            let rollers = index.next().and_then(|index| self.rollers(index));
            rollers.map_or(wheel, |rollers| wheel.with_rollers(rollers.count as u32))
        }))
    }

    /// For the mean readings of so many control periods.
    fn estimator_config<R: Real>(&self, periods: u32) -> EstimatorConfig<R> {
        let period_s = self.period_s() * f64::from(periods);
        let mut config = EstimatorConfig::new(R::of(period_s));
        let Sensors {
            encoder_noise_rad_s,
            encoder_counts,
            gyro_noise_rad_s,
            accelerometer_noise_m_s2,
            ..
        } = self.sensors;
        let mean = f64::from(periods).sqrt().recip();
        let wheel_rad_s = if encoder_counts > 0.0_f64 {
            // What is counted in a period; `EstimatorConfig::wheel_rad_s` says why.
            std::f64::consts::TAU / encoder_counts / (6.0 * period_s * 0.05).sqrt()
        } else {
            encoder_noise_rad_s * mean
        };
        for (assumed, noise) in [
            (&mut config.wheel_rad_s, wheel_rad_s),
            (&mut config.gyro_rad_s, gyro_noise_rad_s * mean),
            (&mut config.accelerometer_m_s2, accelerometer_noise_m_s2 * mean),
        ] {
            *assumed = R::of(assumed.as_f64().max(noise.min(1000.0)));
        }
        config
    }
}
