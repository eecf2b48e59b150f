//! One period of a supervisor and its law, and how their torque ends.

use super::model::Traction;
use super::sample::TractionSample;
use super::state::TractionState;
use super::supervisor::{Supervisor, SupervisorMode, SupervisorState};
use super::target::TractionTarget;
use crate::Real;
use crate::geometry::BodyTwist;
use crate::loops::wheel_loops::RestState;
use crate::loops::{ControlState, RestRule};
use crate::motor::TorqueRanges;
use crate::policy::Readings;

/// A supervisor, its law, and how their torque ends.
pub(crate) struct Supervised<'a, R, const N: usize> {
    /// None: the target is the commanded speed, and there is one try.
    pub(crate) supervisor: Option<&'a Supervisor<R, N>>,
    pub(crate) traction: &'a Traction<R, N>,
    pub(crate) rest: RestRule<R>,
    /// Ranges of the torques that hold besides the motors' own.
    pub(crate) within: Option<&'a TorqueRanges<R, N>>,
    /// The command is a stop: no further retry.
    pub(crate) stops: bool,
}

/// Its state.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(deserialize = "R: Real + serde::Deserialize<'de>"))
)]
pub(crate) struct SupervisedState<R, const N: usize> {
    pub(crate) traction: TractionState<R, N>,
    pub(crate) supervisor: SupervisorState<R>,
    rest: RestState<R>,
}

impl<R: Real, const N: usize> SupervisedState<R, N> {
    pub(crate) const fn new() -> Self {
        Self {
            traction: TractionState::new(),
            supervisor: SupervisorState::new(),
            rest: RestState::new(),
        }
    }

    /// A start while the vehicle moves, after wheel loops: a hold at rest goes on.
    pub(crate) fn after(loops: &ControlState<R, N>, twist: &BodyTwist<R>) -> Self {
        Self {
            traction: TractionState::moving(twist),
            supervisor: SupervisorState::new(),
            rest: loops.rest,
        }
    }

    /// A fresh start of wheel loops after it.
    pub(crate) fn loops(&self) -> ControlState<R, N> {
        ControlState {
            rest: self.rest,
            ..ControlState::new()
        }
    }
}

impl<R: Real, const N: usize> Supervised<'_, R, N> {
    /// One period: a command within the vehicle's limits and readings in, torques in `sample`.
    pub(crate) fn step(
        &self,
        state: &mut SupervisedState<R, N>,
        readings: &Readings<'_, R>,
        sample: &mut TractionSample<R, N>,
    ) {
        self.traction.command(&mut state.traction, &readings.command);
        if let Some(supervisor) = self.supervisor {
            let climbs_m = supervisor.config().climbs_m;
            state.supervisor.feel(readings.climbed_m, climbs_m);
        }
        let target = match self.supervisor {
            None => TractionTarget::at(state.traction.commanded_m_s),
            Some(_) if self.stops => state.supervisor.stop(&state.traction),
            Some(supervisor) => supervisor.step(&mut state.supervisor, &state.traction),
        };
        let mut readings = *readings;
        if state.supervisor.mode() == SupervisorMode::GaveUp {
            readings.command = BodyTwist::ZERO; // nothing pushes for ever
        }
        self.traction
            .run(&mut state.traction, &readings, &target, self.within, sample);
        if readings.command == BodyTwist::ZERO {
            self.end_torque(state, sample);
        } else {
            self.rest.drive(&mut state.rest);
        }
    }

    /// At a command of rest: the torques within what is left of their ranges, in the end none.
    #[inline(never)]
    fn end_torque(&self, state: &mut SupervisedState<R, N>, sample: &mut TractionSample<R, N>) {
        let (wheels, rest) = (&mut sample.wheels, &mut state.rest);
        let kept = &mut state.traction.wheels;
        let mut integrals = [R::zero(); N];
        if self.rest.is_over(rest) {
            wheels.end(self.rest.shorts());
        } else {
            if self.rest.shrinks(rest) {
                self.rest.narrow(rest, &mut wheels.range);
                for i in 0..N {
                    wheels.applied.n_m[i] = wheels.range.clip(i, wheels.applied.n_m[i]);
                }
            }
            for i in 0..N {
                integrals[i] = kept[i].integral_n_m;
            }
            self.rest.step(rest, &mut integrals, &wheels.applied.n_m);
        }
        for i in 0..N {
            (kept[i].integral_n_m, kept[i].applied_n_m) = (integrals[i], wheels.applied.n_m[i]);
        }
    }
}
