//! What firmware's whole step (`[drive]`) does when things go wrong: seeded runs with random faults, sensors and patches of ice, each
//! judged by laws. `drive_campaign RUNS` prints a table as Markdown; the exit code is 1 where a law is broken.
#![expect(clippy::print_stdout, reason = "an example speaks on standard output")]

use std::process::ExitCode;

use omni_sim::config::{Fault, FileKind, Override, Scenario, Source};
use omni_sim::{Error, Trace, Verdict, run};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

/// Friction of what counts as ice.
const ICE: f64 = 0.2;
/// After this time a stopped vehicle stands \[s\].
const STOPPED_AFTER_S: f64 = 1.2;
/// A vehicle that stands moves no faster: a centimetre a second, and what a wheel's rim makes of it half a metre away.
const STANDS: [f64; 2] = [0.01, 0.05];
/// The vehicles, and on what they drive.
pub const PLACES: [(&str, &str); 6] = [
    ("flat", "chugo7"),
    ("flat", "omni3"),
    ("flat", "mecanum4"),
    ("flat", "rocker_bogie6"),
    ("step", "chugo7"),
    ("step", "rocker_bogie6"),
];

/// Random numbers of a seed.
struct Dice(ChaCha8Rng);

impl Dice {
    /// From 0 up to 1.
    fn part(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn within(&mut self, from: f64, to: f64) -> f64 {
        from + (to - from) * self.part()
    }

    /// One of so many.
    fn one_of(&mut self, count: usize) -> usize {
        ((self.part() * count as f64) as usize).min(count - 1)
    }
}

/// The run of a seed.
///
/// # Errors
/// None: every seed is a scenario.
pub fn scenario(seed: u64) -> Result<Scenario, omni_sim::config::Error> {
    let mut dice = Dice(ChaCha8Rng::seed_from_u64(seed));
    let (place, vehicle) = PLACES[(seed % PLACES.len() as u64) as usize];
    let mut text = FileKind::Scenario.template(place)?.to_owned();
    let wheels = omni_sim::config::Vehicle::load(vehicle)?.wheel;
    text.push_str("\n[drive]\n[drive.slip]\n[drive.faults]\n");
    // Encoders and motors that fail, for good or for a while, and commands that stop.
    for _ in 0..1 + dice.one_of(4) {
        let (kind, from_s) = (dice.one_of(5), dice.within(0.5, 3.0));
        let wheel = &wheels[dice.one_of(wheels.len())].name;
        let kind = [
            "wheel_lost",
            "wheel_drag",
            "encoder_stuck",
            "encoder_silent",
            "command_lost",
        ][kind];
        text.push_str(&format!("\n[[fault]]\nkind = {kind:?}\nfrom_s = {from_s:.3}\n"));
        if kind != "command_lost" {
            text.push_str(&format!("wheel = {wheel:?}\n"));
        }
        if kind == "wheel_drag" {
            text.push_str(&format!("damper_n_m_s_rad = {:.3}\n", dice.within(0.01, 1.0)));
        }
        if dice.part() < 0.5 {
            text.push_str(&format!("until_s = {:.3}\n", from_s + dice.within(0.2, 2.0)));
        }
    }
    for _ in 0..dice.one_of(3) {
        let (x, y) = (dice.within(-0.2, 1.0), dice.within(-0.6, 0.2));
        text.push_str(&format!(
            "\n[[friction_patch]]\nx_m = [{x:.3}, {:.3}]\ny_m = [{y:.3}, {:.3}]\nfriction = {:.3}\n",
            x + dice.within(0.1, 0.6),
            y + dice.within(0.1, 0.6),
            dice.within(0.02, 0.6),
        ));
    }
    let mut keys = vec![
        Override::new("vehicle", vehicle),
        Override::new("physics.engine", "articulated"),
        Override::new("duration_s", 6.0),
        Override::new("sensors.encoder_counts", [0, 4096, 65536][dice.one_of(3)]),
        Override::new("sensors.encoder_noise_rad_s", dice.within(0.0, 0.05)),
        Override::new("sensors.delay_us", [0, 1000, 2000][dice.one_of(3)]),
        Override::new(
            "control.policy",
            ["independent", "synchronised", "load_sharing"][dice.one_of(3)],
        ),
    ];
    if place == "flat" {
        keys.push(Override::new("command.vx_m_s", dice.within(-0.4, 0.4)));
        keys.push(Override::new("command.vy_m_s", dice.within(-0.3, 0.3)));
        keys.push(Override::new("command.wz_rad_s", dice.within(-0.8, 0.8)));
    }
    Scenario::from_source(&Source::text(format!("seed {seed}"), text), &keys)
}

/// What came of a run.
#[derive(Clone, Copy, Debug, Default)]
pub struct Found {
    /// It came to a safe stop.
    pub stopped: bool,
    /// A command timed out.
    pub timed_out: bool,
    /// A wheel was called faulty.
    pub faulty: bool,
    /// It moved 1.2 s after a safe stop, with a wheel on ice.
    pub slid: bool,
    /// It moved 1.2 s after a safe stop with fewer than three wheels left to hold it.
    pub rolled_on: bool,
    /// The fastest 1.2 s after a safe stop, over the ground \[m/s\] and about the vertical \[rad/s\].
    pub after: [f64; 2],
    /// Laws that it broke: a number that is none, a torque beyond its limit, motion after a safe stop, tipped over on flat ground.
    pub broken: [bool; 4],
}

/// The names of the laws.
pub const LAWS: [&str; 4] = [
    "not a number",
    "torque beyond its limit",
    "moved after a safe stop",
    "tipped on flat ground",
];

/// Judges a run.
#[must_use]
pub fn judge(scenario: &Scenario, trace: &Trace) -> Found {
    let column = |name: &str| trace.column(name).unwrap_or_default();
    let (mode, status) = (column("drive_mode"), column("drive_command_status"));
    let wheels = trace.wheel_names().len();
    let mut found = Found {
        stopped: mode.contains(&2.0),
        timed_out: status.contains(&3.0),
        faulty: trace.wheel_names().iter().any(|name| {
            column(&format!("drive_fault_{name}"))
                .iter()
                .any(|fault| *fault > 0.0)
        }),
        ..Found::default()
    };
    for (name, index) in trace.names().iter().zip(0..) {
        // A silent encoder says nothing, and what follows from its reading is not known.
        let may_be_none = ["measured_rad_s", "disturbed_ratio"]
            .iter()
            .any(|signal| name.ends_with(signal));
        found.broken[0] |= !may_be_none && trace.column_at(index).iter().any(|value| !value.is_finite());
    }
    for wheel in 0..wheels {
        let of = |signal| trace.wheel(signal, wheel).unwrap_or_default();
        let limits = of("limit_lower_n_m").iter().zip(of("limit_upper_n_m"));
        let within = of("applied_n_m")
            .iter()
            .zip(limits)
            .all(|(torque, (lower, upper))| (*lower..=*upper).contains(torque));
        found.broken[1] |= !within;
    }
    let stops_at = mode.iter().position(|mode| *mode == 2.0);
    let from = stops_at.map_or(usize::MAX, |at| {
        at + (STOPPED_AFTER_S / scenario.period_s()) as usize
    });
    let mut in_hand = 0;
    for row in stops_at.unwrap_or(usize::MAX)..trace.rows() {
        in_hand = if is_out_of_hand(scenario, trace, row) {
            0
        } else {
            in_hand + 1
        };
        if row < from {
            continue;
        }
        let at = |name: &str| column(name)[row];
        let speeds = [
            at("twist_vx_m_s").hypot(at("twist_vy_m_s")),
            at("twist_wz_rad_s").abs(),
        ];
        for (most, speed) in found.after.iter_mut().zip(speeds) {
            *most = most.max(speed);
        }
        if speeds[0] > STANDS[0] || speeds[1] > STANDS[1] {
            if on_ice(scenario, trace, row) {
                found.slid = true;
            } else if in_hand <= from - stops_at.unwrap_or(0) {
                found.rolled_on = true;
            } else {
                found.broken[2] = true;
            }
        }
    }
    let flat = scenario.terrain.obstacle().is_none();
    found.broken[3] = flat && trace.outcome().verdict == Verdict::Tipped;
    found
}

/// Have fewer than three wheels both an encoder that tells the truth, and is believed, and a motor that gives torque? No law has a hold on
/// every motion then.
fn is_out_of_hand(scenario: &Scenario, trace: &Trace, row: usize) -> bool {
    let time_s = trace.column("time_s").map_or(0.0, |time| time[row]);
    let lost = |name: &str| {
        scenario.fault.iter().any(|fault| {
            let (from_s, until_s) = fault.span_s();
            matches!(fault, Fault::WheelLost { wheel, .. } | Fault::EncoderStuck { wheel, .. } if wheel == name)
                && (from_s..until_s).contains(&time_s)
        })
    };
    let shorted = |name: &str| {
        trace
            .column(&format!("drive_brake_{name}"))
            .is_some_and(|brake| brake[row] == 1.0)
    };
    let names = trace.wheel_names().iter();
    names.filter(|name| !lost(name) && !shorted(name)).count() < 3
}

/// Is a wheel on ice?
fn on_ice(scenario: &Scenario, trace: &Trace, row: usize) -> bool {
    (0..trace.wheel_names().len()).any(|wheel| {
        let at = |signal| trace.wheel(signal, wheel).map_or(f64::NAN, |of| of[row]);
        let (x, y) = (at("x_m"), at("y_m"));
        scenario.friction_patch.iter().any(|patch| {
            let inside = |[from, to]: [f64; 2], at: f64| at >= from && at < to;
            patch.friction < ICE && inside(patch.x_m, x) && inside(patch.y_m, y)
        })
    })
}

fn main() -> Result<ExitCode, Error> {
    let runs: u64 = std::env::args()
        .nth(1)
        .and_then(|runs| runs.parse().ok())
        .unwrap_or(24);
    let verbose = std::env::args().any(|argument| argument == "--seeds");
    let mut rows = vec![(0_u64, Found::default(), [0_u64; 9]); PLACES.len()];
    for seed in 0..runs {
        let scenario = scenario(seed)?;
        let trace = run(&scenario)?;
        let found = judge(&scenario, &trace);
        let (count, _, sums) = &mut rows[(seed % PLACES.len() as u64) as usize];
        *count += 1;
        let flags = [
            found.faulty,
            found.timed_out,
            found.stopped,
            found.slid,
            found.rolled_on,
        ];
        for (sum, flag) in sums.iter_mut().zip(flags.into_iter().chain(found.broken)) {
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
        "| ground, vehicle | runs | a wheel was called faulty | a command timed out | safe stops | slid on ice | rolled on | {} |",
        LAWS.join(" | ")
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    let mut broken = 0;
    for ((place, vehicle), (count, _, sums)) in PLACES.iter().zip(&rows) {
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
