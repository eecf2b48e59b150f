//! The figures of runs, as tables show them.

use omni_sim::{Outcome, Verdict};

use crate::output::marked;

/// A column of a table of runs: its heading, and what it shows of a run.
type Column = (&'static str, fn(&Outcome) -> String);

/// Those behind the verdict.
const FIGURES: [Column; 10] = [
    (CROSSING, |o| number(o.crossing_s.unwrap_or(f64::NAN), 2)),
    (RETRIES, |o| {
        o.retries.map_or_else(|| "-".into(), |n| n.to_string())
    }),
    ("pitch [deg]", |o| number(o.pitch_peak_deg, 2)),
    ("yaw [deg]", |o| number(o.yaw_error_deg, 1)),
    ("slip rms", |o| number(o.slip_rms, 3)),
    ("disturbed rms", |o| number(o.disturbed_rms, 3)),
    ("spread rms", |o| number(o.spread_rms, 3)),
    ("linkage spread", |o| number(o.linkage_spread, 3)),
    ("heat [N2m2s]", |o| number(o.heat_n2m2s, 1)),
    ("work [J]", |o| number(o.work_j, 1)),
];
/// In a table only where there was something to cross.
const CROSSING: &str = "crossing [s]";
/// In a table only where some run tried again: of the others it says nothing.
const RETRIES: &str = "retries";

/// Where a vehicle came to, and how far its odometry is from there: in a table only where there was nothing to cross.
const WHEREABOUTS: [Column; 4] = [
    ("x [m]", |o| number(o.final_x_m, 3)),
    ("y [m]", |o| number(o.final_y_m, 3)),
    ("heading [deg]", |o| number(o.final_yaw_rad.to_degrees(), 1)),
    ("odometry error [m]", |o| number(o.odometry_error_m, 4)),
];

/// The figures that a table of some runs shows.
pub(super) fn figures<'a>(outcomes: impl IntoIterator<Item = &'a Outcome>) -> Vec<Column> {
    let (mut tried, mut driven, mut crossed) = (false, false, false);
    for outcome in outcomes {
        tried |= outcome.retries.is_some_and(|n| n > 0);
        let on_flat_ground = outcome.verdict == Verdict::Driven;
        driven |= on_flat_ground;
        crossed |= !on_flat_ground;
    }
    let shown = |column: &Column| match column.0 {
        RETRIES => tried,
        CROSSING => crossed,
        _ => true,
    };
    let whereabouts = WHEREABOUTS.into_iter().filter(|_| driven);
    whereabouts.chain(FIGURES.into_iter().filter(shown)).collect()
}

/// Headings of the verdict and of figures behind it.
pub(super) fn headings(figures: &[Column]) -> impl Iterator<Item = &'static str> {
    ["verdict"]
        .into_iter()
        .chain(figures.iter().map(|figure| figure.0))
}

/// The verdict and figures of a run.
pub(super) fn cells(outcome: &Outcome, figures: &[Column]) -> impl Iterator<Item = String> {
    std::iter::once(verdict(outcome)).chain(figures.iter().map(|figure| figure.1(outcome)))
}

/// How it ended, and where if it stalled.
fn verdict(outcome: &Outcome) -> String {
    let text = match (outcome.stalled_at_m, outcome.stalled_row) {
        (Some(x), Some(row)) => format!("stalled at {x:.2} m, row {row}"),
        _ => outcome.verdict.name().into(),
    };
    marked(text, outcome.wheel_model_valid)
}

/// A figure with so many decimals, `-` where nothing was measured.
fn number(figure: f64, decimals: usize) -> String {
    if figure.is_nan() {
        "-".into()
    } else {
        format!("{figure:.decimals$}")
    }
}
