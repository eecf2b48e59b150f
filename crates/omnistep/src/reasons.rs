//! The reasons why a run did not end as commanded, in words.

use omni_sim::{LimitedBy, Outcome, Verdict};

/// The limiting factor of a stalled run and the first contact of a body with the ground, one line each. `wheels` is the
/// vehicle's number of wheels.
pub(crate) fn reasons(outcome: &Outcome, wheels: usize) -> Vec<String> {
    let mut lines = Vec::new();
    if let (Verdict::Stalled, Some(by)) = (outcome.verdict, outcome.limited_by) {
        let some = outcome.limited_wheels.unwrap_or_default();
        let why = match by {
            LimitedBy::Friction => format!("{some} of {wheels} wheels slipped"),
            LimitedBy::Torque => format!("{some} of {wheels} wheels stood with their motors at the limit"),
            _ => "no wheel slipped and no motor was at its limit; use a longer duration_s or higher gains"
                .into(),
        };
        lines.push(format!("stalled: limited by {}: {why}", by.name()));
    }
    if let Some(body) = outcome.touched_body {
        let number = |metric: Option<f64>| metric.unwrap_or(f64::NAN);
        lines.push(format!(
            "touched: body {body} met the ground at {:.2} s, x = {:.3} m, y = {:.3} m, {:.1} mm deep; a real vehicle would be stopped or \
             scrape there, so what follows is not valid",
            number(outcome.touched_s),
            number(outcome.touched_x_m),
            number(outcome.touched_y_m),
            1e3 * number(outcome.touched_depth_m)
        ));
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_without_either_has_no_line_and_a_stalled_one_says_how_many_wheels() {
        let scenario = omni_config::Scenario::load("flat", &[]).expect("built in");
        let mut outcome = Outcome::unfinished(&scenario);
        assert!(reasons(&outcome, 7).is_empty());
        outcome.verdict = Verdict::Stalled;
        (outcome.limited_by, outcome.limited_wheels) = (Some(LimitedBy::Friction), Some(3));
        assert_eq!(
            reasons(&outcome, 4),
            ["stalled: limited by friction: 3 of 4 wheels slipped"]
        );
    }
}
