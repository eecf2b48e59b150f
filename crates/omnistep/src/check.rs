//! `omnistep check`.

use std::io::Write;
use std::path::PathBuf;

use omni_config::{DerivedGains, File, Override, Scenario, Study, Vehicle, WheelModel, WheelSpec};

use crate::Error;
use crate::notices::{announce_assumed, beyond_balls, doubts_of};
use crate::output::{print, warn};

/// Control period and gravity that a vehicle's facts are for, where no scenario gives them: the built-in scenarios'.
const PERIOD_S: f64 = 1e-3;
const GRAVITY_M_S2: f64 = 9.81;
/// What a step is climbed with where no scenario says so: the built-in step's.
const FRICTION: f64 = 0.7;
const SPEED_M_S: f64 = 0.3;

/// A step that a vehicle shall climb.
pub(super) struct AskedStep {
    pub(super) height_m: f64,
    /// The file of the vehicle's chart.
    pub(super) chart: Option<PathBuf>,
}

/// Says what a file describes, or what is wrong with it, and warns of what is doubtful: whether
/// there was anything. `step` is what its motors shall be strong enough for.
pub(super) fn check(
    file: &str,
    step: Option<&AskedStep>,
    overrides: &[Override],
    out: &mut dyn Write,
) -> Result<bool, Error> {
    let mut report = Report::default();
    let loaded = File::load(file, overrides)?;
    if let (File::Study(_), Some(given)) = (&loaded, overrides.first()) {
        return Err(Error::Argument {
            name: "--set",
            value: given.key().into(),
            allowed: "with a vehicle, a scenario or an experiment",
        });
    }
    if let Some(step) = step {
        allowed_step(step.height_m, &loaded)?;
    }
    report.name = match &loaded {
        File::Vehicle(vehicle) => vehicle.name.clone(),
        File::Scenario(scenario) => scenario.name.clone(),
        File::Study(study) => study.name.clone(),
        _ => file.to_owned(),
    };
    let said = match loaded {
        File::Vehicle(vehicle) => of_vehicle(file, &vehicle, step, overrides, &mut report)?,
        File::Scenario(scenario) => of_scenario(&scenario, step, &mut report)?,
        File::Experiment(experiment) => {
            format!("experiment {}, {} s", experiment.name, experiment.duration_s)
        }
        File::Study(study) => {
            let (described, doubts_of_runs, balls) = checked(&study)?;
            report.warn(doubts_of_runs);
            match balls {
                Some(why) => {
                    report.doubtful = true;
                    format!("study {described}\n  {:<8} WARNING: {why}", "balls")
                }
                None => format!("study {described}"),
            }
        }
        _ => {
            return Err(Error::Argument {
                name: "FILE",
                value: file.into(),
                allowed: "a vehicle, a scenario, an experiment or a study",
            });
        }
    };
    print(out, &format!("{file}: {said}\n"))?;
    Ok(report.doubtful)
}

/// What a vehicle's file describes.
fn of_vehicle(
    file: &str,
    vehicle: &Vehicle,
    step: Option<&AskedStep>,
    overrides: &[Override],
    report: &mut Report,
) -> Result<String, Error> {
    let derived = match vehicle.gains {
        Some(_) => None,
        None => Some(vehicle.derived_gains(PERIOD_S)?),
    };
    announce_assumed(vehicle, PERIOD_S, derived.as_ref());
    report.warn(vehicle.doubts(PERIOD_S)?);
    report.warn(vehicle.falls(GRAVITY_M_S2));
    let facts = facts(vehicle, PERIOD_S, GRAVITY_M_S2, derived.as_ref())?;
    let step_m = step.map(|step| step.height_m);
    let limits = on_step(vehicle, step_m, FRICTION, GRAVITY_M_S2, SPEED_M_S, report)?;
    // As in a scenario that names no policy.
    let own = |over: &Override| Override::new(format!("vehicle.{}", over.key()), over.value().clone());
    let overrides: Vec<_> = [Override::new("vehicle", file)]
        .into_iter()
        .chain(overrides.iter().map(own))
        .collect();
    let flat = Scenario::load("flat", &overrides)?;
    let charted = charted(step, flat.vehicle(), report)?;
    Ok(format!(
        "vehicle {}{facts}{}{limits}{charted}{}",
        described(vehicle),
        chosen(&flat),
        wheels_ahead(vehicle)
    ))
}

