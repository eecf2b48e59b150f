//! What controllers do when things go wrong: seeded runs with random faults, sensors, policies, engines and ice.
//!
//! Each is stopped at half of its time and judged by laws. All but those of traction control run firmware's whole step
//! (`[drive]`). `drive_campaign RUNS` prints a table as Markdown; the exit code is 1 where a law is broken.
#![expect(clippy::print_stdout, reason = "an example speaks on standard output")]

#[path = "campaigns/dice.rs"]
mod dice;

use std::process::ExitCode;

use omni_core::Coordination;
use omni_sim::config::{Fault, FileKind, Override, POLICIES, Scenario, Source, Vehicle};
use omni_sim::{Error, Trace, Verdict, run};

use dice::Dice;

/// Friction of what counts as ice.
const ICE: f64 = 0.2;
/// A vehicle that stands moves no faster: a centimetre a second, and what a wheel's rim makes of it half a metre away.
const STANDS: [f64; 2] = [0.01, 0.05];
/// Rest is commanded for so long before a run's last 0.6 s \[s\]: up to 0.5 m/s at 0.5 m/s^2, and a
/// second in which torque ends.
const RESTS_S: f64 = 2.0;
/// Work of the motors in those 0.6 s that is a push \[J\].
const PUSHES_J: f64 = 0.05;
const PUSHES_S: f64 = 0.6;
/// Against its command a vehicle moves faster than this \[m/s\], and by 5 cm in half a second and more.
const AGAINST: [f64; 2] = [0.02, 0.05];
/// The vehicles, and on what they drive.
pub const PLACES: [(&str, &str); 6] = [
    ("flat", "chugo7"),
    ("flat", "omni3"),
    ("flat", "mecanum4"),
    ("flat", "rocker_bogie6"),
    ("step", "chugo7"),
    ("step", "rocker_bogie6"),
];

/// A run's time, and when it is stopped for good \[s\].
const DURATION_S: f64 = 6.0;
const STOPS_S: f64 = 3.0;

/// The kinds of faults that are drawn.
const KINDS: [&str; 12] = [
    "wheel_lost",
    "wheel_drag",
    "motor_weak",
    "supply_sag",
    "encoder_stuck",
    "encoder_dead",
    "encoder_toggles",
    "encoder_slips",
    "encoder_silent",
    "load_added",
    // The last two: without a drive nothing ends a lost command, and there is no such button.
    "command_lost",
    "emergency_stop",
];

