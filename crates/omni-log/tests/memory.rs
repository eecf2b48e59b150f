//! A run into a file needs no more memory the longer it takes. Alone in its process: it reads the process's own size.

use omni_config::{Override, Scenario};
use omni_log::{Error, LogRun, RunLog};
use omni_sim::Run;
use omni_sim::controller::AnyController;

/// Resident memory of this process [bytes].
#[cfg(target_os = "linux")]
fn resident() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").expect("Linux");
    let line = status
        .lines()
        .find(|line| line.starts_with("VmRSS:"))
        .expect("a size");
    let kib: f64 = line
        .split_whitespace()
        .nth(1)
        .and_then(|n| n.parse().ok())
        .expect("a number");
    kib * 1024.0
}

#[test]
#[cfg(target_os = "linux")]
fn five_minutes_more_of_a_logged_run_add_less_than_a_mebibyte() {
    // As many messages as at the default rates: VehicleState at 1 kHz, the rest at 50 Hz. Coarse physics, to be quick.
    let keys = [
        "duration_s=360",
        "physics.timestep_s=0.001",
        "physics.engine=rapier",
        "physics.solver_iterations=1",
        "command.vx_m_s=0.01",
        "control.policy=independent",
    ];
    let keys: Vec<_> = keys
        .iter()
        .map(|k| Override::parse(k).expect("KEY=VALUE"))
        .collect();
    let scenario = Scenario::load("flat", &keys).expect("valid");
    let folder = tempfile::tempdir().expect("a folder");
    let mut warm = None;
    let mut last = 0.0;
    let controller = AnyController::new(&scenario).expect("a controller");
    let mut log = RunLog::create(folder.path().join("long.mcap"), &scenario, &controller).expect("writable");
    let run = Run::new(&scenario)
        .controller(controller)
        .watch(|simulation, part| {
            if simulation.time_ns() == 60_000_000_000 {
                warm = Some(resident());
            } else if part == 1.0 {
                last = resident();
            }
            Ok::<(), Error>(())
        });
    let run = run.log_to::<Error>(&mut log);
    log.finish(&run.expect("runs").outcome).expect("writable");
    let grown = last - warm.expect("passed the first minute");
    assert!(grown < 1024.0 * 1024.0, "five minutes added {grown} bytes");
}
