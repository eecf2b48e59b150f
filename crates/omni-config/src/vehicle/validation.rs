//! Checks across several keys: names that refer to each other, wheels that can move the vehicle, a stable shape.

use super::Vehicle;
use crate::Error;
use crate::load::Source;
use crate::suggestion::did_you_mean;
use crate::wheel_spec::{WheelContact, WheelSpec};

/// Wheels that push past their middle by less than this part of their distance from it do not turn the vehicle.
const LEAST_LEVER: f64 = 0.01;

impl Vehicle {
    /// Checks across several keys: names that refer to each other, and wheels that together move the vehicle.
    pub(super) fn check(&self, source: &Source) -> Result<(), Error> {
        if let Some(message) = self.motor.refusal() {
            return Err(source.refuse("motor", message));
        }
        own_names(source, self)?;
        unique(source, "body", self.body.iter().map(|b| &b.name))?;
        unique(source, "hinge", self.hinge.iter().map(|h| &h.name))?;
        unique(source, "coupling", self.coupling.iter().map(|c| &c.name))?;
        unique(source, "wheel", self.wheel.iter().map(|w| &w.name))?;
        let bodies = self.body.iter().map(|b| b.name.as_str()).collect::<Vec<_>>();
        let known = |key: String, name: &str| {
            if bodies.contains(&name) {
                Ok(())
            } else {
                let meant = did_you_mean(name, bodies.iter().copied());
                Err(source.refuse(key, format!("{name:?}{meant}, allowed: {}", bodies.join(", "))))
            }
        };
        // Hinges in file order grow the tree from the base: each parent is there already, each child is new.
        let mut joined = vec![bodies[0]];
        for (i, hinge) in self.hinge.iter().enumerate() {
            known(format!("hinge[{i}].parent"), &hinge.parent)?;
            known(format!("hinge[{i}].child"), &hinge.child)?;
            if !joined.contains(&hinge.parent.as_str()) {
                let allowed = joined.join(", ");
                let message = format!(
                    "{:?}, allowed: a body already joined to the base ({allowed})",
                    hinge.parent
                );
                return Err(source.refuse(format!("hinge[{i}].parent"), message));
            }
            if joined.contains(&hinge.child.as_str()) {
                let message = format!("{:?}, allowed: a body not yet joined to the base", hinge.child);
                return Err(source.refuse(format!("hinge[{i}].child"), message));
            }
            joined.push(&hinge.child);
        }
        if let Some(i) = bodies.iter().position(|b| !joined.contains(b)) {
            let message = format!(
                "{:?} is not the child of any hinge, allowed: every body except the first is the child of a hinge",
                bodies[i]
            );
            return Err(source.refuse(format!("body[{i}].name"), message));
        }
        for (i, wheel) in self.wheel.iter().enumerate() {
            known(format!("wheel[{i}].body"), &wheel.body)?;
            if let WheelContact::Roller { radius_m } = wheel.contact
                && radius_m >= wheel.radius_m
            {
                let message = format!(
                    "{radius_m}, allowed: less than the wheel's radius_m, {}",
                    wheel.radius_m
                );
                return Err(source.refuse(format!("wheel[{i}].contact.radius_m"), message));
            }
        }
        for i in 0..self.wheel.len() {
            if self.wheel[..i]
                .iter()
                .any(|earlier| alike(earlier, &self.wheel[i]))
            {
                continue; // its rollers fit as well
            }
            self.rollers_of(i)
                .transpose()
                .map_err(|(key, message)| source.refuse(key, message))?;
        }
        self.check_couplings(source)?;
        crate::controller::check_layout(self).map_err(|error| {
            let key = error
                .index
                .map_or_else(|| "wheel".to_owned(), |i| format!("wheel[{i}]"));
            let found = format!("{} = {}", error.parameter, error.value);
            let message = self.pushes_one_way().map_or_else(
                || format!("{found}, allowed: {}", error.allowed),
                |way| {
                    format!(
                        "all wheels push {way}, allowed: omni and mecanum wheels that push in different directions; plain, steered and tracked \
                         wheels are not supported"
                    )
                },
            );
            source.refuse(key, message)
        })?;
        self.check_levers(source)?;
        self.check_shape(source)
    }

