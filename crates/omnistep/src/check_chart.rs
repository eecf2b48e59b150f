//! A chart's limits for a step, for `omnistep check --chart`.

use std::path::Path;

use omni_config::Vehicle;
use omni_study::{Chart, ChartCell, Edge};

use crate::Error;
use crate::chart::read;

/// Where a step of a height may be climbed, and what is doubtful of it.
pub(crate) struct OnChart {
    /// A line.
    pub(crate) text: String,
    /// A warning if it is not climbed from any side, or not head-on.
    pub(crate) doubt: Option<String>,
}

/// What the chart of a file says of a step that its vehicle meets squarely.
pub(crate) fn on_chart(file: &Path, vehicle: &Vehicle, height_m: f64) -> Result<OnChart, Error> {
    let chart = read(file)?;
    chart.check_vehicle(&file.display().to_string(), vehicle)?;
    let steps: Vec<&ChartCell> = chart
        .cell
        .iter()
        .filter(|cell| cell.edge == Edge::Step && cell.skew_deg == 0.0)
        .collect();
    let Some(most) = steps.iter().max_by(|a, b| a.climbs_m.total_cmp(&b.climbs_m)) else {
        return Err(Error::Argument {
            name: "--chart",
            value: file.display().to_string(),
            allowed: "a chart with steps that are met squarely: omnistep chart --edge step --skew 0",
        });
    };
    let at_most = format!(
        "at most {} mm, at {} deg",
        mm(most.climbs_m),
        side(&chart, most.side_deg)
    );
    let climbed: Vec<_> = steps.iter().filter(|cell| cell.climbs_m >= height_m).collect();
    let ahead = steps.iter().find(|cell| cell.side_deg == 0.0);
    let found = if climbed.is_empty() {
        format!("from none of {} sides; {at_most}", steps.len())
    } else {
        let sides: Vec<_> = climbed.iter().map(|cell| side(&chart, cell.side_deg)).collect();
        format!("from {} deg; {at_most}", sides.join(", "))
    };
    let doubt = match ahead {
        _ if climbed.is_empty() => Some(format!(
            "its chart plans with no step of {height_m} m from any side: {at_most}"
        )),
        Some(cell) if cell.climbs_m < height_m => Some(format!(
            "its chart plans with {} mm straight ahead, less than the step of {height_m} m: {}",
            mm(cell.climbs_m),
            cell.because
        )),
        _ => None,
    };
    let text = format!(
        "step of {height_m} m {found} ({}, friction {}, {} m/s)",
        chart.policy, chart.friction, chart.speed_m_s
    );
    Ok(OnChart { text, doubt })
}

fn mm(size_m: f64) -> String {
    format!("{:.1}", 1e3 * size_m)
}

/// A side; with both signs where a chart's cell holds for both.
fn side(chart: &Chart, side_deg: f64) -> String {
    let both = chart.mirrored && side_deg != 0.0 && side_deg != 180.0;
    format!("{}{side_deg}", if both { "±" } else { "" })
}
