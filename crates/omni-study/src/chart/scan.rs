//! One cell: sizes from below, from several starts each, until one is not climbed.

use std::sync::atomic::AtomicBool;

use omni_sim::Verdict;

use super::bounds::{clearance_m, climb_limits_mm};
use super::edge::{Edge, size_m};
use super::{Approach, ChartCell, ChartPlan, ChartStart};
use crate::Error;
use crate::row::ended;

/// Sizes are first tried in steps of so many of the grid's, then one by one.
const COARSE: u32 = 5;

/// A cell in the making.
struct Scan<'a> {
    plan: &'a ChartPlan,
    approach: Approach,
    starts: &'a [ChartStart],
    stop: &'a AtomicBool,
    /// Every size up to it was climbed that was tried \[mm\].
    limit_mm: u32,
    fails: Option<f64>,
    because: String,
}

/// The cell of an approach; none if `stop` was set before its end.
pub(super) fn cell(
    plan: &ChartPlan,
    approach: Approach,
    stop: &AtomicBool,
) -> Result<Option<ChartCell>, Error> {
    let (chart, vehicle) = (&plan.empty, plan.level().vehicle());
    let mut largest = (approach.edge.largest_mm(vehicle), "largest");
    let is_step = approach.edge == Edge::Step && approach.skew_deg == 0.0;
    let clearance_m = clearance_m(vehicle, approach.side_deg).filter(|_| is_step);
    let clears_mm = clearance_m.map(|clearance_m| (1e3 * clearance_m) as u32);
    let square = ChartStart {
        x_m: 0.0,
        heading_deg: 0.0,
    };
    let climb_limits_mm = climb_limits_mm(
        |height_mm| plan.scenario(&approach, size_m(height_mm), &square),
        &approach,
        largest.0,
    )?;
    for (bound_mm, because) in [(clears_mm, "clearance"), (climb_limits_mm, "climb_limits")] {
        if let Some(bound_mm) = bound_mm.filter(|bound_mm| *bound_mm < largest.0) {
            largest = (bound_mm, because);
        }
    }
    let mut scan = Scan {
        plan,
        approach,
        starts: &chart.start,
        stop,
        limit_mm: 0,
        fails: None,
        because: largest.1.into(),
    };
    if !scan.rise(chart.starts, largest.0)? {
        return Ok(None);
    }
    let Some(climbs_m) = scan.confirmed(chart.margin)? else {
        return Ok(None);
    };
    Ok(Some(ChartCell {
        edge: approach.edge,
        side_deg: approach.side_deg,
        skew_deg: approach.skew_deg,
        climbs_m,
        limit_m: size_m(scan.limit_mm),
        fails_m: scan.fails,
        because: scan.because,
        clearance_m: clearance_m.map(tenths),
        climb_limits_m: climb_limits_mm.map(size_m),
    }))
}

/// Down to tenths of a millimetre; what rounding lost of a whole one is given back.
fn tenths(size_m: f64) -> f64 {
    (1e4 * size_m + 1e-6).floor() / 1e4
}

impl Scan<'_> {
    /// Coarse steps to the first size that is not climbed, then fine ones below it. A larger size that is
    /// climbed again beyond is an island, and none of the vehicle's capability. False if it was stopped.
    fn rise(&mut self, starts: usize, largest_mm: u32) -> Result<bool, Error> {
        let grid_mm = self.approach.edge.grid_mm();
        let mut above_mm = largest_mm + 1;
        for step_mm in [COARSE * grid_mm, grid_mm] {
            while self.limit_mm + step_mm < above_mm {
                let next_mm = self.limit_mm + step_mm;
                match self.tried(size_m(next_mm), &self.starts[..starts])? {
                    None => return Ok(false),
                    Some(None) => self.limit_mm = next_mm,
                    Some(Some(why)) => {
                        self.fails = Some(size_m(next_mm));
                        self.because = why;
                        above_mm = next_mm;
                    }
                }
            }
        }
        Ok(true)
    }

    /// The margin's part of the limit, climbed from every start. A size that is not becomes the
    /// limit: it lies between two that were tried.
    fn confirmed(&mut self, margin: f64) -> Result<Option<f64>, Error> {
        loop {
            let climbs_m = tenths(margin * size_m(self.limit_mm));
            if climbs_m <= 0.0 {
                return Ok(Some(0.0));
            }
            match self.tried(climbs_m, self.starts)? {
                None => return Ok(None),
                Some(None) => return Ok(Some(climbs_m)),
                Some(Some(why)) => {
                    let grid_mm = self.approach.edge.grid_mm();
                    // The next size of the grid below.
                    self.limit_mm = ((1e3 * climbs_m - 1e-6) / f64::from(grid_mm)) as u32 * grid_mm;
                    self.fails = Some(climbs_m);
                    self.because = why;
                }
            }
        }
    }

    /// Why a size is not climbed from the first of the starts from which it is not; within, none if
    /// it is climbed from all. None if it was stopped.
    #[expect(clippy::option_option, reason = "stopped, climbed, or not and why")]
    fn tried(&self, size_m: f64, starts: &[ChartStart]) -> Result<Option<Option<String>>, Error> {
        for start in starts {
            let scenario = self.plan.scenario(&self.approach, size_m, start)?;
            let outcome = match ended(&scenario, None, self.stop) {
                Ok(None) => return Ok(None),
                Ok(Some((outcome, _))) => outcome,
                Err(error) if error.is_bad_input() => return Err(error.into()),
                // Contacts that did not settle are no climb.
                Err(_) => return Ok(Some(Some(Verdict::Diverged.name().into()))),
            };
            if outcome.verdict != Verdict::Climbed {
                return Ok(Some(Some(outcome.verdict.name().into())));
            }
            let turned_deg = outcome.yaw_error_deg.abs();
            // A metric that was not measured is no small one.
            if turned_deg.is_nan() || turned_deg >= self.plan.empty.max_yaw_deg {
                return Ok(Some(Some("turned".into())));
            }
        }
        Ok(Some(None))
    }
}
