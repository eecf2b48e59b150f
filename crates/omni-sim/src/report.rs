//! A controller's report besides the wheels' signals, and its columns in traces and logs.

mod ground;
mod numbers;

use omni_core::DriveMode;
use omni_core::drive::Fault;
use omni_core::geometry::PlanarPose;
use omni_core::shaping::CommandStatus;
use omni_core::traction::{SupervisorMode, TractionLoops};
use serde::{Deserialize, Serialize};

use crate::config::Vehicle;
pub use ground::{GroundReport, GroundWheel};
use numbers::{number, value, whole};

/// A controller's report in one control period besides its wheels' signals; parts that the controller lacks are absent.
/// Of a period that no controller had a part in nothing is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Of a scenario's `[drive]`.
    pub drive: Option<DriveReport>,
    /// Of traction control that runs here.
    pub traction: Option<TractionReport>,
    /// Of a controller of one's own, in the order of its names; NaN if one is not known.
    pub own: Vec<f64>,
    /// Of odometry in three dimensions.
    pub ground: Option<GroundReport>,
    /// Of the path that is followed.
    pub path: Option<PathReport>,
}

/// Reference pose of a path at the end of a period.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PathReport {
    /// The reference pose.
    pub pose: PlanarPose<f64>,
    /// Total time that the path has waited for the vehicle \[s\].
    pub waited_s: f64,
    /// The pose that is followed with: by odometry, by the estimator, or the true one.
    pub estimated: PlanarPose<f64>,
}

/// Report of a drive, local or at the other end of a link.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DriveReport {
    /// How far the vehicle can be relied on.
    pub mode: DriveMode,
    /// Enough wheels determine the motion.
    pub motion_known: bool,
    /// Why the twist is what it is; over a link it is not reported.
    pub command: Option<CommandStatus>,
    /// Pose since the start by its own odometry.
    pub pose: PlanarPose<f64>,
    /// Standard deviations of x \[m\], y \[m\] and yaw \[rad\]; over a link they are not reported.
    pub deviations: Option<[f64; 3]>,
    /// One entry per wheel.
    pub wheels: Vec<DriveWheel>,
}

/// Report of a drive on a wheel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DriveWheel {
    /// Its error.
    pub fault: Option<Fault>,
    /// It is excluded from the motion.
    pub excluded: bool,
    /// Its motor's windings are shorted.
    pub brake: bool,
}

/// Report of traction control.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TractionReport {
    /// Measured speed over the commanded, -1 to 1; 1 if none is commanded.
    pub factor: f64,
    /// Measured speed along the direction of travel \[m/s\].
    pub speed_m_s: f64,
    /// The target that it follows \[m/s\].
    pub target_m_s: f64,
    /// Common thrust \[N.m\].
    pub thrust_n_m: f64,
    /// The wheel that the measured speed hangs on, counted from 0.
    pub speed_wheel: Option<u32>,
    /// The row that climbs next, 0 the foremost.
    pub row: u16,
    /// Phase of its supervisor.
    pub mode: SupervisorMode,
    /// Retries of the present row.
    pub row_retries: u16,
    /// Times that it backed off for another try since the start.
    pub retries: u32,
    /// Height of the highest edge that a wheel has climbed since the obstacle began \[m\]; 0 if none is known.
    pub edge_m: f64,
    /// Heading error \[rad\], counter-clockwise positive.
    pub heading_rad: f64,
    /// The gyro's zero \[rad/s\].
    pub gyro_zero_rad_s: f64,
    /// The control mode of the wheels.
    pub loops: TractionLoops,
    /// Speed across the direction of travel \[m/s\], to the left.
    pub drift_m_s: f64,
    /// One entry per wheel.
    pub wheels: Vec<TractionWheel>,
}

