//! The verdict for each row: what a climb takes, and whether the vehicle has it.

use omni_config::{Scenario, Terrain};
use serde::Serialize;

use crate::Error;
use crate::balance::{Ask, best};
use crate::climb_path::{Misfit, Posture};
use crate::linkage::Linkage;
use crate::step::Step;

/// Points of a row's path, from first touch to on top.
const POINTS: usize = 65;

/// Names of the rows.
const ROWS: [&str; 3] = ["front", "middle", "rear"];

/// Less than this deficit is none, of the energy that lifts the vehicle by the step: what rounding makes of zero.
const NO_DEFICIT: f64 = 1e-9;

/// Whether a row can climb, with the torque and at the speed given.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Verdict {
    /// The torque suffices at any speed, as slow as one likes.
    Torque,
    /// The torque does not suffice, the run-up makes up for it even where the impact leaves no more
    /// than the motion along the path.
    RunUp,
    /// Not excluded: it depends on what the impact leaves.
    Open,
    /// Whatever the impact leaves: the energy does not suffice.
    Impossible,
}

impl Verdict {
    /// The name in tables, as `run_up`.
    ///
    /// ```
    /// assert_eq!(omni_bound::Verdict::RunUp.name(), "run_up");
    /// ```
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Torque => "torque",
            Self::RunUp => "run_up",
            Self::Open => "open",
            Self::Impossible => "impossible",
        }
    }
}

/// What the climb of one row takes.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct RowLimits {
    /// `front`, `middle` or `rear`.
    pub row: &'static str,
    /// Names of its wheels, in the vehicle's order.
    pub wheels: Vec<String>,
    /// Least torque of an actuator that lifts it as slowly as one likes \[N.m\]; infinite where
    /// none does, and null in JSON.
    pub least_torque_n_m: f64,
    /// Energy that the torque given lacks, from first touch to the worst point of the path \[J\]; 0 where it suffices.
    pub deficit_j: f64,
    /// Inertia of the motion along the path right after the impact, over the square of the hinge's way \[kg\].
    pub path_mass_kg: f64,
    /// Part of the run-up's kinetic energy that the impact leaves at most, 0 to 1.
    pub kept_at_most: f64,
    /// The part that it leaves where all of it has to go along the path, 0 to `kept_at_most`.
    pub kept_on_path: f64,
    /// Below this run-up the row does not climb, whatever the impact leaves \[m/s\].
    pub run_up_m_s: f64,
    /// From this run-up on the energy suffices where the impact leaves the motion along the path
    /// \[m/s\]; infinite where it leaves none.
    pub path_run_up_m_s: f64,
    /// With the torque and at the speed given.
    pub verdict: Verdict,
}

/// What the climb of a vehicle takes, beside what it has.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ClimbLimits {
    /// The vehicle's name.
    pub vehicle: String,
    /// The step.
    pub step: Step,
    /// Torque of each actuator \[N.m\].
    pub torque_n_m: f64,
    /// Speed at which each row meets the edge \[m/s\].
    pub speed_m_s: f64,
    /// The front row first.
    pub rows: [RowLimits; 3],
}

impl ClimbLimits {
    /// Is the climb not excluded?
    ///
    /// ```
    /// let step = omni_config::Scenario::load("step", &[])?;
    /// assert!(omni_bound::ClimbLimits::of(&step)?.possible());
    /// # Ok::<(), omni_bound::Error>(())
    /// ```
    #[must_use]
    pub fn possible(&self) -> bool {
        self.rows.iter().all(|row| row.verdict != Verdict::Impossible)
    }

    /// Index of the row that decides, from 0 at the front: the one that needs the most run-up;
    /// where none needs any, the most torque.
    ///
    /// ```
    /// let step = omni_config::Scenario::load("step", &[])?;
    /// assert_eq!(omni_bound::ClimbLimits::of(&step)?.decisive(), 1); // wheel 4 is the hardest
    /// # Ok::<(), omni_bound::Error>(())
    /// ```
    #[must_use]
    pub fn decisive(&self) -> usize {
        let need = |row: &RowLimits| [row.run_up_m_s, row.path_run_up_m_s, row.least_torque_n_m];
        let mut most = 0;
        for index in 1..3 {
            if need(&self.rows[index]) > need(&self.rows[most]) {
                most = index;
            }
        }
        most
    }

