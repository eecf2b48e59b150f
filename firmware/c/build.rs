//! `include/omnistep.h` from the sources. The header is part of the repository, so that who reads it needs no Rust: here it
//! is only compared, and written where OMNISTEP_WRITE_HEADER is set.

use std::env;
use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

use omni_core::DriveState;

const HEADER: &str = "include/omnistep.h";
const TEMPLATE: &str = "src/wheels.rs.in";

/// Wheel counts: the number, its name, and the words of 32 bits of a drive's state.
const COUNTS: [(usize, &str, usize); 4] = [
    (3, "three", words::<3>()),
    (4, "four", words::<4>()),
    (6, "six", words::<6>()),
    (7, "seven", words::<7>()),
];

/// Names of the types of N wheels: in Rust, and behind `omniN_` in C.
const TYPES: [(&str, &str); 13] = [
    ("Controller_f32__", "controller"),
    ("ControlState_f32__", "state"),
    ("ControlSample_f32__", "sample"),
    ("WheelVelocities_f32__", "velocities"),
    ("WheelTorques_f32__", "torques"),
    ("WheelSample_f32__", "wheel_sample"),
    ("WheelController_f32__", "loops"),
    ("Kinematics_f32__", "kinematics"),
    ("TorqueLimits_f32__", "torque_limits"),
    ("TorqueRanges_f32__", "torque_ranges"),
    ("Drive_f32__", "drive"),
    ("SpeedLimits_f32__", "speed_limits"),
    ("Odometry_f32__", "odometry"),
];

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-env-changed=OMNISTEP_WRITE_HEADER");
    for source in ["src", "cbindgen.toml", HEADER, "../../crates/omni-core/src"] {
        println!("cargo::rerun-if-changed={source}");
    }
    let folder = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").ok_or("no CARGO_MANIFEST_DIR")?);
    let wheels = PathBuf::from(env::var_os("OUT_DIR").ok_or("no OUT_DIR")?).join("wheels.rs");
    fs::write(
        &wheels,
        of_each_count(&fs::read_to_string(folder.join(TEMPLATE))?),
    )?;
    let bindings = cbindgen::Builder::new()
        .with_config(config(&folder)?)
        .with_src(&wheels)
        .with_crate(&folder)
        .generate()?;
    let mut raw = Vec::new();
    bindings.write(&mut raw);
    let header = for_c(&String::from_utf8(raw)?);
    let path = folder.join(HEADER);
    if env::var_os("OMNISTEP_WRITE_HEADER").is_some() {
        fs::write(path, header)?;
    } else if fs::read_to_string(&path).ok().as_deref() != Some(&header) {
        return Err(
            format!("{HEADER} is not what the sources say: build once with OMNISTEP_WRITE_HEADER=1").into(),
        );
    }
    Ok(())
}

/// Words of 32 bits that a drive of N wheels remembers: on a 32-bit processor they are as many as here, which
/// `State::FITS` checks.
const fn words<const N: usize>() -> usize {
    size_of::<DriveState<f32, N>>().div_ceil(size_of::<u32>())
}

/// The functions of N wheels, written out for each wheel count.
fn of_each_count(template: &str) -> String {
    let of = |(n, count, words): (usize, &str, usize)| {
        template
            .replace("omniN", &format!("omni{n}"))
            .replace("COUNT", count)
            .replace("<N", &format!("<{n}"))
            .replace(", N>", &format!(", {n}>"))
            .replace("WORDS", &words.to_string())
    };
    COUNTS.map(of).concat()
}

/// The configuration, with the names of the types of each wheel count.
fn config(folder: &Path) -> Result<cbindgen::Config, String> {
    let mut config = cbindgen::Config::from_file(folder.join("cbindgen.toml"))?;
    for (n, _, words) in COUNTS {
        let own = [
            (format!("Input_{n}"), "drive_input"),
            (format!("Output_{n}"), "drive_output"),
            (format!("State_{n}__{words}"), "drive_state"),
        ];
        let types = TYPES.map(|(rust, c)| (format!("{rust}{n}"), c));
        for (rust, c) in types.into_iter().chain(own) {
            config.export.rename.insert(rust, format!("omni{n}_{c}"));
        }
    }
    Ok(config)
}

/// Leaves out the examples, which are in Rust, and the traces of Rust's generics and links.
fn for_c(text: &str) -> String {
    let mut lines = Vec::<String>::new();
    let mut in_example = false;
    for line in text.lines() {
        let comment = line.trim_start().strip_prefix("//").map(str::trim);
        if let Some(comment) = comment {
            if comment.starts_with("```") {
                in_example = !in_example;
                continue;
            }
            if in_example
                || comment == "A torque is not a velocity:"
                || comment.ends_with("does not compile:")
            {
                continue;
            }
        } else {
            // A comment's empty last lines say nothing.
            while lines.last().is_some_and(|last| last.trim() == "//") {
                lines.pop();
            }
        }
        let plain = line
            .replace("\\[", "[")
            .replace("\\]", "]")
            .replace("[`", "`")
            .replace("`]", "`");
        let plain = without_links(&plain);
        let plain = plain
            .replace("_F32,", ",")
            .replace("_Body_f32", "_body")
            .replace("_Tag", "_tag");
        let repeats = plain.trim() == "//" && lines.last().is_some_and(|last| last.trim() == "//");
        if !repeats {
            lines.push(plain);
        }
    }
    lines.join("\n") + "\n"
}

/// `Name(crate::path::Name)`, a link of Rust's documentation, as `Name`.
fn without_links(line: &str) -> String {
    let mut parts = line.split("(crate::");
    let mut plain = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        plain.push_str(part.split_once(')').map_or(part, |(_, rest)| rest));
    }
    plain
}
