//! The way from one waypoint to the next, as numbers.

use super::piece::PathPiece;
use super::time_law::Phase;
use crate::Real;
use crate::constants::constant_struct;
use crate::shaping::MotionLimits;

/// The segment from one waypoint to the next: its pieces, and the distance along them over time. Made by
/// [`TrajectoryPlanner`](crate::path::TrajectoryPlanner).
///
/// ```
/// use omni_core::path::PathSegment;
/// static ROOM: [PathSegment<f32>; 4] = [PathSegment::EMPTY; 4];
/// assert_eq!(ROOM[0].length_m(), 0.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct PathSegment<R> {
    pub(super) start_s: R,
    pub(super) duration_s: R,
    pub(super) length_m: R,
    /// Its pieces: the first and how many.
    pub(super) first: u16,
    pub(super) count: u16,
    pub(super) on_the_spot: bool,
    /// Its limits, and its speeds at both ends.
    pub(super) allowed: MotionLimits<R>,
    pub(super) ends: [R; 2],
    pub(super) phases: [Phase<R>; 7],
}

constant_struct!(PathSegment<R> {
    start_s: R,
    duration_s: R,
    length_m: R,
    first: u16,
    count: u16,
    on_the_spot: bool,
    allowed: MotionLimits<R>,
    ends: [R; 2],
    phases: [Phase<R>; 7],
});

impl<R: Real> PathSegment<R> {
    /// Nothing: what room for segments is filled with.
    ///
    /// ```
    /// use omni_core::path::PathSegment;
    /// let room = [PathSegment::<f64>::EMPTY; 4];
    /// assert_eq!(room.len(), 4);
    /// ```
    pub const EMPTY: Self = Self {
        start_s: R::ZERO,
        duration_s: R::ZERO,
        length_m: R::ZERO,
        first: 0,
        count: 0,
        on_the_spot: false,
        allowed: MotionLimits {
            velocity: R::ZERO,
            acceleration: R::ZERO,
            deceleration: R::ZERO,
            jerk: R::ZERO,
        },
        ends: [R::ZERO; 2],
        phases: [Phase::EMPTY; 7],
    };

    /// When it begins \[s\].
    #[must_use]
    pub fn start_s(&self) -> R {
        self.start_s
    }

    /// Its length \[m\]; \[rad\] for a turn on the spot, 0 for waiting.
    #[must_use]
    pub fn length_m(&self) -> R {
        self.length_m
    }

    /// Limits of the plan along its path \[m/s, m/s^2, m/s^3\]; in rad for a turn on the spot.
    #[must_use]
    pub fn limits(&self) -> MotionLimits<R> {
        self.allowed
    }

    pub(super) fn pieces_of<'a>(&self, pieces: &'a [PathPiece<R>]) -> &'a [PathPiece<R>] {
        let first = usize::from(self.first);
        pieces.get(first..first + usize::from(self.count)).unwrap_or(&[])
    }
}
