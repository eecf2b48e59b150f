//! Notices about vehicles that are allowed but doubtful.

use omni_core::{ConfigError, Kinematics};

use crate::digits::digits;
use crate::{Error, Vehicle, WheelContact, WheelModel, WheelSpec, for_wheel_count, wheel_count_refused};

mod effort;
mod hands;
mod places;

/// A rim that is faster than this without load is doubtful \[m/s\]: rpm mistaken for rad/s.
const FAST_M_S: f64 = 6.0;
/// Motors whose thrust exceeds this multiple of the weight are doubtful: kg.cm mistaken for N.m.
const STRONG: f64 = 8.0;
/// Wheels are doubtful that are denser than steel \[kg/m^3\], as wide as they are high.
const DENSE_KG_M3: f64 = 9000.0;
/// Rollers are doubtful where the axle's height changes by more than this part of the wheel's radius.
const RIPPLE: f64 = 0.01;
/// A radius is doubtful that differs from the median of alike wheels by more than this part. Of one
/// batch, wear, load and casting change wheels by up to some 5 %, and a calibration finds that; the
/// next size that is sold differs by 10 % or more.
const SIZES: f64 = 0.08;
/// The same where all the other radii are exactly equal: a calibration gives each wheel digits of
/// its own, so only one was edited.
const ALONE: f64 = 0.04;
/// Limits are doubtful beyond what the motors reach by more than this part.
const BEYOND: f64 = 1.05;

impl Vehicle {
    /// Doubts about it with this control period \[s\], one line each: nothing here is an error, but each is worth a
    /// second look.
    ///
    /// # Errors
    /// As [`Vehicle::derived_gains`].
    ///
    /// ```
    /// use omni_config::{Override, Scenario, Vehicle};
    /// assert!(Vehicle::load("mecanum4")?.doubts(1e-3)?.is_empty());
    /// let heavy = Override::parse("vehicle.wheel[0].inertia_kg_m2=0.01")?;
    /// let doubts = Scenario::load("step", &[heavy])?.vehicle().doubts(1e-3)?;
    /// let said = "wheel 1: inertia_kg_m2 = 0.01, but all its mass at the rim gives 0.00436 (m r^2); a larger value is right only for a geared rotor";
    /// assert_eq!(doubts, [said]);
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn doubts(&self, period_s: f64) -> Result<Vec<String>, Error> {
        let mut doubts = Vec::new();
        doubts.extend(self.unreplaceable()?);
        let (mirrored, misplaced) = (self.mirrored_rollers()?, self.misplaced());
        let wrong_inertia = mirrored.is_some() || !misplaced.is_empty();
        doubts.extend(mirrored);
        doubts.extend(self.wrong_hand()?);
        let wheels = self.wheel.iter().filter(|_| !self.with_rotors);
        doubts.extend(wheels.filter_map(flywheel));
        doubts.extend(self.too_dense());
        doubts.extend(self.gaps());
        doubts.extend(self.too_strong()?);
        doubts.extend(self.too_lossy()?);
        doubts.extend(misplaced);
        doubts.extend(self.unequal_wheels());
        doubts.extend(self.no_load_rad_s().and_then(|no_load| self.too_fast(no_load)));
        doubts.extend(self.never_reached()?);
        // Gains are compared with what follows from the inertia: where that is doubtful, they are not yet.
        if !wrong_inertia {
            doubts.extend(self.wrong_gains(period_s)?);
        }
        Ok(doubts)
    }

    /// Reason why it does not stand on flat ground as described by its file; none if it does.
    ///
    /// ```
    /// use omni_config::{Source, Vehicle, FileKind};
    /// assert_eq!(Vehicle::load("rocker_bogie6")?.falls(9.81), None);
    /// let mut without = Vehicle::load("rocker_bogie6")?;
    /// without.coupling.clear();
    /// let why = without.falls(9.81).expect("its body falls on its nose");
    /// assert!(why.starts_with("hinge rocker_left, rocker_right: nothing holds body body"), "{why}");
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn falls(&self, gravity_m_s2: f64) -> Option<String> {
        if self.static_loads_n(gravity_m_s2).is_some() {
            return None;
        }
        if self.wheel.iter().any(|wheel| wheel.preload_n != 0.0) {
            return Some("preload_n: with these preloads a wheel does not touch the ground".into());
        }
        let hinges = self.hinge.iter().enumerate();
        let loose: Vec<_> = hinges
            .filter(|(index, _)| self.static_loads_with(gravity_m_s2, Some(*index)).is_some())
            .map(|(_, hinge)| hinge)
            .collect();
        let Some(first) = loose.first() else {
            return Some(
                "no loads of the wheels balance the weight: at rest on flat ground the vehicle tips over, or a body falls to the stop of its \
                 hinge; check com_m, position_m and anchor_m"
                    .into(),
            );
        };
        let names: Vec<_> = loose.iter().map(|hinge| hinge.name.as_str()).collect();
        Some(format!(
            "hinge {}: nothing holds body {} about it: at rest on flat ground it falls to the stop, limit_rad = {}; add a [[coupling]] or \
             move com_m, position_m or anchor_m",
            names.join(", "),
            first.parent,
            first.limit_rad
        ))
    }

