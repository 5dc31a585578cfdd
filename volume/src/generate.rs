//! Generated volumes, so that pictures and measurements need no file.
//!
//! | name | what | stored as | what it is good for |
//! | --- | --- | --- | --- |
//! | `supernova` | a wrinkled shell around a small core | u8 | much empty space, inside and outside |
//! | `nebula` | five octaves of value noise, denser towards the centre | u16 | little to skip, soft edges |
//! | `marschner-lobb` | the signal of Marschner and Lobb | f32 | errors of interpolation and step |
//!
//! Marschner, Lobb, "An evaluation of reconstruction filters for volume rendering", Visualization
//! 1994, equation 1. All are functions of position in a cube that the grid fills, whatever its
//! sizes, and of a seed.
//!
//! Invariants: the same arguments give the same volume with any number of threads; across platforms
//! up to the rounding of the sine.

use std::f64::consts::PI;

use glam::DVec3;
use rayon::prelude::*;
use raywright_imaging::Camera;

use crate::{
    grid::{GridError, ValueScale, Volume, Voxels},
    transfer::TransferFunction,
    view::overview,
};

/// Names of the generated volumes.
pub const NAMES: [&str; 3] = ["supernova", "nebula", "marschner-lobb"];

/// Voxels of a generated volume at most.
const MAX_VOXELS: u64 = 1 << 34;

/// A generated volume and how to look at it.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Generated {
    /// The volume; distances between voxels are 1, values from 0 to 1.
    pub volume: Volume,
    /// Colours and opacities that suit it.
    pub transfer_function: TransferFunction,
    /// A view of all of it.
    pub camera: Camera,
}

/// Why there is no such volume.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GenerateError {
    /// The name is unknown.
    #[error("no generated volume is called `{name}`; there are {}", NAMES.join(", "))]
    UnknownName {
        /// The name.
        name: String,
    },
    /// Too many voxels, or more than the system has memory for.
    #[error("{} x {} x {} voxels are too many to generate", dims[0], dims[1], dims[2])]
    TooManyVoxels {
        /// The sizes.
        dims: [usize; 3],
    },
    /// The sizes make no grid.
    #[error(transparent)]
    Grid(#[from] GridError),
}

/// The volume of that name; [`NAMES`] has them.
///
/// ```
/// let nebula = raywright_volume::generate::by_name("nebula", [32, 32, 16], 1)?;
/// assert_eq!(nebula.volume.dims(), [32, 32, 16]);
/// # Ok::<(), raywright_volume::generate::GenerateError>(())
/// ```
///
/// # Errors
/// See [`GenerateError`].
pub fn by_name(name: &str, dims: [usize; 3], seed: u64) -> Result<Generated, GenerateError> {
    let fields: [fn(DVec3, u64) -> f64; 3] = [supernova, nebula, marschner_lobb];
    let found = NAMES.iter().zip(fields).find(|(known, _)| **known == name);
    let Some((_, field)) = found else {
        return Err(GenerateError::UnknownName { name: name.into() });
    };
    let level = |value: f64, levels: f64| (value.clamp(0.0, 1.0) * levels).round();
    let (voxels, slope) = match name {
        "supernova" => {
            let values = fill(dims, |p| level(field(p, seed), 255.0) as u8)?;
            (Voxels::U8(values), 1.0 / 255.0)
        }
        "nebula" => {
            let values = fill(dims, |p| level(field(p, seed), 65535.0) as u16)?;
            (Voxels::U16(values), 1.0 / 65535.0)
        }
        _ => (Voxels::F32(fill(dims, |p| field(p, seed) as f32)?), 1.0),
    };
    let scale = ValueScale {
        slope,
        intercept: 0.0,
    };
    let volume = Volume::new(dims, [1.0; 3], voxels, scale)?;
    Ok(Generated {
        camera: overview(&volume),
        transfer_function: transfer_function(name),
        volume,
    })
}

