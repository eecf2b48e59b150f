//! Sweeps over the contacts (Gauss-Seidel), where their modes go round in circles.

use super::contact::{Contact, LinearForm, Mode};
use super::grip::{Grip, SLACK, STICK};
use super::linear::{Vector, add, add_outer, dot, solve};
use super::model::MOST_WHEELS;
use super::spin::Spin;
use super::system::{System, WheelRow};

/// Largest number of sweeps over all contacts.
const SWEEPS: usize = 3000;
/// From this sweep on an impulse moves by a part of what would settle it alone.
const RELAXED_FROM: usize = 1000;
/// That part. A contact whose friction pushes it apart or together may go round in circles of push, friction, push:
/// friction follows the last push whole, and the next push follows that. With half of each the circle shrinks.
const RELAXED: f64 = 0.5;
/// A sweep that changes no contact's velocity by more is the last \[m/s\]: what the linear solution leaves too.
const SETTLED_M_S: f64 = 1e-10;
/// Sweeps that still change a contact's velocity by more have not settled \[m/s\]: a thousandth of
/// what a vehicle drives.
const UNSETTLED_M_S: f64 = 3e-4;

/// What a unit impulse on a wheel does.
struct Response<const N: usize> {
    tree: Vector<N>,
    /// To the spins of all wheels: one that a drag ties to its carrier turns with that, whichever wheel is pushed.
    spins: [f64; MOST_WHEELS],
}

impl<const N: usize> Response<N> {
    fn add(&self, by: f64, u: &mut Vector<N>, spins: &mut [f64]) {
        add(u, by, &self.tree);
        for (spin, own) in spins.iter_mut().zip(&self.spins) {
            *spin += by * own;
        }
    }

    /// Response of a line to it.
    fn along(&self, line: &LinearForm<N>, wheel: usize) -> f64 {
        dot(&line.row, &self.tree) + line.lever_m * self.spins[wheel]
    }
}

