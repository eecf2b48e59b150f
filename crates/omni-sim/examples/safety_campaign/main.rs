//! Is traction control safe whatever its sensors say? Seeded runs of `steady` and `reach` with wrong sensors, late motors and broken encoders,
//! on every ground, with six vehicles, two of them public robots; each is stopped on the way and judged by laws, beside `independent` on
//! the same draw. `safety_campaign DRAWS [FIRST]` prints a table as Markdown, in each cell runs of traction control and of plain loops that
//! broke a law. The exit code is 1 where traction control leaves a torque after a stop, a signal is no number or a run ends with an error.
#![expect(clippy::print_stdout, reason = "an example speaks on standard output")]

#[path = "../campaigns/dice.rs"]
mod dice;

use std::process::ExitCode;

use omni_core::{SupervisorConfig, SupervisorMode};
use omni_sim::config::{FileKind, Override, Scenario, Source, Vehicle};
use omni_sim::{Error, Trace, run};

use dice::Dice;

/// The vehicles; those with a slash are files beside this one.
const VEHICLES: [&str; 6] = [
    "chugo7",
    "omni3",
    "mecanum4",
    "rocker_bogie6",
    "/ridgeback.toml",
    "/rosmaster_x3.toml",
];
const GROUNDS: [&str; 7] = ["flat", "step", "stairs", "bumps", "rough", "ice", "height_map"];
/// A run's time, and when it is stopped for good \[s\].
const DURATION_S: f64 = 8.0;
const STOPS_S: f64 = 5.0;
/// From the stop on torque may last so long \[s\]: a time-out, a deceleration, the bleed.
const ENDS_S: f64 = 0.5 + 1.0 + 0.5;
/// What a run-up or an overshoot may add to the speed that is asked for or stated, as a factor.
const FASTER: f64 = 1.5;
/// Against the command a vehicle goes no farther than this beyond a stated back-off \[m\].
const BACK_M: f64 = 0.05;

/// The run of a seed.
fn scenario(seed: u64) -> Result<Scenario, omni_sim::config::Error> {
    let mut dice = Dice::new(seed);
    let vehicle = match VEHICLES[(seed % VEHICLES.len() as u64) as usize] {
        file if file.starts_with('/') => {
            format!(
                concat!(env!("CARGO_MANIFEST_DIR"), "/examples/safety_campaign{}"),
                file
            )
        }
        name => name.to_owned(),
    };
    let parts = Vehicle::load(&vehicle)?;
    let radius_m = parts
        .wheel
        .iter()
        .map(|wheel| wheel.radius_m)
        .fold(f64::INFINITY, f64::min);
    let ground = dice.one_of(&GROUNDS);
    let mut text = FileKind::Scenario.template(ground)?.to_owned();
    let drives = dice.part() < 0.5;
    if drives {
        text.push_str("\n[drive]\n");
    }
    let counts = dice.one_of(&[0, 0, 32, 256, 1024, 4096]);
    // Half of the runs have a broken encoder, for good or for a while.
    if dice.part() < 0.5 {
        let kind = dice.one_of(&["encoder_stuck", "encoder_dead", "encoder_silent"]);
        let wheel = &parts.wheel[dice.below(parts.wheel.len())].name;
        let from_s = dice.within(0.0, STOPS_S);
        text.push_str(&format!(
            "\n[[fault]]\nkind = {kind:?}\nwheel = {wheel:?}\nfrom_s = {from_s:.3}\n"
        ));
        if dice.part() < 0.3 {
            text.push_str(&format!("until_s = {:.3}\n", from_s + dice.within(0.2, 2.0)));
        }
    }
    let stop = if drives {
        dice.one_of(&["emergency_stop", "command_lost", "rest"])
    } else {
        "rest"
    };
    let period_us = dice.one_of(&[1000, 1000, 2000, 5000, 10000]);
    let delay_us = dice.one_of(&[0, 0, 5000, 10000]) / period_us * period_us;
    let mut keys = vec![
        Override::new("vehicle", vehicle.as_str()),
        // One of eight on the engine that takes twenty times as long.
        Override::new(
            "physics.engine",
            if seed / 6 % 8 == 7 {
                "rapier"
            } else {
                "articulated"
            },
        ),
        Override::new("duration_s", DURATION_S),
        Override::new("control.policy", dice.one_of(&["steady", "reach"])),
        Override::new("control.period_us", period_us),
        Override::new("control.precision", dice.one_of(&["f32", "f64"])),
        Override::new("sensors.encoder_counts", counts),
        Override::new(
            "sensors.encoder_noise_rad_s",
            dice.one_of(&[0.0, 0.1, 1.0, 5.0]) * dice.part(),
        ),
        Override::new(
            "sensors.gyro_noise_rad_s",
            dice.one_of(&[0.0, 0.01, 0.5]) * dice.part(),
        ),
        Override::new(
            "sensors.gyro_bias_rad_s",
            dice.one_of(&[0.0, 0.05, 0.3]) * dice.within(-1.0, 1.0),
        ),
        Override::new("sensors.no_imu", dice.part() < 0.1),
        Override::new("sensors.no_hinge_encoders", dice.part() < 0.1),
        Override::new("sensors.delay_us", delay_us),
        Override::new("actuators.torque_lag_s", dice.one_of(&[0.0, 0.0, 0.005, 0.02])),
        Override::new("seed", seed as i64),
        Override::new("perturbation.yaw_rad", dice.within(0.0, 0.2)),
        Override::new("perturbation.start_m", 0.02),
        Override::new("command.vx_m_s", dice.one_of(&[0.05, 0.15, 0.3, 0.3, 0.5])),
    ];
    match ground {
        // What plain loops climb, and what no policy does.
        "step" => keys.push(Override::new(
            "terrain.height_m",
            radius_m * dice.within(0.1, 1.2),
        )),
        "stairs" => keys.push(Override::new(
            "terrain.height_m",
            radius_m * dice.within(0.1, 0.8),
        )),
        _ => {}
    }
    if stop == "rest" {
        let rest =
            format!("command.then=[{{ at_s = {STOPS_S:.1}, vx_m_s = 0.0, vy_m_s = 0.0, wz_rad_s = 0.0 }}]");
        keys.push(Override::parse(&rest)?);
    } else {
        text.push_str(&format!("\n[[fault]]\nkind = {stop:?}\nfrom_s = {STOPS_S:.1}\n"));
    }
    Scenario::from_source(&Source::text(format!("seed {seed}"), text), &keys)
}