/// Report of traction control on a wheel; 0 for a wheel that is not driven.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TractionWheel {
    /// Slip along the direction of travel \[rad/s\].
    pub slip_rad_s: f64,
    /// Part of its torque that the ground transmits \[N.m\], by the control law's own estimate.
    pub contact_n_m: f64,
}

/// Columns of a drive; then for each signal of [`DRIVE_WHEEL`] one per wheel.
const DRIVE: [&str; 9] = [
    "drive_mode",
    "drive_motion_known",
    "drive_command_status",
    "drive_pose_x_m",
    "drive_pose_y_m",
    "drive_pose_yaw_rad",
    "drive_std_x_m",
    "drive_std_y_m",
    "drive_std_yaw_rad",
];
const DRIVE_WHEEL: [&str; 3] = ["drive_fault", "drive_excluded", "drive_brake"];
/// Columns of traction control; then for each signal of [`TRACTION_WHEEL`] one per wheel.
const TRACTION: [&str; 14] = [
    "traction_factor",
    "traction_speed_m_s",
    "traction_target_m_s",
    "traction_thrust_n_m",
    "traction_speed_wheel",
    "traction_row",
    "traction_mode",
    "traction_row_retries",
    "traction_retries",
    "traction_edge_m",
    "traction_heading_rad",
    "traction_gyro_zero_rad_s",
    "traction_loops",
    "traction_drift_m_s",
];
const TRACTION_WHEEL: [&str; 2] = ["traction_slip_rad_s", "traction_contact_n_m"];
/// Columns of a path that is followed.
const PATH: [&str; 7] = [
    "path_x_m",
    "path_y_m",
    "path_yaw_rad",
    "path_waited_s",
    "path_estimated_x_m",
    "path_estimated_y_m",
    "path_estimated_yaw_rad",
];

fn wheel_names(vehicle: &Vehicle) -> Vec<String> {
    vehicle.wheel.iter().map(|wheel| wheel.name.clone()).collect()
}

/// By their numbers in columns, 0 first.
const MODES: [DriveMode; 4] = [
    DriveMode::Normal,
    DriveMode::Degraded,
    DriveMode::SafeStop,
    DriveMode::EmergencyStop,
];
const COMMANDS: [CommandStatus; 5] = [
    CommandStatus::Idle,
    CommandStatus::Following,
    CommandStatus::Limited,
    CommandStatus::TimedOut,
    CommandStatus::EmergencyStop,
];
const FAULTS: [Option<Fault>; 6] = [
    None,
    Some(Fault::NotANumber),
    Some(Fault::Jump),
    Some(Fault::Stuck),
    Some(Fault::Silent),
    Some(Fault::Lost),
];
const SUPERVISOR: [SupervisorMode; 4] = [
    SupervisorMode::Drive,
    SupervisorMode::BackOff,
    SupervisorMode::RunUp,
    SupervisorMode::GaveUp,
];
const LOOPS: [TractionLoops; 3] = [
    TractionLoops::Plain,
    TractionLoops::Traction,
    TractionLoops::Fallback,
];
const FLAGS: [bool; 2] = [false, true];

fn pose([x_m, y_m, yaw_rad]: [f64; 3]) -> PlanarPose<f64> {
    PlanarPose { x_m, y_m, yaw_rad }
}

impl DriveReport {
    fn values(&self) -> Vec<f64> {
        let mut values = vec![
            number(&MODES, &self.mode),
            number(&FLAGS, &self.motion_known),
            self.command
                .map_or(f64::NAN, |command| number(&COMMANDS, &command)),
        ];
        values.extend([self.pose.x_m, self.pose.y_m, self.pose.yaw_rad]);
        values.extend(self.deviations.unwrap_or([f64::NAN; 3]));
        values.extend(self.wheels.iter().map(|wheel| number(&FAULTS, &wheel.fault)));
        values.extend(self.wheels.iter().map(|wheel| number(&FLAGS, &wheel.excluded)));
        values.extend(self.wheels.iter().map(|wheel| number(&FLAGS, &wheel.brake)));
        values
    }

