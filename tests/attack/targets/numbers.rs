//! Numbers out of bytes: within a range, or any bits at all. Where the bytes are used up all are zero.

use arbitrary::Unstructured;
use omni_core::Real;

/// A number of 0 to 255.
pub(super) fn byte(u: &mut Unstructured<'_>) -> u8 {
    u.arbitrary().unwrap_or_default()
}

/// One in `n`.
pub(super) fn one_in(u: &mut Unstructured<'_>, n: u8) -> bool {
    byte(u).is_multiple_of(n)
}

/// From `low` > 0 to `high`, each power of ten as likely as another, the ends now and then.
pub(super) fn within<R: Real>(u: &mut Unstructured<'_>, low: f64, high: f64) -> R {
    match byte(u) {
        0 => R::of(low),
        1 => R::of(high),
        _ => {
            let part = f64::from(u.arbitrary::<u32>().unwrap_or_default()) / f64::from(u32::MAX);
            R::of((low.ln() + part * (high / low).ln()).exp().clamp(low, high))
        }
    }
}

/// [`within`], or zero one time in four.
pub(super) fn none_or<R: Real>(u: &mut Unstructured<'_>, low: f64, high: f64) -> R {
    if one_in(u, 4) {
        R::zero()
    } else {
        within(u, low, high)
    }
}

/// [`within`], or infinity one time in four: what many limits mean by none.
pub(super) fn limit<R: Real>(u: &mut Unstructured<'_>, low: f64, high: f64) -> R {
    if one_in(u, 4) {
        R::of(f64::INFINITY)
    } else {
        within(u, low, high)
    }
}

/// [`within`] of either sign.
pub(super) fn signed<R: Real>(u: &mut Unstructured<'_>, low: f64, high: f64) -> R {
    let size = none_or::<R>(u, low, high);
    if one_in(u, 2) { -size } else { size }
}

/// Any bits, with the awkward ones often.
pub(super) fn bits<R: Real>(u: &mut Unstructured<'_>) -> R {
    let awkward = [
        f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        -0.0,
        f64::MAX,
        f64::MIN_POSITIVE,
        5e-324,
        f64::from(f32::MAX),
        f64::from(f32::MIN_POSITIVE),
        1e-45,
        1e6,
        -1e6,
        1e6 + 1.0,
        1e38,
        -1e19,
    ];
    match byte(u) {
        kind @ 0..60 => R::of(awkward[usize::from(kind) % awkward.len()]),
        60..100 => R::of(f64::from_bits(u.arbitrary().unwrap_or_default())),
        100..120 => R::of(f64::from(f32::from_bits(u.arbitrary().unwrap_or_default()))),
        _ => signed(u, 1e-3, 300.0),
    }
}
