//! The velocities at the end of a step together with the contact impulses that belong to them.
//!
//! Every contact is open, or closed and sticks or slides along each of its directions. Once that is given,
//! everything is linear: wheels' and rollers' spins are eliminated, body by body, and the tree's velocities are left.
//! What comes out says which contacts are in the wrong mode; they are changed, and the system is solved again (a
//! semismooth Newton method). It starts from the modes of the step before, and needs 1.0 solutions per step on average.

use serde::{Deserialize, Serialize};

use super::contact::{Contact, LinearForm, Mode};
use super::grip::{Grip, STICK, follow};
use super::linear::{Vector, solve, solve_symmetric};
use super::spin::Spin;
use super::sweeps::sweep;
use super::system::{Equations, System, WheelRow, WheelSystem};
use super::tree::{FREE, Tree, Twist};
use crate::config::MOST_WHEELS;

/// Solutions after which contacts change their modes one at a time, and those after which sweeps take over. Modes that
/// settle together do so in a few solutions, and what is left are circles; one at a time each of the contacts of seven
/// wheels can change four times. Either number costs time only: sweeps end at the same impulses.
const TOGETHER: usize = 10;
const ONE_BY_ONE: usize = 30;

/// Statistics of the solver: how often it needed what.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct SolverStats {
    pub(super) steps: u64,
    pub(super) solutions: u64,
    pub(super) swept: u64,
    /// Sweeps that ended before they settled.
    pub(super) unsettled: u64,
}

impl SolverStats {
    /// Did the contacts of more steps not settle than a run may have: more than one in a hundred, and more than ten?
    pub(super) fn is_too_much(&self) -> bool {
        self.unsettled * 100 > self.steps.max(1000)
    }
}

/// A roller's row of the system: `diagonal spin + off_diagonal = right`, `off_diagonal` being a sum
/// over the sticking contacts of what bodies and wheel move.
struct RollerRow {
    diagonal: f64,
    off_diagonal: LinearForm,
    right: f64,
}

impl RollerRow {
    /// The row of the roller that all these contacts belong to; none if there is no roller.
    fn of(contacts: &[Contact]) -> Option<Self> {
        let roller = contacts.first()?.across.as_ref()?;
        let mut row = Self {
            diagonal: roller.inertia_kg_m2,
            off_diagonal: LinearForm::ZERO,
            right: roller.inertia_kg_m2 * roller.free_rad_s,
        };
        for contact in contacts {
            if let (Mode::Closed(_, Grip::Stick), Some(across)) = (contact.mode, &contact.across) {
                row.diagonal += STICK * across.lever_m * across.lever_m;
                row.off_diagonal.add(STICK * across.lever_m, &across.line);
            }
        }
        Some(row)
    }
}

/// Solves a step; contacts are sorted by wheel and then by roller, and get their modes and
/// impulses. Returns the generalised velocities; `spins` gets the wheels'.
pub(super) fn solve_step<const N: usize>(
    tree: &Tree<N>,
    free: &mut Equations<N>,
    wheels: &mut [Spin],
    contacts: &mut [Contact],
    spins: &mut [f64],
    stats: &mut SolverStats,
) -> Vector<N> {
    stats.steps += 1;
    for round in 1..=TOGETHER + ONE_BY_ONE {
        stats.solutions += 1;
        let (u, twists) = solve_modes(tree, free, wheels, contacts, spins);
        turn_rollers(contacts, &twists, spins);
        let mut changed = false;
        for (wheel, spin) in wheels.iter_mut().zip(spins.iter()) {
            if wheel.hold > 0.0 && wheel.settle(&twists[wheel.body], *spin) {
                changed = true;
                if round > TOGETHER {
                    break;
                }
            }
        }
        if changed && round > TOGETHER {
            continue;
        }
        for contact in contacts.iter_mut() {
            let mode = settle(contact, &twists[contact.body], spins[contact.wheel]);
            if mode != contact.mode {
                contact.mode = mode;
                changed = true;
                if round > TOGETHER {
                    break; // one at a time: circles of several end
                }
            }
        }
        if !changed {
            return u;
        }
    }
    stats.swept += 1;
    let (u, settled) = sweep(tree, free, wheels, contacts, spins);
    stats.unsettled += u64::from(!settled);
    u
}

/// The generalised velocities that the present modes make, and the bodies' twists.
fn solve_modes<const N: usize>(
    tree: &Tree<N>,
    free: &mut Equations<N>,
    wheels: &[Spin],
    contacts: &[Contact],
    spins: &mut [f64],
) -> (Vector<N>, [Twist; N]) {
    // Friction that slides follows the normal force, and not the other way round.
    let slides = |contact: &Contact| {
        matches!(
            contact.mode,
            Mode::Closed(Grip::Slide(_), _) | Mode::Closed(_, Grip::Slide(_))
        )
    };
    let symmetric = !contacts.iter().any(slides);
    let bodies = &mut free.with_contacts;
    bodies.clone_from(&free.bodies);
    for body in bodies.iter_mut() {
        body.symmetric = symmetric;
    }
    // Of each wheel the row that its spin follows once the carrier's twist is known.
    let mut rows: [Option<WheelRow>; MOST_WHEELS] = [const { None }; MOST_WHEELS];
    let mut rest = contacts;
    for (index, wheel) in wheels.iter().enumerate() {
        let count = rest.iter().take_while(|contact| contact.wheel == index).count();
        let own;
        (own, rest) = rest.split_at(count);
        rows[index] = Some(add_wheel(wheel, own, &mut bodies[wheel.body]));
    }
    let mut whole = free.tree;
    whole.gather(tree, bodies);
    let u = if whole.symmetric {
        solve_symmetric(whole.matrix, whole.right)
    } else {
        solve(whole.matrix, whole.right)
    };
    let twists = tree.twists(&u);
    for ((spin, row), wheel) in spins.iter_mut().zip(&rows).zip(wheels) {
        *spin = row.as_ref().map_or(*spin, |row| row.spin(&twists[wheel.body]));
    }
    (u, twists)
}

