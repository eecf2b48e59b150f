//! The messages between both sides of a link.

use omni_core::drive::BodyReadings;
use omni_core::linkage::MAX_HINGES;
use omni_core::loops::ControlSample;
use omni_core::{BodyTwist, DriveMode, WheelVelocities};
use serde::{Deserialize, Serialize};

use crate::wire::{Sample, Twist, each, plain};
use crate::{Action, Counters};

/// Version of frames and messages; sides of different versions do not work together.
pub const PROTOCOL_VERSION: u32 = 5;

/// Bytes of a request's frame for `wheels` wheels, 1 to 8, its closing zero included: the buffer that a controller
/// receives into.
///
/// ```
/// assert_eq!(omni_link::request_frame(7), 53);
/// ```
#[must_use]
pub const fn request_frame(wheels: usize) -> usize {
    framed(request(wheels))
}

/// Bytes of the frame of a request with the motion of the bodies, for `wheels` wheels, 1 to 8, its closing zero
/// included: the buffer that a controller with traction control receives into.
///
/// ```
/// assert_eq!(omni_link::request_with_bodies_frame(7), 149);
/// ```
#[must_use]
pub const fn request_with_bodies_frame(wheels: usize) -> usize {
    // Of the base: two vectors and two angles.
    framed(request(wheels) + 2 * 4 * MAX_HINGES + (3 + 3 + 2) * 4)
}

/// Bytes of an answer's frame for `wheels` wheels, 1 to 8, its closing zero included: the buffer
/// that a controller sends from.
///
/// ```
/// assert_eq!(omni_link::answer_frame(7), 405);
/// ```
#[must_use]
pub const fn answer_frame(wheels: usize) -> usize {
    // Of a wheel: 10 numbers and 2 marks of its sample, its residual, and 2 bytes of the drive's report.
    framed(1 + 4 + 1 + 12 + 12 + (10 * 4 + 2) * wheels + 4 + 2 + 12 + 4 * wheels + 1 + 1 + 12 + 2 * wheels)
}

/// A request by itself, with the byte that says what it is.
const fn request(wheels: usize) -> usize {
    1 + 4 + 1 + 1 + 12 + 4 * wheels
}

/// The check, a byte of stuffing for each 254 and one, the closing zero.
const fn framed(body: usize) -> usize {
    body + 4 + (body + 4) / 254 + 1 + 1
}

/// The longest request's frame: 8 wheels, and what the bodies do.
pub const MAX_REQUEST_FRAME: usize = request_with_bodies_frame(8);

/// The longest answer's frame: 8 wheels.
pub const MAX_ANSWER_FRAME: usize = answer_frame(8);

/// Message to the side that has the controller; it answers each.
///
/// ```
/// use omni_link::{MAX_REQUEST_FRAME, ToController, decode, encode};
/// let mut buffer = [0; MAX_REQUEST_FRAME];
/// assert_eq!(encode(&ToController::<4>::Hello, &mut buffer).map(<[u8]>::len), Some(1 + 4 + 2));
/// assert_eq!(decode(&mut buffer), Ok(ToController::<4>::Hello));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum ToController<const N: usize> {
    /// Requests the controller's identity.
    Hello,
    /// One control period.
    Request(Request<N>),
    /// One control period of a controller that reads hinges and an inertial measurement unit.
    RequestWithBodies(Request<N>, Bodies),
}

/// One control period: the command, and the measurements at its start.
///
/// ```
/// use omni_core::BodyTwist;
/// use omni_link::{MAX_REQUEST_FRAME, Request, ToController, decode, encode, request_frame};
/// let (restart, emergency_stop) = (true, false);
/// let request = Request { sequence: 1, restart, emergency_stop, command: BodyTwist::ZERO, measured_rad_s: [0.5_f32; 4] };
/// let mut buffer = [0; MAX_REQUEST_FRAME];
/// let frame = encode(&ToController::Request(request), &mut buffer).unwrap_or_default();
/// assert_eq!(frame.len(), request_frame(4));
/// assert_eq!(decode(&mut buffer), Ok(ToController::Request(request)));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Request<const N: usize> {
    /// Number of the period; wraps round.
    #[serde(with = "plain")]
    pub sequence: u32,
    /// Start the loops afresh, whatever was before. The first request must.
    pub restart: bool,
    /// The emergency stop is pressed. A [`Drive`](omni_core::Drive) comes to rest, and follows
    /// commands again once a request says that it is not; the bare loops have none.
    pub emergency_stop: bool,
    /// Command. For a [`Drive`](omni_core::Drive) one with a NaN says that none arrived in this period.
    #[serde(with = "Twist")]
    pub command: BodyTwist<f32>,
    /// Measured actuator velocities \[rad/s\]. For a drive a NaN says that the reading did not arrive.
    #[serde(with = "each")]
    pub measured_rad_s: [f32; N],
}

