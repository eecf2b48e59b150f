//! Small dense linear algebra of a size that is known when it is compiled.

/// A vector of generalised velocities or forces.
pub(super) type Vector<const N: usize> = [f64; N];
/// A matrix, row by row.
pub(super) type Matrix<const N: usize> = [[f64; N]; N];

/// The scalar product, as two sums side by side: of even and of odd entries.
#[inline(always)]
pub(super) fn dot<const N: usize>(a: &Vector<N>, b: &Vector<N>) -> f64 {
    let mut sums = [0.0; 2];
    for i in 0..N / 2 {
        sums = [
            sums[0] + a[2 * i] * b[2 * i],
            sums[1] + a[2 * i + 1] * b[2 * i + 1],
        ];
    }
    if N % 2 == 1 {
        sums[0] += a[N - 1] * b[N - 1];
    }
    sums[0] + sums[1]
}

/// Adds `factor` times `b` to `a`.
#[inline(always)]
pub(super) fn add<const N: usize>(a: &mut Vector<N>, factor: f64, b: &Vector<N>) {
    for i in 0..N {
        a[i] += factor * b[i];
    }
}

/// Adds `factor a b^T` to a matrix.
#[inline(always)]
pub(super) fn add_outer<const N: usize>(matrix: &mut Matrix<N>, factor: f64, a: &Vector<N>, b: &Vector<N>) {
    for i in 0..N {
        let scaled = factor * a[i];
        for j in 0..N {
            matrix[i][j] += scaled * b[j];
        }
    }
}

/// Adds `factor a a^T` to the upper half of a matrix. Some of what is below the diagonal changes too, and means
/// nothing.
#[inline(always)]
pub(super) fn add_square<const N: usize>(matrix: &mut Matrix<N>, factor: f64, a: &Vector<N>) {
    for i in 0..N {
        let scaled = factor * a[i];
        for j in i & !1..N {
            matrix[i][j] += scaled * a[j]; // by two, as registers are wide
        }
    }
}

/// Copies the upper half of a symmetric matrix to its lower half.
#[inline(always)]
pub(super) fn mirror<const N: usize>(matrix: &mut Matrix<N>) {
    for i in 1..N {
        for j in 0..i {
            matrix[i][j] = matrix[j][i];
        }
    }
}

/// The middle between two vectors.
#[inline(always)]
pub(super) fn middle<const N: usize>(a: &Vector<N>, b: &Vector<N>) -> Vector<N> {
    let mut middle = [0.0; N];
    for i in 0..N {
        middle[i] = 0.5 * (a[i] + b[i]);
    }
    middle
}

/// The product of a matrix and a vector.
#[inline(always)]
pub(super) fn times<const N: usize>(matrix: &Matrix<N>, a: &Vector<N>) -> Vector<N> {
    let mut product = [0.0; N];
    for i in 0..N {
        product[i] = dot(&matrix[i], a);
    }
    product
}

/// The product of a matrix, transposed, and a vector.
#[inline(always)]
pub(super) fn times_transposed<const N: usize>(matrix: &Matrix<N>, a: &Vector<N>) -> Vector<N> {
    let mut product = [0.0; N];
    for i in 0..N {
        add(&mut product, a[i], &matrix[i]);
    }
    product
}

/// Solves `matrix x = right` by elimination, the largest of a column as its pivot.
pub(super) fn solve<const N: usize>(mut matrix: Matrix<N>, mut right: Vector<N>) -> Vector<N> {
    for column in 0..N {
        let mut pivot = column;
        for row in column + 1..N {
            if matrix[row][column].abs() > matrix[pivot][column].abs() {
                pivot = row;
            }
        }
        if pivot != column {
            matrix.swap(column, pivot);
            right.swap(column, pivot);
        }
        let inverse = 1.0 / matrix[column][column];
        let (top, below) = matrix.split_at_mut(column + 1);
        let own = &top[column];
        for (i, row) in below.iter_mut().enumerate() {
            let factor = row[column] * inverse;
            if factor != 0.0 {
                for j in column..N {
                    row[j] -= factor * own[j];
                }
                right[column + 1 + i] -= factor * right[column];
            }
        }
    }
    back_substitute(&matrix, &mut right);
    right
}

/// Solves `matrix x = right` for a symmetric, positive definite matrix, of which the upper half is read: L^T D L.
pub(super) fn solve_symmetric<const N: usize>(mut matrix: Matrix<N>, mut right: Vector<N>) -> Vector<N> {
    for column in 0..N {
        let inverse = 1.0 / matrix[column][column];
        let (top, below) = matrix.split_at_mut(column + 1);
        let own = &top[column];
        for (i, row) in below.iter_mut().enumerate() {
            let at = column + 1 + i;
            let factor = own[at] * inverse;
            for j in at..N {
                row[j] -= factor * own[j];
            }
            right[at] -= factor * right[column];
        }
    }
    back_substitute(&matrix, &mut right);
    right
}

/// Solves for an upper triangular matrix; what is below its diagonal is not read.
fn back_substitute<const N: usize>(matrix: &Matrix<N>, right: &mut Vector<N>) {
    for row in (0..N).rev() {
        let mut rest = right[row];
        for j in row + 1..N {
            rest -= matrix[row][j] * right[j];
        }
        right[row] = rest / matrix[row][row];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_a_symmetric_system_from_its_upper_half() {
        let matrix = [[4.0, 1.0, -2.0], [1.0, 5.0, 0.5], [-2.0, 0.5, 3.0]];
        let x = [0.5, -2.0, 3.0];
        let right = times(&matrix, &x);
        let mut upper = matrix;
        (upper[1][0], upper[2][0], upper[2][1]) = (f64::NAN, f64::NAN, f64::NAN);
        for (found, x) in solve_symmetric(upper, right).iter().zip(x) {
            assert!((found - x).abs() < 1e-14, "{found}, {x}"); // as below
        }
    }

    #[test]
    fn solves_what_needs_its_rows_swapped() {
        // No pivot on the diagonal, and not symmetric.
        let matrix = [[0.0, 2.0, 1.0], [4.0, 0.0, -1.0], [1.0, 3.0, 0.0]];
        let x = [0.5, -2.0, 3.0];
        let found = solve(matrix, times(&matrix, &x));
        for (found, x) in found.iter().zip(x) {
            // Three eliminations of numbers of size one.
            assert!((found - x).abs() < 1e-14, "{found}, {x}");
        }
    }
}
