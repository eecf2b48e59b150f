//! Is an answer one that the scenario's controller can have given? It goes to the motors, into logs and into metrics.

use omni_core::drive::Fault;
use omni_core::geometry::PlanarPose;
use omni_core::{BodyTwist, DriveMode, Real};
use omni_link::{Action, Answer, Request};

use super::Linked;

/// The largest numbers of a mode and of a fault.
const MOST_MODE: u8 = DriveMode::EmergencyStop.number();
const MOST_FAULT: u8 = Fault::Lost.number();
/// The number of a safe stop among modes.
const SAFE_STOP: u8 = DriveMode::SafeStop.number();
/// How far beyond the motor's range a torque may be, as a part of it: another processor's rounding in `f32`, and
/// far below what any motor's data sheet promises. Also how far off the way of a period may be, as a part of it.
const ROUNDING: f64 = 1e-5;

impl<const N: usize> Linked<N> {
    /// Can the motors give these torques at the velocities that were sent? Else the firmware is at
    /// fault, whatever physics would make of it.
    pub(super) fn plausible(&self, answer: &Answer<N>, request: &Request<N>) -> Result<(), String> {
        let (measured_rad_s, drives) = (&request.measured_rad_s, self.drives);
        if answer.action == Action::Hold {
            return Ok(()); // none of its signals is used
        }
        plausible(answer, measured_rad_s, &self.asked, drives)?;
        ended(&answer.sample.wheels)?;
        if answer.action == Action::Stop {
            return Ok(()); // its torques are not used
        }
        let torques = answer.sample.wheels.applied.n_m;
        let velocities = if drives {
            let taken = self.taken(answer)?;
            self.of_a_drive(answer, request.emergency_stop)?;
            self.after_the_last(answer)?;
            taken
        } else {
            *measured_rad_s
        };
        for ((torque, velocity), (wheel, motor)) in torques.iter().zip(&velocities).zip(&self.motors) {
            let range = motor.range(*velocity);
            let (lower, upper) = (f64::from(range.lower_n_m), f64::from(range.upper_n_m));
            let room = ROUNDING * (upper - lower);
            // Not so for a NaN.
            if !(lower - room..=upper + room).contains(&f64::from(*torque)) {
                return Err(format!(
                    "the firmware answers {torque} N.m for wheel {wheel}, allowed: {lower} to {upper}, the range of \
                     its motor at {velocity} rad/s"
                ));
            }
        }
        Ok(())
    }

    /// The velocities that a drive worked with: as sent, or, where a reading is missing, the last
    /// one that it had. That is of the answer before, or was sent in a period whose answer was
    /// lost. A faulty wheel, whose velocity it takes for 0, gets no torque.
    fn taken(&self, answer: &Answer<N>) -> Result<[f32; N], String> {
        let wheels = &answer.sample.wheels;
        for (i, said) in wheels.measured.rad_s.iter().enumerate() {
            let (wheel, _) = &self.motors[i];
            let before = self.last.sample.wheels.measured.rad_s[i];
            let released = wheels.applied.n_m[i] == 0.0;
            let sent = self.unanswered_rad_s.iter().any(|sent| sent[i] == *said);
            let known = sent || *said == before || (*said == 0.0 && released);
            // Traction control works with an estimate from coarse counts.
            let most = self.fastest_rad_s[i];
            if self.grips && !known && said.abs() > most {
                return Err(format!(
                    "the firmware answers {said} rad/s as measured velocity of wheel {wheel}, allowed: -{most} to {most}, \
                     the fastest sent so far"
                ));
            }
            if !self.grips && !known {
                let sent = self.unanswered_rad_s.last().map_or(f32::NAN, |sent| sent[i]);
                return Err(format!(
                    "the firmware answers {said} rad/s as measured velocity of wheel {wheel}, allowed: {sent} (the value sent), \
                     {before} (the value before), or 0 without torque"
                ));
            }
            if answer.drive.faults[i] != 0 && !released {
                return Err(format!(
                    "the firmware answers a torque for wheel {wheel}, which it reports as faulty, allowed: 0"
                ));
            }
        }
        Ok(wheels.measured.rad_s)
    }