/// Measured motion of a vehicle's bodies. Values that are not read are NaN.
///
/// ```
/// use omni_link::Bodies;
/// let mut bodies = Bodies::none();
/// (bodies.hinges_rad[0], bodies.pitch_rad) = (0.1, -0.02);
/// let readings = bodies.readings();
/// assert_eq!((readings.hinges_rad[0], readings.imu.pitch_rad), (0.1, -0.02));
/// assert!(readings.hinges_rad[1].is_nan());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Bodies {
    /// Angle of every hinge \[rad\], in the vehicle's order, and NaN behind them.
    #[serde(with = "each")]
    pub hinges_rad: [f32; MAX_HINGES],
    /// Their rates \[rad/s\].
    #[serde(with = "each")]
    pub hinges_rad_s: [f32; MAX_HINGES],
    /// Rates of the base about its axes \[rad/s\].
    #[serde(with = "each")]
    pub rate_rad_s: [f32; 3],
    /// Reading of its accelerometer \[m/s^2\].
    #[serde(with = "each")]
    pub specific_force_m_s2: [f32; 3],
    /// Its roll \[rad\].
    pub roll_rad: f32,
    /// Its pitch \[rad\].
    pub pitch_rad: f32,
}

impl Bodies {
    /// Nothing is read.
    ///
    /// ```
    /// assert!(omni_link::Bodies::none().rate_rad_s[2].is_nan());
    /// ```
    #[must_use]
    pub const fn none() -> Self {
        Self {
            hinges_rad: [f32::NAN; MAX_HINGES],
            hinges_rad_s: [f32::NAN; MAX_HINGES],
            rate_rad_s: [f32::NAN; 3],
            specific_force_m_s2: [f32::NAN; 3],
            roll_rad: f32::NAN,
            pitch_rad: f32::NAN,
        }
    }

    /// As input of a [`TractionDrive`](omni_core::drive::TractionDrive).
    ///
    /// ```
    /// assert_eq!(omni_link::Bodies::none().readings().hinges_rad.len(), 8);
    /// ```
    #[must_use]
    pub fn readings(&self) -> BodyReadings<'_, f32> {
        let mut readings = BodyReadings::none();
        (readings.hinges_rad, readings.hinges_rad_s) = (&self.hinges_rad, &self.hinges_rad_s);
        readings.imu.rate_rad_s = self.rate_rad_s;
        readings.imu.specific_force_m_s2 = self.specific_force_m_s2;
        (readings.imu.roll_rad, readings.imu.pitch_rad) = (self.roll_rad, self.pitch_rad);
        readings
    }
}

/// Message from the side that has the controller. `A` is an [`Answer`], or a reference to one if it is only sent.
///
/// ```
/// use omni_link::{Answer, FromController, MAX_ANSWER_FRAME, decode, encode};
/// let (answer, mut buffer) = (Answer::<4>::stopped(), [0; MAX_ANSWER_FRAME]);
/// encode(&FromController::Answer(&answer), &mut buffer);
/// assert_eq!(decode(&mut buffer), Ok(FromController::Answer(answer)));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum FromController<A> {
    /// To [`ToController::Hello`].
    Greeting(Greeting),
    /// To a request, or to a frame that is none.
    Answer(A),
}

/// The controller's build: a host rejects a controller of another vehicle. It reads the same for any number of wheels.
///
/// ```
/// use omni_link::{Answer, FromController, Greeting, PROTOCOL_VERSION, decode, encode};
/// let greeting = Greeting { version: PROTOCOL_VERSION, wheels: 4, period_us: 1000, digest: 0x1234_5678 };
/// let mut buffer = [0; 32];
/// encode(&FromController::<Answer<4>>::Greeting(greeting), &mut buffer);
/// assert_eq!(decode(&mut buffer), Ok(FromController::<Answer<7>>::Greeting(greeting))); // not of 7 wheels, says the host
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Greeting {
    /// [`PROTOCOL_VERSION`] of the controller.
    #[serde(with = "plain")]
    pub version: u32,
    /// Number of wheels.
    #[serde(with = "plain")]
    pub wheels: u32,
    /// Control period \[us\].
    #[serde(with = "plain")]
    pub period_us: u32,
    /// Digest of the controller's constants.
    #[serde(with = "plain")]
    pub digest: u32,
}