    /// A wheel whose radius differs from the other wheels with its kind of contact, for example after a change of this
    /// wheel alone.
    fn unequal_wheels(&self) -> Option<String> {
        let (other, median_m) = self.wheel.iter().find_map(|wheel| {
            let kind = std::mem::discriminant(&wheel.contact);
            let alike = |each: &&WheelSpec| std::mem::discriminant(&each.contact) == kind;
            let mut radii: Vec<_> = self
                .wheel
                .iter()
                .filter(alike)
                .map(|each| each.radius_m)
                .collect();
            radii.sort_by(f64::total_cmp);
            let median_m = radii[radii.len() / 2];
            let equal = radii.iter().filter(|radius_m| **radius_m == median_m).count();
            let alone = equal > 1 && equal + 1 == radii.len();
            let off = (wheel.radius_m / median_m - 1.0).abs();
            (off > if alone { ALONE } else { SIZES }).then_some((wheel, median_m))
        })?;
        Some(format!(
            "wheel {}: radius_m = {}, {} % off {median_m}, the median of the wheels; check whether only one wheel was changed",
            other.name,
            other.radius_m,
            digits(100.0 * (other.radius_m / median_m - 1.0).abs())
        ))
    }

    /// Wheels without which the others do not determine the motion.
    fn unreplaceable(&self) -> Result<Option<String>, Error> {
        // Of three wheels every one is, whatever the file says.
        if self.wheel.len() == 3 {
            return Ok(None);
        }
        let alone: Vec<bool> = for_wheel_count!(self.wheel.len(), unreplaceable[](self), |count| Err(
            wheel_count_refused(count)
        ))
        .map_err(|error| self.refuse(&error))?;
        let wheels = self.wheel.iter().zip(alone);
        let names: Vec<_> = wheels
            .filter_map(|(wheel, alone)| alone.then_some(wheel.name.as_str()))
            .collect();
        Ok((!names.is_empty()).then(|| {
            format!(
                "wheel {}: without its reading the motion is unknown, and the drive stops",
                names.join(", ")
            )
        }))
    }

    /// Wheels that are denser than steel.
    fn too_dense(&self) -> Option<String> {
        let kg_m3 = |wheel: &WheelSpec| {
            wheel.mass_kg / (core::f64::consts::PI * wheel.radius_m * wheel.radius_m * 2.0 * wheel.radius_m)
        };
        let dense: Vec<_> = self
            .wheel
            .iter()
            .filter(|wheel| kg_m3(wheel) > DENSE_KG_M3)
            .collect();
        let first = dense.first()?;
        let names: Vec<_> = dense.iter().map(|wheel| wheel.name.as_str()).collect();
        Some(format!(
            "wheel {}: mass_kg = {} with radius_m = {}: {} kg a litre, even as wide as it is high, and steel has 7.9",
            names.join(", "),
            first.mass_kg,
            first.radius_m,
            digits(kg_m3(first) / 1000.0)
        ))
    }

    /// Rollers between which a wheel falls.
    fn gaps(&self) -> Option<String> {
        let (wheel, built, ripple) = self.wheel.iter().enumerate().find_map(|(index, wheel)| {
            let built = self.rollers(index, WheelModel::Rollers)?;
            let ripple = built.ripple().part();
            (ripple > RIPPLE).then_some((wheel, built, ripple))
        })?;
        let rollers = match wheel.contact {
            WheelContact::Rollers(own) => own,
            _ => self.rollers?,
        };
        let mend = match rollers.closing_radius_m(wheel) {
            Some(radius_m) => format!("with radius_m = {radius_m} they leave none"),
            None => "use more rollers or two rows".into(),
        };
        Some(format!(
            "wheel {}: between its {} rollers of radius_m = {} are gaps, the axle falls by {:.1} % of the wheel's radius; {mend}",
            wheel.name,
            built.rows * built.count,
            rollers.radius_m,
            100.0 * ripple
        ))
    }