    /// The direction, in words, where all wheels push in one.
    fn pushes_one_way(&self) -> Option<String> {
        let pushes = || {
            self.wheel.iter().map(|wheel| {
                let [x, y] = wheel.rolling_direction;
                libm::atan2(y, x) + wheel.roller_angle_rad
            })
        };
        let first = pushes().next()?;
        // Parallel: a difference of 0 or half a turn.
        pushes()
            .all(|push| libm::sin(push - first).abs() < 1e-6)
            .then(|| format!("{:.0} degrees from ahead", first.to_degrees()))
    }

    /// Do the wheels' pushes pass their middle at a distance that turns the vehicle?
    fn check_levers(&self, source: &Source) -> Result<(), Error> {
        let (lever_m, circle_m) = self.levers_m()?;
        if lever_m >= LEAST_LEVER * circle_m {
            return Ok(());
        }
        let message = format!(
            "roller_angle_rad: lever {lever_m:.1e} m, allowed: {LEAST_LEVER} of the wheels' distance from their middle, {circle_m:.3} m, or more, or \
             nothing turns the vehicle: on the ground the roller axes form a diamond"
        );
        Err(source.refuse("wheel", message))
    }

    fn check_couplings(&self, source: &Source) -> Result<(), Error> {
        for (i, coupling) in self.coupling.iter().enumerate() {
            for (end, name) in [("hinge_a", &coupling.hinge_a), ("hinge_b", &coupling.hinge_b)] {
                if !self.hinge.iter().any(|hinge| hinge.name == *name) {
                    let names = self.hinge.iter().map(|h| h.name.as_str()).collect::<Vec<_>>();
                    let meant = did_you_mean(name, names.iter().copied());
                    let message = format!("{name:?}{meant}, allowed: {}", names.join(", "));
                    return Err(source.refuse(format!("coupling[{i}].{end}"), message));
                }
            }
            if coupling.hinge_a == coupling.hinge_b {
                let message = format!("{:?}, allowed: another hinge than hinge_a", coupling.hinge_b);
                return Err(source.refuse(format!("coupling[{i}].hinge_b"), message));
            }
            if coupling.ratio.abs() < 1e-3 {
                let message = format!("{}, allowed: at least 0.001 or at most -0.001", coupling.ratio);
                return Err(source.refuse(format!("coupling[{i}].ratio"), message));
            }
        }
        Ok(())
    }
}

/// Names that viewers know: frames and joints of logs and URDFs are called after bodies, hinges and wheels.
fn own_names(source: &Source, vehicle: &Vehicle) -> Result<(), Error> {
    let bodies = vehicle.body.iter().skip(1).map(|body| &body.name);
    let hinges = vehicle.hinge.iter().map(|hinge| &hinge.name);
    let bodies = bodies.enumerate().map(|(i, name)| ("body", i + 1, name));
    for (list, i, name) in bodies.chain(hinges.enumerate().map(|(i, name)| ("hinge", i, name))) {
        let wheel = |w: &WheelSpec| name.strip_prefix("wheel_") == Some(w.name.as_str());
        if ["world", "odom", "base_link"].contains(&name.as_str()) || vehicle.wheel.iter().any(wheel) {
            let allowed = "any name except \"world\", \"odom\", \"base_link\" and \"wheel_\" with a wheel's name, which are frames of the logs";
            return Err(source.refuse(
                format!("{list}[{i}].name"),
                format!("{name:?}, allowed: {allowed}"),
            ));
        }
    }
    Ok(())
}

fn unique<'a>(source: &Source, list: &str, names: impl Iterator<Item = &'a String>) -> Result<(), Error> {
    let mut seen = Vec::new();
    for (i, name) in names.enumerate() {
        if seen.contains(&name) {
            return Err(source.refuse(
                format!("{list}[{i}].name"),
                format!("{name:?} twice, allowed: each name once"),
            ));
        }
        seen.push(name);
    }
    Ok(())
}

/// Do the same rollers fit both wheels?
fn alike(a: &WheelSpec, b: &WheelSpec) -> bool {
    let own = |w: &WheelSpec| match w.contact {
        WheelContact::Rollers(rollers) => Some(rollers),
        _ => None,
    };
    let shape = |w: &WheelSpec| [w.radius_m, w.roller_angle_rad, w.mass_kg, w.inertia_kg_m2];
    own(a) == own(b) && shape(a) == shape(b)
}
