//! Linear systems of a step: the tree's equations, what acts on single bodies, and each wheel's row.

use super::contact::LinearForm;
use super::linear::{Matrix, Vector, add, add_outer, dot};
use super::spin::Spin;
use super::tree::{FREE, Twist};

/// A linear system `matrix velocities = right`: of the generalised velocities without contacts, or what contacts and
/// wheels add for the twist of one body.
#[derive(Clone, Copy)]
pub(super) struct System<const N: usize> {
    pub(super) matrix: Matrix<N>,
    pub(super) right: Vector<N>,
}

impl<const N: usize> System<N> {
    pub(super) const ZERO: Self = Self {
        matrix: [[0.0; N]; N],
        right: [0.0; N],
    };

    /// Adds an impulse `-gain (line + offset)` along another line.
    #[inline(always)]
    pub(super) fn add_force(&mut self, gain: f64, works: &Vector<N>, line: &Vector<N>, offset: f64) {
        add_outer(&mut self.matrix, gain, works, line);
        add(&mut self.right, -gain * offset, works);
    }
}

/// A wheel's row of the system: `diagonal spin + row . twist = right`, and what its spin does to its carrier.
#[derive(Clone, Copy)]
pub(super) struct WheelRow {
    pub(super) diagonal: f64,
    pub(super) row: Twist,
    pub(super) column: Twist,
    right: f64,
    pub(super) coupled: bool,
}

impl WheelRow {
    #[inline(always)]
    pub(super) fn new(spin: &Spin) -> Self {
        let mut own = Self {
            diagonal: spin.inertia_kg_m2,
            row: [0.0; FREE],
            column: [0.0; FREE],
            right: spin.inertia_kg_m2 * spin.free_rad_s,
            coupled: false,
        };
        if spin.damper > 0.0 {
            own.diagonal += spin.damper;
            add(&mut own.row, -spin.damper, &spin.carried);
            add(&mut own.column, -spin.damper, &spin.carried);
            own.coupled = true;
        }
        own
    }

    #[inline(always)]
    pub(super) fn spin(&self, carrier: &Twist) -> f64 {
        self.response(self.right, carrier)
    }

    /// What an impulse does to the spin: it turns the wheel by a lever, and its carrier by a twist.
    #[inline(always)]
    pub(super) fn response(&self, lever_m: f64, carrier: &Twist) -> f64 {
        (lever_m - dot(&self.row, carrier)) / self.diagonal
    }

    /// Adds a force `-gain (line + offset)` that works along another line.
    #[inline(always)]
    pub(super) fn add_force(
        &mut self,
        carrier: &mut System<FREE>,
        gain: f64,
        works: &LinearForm,
        line: &LinearForm,
        offset: f64,
    ) {
        carrier.add_force(gain, &works.row, &line.row, offset);
        if line.lever_m != 0.0 {
            add(&mut self.column, gain * line.lever_m, &works.row);
            self.coupled = true;
        }
        if works.lever_m != 0.0 {
            add(&mut self.row, gain * works.lever_m, &line.row);
            self.diagonal += gain * works.lever_m * line.lever_m;
            self.right -= gain * works.lever_m * offset;
        }
    }

    /// Adds the one contact of a wheel that sticks and that nothing else holds, in closed form: large numbers would
    /// cancel in [`WheelRow::eliminate`].
    #[inline(always)]
    pub(super) fn roll_on(&mut self, carrier: &mut System<FREE>, slip: &LinearForm, stick: f64) {
        let (lever_m, free_m_s) = (slip.lever_m, slip.lever_m * self.right / self.diagonal);
        let gain = 1.0 / (1.0 / stick + lever_m * lever_m / self.diagonal);
        carrier.add_force(gain, &slip.row, &slip.row, free_m_s);
        add(&mut self.row, stick * lever_m, &slip.row);
        self.diagonal += stick * lever_m * lever_m;
    }

    /// Takes the spin out of the carrier's equations.
    #[inline(always)]
    pub(super) fn eliminate(&self, carrier: &mut System<FREE>) {
        if self.coupled {
            let inverse = 1.0 / self.diagonal;
            add_outer(&mut carrier.matrix, -inverse, &self.column, &self.row);
            add(&mut carrier.right, -inverse * self.right, &self.column);
        }
    }
}