/// The values at all voxels, x fastest. Positions are the middles of cells that fill −1..1.
fn fill<T: Clone + Default + Send>(
    dims: [usize; 3],
    value: impl Fn(DVec3) -> T + Sync,
) -> Result<Vec<T>, GenerateError> {
    if dims.contains(&0) {
        return Err(GridError::Empty { dims }.into());
    }
    let too_many = || GenerateError::TooManyVoxels { dims };
    let count = dims
        .iter()
        .try_fold(1_usize, |n, &size| n.checked_mul(size));
    let count = count.filter(|&n| n as u64 <= MAX_VOXELS);
    let count = count.ok_or_else(too_many)?;
    let mut values = Vec::new();
    values.try_reserve_exact(count).map_err(|_| too_many())?;
    values.resize(count, T::default());
    let at = |index: usize, axis: usize| (2 * index + 1) as f64 / dims[axis] as f64 - 1.0;
    let rows = values.par_chunks_mut(dims[0]).enumerate();
    rows.for_each(|(row, values)| {
        let (y, z) = (row % dims[1], row / dims[1]);
        for (x, slot) in values.iter_mut().enumerate() {
            *slot = value(DVec3::new(at(x, 0), at(y, 1), at(z, 2)));
        }
    });
    Ok(values)
}

/// A shell of radius 0.7 whose radius and density vary with direction, and a core.
fn supernova(position: DVec3, seed: u64) -> f64 {
    let radius = position.length();
    let direction = position.try_normalize().unwrap_or(DVec3::Z);
    let wrinkle = octaves(direction * 3.0, 4, seed) - 0.5;
    let shell = (radius - 0.7 - 0.25 * wrinkle) / 0.06;
    let threads = octaves(position * 9.0, 3, seed ^ 1);
    let core = (radius / 0.12).powi(2);
    let density = (-shell * shell).exp() * (0.4 + 0.6 * threads) + 0.9 * (-core).exp();
    // Thin gas would leave no voxel empty.
    ((density - 0.02) / 0.98).clamp(0.0, 1.0)
}

/// Noise that thins out towards the walls.
fn nebula(position: DVec3, seed: u64) -> f64 {
    let bend = DVec3::new(
        octaves(position * 1.5, 2, seed ^ 1),
        octaves(position * 1.5, 2, seed ^ 2),
        octaves(position * 1.5, 2, seed ^ 3),
    );
    let density = octaves(position * 2.5 + bend * 1.5, 5, seed);
    let fall = 1.0 - position.length_squared() / 1.4;
    ((density - 0.25) * 1.8 * fall.max(0.0)).clamp(0.0, 1.0)
}

/// Equation 1 of the paper with f_M = 6 and α = 0.25: from 0 to 1.
fn marschner_lobb(position: DVec3, _seed: u64) -> f64 {
    const FREQUENCY: f64 = 6.0;
    const ALPHA: f64 = 0.25;
    let radius = position.x.hypot(position.y);
    let ripple = (2.0 * PI * FREQUENCY * (PI * radius / 2.0).cos()).cos();
    let wave = 1.0 - (PI * position.z / 2.0).sin();
    (wave + ALPHA * (1.0 + ripple)) / (2.0 * (1.0 + ALPHA))
}

/// Value noise of several octaves, each twice as fine and half as strong; in 0..1.
fn octaves(position: DVec3, count: u32, seed: u64) -> f64 {
    let (mut sum, mut weight, mut total) = (0.0, 1.0, 0.0);
    let mut position = position;
    for octave in 0..count {
        sum += weight * noise(position, seed.wrapping_add(u64::from(octave) << 32));
        total += weight;
        weight *= 0.5;
        position *= 2.0;
    }
    sum / total
}

/// Random values at integer positions, joined by the polynomial 3t² − 2t³.
fn noise(position: DVec3, seed: u64) -> f64 {
    let cell = position.floor();
    let t = position - cell;
    let t = t * t * (DVec3::splat(3.0) - 2.0 * t);
    let [x, y, z] = cell.to_array().map(|c| c as i64);
    let corner = |dx: i64, dy: i64, dz: i64| hash([x + dx, y + dy, z + dz], seed);
    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let edge = |dy, dz| mix(corner(0, dy, dz), corner(1, dy, dz), t.x);
    let face = |dz| mix(edge(0, dz), edge(1, dz), t.y);
    mix(face(0), face(1), t.z)
}

