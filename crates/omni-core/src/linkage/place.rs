//! Positions and velocities of the wheels of a linkage in space: exact, for any tree of hinges.

use super::tree::{Attitude, Linkage, MAX_HINGES};
use crate::Real;

/// Largest angle of the base's axes above the horizon \[rad\].
const LARGEST_ANGLE_RAD: f64 = 1.1;

/// x, y and z axis of a body, each as a vector of the level frame.
pub(crate) type Axes<R> = [[R; 3]; 3];

/// A wheel in the level frame: origin at the base's origin, x along the heading, z up.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WheelPlace<R> {
    /// Its centre \[m\].
    pub(crate) centre_m: [R; 3],
    /// Velocity of its centre relative to the base's origin, by attitude and hinges alone \[m/s\].
    pub(crate) velocity_m_s: [R; 3],
    /// Axes of the body that carries it.
    pub(crate) axes: Axes<R>,
    /// Angular velocity of that body, without the yaw rate \[rad/s\].
    pub(crate) rate_rad_s: [R; 3],
}

/// A body in the level frame: its axes, angular velocity, and position and velocity of its reference point.
#[derive(Clone, Copy)]
struct BodyPlace<R> {
    axes: Axes<R>,
    rate_rad_s: [R; 3],
    position_m: [R; 3],
    velocity_m_s: [R; 3],
}

/// The base's axes from the angles of its x and y axis above the horizon, which are limited to 1.1 rad.
pub(crate) fn axes_of<R: Real>(attitude: &Attitude<R>) -> Axes<R> {
    let most = R::of(LARGEST_ANGLE_RAD);
    let up = |angle: R| angle.limited(-most, most).sine_cosine();
    let ((sp, cp), (sr, _)) = (up(attitude.nose_up_rad), up(attitude.left_up_rad));
    let level = R::one() - sp * sp - sr * sr;
    let least = R::of(0.01);
    let b = if level > least { level } else { least }.sqrt() / cp;
    let a = -(sp * sr) / cp;
    [
        [cp, R::zero(), sp],
        [a, b, sr],
        [-(sp * b), sp * a - cp * sr, cp * b],
    ]
}

