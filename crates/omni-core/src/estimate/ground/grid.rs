//! Heights of the ground around the vehicle, in a fixed number of cells.

use crate::Real;

/// Sets of cells, and cells in a set: a cell of the ground belongs into one set, where it takes the place of the oldest.
const SETS: usize = 128;
const WAYS: usize = 4;
/// Radius, in cells, in which a wheel that finds no height below it looks for one.
const REACH: i32 = 3;
/// Cells of its own path that a wheel does not follow.
const OWN_CELLS: u32 = 8;
/// Writer of ground that was there at the start.
const START: u8 = u8::MAX;

/// Place in cells: the whole ones and the rest, 0 up to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Place<R> {
    pub(super) cell: [i32; 2],
    pub(super) rest: [R; 2],
}

impl<R: Real> Place<R> {
    pub(super) fn origin() -> Self {
        let half = R::of(0.5);
        Self {
            cell: [0; 2],
            rest: [half; 2],
        }
    }

    /// This place, moved by so many cells.
    pub(super) fn moved(&self, by: [R; 2]) -> Self {
        let mut place = *self;
        // Beyond what a vehicle reaches from its origin the number of cells is not looked at.
        let most = 1 << 12;
        let offset = R::of(f64::from(most));
        for ((cell, rest), by) in place.cell.iter_mut().zip(&mut place.rest).zip(by) {
            let sum = (*rest + by).limited(-offset, offset) + offset;
            let whole = sum.whole_part();
            *cell = cell.wrapping_add(whole as i32 - most);
            *rest = sum - R::of(f64::from(whole));
        }
        place
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Cell<R> {
    x: i16,
    y: i16,
    /// Travel at which it was last written, in cells.
    travel: u32,
    writer: u8,
    /// Writings that it is the mean of; 0 where it is free.
    count: u8,
    height_m: R,
    variance_m2: R,
}

/// What is known of the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(serialize = "R: serde::Serialize", deserialize = "R: serde::Deserialize<'de>"))
)]
pub(super) struct Grid<R> {
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    sets: [[Cell<R>; WAYS]; SETS],
    /// Ground below the vehicle at the start: corners \[cells\], height at the origin and slopes \[m per cell\].
    corners: [[i32; 2]; 2],
    plane_m: [R; 3],
}

/// A height that was found, and its variance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Found<R> {
    pub(super) height_m: R,
    pub(super) variance_m2: R,
    /// It was below the wheel, not beside it.
    pub(super) below: bool,
}

/// Who looks: a wheel does not follow what it wrote itself just now.
#[derive(Clone, Copy)]
pub(super) struct Who {
    pub(super) wheel: usize,
    pub(super) travel: u32,
}

impl<R: Real> Grid<R> {
    pub(super) const EMPTY: Self = Self {
        sets: [[Cell {
            x: 0,
            y: 0,
            travel: 0,
            writer: 0,
            count: 0,
            height_m: R::ZERO,
            variance_m2: R::ZERO,
        }; WAYS]; SETS],
        corners: [[0; 2]; 2],
        plane_m: [R::ZERO; 3],
    };

    /// Ground below the vehicle at the start: even between these corners \[cells\].
    pub(super) fn start(&mut self, corners: [[i32; 2]; 2], plane_m: [R; 3]) {
        (self.corners, self.plane_m) = (corners, plane_m);
    }

    fn set(x: i16, y: i16) -> usize {
        // Neighbours fall into different sets: 16 by 8 of them fill all.
        let (x, y) = (x as u16 as usize, y as u16 as usize);
        (x.wrapping_add(y.wrapping_mul(16))
            .wrapping_add((y >> 3).wrapping_mul(5)))
            % SETS
    }

    fn at(&self, cell: [i32; 2], who: Who) -> Option<(R, R)> {
        let [x, y] = cell.map(|each| each as i16);
        let found = (self.sets.get(Self::set(x, y))?.iter())
            .find(|each| each.count > 0 && each.x == x && each.y == y);
        if let Some(found) = found {
            let own =
                usize::from(found.writer) == who.wheel && who.travel.wrapping_sub(found.travel) < OWN_CELLS;
            return (!own).then_some((found.height_m, found.variance_m2));
        }
        let [low, high] = &self.corners;
        let inside = (cell.iter().zip(low).zip(high))
            .all(|((each, low), high)| each >= low && each <= high && low < high);
        inside.then(|| {
            let [height, x, y] = self.plane_m;
            let of = |each: i32| R::of(f64::from(each));
            (height + x * of(cell[0]) + y * of(cell[1]), R::zero())
        })
    }

    /// Height at a place: between the four nearest cells, or else of known cells within reach.
    pub(super) fn read(&self, place: &Place<R>, who: Who, reach: bool) -> Option<Found<R>> {
        let half = R::of(0.5);
        // Heights stand for the middles of cells.
        let place = place.moved([-half; 2]);
        let ([x, y], [a, b]) = (place.cell, place.rest);
        let one = R::one();
        let corners = [
            ([0, 0], (one - a) * (one - b)),
            ([1, 0], a * (one - b)),
            ([0, 1], (one - a) * b),
            ([1, 1], a * b),
        ];
        let mut sum = Sum::new();
        for ([p, q], weight) in corners {
            if let Some(found) = self.at([x.wrapping_add(p), y.wrapping_add(q)], who) {
                sum.add(found, weight);
            }
        }
        if sum.weight > R::of(0.3) {
            return Some(sum.found(true));
        }
        if !reach {
            return None;
        }
        let mut sum = Sum::new();
        for p in -REACH..=REACH + 1 {
            for q in -REACH..=REACH + 1 {
                if let Some(found) = self.at([x.wrapping_add(p), y.wrapping_add(q)], who) {
                    let (dx, dy) = (R::of(f64::from(p)) - a, R::of(f64::from(q)) - b);
                    let near = dx * dx + dy * dy + R::of(0.25);
                    sum.add(found, one / (near * near));
                }
            }
        }
        (sum.weight > R::zero()).then(|| sum.found(false))
    }

    /// A wheel's contact at a place: remembered where nothing is known, and averaged with what the same wheel wrote on its way over the cell.
    pub(super) fn write(&mut self, place: &Place<R>, height_m: R, variance_m2: R, who: Who) {
        let [x, y] = place.cell.map(|each| each as i16);
        let Some(set) = self.sets.get_mut(Self::set(x, y)) else {
            return;
        };
        let writer = if who.wheel < usize::from(START) {
            who.wheel as u8
        } else {
            START
        };
        let known = set
            .iter_mut()
            .find(|each| each.count > 0 && each.x == x && each.y == y);
        if let Some(known) = known {
            if known.writer == writer && who.travel.wrapping_sub(known.travel) <= 1 {
                known.travel = who.travel;
                known.count = known.count.saturating_add(1);
                let part = R::one() / R::of(f64::from(known.count));
                known.height_m += part * (height_m - known.height_m);
            }
            return;
        }
        let age = |each: &Cell<R>| {
            if each.count == 0 {
                u32::MAX
            } else {
                who.travel.wrapping_sub(each.travel)
            }
        };
        if let Some(oldest) = set.iter_mut().max_by_key(|each| age(each)) {
            *oldest = Cell {
                x,
                y,
                travel: who.travel,
                writer,
                count: 1,
                height_m,
                variance_m2,
            };
        }
    }
}

struct Sum<R> {
    weight: R,
    height: R,
    variance: R,
}

impl<R: Real> Sum<R> {
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

    fn found(&self, below: bool) -> Found<R> {
        Found {
            height_m: self.height / self.weight,
            variance_m2: self.variance / self.weight,
            below,
        }
    }
}
