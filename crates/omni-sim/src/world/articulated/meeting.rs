//! Where the rollers of wheels meet the ground: at most a few of a wheel touch at a time.
//!
//! A roller's surface in touch moves with its wheel, and by the roller's own spin about its axis.
//! Its spin changes by the friction across that axis alone; nothing else of it is free. A roller
//! that does not touch keeps its spin but for its bearing's damping.

use rapier3d_f64::parry::query::details::contact_support_map_support_map;
use rapier3d_f64::parry::shape::{SupportMap, Triangle};
use rapier3d_f64::prelude::{Matrix as Matrix3, Pose, Rotation, Vector as Vector3};

use super::contact::{Across, Contact, LinearForm, unit};
use super::ground::{Ground, Part, PartDirection, Solid, Touch, nearest_on_field};
use super::model::Wheel;
use super::rollers::Rollers;
use super::tree::Tree;
use crate::world::barrel::nearest_to_box;

/// A roller in the present step, in world axes about the common centre of mass.
struct Placed {
    index: usize,
    middle: Vector3,
    axis: Vector3,
}

/// Everything that a wheel's rollers meet the ground with.
pub(super) struct Meeting<'a, const N: usize> {
    pub(super) tree: &'a Tree<N>,
    pub(super) ground: &'a Ground,
    /// The common centre of mass \[m\].
    pub(super) com: Vector3,
    pub(super) ahead_m: f64,
    pub(super) step_s: f64,
}

impl Rollers {
    /// The axis of a roller in the frame of the wheel's carrier, the wheel turned by an angle \[rad\].
    pub(super) fn axis(&self, wheel: &Wheel, roller: usize, turn_rad: f64) -> Vector3 {
        let (sin, cos) = self.angle(roller, libm::sincos(turn_rad));
        let [angle_sin, angle_cos] = wheel.sin_cos;
        let rolling = wheel.axle.cross(Vector3::Z);
        (rolling * cos - Vector3::Z * sin) * angle_cos + wheel.axle * angle_sin
    }

    /// The contacts of a wheel, turned by an angle \[rad\], roller by roller; `free` is the spin
    /// that each roller has if it is not touched.
    pub(super) fn meet<const N: usize>(
        &self,
        meeting: &Meeting<'_, N>,
        wheel: &Wheel,
        index: usize,
        turn_rad: f64,
        free: &[f64],
        contacts: &mut Vec<Contact>,
    ) {
        let tree = meeting.tree;
        let rotation = tree.rotation[wheel.body];
        let centre = tree.centre[index];
        let reach_m = self.reach_m + meeting.ahead_m;
        let at = centre + meeting.com;
        let rolling = wheel.axle.cross(Vector3::Z);
        let axle = tree.axle[index];
        let (down, back) = (rotation * -Vector3::Z, rotation * -rolling);
        let [angle_sin, angle_cos] = wheel.sin_cos;
        let turned = libm::sincos(turn_rad);
        let (half_length_m, radius_m) = (self.shape.0.half_length_m(), self.shape.0.radius_m());
        let from = contacts.len();
        for (key, part) in meeting.ground.near(at, reach_m) {
            let Some(way) = part.direction_from(at, reach_m) else {
                continue;
            };
            // A convex part lies beyond the plane across the way to its nearest place: what does
            // not reach that plane cannot touch.
            let (towards, least) = match way {
                PartDirection::Towards(way) => (way.normalize_or_zero(), way.length() - meeting.ahead_m),
                PartDirection::Around => (Vector3::ZERO, f64::NEG_INFINITY),
            };
            // How far each roller's middle is out that way, by its own angle: most are not looked at any further.
            let [down_to, back_to, axle_to] = [down, back, axle].map(|axis| axis.dot(towards));
            let (turn_sin, turn_cos) = turned;
            let by_sin = (back_to * turn_cos - down_to * turn_sin) * self.pitch_radius_m;
            let by_cos = (down_to * turn_cos + back_to * turn_sin) * self.pitch_radius_m;
            for (roller, [own_sin, own_cos, along]) in self.places.iter().enumerate() {
                let middle_to = own_sin * by_sin + own_cos * by_cos + axle_to * along;
                if middle_to + self.longest_m < least {
                    continue;
                }
                let (sin, cos) = self.angle(roller, turned);
                let sine = (down_to * sin - back_to * cos) * angle_cos + axle_to * angle_sin;
                // A cylinder about it reaches farther, and that is quicker to say.
                let cylinder_m = half_length_m * sine.abs() + radius_m * (1.0 - 0.5 * sine * sine);
                if middle_to + cylinder_m < least
                    || middle_to + self.shape.0.reach_m(sine.clamp(-1.0, 1.0)) < least
                {
                    continue;
                }
                let middle = (down * cos + back * sin) * self.pitch_radius_m + axle * *along;
                let axis = (down * sin - back * cos) * angle_cos + axle * angle_sin;
                let placed = Placed {
                    index: roller,
                    middle: centre + middle,
                    axis,
                };
                self.touch(meeting, part, key, &placed, |touch| {
                    contacts.push(self.contact(meeting, wheel, index, &placed, touch, free[roller]));
                });
            }
        }
        // Roller by roller, whatever part of the ground they meet.
        contacts[from..].sort_by_key(|contact| contact.across.as_ref().map(|across| across.roller));
    }

