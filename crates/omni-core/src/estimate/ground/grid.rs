//! Heights of the ground around the vehicle, in a fixed number of cells.

use crate::Real;
use crate::sum::Sum;

/// Sets of cells, and cells per set. Each cell of the ground belongs to one set, in which it replaces the oldest cell.
const SETS: usize = 128;
const CELLS_PER_SET: usize = 4;
/// A wheel does not use the heights that it recorded itself over this distance \[cells\].
const OWN_CELLS: u32 = 8;
/// Least weight of the four nearest cells for a height below a wheel.
const LEAST_WEIGHT: f64 = 0.3;
/// The wheel that recorded ground is none of the first 255.
const OTHER_WHEEL: u8 = u8::MAX;

/// Position in cells: the whole part, and the rest from 0 up to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct GridPosition<R> {
    pub(super) cell: [i32; 2],
    rest: [R; 2],
}

impl<R: Real> GridPosition<R> {
    /// The middle of the cell at the origin.
    fn origin() -> Self {
        let half = R::of(0.5);
        Self {
            cell: [0; 2],
            rest: [half; 2],
        }
    }

    /// This position, moved by so many cells: 4096 at most in each direction.
    pub(super) fn moved(&self, by: [R; 2]) -> Self {
        let mut position = *self;
        let most = 1 << 12;
        let offset = R::of(f64::from(most));
        for ((cell, rest), by) in position.cell.iter_mut().zip(&mut position.rest).zip(by) {
            let sum = (*rest + by).limited(-offset, offset) + offset;
            let whole = sum.whole_part();
            *cell = cell.wrapping_add(whole as i32 - most);
            *rest = sum - R::of(f64::from(whole));
        }
        position
    }
}

/// Path of the vehicle over the grid, whose axes are those of the heading at the start.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Track<R> {
    pub(super) position: GridPosition<R>,
    /// Heading relative to the start \[rad\].
    pub(super) heading: Sum<R>,
    /// Distance travelled \[cells\]: the whole part, which wraps, and the rest.
    pub(super) travelled: u32,
    travelled_rest: R,
}

impl<R: Real> Track<R> {
    pub(super) fn start() -> Self {
        Self {
            position: GridPosition::origin(),
            heading: Sum::of(R::zero()),
            travelled: 1 << 16,
            travelled_rest: R::zero(),
        }
    }

    /// Moves by a displacement in the axes of a world in which the yaw is `yaw_rad` \[m\].
    pub(super) fn move_by(&mut self, [wx, wy]: [R; 2], yaw_rad: R, cells_per_m: R) {
        let (sin, cos) = (yaw_rad - self.heading.total).sine_cosine();
        let [x, y] = [cos * wx + sin * wy, cos * wy - sin * wx];
        self.position = self.position.moved([x * cells_per_m, y * cells_per_m]);
    }

    pub(super) fn turn_by(&mut self, angle_rad: R) {
        self.heading = self.heading.plus(angle_rad);
    }

    /// Adds a distance \[cells\].
    pub(super) fn travel(&mut self, cells: R) {
        let sum = (self.travelled_rest + cells).limited(R::zero(), R::of(1e6));
        let whole = sum.whole_part();
        self.travelled = self.travelled.wrapping_add(whole);
        self.travelled_rest = sum - R::of(f64::from(whole));
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Cell<R> {
    x: i16,
    y: i16,
    /// Distance travelled at its last record \[cells\].
    travelled: u32,
    wheel: u8,
    /// Number of heights in its mean; 0 if it is free.
    count: u8,
    height_m: R,
    variance_m2: R,
}

/// Heights of the ground: recorded ones, and an even start below the vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(serialize = "R: serde::Serialize", deserialize = "R: serde::Deserialize<'de>"))
)]
pub(super) struct HeightGrid<R> {
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    sets: [[Cell<R>; CELLS_PER_SET]; SETS],
    /// Ground below the vehicle at the start: corners \[cells\], height at the origin and slopes \[m per cell\].
    corners: [[i32; 2]; 2],
    plane_m: [R; 3],
}

/// A height of the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct GroundHeight<R> {
    pub(super) height_m: R,
    pub(super) variance_m2: R,
}

/// A wheel over the grid, after a distance travelled \[cells\]. It does not use the heights that it has just recorded.
#[derive(Clone, Copy)]
pub(super) struct Visit {
    pub(super) wheel: usize,
    pub(super) travelled: u32,
}

impl<R: Real> Cell<R> {
    fn is_at(&self, x: i16, y: i16) -> bool {
        self.count > 0 && self.x == x && self.y == y
    }
}

/// The set of a cell. Neighbours belong to different sets: 16 by 8 of them fill all.
fn set_of(x: i16, y: i16) -> usize {
    let (x, y) = (x as u16 as usize, y as u16 as usize);
    (x.wrapping_add(y.wrapping_mul(16))
        .wrapping_add((y >> 3).wrapping_mul(5)))
        % SETS
}

