//! Properties that follow from a vehicle file: mass, centre of mass, wheel loads, speeds.

use nalgebra::{DMatrix, DVector};
use omni_core::{ConfigError, Kinematics};

use crate::{Body, Error, Vehicle, for_wheel_count, wheel_count_refused};

impl Body {
    /// Moments of inertia of its box about the centre of mass, along x, y, z \[kg.m^2\].
    ///
    /// ```
    /// let platform = &omni_config::Vehicle::load("mecanum4")?.body[0]; // 20 kg, 0.60 x 0.40 x 0.20 m
    /// assert!((platform.inertia_kg_m2()[2] - 20.0 * (0.36 + 0.16) / 12.0).abs() < 1e-12);
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn inertia_kg_m2(&self) -> [f64; 3] {
        let [a, b, c] = self.inertia_box_m.map(|edge| edge * edge);
        [b + c, a + c, a + b].map(|sum| sum * (self.mass_kg / 12.0))
    }
}

/// Of scenarios; it enters where some wheels have a stiffness of their own and others have not.
const CONTACT_HZ: f64 = 200.0;

impl Vehicle {
    /// Mass of everything \[kg\].
    ///
    /// ```
    /// assert_eq!(omni_config::Vehicle::load("chugo7")?.mass_kg(), 20.0);
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn mass_kg(&self) -> f64 {
        self.weights().map(|(mass, _)| mass).sum()
    }

    /// Centre of mass of everything, as the vehicle stands on flat ground \[m\].
    ///
    /// ```
    /// let [x, y, _] = omni_config::Vehicle::load("omni3")?.centre_of_mass_m();
    /// assert!((x - 6.0 * 0.02 / 7.2).abs() < 1e-9 && y.abs() < 1e-9); // a base of 6 kg, 2 cm ahead of three wheels
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn centre_of_mass_m(&self) -> [f64; 3] {
        let total = self.mass_kg();
        [0, 1, 2].map(|axis| {
            self.weights()
                .map(|(mass, place)| mass * place[axis])
                .sum::<f64>()
                / total
        })
    }

    /// Masses \[kg\] and their places \[m\]: bodies, then wheels.
    pub(crate) fn weights(&self) -> impl Iterator<Item = (f64, [f64; 3])> {
        let bodies = self.body.iter().map(|body| (body.mass_kg, body.com_m));
        let wheels = self.wheel.iter().map(|wheel| {
            let [x, y] = wheel.position_m;
            (wheel.mass_kg, [x, y, wheel.radius_m])
        });
        bodies.chain(wheels)
    }

    /// How evenly the wheels move the vehicle in its three directions: 1 is best, above 100 is refused.
    ///
    /// # Errors
    /// [`Error::Key`] for wheels that cannot move it in three directions; a loaded vehicle has been checked.
    ///
    /// ```
    /// let chugo7 = omni_config::Vehicle::load("chugo7")?;
    /// assert!((chugo7.condition_number()? - 2.5_f64.sqrt()).abs() < 1e-9);
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn condition_number(&self) -> Result<f64, Error> {
        Ok(self.actuators()?.1)
    }

    /// Actuator velocities per unit of vx, vy and wz, one row a wheel, and the layout's condition number.
    pub(crate) fn actuators(&self) -> Result<(Vec<[f64; 3]>, f64), Error> {
        for_wheel_count!(self.wheel.len(), actuators[](self), |count| Err(
            wheel_count_refused(count)
        ))
        .map_err(|error| self.refuse(&error))
    }

    /// What omni-core refuses of it.
    pub(crate) fn refuse(&self, error: &ConfigError) -> Error {
        Error::Key {
            file: format!("vehicle {}", self.name),
            key: error.parameter.into(),
            message: error.to_string(),
        }
    }

    /// Velocities along x, y \[m/s\] and about z \[rad/s\] at which the fastest wheel's actuator
    /// turns with this velocity \[rad/s\], each alone.
    ///
    /// # Errors
    /// As [`Vehicle::condition_number`].
    ///
    /// ```
    /// let omni3 = omni_config::Vehicle::load("omni3")?;
    /// let [vx, vy, wz] = omni3.speeds_at(10.0)?;
    /// assert!((vy - 0.5).abs() < 1e-9); // wheel 1, of 50 mm, rolls sideways
    /// assert!((vx - 0.5 / 0.75_f64.sqrt()).abs() < 1e-6 && (wz - 0.5 / 0.18).abs() < 1e-6);
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn speeds_at(&self, actuator_rad_s: f64) -> Result<[f64; 3], Error> {
        let (rows, _) = self.actuators()?;
        Ok([0, 1, 2].map(|axis| {
            let fastest = rows.iter().map(|row| row[axis].abs()).fold(0.0, f64::max);
            actuator_rad_s / fastest
        }))
    }

