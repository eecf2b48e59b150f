//! Linear systems of a step: the tree's equations, what acts on single bodies, and each wheel's row.

use super::contact::LinearForm;
use super::linear::{Matrix, Vector, add, add_outer, add_square, dot, mirror, times, times_transposed};
use super::spin::Spin;
use super::tree::{FREE, Tree, Twist};

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

    /// Adds the systems of bodies, each for its twist (docs/derivations.md). Each of them becomes that of all that
    /// hangs on its hinge.
    ///
    /// At a unit rate of a hinge everything moves by its `drift`, and what hangs on it by its `joint` as well.
    pub(super) fn gather(&mut self, tree: &Tree<N>, bodies: &mut [System<FREE>]) {
        self.symmetric = bodies[0].symmetric;
        let symmetric = self.symmetric;
        // Inwards: of all that hangs on a hinge.
        for b in (1..tree.bodies).rev() {
            let (inner, outer) = bodies.split_at_mut(b);
            let (parent, own) = (&mut inner[tree.parent[b]], &outer[0]);
            for (row, own) in parent.matrix.iter_mut().zip(&own.matrix) {
                add(row, 1.0, own);
            }
            add(&mut parent.right, 1.0, &own.right);
        }
        if symmetric {
            bodies.iter_mut().for_each(|body| mirror(&mut body.matrix));
        }
        let all = &bodies[0];
        for i in 0..FREE {
            for j in 0..FREE {
                self.matrix[i][j] += all.matrix[i][j];
            }
            self.right[i] += all.right[i];
        }
        // Of what hangs on each hinge: impulses for a unit rate of it, and its force for unit velocities.
        let (mut hung, mut works) = ([[0.0; FREE]; N], [[0.0; FREE]; N]);
        for h in 1..tree.bodies {
            works[h] = times_transposed(&bodies[h].matrix, &tree.joint[h]);
            hung[h] = if symmetric {
                works[h]
            } else {
                times(&bodies[h].matrix, &tree.joint[h])
            };
        }
        for h in 1..tree.bodies {
            let (drift, joint, index) = (&tree.drift[h], &tree.joint[h], FREE - 1 + h);
            let row = times_transposed(&all.matrix, drift);
            let mut column = if symmetric { row } else { times(&all.matrix, drift) };
            add(&mut column, 1.0, &hung[h]);
            for i in 0..FREE {
                self.matrix[i][index] += column[i];
                self.matrix[index][i] += row[i] + works[h][i];
            }
            for k in 1..if symmetric { h + 1 } else { tree.bodies } {
                let value = &mut self.matrix[FREE - 1 + k][index];
                *value += dot(&works[k], drift) + dot(&tree.drift[k], &column);
                if tree.hangs_on(h, k) {
                    *value += dot(&tree.joint[k], &hung[h]);
                } else if tree.hangs_on(k, h) {
                    *value += dot(&works[k], joint);
                }
            }
            self.right[index] += dot(joint, &bodies[h].right) + dot(drift, &all.right);
        }
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

/// The equations of a step without contacts.
pub(super) struct Equations<const N: usize> {
    /// Dampers, stops and couplings of hinges.
    pub(super) tree: System<N>,
    /// Inertia of each body, and its momentum with what pushes it.
    pub(super) bodies: Vec<System<FREE>>,
    /// Room for the same with contacts and wheels.
    pub(super) with_contacts: Vec<System<FREE>>,
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
