//! The procedural triangle sets of the golden trees, made from integers alone, so that every
//! machine makes the same.
//!
//! Source: section 3 of the README beside the golden files. Invariant: the hash of the vertices is
//! that of `debug_steps.jsonl` (test of this crate).

use raywright_bvh::Vec3;

use crate::triangles::TriangleSet;

/// The procedural sets, in the order of `sets.jsonl`.
pub const NAMES: [&str; 17] = [
    "uniform1000",
    "clustered2000",
    "grid1728",
    "diagonals500",
    "duplicates600",
    "flatx800",
    "allsame100",
    "points300",
    "mixed1500",
    "uniform5000",
    "single",
    "two",
    "seven",
    "n33",
    "big24",
    "offset700",
    "diag40",
];

/// The procedural set called `name`; `None` if there is none.
#[must_use]
pub fn procedural(name: &str) -> Option<TriangleSet> {
    let triangles = match name {
        "uniform1000" => uniform(1, 1000, 2048),
        "uniform5000" => uniform(10, 5000, 2048),
        "single" => uniform(11, 1, 2048),
        "two" => uniform(12, 2, 2048),
        "seven" => uniform(13, 7, 2048),
        "n33" => uniform(14, 33, 2048),
        "big24" => uniform(15, 24, 32768),
        "offset700" => uniform(16, 700, 2048)
            .into_iter()
            .map(|corners| corners.map(|v| v * 0.1 + Vec3::splat(100.0)))
            .collect(),
        "clustered2000" => clustered(2, 2000),
        "grid1728" => grid(),
        "diagonals500" => diagonals(4, 500),
        "diag40" => diagonals(17, 40),
        "duplicates600" => uniform(5, 60, 4096)
            .into_iter()
            .flat_map(|corners| [corners; 10])
            .collect(),
        "flatx800" => flat(6, 800),
        "allsame100" => {
            let corners = [[0; 3], [65536, 0, 0], [0, 65536, 65536]];
            vec![corners.map(vertex); 100]
        }
        "points300" => points(8, 300),
        "mixed1500" => mixed(9, 1500),
        _ => return None,
    };
    Some(TriangleSet {
        name: name.to_owned(),
        triangles,
        geometries: if name == "mixed1500" { 3 } else { 1 },
    })
}

/// The linear congruential generator of the README.
struct Lcg(u32);

impl Lcg {
    fn below(&mut self, bound: i32) -> i32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        ((u64::from(self.0 >> 8) * bound as u64) >> 24) as i32
    }

    /// Three draws, for x, y, z.
    fn below3(&mut self, bound: i32) -> [i32; 3] {
        std::array::from_fn(|_| self.below(bound))
    }

    /// Three vertices around `p`, up to `spread` away on each axis.
    fn around(&mut self, p: [i32; 3], width: i32, spread: i32) -> [Vec3; 3] {
        std::array::from_fn(|_| vertex(p.map(|p| p + self.below(width) - spread)))
    }
}

/// Coordinates are multiples of 2⁻¹⁶, exact in f32.
fn vertex(c: [i32; 3]) -> Vec3 {
    Vec3::from_array(c.map(|c| c as f32 / 65536.0))
}

fn uniform(seed: u32, n: usize, spread: i32) -> Vec<[Vec3; 3]> {
    let mut lcg = Lcg(seed);
    let triangle = |_| {
        let p = lcg.below3(65536);
        lcg.around(p, 2 * spread, spread)
    };
    (0..n).map(triangle).collect()
}

fn clustered(seed: u32, n: usize) -> Vec<[Vec3; 3]> {
    let mut lcg = Lcg(seed);
    let centres: [_; 20] = std::array::from_fn(|_| lcg.below3(65536));
    let triangle = |_| {
        let j = lcg.below(20);
        let w = 16 << (j % 10);
        let p = centres[j as usize].map(|c| c + lcg.below(w) - w / 2);
        lcg.around(p, w / 4 + 1, w / 8)
    };
    (0..n).map(triangle).collect()
}

fn grid() -> Vec<[Vec3; 3]> {
    let triangle = |i: i32| {
        let [x, y, z] = [i % 12, i / 12 % 12, i / 144].map(|c| 65536 * c);
        [[x, y, z], [x + 32768, y, z], [x, y + 32768, z + 16384]].map(vertex)
    };
    (0..1728).map(triangle).collect()
}

