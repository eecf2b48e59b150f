//! A drive whose loops are traction control.

use super::config::DriveInput;
use super::model::Drive;
use super::sample::DriveSample;
use super::state::DriveState;
use crate::constants::constant_struct;
use crate::geometry::BodyTwist;
use crate::policy::{Imu, Readings};
use crate::traction::{Supervised, SupervisedState, Supervisor, SupervisorState, Traction, TractionSample};
use crate::{ConfigError, Real};

/// A [`Drive`] with traction control in place of the wheels' loops: everything around them is the drive's.
///
/// Wheels that the fault monitor excludes, and wheels without a reading, get no torque and do not count for the speed.
/// `torque_ranges` of the input also apply here. In a stop nothing is tried any more: no back-off, no run-up.
///
/// ```
/// use omni_core::drive::{BodyReadings, TractionDrive, TractionDriveState};
/// use omni_core::{BodyTwist, DriveInput, DriveMode, WheelVelocities};
/// # use omni_core::examples::{drive, supervisor, traction};
/// let drive = TractionDrive::new(drive()?, supervisor()?, traction()?)?;
/// let mut state = TractionDriveState::new(&drive);
/// let ahead = BodyTwist { vx_m_s: 0.3, ..BodyTwist::ZERO };
/// let mut input = DriveInput::measured(&WheelVelocities::zero()).with_command(ahead);
/// input.readings_rad_s[3] = None; // no reading of wheel 4 arrived
/// let sample = drive.step(&mut state, &input, &BodyReadings::none());
/// assert_eq!((sample.drive.mode, sample.drive.wheels.applied.n_m[3]), (DriveMode::Degraded, 0.0));
/// assert!(sample.drive.wheels.applied.n_m[0] > 0.0); // the others drive on
/// assert!((sample.traction.target_m_s - 4.0 * 1e-3).abs() < 1e-12);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct TractionDrive<R, const N: usize> {
    drive: Drive<R, N>,
    supervisor: Supervisor<R, N>,
    traction: Traction<R, N>,
}

constant_struct!(TractionDrive<R, const N> { drive: Drive<R, N>, supervisor: Supervisor<R, N>, traction: Traction<R, N> });

/// Measured motion of a vehicle's bodies, for [`TractionDrive::step`].
///
/// ```
/// use omni_core::drive::BodyReadings;
/// use omni_core::policy::Imu;
/// let mut read = BodyReadings::none();
/// (read.hinges_rad, read.hinges_rad_s, read.imu) = (&[0.1, 0.0], &[0.0, 0.0], Imu::level());
/// assert_eq!((read.hinges_rad[0], read.imu.pitch_rad), (0.1, 0.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct BodyReadings<'a, R> {
    /// Angle of every hinge \[rad\], in the vehicle's order; empty if none are read.
    pub hinges_rad: &'a [R],
    /// Their rates \[rad/s\].
    pub hinges_rad_s: &'a [R],
    /// Inertial measurement unit of the base.
    pub imu: Imu<R>,
    /// Height of the edge that a wheel has climbed in this period \[m\]; 0 if none has, or if nothing measures it.
    pub climbed_m: R,
}

impl<R: Real> BodyReadings<'_, R> {
    /// Neither hinges nor a unit: traction control does with the wheels' encoders.
    ///
    /// ```
    /// let none = omni_core::drive::BodyReadings::<f64>::none();
    /// assert_eq!(none.hinges_rad.len(), 0);
    /// assert!(none.imu.pitch_rad.is_nan());
    /// ```
    #[must_use]
    pub fn none() -> Self {
        Self {
            hinges_rad: &[],
            hinges_rad_s: &[],
            imu: Imu::silent(),
            climbed_m: R::zero(),
        }
    }
}

/// The state of a [`TractionDrive`].
///
/// ```
/// use omni_core::drive::TractionDriveState;
/// let state = TractionDriveState::new(&omni_core::examples::traction_drive()?);
/// assert_eq!((state.supervisor().retries(), state.drive.odometry.pose().x_m), (0, 0.0));
/// assert!(size_of::<TractionDriveState<f32, 7>>() < 3072); // bytes
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(deserialize = "R: Real + serde::Deserialize<'de>"))
)]
pub struct TractionDriveState<R, const N: usize> {
    /// The state around the loops: safe stops end here, faults and the pose are read here.
    pub drive: DriveState<R, N>,
    supervised: SupervisedState<R, N>,
}

impl<R: Real, const N: usize> TractionDriveState<R, N> {
    /// A fresh start.
    #[must_use]
    pub fn new(drive: &TractionDrive<R, N>) -> Self {
        Self {
            drive: DriveState::new(&drive.drive),
            supervised: SupervisedState::new(),
        }
    }

    /// A start after a [`Drive`] with this state, while the vehicle moves with `twist`: all that is
    /// around the loops goes on, and so does a hold at rest.
    ///
    /// ```
    /// use omni_core::drive::TractionDriveState;
    /// use omni_core::{BodyTwist, DriveState};
    /// # let drive = omni_core::examples::traction_drive()?;
    /// let mut loops = DriveState::new(drive.drive());
    /// loops.control.integral_n_m = [0.3; 4];
    /// let state = TractionDriveState::after(&loops, &BodyTwist::ZERO).drive();
    /// assert_eq!(state.control.integral_n_m, [0.0; 4]); // loops start afresh
    /// assert_eq!(state.odometry, loops.odometry); // what is around them goes on
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn after(drive: &DriveState<R, N>, twist: &BodyTwist<R>) -> Self {
        Self {
            drive: *drive,
            supervised: SupervisedState::after(&drive.control, twist),
        }
    }