    /// The limits of a scenario: its vehicle, its step, its motors' torque at rest, and the fastest
    /// that it is commanded to drive ahead.
    ///
    /// # Errors
    /// [`Error::Config`] for a scenario without a plain step, with patches of other friction, that meets it
    /// with another heading than 0, or is commanded to go aside or to turn; and as [`Linkage::climb_limits`].
    ///
    /// ```
    /// use omni_config::{Override, Scenario};
    /// let weak = Override::parse("vehicle.motor.stall_torque_n_m=1.0")?;
    /// let limits = omni_bound::ClimbLimits::of(&Scenario::load("step", &[weak])?)?;
    /// assert_eq!((limits.torque_n_m, limits.speed_m_s), (1.0, 0.3));
    /// assert!(limits.rows.iter().all(|row| row.deficit_j > 0.0)); // 1.3 N.m lift the front row
    /// # Ok::<(), omni_bound::Error>(())
    /// ```
    pub fn of(scenario: &Scenario) -> Result<Self, Error> {
        let refused = |key: &str, message: &str| {
            Error::Config(omni_config::Error::Key {
                file: format!("scenario {}", scenario.name),
                key: key.into(),
                message: message.into(),
            })
        };
        let Terrain::Step {
            friction, height_m, ..
        } = scenario.terrain
        else {
            return Err(refused(
                "terrain.kind",
                "not a plain step, allowed for climb limits: \"step\"",
            ));
        };
        if !scenario.block.is_empty() {
            return Err(refused(
                "block",
                "more than the step, allowed for climb limits: none",
            ));
        }
        if !scenario.friction_patch.is_empty() {
            return Err(refused(
                "friction_patch",
                "friction changes, allowed for climb limits: none",
            ));
        }
        if scenario.start.heading_rad != 0.0 {
            let message = format!("{}, allowed for climb limits: 0", scenario.start.heading_rad);
            return Err(refused("start.heading_rad", &message));
        }
        let command = &scenario.command;
        for (key, given) in [
            ("command.path", command.path.is_some()),
            ("command.file", command.file.is_some()),
        ] {
            if given {
                return Err(refused(
                    key,
                    "given, allowed for climb limits: a twist straight ahead",
                ));
            }
        }
        let aside = [
            ("command.vy_m_s", command.vy_m_s),
            ("command.wz_rad_s", command.wz_rad_s),
        ];
        let later = command.then.iter().enumerate().flat_map(|(i, then)| {
            [
                (format!("command.then[{i}].vy_m_s"), then.vy_m_s),
                (format!("command.then[{i}].wz_rad_s"), then.wz_rad_s),
            ]
        });
        let mut other = aside
            .map(|(key, value)| (key.to_owned(), value))
            .into_iter()
            .chain(later);
        if let Some((key, value)) = other.find(|(_, value)| *value != 0.0) {
            return Err(refused(&key, &format!("{value}, allowed for climb limits: 0")));
        }
        let later = command.then.iter().map(|then| then.vx_m_s);
        let speed_m_s = later.fold(command.vx_m_s, f64::max).max(0.0);
        let vehicle = scenario.vehicle();
        let step = Step {
            gravity_m_s2: scenario.physics.gravity_m_s2,
            ..Step::new(height_m, friction)?
        };
        let found = Linkage::new(vehicle)?.climb_limits(&step, vehicle.motor.peak_torque_n_m(), speed_m_s);
        found.map_err(|error| match error {
            Error::Argument {
                name: "height_m",
                value,
                allowed,
            } => refused("terrain.height_m", &format!("{value}, allowed: {allowed}")),
            other => other,
        })
    }
}

impl Linkage {
    /// What the climb of a step takes, beside the torque of each actuator \[N.m\], 0 or more, and
    /// the speed at which each row meets the edge \[m/s\], 0 or more.
    ///
    /// # Errors
    /// [`Error::Argument`] for a torque or speed that is negative or not finite, and a step as high
    /// as a wheel's radius or higher; [`Error::Vehicle`] where the linkage does not reach so high,
    /// meets its stop, or another row is at the edge meanwhile.
    ///
    /// ```
    /// use omni_bound::{Linkage, Step, Verdict};
    /// let chugo7 = Linkage::new(&omni_config::Vehicle::load("chugo7")?)?;
    /// let limits = chugo7.climb_limits(&Step::new(0.05, 0.7)?, 1.4, 0.3)?;
    /// let [front, middle, rear] = &limits.rows;
    /// assert!((front.least_torque_n_m - 1.33).abs() < 0.01 && front.verdict == Verdict::Torque);
    /// assert!((middle.least_torque_n_m - 2.49).abs() < 0.01 && middle.deficit_j > 0.1);
    /// assert!(rear.least_torque_n_m.is_infinite()); // without a run-up never
    /// # Ok::<(), omni_bound::Error>(())
    /// ```
    pub fn climb_limits(&self, step: &Step, torque_n_m: f64, speed_m_s: f64) -> Result<ClimbLimits, Error> {
        for (name, value) in [("torque_n_m", torque_n_m), ("speed_m_s", speed_m_s)] {
            if !(0.0..=1e9).contains(&value) {
                let allowed = "0 to 1e9".into();
                return Err(Error::Argument { name, value, allowed });
            }
        }
        let lowest = self
            .rows
            .iter()
            .map(|row| row.radius_m)
            .fold(f64::INFINITY, f64::min);
        if step.height_m >= lowest {
            return Err(Error::Argument {
                name: "height_m",
                value: step.height_m,
                allowed: format!(
                    "less than {lowest}, the radius of the wheels: wheels cannot climb an edge above their axle"
                ),
            });
        }
        let row = |row| self.row_limits(row, step, torque_n_m, speed_m_s);
        Ok(ClimbLimits {
            vehicle: self.name.clone(),
            step: *step,
            torque_n_m,
            speed_m_s,
            rows: [row(0)?, row(1)?, row(2)?],
        })
    }