/// Result of a controller in a period, with all its signals.
///
/// ```
/// use omni_link::{Action, Answer};
/// let answer = Answer::<7>::stopped();
/// assert_eq!((answer.action, answer.sample.wheels.applied.n_m), (Action::Stop, [0.0; 7]));
/// assert!(answer.counters.is_zero());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Answer<const N: usize> {
    /// Number of the request; if the request was damaged, the number that it should have had.
    #[serde(with = "plain")]
    pub sequence: u32,
    /// [`Action::Step`]: the sample is of this period. [`Action::Hold`]: of the last step.
    /// [`Action::Stop`]: likewise, but its applied torques are zero.
    pub action: Action,
    /// Error counts of requests so far.
    pub counters: Counters,
    /// The controller's signals.
    #[serde(with = "Sample")]
    pub sample: ControlSample<f32, N>,
    /// Twist that the measured velocities amount to: [`omni_core::Kinematics::forward`].
    #[serde(with = "Twist")]
    pub estimated: BodyTwist<f32>,
    /// Part of the measured velocities that no motion explains \[rad/s\]: [`omni_core::Kinematics::residual`].
    #[serde(with = "crate::wire::Velocities")]
    pub residual: WheelVelocities<f32, N>,
    /// Signals of a drive besides the wheels' signals.
    pub drive: DriveReport<N>,
}

/// Signals of a [`Drive`](omni_core::Drive) besides the wheels' signals. The bare loops report nothing of the kind:
/// [`DriveReport::of_loops`].
///
/// ```
/// use omni_core::drive::Fault;
/// use omni_core::DriveMode;
/// use omni_link::DriveReport;
/// let report = DriveReport::<4> { mode: 1, faults: [0, 4, 0, 0], ..DriveReport::of_loops() };
/// assert_eq!((report.mode, report.faults[1]), (DriveMode::Degraded.number(), Fault::Silent.number()));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DriveReport<const N: usize> {
    /// [`DriveMode::number`](omni_core::DriveMode::number): 0 normal, 1 degraded, 2 safe stop, 3 emergency stop.
    pub mode: u8,
    /// [`Fault::number`](omni_core::drive::Fault::number) of each wheel: 0 none, 1 not a number, 2
    /// jump, 3 stuck, 4 silent, 5 lost.
    #[serde(with = "each")]
    pub faults: [u8; N],
    /// Enough wheels determine the motion.
    pub motion_known: bool,
    /// Wheels that are left out of the motion.
    #[serde(with = "each")]
    pub excluded: [bool; N],
    /// Pose by odometry: x \[m\], y \[m\], yaw \[rad\].
    #[serde(with = "each")]
    pub pose: [f32; 3],
}

impl<const N: usize> DriveReport<N> {
    /// Without monitoring of the loops: normal, no fault, every wheel included, the pose at the origin.
    ///
    /// ```
    /// assert_eq!(omni_link::DriveReport::<7>::of_loops().faults, [0; 7]);
    /// ```
    #[must_use]
    pub const fn of_loops() -> Self {
        Self {
            mode: 0,
            faults: [0; N],
            motion_known: true,
            excluded: [false; N],
            pose: [0.0; 3],
        }
    }
}

impl<const N: usize> Answer<N> {
    /// Before the first request: stopped, at rest.
    #[must_use]
    pub const fn stopped() -> Self {
        Self {
            sequence: 0,
            action: Action::Stop,
            counters: Counters::none(),
            sample: ControlSample::zero(),
            estimated: BodyTwist::ZERO,
            residual: WheelVelocities::zero(),
            drive: DriveReport::of_loops(),
        }
    }

    /// Motors whose windings shall be shorted, as [`DriveSample::brake`](omni_core::drive::DriveSample::brake).
    /// It follows from the other fields and is not in a frame.
    ///
    /// ```
    /// use omni_core::drive::Fault;
    /// use omni_core::DriveMode;
    /// use omni_link::{Answer, DriveReport};
    /// let faults = [0, Fault::Silent.number(), 0, 0];
    /// let in_mode = |mode: DriveMode| {
    ///     let drive = DriveReport { mode: mode.number(), faults, ..DriveReport::of_loops() };
    ///     Answer::<4> { drive, ..Answer::stopped() }
    /// };
    /// assert_eq!(in_mode(DriveMode::SafeStop).brake(), [false, true, false, false]);
    /// assert_eq!(in_mode(DriveMode::Degraded).brake(), [false; 4]); // the others drive on
    /// let mut at_rest = in_mode(DriveMode::Normal);
    /// at_rest.sample.wheels.shorted = true;
    /// assert_eq!(at_rest.brake(), [true; 4]);
    /// ```
    #[must_use]
    pub fn brake(&self) -> [bool; N] {
        let stopped = self.drive.mode >= DriveMode::SafeStop.number();
        let wheels = &self.sample.wheels;
        self.drive
            .faults
            .map(|fault| wheels.shorted || (stopped && (wheels.ended || fault != 0)))
    }
}