    /// Push ahead of each wheel per torque of its actuator \[1/m\], where the wheels' pushes aside
    /// cancel: 0 of a wheel across.
    ///
    /// # Errors
    /// As [`Vehicle::condition_number`].
    ///
    /// ```
    /// let pushes = omni_config::Vehicle::load("omni3")?.pushes_ahead()?;
    /// // Wheel 1 rolls sideways, the others 30 degrees off ahead, on 50 mm; the file has their directions to eight digits.
    /// assert!(pushes[0] < 1e-9 && (pushes[1] - 0.75_f64.sqrt() / 0.05).abs() < 1e-6);
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn pushes_ahead(&self) -> Result<Vec<f64>, Error> {
        let (rows, _) = self.actuators()?;
        Ok(rows.iter().map(|[ahead, _, _]| ahead.abs()).collect())
    }

    /// The fastest that it goes ahead, aside \[m/s\] and about \[rad/s\]: of its limits and of what
    /// its motors turn without load, the least; infinite where neither says.
    ///
    /// # Errors
    /// As [`Vehicle::condition_number`].
    ///
    /// ```
    /// let [vx, vy, wz] = omni_config::Vehicle::load("mecanum4")?.top_speeds()?;
    /// assert_eq!([vx, vy, wz], [1.0, 0.8, 2.0]); // its limits: the motors reach 2.3 m/s
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn top_speeds(&self) -> Result<[f64; 3], Error> {
        let of_motors = self.motor_speeds()?.unwrap_or([f64::INFINITY; 3]);
        let allowed = self.limits.map_or([f64::INFINITY; 3], |limits| limits.speeds());
        Ok([0, 1, 2].map(|axis| of_motors[axis].min(allowed[axis])))
    }

    /// What its motors turn without load, ahead, aside \[m/s\] and about \[rad/s\]; none of motors
    /// whose line says nothing of that.
    pub(crate) fn motor_speeds(&self) -> Result<Option<[f64; 3]>, Error> {
        self.no_load_rad_s()
            .map(|no_load| self.speeds_at(no_load))
            .transpose()
    }

    /// Friction that accelerating takes of the wheel that has the least of it for its load, per
    /// m/s^2 ahead and aside and per rad/s^2 about, each alone on flat ground under this gravity:
    /// torques in proportion to how fast the wheels turn, as of equal loops.
    ///
    /// # Errors
    /// As [`Vehicle::condition_number`].
    ///
    /// ```
    /// let [ahead, aside, _] = omni_config::Vehicle::load("mecanum4")?.friction_taken(9.81)?;
    /// // Each of four wheels has a quarter of weight and inertia, and its force is 45 degrees off the way.
    /// assert!((ahead - 2.0_f64.sqrt() / 9.81).abs() < 1e-6 && (aside - ahead).abs() < 1e-6);
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn friction_taken(&self, gravity_m_s2: f64) -> Result<[f64; 3], Error> {
        let (rows, _) = self.actuators()?;
        let mass = self.mass_kg();
        let equal = || vec![mass * gravity_m_s2 / rows.len() as f64; rows.len()];
        let loads = self.static_loads_n(gravity_m_s2).unwrap_or_else(equal);
        let inertias = [mass, mass, self.yaw_inertia_kg_m2()];
        Ok([0, 1, 2].map(|axis| {
            let squares: f64 = rows.iter().map(|row| row[axis] * row[axis]).sum();
            let taken = rows.iter().zip(&loads).map(|(row, load)| {
                let torque = inertias[axis] * row[axis].abs() / squares;
                torque * libm::hypot(row[0], row[1]) / load
            });
            taken.fold(0.0, f64::max)
        }))
    }

    /// Velocity at which the motor's line reaches no torque \[rad/s\]; none for a constant limit.
    #[must_use]
    pub fn no_load_rad_s(&self) -> Option<f64> {
        self.motor.line_end_rad_s()
    }

    /// Load of every wheel at rest on flat ground under this gravity \[N\]; none where no loads of
    /// equally stiff contacts are in balance without one that pulls.
    ///
    /// The loads that balance the whole vehicle's weight and, about every hinge, the weight beyond it, couplings
    /// passing on their torques. Where that leaves them open (four wheels under a rigid platform), the ones of the
    /// smallest sum of squares: those of contacts that give alike; stiffer contacts and preloaded wheels take more.
    ///
    /// ```
    /// let load = omni_config::Vehicle::load("omni3")?.static_loads_n(9.81).expect("it stands");
    /// assert!((load[0] - (6.0 * 9.81 * (0.02 + 0.09) / 0.27 + 0.4 * 9.81)).abs() < 1e-6); // docs/validation.md
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn static_loads_n(&self, gravity_m_s2: f64) -> Option<Vec<f64>> {
        self.static_loads_with(gravity_m_s2, None)
    }