    /// Is what a drive reports consistent? It is in an emergency stop for as long as one is
    /// pressed; a faulty wheel is neither driven nor asked for the motion; it is degraded where a
    /// wheel is left out; without a motion it reports none.
    fn of_a_drive(&self, answer: &Answer<N>, emergency_stop: bool) -> Result<(), String> {
        let (report, active) = (&answer.drive, &answer.sample.wheels.active);
        let mode = report.mode;
        for i in 0..N {
            let fault = report.faults[i];
            if fault != 0 && (active[i] || !report.excluded[i]) {
                return Err(format!(
                    "the firmware answers fault {fault} of wheel {}, which it still uses, allowed: 0",
                    self.motors[i].0
                ));
            }
        }
        // When the torque has ended at rest no wheel is controlled, and all are well.
        let released = active.contains(&false) && !answer.sample.wheels.ended;
        let left_out = report.excluded.contains(&true) || released;
        let allowed = match (emergency_stop, left_out) {
            (true, _) => Some("3, because the emergency stop is pressed").filter(|_| mode != MOST_MODE),
            (false, _) if mode == MOST_MODE => Some("0 to 2, because no emergency stop is pressed"),
            (false, true) => Some("1 to 2, because a wheel is left out").filter(|_| mode == 0),
            (false, false) => Some("0 or 2, because no wheel is left out").filter(|_| mode == 1),
        };
        if let Some(allowed) = allowed {
            return Err(format!("the firmware answers mode {mode}, allowed: {allowed}"));
        }
        if !report.motion_known && answer.estimated.to_array() != [0.0; 3] {
            return Err(format!(
                "the firmware answers a twist of {:?}, allowed: 0, because it reports an unknown motion",
                answer.estimated.to_array()
            ));
        }
        Ok(())
    }

    /// Does a drive's report follow from its last one? A safe stop lasts until it is ended, and
    /// over a link it is never ended; the pose moves by the motion of its wheels.
    fn after_the_last(&self, answer: &Answer<N>) -> Result<(), String> {
        let (last, now) = (&self.last.drive, &answer.drive);
        if last.mode == SAFE_STOP && now.mode < SAFE_STOP {
            return Err(format!(
                "the firmware answers mode {} after a safe stop, allowed: {SAFE_STOP} to {MOST_MODE}, because nothing ended the stop",
                now.mode
            ));
        }
        if answer.sequence != self.last.sequence.wrapping_add(1) {
            return Ok(()); // what it did meanwhile was not received
        }
        if last.mode < SAFE_STOP && now.mode == SAFE_STOP && now.motion_known {
            return Err(format!(
                "the firmware answers mode {SAFE_STOP}, a safe stop, allowed: 0 to 1 while the motion is known"
            ));
        }
        let [x_m, y_m, yaw_rad] = last.pose.map(f64::from);
        let way = BodyTwist::from_array(answer.estimated.to_array().map(f64::from)).over(self.period_s);
        let there = PlanarPose { x_m, y_m, yaw_rad }.moved_by(&way);
        let there = [there.x_m, there.y_m, there.yaw_rad];
        let step_m = libm::hypot(way.dx_m, way.dy_m);
        let parts = [("x", step_m), ("y", step_m), ("yaw", way.dyaw_rad.abs())];
        for (i, (part, step)) in parts.into_iter().enumerate() {
            let (before, said) = (last.pose[i], now.pose[i]);
            // A sum of `f32` is right to half a unit in its last place, the one before and this one.
            let sums = f64::from(f32::EPSILON) * f64::from(before.abs() + said.abs());
            let off = f64::from(said) - there[i];
            let off = if part == "yaw" { off.wrapped_angle() } else { off };
            if off.abs() > ROUNDING * step + sums + f64::from(f32::MIN_POSITIVE) {
                return Err(format!(
                    "the firmware answers {said:?} as {part} of its pose, allowed: {:?}, the result of the twist that it reports",
                    there[i] as f32
                ));
            }
        }
        Ok(())
    }
}

