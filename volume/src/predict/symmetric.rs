//! Symmetric matrices of which only the lower half is kept, row by row and without gaps.
//!
//! Half of the numbers means half of the memory traffic, which is what an update of O(m²) costs; a
//! row is contiguous, so that plain loops become vector instructions; a matrix grows by appending a
//! row and loses its first row and column by moving the others forward. And it cannot lose its
//! symmetry to rounding, which recursive least squares would otherwise have to restore from time to
//! time (dlib, issue 1221).
//!
//! Invariant: `numbers.len()` = order · (order + 1) / 2.

use wide::f64x4;

/// A symmetric matrix.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Symmetric {
    order: usize,
    numbers: Vec<f64>,
}

/// Σ aᵢ·bᵢ in a fixed order.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a_parts, a_rest) = a.as_chunks::<4>();
    let (b_parts, b_rest) = b.as_chunks::<4>();
    let mut sums = f64x4::ZERO;
    for (a, b) in a_parts.iter().zip(b_parts) {
        sums += f64x4::new(*a) * f64x4::new(*b);
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.to_array().iter().sum::<f64>() + rest
}

impl Symmetric {
    /// Rows.
    pub(super) fn order(&self) -> usize {
        self.order
    }

    /// Removes all rows; the memory is kept.
    pub(super) fn clear(&mut self) {
        self.order = 0;
        self.numbers.clear();
    }

    /// The part of a row up to the diagonal.
    fn row(&self, row: usize) -> &[f64] {
        let start = row * (row + 1) / 2;
        &self.numbers[start..=start + row]
    }

    /// An element of the diagonal.
    pub(super) fn diagonal(&self, row: usize) -> f64 {
        self.numbers[row * (row + 3) / 2]
    }

    /// The sum of the diagonal.
    pub(super) fn trace(&self) -> f64 {
        (0..self.order).map(|row| self.diagonal(row)).sum()
    }

    /// Appends a row, up to the diagonal: `order` + 1 numbers.
    pub(super) fn push(&mut self, row: impl Iterator<Item = f64>) {
        self.numbers.extend(row);
        self.order += 1;
        debug_assert_eq!(self.numbers.len(), self.order * (self.order + 1) / 2);
    }

    /// The first column, without its first element, into `column`; then removes first row and column.
    pub(super) fn remove_first(&mut self, column: &mut Vec<f64>) {
        column.clear();
        column.extend((1..self.order).map(|row| self.numbers[row * (row + 1) / 2]));
        let mut to = 0;
        for row in 1..self.order {
            let from = row * (row + 1) / 2 + 1;
            self.numbers.copy_within(from..from + row, to);
            to += row;
        }
        self.numbers.truncate(to);
        self.order = self.order.saturating_sub(1);
    }

    /// product = self · vector.
    ///
    /// Every number is used twice, for its row and for its column; two rows are taken at a time, so
    /// that what they share is read and written once.
    pub(super) fn multiply(&self, vector: &[f64], product: &mut Vec<f64>) {
        debug_assert_eq!(vector.len(), self.order);
        product.clear();
        product.resize(self.order, 0.0);
        let mut row = 0;
        while row + 1 < self.order {
            let (first, second) = (self.row(row), self.row(row + 1));
            let own = [vector[row], vector[row + 1]];
            let sums = two_rows(
                &first[..row],
                &second[..row],
                &vector[..row],
                own,
                &mut product[..row],
            );
            let corner = [first[row], second[row], second[row + 1]];
            product[row] = sums[0] + corner[0] * own[0] + corner[1] * own[1];
            product[row + 1] = sums[1] + corner[1] * own[0] + corner[2] * own[1];
            row += 2;
        }
        if row < self.order {
            let numbers = self.row(row);
            let own = vector[row];
            product[row] = dot(numbers, vector);
            for (product, number) in product[..row].iter_mut().zip(numbers) {
                *product += number * own;
            }
        }
    }

    /// self ← (self + factor · v · vᵀ) · scale.
    pub(super) fn add_outer(&mut self, factor: f64, vector: &[f64], scale: f64) {
        let factor = factor * scale;
        let mut start = 0;
        for row in 0..self.order {
            let numbers = &mut self.numbers[start..=start + row];
            let own = factor * vector[row];
            if scale == 1.0 {
                for (number, other) in numbers.iter_mut().zip(vector) {
                    *number += own * other;
                }
            } else {
                for (number, other) in numbers.iter_mut().zip(vector) {
                    *number = *number * scale + own * other;
                }
            }
            start += row + 1;
        }
    }

    /// The inverse of a positive definite matrix, by the factors L · Lᵀ of Cholesky; `None` if it is
    /// not positive definite to working precision.
    pub(super) fn inverse(&self) -> Option<Self> {
        let order = self.order;
        let at = |row: usize, column: usize| row * (row + 1) / 2 + column;
        // L, row by row.
        let mut lower = self.numbers.clone();
        for row in 0..order {
            for column in 0..=row {
                let (a, b) = (at(row, 0), at(column, 0));
                let sum = dot(&lower[a..a + column], &lower[b..b + column]);
                let rest = lower[at(row, column)] - sum;
                lower[at(row, column)] = if column < row {
                    rest / lower[at(column, column)]
                } else if rest > f64::EPSILON * self.diagonal(row) {
                    rest.sqrt()
                } else {
                    return None;
                };
            }
        }
        // L⁻¹, in the same form.
        let mut inverse = vec![0.0; lower.len()];
        for column in 0..order {
            inverse[at(column, column)] = 1.0 / lower[at(column, column)];
            for row in column + 1..order {
                let sum: f64 = (column..row)
                    .map(|k| lower[at(row, k)] * inverse[at(k, column)])
                    .sum();
                inverse[at(row, column)] = -sum / lower[at(row, row)];
            }
        }
        // L⁻ᵀ · L⁻¹.
        let mut result = Self::default();
        for row in 0..order {
            result.push((0..=row).map(|column| {
                (row..order)
                    .map(|k| inverse[at(k, row)] * inverse[at(k, column)])
                    .sum()
            }));
        }
        Some(result)
    }

