//! Random builds beside Embree: what the golden lines cannot reach, any triangles with any
//! parameters.
//!
//! Ranges: 1 to 6000 triangles (uniform in the logarithm), branching factor 2..=16, depth 10..=64,
//! block size 1..=32, leaves 1..=32, costs 0..=10 with 0 in one of eight, room for 1 to 3 references
//! per triangle. A build is a function of its seed and of the scenes that are there.
//!
//! Not asked, because Embree crashes: Morton order with more than 8 children. Not compared, because
//! Embree's tree then depends on its thread library: Morton order with some thousand equal codes.
//! Spatial splits of more than 3072 triangles can depend on the cores that the process may use:
//! keep to one of them, as the program of this crate does.

use std::{collections::HashMap, fmt};

use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use raywright_bvh::{BuildParams, BuildPrimitive, BuildWorkspace, PARAMETERS, Quality, Rounding};

use crate::{
    embree::{BuildArguments, Device, EmbreeError},
    golden::{self, Outcome, families::FAMILIES},
    tree::Tree,
    triangles::TriangleSet,
};

const MOST_TRIANGLES: f64 = 6000.0;
/// Ranges of 1024 equal codes are sorted by Embree's thread library; less a few, since cells here
/// are found with another rounding.
const EQUAL_CODES: usize = 1000;

/// Something to build, with both builders.
#[derive(Clone, Debug)]
pub struct RandomBuild {
    /// The seed that gives it again.
    pub seed: u64,
    /// The triangles.
    pub set: TriangleSet,
    /// How to build.
    pub params: BuildParams,
}

impl RandomBuild {
    /// The build that belongs to `seed`: over triangles of a family, or over consecutive triangles
    /// of one of `scenes`.
    #[must_use]
    pub fn new(seed: u64, scenes: &[TriangleSet]) -> Self {
        let mut draw = Draw(Xoshiro256PlusPlus::seed_from_u64(seed));
        let n = MOST_TRIANGLES.powf(draw.unit()) as usize;
        let which = draw.up_to(FAMILIES.len() + scenes.len() - 1);
        let (name, triangles) = match FAMILIES.get(which) {
            Some((name, family)) => (*name, family(draw.up_to(u32::MAX as usize) as u32, n)),
            None => {
                let scene = &scenes[which - FAMILIES.len()];
                let n = n.min(scene.triangles.len());
                let first = draw.up_to(scene.triangles.len() - n);
                (&*scene.name, scene.triangles[first..first + n].to_vec())
            }
        };
        let geometries = 1 + draw.up_to(2) as u32;
        let set = TriangleSet {
            name: name.to_owned(),
            triangles,
            geometries,
        };
        let params = draw.params(set.triangles.len());
        Self { seed, set, params }
    }

    /// Builds it by ours and by Embree. The text says where the trees differ first.
    pub fn compare(
        &self,
        device: &Device,
        workspace: &mut BuildWorkspace,
    ) -> (Outcome, Option<String>) {
        let primitives = self.set.primitives();
        if self.params.quality == Quality::Morton && equal_codes(&primitives) >= EQUAL_CODES {
            let why = "Embree's tree depends on its thread library (many equal Morton codes)";
            return (Outcome::Skipped(why.into()), None);
        }
        let theirs = match self.embree_tree(device, &primitives) {
            Err(EmbreeError::Crashes { why }) => return (Outcome::Skipped(why.into()), None),
            tree => tree,
        };
        let ours = golden::build(&self.set, &primitives, &self.params, workspace);
        match (ours, theirs) {
            (Err(_), Err(EmbreeError::Refused { .. })) => (Outcome::Equal, None),
            (Ok(ours), Ok(theirs)) => compare_trees(&ours, &theirs),
            (ours, theirs) => {
                let text = |result: Result<Tree, String>| match result {
                    Ok(_) => "a tree".to_owned(),
                    Err(error) => error,
                };
                let theirs = text(theirs.map_err(|error| error.to_string()));
                let what = format!("ours: {}; Embree: {theirs}", text(ours));
                (Outcome::Different(what), None)
            }
        }
    }

    fn embree_tree(
        &self,
        device: &Device,
        primitives: &[BuildPrimitive],
    ) -> Result<Tree, EmbreeError> {
        let corners = |reference| self.set.corners(reference);
        let arguments = BuildArguments::of(&self.params, primitives.len()).expect("one of three");
        device.build(primitives, Some(&corners), &arguments)?.tree()
    }
}

