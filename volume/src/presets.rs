//! Transfer functions by name, for volumes that come without one.
//!
//! Idea: a preset has its points at shares of a window of values. The window is the range of the
//! data, or percentiles of it where outliers would take most of the range. Points outside the
//! window are not needed: functions are constant beyond their ends.
//!
//! Not good for: data whose values have a meaning of their own, as Hounsfield units do. Their own
//! function, from a view file, shows more.

use crate::{
    grid::Volume,
    statistics::Statistics,
    transfer::{ControlPoint, TransferFunction},
};

/// The presets: name, and what it is for.
pub const PRESETS: &[(&str, &str)] = &[
    (
        "ramp",
        "grey, opacity growing with the value: a first look at anything",
    ),
    (
        "fire",
        "black, red, yellow, white with little opacity: simulations, nebulae",
    ),
    (
        "soft-tissue",
        "the lower middle of the window, half transparent: CT and MR",
    ),
    (
        "bone",
        "the upper half of the window, nearly opaque: CT, metal",
    ),
    (
        "surface",
        "a thin band around the middle of the window: like an iso-surface",
    ),
];

/// Points of a preset: share of the window, red, green, blue, opacity of one voxel's length.
fn points(name: &str) -> Option<&'static [[f32; 5]]> {
    Some(match name {
        "ramp" => &[[0.0, 0.0, 0.0, 0.0, 0.0], [1.0, 1.0, 1.0, 1.0, 0.3]],
        "fire" => &[
            [0.0, 0.0, 0.0, 0.0, 0.0],
            [0.1, 0.2, 0.0, 0.05, 0.0],
            [0.4, 0.9, 0.1, 0.0, 0.02],
            [0.7, 1.0, 0.7, 0.1, 0.06],
            [1.0, 1.0, 1.0, 0.9, 0.2],
        ],
        "soft-tissue" => &[
            [0.0, 0.0, 0.0, 0.0, 0.0],
            [0.1, 0.5, 0.25, 0.2, 0.0],
            [0.3, 0.8, 0.45, 0.35, 0.03],
            [0.5, 0.9, 0.7, 0.55, 0.06],
            [1.0, 1.0, 0.95, 0.9, 0.3],
        ],
        "bone" => &[
            [0.0, 0.0, 0.0, 0.0, 0.0],
            [0.4, 0.7, 0.5, 0.4, 0.0],
            [0.6, 0.95, 0.85, 0.7, 0.25],
            [1.0, 1.0, 1.0, 1.0, 0.9],
        ],
        "surface" => &[
            [0.0, 0.0, 0.0, 0.0, 0.0],
            [0.45, 0.9, 0.75, 0.5, 0.0],
            [0.5, 0.9, 0.75, 0.5, 0.6],
            [0.55, 0.9, 0.75, 0.5, 0.0],
            [1.0, 0.0, 0.0, 0.0, 0.0],
        ],
        _ => return None,
    })
}

/// The preset of that name over a window of values; `None` if there is no such preset. A window of
/// no width makes a jump.
///
/// ```
/// let bone = raywright_volume::presets::preset("bone", [-1000.0, 2000.0]).expect("a preset");
/// assert_eq!(bone.at(-1000.0)[3], 0.0);
/// assert!(bone.at(2000.0)[3] > 0.8);
/// ```
#[must_use]
pub fn preset(name: &str, [low, high]: [f32; 2]) -> Option<TransferFunction> {
    let finite = |v: f32| if v.is_finite() { v } else { 0.0 };
    let (low, high) = (finite(low.min(high)), finite(high.max(low)));
    let (low, high) = (low.min(high), high.max(low));
    let points = points(name)?.iter().map(|&[share, r, g, b, opacity]| {
        // Not low + share · (high − low), whose difference may leave single precision.
        let value = f64::from(low) * f64::from(1.0 - share) + f64::from(high) * f64::from(share);
        ControlPoint {
            value: value as f32,
            colour: [r, g, b],
            opacity,
        }
    });
    TransferFunction::new(points.collect()).ok()
}

/// A window for presets: from the smallest value to the 99.9th percentile, which leaves out metal
/// and hot pixels; the whole range if nothing is left then.
#[must_use]
pub fn window(volume: &Volume, statistics: &Statistics) -> [f32; 2] {
    let [low, high] = volume.range();
    let top = (statistics.percentile(0.999) as f32).clamp(low, high);
    if top > low { [low, top] } else { [low, high] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::{ValueScale, Voxels};

    #[test]
    fn every_preset_is_a_function_over_any_window() {
        for window in [
            [0.0, 1.0],
            [-1000.0, 3000.0],
            [5.0, 5.0],
            [f32::MIN, f32::MAX],
            [3.0, -3.0],
            [f32::NAN, 1.0],
            [f32::NEG_INFINITY, f32::INFINITY],
            [1e-45, 2e-45],
        ] {
            for (name, _) in PRESETS {
                assert!(preset(name, window).is_some(), "{name} {window:?}");
            }
        }
        assert_eq!(preset("magic", [0.0, 1.0]), None);
    }

    #[test]
    fn a_window_leaves_out_the_brightest() {
        let mut values = vec![0_u16; 5000];
        values[0] = 60_000;
        values[1..1000].fill(500);
        let volume = Volume::new(
            [5000, 1, 1],
            [1.0; 3],
            Voxels::U16(values),
            ValueScale::default(),
        );
        let volume = volume.unwrap();
        assert_eq!(window(&volume, &Statistics::of(&volume)), [0.0, 500.0]);
        let flat = Volume::new(
            [3, 1, 1],
            [1.0; 3],
            Voxels::U8(vec![4; 3]),
            ValueScale::default(),
        );
        let flat = flat.unwrap();
        assert_eq!(window(&flat, &Statistics::of(&flat)), [4.0, 4.0]);
    }
}