/// What a scenario's file describes.
fn of_scenario(scenario: &Scenario, step: Option<&AskedStep>, report: &mut Report) -> Result<String, Error> {
    let (vehicle, derived) = (scenario.vehicle(), scenario.derived_gains());
    announce_assumed(vehicle, scenario.period_s(), derived);
    let gravity = scenario.physics.gravity_m_s2;
    report.warn(vehicle.doubts(scenario.period_s())?);
    report.warn(vehicle.falls(gravity));
    report.warn(doubts_of(scenario));
    report.warn(scenario.encoder_warning()?);
    let balls = beyond_balls(scenario);
    report.doubtful |= balls.is_some();
    let (friction, speed_m_s) = (scenario.terrain.friction(), scenario.command.vx_m_s.abs());
    let step_m = step.map(|step| step.height_m);
    let limits = on_step(vehicle, step_m, friction, gravity, speed_m_s, report)?;
    let charted = charted(step, vehicle, report)?;
    Ok(format!(
        "scenario {}, {} s, policy {}, engine {}; vehicle {}{}{}{}{limits}{charted}{}",
        scenario.name,
        scenario.duration_s,
        scenario.control.law(),
        scenario.physics.engine.name(),
        described(vehicle),
        facts(vehicle, scenario.period_s(), gravity, derived)?,
        encoder(scenario)?,
        chosen(scenario),
        wheels_there(scenario, balls.as_deref())
    ))
}

/// What was warned of, of whom.
#[derive(Default)]
struct Report {
    name: String,
    doubtful: bool,
}

impl Report {
    fn warn(&mut self, doubts: impl IntoIterator<Item = String>) {
        for doubt in doubts {
            self.doubtful = true;
            warn(&format!("{}: {doubt}", self.name));
        }
    }
}

/// Is that the height of a step that this vehicle, or this scenario's, may be asked for?
fn allowed_step(height_m: f64, file: &File) -> Result<(), Error> {
    let refuse = |allowed| {
        Err(Error::Argument {
            name: "--step",
            value: height_m.to_string(),
            allowed,
        })
    };
    let vehicle = match file {
        File::Vehicle(vehicle) => vehicle,
        File::Scenario(scenario) => scenario.vehicle(),
        _ => return refuse("with a vehicle or a scenario"),
    };
    if !(1e-6..=10.0).contains(&height_m) {
        return refuse("1e-6 to 10 [m]");
    }
    if vehicle.wheel.iter().any(|wheel| wheel.radius_m <= height_m) {
        return refuse("less than the radius of every wheel: wheels cannot climb an edge above their axle");
    }
    Ok(())
}

/// What a study is, what is doubtful of its runs, and what is to be said of those on balls that are not their wheels.
#[cfg(feature = "study")]
fn checked(study: &Study) -> Result<(String, Vec<String>, Option<String>), Error> {
    crate::study::checked(study)
}

#[cfg(not(feature = "study"))]
fn checked(_: &Study) -> Result<(String, Vec<String>, Option<String>), Error> {
    Err(Error::NotBuilt {
        what: "check STUDY",
        feature: "study",
    })
}

fn described(vehicle: &Vehicle) -> String {
    let count = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
    let mut parts = vec![
        match vehicle.body.len() {
            1 => "1 body".to_owned(),
            n => format!("{n} bodies"),
        },
        count(vehicle.hinge.len(), "hinge"),
    ];
    if !vehicle.coupling.is_empty() {
        parts.push(count(vehicle.coupling.len(), "coupling"));
    }
    parts.push(count(vehicle.wheel.len(), "wheel"));
    format!(
        "{}: {}, {:.3} kg",
        vehicle.name,
        parts.join(", "),
        vehicle.mass_kg()
    )
}

