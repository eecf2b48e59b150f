//! The ground under a vehicle that travels straight: edges, closed cells and friction along parallel tracks.

use crate::Point;
use crate::ground::Ground;

/// Distance between two tracks \[cells\]: every cell under the vehicle is on one.
pub(crate) const TRACKS: f64 = 0.7;

/// A strip of the ground that a vehicle travels over, in cells.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Strip {
    /// A place on its middle line.
    pub(crate) place: Point,
    /// Unit vector of travel.
    pub(crate) along: Point,
    /// From and to along the way, from that place.
    pub(crate) from: f64,
    pub(crate) to: f64,
    /// How far the vehicle reaches to the left and to the right of that line.
    pub(crate) left: f64,
    pub(crate) right: f64,
    /// And how far beyond that it is kept clear.
    pub(crate) clearance: f64,
}

/// An edge that a track crosses.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Riser {
    /// How far along the way \[cells\].
    pub(crate) at: f64,
    /// How much the ground rises there, in the direction of travel \[m\].
    pub(crate) rise_m: f64,
    /// The cell whose border it is, and whether that is the one along x.
    pub(crate) cell: usize,
    pub(crate) x: bool,
    /// Its track.
    pub(crate) track: usize,
}

/// What a strip has.
#[derive(Clone, Debug, Default)]
pub(crate) struct Scan {
    /// Track by track.
    pub(crate) risers: Vec<Riser>,
    /// Tracks under the vehicle itself: from and to.
    pub(crate) under: [usize; 2],
    /// On which track closed ground is, from where to where along the way \[cells\].
    closed: Vec<(usize, f64, f64)>,
    /// Distance between two tracks \[cells\], and where the first is, to the left.
    spacing: f64,
    first: f64,
    /// How many tracks there are.
    tracks: usize,
    /// On which track from where along the way \[cells\] which friction is, up to the next of the track.
    frictions: Vec<(usize, f64, f64)>,
}

impl Scan {
    pub(crate) fn new(ground: &Ground, strip: &Strip) -> Self {
        let width = strip.left + strip.right + 2.0 * strip.clearance;
        let tracks = (width / TRACKS).ceil().max(1.0) as usize + 1;
        let spacing = width / (tracks - 1) as f64;
        let off = |track: usize| track as f64 * spacing - strip.right - strip.clearance;
        let mut scan = Self {
            tracks,
            under: [tracks, 0],
            spacing,
            first: off(0),
            ..Self::default()
        };
        for track in 0..tracks {
            let aside = off(track);
            if aside >= -strip.right && aside <= strip.left {
                scan.under = [scan.under[0].min(track), track];
            }
            scan.track(ground, strip, track, aside);
        }
        scan
    }

    /// What a strip has that lies within this one, with the tracks beside it.
    pub(crate) fn within(&self, strip: &Strip) -> Self {
        let beside = strip.clearance + self.spacing;
        let aside = |track: usize| self.first + track as f64 * self.spacing;
        let near = |track: usize| (-strip.right - beside..=strip.left + beside).contains(&aside(track));
        let along = |at: f64| at <= strip.to && at >= strip.from;
        let mut scan = Self {
            tracks: self.tracks,
            under: [self.tracks, 0],
            spacing: self.spacing,
            first: self.first,
            ..Self::default()
        };
        let risers = self.risers.iter();
        scan.risers
            .extend(risers.filter(|riser| near(riser.track) && along(riser.at)));
        let closed = self.closed.iter();
        scan.closed.extend(closed.filter(|(track, ..)| near(*track)));
        let frictions = self.frictions.iter();
        scan.frictions
            .extend(frictions.filter(|(track, ..)| near(*track)));
        for track in 0..self.tracks {
            if (-strip.right..=strip.left).contains(&aside(track)) {
                scan.under = [scan.under[0].min(track), track];
            }
        }
        scan
    }

