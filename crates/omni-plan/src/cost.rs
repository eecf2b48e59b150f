//! Cost of each part of a route: time, energy or risk.

use crate::angles::remainder;
use crate::portals::Portal;
use crate::{Cost, CrossingKind, Footprint, Options};

/// Costs are whole numbers in the search: sums that do not depend on their order.
const UNITS: f64 = 1e6;
/// Gravity \[m/s^2\].
const GRAVITY_M_S2: f64 = 9.81;
/// Risk of a metre on even ground, and what obstacles add.
const RISK_OF_METRE: [f64; 2] = [0.01, 0.1];
/// Risk of a turn by a radian.
const RISK_OF_RADIAN: f64 = 0.001;

/// The costs of a plan.
#[derive(Debug)]
pub(crate) struct Costs<'a> {
    options: &'a Options,
    /// Mean path of the wheels for a turn by a radian \[m\].
    lever_m: f64,
}

impl<'a> Costs<'a> {
    pub(crate) fn new(options: &'a Options, footprint: &Footprint) -> Self {
        Self {
            options,
            lever_m: footprint.radius_m() / 2.0,
        }
    }

    /// Travel over even ground with this side of the vehicle in front, to a position with a proximity of obstacles,
    /// higher by `rise_m`.
    pub(crate) fn travel(&self, length_m: f64, side_rad: f64, proximity: f64, rise_m: f64) -> f64 {
        self.travel_at(
            length_m,
            self.options.speeds.speed_m_s(side_rad),
            proximity,
            rise_m,
        )
    }

    /// The least of it for all sides.
    pub(crate) fn least_travel(&self, length_m: f64, proximity: f64, rise_m: f64) -> f64 {
        self.travel_at(length_m, self.options.speeds.highest_m_s(), proximity, rise_m)
    }

    fn travel_at(&self, length_m: f64, speed_m_s: f64, proximity: f64, rise_m: f64) -> f64 {
        let more = 1.0 + self.options.clearance_weight * proximity;
        match self.options.cost {
            Cost::Time => more * length_m / speed_m_s,
            Cost::Energy => self.rolling(length_m) * more + GRAVITY_M_S2 * rise_m.max(0.0),
            Cost::Risk => length_m * (RISK_OF_METRE[0] + RISK_OF_METRE[1] * proximity),
        }
    }

    /// A turn in place.
    pub(crate) fn turn(&self, angle_rad: f64) -> f64 {
        let angle = angle_rad.abs();
        match self.options.cost {
            Cost::Time => angle / self.options.speeds.yaw_rad_s,
            Cost::Energy => self.rolling(self.lever_m * angle),
            Cost::Risk => RISK_OF_RADIAN * angle,
        }
    }

    /// A crossing, from its entry to its exit.
    pub(crate) fn crossing(&self, portal: &Portal) -> f64 {
        let length_m = portal.length_m();
        match self.options.cost {
            Cost::Time => length_m / portal.speed_m_s,
            Cost::Energy => {
                let lifts = portal.parts.iter().filter(|part| part.kind != CrossingKind::Down);
                let lift_m: f64 = lifts.map(|part| part.height_m).sum();
                self.rolling(length_m) + GRAVITY_M_S2 * lift_m
            }
            Cost::Risk => {
                let risks = portal
                    .parts
                    .iter()
                    .map(|part| (part.height_m / part.allowed_m).powi(2));
                RISK_OF_METRE[0] * length_m + risks.sum::<f64>()
            }
        }
    }

    /// A crossing with the turns to and from the lattice's headings.
    pub(crate) fn portal(&self, portal: &Portal, from_rad: f64, to_rad: f64) -> f64 {
        self.crossing(portal)
            + self.turn(remainder(portal.entry.yaw_rad - from_rad))
            + self.turn(remainder(to_rad - portal.exit.yaw_rad))
    }

    fn rolling(&self, length_m: f64) -> f64 {
        self.options.rolling_resistance * GRAVITY_M_S2 * length_m
    }
}

/// A cost as a whole number, rounded.
pub(crate) fn whole(cost: f64) -> u64 {
    (UNITS * cost).round() as u64
}

/// A cost as a whole number, rounded down: for what shall be no more than the sum of others.
pub(crate) fn whole_below(cost: f64) -> u64 {
    (UNITS * cost).floor() as u64
}

/// And back.
pub(crate) fn from_whole(cost: u64) -> f64 {
    cost as f64 / UNITS
}
