//! Symmetric matrices of 3 x 3: inverse, determinant and eigenvalues, in a number of operations that is known.

use crate::Real;

/// Sweeps of Jacobi's method: it converges quadratically, and three rotations that are left after
/// the fourth change no digit of `f64`.
const SWEEPS: usize = 6;

/// Rows of a matrix.
pub(crate) type Rows<R> = [[R; 3]; 3];

/// `a b`.
fn product<R: Real>(a: &Rows<R>, b: &Rows<R>) -> Rows<R> {
    let [x, y, z] = b;
    a.map(|[p, q, r]| {
        let [ax, ay, az] = x.map(|value| p * value);
        let [bx, by, bz] = y.map(|value| q * value);
        let [cx, cy, cz] = z.map(|value| r * value);
        [ax + bx + cx, ay + by + cy, az + bz + cz]
    })
}

/// The minors of the first row's columns.
fn minors<R: Real>([_, y, z]: &Rows<R>) -> [R; 3] {
    [
        y[1] * z[2] - z[1] * y[2],
        y[0] * z[2] - z[0] * y[2],
        y[0] * z[1] - z[0] * y[1],
    ]
}

pub(super) fn determinant<R: Real>(matrix: &Rows<R>) -> R {
    let ([a, b, c], [x, y, z]) = (matrix[0], minors(matrix));
    a * x - b * y + c * z
}

/// The inverse, by cofactors; none if the determinant is 0.
pub(crate) fn inverse<R: Real>(matrix: &Rows<R>) -> Option<Rows<R>> {
    let det = determinant(matrix);
    let ([a, b, c], [d, e, f], [g, h, i]) = (matrix[0], matrix[1], matrix[2]);
    let [x, y, z] = minors(matrix);
    let cofactors = [
        [x, c * h - i * b, b * f - e * c],
        [-y, a * i - g * c, c * d - f * a],
        [z, b * g - h * a, a * e - d * b],
    ];
    (det != R::zero()).then(|| cofactors.map(|row| row.map(|cofactor| cofactor / det)))
}

