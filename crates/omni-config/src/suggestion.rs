//! The name that was meant.

/// Likeness (Jaro and Winkler's, 0 to 1) from which on a name is taken for a slip of another.
const ALIKE: f64 = 0.8;

/// ` (did you mean "step"?)` where one of the names is much like this one, else nothing: to be put behind the name in a message.
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

/// The most like of the names, if any is much like this one.
pub(crate) fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    // Names end at 40 letters, keys somewhat later; what is longer is no slip of one.
    if name.len() > 80 {
        return None;
    }
    let alike = |known: &'a str| {
        (
            strsim::jaro_winkler(&name.to_lowercase(), &known.to_lowercase()),
            known,
        )
    };
    let best = known.into_iter().map(alike).max_by(|a, b| a.0.total_cmp(&b.0));
    best.filter(|(likeness, _)| *likeness > ALIKE)
        .map(|(_, known)| known)
}

/// serde's message about a key or a kind that there is not, with the one that was meant.
pub(crate) fn with_nearest(message: String) -> String {
    let unknown = ["unknown field `", "unknown variant `"];
    let Some(rest) = unknown.iter().find_map(|start| message.strip_prefix(start)) else {
        return message;
    };
    let Some((name, rest)) = rest.split_once("`, expected ") else {
        return message;
    };
    // Every second piece between backticks is a name.
    let Some(near) = nearest(name, rest.split('`').skip(1).step_by(2)) else {
        return message;
    };
    let (start, end) = message.split_at(message.len() - rest.len() - ", expected ".len());
    format!("{start} (did you mean `{near}`?){end}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_of_a_key_is_answered_with_the_key_and_anything_else_with_what_there_is() {
        let said = |name: &str| {
            with_nearest(format!(
                "unknown field `{name}`, expected one of `friction`, `height_m`, `at_m`"
            ))
        };
        assert_eq!(
            said("hight_m"),
            "unknown field `hight_m` (did you mean `height_m`?), expected one of `friction`, `height_m`, `at_m`"
        );
        assert_eq!(
            said("colour"),
            "unknown field `colour`, expected one of `friction`, `height_m`, `at_m`"
        );
        let alone = "unknown field `radios`, expected `radius`".to_owned();
        assert_eq!(
            with_nearest(alone),
            "unknown field `radios` (did you mean `radius`?), expected `radius`"
        );
        let other = "missing field `name`".to_owned();
        assert_eq!(with_nearest(other.clone()), other);
    }
}
