//! The seven-wheel vehicle of Chugo et al. (2004).

use omni_core::geometry::ForwardMap;
use omni_core::loops::torque_factor;
use omni_core::metrics::disturbed_ratio_literal;
use omni_core::motor::TorqueRanges;
use omni_core::{BodyTwist, Kinematics, WheelLayout};

use crate::{Case, as_numbers};

/// Lengths that the suite chose, because the paper gives none: stated in its first case.
fn kinematics(map: ForwardMap) -> Kinematics<f64, 7> {
    let layout = WheelLayout::chugo7(0.35, 0.27, 0.1).expect("valid");
    Kinematics::with_forward(&layout, map).expect("valid")
}

pub(crate) fn equation_9(case: &Case) {
    for (key, value) in [("r", 0.1), ("R1", 0.35), ("R2", 0.27), ("k", 1.0)] {
        assert!(
            case.input[key].as_f64().is_none_or(|given| given == value),
            "{key}"
        );
    }
    let twist = BodyTwist::from_array(case.array("X"));
    case.expects("V", &kinematics(ForwardMap::LeastSquares).inverse(&twist).rad_s);
}

pub(crate) fn left_inverse(case: &Case) {
    assert_eq!(case.expected["product"], "I3");
    let kinematics = kinematics(ForwardMap::PaperAverage);
    for axis in 0..3 {
        let mut unit = [0.0; 3];
        unit[axis] = 1.0;
        let back = kinematics
            .forward(&kinematics.inverse(&BodyTwist::from_array(unit)))
            .to_array();
        for (got, expected) in back.iter().zip(unit) {
            assert!((got - expected).abs() <= case.tolerance);
        }
    }
}

pub(crate) fn forward_maps(case: &Case) {
    let wheels = case.array::<7>("V").into();
    case.expects(
        "eq7",
        &kinematics(ForwardMap::PaperAverage).forward(&wheels).to_array(),
    );
    let least_squares = kinematics(ForwardMap::LeastSquares);
    case.expects("least_squares_of_eq9", &least_squares.forward(&wheels).to_array());
    let residual = least_squares.residual(&wheels).rad_s;
    case.expects(
        "residual_norm",
        &[residual.iter().map(|r| r * r).sum::<f64>().sqrt()],
    );
    case.expects("residual_dof", &[least_squares.redundancy().iter().sum::<f64>()]);
}

pub(crate) fn equation_11(case: &Case) {
    let (requested, limit) = (case.array::<7>("tau_mNm"), case.number("tau_max"));
    let factor = torque_factor(
        &requested,
        &TorqueRanges {
            lower_n_m: [-limit; 7],
            upper_n_m: [limit; 7],
        },
    );
    case.expects("c_with_abs", &[factor]);
    case.expects("tau_out_with_abs", &requested.map(|t| t * factor));
    // As printed, without the absolute value, the wheel that turns backwards is not seen.
    let printed = requested
        .iter()
        .filter(|t| **t > limit)
        .map(|t| limit / t)
        .fold(1.0, f64::min);
    case.expects("c_as_printed", &[printed]);
    assert!((requested[1] * printed).abs() > limit);
}

pub(crate) fn equation_14(case: &Case) {
    let (reference, velocity) = (case.numbers("omega_ref"), as_numbers(&case.input["omega"]));
    let ratios: Vec<f64> = reference
        .iter()
        .zip(velocity)
        .map(|(&r, w)| disturbed_ratio_literal(r, w))
        .collect();
    case.expects("d", &ratios);
    assert!(!disturbed_ratio_literal(1.0, 0.0_f64).is_finite());
}