/// `inverse` of `matrix` after one step of Newton's method: `X + (I - X M) X`.
pub(super) fn refined<R: Real>(inverse: &Rows<R>, matrix: &Rows<R>) -> Rows<R> {
    let [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = product(inverse, matrix);
    let (one, zero) = (R::one(), R::zero());
    let rest = [
        [one - xx, zero - xy, zero - xz],
        [zero - yx, one - yy, zero - yz],
        [zero - zx, zero - zy, one - zz],
    ];
    let mut sum = product(&rest, inverse);
    for (sums, values) in sum.iter_mut().zip(inverse) {
        for (sum, value) in sums.iter_mut().zip(values) {
            *sum += *value;
        }
    }
    sum
}

/// Smallest and largest eigenvalue of a symmetric matrix, by Jacobi's rotations: each makes one of
/// the three other elements 0.
pub(super) fn eigenvalues<R: Real>(matrix: &Rows<R>) -> [R; 2] {
    let ([mut xx, mut xy, mut xz], [_, mut yy, mut yz], [_, _, mut zz]) = (matrix[0], matrix[1], matrix[2]);
    for _ in 0..SWEEPS {
        rotate([&mut xx, &mut yy], &mut xy, [&mut xz, &mut yz]);
        rotate([&mut xx, &mut zz], &mut xz, [&mut xy, &mut yz]);
        rotate([&mut yy, &mut zz], &mut yz, [&mut xy, &mut xz]);
    }
    let least = |a, b| if a < b { a } else { b };
    let most = |a, b| if a > b { a } else { b };
    [least(least(xx, yy), zz), most(most(xx, yy), zz)]
}

/// Turns two axes until they have nothing in `common`; `third` is what each has in common with the third axis.
fn rotate<R: Real>([p, q]: [&mut R; 2], common: &mut R, [pr, qr]: [&mut R; 2]) {
    if *common == R::zero() {
        return;
    }
    let one = R::one();
    let cotangent = (*q - *p) / (R::of(2.0) * *common); // of twice the angle
    let size = cotangent.abs() + (cotangent * cotangent + one).sqrt();
    let tangent = if cotangent < R::zero() { -one } else { one } / size;
    let cosine = one / (tangent * tangent + one).sqrt();
    let sine = tangent * cosine;
    *p -= tangent * *common;
    *q += tangent * *common;
    *common = R::zero();
    (*pr, *qr) = (cosine * *pr - sine * *qr, sine * *pr + cosine * *qr);
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3;
    use proptest::prelude::*;

    /// `B^T B` of any rows, and the same for nalgebra.
    fn gram(b: [[f64; 3]; 3]) -> (Rows<f64>, Matrix3<f64>) {
        let mut rows = [[0.0; 3]; 3];
        for row in b {
            for i in 0..3 {
                for j in 0..3 {
                    rows[i][j] += row[i] * row[j];
                }
            }
        }
        (rows, Matrix3::from_fn(|i, j| rows[i][j]))
    }

    fn bits(rows: Rows<f64>) -> [[u64; 3]; 3] {
        rows.map(|row| row.map(f64::to_bits))
    }

    fn rows(matrix: &Matrix3<f64>) -> Rows<f64> {
        core::array::from_fn(|i| core::array::from_fn(|j| matrix[(i, j)]))
    }

    proptest! {
        #[test]
        fn inverse_product_and_determinant_are_nalgebra_s_bit_for_bit(b in any_rows()) {
            let (a, theirs) = gram(b);
            prop_assert_eq!(determinant(&a).to_bits(), theirs.determinant().to_bits());
            prop_assert_eq!(inverse(&a).map(bits), theirs.try_inverse().map(|m| bits(rows(&m))));
            let other = Matrix3::from_fn(|i, j| b[i][j]);
            prop_assert_eq!(bits(product(&a, &b)), bits(rows(&(theirs * other))));
            let step = theirs + (Matrix3::identity() - theirs * other) * theirs;
            prop_assert_eq!(bits(refined(&a, &b)), bits(rows(&step)));
        }

        #[test]
        fn eigenvalues_are_nalgebra_s_to_the_rounding_of_the_largest(b in any_rows()) {
            let (a, theirs) = gram(b);
            let expected = theirs.symmetric_eigenvalues();
            let [least, most] = eigenvalues(&a);
            let rounding = 16.0 * f64::EPSILON * most;
            prop_assert!((most - expected.max()).abs() <= rounding && (least - expected.min()).abs() <= rounding);
            let single = a.map(|row| row.map(|value| value as f32));
            let [least_single, most_single] = eigenvalues(&single).map(f64::from);
            let rounding = 16.0 * f64::from(f32::EPSILON) * most;
            prop_assert!((most - most_single).abs() <= rounding && (least - least_single).abs() <= rounding);
        }
    }

    fn any_rows() -> impl Strategy<Value = [[f64; 3]; 3]> {
        prop::array::uniform3(prop::array::uniform3(prop_oneof![
            4 => -2.0..2.0_f64,
            1 => Just(0.0),
            1 => Just(1.0),
            1 => -1e-6..1e-6_f64,
        ]))
    }

    #[test]
    fn equal_eigenvalues_lose_no_digit() {
        // 1, 1 and 4 along (1, 1, 1): two that are equal lose half the digits in a cubic's closed form.
        let [least, most] = eigenvalues(&[[2.0_f64, 1.0, 1.0], [1.0, 2.0, 1.0], [1.0, 1.0, 2.0]]);
        assert!((least - 1.0).abs() < 4.0 * f64::EPSILON && (most - 4.0).abs() < 8.0 * f64::EPSILON);
        assert_eq!(
            eigenvalues(&[[1.0_f32, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
            [1.0, 1.0]
        );
        assert!(eigenvalues(&[[f64::NAN; 3]; 3])[0].is_nan());
        assert_eq!(
            inverse(&[[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0_f32]]),
            None
        );
    }
}