    /// Where a roller meets a part of the ground.
    fn touch<const N: usize>(
        &self,
        meeting: &Meeting<'_, N>,
        part: &Part,
        key: u32,
        placed: &Placed,
        mut found: impl FnMut(&Touch),
    ) {
        let at = placed.middle + meeting.com;
        let edge_m = self.shape.0.edge_m();
        let mut add = |on: Vector3, normal: Vector3, gap_m: f64, face: u32| {
            let point = part.outwards(on);
            found(&Touch {
                normal: part.turned(normal),
                point,
                gap_m,
                friction: meeting.ground.friction_at(point),
                key: [key, face],
            });
        };
        // Of the core, without the rounding of its edges.
        let core = |shape: &dyn SupportMap| {
            let local = part.pose.inverse() * pose(at, placed.axis);
            contact_support_map_support_map(&local, shape, &self.shape, meeting.ahead_m + edge_m)
        };
        match &part.solid {
            Solid::Box(shape) => {
                let (at, axis) = (part.inwards(at), part.turned_back(placed.axis));
                let nearest = nearest_to_box(shape, &self.shape, at, axis);
                if nearest.gap_m < meeting.ahead_m {
                    add(nearest.on_box(), nearest.normal, nearest.gap_m, 0);
                }
            }
            Solid::Bar(shape) => {
                if let Some(touch) = core(shape) {
                    add(touch.point1, touch.normal1, touch.dist - edge_m, 0);
                }
            }
            Solid::Field(shape) => {
                let reach_m = self.shape.reach_m() + meeting.ahead_m;
                let nearest = |triangle: &Triangle| {
                    core(triangle).map(|touch| (touch.point1, touch.normal1, touch.dist - edge_m))
                };
                for ((on, normal, gap_m), face) in nearest_on_field(shape, part.inwards(at), reach_m, nearest)
                {
                    add(on, normal, gap_m, face);
                }
            }
        }
    }

    /// The contact of a roller.
    fn contact<const N: usize>(
        &self,
        meeting: &Meeting<'_, N>,
        wheel: &Wheel,
        index: usize,
        placed: &Placed,
        touch: &Touch,
        free_rad_s: f64,
    ) -> Contact {
        let tree = meeting.tree;
        let (normal, axis) = (touch.normal, placed.axis);
        let (axle, centre) = (tree.axle[index], tree.centre[index]);
        // On the roller: the ground's place and the roller's are a gap apart.
        let point = touch.point - meeting.com + normal * touch.gap_m;
        let line = |direction: Vector3, roller_lever_m: f64| {
            // The wheel turns everything but the roller about its own axis.
            let moment = (point - centre).cross(direction) - axis * roller_lever_m;
            let lever_m = axle.dot(moment);
            let turning = centre.cross(direction) + moment - axle * lever_m;
            LinearForm::new(direction, turning, lever_m)
        };
        let along = unit(axis - normal * normal.dot(axis));
        let across = normal.cross(along);
        let lever_m = axis.dot((point - placed.middle).cross(across));
        // Of what turns the roller its bearing passes a part on to the wheel.
        let inertia_kg_m2 = self.inertia_kg_m2 + meeting.step_s * self.friction_n_m_s_rad;
        let lines = [line(normal, 0.0), line(along, 0.0)];
        let mut contact = Contact::new(wheel, index, touch, [point, along], lines, meeting.step_s);
        contact.key[0] |= (placed.index as u32) << 8;
        contact.across = Some(Across {
            direction: across,
            line: line(across, lever_m * self.inertia_kg_m2 / inertia_kg_m2),
            roller: self.first + placed.index,
            lever_m,
            inertia_kg_m2,
            free_rad_s,
            rad_s: free_rad_s,
            impulse: 0.0,
        });
        contact
    }
}

/// A pose whose x axis is given.
fn pose(at: Vector3, axis: Vector3) -> Pose {
    let aside = axis.any_orthonormal_vector();
    let frame = Matrix3::from_cols(axis, aside, axis.cross(aside));
    Pose::from_parts(at, Rotation::from_mat3(&frame))
}
