//! Interface of an external physics engine: requests and results.

use crate::config::Engine;
use crate::observation::Pose3;

/// What turns a wheel about its axle in one physics step, as the wheel feels it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AxleDrive {
    /// Torque between wheel and carrier \[N.m\].
    pub torque_n_m: f64,
    /// Damping between them \[N.m.s/rad\], 0 or more.
    pub damper_n_m_s_rad: f64,
    /// Dry friction between them at most \[N.m\], 0 or more.
    pub hold_n_m: f64,
}

/// A place where a wheel is touched.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Touch {
    /// The wheel, by its index in the vehicle file.
    pub wheel: usize,
    /// Force on the wheel \[N\], world axes.
    pub force_n: [f64; 3],
    /// Unit vector out of the ground.
    pub normal: [f64; 3],
    /// Where \[m\], world.
    pub at_m: [f64; 3],
}

/// Result of a physics step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExternalStep {
    /// Angle of each wheel against its carrier since the start \[rad\], after the step; positive
    /// drives along the rolling direction.
    pub turned_rad: Vec<f64>,
    /// Its rate \[rad/s\].
    pub rate_rad_s: Vec<f64>,
    /// Every contact of a wheel in the step.
    pub touches: Vec<Touch>,
}

/// A body's frame, which is the vehicle's as it stands on flat ground.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BodyState {
    /// Position of the frame's origin, and its orientation.
    pub pose: Pose3,
    /// Velocity of that origin \[m/s\], world axes.
    pub velocity_m_s: [f64; 3],
    /// Angular velocity \[rad/s\], world axes.
    pub rate_rad_s: [f64; 3],
}

/// The vehicle at one instant.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExternalState {
    /// The bodies, in the vehicle file's order.
    pub bodies: Vec<BodyState>,
    /// Angle \[rad\] and rate \[rad/s\] of each hinge.
    pub hinges: Vec<[f64; 2]>,
    /// Place \[m\] and velocity \[m/s\] of each wheel's centre, world axes.
    pub wheels: Vec<[[f64; 3]; 2]>,
    /// Kinetic energy of all parts \[J\].
    pub kinetic_j: f64,
    /// Potential energy of all parts \[J\], from anywhere.
    pub potential_j: f64,
    /// Momentum of all parts \[N.s\], world axes.
    pub momentum_n_s: [f64; 3],
}

/// Why outside physics cannot go on.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ExternalFailure {
    /// No finite state: the run's verdict is [`crate::Verdict::Diverged`].
    Diverged,
    /// Anything else, in words.
    Failed(String),
}

/// A vehicle on the ground, simulated elsewhere in the scenario's physics steps. Actuators with
/// their lag, faults and gears stay here: what is asked for is what the axles feel. What is filled
/// in comes with an entry per body, hinge and wheel, and keeps as many.
pub trait ExternalPhysics: Send + Sync {
    /// Its name in outcomes.
    fn engine(&self) -> Engine;

    /// Places the vehicle at the scenario's start, at rest, displaced by this distance along the world's x \[m\] and
    /// turned to the left \[rad\].
    ///
    /// # Errors
    /// Why it cannot.
    fn start(&mut self, x_m: f64, yaw_rad: f64) -> Result<(), ExternalFailure>;

    /// One physics step; `axles` has an entry per wheel, and so must what is shown.
    ///
    /// # Errors
    /// Why there is no next state.
    fn step(&mut self, axles: &[AxleDrive], shown: &mut ExternalStep) -> Result<(), ExternalFailure>;

    /// The present state; it has room for every body, hinge and wheel.
    ///
    /// # Errors
    /// Why it cannot be observed.
    fn observe(&mut self, state: &mut ExternalState) -> Result<(), ExternalFailure>;
}
