//! Fields of heights as parry has them.

use rapier3d_f64::parry::utils::Array2;
use rapier3d_f64::prelude::{AngVector, Pose, Vector};

/// Heights, scale and pose of a field of `rows` and `columns` of heights \[m\], row by row, from `from_m` on.
///
/// parry's fields have y up, rows along z and columns along x. Turned by a quarter about x they
/// have z up and rows to the right; so rows here are columns there.
pub(super) fn height_field(
    from_m: f64,
    [length, width]: [f64; 2],
    [rows, columns]: [usize; 2],
    heights_m: &[f64],
) -> (Array2<f64>, Vector, Pose) {
    let mut heights = Array2::repeat(columns, rows, 0.0);
    for i in 0..rows {
        for j in 0..columns {
            heights[(j, i)] = heights_m[i * columns + j];
        }
    }
    let quarter = std::f64::consts::FRAC_PI_2;
    let middle = Vector::new(from_m + length / 2.0, 0.0, 0.0);
    let pose = Pose::new(middle, AngVector::new(quarter, 0.0, 0.0));
    (heights, Vector::new(length, 1.0, width), pose)
}