    fn from_values(values: &[f64], wheels: usize) -> Option<Self> {
        let (&[mode, motion_known, command, x, y, yaw, std_x, std_y, std_yaw], of_wheels) =
            values.split_first_chunk()?;
        let deviations = [std_x, std_y, std_yaw];
        let wheel = |i: usize| {
            let signal = |k: usize| of_wheels.get(k * wheels + i).copied();
            Some(DriveWheel {
                fault: value(&FAULTS, signal(0)?)?,
                excluded: value(&FLAGS, signal(1)?)?,
                brake: value(&FLAGS, signal(2)?)?,
            })
        };
        Some(Self {
            mode: value(&MODES, mode)?,
            motion_known: value(&FLAGS, motion_known)?,
            command: if command.is_nan() {
                None
            } else {
                Some(value(&COMMANDS, command)?)
            },
            pose: pose([x, y, yaw]),
            deviations: (!deviations.iter().all(|each| each.is_nan())).then_some(deviations),
            wheels: (0..wheels).map(wheel).collect::<Option<_>>()?,
        })
    }
}

/// A drive's mode by its number in frames.
pub(crate) fn drive_mode(number: u8) -> Option<DriveMode> {
    value(&MODES, number.into())
}

/// The fault of a wheel, by its number in frames; the outer none for an unknown number.
pub(crate) fn wheel_fault(number: u8) -> Option<Option<Fault>> {
    value(&FAULTS, number.into())
}

impl TractionReport {
    fn values(&self) -> Vec<f64> {
        let mut values = vec![
            self.factor,
            self.speed_m_s,
            self.target_m_s,
            self.thrust_n_m,
            self.speed_wheel.map_or(0.0, |wheel| f64::from(wheel) + 1.0),
            f64::from(self.row),
            number(&SUPERVISOR, &self.mode),
            f64::from(self.row_retries),
            f64::from(self.retries),
            self.edge_m,
            self.heading_rad,
            self.gyro_zero_rad_s,
            number(&LOOPS, &self.loops),
            self.drift_m_s,
        ];
        values.extend(self.wheels.iter().map(|wheel| wheel.slip_rad_s));
        values.extend(self.wheels.iter().map(|wheel| wheel.contact_n_m));
        values
    }

    fn from_values(values: &[f64], wheels: usize) -> Option<Self> {
        let (common, of_wheels) = values.split_first_chunk()?;
        let &[
            factor,
            speed_m_s,
            target_m_s,
            thrust_n_m,
            speed_wheel,
            row,
            mode,
            row_retries,
            retries,
            edge_m,
            heading_rad,
            gyro_zero_rad_s,
            loops,
            drift_m_s,
        ] = common;
        let wheel = |i: usize| {
            Some(TractionWheel {
                slip_rad_s: *of_wheels.get(i)?,
                contact_n_m: *of_wheels.get(wheels + i)?,
            })
        };
        Some(Self {
            factor,
            speed_m_s,
            target_m_s,
            thrust_n_m,
            speed_wheel: whole(speed_wheel, wheels as u32)?.checked_sub(1),
            row: whole(row, u16::MAX.into())? as u16,
            mode: value(&SUPERVISOR, mode)?,
            row_retries: whole(row_retries, u16::MAX.into())? as u16,
            retries: whole(retries, u32::MAX)?,
            edge_m,
            heading_rad,
            gyro_zero_rad_s,
            loops: value(&LOOPS, loops)?,
            drift_m_s,
            wheels: (0..wheels).map(wheel).collect::<Option<_>>()?,
        })
    }
}

