//! Wheels whose rollers are bodies of their own, against closed forms and against balls (docs/validation.md).

use std::f64::consts::PI;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use omni_core::BodyTwist;
use omni_sim::config::{Override, Scenario, Study, builtin_scenarios};
use omni_sim::{Simulation, Trace, run};
use omni_study::{Plan, Run};

use crate::engines::{load, on_both_engines, passed};

/// A built-in scenario with roller wheels.
fn scenario(name: &str, overrides: &[&str]) -> Scenario {
    let mut all = vec![Override::parse("physics.wheel_model=rollers").expect("key=value")];
    all.extend(
        overrides
            .iter()
            .map(|text| Override::parse(text).expect("key=value")),
    );
    load(name, &all).expect("valid")
}

/// Mean of a column over its last rows.
fn tail(trace: &Trace, column: &str, rows: usize) -> f64 {
    let all = trace.column(column).expect("a column");
    all[all.len() - rows..].iter().sum::<f64>() / rows as f64
}

/// Twist that the vehicle has and twist by its encoders, averaged over the last rows of a run at `command`.
fn driven(vehicle: &str, command: [f64; 3], duration_s: f64, rows: usize) -> [[f64; 3]; 2] {
    let [vx, vy, wz] = command;
    let overrides = [
        format!("vehicle={vehicle}"),
        format!("command.vx_m_s={vx}"),
        format!("command.vy_m_s={vy}"),
        format!("command.wz_rad_s={wz}"),
        format!("duration_s={duration_s}"),
        "control.policy=scale_references".to_owned(),
    ];
    let overrides: Vec<_> = overrides.iter().map(String::as_str).collect();
    let trace = run(&scenario("flat", &overrides)).expect("finite");
    ["twist", "estimated"].map(|what| {
        ["vx_m_s", "vy_m_s", "wz_rad_s"].map(|axis| tail(&trace, &format!("{what}_{axis}"), rows))
    })
}

fn forward_command_is_followed_by_seven_roller_wheels() {
    // A roller takes 0.115 s to pass at 0.3 m/s, so 0.46 s average over whole rollers.
    let [twist, encoders] = driven("chugo7", [0.3, 0.0, 0.0], 1.5, 460);
    // Rollers that pass shake the vehicle by a millimetre a second, which averages to less than a
    // thousandth of its speed; the encoders do not measure more than that either.
    assert!(
        (twist[0] / encoders[0] - 1.0).abs() < 1e-3,
        "{twist:?}, encoders {encoders:?}"
    );
    assert!((twist[0] - 0.3).abs() < 2e-3 * 0.3, "{twist:?}"); // what the loops' integrals have not settled yet
    assert!(twist[1].abs() < 3e-4 && twist[2].abs() < 1e-3, "{twist:?}");
}

fn every_direction_is_followed_by_three_double_wheels() {
    for command in [[0.3, 0.0, 0.0], [0.0, 0.3, 0.0], [0.0, 0.0, 0.8]] {
        let [twist, encoders] = driven("omni3", command, 2.0, 700);
        for axis in 0..3 {
            // The rows' contacts are 9 mm to either side of a wheel's middle and change between rollers:
            // forces off the middle turn the vehicle by milliradians a second for as long as a roller is down.
            let allowed = if axis == 2 { 0.01 } else { 0.002 };
            let error = twist[axis] - encoders[axis];
            assert!(
                error.abs() < allowed,
                "{command:?}: {twist:?}, encoders {encoders:?}"
            );
        }
    }
}

fn mecanum_rollers_lose_sideways_what_their_tilt_takes() {
    // A roller on its way past the ground is tilted by up to pi / N: its axis, seen from above, is
    // then at tan(g) / cos(tilt) to the rolling direction. Forward nothing changes; sideways v = w
    // r / tan, times the mean of that cosine, and yaw has both.
    let half = PI / 9.0;
    let (mean_cos, mean_inverse) = (half.sin() / half, ((PI / 4.0 + half / 2.0).tan()).ln() / half);
    let yaw = 0.45 / (0.2 + 0.25 * mean_inverse);
    for (axis, command, expected, allowed) in [
        (0, [0.3, 0.0, 0.0], 1.0, 0.002),
        (1, [0.0, 0.3, 0.0], mean_cos, 0.003),
        (2, [0.0, 0.0, 0.6], yaw, 0.004),
    ] {
        // 0.53 s: three rollers a wheel at 0.3 m/s, all wheels' rollers in step; with 0.45 m for
        // yaw it is two and a half.
        let [twist, encoders] = driven("mecanum4", command, 2.0, 531);
        let ratio = twist[axis] / encoders[axis];
        assert!(
            (ratio - expected).abs() < allowed,
            "axis {axis}: {ratio}, expected {expected}"
        );
    }
}