/// A number in 0..1 for a place: the mixer of SplitMix64 (Steele, Lea, Flood 2014), once per axis.
fn hash(place: [i64; 3], seed: u64) -> f64 {
    let mut state = seed;
    for coordinate in place {
        state = (state ^ coordinate as u64).wrapping_add(0x9e37_79b9_7f4a_7c15);
        state = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        state = (state ^ (state >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        state ^= state >> 31;
    }
    (state >> 11) as f64 / (1_u64 << 53) as f64
}

fn transfer_function(name: &str) -> TransferFunction {
    let points: &[[f32; 5]] = match name {
        "supernova" => &[
            [0.0, 0.0, 0.0, 0.0, 0.0],
            [0.1, 0.3, 0.05, 0.1, 0.0],
            [0.4, 0.9, 0.25, 0.05, 0.03],
            [0.7, 1.0, 0.7, 0.2, 0.15],
            [1.0, 0.9, 0.95, 1.0, 0.5],
        ],
        "nebula" => &[
            [0.0, 0.0, 0.0, 0.0, 0.0],
            [0.05, 0.1, 0.1, 0.4, 0.0],
            [0.25, 0.5, 0.2, 0.6, 0.02],
            [0.5, 0.9, 0.4, 0.4, 0.06],
            [1.0, 1.0, 0.95, 0.8, 0.3],
        ],
        // The surface at one half, as the paper shows it.
        _ => &[
            [0.0, 0.0, 0.0, 0.0, 0.0],
            [0.49, 0.7, 0.7, 0.75, 0.0],
            [0.5, 0.8, 0.8, 0.85, 0.9],
            [1.0, 1.0, 1.0, 1.0, 0.9],
        ],
    };
    let points = points.iter().map(|&point| point.into()).collect();
    TransferFunction::new(points).expect("points are sorted and in range")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::Statistics;

    #[test]
    fn all_have_views_and_use_the_range() {
        for name in NAMES {
            let made = by_name(name, [40, 30, 20], 1).unwrap();
            made.camera.validate().unwrap();
            let [low, high] = made.volume.range();
            assert!(
                low >= 0.0 && high <= 1.000_001 && high > 0.5,
                "{name}: {low} {high}"
            );
            let visible = made.transfer_function.at(f64::from(high))[3];
            assert!(visible > 0.05, "{name}: {visible}");
        }
    }

    #[test]
    fn a_supernova_is_mostly_empty_and_a_nebula_is_not() {
        let share_of_nothing = |name| {
            let volume = by_name(name, [48; 3], 1).unwrap().volume;
            let count = volume.voxels().len();
            let zero = (0..count).filter(|&i| volume.voxels().get(i) == 0.0);
            zero.count() as f64 / count as f64
        };
        assert!(share_of_nothing("supernova") > 0.5);
        assert!(share_of_nothing("nebula") < 0.6);
    }

    #[test]
    fn seeds_and_threads() {
        let of = |seed| by_name("nebula", [24, 20, 9], seed).unwrap();
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build();
        let alone = one.unwrap().install(|| of(1));
        assert_eq!(of(1), alone);
        assert_ne!(of(1).volume, of(2).volume);
    }

    /// Its mean over the cube is ½ + the mean of the ripple, which is small; its extremes are known.
    #[test]
    fn marschner_lobb_is_that_of_the_paper() {
        let at = |x, y, z| marschner_lobb(DVec3::new(x, y, z), 0);
        // On the axis the ripple is cos(12π) = 1.
        assert!((at(0.0, 0.0, -1.0) - 1.0).abs() < 1e-12);
        assert!((at(0.0, 0.0, 1.0) - 0.2).abs() < 1e-12);
        // At radius 1 the inner cosine is 0.
        assert!((at(1.0, 0.0, 0.0) - 0.6).abs() < 1e-12);
        let volume = by_name("marschner-lobb", [41; 3], 0).unwrap().volume;
        assert!((Statistics::of(&volume).mean - 0.5).abs() < 0.05);
    }

    #[test]
    fn extreme_sizes() {
        for name in NAMES {
            assert_eq!(by_name(name, [1; 3], 0).unwrap().volume.dims(), [1; 3]);
            assert!(matches!(
                by_name(name, [0, 1, 1], 0),
                Err(GenerateError::Grid(_))
            ));
            for dims in [[usize::MAX; 3], [1 << 20, 1 << 20, 1]] {
                assert_eq!(
                    by_name(name, dims, 0),
                    Err(GenerateError::TooManyVoxels { dims })
                );
            }
        }
        assert!(matches!(
            by_name("x", [1; 3], 0),
            Err(GenerateError::UnknownName { .. })
        ));
    }
}