/// The run of a seed.
///
/// # Errors
/// None: every seed is a scenario.
pub fn scenario(seed: u64) -> Result<Scenario, omni_sim::config::Error> {
    let mut dice = Dice::new(seed);
    let (place, name) = PLACES[(seed % PLACES.len() as u64) as usize];
    let mut text = FileKind::Scenario.template(place)?.to_owned();
    let vehicle = Vehicle::load(name)?;
    let policy = dice.one_of(&POLICIES);
    // Half of traction control is by itself.
    let drives = Coordination::<f64>::preset(policy).is_some() || dice.part() < 0.5;
    if drives {
        text.push_str("\n[drive]\n[drive.slip]\n[drive.faults]\n");
    }
    let kinds = &KINDS[..KINDS.len() - if drives { 0 } else { 2 }];
    let counts = dice.one_of(&[0, 256, 4096, 65536]);
    // Encoders and motors that fail, for good or for a while, commands that stop, the emergency stop, a load.
    for _ in 0..1 + dice.below(4) {
        let (kind, from_s) = (dice.one_of(kinds), dice.within(0.5, STOPS_S));
        // Without counts there is nothing that toggles.
        let kind = if kind == "encoder_toggles" && counts == 0 {
            "encoder_dead"
        } else {
            kind
        };
        let wheel = &vehicle.wheel[dice.below(vehicle.wheel.len())].name;
        text.push_str(&format!("\n[[fault]]\nkind = {kind:?}\nfrom_s = {from_s:.3}\n"));
        match kind {
            "command_lost" | "emergency_stop" | "supply_sag" => {}
            "load_added" => text.push_str(&format!(
                "body = {:?}\nmass_kg = {:.3}\nat_m = [{:.3}, {:.3}, 0.2]\n",
                vehicle.body[0].name,
                dice.within(0.1, 5.0),
                dice.within(-0.1, 0.1),
                dice.within(-0.1, 0.1),
            )),
            _ => text.push_str(&format!("wheel = {wheel:?}\n")),
        }
        match kind {
            "wheel_drag" => text.push_str(&format!("damper_n_m_s_rad = {:.3}\n", dice.within(0.01, 1.0))),
            "motor_weak" | "supply_sag" | "encoder_slips" => {
                text.push_str(&format!("part = {:.3}\n", dice.within(0.2, 0.9)));
            }
            _ => {}
        }
        if kind != "load_added" && dice.part() < 0.5 {
            text.push_str(&format!("until_s = {:.3}\n", from_s + dice.within(0.2, 2.0)));
        }
    }
    // It is stopped for good: by a button, by a lost connection, by command.
    let stop = if drives { dice.below(3) } else { 2 };
    if let Some(kind) = ["emergency_stop", "command_lost"].get(stop) {
        text.push_str(&format!("\n[[fault]]\nkind = {kind:?}\nfrom_s = {STOPS_S:.1}\n"));
    }
    for _ in 0..dice.below(3) {
        let (x, y) = (dice.within(-0.2, 1.0), dice.within(-0.6, 0.2));
        text.push_str(&format!(
            "\n[[friction_patch]]\nx_m = [{x:.3}, {:.3}]\ny_m = [{y:.3}, {:.3}]\nfriction = {:.3}\n",
            x + dice.within(0.1, 0.6),
            y + dice.within(0.1, 0.6),
            dice.within(0.02, 0.6),
        ));
        if dice.part() < 0.5 {
            let [vx, vy] = [(); 2].map(|()| dice.within(-0.2, 0.2));
            text.push_str(&format!("velocity_m_s = [{vx:.3}, {vy:.3}]\n"));
        }
    }
    // A quarter of them on the engine that takes ten times as long.
    let rapier = seed / PLACES.len() as u64 % 4 == 3;
    let mut keys = vec![
        Override::new("vehicle", name),
        Override::new("physics.engine", if rapier { "rapier" } else { "articulated" }),
        Override::new("duration_s", DURATION_S),
        Override::new("sensors.encoder_counts", counts),
        Override::new("sensors.encoder_noise_rad_s", dice.within(0.0, 0.05)),
        Override::new("sensors.delay_s", dice.one_of(&[0.0, 0.001, 0.002])),
        Override::new("control.precision", dice.one_of(&["f32", "f64"])),
        Override::new("control.policy", policy),
    ];
    if place == "flat" {
        keys.push(Override::new("command.vx_m_s", dice.within(-0.4, 0.4)));
        keys.push(Override::new("command.vy_m_s", dice.within(-0.3, 0.3)));
        keys.push(Override::new("command.wz_rad_s", dice.within(-0.8, 0.8)));
    }
    if stop == 2 {
        let rest =
            format!("command.then=[{{ at_s = {STOPS_S:.1}, vx_m_s = 0.0, vy_m_s = 0.0, wz_rad_s = 0.0 }}]");
        keys.push(Override::parse(&rest)?);
    }
    Scenario::from_source(&Source::text(format!("seed {seed}"), text), &keys)
}

/// What came of a run.
#[derive(Clone, Copy, Debug, Default)]
pub struct Found {
    /// A wheel was called faulty.
    pub faulty: bool,
    /// A command timed out.
    pub timed_out: bool,
    /// It came to a stop: a safe stop, an emergency stop.
    pub stopped: [bool; 2],
    /// It still moves at the end.
    pub rolls: bool,
    /// Laws that it broke, as [`LAWS`].
    pub broken: [bool; 6],
}

/// The names of the laws; docs/drive.md says what they and the other columns mean.
pub const LAWS: [&str; 6] = ["NaN", "torque", "pushed", "moved", "tipped", "verdict"];

