//! Sweeps over the contacts (Gauss-Seidel), where their modes go round in circles.

use super::contact::{Contact, LinearForm, Mode};
use super::grip::{Grip, SLACK, STICK};
use super::linear::{Vector, add, solve};
use super::spin::Spin;
use super::system::{Equations, WheelSystem};
use super::tree::{Tree, Twist};
use crate::config::MOST_WHEELS;

/// Largest number of sweeps over all contacts: a third of them whole and the rest relaxed. Sweeps that settle do so in
/// tens to hundreds; what these do not settle is counted, and a run with much of it ends as an error.
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

/// Velocities of everything: those that there are, or what a unit impulse on a wheel adds to them.
#[derive(Clone)]
struct Velocities<const N: usize> {
    tree: Vector<N>,
    twists: [Twist; N],
    /// Of all wheels: one that a drag ties to its carrier turns with that, whichever wheel is pushed.
    spins: [f64; MOST_WHEELS],
}

impl<const N: usize> Velocities<N> {
    fn add(&mut self, by: f64, other: &Self) {
        add(&mut self.tree, by, &other.tree);
        for (twist, other) in self.twists.iter_mut().zip(&other.twists) {
            add(twist, by, other);
        }
        add(&mut self.spins, by, &other.spins);
    }

    /// Velocity along a line of a wheel.
    fn along(&self, line: &LinearForm, body: usize, wheel: usize) -> f64 {
        line.at(&self.twists[body], self.spins[wheel])
    }
}

/// What unit impulses at a contact do, in each of its directions.
struct ContactResponse<const N: usize> {
    normal: Velocities<N>,
    along: Velocities<N>,
    across: Option<Velocities<N>>,
}

/// A wheel whose gear has dry friction, and what a unit impulse on its turning does.
struct Hold<const N: usize> {
    wheel: usize,
    turning: LinearForm,
    response: Velocities<N>,
}

/// Velocities without any impulse, and what impulses do to them.
struct Responses<const N: usize> {
    free: Velocities<N>,
    contacts: Vec<ContactResponse<N>>,
    holds: Vec<Hold<N>>,
}

impl<const N: usize> Responses<N> {
    fn new(tree: &Tree<N>, free: &Equations<N>, wheels: &[Spin], contacts: &[Contact]) -> Self {
        // Without contacts only drags tie wheels to the tree.
        let (mut bare, mut bodies) = (free.tree, free.bodies.clone());
        let add_wheel = |wheel: &Spin| {
            let mut system = WheelSystem::new(wheel, &mut bodies[wheel.body]);
            system.eliminate();
            system.row
        };
        let rows: Vec<_> = wheels.iter().map(add_wheel).collect();
        bare.gather(tree, &mut bodies);
        let with_spins = |u: Vector<N>, spin: &dyn Fn(usize, &Twist) -> f64| {
            let twists = tree.twists(&u);
            let mut spins = [0.0; MOST_WHEELS];
            for (i, wheel) in wheels.iter().enumerate() {
                spins[i] = spin(i, &twists[wheel.body]);
            }
            Velocities {
                tree: u,
                twists,
                spins,
            }
        };
        // What a unit impulse along a line does.
        let respond = |line: &LinearForm, pushed: usize| {
            let mut force = line.row;
            let own = &rows[pushed];
            add(&mut force, -line.lever_m / own.diagonal, &own.row);
            let force = tree.row(wheels[pushed].body, &force);
            with_spins(solve(bare.matrix, force), &|i, carrier| {
                let lever_m = if i == pushed { line.lever_m } else { 0.0 };
                rows[i].response(lever_m, carrier)
            })
        };
        let of_contact = |contact: &Contact| ContactResponse {
            normal: respond(&contact.separation, contact.wheel),
            along: respond(&contact.slip, contact.wheel),
            across: contact.across.map(|across| respond(&across.line, contact.wheel)),
        };
        let held = wheels.iter().enumerate().filter(|(_, wheel)| wheel.hold > 0.0);
        Self {
            free: with_spins(solve(bare.matrix, bare.right), &|i, carrier| {
                rows[i].spin(carrier)
            }),
            contacts: contacts.iter().map(of_contact).collect(),
            holds: held
                .map(|(i, wheel)| Hold {
                    wheel: i,
                    turning: wheel.turning(),
                    response: respond(&wheel.turning(), i),
                })
                .collect(),
        }
    }

    /// The velocities with the impulses that the rounds before left, each brought within its limits first. They may be
    /// of different rounds: this is only where sweeps start.
    fn begin(&self, wheels: &mut [Spin], contacts: &mut [Contact]) -> Velocities<N> {
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
        let mut now = self.free.clone();
        for (contact, response) in contacts.iter().zip(&self.contacts) {
            now.add(contact.normal_impulse, &response.normal);
            now.add(contact.friction_impulse, &response.along);
            if let (Some(response), Some(across)) = (&response.across, contact.across) {
                now.add(across.impulse, response);
            }
        }
        for hold in &self.holds {
            let wheel = &mut wheels[hold.wheel];
            wheel.held = wheel.held.max(-wheel.hold).min(wheel.hold);
            now.add(wheel.held, &hold.response);
        }
        now
    }
}

