//! Dry friction along one direction: it sticks, or it slides.

use serde::{Deserialize, Serialize};

/// Impulse per slip of what sticks \[kg\]: a wheel creeps by a millionth of a metre a second per newton second.
pub(super) const STICK: f64 = 1e6;
/// How far beyond its bound a friction may be before the contact slides, as a part of the bound.
pub(super) const SLACK: f64 = 1e-9;

/// How a surface holds on to the other along one direction.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub(super) enum Grip {
    Stick,
    /// Slides; the sign is the sign of the friction on the wheel.
    Slide(f64),
}

/// The friction in one direction, and the grip that it calls for: `held` is the impulse that sticking takes.
pub(super) fn follow(grip: Option<Grip>, slip: f64, held: f64, most: f64, impulse: &mut f64) -> Grip {
    match grip {
        None => {
            *impulse = 0.0;
            Grip::Stick
        }
        Some(Grip::Stick) => {
            *impulse = held;
            if held.abs() > most * (1.0 + SLACK) {
                Grip::Slide(held.signum())
            } else {
                Grip::Stick
            }
        }
        Some(slide @ Grip::Slide(sign)) => {
            *impulse = sign * most;
            if slip * sign <= 0.0 { slide } else { Grip::Stick }
        }
    }
}
