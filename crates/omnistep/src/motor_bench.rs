//! `omnistep motor-bench`.

use std::io::Write;

use comfy_table::Table;

use omni_config::MotorBench;
use omni_sim::{MOTOR_BENCH_POLICIES, MotorBenchTrace, run_motor_bench};

use crate::Error;
use crate::args::parse_overrides;
use crate::output::{aligned, print};

/// Times of the table \[s\]: before, between and after the loads of the paper.
const TIMES_S: [f64; 9] = [4.0, 6.5, 13.0, 20.0, 30.0, 45.0, 54.0, 59.9, 64.0];

pub(super) fn motor_bench(
    experiment: &str,
    overrides: &[String],
    json: bool,
    out: &mut dyn Write,
) -> Result<(), Error> {
    let experiment = MotorBench::load(experiment, &parse_overrides(overrides)?)?;
    let traces = MOTOR_BENCH_POLICIES.map(|policy| run_motor_bench(&experiment, policy));
    let traces = traces.into_iter().collect::<Result<Vec<_>, _>>()?;
    if json {
        for trace in &traces {
            let line = serde_json::to_string(trace).unwrap_or_default();
            print(out, &format!("{line}\n"))?;
        }
        return Ok(());
    }
    let friction = experiment.friction_n_m_s_rad;
    print(
        out,
        &format!(
            "speeds of wheels A / B / C [rpm], reference {} rpm, friction {friction} N.m.s/rad\n",
            experiment.speed_rpm
        ),
    )?;
    print(out, &format!("{}\n", table(&traces, experiment.duration_s)))
}

fn table(traces: &[MotorBenchTrace], duration_s: f64) -> Table {
    let headings = std::iter::once("t [s]".to_owned()).chain(traces.iter().map(|t| t.policy.clone()));
    let rows = TIMES_S.into_iter().filter(|t| *t <= duration_s).map(|time| {
        let cells = traces.iter().map(move |trace| {
            let [a, b, c] = trace.speeds_at(time);
            format!("{a:.1} / {b:.1} / {c:.1}")
        });
        std::iter::once(time.to_string()).chain(cells)
    });
    aligned(headings, rows, 0)
}
