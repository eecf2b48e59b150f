//! Random errors of sensors and poses, and how large a pose's error is beside its covariance.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::RngCore;

/// A number of the standard normal distribution, approximated by twelve uniform ones.
pub(crate) fn normal(rng: &mut ChaCha8Rng) -> f64 {
    (0..12)
        .map(|_| (rng.next_u64() >> 11) as f64 / (1_u64 << 53) as f64)
        .sum::<f64>()
        - 6.0
}

/// `e^T P^-1 e` by elimination.
pub(crate) fn nees(mut p: [[f64; 3]; 3], mut e: [f64; 3]) -> f64 {
    let mut sum = 0.0;
    for i in 0..3 {
        sum += e[i] * e[i] / p[i][i];
        for j in i + 1..3 {
            let factor = p[j][i] / p[i][i];
            for k in i..3 {
                p[j][k] -= factor * p[i][k];
            }
            e[j] -= factor * e[i];
        }
    }
    sum
}
