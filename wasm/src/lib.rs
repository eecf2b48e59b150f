//! Runs built-in scenarios and says in which bits they ended.
//!
//! The module for WebAssembly has no bindings, only [`run`], [`text`] and its memory.

use std::cell::RefCell;
use std::fmt::Write;

use omni_sim::config::{Override, Scenario, builtin_scenarios};
use omni_sim::{Error, Trace};

const POSE: [&str; 7] = [
    "pose_x_m", "pose_y_m", "pose_z_m", "pose_qx", "pose_qy", "pose_qz", "pose_qw",
];

/// Engines and wheel models, and what a line adds to the name of its scenario.
const PHYSICS: [(&str, &str, &str); 3] = [
    ("rapier", "ball", ""),
    ("articulated", "ball", "-articulated"),
    ("articulated", "rollers", "-articulated-rollers"),
];

/// The first `duration_s` \[s\] of every built-in scenario with every engine, a line each: name, control periods, the last pose (x, y, z and the
/// quaternion's x, y, z, w) as hexadecimal bits of `f64`, and a digest of all bits of the whole trace.
///
/// # Errors
/// Those of the simulation.
pub fn report(duration_s: f64) -> Result<String, Error> {
    let mut lines = String::new();
    let runs = builtin_scenarios()
        .into_iter()
        .flat_map(|name| PHYSICS.map(|physics| (name, physics)));
    for (name, (engine, wheels, suffix)) in runs {
        let overrides = [
            Override::new("duration_s", duration_s),
            Override::new("physics.engine", engine),
            Override::new("physics.wheel_model", wheels),
        ];
        let trace = omni_sim::run(&Scenario::load(name, &overrides)?)?;
        let _ = write!(lines, "{name}{suffix} {}", trace.rows());
        for column in POSE {
            let last = trace.column(column).and_then(<[f64]>::last);
            let _ = write!(lines, " {:016x}", last.map_or(0, |number| number.to_bits()));
        }
        let _ = writeln!(lines, " {:016x}", digest(&trace));
    }
    Ok(lines)
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

thread_local! { static SAID: RefCell<String> = const { RefCell::new(String::new()) }; }

/// Keeps the [`report`], or what went wrong; returns its length \[bytes\], negative where something went wrong.
#[unsafe(no_mangle)]
pub extern "C" fn run(duration_s: f64) -> i32 {
    let (said, sign) = match report(duration_s) {
        Ok(lines) => (lines, 1),
        Err(error) => (error.to_string(), -1),
    };
    SAID.with(|kept| {
        *kept.borrow_mut() = said;
        sign * kept.borrow().len() as i32
    })
}

/// Where what [`run`] kept begins in the memory; until the next [`run`].
#[unsafe(no_mangle)]
pub extern "C" fn text() -> *const u8 {
    SAID.with(|kept| kept.borrow().as_ptr())
}