    /// Motors that are too strong for so light a vehicle.
    fn too_strong(&self) -> Result<Option<String>, Error> {
        let (rows, _) = self.actuators()?;
        let stall = self.motor.stall_torque_n_m;
        let push_n =
            self.motor.peak_torque_n_m() * rows.iter().map(|[ax, ay, _]| libm::hypot(*ax, *ay)).sum::<f64>();
        let times = push_n / (9.81 * self.mass_kg());
        Ok((times > STRONG).then(|| {
            format!(
                "motor.stall_torque_n_m = {stall}: the wheels push with {} times the weight; {stall} kg.cm are {} N.m",
                digits(times),
                digits(stall * 0.098_066_5)
            )
        }))
    }

    /// Wheels that no vehicle drives so fast.
    fn too_fast(&self, no_load_rad_s: f64) -> Option<String> {
        let rim_m_s = |wheel: &WheelSpec| no_load_rad_s * wheel.gear * wheel.radius_m;
        let wheel = self.wheel.iter().find(|wheel| rim_m_s(wheel) > FAST_M_S)?;
        Some(format!(
            "motor: {} rad/s without load, {} m/s at the rim of wheel {}; use no_load_rpm if the value is in rpm",
            digits(no_load_rad_s),
            digits(rim_m_s(wheel)),
            wheel.name
        ))
    }

    /// Limits that are none: the motors are slower.
    fn never_reached(&self) -> Result<Vec<String>, Error> {
        let (Some(limits), Some(reached)) = (self.limits, self.motor_speeds()?) else {
            return Ok(Vec::new());
        };
        let own = ["vx_m_s", "vy_m_s", "wz_rad_s"].into_iter().zip(limits.speeds());
        let beyond = own.zip(reached).filter(|((_, limit), top)| *limit > BEYOND * top);
        Ok(beyond
            .map(|((key, limit), top)| {
                format!(
                    "limits.{key} = {limit}, but the motors reach only {} without load",
                    digits(top)
                )
            })
            .collect())
    }

    /// How far from the wheels' middle their pushes pass it, and how far the wheels are from it,
    /// roots of mean squares \[m\].
    pub(crate) fn levers_m(&self) -> Result<(f64, f64), Error> {
        let (rows, _) = self.actuators()?;
        let count = self.wheel.len() as f64;
        let [cx, cy] =
            [0, 1].map(|axis| self.wheel.iter().map(|wheel| wheel.position_m[axis]).sum::<f64>() / count);
        let squares = rows.iter().map(|[ax, ay, turned]| {
            let about_the_middle = turned + ax * cy - ay * cx;
            about_the_middle * about_the_middle / (ax * ax + ay * ay)
        });
        let circle = self.wheel.iter().map(|wheel| {
            let [x, y] = wheel.position_m;
            (x - cx) * (x - cx) + (y - cy) * (y - cy)
        });
        Ok((
            (squares.sum::<f64>() / count).sqrt(),
            (circle.sum::<f64>() / count).sqrt(),
        ))
    }
}

/// Why a wheel's inertia is more than its mass can have.
fn flywheel(wheel: &WheelSpec) -> Option<String> {
    let most = wheel.mass_kg * wheel.radius_m * wheel.radius_m;
    (wheel.inertia_kg_m2 > most).then(|| {
        format!(
            "wheel {}: inertia_kg_m2 = {}, but all its mass at the rim gives {} (m r^2); a larger value is right only for a geared rotor",
            wheel.name,
            wheel.inertia_kg_m2,
            digits(most)
        )
    })
}

/// Of each wheel whether the motion is unknown without it.
fn unreplaceable<const N: usize>(vehicle: &Vehicle) -> Result<Vec<bool>, ConfigError> {
    let kinematics = Kinematics::<f64, N>::new(&vehicle.layout()?)?;
    let without = |wheel: usize| {
        let excluded = core::array::from_fn(|each| each == wheel);
        kinematics.excluding(&excluded).is_none()
    };
    Ok((0..N).map(without).collect())
}
