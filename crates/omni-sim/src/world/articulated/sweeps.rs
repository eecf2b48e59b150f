//! Sweeps over the contacts (Gauss-Seidel), where their modes go round in circles.

use super::MOST_WHEELS;
use super::contact::{Contact, Grip, Line, Mode};
use super::linear::{Vector, add, add_outer, dot, solve};
use super::solver::{SLACK, STICK, System, WheelRow};
use super::spin::Spin;

/// Sweeps over all contacts at most.
const SWEEPS: usize = 3000;
/// A sweep that changes no contact's velocity by more is the last \[m/s\]: what the linear solution leaves too.
const SETTLED_M_S: f64 = 1e-10;
/// Sweeps that still change a contact's velocity by more have not settled \[m/s\]: a thousandth of what a vehicle drives.
const UNSETTLED_M_S: f64 = 3e-4;
/// Times that sweeps begin anew at most because wheels' grips have changed.
const SWEPT_AGAIN: usize = 8;

/// What a unit impulse on a wheel does.
struct Response<const N: usize> {
    tree: Vector<N>,
    /// To the spins of all wheels.
    turns: [f64; MOST_WHEELS],
}

/// Sweeps over the contacts with the wheels' grips as they are, until these fit. Returns the velocities, and whether they have settled.
pub(super) fn sweep_held<const N: usize>(
    system: &System<N>,
    wheels: &mut [Spin<N>],
    contacts: &mut [Contact<N>],
    spins: &mut [f64],
) -> (Vector<N>, bool) {
    for round in 1.. {
        let gripped = |wheel: &Spin<N>| if wheel.hold > 0.0 { wheel.gripped() } else { *wheel };
        let held: Vec<_> = wheels.iter().map(gripped).collect();
        let mut with_friction = System {
            matrix: system.matrix,
            right: system.right,
        };
        for wheel in wheels.iter() {
            wheel.push_carrier(&mut with_friction.right);
        }
        let (u, left_m_s) = sweep(&with_friction, &held, contacts, spins);
        let mut changed = false;
        for (wheel, spin) in wheels.iter_mut().zip(spins.iter()) {
            changed |= wheel.hold > 0.0 && wheel.settle(&u, *spin);
        }
        if !changed || round == SWEPT_AGAIN {
            return (u, !changed && left_m_s <= UNSETTLED_M_S);
        }
    }
    unreachable!("the loop above returns")
}

