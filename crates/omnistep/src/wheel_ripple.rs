//! `omnistep wheel-ripple`.

use std::io::Write;

use comfy_table::Table;
use serde::Serialize;

use omni_config::{self as config, RollerWheel, Source, Vehicle, WheelModel};

use crate::Error;
use crate::args::parse_overrides;
use crate::output::{aligned, print};

/// One line of `--json`, one row of the table.
#[derive(Serialize)]
struct Row {
    wheel: String,
    rows: usize,
    count: usize,
    roller_radius_m: f64,
    roller_length_m: f64,
    row_gap_m: f64,
    min_m: f64,
    max_m: f64,
    ripple_m: f64,
    ripple_ratio: f64,
    rolling_radius_m: f64,
    rolling_radius_error: f64,
}

impl Row {
    fn of(wheel: &str, built: &RollerWheel) -> Self {
        let ripple = built.ripple();
        let height = ripple.max_m - ripple.min_m;
        Self {
            wheel: wheel.to_owned(),
            rows: built.rows,
            count: built.count,
            roller_radius_m: built.barrel.radius_m(),
            roller_length_m: 2.0 * built.barrel.half_length_m(),
            row_gap_m: built.row_gap_m,
            min_m: ripple.min_m,
            max_m: ripple.max_m,
            ripple_m: height,
            ripple_ratio: height / built.radius_m,
            rolling_radius_m: ripple.rolling_radius_m,
            rolling_radius_error: ripple.rolling_radius_m / built.radius_m - 1.0,
        }
    }
}

/// Prints the height of every wheel's axle over a turn, from the geometry of its rollers alone.
pub(super) fn wheel_ripple(
    vehicle: &str,
    overrides: &[String],
    json: bool,
    out: &mut dyn Write,
) -> Result<(), Error> {
    let source = Source::vehicle(vehicle, None)?;
    let vehicle = Vehicle::from_source(&source, &parse_overrides(overrides)?)?;
    let mut rows = Vec::new();
    for (i, wheel) in vehicle.wheel.iter().enumerate() {
        let built = vehicle.rollers(i, WheelModel::Rollers);
        rows.extend(built.map(|built| Row::of(&wheel.name, &built)));
    }
    if rows.is_empty() {
        return Err(Error::from(config::Error::Key {
            file: source.file.clone(),
            key: "rollers".into(),
            message: "missing, allowed: a table [rollers], or rollers as a wheel's contact".into(),
        }));
    }
    if json {
        for row in &rows {
            // Serialising plain numbers and strings cannot fail.
            let line = serde_json::to_string(row).unwrap_or_default();
            print(out, &format!("{line}\n"))?;
        }
        return Ok(());
    }
    let name = &vehicle.name;
    print(
        out,
        &format!(
            "{name}: height of each axle over a turn, lengths in mm\n{}\n",
            table(&rows)
        ),
    )
}

fn table(rows: &[Row]) -> Table {
    let headings = [
        "wheel",
        "rollers",
        "radius",
        "length",
        "min",
        "max",
        "ripple",
        "ripple [%]",
        "rolling radius",
        "error [%]",
    ];
    // Adding 0 takes the sign off a zero.
    let thousandths = |x: f64| format!("{:.3}", (1e3 * x).round() / 1e3 + 0.0);
    let mm = |metres: f64| thousandths(1e3 * metres);
    let rows = rows.iter().map(|row| {
        [
            row.wheel.clone(),
            format!("{} x {}", row.rows, row.count),
            mm(row.roller_radius_m),
            mm(row.roller_length_m),
            mm(row.min_m),
            mm(row.max_m),
            mm(row.ripple_m),
            thousandths(100.0 * row.ripple_ratio),
            mm(row.rolling_radius_m),
            thousandths(100.0 * row.rolling_radius_error),
        ]
    });
    aligned(headings, rows, 1)
}
