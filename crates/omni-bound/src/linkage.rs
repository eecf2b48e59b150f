//! The vehicle in the plane of its climb: two frames on one hinge, three rows of wheels.

use omni_config::{Body, Hinge, Vehicle, WheelSpec};

use crate::Error;

/// How exactly wheels of a row stand side by side, and axes along or across \[m, 1\].
const ALIKE: f64 = 1e-3;

/// Of scenarios; it enters where some wheels have a stiffness of their own and others have not.
const CONTACT_HZ: f64 = 200.0;

/// A rigid frame with what is fixed to it, its wheels' masses included.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Frame {
    pub(crate) mass_kg: f64,
    /// Centre of mass from the hinge, on flat ground \[m\]: forward, up.
    pub(crate) centre_m: [f64; 2],
    /// About the centre of mass, across the way \[kg.m^2\].
    pub(crate) inertia_kg_m2: f64,
}

/// Wheels side by side.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct WheelRow {
    /// Names, in the vehicle's order.
    pub(crate) wheels: Vec<String>,
    /// The frame that carries it.
    pub(crate) frame: usize,
    /// Axle from the hinge, on flat ground \[m\]: forward, up.
    pub(crate) axle_m: [f64; 2],
    pub(crate) radius_m: f64,
    /// Part of its load that wheels across the way carry on level ground, 0 to less than 1.
    pub(crate) crosswise: f64,
    /// Torque of all its wheels about the axle for each N.m of an actuator: the sum of 1 / gear
    /// over those that roll along the way.
    pub(crate) torques: f64,
    /// Inertia of the wheels that roll along the way, about their axles \[kg.m^2\].
    pub(crate) spin_kg_m2: f64,
}

/// A vehicle in the plane of its climb: two frames on one transverse hinge, three rows of wheels, two rows on one frame
/// and one on the other.
///
/// Masses, centres of mass, inertias, places, radii and gears are the vehicle file's. Bodies that are joined only by
/// longitudinal or vertical hinges are one frame: on a straight approach these hinges do not turn. Hinges have no
/// dampers here, which makes climbs easier. Wheels of a row that stands on level ground share its load by the stiffness
/// of their contacts.
///
/// ```
/// use omni_bound::{Linkage, Step};
/// let chugo7 = Linkage::new(&omni_config::Vehicle::load("chugo7")?)?;
/// assert!((chugo7.mass_kg() - 20.0).abs() < 1e-12);
/// // Five wheels of 1 kg that turn as discs: half their mass again.
/// assert!((chugo7.driving_mass_kg() - 22.5).abs() < 1e-9);
/// # Ok::<(), omni_bound::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Linkage {
    pub(crate) name: String,
    /// The frame with two rows, then the one with one.
    pub(crate) frames: [Frame; 2],
    /// The front row first.
    pub(crate) rows: [WheelRow; 3],
    /// Range of the hinge \[rad\].
    pub(crate) stop_rad: f64,
    /// Height of the hinge on flat ground \[m\].
    pub(crate) hinge_m: f64,
}

impl Linkage {
    /// The linkage of a vehicle.
    ///
    /// # Errors
    /// [`Error::Vehicle`] for a vehicle that is no such linkage: not exactly one transverse hinge, oblique hinges,
    /// couplings, other than three rows, a row on two frames or with unequal radii, three rows on one frame, wheels
    /// that are neither longitudinal nor transverse, rows without a longitudinal wheel.
    ///
    /// ```
    /// let mecanum4 = omni_config::Vehicle::load("mecanum4")?;
    /// let said = omni_bound::Linkage::new(&mecanum4).unwrap_err().to_string();
    /// assert!(said.starts_with("vehicle mecanum4: it has 0 transverse hinges"), "{said}");
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn new(vehicle: &Vehicle) -> Result<Self, Error> {
        let refused = |reason: String| Error::Vehicle {
            vehicle: vehicle.name.clone(),
            reason,
        };
        Self::described(vehicle).map_err(refused)
    }

