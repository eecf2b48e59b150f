//! The torques alone are those of a period with its signals.

use super::*;
use crate::linkage::MAX_HINGES;
use crate::{Attitude, WheelTorques};

/// What a period reads and is told.
#[derive(Clone, Debug)]
struct Period {
    command: [f64; 3],
    wheels_rad_s: [f64; 7],
    hinges: [[f64; 2]; 2],
    imu: [f64; 5],
    target_m_s: f64,
    climbs: Option<(u32, f64, f64)>,
    square_up: bool,
}

/// Mostly a number within, at times one that no sensor says, or none.
fn reading(most: f64) -> impl Strategy<Value = f64> {
    prop_oneof![
        30 => -most..most,
        10 => Just(0.0),
        1 => Just(f64::NAN),
        1 => Just(1e7),
    ]
}

fn period() -> impl Strategy<Value = Period> {
    let command = prop_oneof![
        4 => Just([0.3, 0.0, 0.0]),
        2 => [-0.4..0.4, -0.4..0.4, -1.0..1.0],
        1 => Just([0.0; 3]),
        1 => Just([f64::NAN, 0.0, 0.0]),
    ];
    let hinges = [[reading(0.5), reading(1.0)], [reading(0.5), reading(1.0)]];
    let imu = [
        reading(0.3),
        reading(0.3),
        reading(0.5),
        reading(0.5),
        reading(0.5),
    ];
    let climbs = prop::option::of((0..128_u32, 0.0..0.1, 0.0..0.3));
    (
        command,
        prop::array::uniform7(reading(12.0)),
        hinges,
        imu,
        reading(0.5),
        climbs,
        any::<bool>(),
    )
        .prop_map(
            |(command, wheels_rad_s, hinges, imu, target_m_s, climbs, square_up)| Period {
                command,
                wheels_rad_s,
                hinges,
                imu,
                target_m_s,
                climbs,
                square_up,
            },
        )
}

macro_rules! alike {
    ($name:ident, $real:ty) => {
        /// Runs both for these periods: torques and states are equal in every bit, NaN and the sign of 0 too.
        fn $name(encoders: bool, falling: bool, periods: &[Period]) -> Result<(), TestCaseError> {
            let of = |x: f64| x as $real;
            let kinematics =
                Kinematics::new(&WheelLayout::chugo7(of(0.30), of(0.23), of(0.066)).expect("valid"))
                    .expect("valid");
            let limit = match falling {
                true => TorqueLimit::line(of(2.5), of(0.1)).and_then(|limit| limit.capped(of(2.0))),
                false => TorqueLimit::constant(of(2.0)),
            };
            let mut wheels = PLACES.map(|place_m| TractionWheel {
                limit: limit.expect("valid"),
                inertia_kg_m2: of(J),
                carrier: [of(0.0); 2],
                place_m: place_m.map(of),
            });
            for (wheel, [ax, ay, _]) in wheels.iter_mut().zip(kinematics.inverse_matrix()) {
                wheel.carrier = [of(0.066) * ax, of(0.066) * ay];
            }
            let hinges = hinges().map(|hinge| HingeGeometry {
                parent: hinge.parent,
                child: hinge.child,
                axis: hinge.axis.map(of),
                anchor_m: hinge.anchor_m.map(of),
            });
            let carried = PLACES.map(|[x, y]| CarriedWheel {
                body: [2, 0, 1][(x.signum() * f64::from(x != 0.0) + 1.0) as usize],
                centre_m: [of(x), of(y), of(0.066)],
            });
            let linkage = Linkage::new(&hinges, &carried).expect("a tree");
            let mut config = TractionConfig::steady(of(0.3), of(2.0), of(T));
            config.encoder_rad = of(if encoders { 0.01 } else { 0.0 });
            let traction = Traction::new(kinematics, linkage, wheels, config).expect("valid");
            let (mut whole, mut lean) = (TractionState::new(), TractionState::new());
            let (mut sample, mut torques) = (TractionSample::zero(), WheelTorques::zero());
            for (k, period) in periods.iter().enumerate() {
                let [vx_m_s, vy_m_s, wz_rad_s] = period.command.map(of);
                let rates = period.wheels_rad_s.map(of);
                let (angles, hinge_rates) = (
                    period.hinges.map(|[angle, _]| of(angle)),
                    period.hinges.map(|[_, rate]| of(rate)),
                );
                let mut readings = Readings::new(
                    BodyTwist {
                        vx_m_s,
                        vy_m_s,
                        wz_rad_s,
                    },
                    &rates,
                );
                (readings.hinges_rad, readings.hinges_rad_s) = (&angles, &hinge_rates);
                let [roll, pitch, x, y, z] = period.imu.map(of);
                (readings.imu.roll_rad, readings.imu.pitch_rad) = (roll, pitch);
                readings.imu.rate_rad_s = [x, y, z];
                let mut target = TractionTarget::at(of(period.target_m_s));
                target.square_up = period.square_up;
                if let Some((climbing, allowance, spin)) = period.climbs {
                    (target.climbing, target.spin_gain) = (climbing, of(0.7));
                    (target.allowance_m_s, target.spin_m_s) = (of(allowance), of(spin));
                }
                let observed = traction.observe(&mut whole, &readings);
                traction.act_into(&mut whole, &readings, &observed, &target, &mut sample);
                traction.torques_into(&mut lean, &readings, &target, &mut torques);
                let bits = |n_m: [$real; 7]| n_m.map(<$real>::to_bits);
                prop_assert_eq!(
                    bits(torques.n_m),
                    bits(sample.wheels.applied.n_m),
                    "period {}",
                    k
                );
                // The text of a number is that of its bits.
                prop_assert_eq!(
                    std::format!("{lean:?}"),
                    std::format!("{whole:?}"),
                    "period {}",
                    k
                );
            }
            Ok(())
        }
    };
}

