//! Transfer functions between others.

use super::TransferKey;
use crate::transfer::{ControlPoint, TransferFunction};

/// Blends within blends that are followed: what was seen before is then taken to have been whole.
const MAX_DEPTH: usize = 4;

/// What is seen at a time at which key `key` holds, if it is being blended in.
pub(super) fn at(keys: &[TransferKey], key: usize, time: f64) -> Option<TransferFunction> {
    nested(keys, key, time, MAX_DEPTH)
}

fn nested(keys: &[TransferKey], key: usize, time: f64, depth: usize) -> Option<TransferFunction> {
    let own = &keys[key];
    let before = key.checked_sub(1)?;
    let share = (time - own.t) / own.blend_s;
    // Not a number if both are 0: a switch.
    if !(0.0..1.0).contains(&share) {
        return None;
    }
    let start = match depth {
        0 => None,
        _ => nested(keys, before, own.t, depth - 1),
    };
    let start = start.as_ref().unwrap_or(&keys[before].points);
    Some(between(start, &own.points, share))
}

/// The function at a share, 0..=1, of the way from one to another; exact at every value.
pub(super) fn between(
    from: &TransferFunction,
    to: &TransferFunction,
    share: f64,
) -> TransferFunction {
    let mut values: Vec<f32> = from
        .points()
        .iter()
        .chain(to.points())
        .map(|point| point.value)
        .collect();
    values.sort_by(f32::total_cmp);
    values.dedup();
    let mix = |a: [f64; 4], b: [f64; 4]| -> [f64; 4] {
        std::array::from_fn(|i| a[i] * (1.0 - share) + b[i] * share)
    };
    let point = |value: f32, rgba: [f64; 4]| {
        // Rounding may leave the range by an ulp.
        let [r, g, b, opacity] = rgba.map(|c| (c as f32).clamp(0.0, 1.0));
        ControlPoint {
            value,
            colour: [r, g, b],
            opacity,
        }
    };
    let mut points = Vec::with_capacity(values.len());
    for value in values {
        let left = point(value, mix(left_of(from, value), left_of(to, value)));
        let at = f64::from(value);
        let right = point(value, mix(from.at(at), to.at(at)));
        if left != right {
            points.push(left);
        }
        points.push(right);
    }
    TransferFunction::new(points).unwrap_or_else(|_| to.clone())
}

/// What the function tends to below a value.
fn left_of(function: &TransferFunction, value: f32) -> [f64; 4] {
    let points = function.points();
    let first = points.partition_point(|point| point.value < value);
    match points.get(first) {
        // The first of the points there, unless nothing is on its left.
        Some(point) if point.value == value && first > 0 => {
            let [r, g, b] = point.colour;
            [r, g, b, point.opacity].map(f64::from)
        }
        _ => function.at(f64::from(value)),
    }
}

/// The function with its first point moved to the low end of a range, its last to the high end, and
/// the others in between. A function at a single value moves to the middle.
pub(super) fn stretched(function: &TransferFunction, [low, high]: [f32; 2]) -> TransferFunction {
    let points = function.points();
    let first = f64::from(points[0].value);
    let width = f64::from(points[points.len() - 1].value) - first;
    let [start, end] = [low, high].map(f64::from);
    let moved = points.iter().map(|point| {
        let share = if width > 0.0 {
            (f64::from(point.value) - first) / width
        } else {
            0.5
        };
        ControlPoint {
            value: (start * (1.0 - share) + end * share) as f32,
            ..*point
        }
    });
    TransferFunction::new(moved.collect()).unwrap_or_else(|_| function.clone())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn function(points: &[[f32; 5]]) -> TransferFunction {
        TransferFunction::new(points.iter().map(|&point| point.into()).collect()).unwrap()
    }

    fn pair() -> (TransferFunction, TransferFunction) {
        (
            function(&[
                [0.0; 5],
                [2.0, 0.4, 0.2, 0.0, 0.0],
                [2.0, 0.4, 0.2, 0.0, 0.8],
                [5.0, 1.0, 1.0, 1.0, 0.1],
            ]),
            function(&[[1.0, 0.5, 0.5, 0.5, 0.3], [6.0, 0.0, 1.0, 0.0, 0.9]]),
        )
    }

    #[test]
    fn a_blend_is_exact_at_every_value() {
        let (from, to) = pair();
        for share in [0.0, 0.25, 0.5, 1.0] {
            let blended = between(&from, &to, share);
            for step in -10..80 {
                let value = f64::from(step) * 0.1 + 0.013;
                let (a, b) = (from.at(value), to.at(value));
                for (i, got) in blended.at(value).into_iter().enumerate() {
                    let expected = a[i] * (1.0 - share) + b[i] * share;
                    assert!((got - expected).abs() < 1e-6, "{share} {value}: {got}");
                }
            }
        }
    }

    #[test]
    fn blends_begin_with_what_was_seen() {
        let (a, b) = pair();
        let key = |t, points: &TransferFunction, blend_s| TransferKey {
            t,
            points: points.clone(),
            blend_s,
        };
        let keys = [key(0.0, &a, 0.0), key(1.0, &b, 2.0), key(2.0, &a, 1.0)];
        assert_eq!(at(&keys, 0, 0.5), None);
        let half = at(&keys, 1, 2.0).unwrap();
        let again = at(&keys, 2, 2.0).unwrap();
        for value in [0.5, 1.9, 3.0, 5.5] {
            for i in 0..4 {
                assert!((half.at(value)[i] - again.at(value)[i]).abs() < 1e-6);
            }
        }
        assert_eq!(at(&keys, 2, 3.0), None);
        // A first key has nothing to be blended from.
        assert_eq!(at(&[key(0.0, &a, 5.0)], 0, 1.0), None);
    }

    #[test]
    fn windows_move_points() {
        let (function, _) = pair();
        let moved = stretched(&function, [100.0, 200.0]);
        let values: Vec<f32> = moved.points().iter().map(|point| point.value).collect();
        assert_eq!(values, [100.0, 140.0, 140.0, 200.0]);
        assert_eq!(moved.at(140.0)[3], f64::from(0.8_f32));
    }
}