impl fmt::Display for RandomBuild {
    /// All that is needed to build it by other means.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let set = &self.set;
        write!(
            f,
            "seed {}: {} triangles of {:?}, {} geometries, vertices {:016x}",
            self.seed,
            set.triangles.len(),
            set.name,
            set.geometries,
            golden::Fnv::of_vertices(&set.triangles)
        )?;
        for parameter in &PARAMETERS {
            let value = self.params.get(parameter.name).expect("a parameter");
            write!(f, ", {} {value}", parameter.name)?;
        }
        Ok(())
    }
}

fn compare_trees(ours: &Tree, theirs: &Tree) -> (Outcome, Option<String>) {
    let Some(difference) = ours.first_difference(theirs) else {
        return (Outcome::Equal, None);
    };
    let unordered = |tree: &Tree| tree.root.as_ref().map(golden::unordered);
    let outcome = if unordered(ours) == unordered(theirs) {
        Outcome::Unordered
    } else {
        Outcome::Different("another tree".into())
    };
    let text = format!("{difference} (ours against Embree's)");
    (outcome, Some(text))
}

/// The most primitives whose centres share one of 1024³ cells.
fn equal_codes(primitives: &[BuildPrimitive]) -> usize {
    let centres = || {
        primitives
            .iter()
            .map(|p| (p.bounds.min + p.bounds.max).as_dvec3())
    };
    let Some((lower, upper)) = centres()
        .map(|c| (c, c))
        .reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
    else {
        return 0;
    };
    let mut cells: HashMap<[u32; 3], usize> = HashMap::new();
    for centre in centres() {
        let cell = [0, 1, 2].map(|k| {
            let extent = upper[k] - lower[k];
            let share = if extent > 0.0 {
                (centre[k] - lower[k]) / extent
            } else {
                0.0
            };
            (share * 1013.76).round() as u32
        });
        *cells.entry(cell).or_default() += 1;
    }
    cells.into_values().max().unwrap_or(0)
}

struct Draw(Xoshiro256PlusPlus);

impl Draw {
    /// Uniform in 0..1, exact steps of 2⁻⁵³.
    fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in 0..=`last`, but for a bias below 2⁻³².
    fn up_to(&mut self, last: usize) -> usize {
        ((u128::from(self.0.next_u64()) * (last as u128 + 1)) >> 64) as usize
    }

    fn between(&mut self, first: u32, last: u32) -> u32 {
        first + self.up_to((last - first) as usize) as u32
    }

    fn cost(&mut self) -> f32 {
        match self.up_to(7) {
            0 => 0.0,
            _ => (10.0 * self.unit()) as f32,
        }
    }

    fn params(&mut self, n: usize) -> BuildParams {
        let mut params = BuildParams::embree_api_default();
        params.rounding = Rounding::Embree;
        (params.quality, params.branching_factor) = match self.up_to(2) {
            0 => (Quality::Morton, self.between(2, 8)),
            1 => (Quality::BinnedSah, self.between(2, 16)),
            _ => (Quality::SpatialSplits, self.between(2, 16)),
        };
        params.max_depth = self.between(10, 64);
        params.sah_block_size = self.between(1, 32);
        params.min_leaf_size = self.between(1, 32);
        params.max_leaf_size = self.between(1, 32);
        params.traversal_cost = self.cost();
        params.intersection_cost = self.cost();
        let capacity = n + self.up_to(2 * n);
        params.split_budget = golden::split_budget(capacity, n).expect("at most 8 per primitive");
        params
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_gives_the_same_build_and_all_of_them_are_valid() {
        let mut names = std::collections::BTreeSet::new();
        for seed in 0..300 {
            let build = RandomBuild::new(seed, &[]);
            assert_eq!(build.params.validate(), Ok(()), "{build}");
            assert!(!build.set.triangles.is_empty());
            assert_eq!(build.to_string(), RandomBuild::new(seed, &[]).to_string());
            names.insert(build.set.name);
        }
        assert_eq!(names.len(), FAMILIES.len());
    }

    #[test]
    fn equal_codes_are_counted() {
        let same = golden::procedural("allsame100").expect("a set");
        assert_eq!(equal_codes(&same.primitives()), 100);
        let spread = golden::procedural("grid1728").expect("a set");
        assert_eq!(equal_codes(&spread.primitives()), 1);
    }
}