impl<R: Real> HeightGrid<R> {
    pub(super) const EMPTY: Self = Self {
        sets: [[Cell {
            x: 0,
            y: 0,
            travelled: 0,
            wheel: 0,
            count: 0,
            height_m: R::ZERO,
            variance_m2: R::ZERO,
        }; CELLS_PER_SET]; SETS],
        corners: [[0; 2]; 2],
        plane_m: [R::ZERO; 3],
    };

    /// Even ground below the vehicle at the start, between these corners \[cells\].
    pub(super) fn start(&mut self, corners: [[i32; 2]; 2], plane_m: [R; 3]) {
        (self.corners, self.plane_m) = (corners, plane_m);
    }

    /// The cell is part of the level ground at the start.
    fn is_at_start(&self, cell: [i32; 2]) -> bool {
        let [low, high] = &self.corners;
        (cell.iter().zip(low).zip(high)).all(|((each, low), high)| each >= low && each <= high && low < high)
    }

    /// Height and variance of a cell.
    fn at(&self, cell: [i32; 2], visit: Visit) -> Option<(R, R)> {
        let [x, y] = cell.map(|each| each as i16);
        let recorded = self.sets.get(set_of(x, y))?.iter().find(|each| each.is_at(x, y));
        if let Some(recorded) = recorded {
            let is_own = usize::from(recorded.wheel) == visit.wheel
                && visit.travelled.wrapping_sub(recorded.travelled) < OWN_CELLS;
            return (!is_own).then_some((recorded.height_m, recorded.variance_m2));
        }
        self.is_at_start(cell).then(|| {
            let [height, x, y] = self.plane_m;
            let of = |each: i32| R::of(f64::from(each));
            (height + x * of(cell[0]) + y * of(cell[1]), R::zero())
        })
    }

    /// Height at a position: bilinear between the middles of the four nearest cells.
    pub(super) fn below(&self, position: &GridPosition<R>, visit: Visit) -> Option<GroundHeight<R>> {
        let ([x, y], [a, b]) = lower_middle(position);
        let one = R::one();
        let corners = [
            ([0, 0], (one - a) * (one - b)),
            ([1, 0], a * (one - b)),
            ([0, 1], (one - a) * b),
            ([1, 1], a * b),
        ];
        let mut mean = WeightedMean::new();
        for ([p, q], weight) in corners {
            if let Some(height) = self.at([x.wrapping_add(p), y.wrapping_add(q)], visit) {
                mean.add(height, weight);
            }
        }
        (mean.weight > R::of(LEAST_WEIGHT)).then(|| mean.height())
    }

    /// Records the height of a wheel's contact: in a cell without a height, or in the mean of the same wheel's heights
    /// while it passes over the cell.
    pub(super) fn record(&mut self, position: &GridPosition<R>, height_m: R, variance_m2: R, visit: Visit) {
        if self.is_at_start(position.cell) {
            return;
        }
        let [x, y] = position.cell.map(|each| each as i16);
        let Some(set) = self.sets.get_mut(set_of(x, y)) else {
            return;
        };
        let wheel = if visit.wheel < usize::from(OTHER_WHEEL) {
            visit.wheel as u8
        } else {
            OTHER_WHEEL
        };
        if let Some(known) = set.iter_mut().find(|each| each.is_at(x, y)) {
            if known.wheel == wheel && visit.travelled.wrapping_sub(known.travelled) <= 1 {
                known.travelled = visit.travelled;
                known.count = known.count.saturating_add(1);
                let part = R::one() / R::of(f64::from(known.count));
                known.height_m += part * (height_m - known.height_m);
            }
            return;
        }
        let age = |each: &Cell<R>| match each.count {
            0 => u32::MAX,
            _ => visit.travelled.wrapping_sub(each.travelled),
        };
        if let Some(oldest) = set.iter_mut().max_by_key(|each| age(each)) {
            *oldest = Cell {
                x,
                y,
                travelled: visit.travelled,
                wheel,
                count: 1,
                height_m,
                variance_m2,
            };
        }
    }
}

/// The cell with the nearest lower middle in both directions, and the distance from that middle \[cells\].
fn lower_middle<R: Real>(position: &GridPosition<R>) -> ([i32; 2], [R; 2]) {
    let half = R::of(0.5);
    let moved = position.moved([-half; 2]);
    (moved.cell, moved.rest)
}

struct WeightedMean<R> {
    weight: R,
    height: R,
    variance: R,
}

impl<R: Real> WeightedMean<R> {
    fn new() -> Self {
        let zero = R::zero();
        Self {
            weight: zero,
            height: zero,
            variance: zero,
        }
    }

    fn add(&mut self, (height, variance): (R, R), weight: R) {
        self.weight += weight;
        self.height += weight * height;
        self.variance += weight * variance;
    }

    fn height(&self) -> GroundHeight<R> {
        GroundHeight {
            height_m: self.height / self.weight,
            variance_m2: self.variance / self.weight,
        }
    }
}