    fn described(vehicle: &Vehicle) -> Result<Self, String> {
        if !vehicle.coupling.is_empty() {
            return Err("its hinges are coupled".into());
        }
        let across = hinge_across(&vehicle.hinge)?;
        let [hinge_x, _, hinge_z] = across.anchor_m;
        let from_hinge = |x: f64, z: f64| [x - hinge_x, z - hinge_z];
        let beyond = beyond(vehicle, across);
        let side = |body: &str| {
            let index = vehicle.body.iter().position(|each| each.name == body);
            usize::from(index.is_some_and(|index| beyond[index]))
        };

        let rows = vehicle.rows();
        let rows: Vec<WheelRow> = rows
            .iter()
            .map(|row| {
                let wheels: Vec<&WheelSpec> = row.wheels.iter().map(|i| &vehicle.wheel[*i]).collect();
                wheel_row(&wheels, side, from_hinge)
            })
            .collect::<Result<_, _>>()?;
        let count = rows.len();
        let mut rows: [WheelRow; 3] = rows
            .try_into()
            .map_err(|_| format!("it has {count} rows of wheels"))?;

        let mut parts: [Vec<(f64, [f64; 2], f64)>; 2] = [Vec::new(), Vec::new()];
        for body in &vehicle.body {
            let [x, _, z] = body.com_m;
            parts[side(&body.name)].push((body.mass_kg, from_hinge(x, z), across_of(body)));
        }
        for wheel in &vehicle.wheel {
            let place = from_hinge(wheel.position_m[0], wheel.radius_m);
            parts[side(&wheel.body)].push((wheel.mass_kg, place, 0.0));
        }
        let mut frames = parts.map(|parts| joined(&parts));

        let with_one = match rows.iter().filter(|row| row.frame == 1).count() {
            1 => 1,
            2 => 0,
            all => {
                return Err(format!(
                    "one of its frames carries {} rows of wheels",
                    all.max(3 - all)
                ));
            }
        };
        if with_one == 0 {
            frames.swap(0, 1);
            for row in &mut rows {
                row.frame = 1 - row.frame;
            }
        }
        if rows
            .iter()
            .any(|row| row.frame == 1 && row.axle_m[0].abs() < ALIKE)
        {
            return Err("the only row of one frame is right below the hinge".into());
        }
        Ok(Self {
            name: vehicle.name.clone(),
            frames,
            rows,
            stop_rad: across.limit_rad,
            hinge_m: hinge_z,
        })
    }

    /// Mass of everything \[kg\].
    #[must_use]
    pub fn mass_kg(&self) -> f64 {
        self.frames.iter().map(|frame| frame.mass_kg).sum()
    }

    /// Effective mass on level ground \[kg\]: its mass, and the equivalent mass of turning wheels at their rims, I /
    /// r^2.
    #[must_use]
    pub fn driving_mass_kg(&self) -> f64 {
        let rims = self.rows.iter().map(|row| row.spin_kg_m2 / row.radius_m.powi(2));
        self.mass_kg() + rims.sum::<f64>()
    }
}

/// The one hinge that turns in the plane of the climb.
fn hinge_across(hinges: &[Hinge]) -> Result<&Hinge, String> {
    let part_across = |hinge: &Hinge| {
        let [x, y, z] = hinge.axis;
        y.abs() / (x * x + y * y + z * z).sqrt()
    };
    if let Some(oblique) = hinges
        .iter()
        .find(|hinge| (ALIKE..1.0 - ALIKE).contains(&part_across(hinge)))
    {
        return Err(format!("the axis of its hinge {} is oblique", oblique.name));
    }
    let across: Vec<&Hinge> = hinges.iter().filter(|hinge| part_across(hinge) > 0.5).collect();
    match across[..] {
        [one] => Ok(one),
        _ => Err(format!("it has {} transverse hinges", across.len())),
    }
}