pub(crate) fn dot<R: Real>(a: &[R; 3], b: &[R; 3]) -> R {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn cross<R: Real>(a: &[R; 3], b: &[R; 3]) -> [R; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

pub(crate) fn plus<R: Real>(a: &[R; 3], b: &[R; 3]) -> [R; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// A vector in a body's axes, in the level frame.
pub(crate) fn turned<R: Real>([x, y, z]: &Axes<R>, v: &[R; 3]) -> [R; 3] {
    [
        x[0] * v[0] + y[0] * v[1] + z[0] * v[2],
        x[1] * v[0] + y[1] * v[1] + z[1] * v[2],
        x[2] * v[0] + y[2] * v[1] + z[2] * v[2],
    ]
}

/// A vector `v`, turned about the unit vector `axis` by the angle with this sine and cosine (Rodrigues).
fn about<R: Real>(v: &[R; 3], axis: &[R; 3], (sin, cos): (R, R)) -> [R; 3] {
    let (across, along) = (cross(axis, v), dot(axis, v) * (R::one() - cos));
    let part = |k: usize| cos * v[k] + sin * across[k] + along * axis[k];
    [part(0), part(1), part(2)]
}

impl<R: Real, const N: usize> Linkage<R, N> {
    /// Positions and velocities of the wheels, from attitude and hinges: angles \[rad\] and rates \[rad/s\] in the
    /// order in which the hinges were given. Hinges about vertical axes are left out, as in [`Linkage::motion`].
    pub(crate) fn places(
        &self,
        base: &Attitude<R>,
        hinges_rad: &[R; MAX_HINGES],
        hinges_rad_s: &[R; MAX_HINGES],
    ) -> [WheelPlace<R>; N] {
        let zero = [R::zero(); 3];
        let axes = axes_of(base);
        // Angular velocity of the base without the yaw rate: its x axis stays in its vertical plane.
        let [x, y, _] = &axes;
        let (left, nose) = (base.left_up_rad_s, -base.nose_up_rad_s);
        let along = x[0] * left + y[0] * nose;
        let rate = [along, y[1] * nose, along * x[2] / x[0]];
        let body = BodyPlace {
            axes,
            rate_rad_s: rate,
            position_m: zero,
            velocity_m_s: zero,
        };
        let mut bodies = [body; MAX_HINGES + 1];
        for (k, joint) in self.joints.iter().take(self.hinge_count()).enumerate() {
            let [first, ..] = &bodies;
            let parent = *bodies.get(usize::from(joint.parent)).unwrap_or(first);
            let reading = usize::from(joint.reading);
            let read = |values: &[R; MAX_HINGES]| values.get(reading).copied().unwrap_or(R::zero());
            let (angle, rate) = (read(hinges_rad), read(hinges_rad_s));
            let axis = turned(&parent.axes, &[joint.left_up, -joint.nose_up, R::zero()]);
            let (position_m, velocity_m_s) = parent.point(&joint.arm_m);
            let by = angle.sine_cosine();
            if let Some(body) = bodies.get_mut(k + 1) {
                *body = BodyPlace {
                    axes: parent.axes.map(|each| about(&each, &axis, by)),
                    rate_rad_s: plus(&parent.rate_rad_s, &axis.map(|each| each * rate)),
                    position_m,
                    velocity_m_s,
                };
            }
        }
        let [first, ..] = &bodies;
        core::array::from_fn(|i| {
            let body = bodies.get(self.carrier(i)).unwrap_or(first);
            let arm = self.arm_m.get(i).unwrap_or(&zero);
            let (centre_m, velocity_m_s) = body.point(arm);
            WheelPlace {
                centre_m,
                velocity_m_s,
                axes: body.axes,
                rate_rad_s: body.rate_rad_s,
            }
        })
    }
}

impl<R: Real> BodyPlace<R> {
    /// Position and velocity of a point of it.
    fn point(&self, arm_m: &[R; 3]) -> ([R; 3], [R; 3]) {
        let arm = turned(&self.axes, arm_m);
        let velocity = plus(&self.velocity_m_s, &cross(&self.rate_rad_s, &arm));
        (plus(&self.position_m, &arm), velocity)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linkage::{CarriedWheel, HingeGeometry};

    /// The attitude with the rates of a gyro on the base's axes, if nose and left side rise at these rates \[rad/s\].
    ///
    /// The angular velocity (p, q, r) turns the axes by x' = r y - q z and y' = p z - r x. The heading is kept: the
    /// lateral component of x' is 0.
    fn with_rates(base: &Attitude<f64>, nose: f64, left: f64) -> Attitude<f64> {
        let [x, y, z] = axes_of(base);
        let (cn, cl) = (base.nose_up_rad.cos(), base.left_up_rad.cos());
        let r_per_q = z[1] / y[1];
        let q = nose * cn / (r_per_q * y[2] - z[2]);
        let p = (left * cl + r_per_q * q * x[2]) / z[2];
        Attitude {
            nose_up_rad_s: -q,
            left_up_rad_s: p,
            ..*base
        }
    }

    #[test]
    fn places_are_those_of_turned_bodies_and_velocities_their_differences() {
        let pitch = HingeGeometry {
            parent: 0,
            child: 1,
            axis: [0.0, 1.0, 0.0],
            anchor_m: [0.0, 0.0, 0.07],
        };
        let wheel = |body, x, y| CarriedWheel {
            body,
            centre_m: [x, y, 0.07],
        };
        let linkage = Linkage::new(&[pitch], &[wheel(1, 0.3, 0.2), wheel(0, -0.3, 0.2)]).expect("a tree");
        let at = |t: f64| {
            let base = Attitude {
                nose_up_rad: 0.2 + 0.5 * t,
                left_up_rad: 0.1 - 0.3 * t,
                nose_up_rad_s: 0.0,
                left_up_rad_s: 0.0,
            };
            let mut hinges = [0.0; MAX_HINGES];
            hinges[0] = -0.3 + 0.7 * t;
            (base, hinges)
        };
        let (base, hinges) = at(0.0);
        let [x, y, z] = axes_of(&base);
        assert!((z[2] - cross(&x, &y)[2]).abs() < 1e-12 && dot(&x, &y).abs() < 1e-12);
        let base = with_rates(&base, 0.5, -0.3);
        let mut rates = [0.0; MAX_HINGES];
        rates[0] = 0.7;
        let now = linkage.places(&base, &hinges, &rates);
        let h = 1e-6;
        let none = [0.0; MAX_HINGES];
        let place = |t: f64| {
            let (base, hinges) = at(t);
            linkage.places(&base, &hinges, &none)
        };
        let (before, after) = (place(-h), place(h));
        for i in 0..2 {
            for k in 0..3 {
                let difference = (after[i].centre_m[k] - before[i].centre_m[k]) / (2.0 * h);
                // Without the gyro about z the base's rotation about its own z axis is left out: a product of two small
                // angles.
                assert!(
                    (now[i].velocity_m_s[k] - difference).abs() < 0.02,
                    "{i} {k}: {} {difference}",
                    now[i].velocity_m_s[k]
                );
            }
        }
        // 0.3 m in front of the joint, 0.2 m to the left, turned by the hinge.
        let (s, c) = 0.3_f64.sin_cos();
        let arm = turned(&[x, y, z], &[0.3 * c, 0.2, 0.07 + 0.3 * s]);
        for k in 0..3 {
            assert!((now[0].centre_m[k] - arm[k]).abs() < 1e-12);
        }
    }
}
