//! The linear maps of a layout of any wheel count, over rows of numbers.

use omni_core::estimate::EstimatorConfig;
use omni_core::geometry::{Desaturation, ForwardMap, SpeedLimits};
use omni_core::{BodyTwist, WheelVelocities};
use pyo3::prelude::*;

use crate::arrays::sized;
use crate::error::of_core;
use crate::estimate::{Estimate, estimate};
use crate::layout::Layout;
use crate::plan::{Limits, Plan, planner};
use crate::track::{Track, track};

/// The maps of any wheel count: rows of 3 or N numbers in, rows out.
pub(crate) trait Maps: Send + Sync {
    fn inverse(&self, twists: &[f64]) -> Vec<f64>;
    fn forward(&self, velocities: &[f64]) -> Vec<f64>;
    fn residual(&self, velocities: &[f64]) -> Vec<f64>;
    fn desaturate(&self, twists: &[f64], limits_rad_s: &[f64], gives_way: Desaturation) -> PyResult<Reduced>;
    fn scale(&self, velocities: &[f64], limits_rad_s: &[f64]) -> PyResult<Reduced>;
    fn inverse_matrix(&self) -> Vec<f64>;
    fn forward_matrix(&self) -> Vec<f64>;
    /// Odometry that starts at the origin.
    fn track(&self, period_s: f64) -> PyResult<Box<dyn Track>>;
    /// An estimator that starts at the origin.
    fn estimate(&self, config: EstimatorConfig<f64>) -> PyResult<Box<dyn Estimate>>;
    /// A planner of paths.
    fn planner(&self, limits: &Limits) -> PyResult<Box<dyn Plan>>;
}

/// Columns of [`Desaturated`], row after row.
#[derive(Default)]
pub(crate) struct Reduced {
    pub(crate) twist: Vec<f64>,
    pub(crate) velocities: Vec<f64>,
    pub(crate) translation_factor: Vec<f64>,
    pub(crate) yaw_factor: Vec<f64>,
    pub(crate) limiting: Vec<i64>,
}

/// Every row through `map`.
fn each<const FROM: usize, const TO: usize>(
    rows: &[f64],
    map: impl Fn([f64; FROM]) -> [f64; TO],
) -> Vec<f64> {
    let (rows, _) = rows.as_chunks();
    rows.iter().flat_map(|&row| map(row)).collect()
}

impl<const N: usize> Maps for omni_core::Kinematics<f64, N> {
    fn inverse(&self, twists: &[f64]) -> Vec<f64> {
        each(twists, |twist| self.inverse(&BodyTwist::from_array(twist)).rad_s)
    }

    fn forward(&self, velocities: &[f64]) -> Vec<f64> {
        each(velocities, |rad_s| {
            self.forward(&WheelVelocities { rad_s }).to_array()
        })
    }

    fn residual(&self, velocities: &[f64]) -> Vec<f64> {
        each(velocities, |rad_s| {
            self.residual(&WheelVelocities { rad_s }).rad_s
        })
    }

    fn desaturate(&self, twists: &[f64], limits_rad_s: &[f64], gives_way: Desaturation) -> PyResult<Reduced> {
        let limits = speed_limits::<N>(limits_rad_s, gives_way)?;
        let mut reduced = Reduced::default();
        let (twists, _) = twists.as_chunks();
        for &twist in twists {
            let row = limits.desaturate(self, &BodyTwist::from_array(twist));
            reduced.twist.extend(row.twist.to_array());
            reduced.velocities.extend(row.velocities.rad_s);
            reduced.translation_factor.push(row.translation_factor);
            reduced.yaw_factor.push(row.yaw_factor);
            reduced
                .limiting
                .push(row.limiting.map_or(-1, |index| index as i64));
        }
        Ok(reduced)
    }

    fn scale(&self, velocities: &[f64], limits_rad_s: &[f64]) -> PyResult<Reduced> {
        let limits = speed_limits::<N>(limits_rad_s, Desaturation::Uniform)?;
        let mut reduced = Reduced::default();
        let (velocities, _) = velocities.as_chunks();
        for &rad_s in velocities {
            let (scaled, factor, limiting) = limits.scale(&WheelVelocities { rad_s });
            reduced.twist.extend(self.forward(&scaled).to_array());
            reduced.velocities.extend(scaled.rad_s);
            reduced.translation_factor.push(factor);
            reduced.yaw_factor.push(factor);
            reduced.limiting.push(limiting.map_or(-1, |index| index as i64));
        }
        Ok(reduced)
    }

    fn inverse_matrix(&self) -> Vec<f64> {
        self.inverse_matrix().as_flattened().to_vec()
    }

    fn forward_matrix(&self) -> Vec<f64> {
        self.forward_matrix().as_flattened().to_vec()
    }

    fn track(&self, period_s: f64) -> PyResult<Box<dyn Track>> {
        track(self, period_s)
    }

    fn estimate(&self, config: EstimatorConfig<f64>) -> PyResult<Box<dyn Estimate>> {
        estimate(self, config)
    }

    fn planner(&self, limits: &Limits) -> PyResult<Box<dyn Plan>> {
        planner(self, limits)
    }
}

fn speed_limits<const N: usize>(
    limits_rad_s: &[f64],
    gives_way: Desaturation,
) -> PyResult<SpeedLimits<f64, N>> {
    SpeedLimits::new(*sized("limits_rad_s", limits_rad_s)?, gives_way)
        .map_err(|error| of_core(&indexed("limits_rad_s", error.index), &error))
}

/// An argument, or the element of it that a wheel's index points to.
fn indexed(name: &str, index: Option<usize>) -> String {
    index.map_or(name.into(), |index| format!("{name}[{index}]"))
}

pub(crate) fn named<const N: usize>(layout: &Layout, map: ForwardMap) -> PyResult<Box<dyn Maps>> {
    match omni_core::Kinematics::<f64, N>::with_forward(&layout.sized()?, map) {
        Ok(maps) => Ok(Box::new(maps)),
        Err(error) => Err(of_core("forward", &error)),
    }
}

pub(crate) fn weighted<const N: usize>(layout: &Layout, weights: &[f64]) -> PyResult<Box<dyn Maps>> {
    match omni_core::Kinematics::<f64, N>::weighted(&layout.sized()?, sized("weights", weights)?) {
        Ok(maps) => Ok(Box::new(maps)),
        Err(error) => Err(of_core(&indexed("weights", error.index), &error)),
    }
}
