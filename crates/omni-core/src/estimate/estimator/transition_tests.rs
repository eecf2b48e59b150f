use super::step::ValidReadings;
use super::tests::{Random, mecanum};
use super::{
    BIAS, Estimator, EstimatorConfig, EstimatorInput, EstimatorState, Matrix, SIZE, SLIP, Sum, VX, VY, X, Y,
    YAW,
};

type State = EstimatorState<f64, 4>;

fn numbers(state: &State) -> [f64; SIZE] {
    let ([vx, vy], [sx, sy, sw]) = (state.velocity, state.slip);
    let (x, y, yaw) = (state.x.total, state.y.total, state.yaw.total);
    [x, y, yaw, vx, vy, state.bias, sx, sy, sw]
}

/// The state with one number changed. Without a gyro the yaw rate of the period before, which has
/// the bias in it, changes with the bias.
fn changed(state: &State, index: usize, by: f64, gyro: bool) -> State {
    let mut state = *state;
    match index {
        X => state.x = Sum::of(state.x.total + by),
        Y => state.y = Sum::of(state.y.total + by),
        YAW => state.yaw = Sum::of(state.yaw.total + by),
        VX => state.velocity[0] += by,
        VY => state.velocity[1] += by,
        BIAS => {
            state.bias += by;
            state.yaw_rate += if gyro { 0.0 } else { by };
        }
        _ => state.slip[index - SLIP] += by,
    }
    state
}

/// A column of the transition that the covariance is carried by: of `F e e^T F^T`, whose root of
/// the diagonal is positive where the number keeps most of itself.
fn column(
    estimator: &Estimator<f64, 4>,
    state: &State,
    input: &EstimatorInput<f64, 4>,
    i: usize,
) -> [f64; SIZE] {
    let carried = |start: [f64; SIZE]| {
        let mut state = *state;
        state.covariance = Matrix::diagonal(start);
        let valid = ValidReadings::of(input, &state);
        estimator.predict(&mut state, input, &valid);
        state.covariance.0
    };
    let noise = carried([0.0; SIZE]);
    let with = carried(core::array::from_fn(|k| if k == i { 1.0 } else { 0.0 }));
    let root = (with[i][i] - noise[i][i]).sqrt();
    core::array::from_fn(|k| (with[k][i] - noise[k][i]) / root)
}

#[test]
fn the_covariance_is_carried_by_the_derivatives_of_the_state() {
    let mut random = Random(0x1234_5678_9abc_def1);
    let mut worst = 0.0_f64;
    for round in 0..400 {
        let period_s = if round % 2 == 0 { 1e-3 } else { 0.05 };
        let estimator = Estimator::new(EstimatorConfig::new(period_s), &mecanum()).expect("valid");
        let mut state = estimator.start();
        for i in 0..SIZE {
            state = changed(
                &state,
                i,
                [3.0, 3.0, 3.0, 2.0, 2.0, 0.1, 1.0, 1.0, 1.0][i] * random.next(),
                true,
            );
        }
        state.yaw_rate = 3.0 * random.next();
        let mut input = EstimatorInput::new(&[(); 4].map(|()| 10.0 * random.next()).into());
        let (gyro, accelerometer) = (round % 3 > 0, round % 5 > 0);
        if gyro {
            input.yaw_rate_rad_s = 3.0 * random.next();
        }
        if accelerometer {
            input.acceleration_m_s2 = [5.0 * random.next(), 5.0 * random.next()];
        }
        let moved = |i: usize, by: f64| {
            let mut state = changed(&state, i, by, gyro);
            let valid = ValidReadings::of(&input, &state);
            estimator.predict(&mut state, &input, &valid);
            numbers(&state)
        };
        // Without a gyro the wheels' slip in yaw turns the vehicle; it is carried as noise of the
        // rate, not by a derivative.
        for i in 0..if gyro { SIZE } else { SIZE - 1 } {
            const STEP: f64 = 1e-5;
            let (ahead, behind) = (moved(i, STEP), moved(i, -STEP));
            let by_covariance = column(&estimator, &state, &input, i);
            for k in 0..SIZE {
                let difference = (ahead[k] - behind[k]) / (2.0 * STEP);
                worst = worst.max((difference - by_covariance[k]).abs());
            }
        }
    }
    // Rounding of numbers up to 4 over the step, 1e-10, and a third derivative of at most 2 times
    // the square of the step, 1e-10. A term of v dt^2 that is wrong is 2e-6 at 1 kHz.
    assert!(worst < 1e-9, "{worst}");
}
