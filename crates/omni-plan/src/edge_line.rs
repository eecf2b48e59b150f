//! A straight edge: its middle, its normal and its length.

use crate::Point;

/// No line.
pub(crate) const NONE: u32 = u32::MAX;

/// A straight edge.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgeLine {
    /// Its middle, in cells from the grid's corner.
    pub(crate) middle: Point,
    /// Unit vector uphill.
    pub(crate) normal: Point,
    /// Half of its length [cells].
    pub(crate) half_length: f64,
}

impl EdgeLine {
    /// Unit vector along it: uphill is on its left.
    pub(crate) fn along(&self) -> Point {
        [self.normal[1], -self.normal[0]]
    }

    /// A place on it, so far from its middle [cells].
    pub(crate) fn place(&self, along: f64) -> Point {
        let [x, y] = self.along();
        [self.middle[0] + along * x, self.middle[1] + along * y]
    }
}