/// Whether a wheel pushes transverse to the vehicle's forward direction.
fn is_crosswise(wheel: &WheelSpec) -> bool {
    let [dx, dy] = wheel.rolling_direction;
    let (sin, cos) = wheel.roller_angle_rad.sin_cos();
    (cos * dx - sin * dy).abs() < 0.1 * dx.hypot(dy)
}

/// What follows from the vehicle's numbers, one indented line each.
fn facts(
    vehicle: &Vehicle,
    period_s: f64,
    gravity_m_s2: f64,
    derived: Option<&DerivedGains>,
) -> Result<String, Error> {
    let mut lines = String::new();
    let mut say = |what: &str, text: String| lines.push_str(&format!("\n  {what:<8} {text}"));
    say(
        "layout",
        format!("condition number {:.2} (1 is best)", vehicle.condition_number()?),
    );
    if vehicle.wheel.len() == 3 {
        say(
            "encoders",
            "all 3 are needed: without one the motion is unknown, and the drive stops".into(),
        );
    }
    let [x, y, z] = vehicle
        .centre_of_mass_m()
        .map(|at| if at.abs() < 5e-5 { 0.0 } else { at });
    say("weight", format!("centre of mass at ({x:.3}, {y:.3}, {z:.3}) m"));
    if let Some(loads) = vehicle.static_loads_n(gravity_m_s2) {
        let each = vehicle
            .wheel
            .iter()
            .zip(&loads)
            .map(|(wheel, load)| format!("{} {load:.1}", wheel.name));
        say(
            "loads",
            format!(
                "at rest on flat ground [N]: {}",
                each.collect::<Vec<_>>().join(", ")
            ),
        );
        // What a transverse wheel carries is lost to those that push.
        let shares = vehicle.rows().into_iter().filter_map(|row| {
            let carried: f64 = row.wheels.iter().map(|wheel| loads[*wheel]).sum();
            let crosswise: Vec<_> = row
                .wheels
                .iter()
                .filter(|wheel| is_crosswise(&vehicle.wheel[**wheel]))
                .collect();
            if crosswise.is_empty() || crosswise.len() == row.wheels.len() || carried <= 0.0 {
                return None;
            }
            let names: Vec<_> = crosswise
                .iter()
                .map(|wheel| vehicle.wheel[**wheel].name.as_str())
                .collect();
            let share = 100.0 * crosswise.iter().map(|wheel| loads[**wheel]).sum::<f64>() / carried;
            let (wheel, x_m) = (if names.len() == 1 { "wheel" } else { "wheels" }, row.x_m);
            Some(format!(
                "row at x = {x_m} m: {share:.0} % on transverse {wheel} {}",
                names.join(", ")
            ))
        });
        let shares: Vec<_> = shares.collect();
        if !shares.is_empty() {
            say("shares", shares.join("; "));
        }
    }
    say("under", undersides(vehicle));
    if let Some(no_load) = vehicle.no_load_rad_s() {
        let [vx, vy, wz] = vehicle.speeds_at(no_load)?;
        say(
            "speed",
            format!(
                "motors reach {no_load:.1} rad/s without load: {vx:.2} m/s forward, {vy:.2} m/s sideways, {wz:.2} rad/s in yaw"
            ),
        );
    }
    let gains = vehicle.gains_at(period_s)?;
    let origin = if derived.is_some() { "derived" } else { "given" };
    say(
        "gains",
        format!(
            "kp {:.4} N.m.s/rad, ki {:.4} N.m/rad, kd {} N.m.s2/rad, {origin}",
            gains.kp_n_m_s_rad, gains.ki_n_m_rad, gains.kd_n_m_s2_rad
        ),
    );
    Ok(lines)
}

