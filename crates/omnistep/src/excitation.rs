//! Excitation for `omnistep identify`: a scenario with the motions that its log has to contain.

use std::fmt::Write as _;

use omni_config::Vehicle;

use crate::Error;

/// Part of the top speeds that is driven: below them no motor is at its limit.
const SHARE: f64 = 0.6;
/// Friction that the drive is for, and what its ramps take of that: loops overshoot, and wheels share unevenly.
const FRICTION: f64 = 0.7;
const TAKEN: f64 = 0.4;
const GRAVITY_M_S2: f64 = 9.81;
/// Shortest ramp \[s\].
const LEAST_RAMP_S: f64 = 0.1;
/// Where neither the vehicle's limits nor its motors say how fast it goes \[m/s, m/s, rad/s\].
const SPEEDS: [f64; 3] = [0.5, 0.5, 1.0];
/// Fractions of the forward speed, lateral speed and yaw rate, and the duration of each \[s\]. Forward and backward,
/// lateral, turns, each fast and slow, and oblique, so that no wheel stands still.
const LEGS: [([f64; 3], f64); 17] = [
    ([1.0, 0.0, 0.0], 1.4),
    ([-1.0, 0.0, 0.0], 1.4),
    ([-0.3, 0.0, 0.0], 1.0),
    ([0.3, 0.0, 0.0], 1.0),
    ([0.0, 1.0, 0.0], 1.4),
    ([0.0, -1.0, 0.0], 1.4),
    ([0.0, -0.3, 0.0], 1.0),
    ([0.0, 0.3, 0.0], 1.0),
    ([0.0, 0.0, 1.0], 1.4),
    ([0.0, 0.0, -1.0], 1.4),
    ([0.0, 0.0, -0.3], 1.0),
    ([0.0, 0.0, 0.3], 1.0),
    ([0.5, 0.2, 0.3], 1.4),
    ([-0.5, 0.2, -0.3], 1.4),
    ([0.2, -0.5, -0.3], 1.4),
    ([-0.2, 0.5, 0.3], 1.4),
    ([0.6, 0.0, 0.0], 1.0),
];
/// Halves of the swings about the last leg \[s\]: 0.5 to 5 Hz, for delay and lag.
const SWINGS_S: [f64; 14] = [
    1.0, 1.0, 0.7, 0.7, 0.5, 0.5, 0.3, 0.3, 0.2, 0.2, 0.15, 0.15, 0.1, 0.1,
];
/// A swing's fraction of the forward speed.
const SWING: f64 = 0.25;

/// The text of the scenario for a vehicle that its own file or name stands for.
pub(crate) fn text(name: &str, given: &str) -> Result<String, Error> {
    let vehicle = Vehicle::load(given)?;
    let speeds = speeds(&vehicle)?;
    let mut then = String::new();
    let mut at_s = 0.5;
    let mut before = [0.0; 3];
    let mut drive = |at_s: f64, part: [f64; 3], ramp_s: Option<f64>| {
        let steps = [0, 1, 2].map(|axis| (part[axis] - before[axis]).abs() * speeds.ramps_s[axis]);
        let ramp_s = ramp_s.unwrap_or(steps.iter().sum::<f64>().max(LEAST_RAMP_S));
        before = part;
        let [vx, vy, wz] = [0, 1, 2].map(|axis| part[axis] * speeds.twist[axis]);
        // A string takes whatever is written.
        let _ = writeln!(
            then,
            "    {{ at_s = {at_s:.2}, vx_m_s = {vx:.3}, vy_m_s = {vy:.3}, wz_rad_s = {wz:.3}, ramp_s = {ramp_s:.2} }},"
        );
        ramp_s
    };
    for (part, stays_s) in LEGS {
        at_s += drive(at_s, part, None) + stays_s;
    }
    for (index, half_s) in SWINGS_S.into_iter().enumerate() {
        // From one side to the other within the half, by no more than what a ramp takes.
        let swing = SWING.min(0.5 * half_s / speeds.ramps_s[0]);
        let swing = if index % 2 == 0 { swing } else { -swing };
        drive(at_s, [0.6 + swing, 0.0, 0.0], Some(half_s));
        at_s += half_s;
    }
    at_s += drive(at_s, [0.0; 3], None);
    let duration_s = (at_s + 0.5).ceil();
    let quoted = serde_json::Value::from(given); // JSON quotes as TOML does
    Ok(format!(
        "# An excitation to identify masses, friction, delay and lag: use omnistep run {name}.toml, then omnistep identify on the log.
# Drive the same commands with your own vehicle on level ground, with some 3 m free on each side. Log the commanded torques (or duty cycles)
# and wheel velocities of every control period. Then repeat with all wheels in the air (--wheels-off-ground): only that separates gear friction from
# rolling resistance, and the wheels' inertia from the vehicle's mass. A known mass (--fix mass_kg=...) separates the latter too.
schema_version = 1
name = \"{name}\"
vehicle = {quoted}
duration_s = {duration_s:.1}

[terrain]
kind = \"flat\"
friction = {FRICTION}

[command]                       # forward, sideways, yaw, each fast and slow; diagonal; then oscillations of 0.5 to 5 Hz
vx_m_s = 0.0
vy_m_s = 0.0
wz_rad_s = 0.0
ramp_s = 0.0
then = [
{then}]

[control]
policy = \"independent\"
period_s = 0.001

[physics]
engine = \"articulated\"
timestep_s = 0.0005
contact_frequency_hz = 200.0
contact_damping_ratio = 5.0
gravity_m_s2 = {GRAVITY_M_S2}
"
    ))
}

/// How fast the legs are driven.
struct Speeds {
    /// Along x, y \[m/s\] and about z \[rad/s\].
    twist: [f64; 3],
    /// How long it takes to reach them \[s\], that no wheel slips.
    ramps_s: [f64; 3],
}

fn speeds(vehicle: &Vehicle) -> Result<Speeds, Error> {
    let top = vehicle.top_speeds()?;
    let twist = [0, 1, 2].map(|axis| {
        SHARE
            * if top[axis].is_finite() {
                top[axis]
            } else {
                SPEEDS[axis]
            }
    });
    let taken = vehicle.friction_taken(GRAVITY_M_S2)?;
    Ok(Speeds {
        twist,
        ramps_s: [0, 1, 2].map(|axis| twist[axis] * taken[axis] / (TAKEN * FRICTION)),
    })
}