alike!(alike_f32, f32);
alike!(alike_f64, f64);

proptest! {
    #[test]
    fn torques_alone_are_those_of_a_period_with_its_signals_in_every_bit(
        encoders in any::<bool>(),
        falling in any::<bool>(),
        periods in prop::collection::vec(period(), 1..40),
    ) {
        alike_f32(encoders, falling, &periods)?;
        alike_f64(encoders, falling, &periods)?;
    }
}

proptest! {
    /// Readings of which all are numbers have a short way; what is seen on it is what the long one sees.
    #[test]
    fn on_the_short_way_nothing_else_is_seen(
        wheels in prop::array::uniform7(-12.0..12.0_f64),
        angles in prop::array::uniform2(-0.5..0.5_f64),
        rates in prop::array::uniform2(-1.0..1.0_f64),
        imu in prop::array::uniform5(-0.2..0.2_f64),
    ) {
        let traction = steady();
        let mut readings = Readings::new(AHEAD, &wheels);
        (readings.hinges_rad, readings.hinges_rad_s) = (&angles, &rates);
        let [roll, pitch, x, y, z] = imu;
        (readings.imu.roll_rad, readings.imu.pitch_rad) = (roll, pitch);
        readings.imu.rate_rad_s = [x, y, z];
        prop_assert!(traction.plain(&readings));
        let see = |plain| {
            let (mut state, mut bodies) = (TractionState::new(), [Attitude::level(); MAX_HINGES + 1]);
            let seen = traction.see(&mut state, &readings, plain, &mut bodies);
            let moves = (seen.moves.height_m, seen.moves.rise_m_s);
            // The text of a number is that of its bits.
            std::format!("{:?}", (seen.measured, seen.heard, seen.free_rad_s, moves, seen.yaw_rad_s, bodies, state))
        };
        prop_assert_eq!(see(true), see(false));
    }
}

#[test]
fn readings_of_a_vehicle_on_its_side_or_without_a_number_take_the_long_way() {
    let traction = steady();
    let short = |wheels: &[f64], angles: &[f64], roll_rad: f64, yaw_rad_s: f64| {
        let mut readings = Readings::new(AHEAD, wheels);
        (readings.hinges_rad, readings.hinges_rad_s) = (angles, &[0.0; 2]);
        (readings.imu.roll_rad, readings.imu.rate_rad_s[2]) = (roll_rad, yaw_rad_s);
        traction.plain(&readings)
    };
    let still = [0.0; 7];
    assert!(short(&still, &[0.7, -0.7], 0.0, 0.0));
    assert!(!short(&still, &[0.8, -0.8], 0.0, 0.0)); // together more than 1.5 rad
    assert!(!short(&still, &[0.0; 2], 1.6, 0.0));
    assert!(!short(&still, &[0.0, f64::NAN], 0.0, 0.0));
    assert!(!short(&still, &[0.0], 0.0, 0.0)); // two hinges, one reading
    assert!(!short(&still[1..], &[0.0; 2], 0.0, 0.0));
    assert!(!short(&still, &[0.0; 2], 0.0, f64::INFINITY));
    assert!(!short(&[0.0, 0.0, 0.0, 2e6, 0.0, 0.0, 0.0], &[0.0; 2], 0.0, 0.0));
}
