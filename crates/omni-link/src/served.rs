//! The controller behind a link: the bare loops, or a whole `Drive`.

use omni_core::drive::{DriveSample, Fault, TractionDrive, TractionDriveState};
use omni_core::shaping::{TwistLimiter, TwistLimiterState};
use omni_core::{ControlState, Controller, Drive, DriveInput, DriveState};

use crate::{Answer, Bodies, DriveReport, Request};

/// The controller of a [`Server`](crate::Server): from a request to the signals of an answer, with the state between
/// them.
///
/// ```
/// use omni_core::BodyTwist;
/// use omni_link::{Answer, Bodies, Request, Served};
/// /// Every wheel by itself, 0.5 N.m a rad/s, and it counts its periods.
/// struct Brake;
/// impl Served<2> for Brake {
///     type State = u32;
///     fn start(&self) -> u32 { 0 }
///     fn step(&self, periods: &mut u32, request: &Request<2>, _: &Bodies, answer: &mut Answer<2>) {
///         *periods += 1;
///         answer.sample.wheels.applied.n_m = request.measured_rad_s.map(|velocity| -0.5 * velocity);
///     }
/// }
/// let (restart, emergency_stop) = (true, false);
/// let request = Request { sequence: 1, restart, emergency_stop, command: BodyTwist::ZERO, measured_rad_s: [2.0, 0.0] };
/// let (mut periods, mut answer) = (Brake.start(), Answer::stopped());
/// Brake.step(&mut periods, &request, &Bodies::none(), &mut answer);
/// assert_eq!((periods, answer.sample.wheels.applied.n_m), (1, [-1.0, 0.0]));
/// ```
pub trait Served<const N: usize> {
    /// Its state.
    type State;

    /// A fresh start.
    fn start(&self) -> Self::State;

    /// Whether the windings of all motors are to be shorted when the server stops. Not by default: the wheels turn
    /// freely.
    fn shorts_at_rest(&self) -> bool {
        false
    }

    /// One control period; `bodies` are [`Bodies::none`] where the request came without. Writes the
    /// signals of the answer; its number, action and counters are the server's.
    fn step(&self, state: &mut Self::State, request: &Request<N>, bodies: &Bodies, answer: &mut Answer<N>);
}

/// The bare loops, with the limits that the command goes through.
///
/// ```
/// use omni_core::shaping::{AxisLimits, TwistLimiter, TwistLimits};
/// use omni_core::{BodyTwist, Controller, WheelLayout};
/// use omni_link::{Answer, Bodies, Loops, Request, Served};
/// # use omni_core::{Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig};
/// # let gains = PidGains { kp_n_m_s_rad: 0.25_f32, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
/// # let (limits, coordination) = ([TorqueLimit::constant(2.0)?; 4], Coordination::independent());
/// # let config = WheelControlConfig { pid: PidConfig::new(gains, 1e-3), limits, coordination };
/// let controller = Controller::new(&WheelLayout::mecanum4(0.6, 0.4, 0.1)?, config)?;
/// let any = AxisLimits::unlimited();
/// let limiter = TwistLimiter::new(TwistLimits::PerAxis { vx: any, vy: any, wz: any }, 1e-3)?;
/// let loops = Loops { controller: &controller, limiter: &limiter };
/// let (restart, emergency_stop) = (true, false);
/// let request = Request { sequence: 1, restart, emergency_stop, command: BodyTwist::ZERO, measured_rad_s: [2.0; 4] };
/// let mut answer = Answer::stopped();
/// loops.step(&mut loops.start(), &request, &Bodies::none(), &mut answer);
/// assert_eq!(answer.sample.wheels.applied.n_m, [-0.25 * 2.0; 4]);
/// assert_eq!((answer.drive.mode, answer.drive.motion_known), (0, true)); // nothing watches over it
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Loops<'a, const N: usize> {
    /// Kinematics and loops.
    pub controller: &'a Controller<f32, N>,
    /// The limits of the command.
    pub limiter: &'a TwistLimiter<f32>,
}

/// The state of [`Loops`].
pub type LoopsState<const N: usize> = (TwistLimiterState<f32>, ControlState<f32, N>);

impl<const N: usize> Served<N> for Loops<'_, N> {
    type State = LoopsState<N>;

    fn start(&self) -> Self::State {
        (TwistLimiterState::new(), ControlState::new())
    }

    fn shorts_at_rest(&self) -> bool {
        self.controller.shorts_at_rest()
    }

    fn step(
        &self,
        (limited, state): &mut Self::State,
        request: &Request<N>,
        _: &Bodies,
        answer: &mut Answer<N>,
    ) {
        let measured = request.measured_rad_s.into();
        let Answer { sample, .. } = answer;
        let command = self.limiter.step(limited, &request.command);
        self.controller.step_into(state, &command, &measured, sample);
        // As the loops took them: a reading that is no number counts as 0, and no answer holds one.
        let measured = sample.wheels.measured;
        answer.estimated = self.controller.kinematics().forward(&measured);
        answer.residual = self.controller.kinematics().residual(&measured);
        answer.drive = DriveReport::of_loops();
    }
}

/// A reading of NaN did not arrive in this period, and a command with a NaN neither: a drive counts their age.
impl<const N: usize> Served<N> for Drive<f32, N> {
    type State = DriveState<f32, N>;

    fn start(&self) -> Self::State {
        DriveState::new(self)
    }

    fn shorts_at_rest(&self) -> bool {
        Drive::shorts_at_rest(self)
    }

    fn step(&self, state: &mut Self::State, request: &Request<N>, _: &Bodies, answer: &mut Answer<N>) {
        report(&Drive::step(self, state, &ask(request)), answer);
    }
}

impl<const N: usize> Served<N> for TractionDrive<f32, N> {
    type State = TractionDriveState<f32, N>;

    fn start(&self) -> Self::State {
        TractionDriveState::new(self)
    }

    fn shorts_at_rest(&self) -> bool {
        self.drive().shorts_at_rest()
    }

    fn step(&self, state: &mut Self::State, request: &Request<N>, bodies: &Bodies, answer: &mut Answer<N>) {
        let input = ask(request);
        report(
            &TractionDrive::step(self, state, &input, &bodies.readings()).drive,
            answer,
        );
    }
}

/// A request as input of a drive.
fn ask<const N: usize>(request: &Request<N>) -> DriveInput<f32, N> {
    let mut input = DriveInput::received(&request.measured_rad_s.into());
    // One with a NaN is rejected by the drive, which is as if none had arrived.
    input.command = Some(request.command);
    input.emergency = request.emergency_stop;
    input
}

/// Writes the result of a drive into its answer.
fn report<const N: usize>(sample: &DriveSample<f32, N>, answer: &mut Answer<N>) {
    answer.sample.command = sample.shaped.twist;
    answer.sample.wheels = sample.wheels;
    answer.estimated = sample.slip.estimated;
    answer.residual = sample.slip.residual;
    let pose = sample.pose;
    answer.drive = DriveReport {
        mode: sample.mode.number(),
        faults: sample.faults.map(|fault| fault.map_or(0, Fault::number)),
        motion_known: sample.motion_known,
        excluded: sample.slip.excluded,
        pose: [pose.x_m, pose.y_m, pose.yaw_rad],
    };
}
