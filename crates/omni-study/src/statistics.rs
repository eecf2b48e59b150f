//! Statistics of some runs: 95 % intervals.

use std::f64::consts::{FRAC_2_PI, FRAC_PI_2};

/// How sure an interval is.
const SURE: f64 = 0.95;
/// The normal distribution's quantile for it, half of the rest above.
const Z: f64 = 1.959_963_984_540_054;
/// From so many degrees of freedom on an expansion about the normal distribution has nine digits.
const MANY: usize = 1000;

/// 95 % interval of a rate, from how many of `runs` said yes, by Wilson's score: even if all or none did. None without
/// a run.
///
/// E. B. Wilson, *Probable inference, the law of succession, and statistical inference*, J. Am.
/// Stat. Assoc. 22 (1927) 209.
///
/// ```
/// let [low, high] = omni_study::wilson(22, 24).expect("there are runs");
/// assert!((low - 0.7415).abs() < 1e-4 && (high - 0.9768).abs() < 1e-4);
/// ```
#[must_use]
pub fn wilson(yes: usize, runs: usize) -> Option<[f64; 2]> {
    if runs == 0 {
        return None;
    }
    let n = runs as f64;
    let (rate, part) = (yes.min(runs) as f64 / n, Z * Z / n);
    let middle = (rate + part / 2.0) / (1.0 + part);
    let half = Z / (1.0 + part) * (rate * (1.0 - rate) / n + part / (4.0 * n)).sqrt();
    // All and none are in it; rounding may not say otherwise.
    Some([
        if yes == 0 { 0.0 } else { (middle - half).max(0.0) },
        if yes >= runs {
            1.0
        } else {
            (middle + half).min(1.0)
        },
    ])
}

/// Mean of some measurements and its 95 % interval by Student's t; no interval of one measurement, nothing of none.
///
/// Student, *The probable error of a mean*, Biometrika 6 (1908) 1.
///
/// ```
/// let (mean, interval) = omni_study::mean_interval(&[1.0, 2.0, 3.0]).expect("there are some");
/// let [low, high] = interval.expect("more than one"); // t of 2 degrees of freedom is 4.303: 4.303 / sqrt(3)
/// assert!(mean == 2.0 && (low + 0.484).abs() < 1e-3 && (high - 4.484).abs() < 1e-3);
/// ```
#[must_use]
pub fn mean_interval(measured: &[f64]) -> Option<(f64, Option<[f64; 2]>)> {
    let n = measured.len() as f64;
    if measured.is_empty() {
        return None;
    }
    let mean = measured.iter().sum::<f64>() / n;
    let interval = (measured.len() > 1).then(|| {
        let squares: f64 = measured.iter().map(|x| (x - mean) * (x - mean)).sum();
        let half = student_t(measured.len() - 1) * (squares / (n - 1.0) / n).sqrt();
        [mean - half, mean + half]
    });
    Some((mean, interval))
}

/// Student's t that 95 of 100 are within, to either side, for so many degrees of freedom, 1 or more.
fn student_t(degrees: usize) -> f64 {
    let n = degrees as f64;
    if degrees > MANY {
        // Abramowitz and Stegun 26.7.5.
        let (z3, z5) = (Z.powi(3), Z.powi(5));
        return Z + (z3 + Z) / (4.0 * n) + (5.0 * z5 + 16.0 * z3 + 3.0 * Z) / (96.0 * n * n);
    }
    // The part within rises with the angle: halved until two neighbours are left.
    let (mut low, mut high) = (0.0, FRAC_PI_2);
    for _ in 0..60 {
        let angle = f64::midpoint(low, high);
        if part_within(angle, degrees) < SURE {
            low = angle;
        } else {
            high = angle;
        }
    }
    low.tan() * n.sqrt()
}