    /// The state with which a [`Drive`] goes on after this one.
    ///
    /// ```
    /// use omni_core::drive::TractionDriveState;
    /// # let drive = omni_core::examples::traction_drive()?;
    /// let mut state = TractionDriveState::new(&drive);
    /// state.drive.control.integral_n_m = [0.3; 4]; // of loops that are not used
    /// assert_eq!(state.drive().control.integral_n_m, [0.0; 4]);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[must_use]
    pub fn drive(&self) -> DriveState<R, N> {
        DriveState {
            control: self.supervised.loops(),
            ..self.drive
        }
    }

    /// Phase of the supervisor.
    #[must_use]
    pub fn supervisor(&self) -> &SupervisorState<R> {
        &self.supervised.supervisor
    }
}

/// Every signal of one step of a [`TractionDrive`].
///
/// ```
/// use omni_core::drive::{BodyReadings, TractionDriveState};
/// use omni_core::{DriveInput, WheelVelocities};
/// # let drive = omni_core::examples::traction_drive()?;
/// let input = DriveInput::measured(&WheelVelocities { rad_s: [5.0; 4] });
/// let sample = drive.step(&mut TractionDriveState::new(&drive), &input, &BodyReadings::none());
/// assert_eq!(sample.drive.wheels, sample.traction.wheels);
/// assert!((sample.drive.slip.estimated.vx_m_s - 0.5).abs() < 1e-12);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct TractionDriveSample<R, const N: usize> {
    /// The sample around the loops; `drive.wheels` comes from the control law.
    pub drive: DriveSample<R, N>,
    /// The law.
    pub traction: TractionSample<R, N>,
}

impl<R: Real, const N: usize> TractionDrive<R, N> {
    /// Traction control inside `drive`, whose own loops are not used but for how their torque ends.
    ///
    /// # Errors
    /// `period_s`, if the control law's period differs from the drive's period.
    pub fn new(
        drive: Drive<R, N>,
        supervisor: Supervisor<R, N>,
        traction: Traction<R, N>,
    ) -> Result<Self, ConfigError> {
        for period_s in [traction.period_s(), supervisor.config().period_s] {
            if period_s != drive.period_s {
                let allowed = "that of the drive";
                return Err(ConfigError::new("period_s", period_s.as_f64(), allowed));
            }
        }
        Ok(Self {
            drive,
            supervisor,
            traction,
        })
    }

    /// The part around the loops.
    #[must_use]
    pub fn drive(&self) -> &Drive<R, N> {
        &self.drive
    }

    /// One period, as [`Drive::step`]; `body` is the measured motion of the bodies. O(N).
    ///
    /// ```
    /// use omni_core::drive::{BodyReadings, TractionDriveState};
    /// use omni_core::{BodyTwist, DriveInput, WheelVelocities};
    /// # let drive = omni_core::examples::traction_drive()?;
    /// let mut state = TractionDriveState::new(&drive);
    /// let ahead = BodyTwist { vx_m_s: 0.3, ..BodyTwist::ZERO };
    /// // Every encoder is stuck at 5 rad/s. After an emergency stop the motors pull for half a second at most.
    /// let mut input = DriveInput::measured(&WheelVelocities { rad_s: [5.0; 4] }).with_command(ahead);
    /// input.emergency = true;
    /// let torques = [(); 501].map(|()| drive.step(&mut state, &input, &BodyReadings::none()).drive.wheels.applied.n_m);
    /// assert!(torques[0][0] < 0.0);
    /// assert_eq!(torques[500], [0.0; 4]);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn step(
        &self,
        state: &mut TractionDriveState<R, N>,
        input: &DriveInput<R, N>,
        body: &BodyReadings<'_, R>,
    ) -> TractionDriveSample<R, N> {
        let mut traction = TractionSample::zero();
        let supervised = &mut state.supervised;
        supervised.traction.watched = self.drive.faults.judges_standing();
        let mut sample = DriveSample::zero();
        self.drive
            .step_with(&mut state.drive, input, &mut sample, |_, asked, wheels| {
                let inputs = &asked.inputs;
                let mut wheels_rad_s = inputs.measured.rad_s;
                if let Some(dropped) = inputs.dropped {
                    for (rad_s, dropped) in wheels_rad_s.iter_mut().zip(dropped) {
                        if *dropped {
                            *rad_s = R::of(f64::NAN);
                        }
                    }
                }
                let mut readings = Readings::new(*asked.twist, &wheels_rad_s);
                (readings.hinges_rad, readings.hinges_rad_s, readings.imu) =
                    (body.hinges_rad, body.hinges_rad_s, body.imu);
                readings.climbed_m = body.climbed_m;
                let law = Supervised {
                    supervisor: Some(&self.supervisor),
                    traction: &self.traction,
                    rest: self.drive.controller.rest().where_held(inputs.holds),
                    within: inputs.within,
                    stops: !inputs.holds,
                };
                law.step(supervised, &readings, &mut traction);
                *wheels = traction.wheels;
            });
        state.drive.faults.doubt(state.supervised.traction.left_out());
        TractionDriveSample {
            drive: sample,
            traction,
        }
    }
}
