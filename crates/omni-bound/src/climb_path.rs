//! Position and motion of all parts along the path of a climb.

use crate::linkage::Linkage;

/// A place in the world's x and z \[m\], the edge at x = 0, and its velocity for each unit of the path's \[m/rad\].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Moving {
    pub(crate) at: [f64; 2],
    pub(crate) rate: [f64; 2],
}

/// The vehicle at one point of the path of one row. The path's coordinate is the angle by which the
/// climbing wheels' centre has gone about the edge \[rad\].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Posture {
    /// Axles, the front row first.
    pub(crate) axles: [Moving; 3],
    /// Out of the ground, where each row touches it.
    pub(crate) normals: [[f64; 2]; 3],
    pub(crate) hinge: Moving,
    /// Centres of mass of the two frames.
    pub(crate) centres: [Moving; 2],
    /// Nose up \[rad\], and for each unit of the path's velocity.
    pub(crate) noses: [(f64, f64); 2],
}

/// Why a linkage cannot go a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Misfit {
    /// No angle of its frames puts the rows there.
    Reach,
    /// Its hinge would turn so far \[rad\].
    Stop(f64),
    /// Another row, from 0, is not clear of the edge.
    Close(usize),
}

/// `along` the rolling direction of a contact with this normal.
pub(crate) fn along([x, z]: [f64; 2]) -> [f64; 2] {
    [z, -x]
}

pub(crate) fn dot([a, b]: [f64; 2], [x, z]: [f64; 2]) -> f64 {
    a * x + b * z
}

/// Moment of a force, nose up.
pub(crate) fn moment([px, pz]: [f64; 2], [fx, fz]: [f64; 2]) -> f64 {
    px * fz - pz * fx
}

pub(crate) fn less([ax, az]: [f64; 2], [bx, bz]: [f64; 2]) -> [f64; 2] {
    [ax - bx, az - bz]
}

/// An arm of a frame turned nose up.
fn turned([x, z]: [f64; 2], angle: f64) -> [f64; 2] {
    let (sin, cos) = angle.sin_cos();
    [x * cos - z * sin, x * sin + z * cos]
}

/// A point of a frame, `arm` from its hinge on flat ground.
fn point(hinge: Moving, arm: [f64; 2], (angle, rate): (f64, f64)) -> Moving {
    let [x, z] = turned(arm, angle);
    Moving {
        at: [hinge.at[0] + x, hinge.at[1] + z],
        rate: [hinge.rate[0] - rate * z, hinge.rate[1] + rate * x],
    }
}

/// The angle that lifts an arm's end by `rise` \[m\] above its other end, and how fast it grows
/// with `rate`, of the rise.
fn lifted(arm: [f64; 2], rise: f64, rate: f64) -> Option<(f64, f64)> {
    let sin = rise / arm[0].hypot(arm[1]);
    if sin.abs() >= 1.0 {
        return None;
    }
    // Of the two angles the one near level; an arm that points back turns the other way.
    let level = arm[1].atan2(arm[0].abs());
    let angle = (sin.asin() - level) * arm[0].signum();
    Some((angle, rate / turned(arm, angle)[0]))
}

impl Linkage {
    /// The angle of the edge behind the upright of the climbing wheels where they touch it first \[rad\].
    pub(crate) fn first_touch_rad(&self, row: usize, height_m: f64) -> f64 {
        (1.0 - height_m / self.rows[row].radius_m).acos()
    }

    /// The vehicle with the centre of the climbing wheels `edge_rad` behind the upright through the edge.
    pub(crate) fn posture(&self, row: usize, height_m: f64, edge_rad: f64) -> Result<Posture, Misfit> {
        let (sin, cos) = edge_rad.sin_cos();
        let mut rises = [(0.0, 0.0); 3]; // of axles, in the world
        let mut normals = [[0.0, 1.0]; 3];
        for (each, wheels) in self.rows.iter().enumerate() {
            let level = if each < row { height_m } else { 0.0 };
            rises[each] = (level + wheels.radius_m, 0.0);
        }
        let radius = self.rows[row].radius_m;
        rises[row] = (height_m + radius * cos, radius * sin);
        normals[row] = [-sin, cos];

        // The frame with two rows, then the hinge on it, then the other.
        let own = |frame: usize| {
            let rows = self.rows.iter().enumerate();
            rows.filter(move |(_, wheels)| wheels.frame == frame)
                .map(|(each, _)| each)
        };
        let pair: Vec<usize> = own(0).collect();
        let (ahead, behind) = (pair[0], pair[1]);
        let arm = |each: usize| self.rows[each].axle_m;
        let between = (rises[ahead].0 - rises[behind].0, rises[ahead].1 - rises[behind].1);
        let first = lifted(less(arm(ahead), arm(behind)), between.0, between.1).ok_or(Misfit::Reach)?;
        let reach = turned(arm(behind), first.0);
        let hinge_z = (rises[behind].0 - reach[1], rises[behind].1 - first.1 * reach[0]);
        let alone = own(1).next().unwrap_or(row);
        let other = lifted(arm(alone), rises[alone].0 - hinge_z.0, rises[alone].1 - hinge_z.1)
            .ok_or(Misfit::Reach)?;
        let noses = [first, other];

        let turn = (first.0 - other.0).abs();
        if turn > self.stop_rad {
            return Err(Misfit::Stop(turn));
        }
        // Forward, the hinge is where the climbing wheels' centre wants it.
        let nose = noses[self.rows[row].frame];
        let reach = turned(arm(row), nose.0);
        let hinge = Moving {
            at: [-radius * sin - reach[0], hinge_z.0],
            rate: [radius * cos + nose.1 * reach[1], hinge_z.1],
        };
        let axles = [0, 1, 2].map(|each| point(hinge, arm(each), noses[self.rows[each].frame]));
        for each in 0..3 {
            // A row that has not climbed must not yet touch, one that has must be past the edge.
            let touch = -self.rows[each].radius_m * self.first_touch_rad(each, height_m).sin();
            let clear = match each.cmp(&row) {
                std::cmp::Ordering::Less => axles[each].at[0] > 0.0,
                std::cmp::Ordering::Equal => true,
                std::cmp::Ordering::Greater => axles[each].at[0] < touch,
            };
            if !clear {
                return Err(Misfit::Close(each));
            }
        }
        Ok(Posture {
            axles,
            normals,
            hinge,
            centres: [0, 1].map(|frame| point(hinge, self.frames[frame].centre_m, noses[frame])),
            noses,
        })
    }

    /// Inertia along the path \[kg.m^2\], turning wheels included.
    pub(crate) fn path_inertia(&self, posture: &Posture) -> f64 {
        let mut sum = 0.0;
        for (frame, (centre, nose)) in self.frames.iter().zip(posture.centres.iter().zip(posture.noses)) {
            sum += frame.mass_kg * dot(centre.rate, centre.rate) + frame.inertia_kg_m2 * nose.1 * nose.1;
        }
        sum + (0..3)
            .map(|row| self.rows[row].spin_kg_m2 * self.spin(posture, row).powi(2))
            .sum::<f64>()
    }

    /// How fast the wheels of a row turn for each unit of the path's velocity, as they roll.
    pub(crate) fn spin(&self, posture: &Posture, row: usize) -> f64 {
        dot(posture.axles[row].rate, along(posture.normals[row])) / self.rows[row].radius_m
    }
}