    /// The element of a row and a column.
    #[cfg(test)]
    pub(super) fn at(&self, row: usize, column: usize) -> f64 {
        self.row(row.max(column))[row.min(column)]
    }

    /// Whether all numbers of the last row are finite; those before were looked at when they were
    /// last, or came from finite ones by [`Symmetric::add_outer`].
    pub(super) fn last_row_is_finite(&self) -> bool {
        self.order == 0 || self.row(self.order - 1).iter().all(|n| n.is_finite())
    }
}

/// Adds `own` · rows to `product` and returns rows · `vector`, in one pass.
fn two_rows(
    first: &[f64],
    second: &[f64],
    vector: &[f64],
    own: [f64; 2],
    product: &mut [f64],
) -> [f64; 2] {
    let mut sums = [f64x4::ZERO; 2];
    let factors = own.map(f64x4::splat);
    let (first_parts, _) = first.as_chunks::<4>();
    let (second_parts, _) = second.as_chunks::<4>();
    let (vector_parts, _) = vector.as_chunks::<4>();
    let (product_parts, _) = product.as_chunks_mut::<4>();
    let rows = first_parts.iter().zip(second_parts);
    let columns = vector_parts.iter().zip(product_parts);
    for ((a, b), (v, p)) in rows.zip(columns) {
        let [a, b, v] = [a, b, v].map(|part| f64x4::new(*part));
        sums[0] += a * v;
        sums[1] += b * v;
        *p = (f64x4::new(*p) + (a * factors[0] + b * factors[1])).to_array();
    }
    let whole = vector.len() / 4 * 4;
    let mut rest = [0.0; 2];
    for i in whole..vector.len() {
        rest[0] += first[i] * vector[i];
        rest[1] += second[i] * vector[i];
        product[i] += first[i] * own[0] + second[i] * own[1];
    }
    [0, 1].map(|row| sums[row].to_array().iter().sum::<f64>() + rest[row])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A · Aᵀ + I of numbers that look random.
    fn definite(order: usize) -> Symmetric {
        let a = |i: usize, j: usize| ((i * 31 + j * 17 + 5) % 23) as f64 / 23.0 - 0.5;
        let mut matrix = Symmetric::default();
        for row in 0..order {
            matrix.push((0..=row).map(|column| {
                let sum: f64 = (0..order).map(|k| a(row, k) * a(column, k)).sum();
                sum + f64::from(u8::from(row == column))
            }));
        }
        matrix
    }

    #[test]
    fn products_are_those_of_the_full_matrix() {
        for order in [0, 1, 2, 7, 8, 9, 33] {
            let mut matrix = definite(order);
            let vector: Vec<f64> = (0..order).map(|i| (i as f64).sin()).collect();
            let mut product = vec![9.0; 3];
            matrix.multiply(&vector, &mut product);
            assert_eq!(product.len(), order);
            for (row, got) in product.iter().enumerate() {
                let expected: f64 = (0..order).map(|k| matrix.at(row, k) * vector[k]).sum();
                assert!((got - expected).abs() < 1e-12);
            }
            let before = matrix.clone();
            matrix.add_outer(-0.5, &vector, 2.0);
            for row in 0..order {
                for column in 0..order {
                    let outer = -0.5 * vector[row] * vector[column];
                    let expected = (before.at(row, column) + outer) * 2.0;
                    assert!((matrix.at(row, column) - expected).abs() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn a_matrix_times_its_inverse_is_one() {
        for order in [1, 2, 5, 24] {
            let matrix = definite(order);
            let inverse = matrix.inverse().unwrap();
            for row in 0..order {
                for column in 0..order {
                    let got: f64 = (0..order)
                        .map(|k| matrix.at(row, k) * inverse.at(k, column))
                        .sum();
                    let expected = f64::from(u8::from(row == column));
                    assert!((got - expected).abs() < 1e-10, "{row} {column}: {got}");
                }
            }
        }
        let mut singular = Symmetric::default();
        singular.push([1.0].into_iter());
        singular.push([1.0, 1.0].into_iter());
        assert_eq!(singular.inverse(), None);
    }

    #[test]
    fn without_its_first_row_and_column() {
        let before = definite(6);
        let mut after = before.clone();
        let mut column = Vec::new();
        after.remove_first(&mut column);
        assert_eq!(after.order(), 5);
        for (i, first) in column.clone().into_iter().enumerate() {
            assert_eq!(first, before.at(i + 1, 0));
            for j in 0..5 {
                assert_eq!(after.at(i, j), before.at(i + 1, j + 1));
            }
        }
        for _ in 0..6 {
            after.remove_first(&mut column);
        }
        assert_eq!(after, Symmetric::default());
    }
}
