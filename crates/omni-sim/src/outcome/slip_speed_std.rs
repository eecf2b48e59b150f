//! How differently wheels slip.

/// The metric `slip_speed_std`: over all periods, the root mean square of the standard deviation of
/// the wheels' slip speeds, over the root mean square of the speeds that were asked of them. What
/// all wheels do together, as on the longer way over an edge or when they lag behind, is no spread;
/// nor is what the vehicle's links make of wheels that roll.
#[derive(Default)]
pub(super) struct SlipSpeedStd {
    variances: f64,
    asked: f64,
    period: Period,
}

#[derive(Default)]
struct Period {
    wheels: f64,
    slip: f64,
    slip_squared: f64,
    asked_squared: f64,
}

impl SlipSpeedStd {
    pub(super) fn start_period(&mut self) {
        self.period = Period::default();
    }

    /// Adds a driven wheel: the speed along its push that its reference asks of it, and what its
    /// rim is faster than its centre \[m/s\].
    pub(super) fn add(&mut self, asked_m_s: f64, slip_m_s: f64) {
        // Wheels on both sides of a vehicle turn against each other: each counts in its commanded direction.
        let slip_m_s = slip_m_s * asked_m_s.signum();
        let period = &mut self.period;
        period.wheels += 1.0;
        period.slip += slip_m_s;
        period.slip_squared += slip_m_s * slip_m_s;
        period.asked_squared += asked_m_s * asked_m_s;
    }

    pub(super) fn end_period(&mut self) {
        let period = &self.period;
        if period.wheels > 0.0 {
            let mean = period.slip / period.wheels;
            // Rounding can make the difference of equal slips less than 0.
            self.variances += (period.slip_squared / period.wheels - mean * mean).max(0.0);
            self.asked += period.asked_squared / period.wheels;
        }
    }

    /// NaN if no wheel was driven.
    pub(super) fn ratio(&self) -> f64 {
        (self.variances / self.asked).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::SlipSpeedStd;

    fn spread(periods: &[&[(f64, f64)]]) -> f64 {
        let mut spread = SlipSpeedStd::default();
        for wheels in periods {
            spread.start_period();
            wheels.iter().for_each(|(asked, slip)| spread.add(*asked, *slip));
            spread.end_period();
        }
        spread.ratio()
    }

    /// Rounding of a difference of squares.
    const TOLERANCE: f64 = 1e-7;

    #[test]
    fn wheels_that_slip_alike_have_none_whichever_way_they_turn() {
        assert!(spread(&[&[(0.3, 0.05), (-0.3, -0.05), (0.3, 0.05)]]) < TOLERANCE);
    }

    #[test]
    fn it_is_the_deviation_over_the_speed_asked_for() {
        // Slips of 0.06 and 0 m/s: a deviation of 0.03 of 0.3 m/s.
        assert!((spread(&[&[(0.3, 0.06), (-0.3, 0.0)]]) - 0.1).abs() < TOLERANCE);
        // Half of the time: over the square root of two.
        let half = spread(&[&[(0.3, 0.06), (-0.3, 0.0)], &[(0.3, 0.0), (-0.3, 0.0)]]);
        assert!((half - 0.1 / 2.0_f64.sqrt()).abs() < TOLERANCE);
        // Where wheels are asked for 0.3 and 0.1 m/s, the divisor is sqrt((0.09 + 0.01) / 2).
        assert!((spread(&[&[(0.3, 0.06), (-0.1, 0.0)]]) - 0.03 / 0.05_f64.sqrt()).abs() < TOLERANCE);
    }

    #[test]
    fn one_wheel_alone_has_none_and_no_wheel_is_not_measured() {
        assert!(spread(&[&[(0.3, 0.06)]]) < TOLERANCE);
        assert!(spread(&[&[]]).is_nan());
    }
}
