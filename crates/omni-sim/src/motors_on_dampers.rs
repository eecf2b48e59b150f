//! Section 3.3 of the paper: three motors on dampers under a coordination policy, without a physics engine.

use omni_core::loops::WheelController;
use omni_core::{ControlState, Coordination, PidConfig, TorqueLimit, WheelControlConfig};
use serde::Serialize;

use crate::Error;
use crate::config::{self, MotorBench};

/// The policies that make sense without a vehicle: `shared_integral` needs one.
pub const MOTOR_BENCH_POLICIES: [&str; 3] = ["independent", "scale_torques", "scale_references"];

/// rad/s per rpm.
const RPM: f64 = std::f64::consts::PI / 30.0;

/// Time between rows of the trace \[us\].
const ROW_US: u64 = 100_000;

/// Speeds and loads of wheels A, B and C, a row every 0.1 s (or every control period if that is longer).
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct MotorBenchTrace {
    /// The coordination policy.
    pub policy: String,
    /// Time \[s\].
    pub t_s: Vec<f64>,
    /// Velocities \[rpm\], the unit of the paper's figure 8.
    pub speed_rpm: ByWheel,
    /// Applied torques \[N.m\].
    pub torque_n_m: ByWheel,
    /// Dampers applied \[N.m.s/rad\].
    pub load_n_m_s_rad: ByWheel,
    /// Common factor of the policy, 0 to 1.
    pub common_factor: Vec<f64>,
}

/// One series per wheel.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ByWheel {
    /// Wheel A.
    #[serde(rename = "A")]
    pub a: Vec<f64>,
    /// Wheel B.
    #[serde(rename = "B")]
    pub b: Vec<f64>,
    /// Wheel C.
    #[serde(rename = "C")]
    pub c: Vec<f64>,
}

impl ByWheel {
    fn push(&mut self, [a, b, c]: [f64; 3]) {
        self.a.push(a);
        self.b.push(b);
        self.c.push(c);
    }

    /// The values of the three wheels in one row.
    #[must_use]
    pub fn row(&self, index: usize) -> [f64; 3] {
        [self.a[index], self.b[index], self.c[index]]
    }
}

impl MotorBenchTrace {
    /// Speeds \[rpm\] of A, B, C in the row nearest to a time \[s\].
    ///
    /// # Panics
    /// If the trace is empty, which an experiment's is not.
    #[must_use]
    pub fn speeds_at(&self, time_s: f64) -> [f64; 3] {
        let nearest = |a: &usize, b: &usize| {
            (self.t_s[*a] - time_s)
                .abs()
                .total_cmp(&(self.t_s[*b] - time_s).abs())
        };
        self.speed_rpm
            .row((0..self.t_s.len()).min_by(nearest).unwrap_or(0))
    }
}

/// Runs the experiment under a policy, torque limited by eq. (13) in four quadrants.
///
/// # Errors
/// [`config::Error::UnknownName`] for a policy that is not one of [`MOTOR_BENCH_POLICIES`];
/// [`config::Error::Key`] for gains that are out of range.
///
/// ```
/// use omni_sim::{config::MotorBench, run_motor_bench};
/// let trace = run_motor_bench(&MotorBench::load("motor_bench", &[])?, "scale_references")?;
/// let [a, b, c] = trace.speeds_at(20.0); // load B alone is too much: all slow down to what B can keep
/// assert!([a, b, c].iter().all(|speed| (speed - 92.0).abs() < 0.2));
/// # Ok::<(), omni_sim::Error>(())
/// ```
pub fn run_motor_bench(experiment: &MotorBench, policy: &str) -> Result<MotorBenchTrace, Error> {
    let coordination = Coordination::preset(policy).filter(|_| MOTOR_BENCH_POLICIES.contains(&policy));
    let known = || MOTOR_BENCH_POLICIES.join(", ");
    let coordination = coordination.ok_or_else(|| config::Error::UnknownName {
        kind: "policy",
        name: policy.into(),
        known: known(),
    })?;
    let period_s = experiment.period_us as f64 * 1e-6;
    let config = WheelControlConfig {
        pid: PidConfig::new(experiment.gains.pid(), period_s),
        limits: [TorqueLimit::chugo(); 3],
        coordination,
    };
    let controller = WheelController::<f64, 3>::new(config).map_err(|error| config::Error::Key {
        file: experiment.name.clone(),
        key: error.parameter.into(),
        message: error.to_string(),
    })?;

    let reference = [experiment.speed_rpm * RPM; 3];
    let mut velocity = reference;
    let mut state = ControlState::default();
    let mut trace = MotorBenchTrace {
        policy: policy.into(),
        t_s: Vec::new(),
        speed_rpm: ByWheel::default(),
        torque_n_m: ByWheel::default(),
        load_n_m_s_rad: ByWheel::default(),
        common_factor: Vec::new(),
    };
    let periods = (experiment.duration_s / period_s).round() as u64;
    let every = (ROW_US / experiment.period_us).max(1);
    for k in 0..=periods {
        let time_us = k * experiment.period_us;
        let sample = controller.step(&mut state, &reference.into(), &velocity.into());
        let loads = experiment.loads_at(time_us as f64 / 1e6);
        if k % every == 0 {
            trace.t_s.push(time_us as f64 / 1e6);
            trace.speed_rpm.push(velocity.map(|v| v / RPM));
            trace.torque_n_m.push(sample.applied.n_m);
            trace.load_n_m_s_rad.push(loads);
            trace.common_factor.push(sample.common_factor);
        }
        // J v' = tau - d v by implicit Euler: stable at any period, exact where the wheel settles.
        for i in 0..3 {
            let per_inertia = period_s / experiment.inertia_kg_m2;
            let damper = experiment.friction_n_m_s_rad + loads[i];
            velocity[i] = (velocity[i] + per_inertia * sample.applied.n_m[i]) / (1.0 + per_inertia * damper);
        }
    }
    Ok(trace)
}