/// Gauss-Seidel over the impulses of contacts and of the gears' dry friction, from those that the
/// last modes made. Returns the velocities, and whether they have settled.
pub(super) fn sweep<const N: usize>(
    system: &System<N>,
    wheels: &mut [Spin<N>],
    contacts: &mut [Contact<N>],
    spins: &mut [f64],
) -> (Vector<N>, bool) {
    // Without contacts only drags tie wheels to the tree.
    let mut bare = System {
        matrix: system.matrix,
        right: system.right,
    };
    let rows: Vec<_> = wheels.iter().map(WheelRow::new).collect();
    for (wheel, row) in wheels.iter().zip(&rows) {
        if wheel.damper > 0.0 {
            add_outer(&mut bare.matrix, wheel.damper, &wheel.carried, &wheel.carried);
        }
        row.eliminate(&mut bare);
    }
    // What a unit impulse along a line does.
    let respond = |line: &LinearForm<N>, pushed: usize| {
        let mut force = line.row;
        add(
            &mut force,
            -line.lever_m / rows[pushed].diagonal,
            &rows[pushed].column,
        );
        let tree = solve(bare.matrix, force);
        let mut spins = [0.0; MOST_WHEELS];
        for (i, row) in rows.iter().enumerate() {
            let lever_m = if i == pushed { line.lever_m } else { 0.0 };
            spins[i] = (lever_m - dot(&row.row, &tree)) / row.diagonal;
        }
        Response { tree, spins }
    };
    let mut u = solve(bare.matrix, bare.right);
    for (spin, row) in spins.iter_mut().zip(&rows) {
        *spin = row.spin(&u);
    }
    // Directions of all contacts: normal, along, across.
    let responses: Vec<_> = contacts
        .iter()
        .map(|contact| {
            let wheel = contact.wheel;
            (
                respond(&contact.separation, wheel),
                respond(&contact.slip, wheel),
                contact.across.map(|across| respond(&across.line, wheel)),
            )
        })
        .collect();
    let holds: Vec<_> = wheels
        .iter()
        .enumerate()
        .filter(|(_, wheel)| wheel.hold > 0.0)
        .map(|(i, wheel)| (i, wheel.turning(), respond(&wheel.turning(), i)))
        .collect();
    for contact in contacts.iter_mut() {
        let most = contact.friction * contact.normal_impulse;
        contact.friction_impulse = contact.friction_impulse.max(-most).min(most);
        if let Some(across) = &mut contact.across {
            across.impulse = across.impulse.max(-most).min(most);
        }
    }
    for group in contacts.chunk_by_mut(Contact::shares_roller) {
        let turned: f64 = group
            .iter()
            .filter_map(|contact| contact.across)
            .map(|across| across.impulse * across.lever_m / across.inertia_kg_m2)
            .sum();
        for across in group.iter_mut().filter_map(|contact| contact.across.as_mut()) {
            across.rad_s = across.free_rad_s + turned;
        }
    }
    for (contact, (normal, along, across)) in contacts.iter().zip(&responses) {
        normal.add(contact.normal_impulse, &mut u, spins);
        along.add(contact.friction_impulse, &mut u, spins);
        if let (Some(response), Some(across)) = (across, contact.across) {
            response.add(across.impulse, &mut u, spins);
        }
    }
    for (i, _, response) in &holds {
        let wheel = &mut wheels[*i];
        wheel.held = wheel.held.max(-wheel.hold).min(wheel.hold);
        response.add(wheel.held, &mut u, spins);
    }
    let mut left_m_s = 0.0_f64;
    for sweep in 0..SWEEPS {
        left_m_s = 0.0;
        let part = if sweep < RELAXED_FROM { 1.0 } else { RELAXED };
        for i in 0..contacts.len() {
            let contact = &mut contacts[i];
            let (normal, along, across_roller) = &responses[i];
            let wheel = contact.wheel;
            let compliance = normal.along(&contact.separation, wheel) + 1.0 / contact.stiffness;
            let off = contact.separation.at(&u, spins[wheel])
                + contact.bias
                + contact.normal_impulse / contact.stiffness;
            let by = (-off / compliance * part).max(-contact.normal_impulse);
            contact.normal_impulse += by;
            left_m_s = left_m_s.max((by * compliance).abs());
            normal.add(by, &mut u, spins);
            let most = contact.friction * contact.normal_impulse;
            let compliance = along.along(&contact.slip, wheel) + 1.0 / STICK;
            let off = contact.slip.at(&u, spins[wheel]) + contact.friction_impulse / STICK;
            let by = (contact.friction_impulse - off / compliance * part)
                .max(-most)
                .min(most)
                - contact.friction_impulse;
            contact.friction_impulse += by;
            left_m_s = left_m_s.max((by * compliance).abs());
            along.add(by, &mut u, spins);
            let (Some(response), Some(across)) = (across_roller, &mut contact.across) else {
                continue;
            };
            let turns = across.lever_m / across.inertia_kg_m2;
            let compliance = response.along(&across.line, wheel) + across.lever_m * turns + 1.0 / STICK;
            let slip = across.line.at(&u, spins[wheel]) + across.lever_m * across.rad_s;
            let off = slip + across.impulse / STICK;
            let by = (across.impulse - off / compliance * part).max(-most).min(most) - across.impulse;
            across.impulse += by;
            left_m_s = left_m_s.max((by * compliance).abs());
            let roller = across.roller;
            response.add(by, &mut u, spins);
            for other in contacts.iter_mut().filter_map(|other| other.across.as_mut()) {
                if other.roller == roller {
                    other.rad_s += by * turns;
                }
            }
        }
        for (i, turning, response) in &holds {
            let wheel = &mut wheels[*i];
            let compliance = response.along(turning, *i) + 1.0 / wheel.stick();
            let off = turning.at(&u, spins[*i]) + wheel.held / wheel.stick();
            let by = (wheel.held - off / compliance * part)
                .max(-wheel.hold)
                .min(wheel.hold)
                - wheel.held;
            wheel.held += by;
            // Of a place a metre from the axle.
            left_m_s = left_m_s.max((by * compliance).abs());
            response.add(by, &mut u, spins);
        }
        if left_m_s <= SETTLED_M_S {
            break;
        }
    }
    for contact in contacts.iter_mut() {
        let most = contact.friction * contact.normal_impulse;
        let grip = |impulse: f64| {
            if impulse.abs() >= most * (1.0 - SLACK) {
                Grip::Slide(impulse.signum())
            } else {
                Grip::Stick
            }
        };
        contact.mode = if contact.normal_impulse <= 0.0 {
            Mode::Open
        } else {
            Mode::Closed(
                grip(contact.friction_impulse),
                contact.across.map_or(Grip::Stick, |a| grip(a.impulse)),
            )
        };
    }
    (u, left_m_s <= UNSETTLED_M_S)
}
