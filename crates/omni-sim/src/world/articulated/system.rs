//! The linear system of a step: the tree's equations, and each wheel's row.

use super::contact::LinearForm;
use super::linear::{Matrix, Vector, add, add_outer, dot};
use super::spin::Spin;

/// The linear system of a step without contacts, `matrix u = right`.
pub(super) struct System<const N: usize> {
    pub(super) matrix: Matrix<N>,
    pub(super) right: Vector<N>,
}

/// A wheel's row of the system: `diagonal spin + row . u = right`, and what its spin does to the tree.
#[derive(Clone, Copy)]
pub(super) struct WheelRow<const N: usize> {
    pub(super) diagonal: f64,
    pub(super) row: Vector<N>,
    pub(super) column: Vector<N>,
    right: f64,
    pub(super) coupled: bool,
}

impl<const N: usize> WheelRow<N> {
    pub(super) fn new(spin: &Spin<N>) -> Self {
        let mut own = Self {
            diagonal: spin.inertia_kg_m2,
            row: [0.0; N],
            column: [0.0; N],
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

    pub(super) fn spin(&self, u: &Vector<N>) -> f64 {
        (self.right - dot(&self.row, u)) / self.diagonal
    }

    /// Adds a force `-gain (line + offset)` that works along another line.
    pub(super) fn add_force(
        &mut self,
        system: &mut System<N>,
        gain: f64,
        works: &LinearForm<N>,
        line: &LinearForm<N>,
        offset: f64,
    ) {
        add_outer(&mut system.matrix, gain, &works.row, &line.row);
        add(&mut system.right, -gain * offset, &works.row);
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

    /// Takes the spin out of the tree's equations.
    pub(super) fn eliminate(&self, system: &mut System<N>) {
        if self.coupled {
            let inverse = 1.0 / self.diagonal;
            add_outer(&mut system.matrix, -inverse, &self.column, &self.row);
            add(&mut system.right, -inverse * self.right, &self.column);
        }
    }
}