/// Adds a wheel with its contacts to its carrier, without its spin; returns the row that the spin follows.
#[inline(always)]
fn add_wheel(wheel: &Spin, own: &[Contact], carrier: &mut System<FREE>) -> WheelRow {
    let gripped;
    let wheel = if wheel.hold > 0.0 {
        wheel.push_carrier(&mut carrier.right);
        gripped = wheel.gripped();
        &gripped
    } else {
        wheel
    };
    let mut system = WheelSystem::new(wheel, carrier);
    let mut closed = own.iter().filter(|contact| contact.mode != Mode::Open);
    if let (Some(contact), None) = (closed.next(), closed.next())
        && let (Mode::Closed(Grip::Stick, _), None) = (contact.mode, contact.across)
        && wheel.damper == 0.0
        && contact.separation.lever_m == 0.0
    {
        // The usual case, a ball that rolls: its normal passes through the axle and does not turn the wheel.
        let separation = &contact.separation.row;
        system
            .carrier
            .add_force(contact.gain_kg, separation, separation, contact.bias_m_s);
        system.roll_on(&contact.slip, STICK);
    } else {
        for group in own.chunk_by(Contact::shares_roller) {
            add_group(group, &mut system);
        }
        system.eliminate();
    }
    system.row
}

/// Adds the contacts of one roller, or a contact without one, to the equations of wheel and carrier.
fn add_group(group: &[Contact], wheel: &mut WheelSystem) {
    // Of a roller that touches in one place its spin is eliminated in closed form.
    let roller = if group.len() > 1 {
        RollerRow::of(group)
    } else {
        None
    };
    for contact in group {
        let Mode::Closed(along, across) = contact.mode else {
            continue;
        };
        // What the normal force works along: the normal, and the directions in which it makes friction.
        let mut works = contact.separation;
        match along {
            Grip::Slide(sign) => works.add(sign * contact.friction, &contact.slip),
            Grip::Stick => wheel.add_force(STICK, &contact.slip, &contact.slip, 0.0),
        }
        match (&contact.across, across) {
            (None, _) => {}
            (Some(own), Grip::Slide(sign)) => {
                let friction = sign * contact.friction;
                works.add(friction, &own.line);
                if let Some(roller) = &roller {
                    // It turns the roller, and where that sticks as well it is held.
                    works.add(-friction * own.lever_m / roller.diagonal, &roller.off_diagonal);
                }
            }
            (Some(own), Grip::Stick) if roller.is_some() => {
                wheel.add_force(STICK, &own.line, &own.line, 0.0);
            }
            (Some(own), Grip::Stick) => {
                let gain = 1.0 / (1.0 / STICK + own.lever_m * own.lever_m / own.inertia_kg_m2);
                let free_m_s = own.lever_m * own.free_rad_s;
                wheel.add_force(gain, &own.line, &own.line, free_m_s);
            }
        }
        wheel.add_force(contact.gain_kg, &works, &contact.separation, contact.bias_m_s);
    }
    if let Some(roller) = roller {
        let (gain, line) = (-1.0 / roller.diagonal, &roller.off_diagonal);
        wheel.add_force(gain, line, line, -roller.right);
    }
}

/// The normal impulse of a contact at this twist of its carrier, below 0 if it is open.
fn normal_impulse(contact: &Contact, carrier: &Twist, spin: f64) -> f64 {
    -contact.gain_kg * (contact.separation.at(carrier, spin) + contact.bias_m_s)
}

/// Gives the rollers in touch the spins that go with these twists.
fn turn_rollers(contacts: &mut [Contact], twists: &[Twist], spins: &[f64]) {
    for group in contacts.chunk_by_mut(Contact::shares_roller) {
        let Some(row) = RollerRow::of(group) else {
            continue;
        };
        let (carrier, spin) = (&twists[group[0].body], spins[group[0].wheel]);
        let mut right = row.right - row.off_diagonal.at(carrier, spin);
        for contact in group.iter() {
            if let (Mode::Closed(_, Grip::Slide(sign)), Some(across)) = (contact.mode, contact.across) {
                right += sign
                    * across.lever_m
                    * contact.friction
                    * normal_impulse(contact, carrier, spin).max(0.0);
            }
        }
        for contact in group {
            if let Some(across) = &mut contact.across {
                across.rad_s = right / row.diagonal;
            }
        }
    }
}

/// The impulses of a contact at this twist of its carrier, and the mode that they call for.
fn settle(contact: &mut Contact, carrier: &Twist, spin: f64) -> Mode {
    let impulse = normal_impulse(contact, carrier, spin);
    contact.normal_impulse = impulse.max(0.0);
    let most = contact.friction * contact.normal_impulse;
    let open = impulse <= 0.0;
    let along = match contact.mode {
        Mode::Closed(grip, _) if !open => Some(grip),
        _ => None,
    };
    let slip = contact.slip.at(carrier, spin);
    let along = follow(along, slip, -STICK * slip, most, &mut contact.friction_impulse);
    let mut across = Grip::Stick;
    if let Some(roller) = &mut contact.across {
        let grip = match contact.mode {
            Mode::Closed(_, grip) if !open => Some(grip),
            _ => None,
        };
        let slip = roller.line.at(carrier, spin) + roller.lever_m * roller.rad_s;
        across = follow(grip, slip, -STICK * slip, most, &mut roller.impulse);
    }
    if open {
        Mode::Open
    } else {
        Mode::Closed(along, across)
    }
}