/// The vehicle after so many milliseconds at rest on flat ground.
fn at_rest(periods: usize) -> Simulation {
    let mut simulation = Simulation::new(&scenario("flat", &[])).expect("valid");
    for _ in 0..periods {
        simulation.step(&BodyTwist::ZERO).expect("finite");
    }
    simulation
}

fn static_row_loads_follow_from_the_moment_balance_with_rollers() {
    let mut simulation = at_rest(400);
    let mut loads = [0.0; 7];
    for _ in 0..100 {
        simulation.step(&BodyTwist::ZERO).expect("finite");
        for (load, wheel) in loads.iter_mut().zip(&simulation.observation().wheels) {
            *load += wheel.force_normal_n / 100.0;
        }
    }
    // As for balls (tests/statics.rs): hubs and rollers weigh what the wheels of the file do.
    let row = 9.81 * (6.0 * 0.18 + 3.0 * 0.30) / 0.30;
    for (name, wheels) in [("front", [4, 5, 6]), ("rear", [0, 1, 2])] {
        let load: f64 = wheels.iter().map(|w| loads[*w]).sum();
        assert!(
            (load / row - 1.0).abs() < 0.01,
            "{name} row {load} N, expected {row}"
        );
    }
    let all: f64 = loads.iter().sum();
    // What contacts still swing after half a second.
    assert!((all / (20.0 * 9.81) - 1.0).abs() < 1e-3, "{all} N on the ground");
}

fn free_acceleration_is_that_of_five_turning_wheels() {
    // 0.3 N.m on wheels 1, 3, 4, 5, 7 as they roll. Wheels 2 and 6 stand still on their rollers,
    // which is what balls cannot do.
    let mut simulation = at_rest(100);
    let mut torques = [0.0; 7];
    for (torque, rolls) in torques.iter_mut().zip([1.0, 0.0, -1.0, 1.0, 1.0, 0.0, -1.0]) {
        *torque = 0.3 * rolls;
    }
    let start = simulation.observation().twist.vx_m_s;
    for _ in 0..500 {
        simulation.step_torques(&torques).expect("finite");
    }
    let gained = simulation.observation().twist.vx_m_s - start;
    let expected = 0.5 * (5.0 * 0.3 / 0.066) / (20.0 + 5.0 * 0.002178 / (0.066 * 0.066));
    // Loads that change from roller to roller cost some of it, never give any; 3 % would be a wheel too many.
    let lost = 1.0 - gained / expected;
    assert!(
        lost > -0.002 && lost < 0.02,
        "{gained} m/s, expected {expected}: {lost} lost"
    );
}

fn axle_rises_and_sinks_over_the_rollers_as_their_geometry_says() {
    // Three wheels under a vehicle that spins. Straight rollers in one row, so that there is
    // something to see; slowly, so that nothing leaves the ground.
    let single = scenario(
        "flat",
        &[
            "vehicle=omni3",
            "vehicle.rollers.rows=1",
            "vehicle.rollers.count=12",
            "vehicle.rollers.radius_m=0.006",
            "vehicle.rollers.crown_m=0",
            "command.vx_m_s=0",
            "command.wz_rad_s=0.3",
            "duration_s=1.0",
        ],
    );
    let built = single.rollers(0).expect("rollers");
    let trace = run(&single).expect("finite");
    let ripple = built.ripple();
    let height = ripple.max_m - ripple.min_m;
    assert!(height > 5e-4, "something to see: {height} m");
    for wheel in 0..3 {
        let z = trace.wheel("z_m", wheel).expect("z");
        let speed = trace.wheel("measured_rad_s", wheel).expect("speed");
        let (mut turned, mut worst) = (0.0, 0.0_f64);
        let (mut low, mut high) = (f64::MAX, f64::MIN);
        for (k, (z, speed)) in z.iter().zip(speed).enumerate() {
            turned += speed * 1e-3;
            if k < 50 {
                continue; // it comes down from a corner, where it is put, to the side of a roller
            }
            worst = worst.max((z - built.axle_height_m(turned)).abs());
            (low, high) = (low.min(*z), high.max(*z));
        }
        assert!(
            turned > 2.0 * PI / 12.0,
            "more than one roller has passed: {turned} rad"
        );
        // Contacts give by 0.04 mm, more where two rollers change over.
        assert!(
            (high - low - height).abs() < 0.1 * height,
            "wheel {wheel}: {} instead of {height} m",
            high - low
        );
        assert!(
            worst < 0.1 * height,
            "wheel {wheel}: {worst} m off, of {height} m"
        );
    }
}