    /// Goes from cell to cell (Amanatides and Woo 1987).
    fn track(&mut self, ground: &Ground, strip: &Strip, track: usize, aside: f64) {
        let grid = ground.grid;
        let [dx, dy] = strip.along;
        let begin = [
            strip.place[0] - aside * dy + strip.from * dx,
            strip.place[1] + aside * dx + strip.from * dy,
        ];
        let length = strip.to - strip.from;
        let mut cell = begin.map(|part| part.floor() as isize);
        let step = strip.along.map(|part| if part > 0.0 { 1_isize } else { -1 });
        // How far it is to the next border along x and y, and from one to the next.
        let mut next = [0, 1].map(|k| {
            let border = cell[k] as f64 + if step[k] > 0 { 1.0 } else { 0.0 };
            if strip.along[k] == 0.0 {
                f64::INFINITY
            } else {
                (border - begin[k]) / strip.along[k]
            }
        });
        let between = strip.along.map(|part| 1.0 / part.abs());
        let inside = |cell: [isize; 2]| {
            let [x, y] = cell;
            let inside = x >= 0 && y >= 0 && x < grid.columns as isize && y < grid.rows as isize;
            inside.then(|| grid.index(x as usize, y as usize))
        };
        let mut done = 0.0;
        let mut was_inside = false;
        loop {
            let here = inside(cell);
            let entered = strip.from + done;
            let is_open = here.is_some_and(|index| !ground.closed[index]);
            if let Some(index) = here.filter(|_| is_open) {
                let friction = ground.friction[index];
                let last = self.frictions.last();
                if last.is_none_or(|last| last.0 != track || last.2 != friction) {
                    self.frictions.push((track, entered, friction));
                }
            }
            was_inside |= here.is_some();
            if was_inside && here.is_none() {
                // It does not come back.
                self.closed.push((track, entered, f64::INFINITY));
                break;
            }
            let k = usize::from(next[1] < next[0]);
            done = next[k];
            if !is_open {
                let left = strip.from + done;
                match self.closed.last_mut() {
                    Some(last) if last.0 == track && last.2 == entered => last.2 = left,
                    _ => self.closed.push((track, entered, left)),
                }
            }
            if done > length {
                break;
            }
            next[k] += between[k];
            let before = cell;
            cell[k] += step[k];
            if let (Some(one), Some(other)) = (here, inside(cell)) {
                // The border belongs to the cell of lower index.
                let (low, sign) = if step[k] > 0 { (one, 1.0) } else { (other, -1.0) };
                let rises = if k == 0 {
                    &ground.rise_x_m
                } else {
                    &ground.rise_y_m
                };
                if rises[low] != 0.0 {
                    self.risers.push(Riser {
                        at: strip.from + done,
                        rise_m: sign * rises[low],
                        cell: low,
                        x: k == 0,
                        track,
                    });
                }
            }
            debug_assert!(before != cell);
        }
    }

    /// The least friction between two places along the way.
    pub(crate) fn friction(&self, from: f64, to: f64) -> f64 {
        let mut least = f64::INFINITY;
        for (number, (track, begin, friction)) in self.frictions.iter().enumerate() {
            let next = self.frictions.get(number + 1);
            let end = next
                .filter(|next| next.0 == *track)
                .map_or(f64::INFINITY, |next| next.1);
            if *begin < to && end > from {
                least = least.min(*friction);
            }
        }
        least
    }

    /// Is there a closed cell between two places along the way?
    pub(crate) fn is_closed(&self, from: f64, to: f64) -> bool {
        self.closed
            .iter()
            .any(|(_, begin, end)| *end > from && *begin < to)
    }

    /// The greatest rise and fall between two places along the way \[m\]: edges of one sign within
    /// `merge` cells of each other are one.
    pub(crate) fn up_and_down(&self, from: f64, to: f64, merge: f64) -> [f64; 2] {
        let mut most = [0.0_f64; 2];
        for (first, riser) in self.risers.iter().enumerate() {
            if riser.at < from || riser.at > to {
                continue;
            }
            let mut sum = [0.0; 2];
            for other in &self.risers[first..] {
                if other.track != riser.track || other.at > riser.at + merge || other.at > to {
                    break;
                }
                sum[usize::from(other.rise_m < 0.0)] += other.rise_m.abs();
            }
            most = [most[0].max(sum[0]), most[1].max(sum[1])];
        }
        most
    }

    /// Is it the same edge over the vehicle's whole width? Each track under it rises and falls
    /// there by half of what any does, at least.
    pub(crate) fn is_whole(&self, from: f64, to: f64) -> bool {
        let mut sums = vec![[0.0_f64; 2]; self.under[1] + 1];
        for riser in &self.risers {
            if riser.at >= from && riser.at <= to && riser.track < sums.len() {
                sums[riser.track][usize::from(riser.rise_m < 0.0)] += riser.rise_m.abs();
            }
        }
        let under = &sums[self.under[0].min(sums.len())..];
        [0, 1].into_iter().all(|sign| {
            let most = under.iter().map(|sum| sum[sign]).fold(0.0, f64::max);
            under.iter().all(|sum| sum[sign] >= 0.5 * most)
        })
    }

    /// By how much the edges between two places are slanted to the vehicle's front: the slope of
    /// where they are over how far aside, weighted by their heights, as the tracks under the
    /// vehicle find it. 0 if there are too few tracks.
    pub(crate) fn slant(&self, from: f64, to: f64) -> f64 {
        let tracks = self.under[1] + 1;
        let mut sums = vec![[0.0_f64; 2]; tracks];
        for riser in &self.risers {
            if riser.at >= from && riser.at <= to && riser.track < tracks {
                let weight = riser.rise_m.abs();
                sums[riser.track] = [
                    sums[riser.track][0] + weight,
                    sums[riser.track][1] + weight * riser.at,
                ];
            }
        }
        let (mut count, mut x, mut y, mut xx, mut xy) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (track, [weight, at]) in sums.into_iter().enumerate() {
            if weight > 0.0 {
                let (aside, place) = (track as f64 * self.spacing, at / weight);
                count += 1.0;
                x += aside;
                y += place;
                xx += aside * aside;
                xy += aside * place;
            }
        }
        let spread = count * xx - x * x;
        if spread <= 0.0 {
            0.0
        } else {
            (count * xy - x * y) / spread
        }
    }
}