/// Which parts the reports of a run have, and their columns: the only place where reports and columns meet.
///
/// ```
/// use omni_sim::{Simulation, config::{Override, Scenario}};
/// let scenario = Scenario::load("flat", &[Override::new("drive.command_timeout_s", 0.5)])?;
/// let mut simulation = Simulation::new(&scenario)?;
/// simulation.step(&simulation.scenario_command())?;
/// let (columns, report) = (simulation.controller().columns(), &simulation.sample().report);
/// let values = columns.values(report);
/// assert_eq!((columns.names()[0].as_str(), values[0]), ("drive_mode", 0.0)); // normal
/// assert_eq!(columns.report(&values).as_ref(), Some(report));
/// # Ok::<(), omni_sim::Error>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReportColumns {
    names: Vec<String>,
    /// Names of the wheels.
    wheels: Vec<String>,
    drive: bool,
    traction: bool,
    own: usize,
    ground: bool,
    path: bool,
}

impl ReportColumns {
    /// Of a controller of one's own: the names of its signals.
    #[must_use]
    pub fn own(names: Vec<String>) -> Self {
        Self::new(Vec::new(), [false; 2], names, [false; 2])
    }

    /// Of a vehicle's drive, its traction control, or both.
    pub(crate) fn built_in(vehicle: &Vehicle, drive: bool, traction: bool) -> Self {
        Self::new(wheel_names(vehicle), [drive, traction], Vec::new(), [false; 2])
    }

    /// The same, and those of odometry in three dimensions.
    pub(crate) fn with_ground(self, vehicle: &Vehicle) -> Self {
        let own = self.own_names();
        Self::new(
            wheel_names(vehicle),
            [self.drive, self.traction],
            own,
            [true, self.path],
        )
    }

    /// The same, and where a path wants the vehicle.
    pub(crate) fn following_a_path(self) -> Self {
        let own = self.own_names();
        Self::new(self.wheels, [self.drive, self.traction], own, [self.ground, true])
    }

    fn own_names(&self) -> Vec<String> {
        let [drive, traction, own, _] = self.lengths();
        self.names[drive + traction..][..own].to_vec()
    }

    fn new(
        wheels: Vec<String>,
        [drive, traction]: [bool; 2],
        own: Vec<String>,
        [ground, path]: [bool; 2],
    ) -> Self {
        let of = |common: &[&str], of_wheels: &[&str]| {
            let mut names: Vec<_> = common.iter().map(|name| (*name).to_owned()).collect();
            for signal in of_wheels {
                names.extend(wheels.iter().map(|wheel| format!("{signal}_{wheel}")));
            }
            names
        };
        let count = own.len();
        let parts = [
            (drive, of(&DRIVE, &DRIVE_WHEEL)),
            (traction, of(&TRACTION, &TRACTION_WHEEL)),
            (true, own),
            (ground, of(&ground::GROUND, &ground::GROUND_WHEEL)),
            (path, of(&PATH, &[])),
        ];
        let names = parts.into_iter().filter(|(there, _)| *there);
        let names = names.flat_map(|(_, names)| names).collect();
        Self {
            names,
            wheels,
            drive,
            traction,
            own: count,
            ground,
            path,
        }
    }

    /// Those with these names, as a log has them. Names that belong to neither a drive nor traction control belong to a
    /// custom controller.
    #[must_use]
    pub fn named(names: &[String]) -> Self {
        let of_wheels = |signal: &str| -> Vec<String> {
            let wheels = names
                .iter()
                .filter_map(|name| name.strip_prefix(signal)?.strip_prefix('_'));
            wheels.map(str::to_owned).collect()
        };
        let signals = [DRIVE_WHEEL[0], TRACTION_WHEEL[0], ground::GROUND_WHEEL[0]];
        let [drive, traction, ground] = signals.map(of_wheels);
        let is_there = [&drive, &traction, &ground].map(|wheels| !wheels.is_empty());
        let [has_drive, has_traction, has_ground] = is_there;
        let path = names.ends_with(&PATH.map(str::to_owned));
        let wheels = [drive, traction, ground]
            .into_iter()
            .find(|wheels| !wheels.is_empty());
        let wheels = wheels.unwrap_or_default();
        let parts = [has_drive, has_traction];
        // The names that are left over are those of a custom controller.
        let built_in = Self::new(wheels.clone(), parts, Vec::new(), [has_ground, path]);
        let own = names.len().saturating_sub(built_in.names.len());
        let [drive, traction, ..] = built_in.lengths();
        let own = names.iter().skip(drive + traction).take(own).cloned().collect();
        let all = Self::new(wheels, parts, own, [has_ground, path]);
        if all.names == names {
            all
        } else {
            Self::own(names.to_vec())
        }
    }

