//! Phase and state of a supervisor.

use crate::Real;
use crate::traction::state::TractionState;
use crate::traction::target::TractionTarget;

/// Phase of a [`super::Supervisor`].
///
/// ```
/// assert_eq!(omni_core::traction::SupervisorMode::RunUp.number(), 2);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(u8)]
#[non_exhaustive]
pub enum SupervisorMode {
    /// It drives as commanded.
    Drive = 0,
    /// It backs off from the obstacle.
    BackOff = 1,
    /// It runs up to it.
    RunUp = 2,
    /// No retry is left: it rests until the command does, or puts other rows in front.
    GaveUp = 3,
}

impl SupervisorMode {
    /// The number that stands for it in traces: 0 to 3 in the order above. It never changes.
    #[must_use]
    pub const fn number(self) -> u8 {
        self as u8
    }
}

/// The state of a [`super::Supervisor`]; `default` is a fresh start.
///
/// ```
/// use omni_core::traction::{SupervisorMode, SupervisorState};
/// let state = SupervisorState::<f32>::new();
/// assert_eq!((state.mode(), state.row_retries(), state.row()), (SupervisorMode::Drive, 0, 0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SupervisorState<R> {
    pub(super) mode: SupervisorMode,
    /// Of this row, and in all.
    pub(super) row_retries: u16,
    pub(super) retries: u32,
    /// The row that climbs next, 0 the foremost; the furthest so far.
    pub(super) row: u16,
    pub(super) furthest: u16,
    pub(super) target_m_s: R,
    /// Direction of travel that all this is of.
    pub(super) direction: [R; 2],
    pub(super) since_start_s: R,
    pub(super) in_mode_s: R,
    pub(super) stuck_s: R,
    pub(super) stuck_again_s: R,
    /// Time for which it has pushed without effect.
    pub(super) vain_s: R,
    pub(super) level_s: R,
    /// Way that it has backed off, and is to.
    pub(super) back_m: R,
    pub(super) far_m: R,
    pub(super) begun: bool,
    /// Speed of the last run-up, and of the last that succeeded, for later rows \[m/s\].
    pub(super) run_up_m_s: R,
    pub(super) later_rows_m_s: R,
    /// Highest edge that a wheel has climbed on this way \[m\], retries since the first that the vehicle does not
    /// climb, and the way driven with all rows level since the last \[m\].
    pub(super) edge_m: R,
    pub(super) edge_retries: u16,
    pub(super) past_edge_m: R,
}

impl<R: Real> Default for SupervisorState<R> {
    fn default() -> Self {
        Self::new()
    }
}

impl<R: Real> SupervisorState<R> {
    /// A fresh start, also for a `static`.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            mode: SupervisorMode::Drive,
            row_retries: 0,
            retries: 0,
            row: 0,
            furthest: 0,
            target_m_s: R::ZERO,
            direction: [R::ONE, R::ZERO],
            since_start_s: R::ZERO,
            in_mode_s: R::ZERO,
            stuck_s: R::ZERO,
            stuck_again_s: R::ZERO,
            vain_s: R::ZERO,
            level_s: R::ZERO,
            back_m: R::ZERO,
            far_m: R::ZERO,
            begun: false,
            run_up_m_s: R::ZERO,
            later_rows_m_s: R::ZERO,
            edge_m: R::ZERO,
            edge_retries: 0,
            past_edge_m: R::ZERO,
        }
    }

    /// Its phase.
    #[must_use]
    pub fn mode(&self) -> SupervisorMode {
        self.mode
    }

    /// Retries of the present row.
    #[must_use]
    pub fn row_retries(&self) -> u16 {
        self.row_retries
    }

    /// Number of retries since the start.
    #[must_use]
    pub fn retries(&self) -> u32 {
        self.retries
    }

    /// The row that climbs next, 0 the foremost in the direction of travel.
    #[must_use]
    pub fn row(&self) -> u16 {
        self.row
    }

    /// Height of the highest edge that a wheel has climbed since the obstacle began \[m\], by
    /// [`Readings::climbed_m`](crate::policy::Readings::climbed_m); 0 if none is known. Beyond
    /// [`SupervisorConfig::climbs_m`](super::SupervisorConfig::climbs_m) the vehicle gives up after one retry.
    #[must_use]
    pub fn edge_m(&self) -> R {
        self.edge_m
    }

    /// A wheel has climbed an edge of this height \[m\], 0 or NaN is none, of which the vehicle climbs `climbs_m`.
    pub(in crate::traction) fn feel(&mut self, climbed_m: R, climbs_m: R) {
        if climbed_m > R::zero() {
            self.past_edge_m = R::zero();
        }
        if climbed_m > self.edge_m {
            if self.edge_m <= climbs_m {
                self.edge_retries = 0;
            }
            self.edge_m = climbed_m;
        }
    }

    /// Begins afresh: only the target, its direction and the number of retries stay.
    pub(super) fn forget(&mut self) {
        let (target, direction, retries) = (self.target_m_s, self.direction, self.retries);
        *self = Self::new();
        (self.target_m_s, self.direction, self.retries) = (target, direction, retries);
    }

    /// In a stop: no retry continues, and a vehicle that was backing off or running up does not continue forward.
    pub(in crate::traction) fn stop<const N: usize>(
        &mut self,
        traction: &TractionState<R, N>,
    ) -> TractionTarget<R, N> {
        self.forget();
        self.target_m_s = self.target_m_s.limited(R::zero(), traction.commanded_m_s);
        TractionTarget::at(self.target_m_s)
    }

    pub(super) fn start(&mut self, mode: SupervisorMode) {
        self.mode = mode;
        (self.in_mode_s, self.back_m) = (R::zero(), R::zero());
        (self.stuck_s, self.stuck_again_s, self.vain_s) = (R::zero(), R::zero(), R::zero());
        self.begun = false;
    }

    pub(super) fn back_off(&mut self) {
        self.start(SupervisorMode::BackOff);
        self.row_retries += 1;
        self.edge_retries = self.edge_retries.saturating_add(1);
        self.retries = self.retries.saturating_add(1);
    }

    /// How much longer something has been so than not \[s\], a period later: a break takes back its own length.
    pub(super) fn net_s(time_s: R, period_s: R, so: bool) -> R {
        if so {
            time_s + period_s
        } else if time_s > period_s {
            time_s - period_s
        } else {
            R::zero()
        }
    }
}
