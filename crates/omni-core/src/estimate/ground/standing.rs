//! A vehicle that stands: its height above the ground at the start, and the plane of that ground.

use super::step::Wheels;
use super::{GroundOdometry, GroundOdometryState};
use crate::Real;
use crate::linkage::axes_of;
use crate::scalar::{follow, max, min};
use crate::sum::Sum;

/// Weight of a period in the mean heights of the contacts.
const MEAN_PART: f64 = 0.05;
/// Margin of known ground around the wheels \[cells\].
const MARGIN_CELLS: f64 = 1.5;

impl<R: Real, const N: usize> GroundOdometry<R, N> {
    /// A period of a vehicle that stands. Until it has moved, the ground is the plane through its contacts that is
    /// parallel to the base's axes.
    pub(super) fn stand(&self, state: &mut GroundOdometryState<R, N>, wheels: &Wheels<R, N>) {
        state.base_rise_m_s = R::zero();
        if state.moved {
            state.contact_m = wheels.contact_m;
            return;
        }
        let averages = state
            .contact_m
            .first()
            .is_some_and(|first| first.is_finite_real());
        if averages {
            for (mean, contact) in state.contact_m.iter_mut().zip(wheels.contact_m) {
                follow(mean, contact, R::of(MEAN_PART));
            }
        } else {
            state.contact_m = wheels.contact_m;
        }
        let [x, y, _] = axes_of(&state.attitude);
        let slopes = [x[2] / x[0], y[2] / y[1]];
        let mut sum = R::zero();
        for (mean, place) in state.contact_m.iter().zip(&wheels.places) {
            let [x, y, _] = place.centre_m;
            sum += *mean - slopes[0] * x - slopes[1] * y;
        }
        state.height_m = Sum::of(-sum / R::of(N as f64));
        state.ground_slope = slopes;
        let height_m = state.height_m.total;
        state.ground_m = state.contact_m.map(|contact| contact + height_m);
        let [forward, left] = slopes.map(|each| each * self.config.cell_m);
        let corners = self.corners(state, wheels);
        state.grid.start(corners, [R::zero(), forward, left]);
        state.started = true;
    }

    /// Corners of the ground below the wheels \[cells\].
    fn corners(&self, state: &GroundOdometryState<R, N>, wheels: &Wheels<R, N>) -> [[i32; 2]; 2] {
        let (mut low, mut high) = ([R::zero(); 2], [R::zero(); 2]);
        for place in &wheels.places {
            let [x, y, _] = place.centre_m;
            for ((low, high), value) in low.iter_mut().zip(&mut high).zip([x, y]) {
                *low = min(value, *low);
                *high = max(value, *high);
            }
        }
        let cells_per_m = R::one() / self.config.cell_m;
        let margin = R::of(MARGIN_CELLS);
        let corner = |at: [R; 2], by: R| {
            state
                .track
                .position
                .moved(at.map(|each| each * cells_per_m + by))
                .cell
        };
        [corner(low, -margin), corner(high, margin)]
    }
}