    /// Their names, in order.
    #[must_use]
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Names of the wheels of a drive or of traction control, in order.
    #[must_use]
    pub fn wheels(&self) -> &[String] {
        &self.wheels
    }

    /// A path is followed.
    pub(crate) fn follows_a_path(&self) -> bool {
        self.path
    }

    /// Numbers of each part that is there: of the drive, of traction control, of a controller of one's own, of odometry
    /// in three dimensions.
    fn lengths(&self) -> [usize; 4] {
        let wheels = self.wheels.len();
        let of =
            |there: bool, common: usize, of_wheel: usize| if there { common + of_wheel * wheels } else { 0 };
        [
            of(self.drive, DRIVE.len(), DRIVE_WHEEL.len()),
            of(self.traction, TRACTION.len(), TRACTION_WHEEL.len()),
            self.own,
            of(self.ground, ground::GROUND.len(), ground::GROUND_WHEEL.len()),
        ]
    }

    /// One number per name; NaN if the report lacks a part.
    #[must_use]
    pub fn values(&self, report: &Report) -> Vec<f64> {
        let drive = report.drive.as_ref().map(DriveReport::values);
        let traction = report.traction.as_ref().map(TractionReport::values);
        let own = Some(report.own.as_slice());
        let ground = report.ground.as_ref().map(GroundReport::values);
        let parts = [drive.as_deref(), traction.as_deref(), own, ground.as_deref()];
        let mut values = Vec::with_capacity(self.names.len());
        for (length, part) in self.lengths().into_iter().zip(parts) {
            let end = values.len() + length;
            values.extend(part.unwrap_or_default().iter().take(length));
            values.resize(end, f64::NAN);
        }
        if let (true, Some(path)) = (self.path, &report.path) {
            let (wanted, is) = (&path.pose, &path.estimated);
            values.extend([wanted.x_m, wanted.y_m, wanted.yaw_rad, path.waited_s]);
            values.extend([is.x_m, is.y_m, is.yaw_rad]);
        }
        values.resize(self.names.len(), f64::NAN);
        values
    }

    /// The report of these numbers, one per name. A part whose numbers are none of its, as NaN throughout, is not
    /// there. None if there are more or fewer numbers than names.
    #[must_use]
    pub fn report(&self, values: &[f64]) -> Option<Report> {
        if values.len() != self.names.len() {
            return None;
        }
        let [drive, traction, own, ground] = self.lengths();
        let (of_drive, rest) = values.split_at(drive);
        let (of_traction, rest) = rest.split_at(traction);
        let (own, rest) = rest.split_at(own);
        let (ground, path) = rest.split_at(ground);
        let wheels = self.wheels.len();
        let path = path
            .first_chunk::<7>()
            .filter(|path| !path.iter().any(|part| part.is_nan()));
        Some(Report {
            drive: DriveReport::from_values(of_drive, wheels),
            traction: TractionReport::from_values(of_traction, wheels),
            own: own.to_vec(),
            ground: GroundReport::from_values(ground, wheels),
            path: path.map(|[x_m, y_m, yaw_rad, waited_s, estimated @ ..]| PathReport {
                pose: pose([*x_m, *y_m, *yaw_rad]),
                waited_s: *waited_s,
                estimated: pose(*estimated),
            }),
        })
    }
}

#[cfg(test)]
mod tests;