impl<const N: usize> ContactResponse<N> {
    /// Moves the impulses of contact `i` by `part` of what would settle each alone. Returns the largest part of what
    /// was off that this removed \[m/s\]: the change of velocity, and of what the contact's own softness takes.
    fn relax(&self, contacts: &mut [Contact], i: usize, part: f64, now: &mut Velocities<N>) -> f64 {
        let contact = &mut contacts[i];
        let (body, wheel) = (contact.body, contact.wheel);
        let compliance = self.normal.along(&contact.separation, body, wheel) + 1.0 / contact.gain_kg;
        let off = now.along(&contact.separation, body, wheel)
            + contact.bias_m_s
            + contact.normal_impulse / contact.gain_kg;
        let by = (-off / compliance * part).max(-contact.normal_impulse);
        contact.normal_impulse += by;
        let mut changed_m_s = (by * compliance).abs();
        now.add(by, &self.normal);
        let most = contact.friction * contact.normal_impulse;
        let compliance = self.along.along(&contact.slip, body, wheel) + 1.0 / STICK;
        let off = now.along(&contact.slip, body, wheel) + contact.friction_impulse / STICK;
        let by = (contact.friction_impulse - off / compliance * part)
            .max(-most)
            .min(most)
            - contact.friction_impulse;
        contact.friction_impulse += by;
        changed_m_s = changed_m_s.max((by * compliance).abs());
        now.add(by, &self.along);
        let (Some(response), Some(across)) = (&self.across, &mut contact.across) else {
            return changed_m_s;
        };
        let turns = across.lever_m / across.inertia_kg_m2;
        let compliance = response.along(&across.line, body, wheel) + across.lever_m * turns + 1.0 / STICK;
        let slip = now.along(&across.line, body, wheel) + across.lever_m * across.rad_s;
        let off = slip + across.impulse / STICK;
        let by = (across.impulse - off / compliance * part).max(-most).min(most) - across.impulse;
        across.impulse += by;
        changed_m_s = changed_m_s.max((by * compliance).abs());
        let roller = across.roller;
        now.add(by, response);
        for other in contacts.iter_mut().filter_map(|other| other.across.as_mut()) {
            if other.roller == roller {
                other.rad_s += by * turns;
            }
        }
        changed_m_s
    }
}

impl<const N: usize> Hold<N> {
    /// The same for the dry friction of a wheel's gear; the change is of a place a metre from the axle \[m/s\].
    fn relax(&self, wheels: &mut [Spin], part: f64, now: &mut Velocities<N>) -> f64 {
        let wheel = &mut wheels[self.wheel];
        let compliance = self.response.along(&self.turning, wheel.body, self.wheel) + 1.0 / wheel.stick();
        let off = now.along(&self.turning, wheel.body, self.wheel) + wheel.held / wheel.stick();
        let by = (wheel.held - off / compliance * part)
            .max(-wheel.hold)
            .min(wheel.hold)
            - wheel.held;
        wheel.held += by;
        now.add(by, &self.response);
        (by * compliance).abs()
    }
}

/// The mode of a contact with these impulses.
fn mode(contact: &Contact) -> Mode {
    let most = contact.friction * contact.normal_impulse;
    let grip = |impulse: f64| {
        if impulse.abs() >= most * (1.0 - SLACK) {
            Grip::Slide(impulse.signum())
        } else {
            Grip::Stick
        }
    };
    if contact.normal_impulse <= 0.0 {
        return Mode::Open;
    }
    Mode::Closed(
        grip(contact.friction_impulse),
        contact.across.map_or(Grip::Stick, |a| grip(a.impulse)),
    )
}

/// Gauss-Seidel over the impulses of contacts and of the gears' dry friction, from those that the
/// rounds before left. Returns the velocities, and whether they have settled.
pub(super) fn sweep<const N: usize>(
    tree: &Tree<N>,
    free: &Equations<N>,
    wheels: &mut [Spin],
    contacts: &mut [Contact],
    spins: &mut [f64],
) -> (Vector<N>, bool) {
    let responses = Responses::new(tree, free, wheels, contacts);
    let mut now = responses.begin(wheels, contacts);
    let mut left_m_s = 0.0_f64;
    for sweep in 0..SWEEPS {
        left_m_s = 0.0;
        let part = if sweep < RELAXED_FROM { 1.0 } else { RELAXED };
        for (i, response) in responses.contacts.iter().enumerate() {
            left_m_s = left_m_s.max(response.relax(contacts, i, part, &mut now));
        }
        for hold in &responses.holds {
            left_m_s = left_m_s.max(hold.relax(wheels, part, &mut now));
        }
        if left_m_s <= SETTLED_M_S {
            break;
        }
    }
    for contact in contacts.iter_mut() {
        contact.mode = mode(contact);
    }
    spins.copy_from_slice(&now.spins[..spins.len()]);
    (now.tree, left_m_s <= UNSETTLED_M_S)
}