/// Judges a run.
#[must_use]
pub fn judge(scenario: &Scenario, trace: &Trace) -> Found {
    let column = |name: &str| trace.column(name).unwrap_or_default();
    let (mode, status) = (column("drive_mode"), column("drive_command_status"));
    let mut found = Found {
        faulty: trace.wheel_names().iter().any(|name| {
            column(&format!("drive_fault_{name}"))
                .iter()
                .any(|fault| *fault > 0.0)
        }),
        timed_out: status.contains(&3.0),
        stopped: [mode.contains(&2.0), mode.contains(&3.0)],
        ..Found::default()
    };
    for (name, index) in trace.names().iter().zip(0..) {
        // A silent encoder says nothing, and what follows from its reading is not known.
        let may_be_none = ["measured_rad_s", "disturbed_ratio"]
            .iter()
            .any(|signal| name.ends_with(signal))
            || name.starts_with("sensed_increment_rad");
        found.broken[0] |= !may_be_none && trace.column_at(index).iter().any(|value| !value.is_finite());
    }
    found.broken[1] = beyond_limits(scenario, trace);
    found.broken[2] = torque_at_rest(scenario, trace) || works_at_the_end(trace);
    let flat = scenario.terrain.obstacle().is_none();
    let last = trace.rows() - 1;
    found.rolls = speed(trace, last) > 1.0;
    found.broken[3] = found.rolls && flat && nothing_is_broken(scenario) && !has_ice(scenario);
    found.broken[4] = flat && trace.outcome().verdict == Verdict::Tipped;
    let plain = matches!(trace.outcome().verdict, Verdict::Completed | Verdict::Unfinished);
    found.broken[5] = plain && (pushes(scenario, trace) || goes_against(scenario, trace));
    found
}

/// Was a torque beyond what the controller found the motor to have, or one that acted beyond what it has at rest?
fn beyond_limits(scenario: &Scenario, trace: &Trace) -> bool {
    let stall_n_m = scenario.vehicle().motor.stall_torque_n_m;
    (0..trace.wheel_names().len()).any(|wheel| {
        let of = |signal| trace.wheel(signal, wheel).unwrap_or_default();
        let mut limits = of("limit_lower_n_m").iter().zip(of("limit_upper_n_m"));
        let mut torques = of("applied_n_m").iter();
        // An average over the period: a rounding more than the limit.
        let acts_within = |torque: &f64| torque.abs() <= stall_n_m * (1.0 + 1e-12);
        torques.any(|torque| {
            limits
                .next()
                .is_none_or(|(lower, upper)| !(*lower..=*upper).contains(torque))
        }) || !of("torque_n_m").iter().all(acts_within)
    })
}

/// Is the command the same in so many seconds before the end?
fn steady_command(scenario: &Scenario, trace: &Trace, time_s: f64) -> Option<[f64; 3]> {
    let rows = (time_s / scenario.period_s()).round() as usize;
    let first = trace.rows().checked_sub(rows)?;
    let columns = ["command_vx_m_s", "command_vy_m_s", "command_wz_rad_s"];
    let columns = columns.map(|name| trace.column(name).unwrap_or_default());
    let same = columns
        .iter()
        .all(|column| column[first..].iter().all(|value| *value == column[first]));
    same.then(|| columns.map(|column| column[first]))
}

/// Do motors drive wheels at the end, long after a stop?
#[must_use]
pub fn pushes(scenario: &Scenario, trace: &Trace) -> bool {
    let rests = steady_command(scenario, trace, RESTS_S + PUSHES_S) == Some([0.0; 3]);
    let rows = (PUSHES_S / scenario.period_s()).round() as usize;
    let work_j = |wheel: usize| -> f64 {
        let of = |signal| trace.wheel(signal, wheel).unwrap_or_default();
        let way = scenario.vehicle().wheel[wheel].way_per_rad();
        let powers = of("torque_n_m").iter().zip(of("rim_m_s"));
        let last = powers.rev().take(rows);
        last.map(|(torque, rim)| (torque * rim / way).max(0.0) * scenario.period_s())
            .sum()
    };
    rests && (0..trace.wheel_names().len()).map(work_j).sum::<f64>() > PUSHES_J
}

/// Does it move against its command in the last half second?
#[must_use]
pub fn goes_against(scenario: &Scenario, trace: &Trace) -> bool {
    let Some([vx, vy, _]) = steady_command(scenario, trace, RESTS_S) else {
        return false;
    };
    let (commanded, rows) = (vx.hypot(vy), (0.5 / scenario.period_s()).round() as usize);
    let columns = ["twist_vx_m_s", "twist_vy_m_s"].map(|name| trace.column(name).unwrap_or_default());
    let along = columns[0]
        .iter()
        .zip(columns[1])
        .rev()
        .take(rows)
        .map(|(x, y)| (x * vx + y * vy) / commanded);
    let back: Vec<f64> = along.map(|along| -along).collect();
    let (least, way) = (AGAINST[0].max(0.1 * commanded), AGAINST[1]);
    commanded > AGAINST[0]
        && back.iter().all(|back| *back > least)
        && back.iter().sum::<f64>() * scenario.period_s() > way
}