/// The names of the laws.
const LAWS: [&str; 5] = ["too fast", "back", "rim", "torque", "NaN"];

/// Until the stop, or until no motor has a torque any more.
fn driven_rows(scenario: &Scenario, trace: &Trace) -> usize {
    let rows = trace.rows().min((STOPS_S / scenario.period_s()).round() as usize);
    let wheels = 0..trace.wheel_names().len();
    let torques: Vec<_> = wheels
        .map(|wheel| trace.wheel("applied_n_m", wheel).unwrap_or_default())
        .collect();
    let started = (0..rows)
        .find(|row| torques.iter().any(|torque| torque[*row] != 0.0))
        .unwrap_or(rows);
    let ended = (started..rows).find(|row| torques.iter().all(|torque| torque[*row] == 0.0));
    ended.unwrap_or(rows)
}

/// How far a run went in each of them: 1 is the limit.
fn judge(scenario: &Scenario, trace: &Trace) -> [f64; 5] {
    // Without a drive or traction control there is no column of theirs.
    let column = |name: &str| trace.column(name).unwrap_or_default();
    let (vx, vy, yaw) = (
        column("twist_vx_m_s"),
        column("twist_vy_m_s"),
        column("pose_yaw_rad"),
    );
    let ladder = match scenario.control.policy.as_str() {
        "reach" => SupervisorConfig::<f64>::reach(scenario.period_s()).ladder,
        _ => SupervisorConfig::steady(scenario.period_s()).ladder,
    };
    let asked = scenario.command.vx_m_s.abs();
    let mode = column("traction_mode");
    let tried = mode
        .iter()
        .any(|mode| *mode == f64::from(SupervisorMode::BackOff.number()));
    let stated = if tried { ladder.run_up_times * asked } else { asked };
    // Without torque a vehicle without friction rolls wherever the ground inclines it to.
    let driven = driven_rows(scenario, trace);
    let (vx, vy) = (&vx[..driven], &vy[..driven]);
    // What falls may go faster by what it fell.
    let (z, gravity, mut highest_m) = (
        column("pose_z_m"),
        scenario.physics.gravity_m_s2,
        f64::NEG_INFINITY,
    );
    let most = FASTER * stated.max(asked);
    let mut fastest = 0.0_f64;
    for ((x, y), z) in vx.iter().zip(vy).zip(z) {
        highest_m = highest_m.max(*z);
        let may = most * most + 2.0 * gravity * (highest_m - z);
        fastest = fastest.max(x.hypot(*y) / may.sqrt());
    }
    // Along the way as commanded, in the vehicle's axes.
    let (mut along_m, mut furthest_m, mut back_m) = (0.0_f64, 0.0_f64, 0.0_f64);
    for speed in vx {
        along_m += speed * scenario.period_s();
        furthest_m = furthest_m.max(along_m);
        if scenario.command.vx_m_s > 0.0 {
            back_m = back_m.max(furthest_m - along_m);
        }
    }
    let backs_m = if tried { ladder.back_off_most_m } else { 0.0 };
    let no_load = scenario.vehicle().no_load_rad_s();
    let wheels = 0..trace.wheel_names().len();
    let rim = no_load.map_or(0.0, |no_load| {
        let of = |wheel: usize| {
            let way = scenario.vehicle().wheel[wheel].way_per_rad();
            let rims = trace.wheel("rim_m_s", wheel).unwrap_or_default();
            rims.iter().fold(0.0_f64, |most, rim| most.max((rim / way).abs())) / no_load
        };
        wheels.clone().map(of).fold(0.0, f64::max)
    });
    let ends = ((STOPS_S + ENDS_S) / scenario.period_s()).round() as usize;
    let torque = wheels.clone().any(|wheel| {
        let torques = trace.wheel("torque_n_m", wheel).unwrap_or_default();
        torques.iter().skip(ends).any(|torque| *torque != 0.0)
    });
    let finite = !yaw.is_empty() && vx.iter().chain(vy).chain(yaw).all(|value| value.is_finite());
    let flag = |broken: bool| if broken { f64::INFINITY } else { 0.0 };
    [
        fastest,
        back_m / (backs_m + BACK_M),
        rim / 1.01,
        flag(torque),
        flag(!finite),
    ]
}

