//! Charts for the tests of this crate.

use crate::Chart;

/// A chart of a vehicle that climbs so much with each of its four sides \[m\], at friction 0.7 and a margin of 0.8.
pub(crate) fn square_chart(limit_m: f64) -> Chart {
    let mut text =
        "schema_version = 1\nvehicle = \"square\"\nfriction = 0.7\nspeed_m_s = 0.3\nmargin = 0.8\n"
            .to_owned();
    for edge in ["step", "drop"] {
        for side in [-90, 0, 90, 180] {
            text += &format!(
                "[[cell]]\nedge = \"{edge}\"\nside_deg = {side}.0\nskew_deg = 0.0\nclimbs_m = {}\nlimit_m = {limit_m}\n",
                0.8 * limit_m
            );
        }
    }
    Chart::from_toml("square", &text).expect("a chart")
}