/// How high the lowest point of each body is, those of one height together.
fn undersides(vehicle: &Vehicle) -> String {
    let mut heights: Vec<(Option<String>, Vec<&str>)> = Vec::new();
    for body in &vehicle.body {
        let height = body.underside_m().map(|height_m| format!("{height_m:.3}"));
        match heights.iter_mut().find(|(known, _)| *known == height) {
            Some((_, names)) => names.push(&body.name),
            None => heights.push((height, vec![&body.name])),
        }
    }
    let texts = heights.into_iter().map(|(height, names)| {
        let names = names.join(" ");
        match height {
            Some(height) => format!("{height} under {names}"),
            None => format!("unknown under {names}, whose box reaches the ground: give clearance_m"),
        }
    });
    format!("clearance [m]: {}", texts.collect::<Vec<_>>().join(", "))
}

/// What one count of a scenario's encoders is against the top speed, as one of [`facts`]; nothing without counts.
fn encoder(scenario: &Scenario) -> Result<String, Error> {
    Ok(match scenario.encoder_reading()? {
        Some(reading) => format!("\n  {:<8} {reading}", "encoder"),
        None => String::new(),
    })
}

/// Which policy a scenario that names none has, as one of [`facts`]; nothing if it names one.
fn chosen(scenario: &Scenario) -> String {
    let Some(auto) = scenario.auto_policy() else {
        return String::new();
    };
    let policy = auto.policy;
    let text = match &auto.because {
        Some(because) => format!("{policy} if none is named, because {because}"),
        None => format!("{policy} if none is named: the best that sensors and motors allow"),
    };
    let lines = [&text].into_iter().chain(&auto.without);
    lines.map(|line| format!("\n  {:<8} {line}", "policy")).collect()
}

/// How the wheels of a scenario are simulated, as one of [`facts`]; `beyond` is why they are no valid balls.
fn wheels_there(scenario: &Scenario, beyond: Option<&str>) -> String {
    let ground = scenario.terrain.described();
    let text = match (beyond, scenario.wheel_model()) {
        (Some(why), _) => format!("WARNING: {why}"),
        (None, WheelModel::Rollers) => "rollers".into(),
        _ => format!("balls, a valid model {ground}"),
    };
    format!("\n  {:<8} {text}", "wheels")
}

/// How a vehicle's wheels are simulated where it meets an obstacle straight ahead, as one of [`facts`].
fn wheels_ahead(vehicle: &Vehicle) -> String {
    let text = match vehicle.beyond_balls_ahead() {
        Some(beyond) => format!("balls on level ground; rollers at an edge, because {beyond}"),
        None => "balls on level ground and at an edge straight ahead".into(),
    };
    format!("\n  {:<8} {text}", "wheels")
}

/// From which sides a step is climbed by a chart, as one of [`facts`].
#[cfg(feature = "study")]
fn charted(step: Option<&AskedStep>, vehicle: &Vehicle, report: &mut Report) -> Result<String, Error> {
    let Some((file, height_m)) = step.and_then(|step| Some((step.chart.as_ref()?, step.height_m))) else {
        return Ok(String::new());
    };
    let found = crate::check_chart::on_chart(file, vehicle, height_m)?;
    report.warn(found.doubt);
    Ok(format!("\n  {:<8} {}", "chart", found.text))
}

#[cfg(not(feature = "study"))]
fn charted(step: Option<&AskedStep>, _: &Vehicle, _: &mut Report) -> Result<String, Error> {
    match step.and_then(|step| step.chart.as_ref()) {
        Some(_) => Err(Error::NotBuilt {
            what: "check --chart",
            feature: "study",
        }),
        None => Ok(String::new()),
    }
}

/// The body that reaches farthest ahead, where its clearance is less than the height of a step.
#[cfg(feature = "climb-limits")]
fn too_low(vehicle: &Vehicle, height_m: f64) -> Option<String> {
    let front = |body: &&omni_config::Body| body.com_m[0] + body.inertia_box_m[0] / 2.0;
    let first = vehicle.body.iter().max_by(|a, b| front(a).total_cmp(&front(b)))?;
    let clearance_m = first.underside_m()?;
    (clearance_m < height_m).then(|| {
        format!(
            "the step of {height_m} m is higher than the clearance of {clearance_m:.3} m under `{}`",
            first.name
        )
    })
}