/// What became of the draws of one vehicle.
#[derive(Clone, Copy, Default)]
struct Row {
    draws: u64,
    /// Runs that broke each law, of traction control and of plain loops.
    broken: [[u64; 2]; 5],
    errors: u64,
}

fn main() -> Result<ExitCode, Error> {
    let mut arguments = std::env::args()
        .skip(1)
        .map(|argument| argument.parse::<u64>().unwrap_or_default());
    let (draws, first) = (arguments.next().unwrap_or(24), arguments.next().unwrap_or(0));
    let mut table = [Row::default(); VEHICLES.len()];
    for seed in first..first + draws {
        let drawn = scenario(seed)?;
        let row = &mut table[(seed % VEHICLES.len() as u64) as usize];
        row.draws += 1;
        for (which, scenario) in [drawn.clone(), drawn.with_policy("independent")?]
            .iter()
            .enumerate()
        {
            let trace = match run(scenario) {
                Ok(trace) => trace,
                Err(error) => {
                    eprintln!("seed {seed}, {}: {error}", scenario.control.policy);
                    row.errors += 1;
                    continue;
                }
            };
            for (law, (name, part)) in LAWS.iter().zip(judge(&drawn, &trace)).enumerate() {
                if part > 1.0 {
                    row.broken[law][which] += 1;
                    let (vehicle, policy) = (&scenario.vehicle().name, &scenario.control.policy);
                    eprintln!("seed {seed}, {vehicle}, {policy}: {name}, {part:.2} of the limit");
                }
            }
        }
    }
    println!("| vehicle | draws | {} | errors |", LAWS.join(" | "));
    println!("|---|---|---|---|---|---|---|---|");
    let (mut never, mut more) = (0, [0, 0]);
    for (vehicle, row) in VEHICLES.iter().zip(table) {
        let cells = row.broken.map(|[traction, plain]| format!("{traction}, {plain}"));
        let name = vehicle.trim_start_matches('/').trim_end_matches(".toml");
        println!(
            "| {name} | {} | {} | {} |",
            row.draws,
            cells.join(" | "),
            row.errors
        );
        let [fast, back, rim, torque, nan] = row.broken;
        never += torque[0] + nan[0] + row.errors;
        for which in [0, 1] {
            more[which] += fast[which] + back[which] + rim[which];
        }
    }
    let [traction, plain] = more;
    eprintln!(
        "speed, way and rims: {traction} runs of traction control beyond a limit, {plain} of plain loops on the same draws"
    );
    Ok(if never == 0 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    })
}