fn a_wheel_of_rollers_among_balls_carries_its_share_and_drives() {
    let own = "vehicle.wheel[3].contact={kind = \"rollers\", count = 12, radius_m = 0.006}";
    let overrides = [own, "duration_s=1.0"].map(|text| Override::parse(text).expect("key=value"));
    let trace = run(&load("flat", &overrides).expect("valid")).expect("finite");
    let load = tail(&trace, "wheel_4_force_normal_n", 300);
    // 66.7 N by the moment balance; as its rollers pass, the frames beside it swing by some newtons.
    assert!((load / 66.7 - 1.0).abs() < 0.05, "{load} N on wheel 4");
    let (speed, encoders) = (
        tail(&trace, "twist_vx_m_s", 300),
        tail(&trace, "estimated_vx_m_s", 300),
    );
    assert!(
        (speed / encoders - 1.0).abs() < 1e-3,
        "{speed} m/s, encoders {encoders} m/s"
    );
}

fn rollers_saved_and_resumed_go_on_bit_for_bit() {
    // The front row starts at the riser, and climbs.
    let climb = scenario("step", &["duration_s=0.3", "start.x_m=0.33"]);
    let mut simulation = Simulation::new(&climb).expect("valid");
    let step = |simulation: &mut Simulation| {
        let command = simulation.scenario_command();
        simulation.step(&command).expect("finite");
        (simulation.sample().clone(), simulation.observation().clone())
    };
    let (mut saved, mut history) = (Vec::new(), Vec::new());
    for k in 0..240 {
        if [0, 1, 90, 140].contains(&k) {
            saved.push((k, simulation.save(&climb).expect("saved")));
        }
        history.push(step(&mut simulation));
    }
    for (k, bytes) in saved {
        // Twice: what is resumed can be saved again.
        let again = Simulation::resume(&climb, &bytes).and_then(|resumed| resumed.save(&climb));
        let mut resumed = Simulation::resume(&climb, &again.expect("saved")).expect("a snapshot");
        for (ahead, expected) in history[k..].iter().enumerate().take(100) {
            assert_eq!(
                &step(&mut resumed),
                expected,
                "saved at period {k}, {ahead} periods later"
            );
        }
    }
}

fn same_rollers_leave_the_same_bits() {
    // The front row starts at the riser, and climbs.
    let climb = scenario("step", &["duration_s=0.3", "start.x_m=0.33"]);
    let once = || run(&climb).expect("finite");
    assert_eq!(once(), once());
}

fn rollers_take_as_long_over_the_step_as_balls() {
    let crossing = |model: &str| {
        let wheels = Override::new("physics.wheel_model", model);
        let policy = Override::new("control.policy", "independent");
        let scenario = load("step", &[wheels, policy]).expect("valid");
        run(&scenario).expect("finite").outcome().crossing_s
    };
    let ball = crossing("ball").expect("balls climb");
    let rollers = crossing("rollers").expect("rollers climb");
    // Two wheels in seven do not turn: less inertia. Rollers catch on the edge and slip off it:
    // that costs more (docs/validation.md).
    let ratio = rollers / ball;
    assert!(
        (1.0..1.25).contains(&ratio),
        "balls {ball} s, rollers {rollers} s"
    );
}

