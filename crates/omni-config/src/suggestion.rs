//! Suggestions for a misspelt name.

use std::path::Path;

/// Names of a quantity here, and elsewhere.
const ALIASES: [(&str, &[&str]); 6] = [
    ("independent", &["pid"]),
    ("bumps", &["sill", "cable", "threshold", "hump", "rail"]),
    ("step", &["curb", "kerb", "ledge", "edge"]),
    ("ditch", &["gap", "gutter", "trench", "groove"]),
    ("ramp", &["slope", "incline"]),
    ("flat", &["plane", "floor", "level"]),
];

/// Likeness (Jaro and Winkler's, 0 to 1) from which on a name is taken for a slip of another.
const ALIKE: f64 = 0.8;

/// ` (did you mean "step"?)` where one of the names is much like this one, else nothing: to be put
/// behind the name in a message.
///
/// ```
/// use omni_config::did_you_mean;
/// assert_eq!(did_you_mean("setp", ["step", "flat"]), " (did you mean \"step\"?)");
/// assert_eq!(did_you_mean("moon", ["step", "flat"]), "");
/// ```
#[must_use]
pub fn did_you_mean<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    nearest(name, known).map_or_else(String::new, |near| format!(" (did you mean {near:?}?)"))
}

/// Likewise of a file that is missing: the one beside it, or of these names, that is much like it.
#[must_use]
pub fn did_you_mean_file(missing: &Path, others: &[&str]) -> String {
    let name = |path: &Path| Some(path.file_name()?.to_str()?.to_owned());
    let beside = match missing.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    let there = std::fs::read_dir(beside).into_iter().flatten().flatten();
    let files: Vec<_> = there.filter_map(|entry| name(&entry.path())).collect();
    let missing = name(missing).unwrap_or_default();
    // Without the ending, in which all files of a kind are alike.
    let ending = missing.rfind('.').map_or("", |dot| &missing[dot..]);
    let stem = |name| str::strip_suffix(name, ending).unwrap_or(name);
    let of_kind = files
        .iter()
        .map(String::as_str)
        .filter(|file| file.ends_with(ending));
    let known: Vec<_> = of_kind.chain(others.iter().copied()).collect();
    let near = nearest(stem(&missing), known.iter().map(|name| stem(name)));
    let meant = near.and_then(|near| known.into_iter().find(|name| stem(name) == near));
    // Or the same with another ending.
    let stem_of = |file: &&String| {
        file.rsplit_once('.')
            .is_some_and(|(own, _)| own == stem(&missing))
    };
    let meant = meant.or_else(|| files.iter().find(stem_of).map(String::as_str));
    meant.map_or_else(String::new, |meant| format!(" (did you mean {meant:?}?)"))
}

/// The most like of the names, if any is much like this one.
pub(crate) fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    // Names end at 40 letters, keys somewhat later; what is longer is no slip of one.
    if name.len() > 80 {
        return None;
    }
    let name = name.to_lowercase();
    let known: Vec<_> = known.into_iter().collect();
    // What is called otherwise here.
    if let Some((ours, _)) = ALIASES.iter().find(|(_, theirs)| theirs.contains(&name.as_str()))
        && let Some(found) = known.iter().find(|known| *known == ours)
    {
        return Some(found);
    }
    let alike = |known: &'a str| (likeness(&name, &known.to_lowercase()), known);
    let best = known.into_iter().map(alike).max_by(|a, b| a.0.total_cmp(&b.0));
    best.filter(|(likeness, _)| *likeness > ALIKE)
        .map(|(_, known)| known)
}

/// How alike a name is to another, or to words in it, as `noise` to `gyro_noise_rad_s`, 0 to 1.
fn likeness(name: &str, known: &str) -> f64 {
    let words: Vec<_> = known.split('_').collect();
    let runs = (0..words.len()).flat_map(|from| (from + 1..=words.len()).map(move |to| (from, to)));
    let of_run = |(from, to)| {
        let run = words.get(from..to).unwrap_or_default().join("_");
        match run == name {
            true => PART,
            // Words of a few letters are like too many others.
            false if run.len() < 4 => 0.0,
            false => PART * strsim::jaro_winkler(name, &run),
        }
    };
    runs.map(of_run).fold(strsim::jaro_winkler(name, known), f64::max)
}

/// What likeness to a part of a name counts for, against likeness to the whole of it.
const PART: f64 = 0.9;

/// Keys that are written out before serde reads a table, which lists only what it reads, by keys of that table.
const WRITTEN_OUT: [(&str, &str); 3] = [
    ("`coupling`, `wheel`", ", `mecanum4`, `omni3`, `total_mass_kg`"),
    (
        "`stall_torque_n_m`",
        ", `stall_torque_kg_cm`, `stall_torque_oz_in`, `rotor_inertia_kg_m2`, `gear_ratio`",
    ),
    ("`roller_angle_rad`", ", `roller_angle_deg`"),
];

/// serde's message about a key or a kind that there is not, with the one that was meant.
pub(crate) fn with_nearest(message: String) -> String {
    let unknown = ["unknown field `", "unknown variant `"];
    let Some(rest) = unknown.iter().find_map(|start| message.strip_prefix(start)) else {
        return message;
    };
    let Some((name, read)) = rest.split_once("`, expected ") else {
        return message;
    };
    let written_out = WRITTEN_OUT.iter().find(|(keys, _)| read.contains(keys));
    let rest = &format!("{read}{}", written_out.map_or("", |(_, more)| more));
    // Every second piece between backticks is a name.
    let near = nearest(name, rest.split('`').skip(1).step_by(2));
    let meant = near.map_or_else(String::new, |near| format!(" (did you mean `{near}`?)"));
    let start = message
        .split_at(message.len() - read.len() - ", expected ".len())
        .0;
    format!("{start}{meant}, expected {rest}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_of_a_key_is_answered_with_the_key_and_anything_else_with_what_there_is() {
        let said = |name: &str| {
            with_nearest(format!(
                "unknown field `{name}`, expected one of `friction`, `height_m`, `start_x_m`"
            ))
        };
        assert_eq!(
            said("hight_m"),
            "unknown field `hight_m` (did you mean `height_m`?), expected one of `friction`, `height_m`, `start_x_m`"
        );
        assert_eq!(
            said("colour"),
            "unknown field `colour`, expected one of `friction`, `height_m`, `start_x_m`"
        );
        let alone = "unknown field `radios`, expected `radius`".to_owned();
        assert_eq!(
            with_nearest(alone),
            "unknown field `radios` (did you mean `radius`?), expected `radius`"
        );
        assert!(said("friktion_coefficient").contains("did you mean `friction`"));
        assert!(said("start_m").contains("did you mean `start_x_m`"));
        let kind = with_nearest("unknown variant `Sill`, expected one of `step`, `bumps`".to_owned());
        assert!(kind.contains("did you mean `bumps`"), "{kind}");
        let other = "missing field `name`".to_owned();
        assert_eq!(with_nearest(other.clone()), other);
    }
}
