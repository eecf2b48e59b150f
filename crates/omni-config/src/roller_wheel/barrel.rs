//! The shape of a roller: a barrel with rounded edges.

/// A body of revolution about its own axis, crowned so that it lies against a circle (or the cylinder of a mecanum
/// wheel) from inside, with flat ends and rounded edges.
///
/// It is the hull of balls along the axis: at `a` from the middle the radius is `P - sqrt(q^2 + c^2 a^2)`, with the
/// profile's radius P, q = P - radius and c the cosine of the roller angle. With P the radius of the wheel these balls
/// all touch its rim from inside. The ends are cut off at the half length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Barrel {
    radius_m: f64,
    half_length_m: f64,
    edge_m: f64,
    profile: Profile,
    /// Sine of the largest angle between a touching plane and the axis: beyond it the plane touches the edge.
    end_sine: f64,
    /// Radius of the flat end.
    end_radius_m: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Profile {
    radius_m: f64,
    cos: f64,
}

impl Profile {
    /// Where a plane touches whose outward normal leans by an angle of this sine towards the axis: along the axis and
    /// away from it \[m\], on a barrel of `radius_m` that is thinner by `less_m` all over.
    #[inline] // and what calls it: a simulation asks for every roller, every step
    fn touch(self, sine: f64, radius_m: f64, less_m: f64) -> [f64; 2] {
        let q = self.radius_m - radius_m;
        let root = (self.cos * self.cos - sine * sine).sqrt();
        let along = q * sine / (self.cos * root);
        // P - sqrt(q^2 + c^2 a^2), where the root is q c / root; written so that a flat profile's
        // large P rounds nothing away.
        let ball = radius_m - less_m - q * sine * sine / ((self.cos + root) * root);
        [along + ball * sine, ball * (1.0 - sine * sine).sqrt()]
    }
}

/// Part of a roller's radius by which its edges are rounded.
pub(super) const EDGE: f64 = 0.05;

impl Barrel {
    /// A barrel of a largest radius and half a length whose profile follows a rim of radius `rim_m`
    /// seen at a roller angle of cosine `cos`, or whose ends are thinner than its middle by
    /// `crown_m`. None if no barrel is that long.
    pub(super) fn new(
        radius_m: f64,
        half_length_m: f64,
        [rim_m, cos]: [f64; 2],
        crown_m: Option<f64>,
    ) -> Option<Self> {
        let rim = Profile { radius_m: rim_m, cos };
        // A thin roller that follows the rim ends in a point before it is long; a straighter one goes on.
        let follows = Self::crown(rim, radius_m, half_length_m);
        let Some(crown) = crown_m.filter(|crown| follows.is_none_or(|most| *crown < most)) else {
            return Self::with(rim, radius_m, half_length_m);
        };
        // The larger the profile's radius, the less the crown: 1/P from the rim's down to 0.
        let at = |curvature: f64| Profile {
            radius_m: 1.0 / curvature,
            cos,
        };
        let (mut flatter, mut rounder) = (1e-6 / rim_m, 1.0 / rim_m);
        for _ in 0..100 {
            let middle = 0.5 * (flatter + rounder);
            match Self::crown(at(middle), radius_m, half_length_m) {
                Some(found) if found < crown => flatter = middle,
                _ => rounder = middle,
            }
        }
        Self::with(at(flatter), radius_m, half_length_m)
    }

    fn with(profile: Profile, radius_m: f64, half_length_m: f64) -> Option<Self> {
        let edge_m = EDGE * radius_m;
        let end_sine = Self::sine_at(profile, radius_m, half_length_m - edge_m, edge_m)?;
        let [_, end_radius_m] = profile.touch(end_sine, radius_m, edge_m);
        (end_radius_m > 0.0).then_some(Self {
            radius_m,
            half_length_m,
            edge_m,
            profile,
            end_sine,
            end_radius_m,
        })
    }

    /// Difference of the profile's radius between middle and ends \[m\].
    fn crown(profile: Profile, radius_m: f64, half_length_m: f64) -> Option<f64> {
        let sine = Self::sine_at(profile, radius_m, half_length_m, 0.0)?;
        let [_, end] = profile.touch(sine, radius_m, 0.0);
        (end > 0.0).then_some(radius_m - end)
    }

    /// Sine of the angle at which a plane touches at `along_m` from the middle.
    fn sine_at(profile: Profile, radius_m: f64, along_m: f64, less_m: f64) -> Option<f64> {
        if along_m <= 0.0 {
            return None;
        }
        let (mut low, mut high) = (0.0, profile.cos * (1.0 - 1e-9));
        if profile.touch(high, radius_m, less_m)[0] < along_m {
            return None;
        }
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            if profile.touch(middle, radius_m, less_m)[0] < along_m {
                low = middle;
            } else {
                high = middle;
            }
        }
        Some(low)
    }

    /// Largest radius \[m\].
    #[must_use]
    #[inline]
    pub fn radius_m(&self) -> f64 {
        self.radius_m
    }

    /// Half of the length along the axis \[m\].
    #[must_use]
    #[inline]
    pub fn half_length_m(&self) -> f64 {
        self.half_length_m
    }

    /// Radius of the rounding of the edges \[m\]: what [`Barrel::core_support`] leaves out all around.
    #[must_use]
    #[inline]
    pub fn edge_m(&self) -> f64 {
        self.edge_m
    }

    /// The point of the core farthest in a direction, along the axis and away from it \[m\], for a
    /// direction at an angle to the plane across the axis of sine `sine`, -1 to 1. The barrel is
    /// all that is within [`Barrel::edge_m`] of its core.
    #[must_use]
    #[inline]
    pub fn core_support(&self, sine: f64) -> [f64; 2] {
        if sine.abs() <= self.end_sine {
            self.profile.touch(sine, self.radius_m, self.edge_m)
        } else {
            let end = (self.half_length_m - self.edge_m).copysign(sine);
            [end, self.end_radius_m]
        }
    }

    /// How much thinner the ends are than the middle \[m\], the edges' rounding left aside.
    pub(super) fn crown_m(&self) -> f64 {
        Self::crown(self.profile, self.radius_m, self.half_length_m).unwrap_or(self.radius_m)
    }

    /// How far the barrel reaches from its middle in a direction at an angle to the plane across
    /// the axis of sine `sine`, -1 to 1 \[m\].
    #[must_use]
    #[inline]
    pub fn reach_m(&self, sine: f64) -> f64 {
        let [along, away] = self.core_support(sine);
        along * sine + away * (1.0 - sine * sine).max(0.0).sqrt() + self.edge_m
    }

    /// Sine of the angle up to which a plane touches the crowned part and not an edge.
    pub(super) fn end_sine(&self) -> f64 {
        self.end_sine
    }
}
