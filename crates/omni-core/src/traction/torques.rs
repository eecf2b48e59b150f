//! Torques of a period and nothing else.

use super::{Traction, TractionState, TractionTarget};
use crate::linkage::MAX_HINGES;
use crate::{Attitude, Readings, Real, WheelTorques};

impl<R: Real, const N: usize> Traction<R, N> {
    /// A whole control period without its signals: the torques \[N.m\] that [`Traction::observe_into`] and [`Traction::act_into`] apply,
    /// and the same state, in every bit. What only an observation or a sample shows is not computed: heights, slips, parts of a torque.
    ///
    /// For a microcontroller that follows a given speed. A [`Supervisor`](crate::Supervisor) needs the observation. All of `torques` is
    /// written, 0 for a wheel without a reading. It is inlined: call it from one function of your own.
    ///
    /// ```
    /// # use omni_core::{BodyTwist, CarriedWheel, Kinematics, Linkage, Readings, TorqueLimit, WheelTorques};
    /// # use omni_core::{Traction, TractionConfig, TractionState, TractionTarget, TractionWheel, WheelLayout};
    /// # let places = [[0.3, 0.2], [0.3, -0.2], [-0.3, 0.2], [-0.3, -0.2]];
    /// # let limit = TorqueLimit::constant(2.0)?;
    /// # let wheels = places.map(|place_m| TractionWheel { limit, inertia_kg_m2: 0.002, carrier: [1.0, 0.0], place_m });
    /// # let linkage = Linkage::new(&[], &places.map(|[x, y]| CarriedWheel { body: 0, centre_m: [x, y, 0.1] }))?;
    /// # let kinematics = Kinematics::new(&WheelLayout::mecanum4(0.6, 0.4, 0.1_f64)?)?;
    /// # let traction = Traction::new(kinematics, linkage, wheels, TractionConfig::steady(0.3, 2.0, 1e-3))?;
    /// # let ahead = BodyTwist { vx_m_s: 0.3, ..BodyTwist::ZERO };
    /// let (mut state, mut torques) = (TractionState::new(), WheelTorques::zero());
    /// let readings = Readings::new(ahead, &[0.0; 4]);
    /// traction.torques_into(&mut state, &readings, &TractionTarget::at(0.3), &mut torques);
    /// // At rest, told to go at 0.3 m/s: more is asked for than the motors have.
    /// assert_eq!(torques.n_m, [2.0; 4]);
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    #[inline(always)]
    pub fn torques_into(
        &self,
        state: &mut TractionState<R, N>,
        readings: &Readings<'_, R>,
        target: &TractionTarget<R>,
        torques: &mut WheelTorques<R, N>,
    ) {
        if self.plain(readings) {
            self.torques_told::<true>(state, readings, target, torques);
        } else {
            self.doubtful_torques(state, readings, *target, torques);
        }
    }

    /// As [`Traction::torques_into`], where a sensor says nothing or the vehicle lies on its side.
    #[cold]
    #[inline(never)]
    fn doubtful_torques(
        &self,
        state: &mut TractionState<R, N>,
        readings: &Readings<'_, R>,
        target: TractionTarget<R>,
        torques: &mut WheelTorques<R, N>,
    ) {
        self.torques_told::<false>(state, readings, &target, torques);
    }

    #[inline(always)]
    fn torques_told<const PLAIN: bool>(
        &self,
        state: &mut TractionState<R, N>,
        readings: &Readings<'_, R>,
        target: &TractionTarget<R>,
        torques: &mut WheelTorques<R, N>,
    ) {
        let mut bodies = [Attitude::LEVEL; MAX_HINGES + 1];
        let seen = self.see(state, readings, PLAIN, &mut bodies);
        self.act_told::<PLAIN>(state, readings, &seen.look(&bodies), target, torques);
    }
}
