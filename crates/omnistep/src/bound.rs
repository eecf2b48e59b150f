//! `omnistep bound`.

use std::io::Write;

use comfy_table::Table;
use omni_bound::{Bound, RowBound};
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
    row: &'a RowBound,
}

/// Prints what the step of a scenario takes of its vehicle, a row of wheels a line.
pub(super) fn bound(
    name: &str,
    overrides: Vec<Override>,
    json: bool,
    out: &mut dyn Write,
) -> Result<(), Error> {
    let scenario = scenario(name, overrides)?;
    let bound = Bound::of(&scenario)?;
    if json {
        for row in &bound.rows {
            let line = Line {
                vehicle: &bound.vehicle,
                height_m: bound.step.height_m,
                friction: bound.step.friction,
                torque_n_m: bound.torque_n_m,
                speed_m_s: bound.speed_m_s,
                row,
            };
            // Serialising plain numbers and strings cannot fail.
            let line = serde_json::to_string(&line).unwrap_or_default();
            print(out, &format!("{line}\n"))?;
        }
        return Ok(());
    }
    let possible = if bound.possible() {
        "not excluded"
    } else {
        "impossible"
    };
    let decisive = &bound.rows[bound.decisive()];
    print(
        out,
        &format!(
            "{}: step of {} m, friction {}, torque {} N.m, speed {} m/s: {possible}; the {} row is decisive\n{}\n",
            bound.vehicle,
            bound.step.height_m,
            bound.step.friction,
            bound.torque_n_m,
            bound.speed_m_s,
            decisive.row,
            table(&bound.rows)
        ),
    )?;
    if !bound.possible() {
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
        .map_err(|error| error.to_command("bound").into())
}

fn table(rows: &[RowBound]) -> Table {
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
