//! Quantities that depend on the direction of travel: the driven wheels, and their distance per turn.

use super::model::Traction;
use super::state::{TractionState, WheelAlongTravel};
use crate::Real;
use crate::geometry::BodyTwist;
use crate::scalar::{is_plausible, largest, max};

/// Part of the largest turn per way from which on a direction of travel drives a wheel. The other
/// wheels follow the measured speed.
const DRIVEN_PART: f64 = 0.3;
/// The same where wheels with that much push without turning the vehicle. Wheels across that push
/// at an edge press the vehicle along it: with 0.3 `chugo7` stays at the built-in step at 18
/// degrees and more off straight ahead, with 0.6 it climbs (docs/study.md).
const ENOUGH_PART: f64 = 0.6;
/// If sensors may mask this fraction of the commanded speed, slip cannot be distinguished from noise.
const HIDDEN_PART: f64 = 0.5;
const SEEN_AGAIN_PART: f64 = 0.4;
/// If less than twice this fraction of the wheels' rotation moves the vehicle, it turns on the spot.
const ON_THE_SPOT: f64 = 0.05;
/// Part of their levers by which pushes may turn the vehicle and count as balanced.
const BALANCED_PART: f64 = 0.01;

impl<R: Real, const N: usize> Traction<R, N> {
    /// Takes a command for the direction of travel. [`Traction::step`] does so itself; a
    /// [`super::Supervisor`] must know it before. Knowledge along the old direction is kept in proportion to the new
    /// direction's component along it. An invalid command, such as NaN, is ignored: the last one remains.
    ///
    /// ```
    /// use omni_core::traction::TractionState;
    /// use omni_core::BodyTwist;
    /// # let traction = omni_core::examples::traction()?;
    /// let mut state = TractionState::new();
    /// traction.command(&mut state, &BodyTwist { vy_m_s: 0.2, ..BodyTwist::ZERO });
    /// assert_eq!(state.speed_m_s(), 0.0); // along y from now on
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn command(&self, state: &mut TractionState<R, N>, command: &BodyTwist<R>) {
        if state.wheels_found && *command == state.command {
            return;
        }
        if !command.to_array().into_iter().all(is_plausible) {
            return;
        }
        let zero = R::zero();
        let asked = [command.vx_m_s, command.vy_m_s];
        let speed = (asked[0] * asked[0] + asked[1] * asked[1]).sqrt();
        state.command = *command;
        state.commanded_m_s = speed;
        state.reference_rad_s = self.kinematics.inverse(command).rad_s;
        let mut direction = state.direction;
        if speed > zero {
            direction = [asked[0] / speed, asked[1] / speed];
        }
        // With a gap between coming and going; a vehicle that all but turns on the spot hides whatever there is.
        if *command != BodyTwist::ZERO {
            let part = R::of(if state.slip_observable {
                HIDDEN_PART
            } else {
                SEEN_AGAIN_PART
            });
            let fastest = largest(state.reference_rad_s.map(|rate| rate.abs()));
            let rows = self.kinematics.inverse_matrix();
            let carrying = largest(rows.map(|[ax, ay, _]| (ax * asked[0] + ay * asked[1]).abs()));
            state.slip_observable = speed > zero
                && self.times.hidden_m_s <= part * speed
                && R::of(ON_THE_SPOT) * fastest <= part * carrying;
            // An estimate out of rare counts is late by as many windows; the loops' integrals make a mean of them.
            state.raw = !state.slip_observable && fastest < self.times.rare_rad_s;
        }
        if state.wheels_found && direction == state.direction {
            return;
        }
        let [dx, dy] = state.direction;
        let kept = direction[0] * dx + direction[1] * dy;
        let turned = direction[1] * dx - direction[0] * dy;
        for along in [&mut state.target_m_s, &mut state.integral_n_m, &mut state.drift_m] {
            *along *= kept;
        }
        // The disagreement of wheels is scaled likewise.
        for time_s in [&mut state.carried_s, &mut state.off_speed_s] {
            *time_s *= max(kept, zero);
        }
        // The motion is the same, along and across another direction.
        (state.speed_m_s, state.drift_m_s) = (
            kept * state.speed_m_s + turned * state.drift_m_s,
            kept * state.drift_m_s - turned * state.speed_m_s,
        );
        (state.direction, state.wheels_found) = (direction, true);
        self.find_wheels(state);
    }

    fn find_wheels(&self, state: &mut TractionState<R, N>) {
        let zero = R::zero();
        let [dx, dy] = state.direction;
        let rows = self.kinematics.inverse_matrix();
        let rate_rad_m = rows.map(|[ax, ay, _]| ax * dx + ay * dy);
        let largest = largest(rate_rad_m.map(|rate_rad_m| rate_rad_m.abs()));
        // Do those that push most push without turning the vehicle?
        let (mut moment, mut levers) = (zero, zero);
        for (rate_rad_m, [_, _, turned]) in rate_rad_m.iter().zip(rows) {
            if rate_rad_m.abs() >= R::of(ENOUGH_PART) * largest {
                moment += *rate_rad_m * *turned;
                levers += (*rate_rad_m * *turned).abs();
            }
        }
        let balanced = moment.abs() <= R::of(BALANCED_PART) * levers;
        let least = largest * R::of(if balanced { ENOUGH_PART } else { DRIVEN_PART });
        state.largest_rate_rad_m = largest;
        for i in 0..N {
            let (old, [x, y]) = (state.travel[i], self.place_m[i]);
            let (size, along) = (rate_rad_m[i].abs(), rate_rad_m[i].signum());
            let driven = largest > zero && size >= least;
            let cosine_squared = size * self.way_m_rad[i];
            state.travel[i] = WheelAlongTravel {
                driven,
                rate_rad_m: rate_rad_m[i],
                along,
                side_rate_rad_m: rows[i][1] * dx - rows[i][0] * dy,
                way_m: if driven { R::one() / rate_rad_m[i] } else { zero },
                part: if driven { rate_rad_m[i] / largest } else { zero },
                lever: along * (y * dx * self.per_lever[0] - x * dy * self.per_lever[1]),
                cosine_squared: cosine_squared * cosine_squared,
                slip_gain: self.inertia_kg_m2[i] / self.times.slip_s * rate_rad_m[i],
            };
            let wheel = &mut state.wheels[i];
            // The torque to the ground along one thrust also holds along another thrust.
            wheel.contact_n_m *= along * old.along;
            // It turns as fast as before.
            wheel.speed_m_s = if old.driven {
                wheel.speed_m_s * old.rate_rad_m * state.travel[i].way_m
            } else {
                state.speed_m_s
            };
        }
    }
}