fn diagonals(seed: u32, n: usize) -> Vec<[Vec3; 3]> {
    let mut lcg = Lcg(seed);
    let triangle = |_| {
        let p = lcg.below3(65536);
        let e: [i32; 3] = std::array::from_fn(|_| {
            let m = 8192 + lcg.below(32768);
            if lcg.below(2) != 0 { m } else { -m }
        });
        let d = lcg.below3(64);
        let sum = |a: [i32; 3], b: [i32; 3]| std::array::from_fn(|k| a[k] + b[k]);
        [p, sum(p, e), sum(p, d)].map(vertex)
    };
    (0..n).map(triangle).collect()
}

fn flat(seed: u32, n: usize) -> Vec<[Vec3; 3]> {
    let mut lcg = Lcg(seed);
    let triangle = |_| {
        let (y, z) = (lcg.below(65536), lcg.below(65536));
        std::array::from_fn(|_| {
            let y = y + lcg.below(4096) - 2048;
            let z = z + lcg.below(4096) - 2048;
            vertex([65536, y, z])
        })
    };
    (0..n).map(triangle).collect()
}

fn points(seed: u32, n: usize) -> Vec<[Vec3; 3]> {
    let mut lcg = Lcg(seed);
    (0..n)
        .map(|_| [vertex(lcg.below3(256).map(|c| c * 256)); 3])
        .collect()
}

fn mixed(seed: u32, n: usize) -> Vec<[Vec3; 3]> {
    let mut lcg = Lcg(seed);
    let triangle = |i: usize| {
        let w = match i % 10 {
            0 => 65536,
            1..=3 => 8192,
            _ => 512,
        };
        let p = lcg.below3(131_072);
        lcg.around(p, w, w / 2)
    };
    (0..n).map(triangle).collect()
}

/// Families of triangles with any number of them: the sets above, and what real scenes have beside
/// (whole coordinates, duplicates, triangles without area).
#[cfg(feature = "embree")]
pub(crate) mod families {
    use super::*;

    /// A family: its name, and its triangles by seed and number.
    pub(crate) type Family = (&'static str, fn(u32, usize) -> Vec<[Vec3; 3]>);

    pub(crate) const FAMILIES: [Family; 9] = [
        ("uniform", |seed, n| uniform(seed, n, 2048)),
        ("clustered", clustered),
        ("diagonals", diagonals),
        ("flat", flat),
        ("points", points),
        ("mixed", mixed),
        ("whole numbers", lattice),
        ("duplicates", duplicates),
        ("far away", |seed, n| {
            let triangles = uniform(seed, n, 2048).into_iter();
            triangles
                .map(|corners| corners.map(|v| v * 0.1 + Vec3::new(100.0, -7.0, 0.3)))
                .collect()
        }),
    ];

    /// Right triangles in planes of whole coordinates: half faces of the cells of a grid of 24³.
    fn lattice(seed: u32, n: usize) -> Vec<[Vec3; 3]> {
        let mut lcg = Lcg(seed);
        let triangle = |_| {
            let p = lcg.below3(24).map(|c| c as f32);
            let axis = lcg.below(3) as usize;
            let corner = |steps: [f32; 2]| {
                let mut v = p;
                v[(axis + 1) % 3] += steps[0];
                v[(axis + 2) % 3] += steps[1];
                Vec3::from_array(v)
            };
            [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]].map(corner)
        };
        (0..n).map(triangle).collect()
    }

    /// Runs of equal triangles; of the different ones one in four is a line and one in eight a
    /// point.
    fn duplicates(seed: u32, n: usize) -> Vec<[Vec3; 3]> {
        let mut lcg = Lcg(seed);
        let mut triangles = Vec::with_capacity(n);
        while triangles.len() < n {
            let p = lcg.below3(65536);
            let [a, b, c] = lcg.around(p, 8192, 4096);
            let corners = match lcg.below(8) {
                0 | 1 => [a, b, b],
                2 => [a; 3],
                _ => [a, b, c],
            };
            let run = 1 + lcg.below(12) as usize;
            triangles.extend(std::iter::repeat_n(corners, run.min(n - triangles.len())));
        }
        triangles
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::golden::Fnv;

    /// From `debug_steps.jsonl`, here so that the generator is tested without the data.
    #[test]
    fn vertices_have_their_hashes() {
        for (name, expected) in [
            ("uniform1000", 0xbdae_ae7f_6d5a_0ec3),
            ("clustered2000", 0xd328_cd59_297c_6cd3),
            ("grid1728", 0xfba5_3616_8742_aba5),
            ("single", 0x1037_40e8_aba6_d31e),
        ] {
            let set = procedural(name).expect("a set");
            assert_eq!(Fnv::of_vertices(&set.triangles), expected, "{name}");
        }
    }
}