/// Is a torque commanded although rest has been commanded for the time in which torque ends?
fn torque_at_rest(scenario: &Scenario, trace: &Trace) -> bool {
    let ends = (scenario.control.rest.torque_ends_s() / scenario.period_s()).round() as usize;
    let command = ["command_vx_m_s", "command_vy_m_s", "command_wz_rad_s"];
    let command = command.map(|name| trace.column(name).unwrap_or_default());
    let mut rests = 0;
    (0..trace.rows()).any(|row| {
        let rest = command.iter().all(|column| column[row] == 0.0);
        rests = if rest { rests + 1 } else { 0 };
        rests > ends
            && (0..trace.wheel_names().len()).any(|wheel| torque(trace, "applied_n_m", wheel, row) != 0.0)
    })
}

/// Does a motor act in the last second, three seconds after the stop?
fn works_at_the_end(trace: &Trace) -> bool {
    let rows = trace.rows();
    let first = (rows as f64 * (1.0 - 1.0 / DURATION_S)).round() as usize;
    (first..rows)
        .any(|row| (0..trace.wheel_names().len()).any(|wheel| torque(trace, "torque_n_m", wheel, row) != 0.0))
}

fn torque(trace: &Trace, signal: &str, wheel: usize, row: usize) -> f64 {
    trace
        .wheel(signal, wheel)
        .map_or(f64::NAN, |torques| torques[row])
}

/// Are its wheels, motors and encoders as they should be? Encoders of 256 counts are not: read every
/// millisecond, one count asks for all that a motor has, and loops that get one now and then hardly brake.
fn nothing_is_broken(scenario: &Scenario) -> bool {
    if scenario.sensors.encoder_counts == 256.0 {
        return false;
    }
    let mut faults = scenario.fault.iter();
    faults.all(|fault| {
        matches!(
            fault,
            Fault::CommandLost(_) | Fault::EmergencyStop(_) | Fault::LoadAdded(_)
        )
    })
}

/// How fast the vehicle moves: up to 1 it stands.
fn speed(trace: &Trace, row: usize) -> f64 {
    let at = |name: &str| trace.column(name).map_or(f64::NAN, |column| column[row]);
    let linear = at("twist_vx_m_s").hypot(at("twist_vy_m_s")) / STANDS[0];
    linear.max(at("twist_wz_rad_s").abs() / STANDS[1])
}

/// Is there ice anywhere?
fn has_ice(scenario: &Scenario) -> bool {
    scenario.friction_patch.iter().any(|patch| patch.friction < ICE)
}

fn main() -> Result<ExitCode, Error> {
    let runs: u64 = std::env::args()
        .nth(1)
        .and_then(|runs| runs.parse().ok())
        .unwrap_or(24);
    let verbose = std::env::args().any(|argument| argument == "--seeds");
    let mut rows = vec![(0_u64, [0_u64; 11]); PLACES.len()];
    for seed in 0..runs {
        let scenario = scenario(seed)?;
        let found = judge(&scenario, &run(&scenario)?);
        let (count, sums) = &mut rows[(seed % PLACES.len() as u64) as usize];
        *count += 1;
        let flags = [found.faulty, found.timed_out]
            .into_iter()
            .chain(found.stopped)
            .chain([found.rolls])
            .chain(found.broken);
        for (sum, flag) in sums.iter_mut().zip(flags) {
            *sum += u64::from(flag);
        }
        if verbose && found.broken.contains(&true) {
            eprintln!(
                "seed {seed}, {}: {found:?} {:?}",
                scenario.vehicle().name,
                scenario.fault
            );
        }
    }
    println!(
        "| ground, vehicle | runs | faulty | time-out | safe stop | e-stop | rolls | {} |",
        LAWS.join(" | ")
    );
    println!("{}", "|---".repeat(13) + "|");
    let mut broken = 0;
    for ((place, vehicle), (count, sums)) in PLACES.iter().zip(&rows) {
        let sums_text: Vec<_> = sums.iter().map(u64::to_string).collect();
        println!("| {place}, {vehicle} | {count} | {} |", sums_text.join(" | "));
        broken += sums[5..].iter().sum::<u64>();
    }
    Ok(if broken == 0 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    })
}
