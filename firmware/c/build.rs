//! `include/omnistep.h` from the sources. The header is part of the repository, so that who reads it needs no Rust: here it
//! is only compared, and written where OMNISTEP_WRITE_HEADER is set.

use std::env;
use std::error::Error;
use std::fs;
use std::path::PathBuf;

const HEADER: &str = "include/omnistep.h";

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-env-changed=OMNISTEP_WRITE_HEADER");
    for source in [
        "src/lib.rs",
        "cbindgen.toml",
        HEADER,
        "../../crates/omni-core/src",
    ] {
        println!("cargo::rerun-if-changed={source}");
    }
    let folder = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").ok_or("no CARGO_MANIFEST_DIR")?);
    let bindings = cbindgen::generate(&folder)?;
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
