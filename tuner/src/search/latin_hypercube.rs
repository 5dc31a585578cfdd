//! Latin hypercube: n points such that each of n equal slices of every axis holds exactly one.
//!
//! McKay, Beckman & Conover, "A Comparison of Three Methods for Selecting Values of Input Variables
//! in the Analysis of Output from a Computer Code", Technometrics 1979.

use crate::rng::Stream;

/// `count` points in the unit cube of `dimensions` axes, uniform within their slices.
pub(crate) fn latin_hypercube(
    count: usize,
    dimensions: usize,
    stream: &mut Stream,
) -> Vec<Vec<f64>> {
    let mut points = vec![Vec::with_capacity(dimensions); count];
    let mut slices: Vec<usize> = (0..count).collect();
    for _ in 0..dimensions {
        stream.shuffle(&mut slices);
        for (point, &slice) in points.iter_mut().zip(&slices) {
            point.push((slice as f64 + stream.unit()) / count as f64);
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_slice_of_every_axis_holds_one_point() {
        for seed in 0..50 {
            let (count, dimensions) = (3 + seed as usize % 10, 1 + seed as usize % 7);
            let points = latin_hypercube(count, dimensions, &mut Stream::new(seed));
            for axis in 0..dimensions {
                let mut slices: Vec<usize> = points
                    .iter()
                    .map(|point| (point[axis] * count as f64) as usize)
                    .collect();
                slices.sort_unstable();
                assert_eq!(slices, (0..count).collect::<Vec<_>>());
            }
        }
    }

    #[test]
    fn axes_are_not_coupled() {
        // With one permutation for all axes every point would lie near the diagonal.
        let points = latin_hypercube(100, 2, &mut Stream::new(3));
        let far = points
            .iter()
            .filter(|point| (point[0] - point[1]).abs() > 0.1)
            .count();
        assert!(far > 50, "{far}");
    }
}