    fn row_limits(&self, row: usize, step: &Step, torque: f64, speed: f64) -> Result<RowLimits, Error> {
        let first_touch = self.first_touch_rad(row, step.height_m);
        let part = first_touch / (POINTS - 1) as f64;
        let path: Vec<Posture> = (0..POINTS)
            .map(|point| self.posture(row, step.height_m, first_touch - part * point as f64))
            .collect::<Result<_, _>>()
            .map_err(|misfit| self.misfit(row, step, misfit))?;

        let mut least_torque_n_m = 0.0_f64;
        for posture in &path {
            let least = best(self, step, row, posture, Ask::Torque)?;
            least_torque_n_m = least_torque_n_m.max(least.unwrap_or(f64::INFINITY));
        }
        let deficit_j = if torque >= least_torque_n_m {
            0.0
        } else {
            self.deficit_j(row, step, torque, &path, part)?
        };

        let impact = &path[0];
        let kept = self.kept(row, impact);
        let run_up = |kept: f64| match deficit_j {
            0.0 => 0.0,
            _ if kept <= 0.0 => f64::INFINITY,
            _ => (2.0 * deficit_j / (self.driving_mass_kg() * kept)).sqrt(),
        };
        let (run_up_m_s, path_run_up_m_s) = (run_up(kept.at_most), run_up(kept.on_path));
        let verdict = match deficit_j {
            0.0 => Verdict::Torque,
            _ if speed >= path_run_up_m_s => Verdict::RunUp,
            _ if speed >= run_up_m_s => Verdict::Open,
            _ => Verdict::Impossible,
        };
        Ok(RowLimits {
            row: ROWS[row],
            wheels: self.rows[row].wheels.clone(),
            least_torque_n_m,
            deficit_j,
            path_mass_kg: self.path_inertia(impact) / impact.hinge.rate[0].powi(2),
            kept_at_most: kept.at_most,
            kept_on_path: kept.on_path,
            run_up_m_s,
            path_run_up_m_s,
            verdict,
        })
    }

    /// How far the best that the torque can do falls behind what the path takes, at worst \[J\].
    fn deficit_j(
        &self,
        row: usize,
        step: &Step,
        torque: f64,
        path: &[Posture],
        part: f64,
    ) -> Result<f64, Error> {
        let (mut energy, mut lowest, mut before) = (0.0_f64, 0.0_f64, None::<f64>);
        for posture in path {
            // Where no forces keep all rows on the ground the vehicle goes another way: that bit of
            // the path is given away.
            let fastest = best(self, step, row, posture, Ask::Acceleration(torque))?;
            let gain = self.path_inertia(posture) * fastest.unwrap_or(0.0);
            if let Some(before) = before {
                if before < 0.0 && gain > 0.0 {
                    // The bottom lies between two points, where a straight line from one gain to the other is zero.
                    lowest = lowest.min(energy + 0.5 * part * before * before / (before - gain));
                }
                energy += 0.5 * part * (before + gain);
                lowest = lowest.min(energy);
            }
            before = Some(gain);
        }
        let scale = self.mass_kg() * step.gravity_m_s2 * step.height_m;
        Ok(if -lowest > NO_DEFICIT * scale {
            -lowest
        } else {
            0.0
        })
    }

    fn misfit(&self, row: usize, step: &Step, misfit: Misfit) -> Error {
        let (height, climbing) = (step.height_m, ROWS[row]);
        let reason = match misfit {
            Misfit::Reach => format!("its frames cannot lift the {climbing} row by {height} m"),
            Misfit::Stop(turn) => format!(
                "its hinge would turn {turn:.2} rad, beyond its stop at {}, while the {climbing} row climbs {height} m",
                self.stop_rad
            ),
            Misfit::Close(other) => {
                format!(
                    "its {} row also touches the edge while the {climbing} row climbs {height} m",
                    ROWS[other]
                )
            }
        };
        Error::Vehicle {
            vehicle: self.name.clone(),
            reason,
        }
    }
}