/// Cosine of its rolling direction to the direction of travel, below which a wheel stands across it.
#[cfg(feature = "climb-limits")]
const ACROSS: f64 = 0.1;

/// Requirements of a step of a height for a vehicle, as one of [`facts`]; requirements beyond its motors are doubtful.
#[cfg(feature = "climb-limits")]
fn on_step(
    vehicle: &Vehicle,
    step_m: Option<f64>,
    friction: f64,
    gravity_m_s2: f64,
    speed_m_s: f64,
    report: &mut Report,
) -> Result<String, Error> {
    let Some(height_m) = step_m else {
        return Ok(String::new());
    };
    report.warn(too_low(vehicle, height_m));
    let has = vehicle.motor.peak_torque_n_m();
    let mut step = omni_bound::Step::new(height_m, friction)?;
    step.gravity_m_s2 = gravity_m_s2;
    let where_ = format!("step of {height_m} m, friction {friction}");
    let linkage = match omni_bound::Linkage::new(vehicle) {
        Ok(linkage) => linkage,
        Err(omni_bound::Error::Vehicle { .. }) => {
            let Some(rows) = omni_bound::touch(vehicle, &step)? else {
                let text = "no climb limits for this vehicle: they need two rows of wheels on one frame or three rows on two frames";
                return Ok(format!("\n  {:<8} {text}", "step"));
            };
            let mut needs = Vec::new();
            for row in &rows {
                let (wheels, torque) = (row.wheels.join(" "), row.torque_n_m);
                if torque.is_infinite() {
                    report.warn([format!(
                        "{where_}: no torque lifts wheel {wheels} off the ground, because the friction is too low"
                    )]);
                    needs.push(format!("{wheels}: no torque suffices"));
                    continue;
                }
                if torque > has {
                    report.warn([format!(
                        "{where_}: wheel {wheels} needs {torque:.2} N.m per actuator to leave the ground, but the motor has {has}"
                    )]);
                }
                needs.push(format!("{wheels} {torque:.2}"));
            }
            let needs = needs.join(", ");
            let across: Vec<_> = vehicle
                .wheel
                .iter()
                .filter(|wheel| wheel.rolling_direction[0].abs() < ACROSS)
                .map(|wheel| wheel.name.as_str())
                .collect();
            let roller = match across[..] {
                [] => String::new(),
                _ => format!(
                    "; wheel {} stands across and meets the edge with a roller, which this leaves out: use omnistep chart",
                    across.join(", ")
                ),
            };
            return Ok(format!(
                "\n  {:<8} {where_}, least torques at first contact [N.m]: {needs}; the motor has {has}{roller}",
                "step"
            ));
        }
        Err(other) => return Err(other.into()),
    };
    let limits = linkage.climb_limits(&step, has, speed_m_s)?;
    if !limits.possible() {
        let rows = limits
            .rows
            .iter()
            .filter(|row| row.verdict == omni_bound::Verdict::Impossible);
        let rows = rows.map(|row| row.row).collect::<Vec<_>>().join(", ");
        report.warn([format!(
            "{where_}: impossible at {speed_m_s} m/s with the motor's {has} N.m, for these rows: {rows}; use omnistep climb-limits for details"
        )]);
    }
    let rows = limits
        .rows
        .iter()
        .map(|row| format!("{} {}", row.row, row.verdict.name()));
    let rows = rows.collect::<Vec<_>>().join(", ");
    Ok(format!(
        "\n  {:<8} {where_} at {speed_m_s} m/s: {rows} (omnistep climb-limits)",
        "step"
    ))
}

#[cfg(not(feature = "climb-limits"))]
fn on_step(
    _: &Vehicle,
    step_m: Option<f64>,
    _: f64,
    _: f64,
    _: f64,
    _: &mut Report,
) -> Result<String, Error> {
    match step_m {
        Some(_) => Err(Error::NotBuilt {
            what: "check --step",
            feature: "climb-limits",
        }),
        None => Ok(String::new()),
    }
}