/// Part of Student's distribution within -t to t, for t = tan(angle) sqrt(degrees): Abramowitz and
/// Stegun 26.7.3 and 26.7.4.
fn part_within(angle: f64, degrees: usize) -> f64 {
    let (sin, cos) = angle.sin_cos();
    let odd = degrees % 2 == 1;
    // Each term is the one before times cos^2 and the next number of one kind over the next of the
    // other: 2/3, 4/5, ... or 1/2, 3/4, ...
    let (mut term, first) = if odd { (sin * cos, 2) } else { (sin, 1) };
    let mut sum = 0.0;
    let mut over = first;
    for _ in 0..degrees / 2 {
        sum += term;
        term *= cos * cos * f64::from(over) / f64::from(over + 1);
        over += 2;
    }
    if odd { FRAC_2_PI * (angle + sum) } else { sum }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

    use super::*;

    #[test]
    fn t_is_that_of_the_tables() {
        // scipy.stats.t.ppf(0.975, n); to three digits in every printed table.
        for (degrees, t) in [
            (1, 12.706_204_736_174_694),
            (2, 4.302_652_729_749_462),
            (3, 3.182_446_305_283_708),
            (4, 2.776_445_105_197_793),
            (5, 2.570_581_835_636_315),
            (10, 2.228_138_851_986_274),
            (23, 2.068_657_610_419_049),
            (30, 2.042_272_456_301_238),
            (120, 1.979_930_405_082_44),
        ] {
            // Sixty halvings leave 1e-18 rad; what is lost is rounding of the sums.
            assert!(
                (student_t(degrees) / t - 1.0).abs() < 1e-12,
                "{degrees}: {}",
                student_t(degrees)
            );
        }
    }

    #[test]
    fn the_sum_and_the_expansion_meet_and_go_to_the_normal_distributions() {
        // The expansion's first omitted term is 3e-9 there; one degree of freedom more is 2e-6.
        let step = student_t(MANY) - student_t(MANY + 1);
        assert!((step - (Z.powi(3) + Z) / 4e6).abs() < 1e-8, "{step}");
        assert!((student_t(10_000_000) - Z).abs() < 1e-6);
    }

    #[test]
    fn wilsons_interval_is_the_published_one() {
        // R. G. Newcombe, Statistics in Medicine 17 (1998) 857, table I, method 3, to four digits.
        for (yes, runs, published) in [
            (81, 263, [0.2553, 0.3662]),
            (15, 148, [0.0624, 0.1605]),
            (0, 20, [0.0, 0.1611]),
            (1, 29, [0.0061, 0.1718]),
        ] {
            let interval = wilson(yes, runs).unwrap();
            for (end, expected) in interval.iter().zip(published) {
                assert!((end - expected).abs() < 6e-5, "{yes} of {runs}: {interval:?}");
            }
        }
        assert_eq!(wilson(24, 24).unwrap()[1], 1.0);
        assert_eq!(wilson(0, 0), None);
    }

    #[test]
    fn an_interval_needs_two_measurements_and_is_a_point_where_all_are_equal() {
        assert_eq!(mean_interval(&[]), None);
        assert_eq!(mean_interval(&[2.5]), Some((2.5, None)));
        assert_eq!(mean_interval(&[2.5; 4]), Some((2.5, Some([2.5, 2.5]))));
    }

    #[test]
    fn ninety_five_of_a_hundred_intervals_have_the_true_mean() {
        // Sums of twelve uniform numbers are as good as normal; of 4000 intervals of five each 3800
        // hold 0, give or take 3 * 14.
        let mut seed = 1_u64;
        let mut uniform = || {
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64
        };
        let mut held = 0;
        for _ in 0..4000 {
            let sample: Vec<f64> = (0..5)
                .map(|_| (0..12).map(|_| uniform()).sum::<f64>() - 6.0)
                .collect();
            let [low, high] = mean_interval(&sample).unwrap().1.unwrap();
            held += u32::from(low < 0.0 && high > 0.0);
        }
        assert!((3758..=3842).contains(&held), "{held}");
    }
}