    /// [`Vehicle::static_loads_n`] where the hinge with that index, from 0, is blocked.
    pub(crate) fn static_loads_with(&self, gravity_m_s2: f64, blocked: Option<usize>) -> Option<Vec<f64>> {
        let (wheels, hinges) = (self.wheel.len(), self.hinge.len());
        // Rows: the whole vehicle's force and its moments about x and y; then the moment about each
        // hinge. Columns: the load of each wheel, then the torque of each coupling.
        let mut balance = DMatrix::zeros(3 + hinges, wheels + self.coupling.len());
        let mut weight = DVector::zeros(3 + hinges);
        let bodies = self
            .body
            .iter()
            .map(|body| (body.name.as_str(), body.mass_kg, [body.com_m[0], body.com_m[1]]));
        let carried = self
            .wheel
            .iter()
            .map(|wheel| (wheel.body.as_str(), wheel.mass_kg, wheel.position_m));
        for (body, mass, place) in bodies.chain(carried) {
            for (row, lever) in self.levers(body, place) {
                weight[row] += mass * gravity_m_s2 * lever;
            }
        }
        for (column, wheel) in self.wheel.iter().enumerate() {
            for (row, lever) in self.levers(&wheel.body, wheel.position_m) {
                balance[(row, column)] += lever;
            }
        }
        // In units in which a torque costs next to nothing beside a load, so that it never stands in for one.
        let free = 1e4;
        for (k, coupling) in self.coupling.iter().enumerate() {
            for (name, factor) in [(&coupling.hinge_a, 1.0), (&coupling.hinge_b, coupling.ratio)] {
                if let Some(i) = self.hinge.iter().position(|hinge| hinge.name == *name) {
                    balance[(3 + i, wheels + k)] += factor * free;
                }
            }
        }
        if let Some(hinge) = blocked {
            balance.row_mut(3 + hinge).fill(0.0);
            weight[3 + hinge] = 0.0;
        }
        let residual = |x: &DVector<f64>| (&balance * x - &weight).amax();
        // Contacts carry n = preload + k sink, and the sinks are those of rigid bodies: (n - preload) /
        // sqrt k is the smallest that balances. Only how stiff contacts are against each other counts.
        let stiffness = self
            .wheel
            .iter()
            .map(|wheel| wheel.contact_stiffness_n_m(CONTACT_HZ));
        let mean = stiffness.clone().sum::<f64>() / wheels as f64;
        let mut roots = DVector::from_element(balance.ncols(), 1.0);
        let mut preload = DVector::zeros(balance.ncols());
        for (i, (stiffness, wheel)) in stiffness.zip(&self.wheel).enumerate() {
            (roots[i], preload[i]) = ((stiffness / mean).sqrt(), wheel.preload_n);
        }
        let scaled = &balance * DMatrix::from_diagonal(&roots);
        let found = scaled
            .svd(true, true)
            .solve(&(&weight - &balance * &preload), 1e-8)
            .ok()?;
        let solved = preload + roots.component_mul(&found);
        let whole = weight[0];
        let stands =
            residual(&solved) <= 1e-6 * whole && solved.iter().take(wheels).all(|n| *n >= -1e-9 * whole);
        stands.then(|| solved.iter().take(wheels).copied().collect())
    }

    /// Rows of the balance that an upward force at a place on a body enters, and its lever there.
    fn levers(&self, body: &str, [x, y]: [f64; 2]) -> Vec<(usize, f64)> {
        let mut rows = vec![(0, 1.0), (1, y), (2, -x)];
        let mut body = body;
        // Up the tree: a hinge is listed after the one that carries its parent.
        for (i, hinge) in self.hinge.iter().enumerate().rev() {
            if hinge.child == body {
                let [ax, ay, az] = hinge.axis;
                let length = (ax * ax + ay * ay + az * az).sqrt();
                let [px, py, _] = hinge.anchor_m;
                rows.push((3 + i, (ax * (y - py) - ay * (x - px)) / length));
                body = &hinge.parent;
            }
        }
        rows
    }
}

fn actuators<const N: usize>(vehicle: &Vehicle) -> Result<(Vec<[f64; 3]>, f64), ConfigError> {
    let kinematics = Kinematics::<f64, N>::new(&vehicle.layout()?)?;
    Ok((
        kinematics.inverse_matrix().to_vec(),
        kinematics.condition_number(),
    ))
}
