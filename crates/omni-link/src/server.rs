//! The controller's side of a link, without the transport.

#[cfg(test)]
mod tests;

use omni_core::geometry::WheelTorques;
use omni_core::loops::ControlSample;

use crate::{
    Action, Answer, Bodies, DriveReport, FromController, Greeting, Guard, PROTOCOL_VERSION, Request, Served,
    ToController, decode, encode,
};

/// Answers frames with what it serves, of `N` wheels, whose state is a `T` ([`Served::State`]):
/// that state, the guard and the last answer, with [`Loops`](crate::Loops) at most 76 `N` + 120
/// bytes. Needs no buffers but the two it is given.
///
/// ```
/// use omni_core::shaping::{AxisLimits, TwistLimiter, TwistLimits};
/// use omni_core::{BodyTwist, Controller, WheelLayout};
/// use omni_link::{Action, Answer, FromController, Loops, Receiver, Request, Server, ToController};
/// use omni_link::{answer_frame, decode, encode, request_frame};
/// # use omni_core::{Coordination, PidConfig, PidGains, TorqueLimit, WheelControlConfig};
/// # let gains = PidGains { kp_n_m_s_rad: 0.25_f32, ki_n_m_rad: 0.0, kd_n_m_s2_rad: 0.0 };
/// # let (limits, coordination) = ([TorqueLimit::constant(2.0)?; 4], Coordination::independent());
/// # let config = WheelControlConfig { pid: PidConfig::new(gains, 1e-3), limits, coordination };
/// let controller = Controller::new(&WheelLayout::mecanum4(0.6, 0.4, 0.1)?, config)?;
/// let any = AxisLimits::unlimited();
/// let limiter = TwistLimiter::new(TwistLimits::PerAxis { vx: any, vy: any, wz: any }, 1e-3)?;
/// let loops = Loops { controller: &controller, limiter: &limiter };
/// let mut server = Server::new(0x1234_5678, 1000);
/// let (mut receiver, mut out) = (Receiver::<{ request_frame(4) }>::new(), [0; answer_frame(4)]);
///
/// // What comes from the wire: wheels that turn with 2 rad/s are to stand still.
/// let (restart, emergency_stop) = (true, false);
/// let request = Request { sequence: 1, restart, emergency_stop, command: BodyTwist::ZERO, measured_rad_s: [2.0; 4] };
/// let mut wire = [0; request_frame(4)];
/// encode(&ToController::Request(request), &mut wire);
/// for byte in wire {
///     if let Some(frame) = receiver.push(byte) {
///         server.answer(&loops, frame, &mut out); // and what it returns goes to the wire
///     }
/// }
/// let Ok(FromController::Answer(answer)) = decode::<FromController<Answer<4>>>(&mut out) else { panic!() };
/// assert_eq!((answer.sequence, answer.action), (1, Action::Step));
/// assert_eq!(answer.sample.wheels.applied.n_m, [-0.25 * 2.0; 4]);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Server<T, const N: usize> {
    greeting: Greeting,
    /// None before the first restart.
    state: Option<T>,
    guard: Guard,
    /// The served controller requests shorted windings when the torque has ended.
    shorts: bool,
    answer: Answer<N>,
}

impl<T, const N: usize> Server<T, N> {
    /// Stopped, for a controller of control period `period_us` \[us\] whose constants have this digest.
    #[must_use]
    pub const fn new(digest: u32, period_us: u32) -> Self {
        Self {
            greeting: Greeting {
                version: PROTOCOL_VERSION,
                wheels: N as u32,
                period_us,
                digest,
            },
            state: None,
            guard: Guard::new(),
            shorts: false,
            answer: Answer::stopped(),
        }
    }

    /// Answers one frame: `received` without its closing zero, or with it; its bytes are used up. Always the same
    /// `served`. Returns the answer's frame at the front of `out`, nothing only if `out` is shorter than
    /// [`answer_frame`](crate::answer_frame)`(N)`.
    pub fn answer<'a>(
        &mut self,
        served: &impl Served<N, State = T>,
        received: &mut [u8],
        out: &'a mut [u8],
    ) -> &'a [u8] {
        let message = match decode(received) {
            Ok(ToController::Hello) => FromController::Greeting(self.greeting),
            Ok(ToController::Request(request)) => {
                self.take(served, &request, &Bodies::none());
                FromController::Answer(&self.answer)
            }
            Ok(ToController::RequestWithBodies(request, bodies)) => {
                self.take(served, &request, &bodies);
                FromController::Answer(&self.answer)
            }
            Err(error) => {
                let action = self.guard.damaged(error);
                self.settle(action);
                FromController::Answer(&self.answer)
            }
        };
        encode(&message, out).unwrap_or_default()
    }

    fn take(&mut self, served: &impl Served<N, State = T>, request: &Request<N>, bodies: &Bodies) {
        let action = if request.restart {
            self.guard.restart(request.sequence);
            (self.state, self.shorts) = (Some(served.start()), served.shorts_at_rest());
            Action::Step
        } else {
            self.guard.received(request.sequence)
        };
        // Before the first restart the guard is stopped.
        if action == Action::Step
            && let Some(state) = &mut self.state
        {
            served.step(state, request, bodies, &mut self.answer);
        }
        self.settle(action);
        self.answer.sequence = request.sequence;
    }

    fn settle(&mut self, action: Action) {
        if action == Action::Stop {
            self.answer.sample.wheels.end(self.shorts);
        }
        self.answer.action = action;
        self.answer.sequence = self.guard.sequence();
        self.answer.counters = self.guard.counters();
    }

    /// For firmware with a timer: no frame has come in this period. Returns what to do, with [`Server::torques`].
    pub fn missed(&mut self) -> Action {
        let action = self.guard.missed();
        self.settle(action);
        action
    }

    /// Torques to apply now \[N.m\]: of the last step, zero while stopped.
    #[must_use]
    pub fn torques(&self) -> &WheelTorques<f32, N> {
        &self.answer.sample.wheels.applied
    }

    /// Every signal of the last step; while stopped, that all torque has ended.
    #[must_use]
    pub fn sample(&self) -> &ControlSample<f32, N> {
        &self.answer.sample
    }

    /// Report of a drive in the last step.
    #[must_use]
    pub fn report(&self) -> &DriveReport<N> {
        &self.answer.drive
    }

    /// Motors whose windings shall be shorted: [`Answer::brake`].
    #[must_use]
    pub fn brake(&self) -> [bool; N] {
        self.answer.brake()
    }

    /// Error counts so far, and whether the loop runs.
    #[must_use]
    pub fn guard(&self) -> &Guard {
        &self.guard
    }
}
