//! Linear systems of a step: the tree's equations, what acts on single bodies, and each wheel's row.

use super::contact::LinearForm;
use super::linear::{Matrix, Vector, add, add_outer, add_square, dot};
use super::spin::Spin;
use super::tree::{FREE, Twist};

/// A linear system `matrix velocities = right`: of the generalised velocities without contacts, or what contacts and
/// wheels add for the twist of one body.
#[derive(Clone, Copy)]
pub(super) struct System<const N: usize> {
    pub(super) matrix: Matrix<N>,
    pub(super) right: Vector<N>,
    /// Whether every force works along the line that it follows: of the matrix only the upper half counts then.
    pub(super) symmetric: bool,
}

impl<const N: usize> System<N> {
    pub(super) const ZERO: Self = Self {
        matrix: [[0.0; N]; N],
        right: [0.0; N],
        symmetric: false,
    };

    /// Adds an impulse `-gain (line + offset)` along another line.
    #[inline(always)]
    pub(super) fn add_force(&mut self, gain: f64, works: &Vector<N>, line: &Vector<N>, offset: f64) {
        self.add_outer(gain, works, line);
        add(&mut self.right, -gain * offset, works);
    }

    #[inline(always)]
    fn add_outer(&mut self, gain: f64, works: &Vector<N>, line: &Vector<N>) {
        if self.symmetric {
            add_square(&mut self.matrix, gain, line);
        } else {
            add_outer(&mut self.matrix, gain, works, line);
        }
    }
}

/// A wheel's row of the system: `diagonal spin + row . twist = right`.
#[derive(Clone, Copy)]
pub(super) struct WheelRow {
    pub(super) diagonal: f64,
    pub(super) row: Twist,
    right: f64,
}

impl WheelRow {
    #[inline(always)]
    pub(super) fn new(spin: &Spin) -> Self {
        let mut own = Self {
            diagonal: spin.inertia_kg_m2,
            row: [0.0; FREE],
            right: spin.inertia_kg_m2 * spin.free_rad_s,
        };
        if spin.damper > 0.0 {
            own.diagonal += spin.damper;
            add(&mut own.row, -spin.damper, &spin.carried());
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
}

/// A wheel's row and the equations of its carrier.
pub(super) struct WheelSystem<'a> {
    pub(super) carrier: &'a mut System<FREE>,
    pub(super) row: WheelRow,
    /// What the spin does to the carrier; the row itself, if the carrier's equations are symmetric.
    column: Twist,
    /// Does it do anything?
    coupled: bool,
}

impl<'a> WheelSystem<'a> {
    #[inline(always)]
    pub(super) fn new(spin: &Spin, carrier: &'a mut System<FREE>) -> Self {
        let row = WheelRow::new(spin);
        let coupled = spin.damper > 0.0;
        if coupled {
            carrier.add_force(spin.damper, &spin.carried(), &spin.carried(), 0.0);
        }
        Self {
            carrier,
            row,
            column: row.row,
            coupled,
        }
    }

    /// Adds a force `-gain (line + offset)` that works along another line.
    #[inline(always)]
    pub(super) fn add_force(&mut self, gain: f64, works: &LinearForm, line: &LinearForm, offset: f64) {
        self.carrier.add_force(gain, &works.row, &line.row, offset);
        if line.lever_m != 0.0 {
            if !self.carrier.symmetric {
                add(&mut self.column, gain * line.lever_m, &works.row);
            }
            self.coupled = true;
        }
        if works.lever_m != 0.0 {
            add(&mut self.row.row, gain * works.lever_m, &line.row);
            self.row.diagonal += gain * works.lever_m * line.lever_m;
            self.row.right -= gain * works.lever_m * offset;
        }
    }

    /// Adds the one line along which a wheel sticks that nothing else holds, in closed form: large numbers would cancel
    /// in [`WheelSystem::eliminate`].
    #[inline(always)]
    pub(super) fn roll_on(&mut self, slip: &LinearForm, stick: f64) {
        let row = &mut self.row;
        let (lever_m, free_m_s) = (slip.lever_m, slip.lever_m * row.right / row.diagonal);
        let gain = 1.0 / (1.0 / stick + lever_m * lever_m / row.diagonal);
        self.carrier.add_force(gain, &slip.row, &slip.row, free_m_s);
        add(&mut row.row, stick * lever_m, &slip.row);
        row.diagonal += stick * lever_m * lever_m;
    }

    /// Takes the spin out of the carrier's equations.
    #[inline(always)]
    pub(super) fn eliminate(&mut self) {
        if self.coupled {
            let (inverse, row) = (1.0 / self.row.diagonal, &self.row);
            let column = if self.carrier.symmetric {
                &row.row
            } else {
                &self.column
            };
            self.carrier.add_outer(-inverse, column, &row.row);
            add(&mut self.carrier.right, -inverse * row.right, column);
        }
    }
}
