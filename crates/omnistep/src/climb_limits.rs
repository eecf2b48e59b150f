//! `omnistep climb-limits`.

use std::io::Write;

use comfy_table::Table;
use omni_bound::{ClimbLimits, RowLimits};
use omni_config::{Override, Scenario};
use serde::Serialize;

use crate::Error;
use crate::output::{aligned, print};
use crate::scenario_or_vehicle::scenario_or_vehicle;

/// One line of `--json`.
#[derive(Serialize)]
struct Line<'a> {
    vehicle: &'a str,
    height_m: f64,
    friction: f64,
    torque_n_m: f64,
    speed_m_s: f64,
    #[serde(flatten)]
    row: &'a RowLimits,
}

/// Prints the requirements of a scenario's step for its vehicle, one line per row of wheels.
pub(super) fn climb_limits(
    name: &str,
    overrides: Vec<Override>,
    json: bool,
    out: &mut dyn Write,
) -> Result<(), Error> {
    let scenario = scenario(name, overrides)?;
    let limits = ClimbLimits::of(&scenario)?;
    if json {
        for row in &limits.rows {
            let line = Line {
                vehicle: &limits.vehicle,
                height_m: limits.step.height_m,
                friction: limits.step.friction,
                torque_n_m: limits.torque_n_m,
                speed_m_s: limits.speed_m_s,
                row,
            };
            // Serialising plain numbers and strings cannot fail.
            let line = serde_json::to_string(&line).unwrap_or_default();
            print(out, &format!("{line}\n"))?;
        }
        return Ok(());
    }
    let possible = if limits.possible() {
        "not excluded"
    } else {
        "impossible"
    };
    let decisive = &limits.rows[limits.decisive()];
    print(
        out,
        &format!(
            "{}: step of {} m, friction {}, torque {} N.m, speed {} m/s: {possible}; the {} row is decisive\n{}\n",
            limits.vehicle,
            limits.step.height_m,
            limits.step.friction,
            limits.torque_n_m,
            limits.speed_m_s,
            decisive.row,
            table(&limits.rows)
        ),
    )?;
    if !limits.possible() {
        print(
            out,
            "This holds for this speed only: a policy that backs off and runs up faster (traction, traction_runup) may climb.\n",
        )?;
    }
    Ok(())
}

/// A scenario by its name, or the step with a vehicle by its name.
fn scenario(name: &str, overrides: Vec<Override>) -> Result<Scenario, Error> {
    scenario_or_vehicle(name, overrides, || Ok(("step", Vec::new())))
        .map_err(|error| error.to_command("climb-limits").into())
}

fn table(rows: &[RowLimits]) -> Table {
    let headings = [
        "row",
        "wheels",
        "verdict",
        "least torque [N.m]",
        "missing energy [J]",
        "run-up, necessary [m/s]",
        "run-up, sufficient [m/s]",
    ];
    let number = |number: f64, digits: usize| {
        if number.is_finite() {
            format!("{number:.digits$}")
        } else {
            "none".into() // no torque suffices
        }
    };
    let rows = rows.iter().map(|row| {
        [
            row.row.to_owned(),
            row.wheels.join(" "),
            row.verdict.name().to_owned(),
            number(row.least_torque_n_m, 2),
            number(row.deficit_j, 3),
            number(row.run_up_m_s, 2),
            number(row.path_run_up_m_s, 2),
        ]
    });
    aligned(headings, rows, 3)
}