/// When the torque has ended, there is none, and windings are shorted only then.
fn ended<const N: usize>(wheels: &omni_core::loops::WheelSample<f32, N>) -> Result<(), String> {
    let pushes = wheels.applied.n_m.iter().find(|torque| **torque != 0.0);
    match pushes.filter(|_| wheels.ended) {
        Some(torque) => Err(format!(
            "the firmware answers {torque} N.m although it reports that all torque has ended, allowed: 0"
        )),
        None if wheels.shorted && !wheels.ended => Err(
            "the firmware shorts the windings before the torque has ended, allowed: when it has ended".into(),
        ),
        None => Ok(()),
    }
}

/// Are the signals of an answer those of a controller that got what was sent? They go into logs and metrics.
fn plausible<const N: usize>(
    answer: &Answer<N>,
    measured_rad_s: &[f32; N],
    asked: &[f32; 3],
    drives: bool,
) -> Result<(), String> {
    let wheels = &answer.sample.wheels;
    let of_wheels = [
        ("reference", &wheels.reference.rad_s),
        ("measured velocity", &wheels.measured.rad_s),
        ("proportional term", &wheels.p_n_m),
        ("integral term", &wheels.i_n_m),
        ("derivative term", &wheels.d_n_m),
        ("feed-forward", &wheels.ff_n_m),
        ("requested torque", &wheels.requested.n_m),
        ("lower limit", &wheels.range.lower_n_m),
        ("upper limit", &wheels.range.upper_n_m),
        ("residual", &answer.residual.rad_s),
    ];
    for (signal, values) in of_wheels {
        if let Some((i, value)) = values.iter().enumerate().find(|(_, value)| !value.is_finite()) {
            return Err(format!(
                "the firmware answers {value} as {signal} of wheel {}, allowed: finite",
                i + 1
            ));
        }
    }
    let (command, estimated) = (answer.sample.command.to_array(), answer.estimated.to_array());
    let of_vehicle = estimated.iter().chain(&command).chain([&wheels.common_factor]);
    if let Some(value) = of_vehicle.into_iter().find(|value| !value.is_finite()) {
        return Err(format!(
            "the firmware answers {value} as a twist or common factor, allowed: finite"
        ));
    }
    let report = &answer.drive;
    if report.mode > MOST_MODE || report.faults.iter().any(|fault| *fault > MOST_FAULT) {
        return Err(format!(
            "the firmware answers mode {} and faults {:?}, allowed: 0 to {MOST_MODE} and 0 to {MOST_FAULT}",
            report.mode, report.faults
        ));
    }
    if let Some(value) = report.pose.iter().find(|value| !value.is_finite()) {
        return Err(format!(
            "the firmware answers {value} as a part of its pose, allowed: finite"
        ));
    }
    // A controller that has stopped repeats its last period; a released wheel has 0.
    let measured = (answer.action == Action::Step).then_some(&wheels.measured.rad_s);
    for (i, (said, sent)) in measured.into_iter().flatten().zip(measured_rad_s).enumerate() {
        // A drive judges readings: what it rejects it replaces.
        if said != sent && *said != 0.0 && !drives {
            return Err(format!(
                "the firmware answers {said} rad/s as measured velocity of wheel {}, allowed: {sent} (the value sent) or 0",
                i + 1
            ));
        }
    }
    for (said, most) in command.iter().zip(asked) {
        if said.abs() > most * (1.0 + ROUNDING as f32) {
            return Err(format!(
                "the firmware answers {said} as part of its command, allowed: -{most} to {most}, the largest command sent so far"
            ));
        }
    }
    Ok(())
}
