//! Friction that wheels required.

use super::mean::WINDOW_NS;
use crate::observation::Observation;

/// Bins of the friction that wheels call for, of a hundredth each.
const FRICTION_BINS: usize = 300;
/// Load under which a wheel's friction says nothing \[N\], as a part of the weight.
const LIGHT: f64 = 0.01;

/// Histogram of the friction that wheels required.
pub(super) struct FrictionUse {
    window_ns: u64,
    periods: u32,
    sums: Vec<([f64; 3], f64)>,
    light_n: f64,
    bins: Vec<u64>,
}

impl FrictionUse {
    pub(super) fn new(wheels: usize, weight_n: f64) -> Self {
        Self {
            window_ns: 0,
            periods: 0,
            sums: vec![([0.0; 3], 0.0); wheels],
            light_n: LIGHT * weight_n,
            bins: vec![0; FRICTION_BINS],
        }
    }

    pub(super) fn push(&mut self, seen: &Observation) {
        self.periods += 1;
        for ((force, normal_n), wheel) in self.sums.iter_mut().zip(&seen.wheels) {
            // The force along the ground is what is left without the part along the normal.
            let along: f64 = (0..3).map(|k| wheel.force_n[k] * wheel.normal[k]).sum();
            for k in 0..3 {
                force[k] += wheel.force_n[k] - along * wheel.normal[k];
            }
            *normal_n += wheel.force_normal_n;
        }
        if seen.time_ns < self.window_ns {
            return;
        }
        self.window_ns = seen.time_ns - seen.time_ns % WINDOW_NS + WINDOW_NS;
        let least_n = self.light_n * f64::from(self.periods);
        for (force, normal_n) in &mut self.sums {
            if *normal_n > least_n {
                let ratio = force.iter().map(|f| f * f).sum::<f64>().sqrt() / *normal_n;
                self.bins[((ratio * 100.0) as usize).min(FRICTION_BINS - 1)] += 1;
            }
            (*force, *normal_n) = ([0.0; 3], 0.0);
        }
        self.periods = 0;
    }

    /// The upper edge of the bin under which that part of the averages lies; NaN if there are none.
    pub(super) fn percentile(&self, part: f64) -> f64 {
        let total: u64 = self.bins.iter().sum();
        let mut below = 0;
        for (i, count) in self.bins.iter().enumerate() {
            below += count;
            if total > 0 && below as f64 >= part * total as f64 {
                return (i + 1) as f64 / 100.0;
            }
        }
        f64::NAN
    }
}
