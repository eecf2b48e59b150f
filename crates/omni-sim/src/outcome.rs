//! What a run amounts to in a few numbers.

use omni_core::metrics::DISTURBED_FLOOR_RAD_S;
use serde::Serialize;

use crate::config::{Scenario, Terrain, Vehicle};
use crate::trace::Trace;

/// How far below its place on the upper plane a wheel may be and still count as up \[m\]: contacts give a little.
const UP_TOLERANCE_M: f64 = 0.005;

/// Figures of a run.
///
/// On a step, averages are over the *crossing*: from the moment the foremost wheel reaches the riser to the moment the
/// last wheel stands on the upper plane, or the end of the run. On flat ground they are over the whole run. Where the
/// riser is never reached they are NaN: nothing was measured.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// Every wheel stands on the upper plane; false on flat ground.
    pub climbed: bool,
    /// Duration of the crossing \[s\]; none unless climbed.
    pub crossing_s: Option<f64>,
    /// Largest nose-up angle of any body during the crossing \[deg\].
    pub pitch_peak_deg: f64,
    /// Root mean square of the slip ratio over driven wheels that touch the ground.
    pub slip_rms: f64,
    /// Root mean square of the disturbed ratio over driven wheels.
    pub disturbed_rms: f64,
    /// Root mean square of the spread of velocity over reference: standard deviation over driven wheels.
    pub spread_rms: f64,
    /// Sum over wheels of the time integral of torque squared \[N^2.m^2.s\]: proportional to the motors' heat.
    pub heat_n2m2s: f64,
}

impl Outcome {
    /// The figures of a trace of a scenario.
    #[must_use]
    pub fn of(scenario: &Scenario, trace: &Trace) -> Self {
        let crossing = Crossing::of(scenario, trace);
        let (first, last) = (crossing.first, crossing.last);
        let measured = if first < last { 1.0 } else { f64::NAN };
        let wheels = trace.wheel_names().len();
        let signal = |name: &str, wheel: usize| trace.wheel(name, wheel).unwrap_or(&[]);

        let (mut slip, mut disturbed, mut spread) = (Mean::default(), Mean::default(), Mean::default());
        let mut heat = 0.0;
        let period_s = scenario.control.period_us as f64 * 1e-6;
        for w in 0..wheels {
            let reference = signal("reference_rad_s", w);
            let (slips, normal) = (signal("slip_ratio", w), signal("force_normal_n", w));
            let (ratios, torque) = (signal("disturbed_ratio", w), signal("applied_n_m", w));
            for k in first..last {
                heat += torque[k] * torque[k] * period_s;
                if reference[k].abs() < DISTURBED_FLOOR_RAD_S {
                    continue;
                }
                disturbed.add(ratios[k]);
                if normal[k] > 0.0 {
                    slip.add(slips[k]);
                }
            }
        }
        for k in first..last {
            spread.add(spread_at(trace, wheels, k));
        }
        let steepest = trace
            .names()
            .iter()
            .enumerate()
            .filter(|(_, n)| n.ends_with("_nose_up_rad"));
        let peak = steepest
            .flat_map(|(i, _)| &trace.column_at(i)[first..last])
            .fold(0.0_f64, |m, a| m.max(*a));
        Self {
            climbed: crossing.climbed,
            crossing_s: crossing
                .climbed
                .then(|| ((last - first) as u64 * scenario.control.period_us) as f64 / 1e6),
            pitch_peak_deg: peak.to_degrees() * measured,
            slip_rms: slip.root(),
            disturbed_rms: disturbed.root(),
            spread_rms: spread.root(),
            heat_n2m2s: heat * measured,
        }
    }
}

/// Standard deviation of velocity over reference among driven wheels, in one row.
fn spread_at(trace: &Trace, wheels: usize, row: usize) -> f64 {
    let at = |name, w| trace.wheel(name, w).map_or(0.0, |column| column[row]);
    let (mut reference, mut velocity) = ([0.0; 8], [0.0; 8]);
    for w in 0..wheels.min(8) {
        (reference[w], velocity[w]) = (at("reference_rad_s", w), at("measured_rad_s", w));
    }
    omni_core::metrics::speed_ratio_spread(&reference, &velocity, DISTURBED_FLOOR_RAD_S)
}

/// The rows between which the vehicle is on the step.
struct Crossing {
    first: usize,
    last: usize,
    climbed: bool,
}

impl Crossing {
    fn of(scenario: &Scenario, trace: &Trace) -> Self {
        let Terrain::Step { height_m, at_m, .. } = scenario.terrain else {
            return Self {
                first: 0,
                last: trace.rows(),
                climbed: false,
            };
        };
        let vehicle = scenario.vehicle();
        let row = |touch: &dyn Fn(usize) -> bool| (0..trace.rows()).find(|k| touch(*k));
        let centre = |axis: &str, w: usize| trace.wheel(axis, w).unwrap_or(&[]);
        let first = row(&|k| {
            (0..vehicle.wheel.len()).any(|w| centre("x_m", w)[k] + reach(vehicle, w, height_m) >= at_m)
        });
        let up = |w: usize, k: usize| {
            let lowest = height_m + vehicle.wheel[w].radius_m - UP_TOLERANCE_M;
            centre("x_m", w)[k] >= at_m && centre("z_m", w)[k] >= lowest
        };
        let last = row(&|k| (0..vehicle.wheel.len()).all(|w| up(w, k)));
        Self {
            first: first.unwrap_or(trace.rows()),
            last: last.unwrap_or(trace.rows()),
            climbed: first.is_some() && last.is_some(),
        }
    }
}

/// How far ahead of its centre a wheel on the ground meets a riser of a height \[m\].
fn reach(vehicle: &Vehicle, wheel: usize, height_m: f64) -> f64 {
    let radius = match vehicle.wheel[wheel].contact {
        crate::config::WheelContact::Ball {} | crate::config::WheelContact::Rollers(_) => vehicle.wheel[wheel].radius_m,
        crate::config::WheelContact::Roller { radius_m } => radius_m,
    };
    let above = (radius - height_m).max(0.0);
    (radius * radius - above * above).sqrt()
}

#[derive(Default)]
struct Mean {
    squares: f64,
    count: f64,
}

impl Mean {
    fn add(&mut self, x: f64) {
        self.squares += x * x;
        self.count += 1.0;
    }

    fn root(&self) -> f64 {
        (self.squares / self.count).sqrt() // NaN where there is nothing to average
    }
}