/// Of runs of the study `wheel_models`: torque limit, friction, and the share of them that climbed
/// on balls and on rollers.
fn climbed(of: impl Fn(&Run) -> bool) -> Vec<([f64; 2], [f64; 2])> {
    let grid = Study::load("wheel_models").expect("built in");
    let plan = Plan::new(&grid, &[]).expect("valid");
    let runs: Vec<_> = plan.runs().iter().filter(|run| of(run)).cloned().collect();
    let never = AtomicBool::new(false);
    let next = AtomicUsize::new(0);
    let work = || {
        let mut done = Vec::new();
        while let Some(run) = runs.get(next.fetch_add(1, Ordering::Relaxed)) {
            done.push(omni_study::row(run, &never).expect("nothing stops it"));
        }
        done
    };
    let done: Vec<_> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..2).map(|_| scope.spawn(work)).collect();
        let rows = threads
            .into_iter()
            .flat_map(|thread| thread.join().expect("no panic"));
        rows.collect()
    });
    let cells = omni_study::cells(&plan, &done);
    let counted = cells.iter().filter(|cell| cell.runs > 0).map(|cell| {
        assert_eq!(cell.errors, 0);
        let axis = |k: usize| cell.axes[k].number().expect("a number");
        ([axis(0), axis(1)], cell.mean(0).expect("counted"))
    });
    let counted: Vec<_> = counted.collect();
    // The last axis is the model: balls, then rollers.
    let pairs = counted.chunks(2).map(|pair| (pair[0].0, [pair[0].1, pair[1].1]));
    pairs.collect()
}

#[test]
fn both_models_climb_where_there_is_plenty_and_neither_where_there_is_too_little() {
    let corners = climbed(|run| {
        let axis = |k: usize| run.axes[k].number().expect("a number");
        run.seed == 0 && [[1.0, 0.5], [3.0, 0.9]].contains(&[axis(0), axis(1)])
    });
    assert_eq!(corners, [([1.0, 0.5], [0.0, 0.0]), ([3.0, 0.9], [1.0, 1.0])]);
}

#[test]
#[ignore = "64 climbs on rollers take ten minutes: make test-full"]
fn both_models_agree_on_the_map_of_torque_and_friction_away_from_the_threshold() {
    let map = climbed(|_| true);
    assert_eq!(map.len(), 16);
    // The threshold is where the seeds of one model are not of one mind.
    let clear = map
        .into_iter()
        .filter(|(_, shares)| shares.iter().all(|share| *share == 0.0 || *share == 1.0));
    let (agreeing, differing): (Vec<_>, Vec<_>) = clear.partition(|(_, shares)| shares[0] == shares[1]);
    assert!(
        agreeing.len() >= 8,
        "half the map is away from the threshold: {agreeing:?}"
    );
    assert!(
        agreeing.len() >= 9 * differing.len(),
        "nine in ten: {differing:?} differ, {agreeing:?} agree"
    );
}

#[test]
#[ignore = "eleven scenarios on rollers take two minutes: make test-full"]
fn every_built_in_scenario_passes_on_rollers_with_energy_within_a_ten_thousandth() {
    for name in builtin_scenarios() {
        let scenario = scenario(name, &[]);
        let trace = run(&scenario).expect("finite");
        let outcome = trace.outcome();
        assert_eq!(outcome.verdict, passed(&scenario), "{name}");
        assert!(outcome.energy_residual.abs() < 1e-4, "{name}: {outcome:?}");
        let newton = trace.column("newton_residual_n").expect("a column");
        assert!(newton.iter().all(|n| *n < 2e-7), "{name}: rounding of the weight");
    }
}

on_both_engines! {
    forward_command_is_followed_by_seven_roller_wheels,
    every_direction_is_followed_by_three_double_wheels,
    mecanum_rollers_lose_sideways_what_their_tilt_takes,
    static_row_loads_follow_from_the_moment_balance_with_rollers,
    free_acceleration_is_that_of_five_turning_wheels,
    axle_rises_and_sinks_over_the_rollers_as_their_geometry_says,
    a_wheel_of_rollers_among_balls_carries_its_share_and_drives,
    rollers_saved_and_resumed_go_on_bit_for_bit,
    same_rollers_leave_the_same_bits,
    rollers_take_as_long_over_the_step_as_balls,
}
