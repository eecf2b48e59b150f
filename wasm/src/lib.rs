//! The simulation for a page in a browser, and what of it is compared with the native program.
//!
//! The module for WebAssembly has no bindings, only the functions of `face` and its memory.

mod face;
mod offer;
mod session;

use std::collections::BTreeMap;
use std::fmt::Write;

use omni_sim::config::builtin_scenarios;
use omni_sim::{Trace, TraceBuilder};
use session::{Request, Session};

const POSE: [&str; 7] = [
    "pose_x_m", "pose_y_m", "pose_z_m", "pose_qx", "pose_qy", "pose_qz", "pose_qw",
];

/// Engines and wheel models, and what a line adds to the name of its scenario.
const PHYSICS: [(&str, &str, &str); 3] = [
    ("rapier", "ball", ""),
    ("articulated", "ball", "-articulated"),
    ("articulated", "rollers", "-articulated-rollers"),
];

/// The first `duration_s` \[s\] of every built-in scenario with every engine, a line each: name,
/// control periods, the last pose (x, y, z and the quaternion's x, y, z, w) as hexadecimal bits of
/// `f64`, and a digest of all bits of the whole trace. They are stepped as a page steps them.
///
/// # Errors
/// Those of the simulation.
pub fn report(duration_s: f64) -> Result<String, String> {
    let mut lines = String::new();
    let runs = builtin_scenarios()
        .into_iter()
        .flat_map(|name| PHYSICS.map(|physics| (name, physics)));
    for (name, (engine, wheels, suffix)) in runs {
        let set = BTreeMap::from([
            ("duration_s".to_owned(), duration_s.into()),
            ("physics.engine".to_owned(), engine.into()),
            ("physics.wheel_model".to_owned(), wheels.into()),
        ]);
        let trace = trace(&Request {
            scenario: name.to_owned(),
            policy: None,
            set,
            log: false,
        })?;
        let _ = write!(lines, "{name}{suffix} {}", trace.rows());
        for column in POSE {
            let last = trace.column(column).and_then(<[f64]>::last);
            let _ = write!(lines, " {:016x}", last.map_or(0, |number| number.to_bits()));
        }
        let _ = writeln!(lines, " {:016x}", digest(&trace));
    }
    Ok(lines)
}

/// Every signal of a session's run to its end.
fn trace(request: &Request) -> Result<Trace, String> {
    let mut session = Session::new(request)?;
    let report = session.simulation().controller().columns().clone();
    let mut trace = TraceBuilder::with_report(session.scenario().vehicle(), &report);
    while session.advance(1, None)? == 1 {
        let simulation = session.simulation();
        trace.push(simulation.period());
    }
    Ok(trace.finish(session.metrics()))
}

/// FNV-1a over words. WebAssembly leaves open which bits a NaN has: each counts as the same.
fn digest(trace: &Trace) -> u64 {
    let bits = |number: &f64| {
        if number.is_nan() {
            u64::MAX
        } else {
            number.to_bits()
        }
    };
    let fold = |hash: u64, word: u64| (hash ^ word).wrapping_mul(0x0100_0000_01b3);
    trace.data().iter().map(bits).fold(0xcbf2_9ce4_8422_2325, fold)
}
