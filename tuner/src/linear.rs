//! Symmetric positive definite systems by their Cholesky factor, a lower triangle row by row.
//!
//! Golub & Van Loan, *Matrix Computations*, 4th edition 2013, sections 4.2 (factor) and 6.5.4 (a row more).
//!
//! Invariant: in row r of a packed triangle lie columns 0..=r, from `triangle(r)` on.

/// Eight sums side by side: one after the other would wait for each addition.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    const WIDE: usize = 8;
    let mut sums = [0.0; WIDE];
    let (a_wide, b_wide) = (a.chunks_exact(WIDE), b.chunks_exact(WIDE));
    let rest: f64 = (a_wide.remainder().iter().zip(b_wide.remainder()))
        .map(|(a, b)| a * b)
        .sum();
    for (a, b) in a_wide.zip(b_wide) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    sums.iter().sum::<f64>() + rest
}

/// Where a row of a lower triangle begins.
pub(crate) fn triangle(row: usize) -> usize {
    row * (row + 1) / 2
}

/// The Cholesky factor of a symmetric matrix, in its place.
pub(crate) fn factorise(matrix: &mut [f64], count: usize) -> Option<()> {
    for row in 0..count {
        let start = triangle(row);
        for column in 0..=row {
            let (above, own) = matrix.split_at_mut(start);
            let other = if column == row {
                &own[..column]
            } else {
                &above[triangle(column)..triangle(column) + column]
            };
            let rest = own[column] - dot(&own[..column], other);
            own[column] = if column == row {
                if rest.is_nan() || rest <= 0.0 {
                    return None;
                }
                rest.sqrt()
            } else {
                rest / above[triangle(column) + column]
            };
        }
    }
    Some(())
}

/// L⁻¹ · b.
pub(crate) fn forward(factor: &[f64], b: &[f64]) -> Vec<f64> {
    let mut x: Vec<f64> = Vec::with_capacity(b.len());
    for (row, value) in b.iter().enumerate() {
        let own = &factor[triangle(row)..triangle(row) + row];
        x.push((value - dot(own, &x[..row])) / factor[triangle(row) + row]);
    }
    x
}

/// (L·Lᵀ)⁻¹ · b.
pub(crate) fn solve(factor: &[f64], b: &[f64]) -> Vec<f64> {
    let mut x = forward(factor, b);
    for row in (0..x.len()).rev() {
        x[row] /= factor[triangle(row) + row];
        let own = x[row];
        for (column, value) in x[..row].iter_mut().enumerate() {
            *value -= own * factor[triangle(row) + column];
        }
    }
    x
}

/// Makes the factor of A that of A + x·xᵀ, by one rotation for each column.
pub(crate) fn add_outer_product(factor: &mut [f64], x: &[f64]) {
    let mut rotations: Vec<(f64, f64)> = Vec::with_capacity(x.len());
    for (row, &value) in x.iter().enumerate() {
        let own = &mut factor[triangle(row)..=triangle(row) + row];
        let mut rest = value;
        for (entry, &(cosine, sine)) in own.iter_mut().zip(&rotations) {
            let rotated = cosine * *entry + sine * rest;
            rest = cosine * rest - sine * *entry;
            *entry = rotated;
        }
        let length = own[row].hypot(rest);
        rotations.push((own[row] / length, rest / length));
        own[row] = length;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Stream;

    #[test]
    fn a_row_more_is_the_factor_of_the_sum() {
        const COUNT: usize = 11;
        let mut stream = Stream::new(6);
        let mut matrix = vec![0.0; triangle(COUNT)];
        for row in 0..COUNT {
            matrix[triangle(row) + row] = 0.01;
        }
        let mut factor = matrix.clone();
        factorise(&mut factor, COUNT).unwrap();
        for _ in 0..40 {
            let x: Vec<f64> = stream.point(COUNT).iter().map(|x| x - 0.5).collect();
            add_outer_product(&mut factor, &x);
            for row in 0..COUNT {
                for column in 0..=row {
                    matrix[triangle(row) + column] += x[row] * x[column];
                }
            }
            let mut dense = matrix.clone();
            factorise(&mut dense, COUNT).unwrap();
            for (a, b) in factor.iter().zip(&dense) {
                assert!((a - b).abs() < 1e-10, "{a} {b}");
            }
        }
    }

    #[test]
    fn a_system_worked_by_hand() {
        // (4 2; 2 5) = (2 0; 1 2)·(2 1; 0 2), and (1, 2) times it is (8, 12).
        let mut factor = vec![4.0, 2.0, 5.0];
        factorise(&mut factor, 2).unwrap();
        assert_eq!(factor, [2.0, 1.0, 2.0]);
        assert_eq!(solve(&factor, &[8.0, 12.0]), [1.0, 2.0]);
        assert_eq!(factorise(&mut [1.0, 2.0, 1.0], 2), None);
    }
}