/// Which bodies lie beyond a hinge, on its child's side.
fn beyond(vehicle: &Vehicle, across: &Hinge) -> Vec<bool> {
    let mut beyond: Vec<bool> = vehicle
        .body
        .iter()
        .map(|body| body.name == across.child)
        .collect();
    // A tree: as many rounds as there are hinges reach every body.
    for _ in &vehicle.hinge {
        for hinge in vehicle.hinge.iter().filter(|hinge| hinge.name != across.name) {
            let index = |name: &str| vehicle.body.iter().position(|body| body.name == name);
            if let (Some(parent), Some(child)) = (index(&hinge.parent), index(&hinge.child)) {
                beyond[child] |= beyond[parent];
            }
        }
    }
    beyond
}

/// Inertia of a body's box about its centre of mass, across the way \[kg.m^2\].
fn across_of(body: &Body) -> f64 {
    body.inertia_kg_m2()[1]
}

/// Masses, places and inertias as one.
fn joined(parts: &[(f64, [f64; 2], f64)]) -> Frame {
    let mass_kg: f64 = parts.iter().map(|(mass, ..)| mass).sum();
    let centre_m = [0, 1].map(|axis| {
        let moment: f64 = parts.iter().map(|(mass, place, _)| mass * place[axis]).sum();
        moment / mass_kg
    });
    let about = |(mass, [x, z], own): &(f64, [f64; 2], f64)| {
        own + mass * ((x - centre_m[0]).powi(2) + (z - centre_m[1]).powi(2))
    };
    Frame {
        mass_kg,
        centre_m,
        inertia_kg_m2: parts.iter().map(about).sum(),
    }
}

fn wheel_row(
    wheels: &[&WheelSpec],
    side: impl Fn(&str) -> usize,
    from_hinge: impl Fn(f64, f64) -> [f64; 2],
) -> Result<WheelRow, String> {
    let first = wheels[0];
    let (x, radius) = (first.position_m[0], first.radius_m);
    let mut row = WheelRow {
        wheels: wheels.iter().map(|wheel| wheel.name.clone()).collect(),
        frame: side(&first.body),
        axle_m: from_hinge(x, radius),
        radius_m: radius,
        crosswise: 0.0,
        torques: 0.0,
        spin_kg_m2: 0.0,
    };
    let (mut across_n_m, mut all_n_m) = (0.0, 0.0);
    for wheel in wheels {
        let name = &wheel.name;
        if side(&wheel.body) != row.frame {
            return Err(format!(
                "wheels {} and {name} are in one row but on two frames",
                first.name
            ));
        }
        if (wheel.radius_m / radius - 1.0).abs() > ALIKE {
            return Err(format!(
                "wheels {} and {name} are in one row but differ in radius",
                first.name
            ));
        }
        if (wheel.position_m[0] - x).abs() > ALIKE {
            return Err(format!(
                "wheels {} and {name} are in one row but differ in x",
                first.name
            ));
        }
        let [along, across] = wheel.rolling_direction.map(f64::abs);
        let length = along.hypot(across);
        if wheel.roller_angle_rad.abs() > ALIKE || (along.min(across) / length) > ALIKE {
            return Err(format!("wheel {name} rolls neither forward nor sideways"));
        }
        if along > across {
            row.torques += 1.0 / wheel.gear.abs();
            row.spin_kg_m2 += wheel.inertia_kg_m2;
        } else {
            across_n_m += wheel.contact_stiffness_n_m(CONTACT_HZ);
        }
        all_n_m += wheel.contact_stiffness_n_m(CONTACT_HZ);
    }
    // Load that preloads remove from transverse wheels is not included in a share: they then carry nothing, the easiest
    // case.
    if wheels.iter().all(|wheel| wheel.preload_n == 0.0) {
        row.crosswise = across_n_m / all_n_m;
    }
    if row.torques == 0.0 {
        return Err(format!(
            "no wheel in the row of wheel {} rolls forward",
            first.name
        ));
    }
    Ok(row)
}