/// Gauss-Seidel over the contacts' impulses, from those that the last modes made. Returns the velocities, and by how much the last
/// sweep changed those of a contact \[m/s\].
fn sweep<const N: usize>(
    system: &System<N>,
    wheels: &[Spin<N>],
    contacts: &mut [Contact<N>],
    spins: &mut [f64],
) -> (Vector<N>, f64) {
    // Without contacts only drags tie wheels to the tree.
    let mut bare = System {
        matrix: system.matrix,
        right: system.right,
    };
    for wheel in wheels {
        if wheel.damper > 0.0 {
            add_outer(&mut bare.matrix, wheel.damper, &wheel.carried, &wheel.carried);
        }
        WheelRow::new(wheel).eliminate(&mut bare);
    }
    // What a unit impulse along a line does to the tree, and to the spins of all wheels: one that drags tie to its carrier turns with that
    // whichever wheel is pushed.
    let respond = |line: &Line<N>, pushed: usize| {
        let row = WheelRow::new(&wheels[pushed]);
        let mut force = line.row;
        add(&mut force, -line.lever_m / row.diagonal, &row.column);
        let tree = solve(bare.matrix, force);
        let mut turns = [0.0; MOST_WHEELS];
        for (i, (turn, wheel)) in turns.iter_mut().zip(wheels).enumerate() {
            let row = WheelRow::new(wheel);
            let lever_m = if i == pushed { line.lever_m } else { 0.0 };
            *turn = (lever_m - dot(&row.row, &tree)) / row.diagonal;
        }
        Response { tree, turns }
    };
    let mut u = solve(bare.matrix, bare.right);
    for (spin, wheel) in spins.iter_mut().zip(wheels) {
        *spin = WheelRow::new(wheel).spin(&u);
    }
    // Directions of all contacts: normal, along, across.
    let responses: Vec<[Option<Response<N>>; 3]> = contacts
        .iter()
        .map(|contact| {
            let wheel = contact.wheel;
            [
                Some(respond(&contact.closing, wheel)),
                Some(respond(&contact.slip, wheel)),
                contact.across.map(|across| respond(&across.line, wheel)),
            ]
        })
        .collect();
    for contact in contacts.iter_mut() {
        let most = contact.friction * contact.push;
        contact.rub = contact.rub.max(-most).min(most);
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
    let apply = |u: &mut Vector<N>, spins: &mut [f64], contact: usize, way: usize, by: f64| {
        if let Some(response) = &responses[contact][way] {
            add(u, by, &response.tree);
            for (spin, turn) in spins.iter_mut().zip(&response.turns) {
                *spin += by * turn;
            }
        }
    };
    for (i, contact) in contacts.iter().enumerate() {
        let across = contact.across.map_or(0.0, |across| across.impulse);
        for (way, by) in [contact.push, contact.rub, across].into_iter().enumerate() {
            apply(&mut u, spins, i, way, by);
        }
    }
    // How much a line gives way to a unit impulse along itself.
    let give = |line: &Line<N>, wheel: usize, response: &Option<Response<N>>| {
        response.as_ref().map_or(0.0, |response| {
            dot(&line.row, &response.tree) + line.lever_m * response.turns[wheel]
        })
    };
    let mut left_m_s = 0.0_f64;
    for _ in 0..SWEEPS {
        left_m_s = 0.0;
        for i in 0..contacts.len() {
            let contact = &mut contacts[i];
            let wheel = contact.wheel;
            let gives = give(&contact.closing, wheel, &responses[i][0]) + 1.0 / contact.stiffness;
            let off = contact.closing.at(&u, spins[wheel]) + contact.bias + contact.push / contact.stiffness;
            let by = (-off / gives).max(-contact.push);
            contact.push += by;
            left_m_s = left_m_s.max((by * gives).abs());
            apply(&mut u, spins, i, 0, by);
            let most = contact.friction * contact.push;
            let gives = give(&contact.slip, wheel, &responses[i][1]) + 1.0 / STICK;
            let off = contact.slip.at(&u, spins[wheel]) + contact.rub / STICK;
            let by = (contact.rub - off / gives).max(-most).min(most) - contact.rub;
            contact.rub += by;
            left_m_s = left_m_s.max((by * gives).abs());
            apply(&mut u, spins, i, 1, by);
            let Some(across) = &mut contact.across else {
                continue;
            };
            let turns = across.lever_m / across.inertia_kg_m2;
            let gives = give(&across.line, wheel, &responses[i][2]) + across.lever_m * turns + 1.0 / STICK;
            let slip = across.line.at(&u, spins[wheel]) + across.lever_m * across.rad_s;
            let off = slip + across.impulse / STICK;
            let by = (across.impulse - off / gives).max(-most).min(most) - across.impulse;
            across.impulse += by;
            left_m_s = left_m_s.max((by * gives).abs());
            let roller = across.roller;
            apply(&mut u, spins, i, 2, by);
            for other in contacts.iter_mut().filter_map(|other| other.across.as_mut()) {
                if other.roller == roller {
                    other.rad_s += by * turns;
                }
            }
        }
        if left_m_s <= SETTLED_M_S {
            break;
        }
    }
    for contact in contacts.iter_mut() {
        let most = contact.friction * contact.push;
        let grip = |impulse: f64| {
            if impulse.abs() >= most * (1.0 - SLACK) {
                Grip::Slide(impulse.signum())
            } else {
                Grip::Stick
            }
        };
        contact.mode = if contact.push <= 0.0 {
            Mode::Open
        } else {
            Mode::Closed(
                grip(contact.rub),
                contact.across.map_or(Grip::Stick, |a| grip(a.impulse)),
            )
        };
    }
    (u, left_m_s)
}
