//! No parameter of the tree, no instruction set, no tile size and no number of threads changes a
//! bit of a picture.

#![cfg(feature = "tracer")]

use std::num::NonZeroU32;

use raywright::{
    bvh::{BuildError, BuildParams, Bvh, Isa, PARAMETERS, ParameterRange},
    imaging::{Camera, Film, TileLoop},
    tracer::{Integrator, Shot, View, World, generate},
};

/// SplitMix64.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    fn below(&mut self, n: u32) -> u32 {
        (self.next() % u64::from(n)) as u32
    }

    fn cost(&mut self) -> f32 {
        // Zero too, which makes every leaf or every split free.
        if self.below(8) == 0 {
            0.0
        } else {
            self.below(10_000) as f32 / 1000.0
        }
    }
}

/// A random value of every parameter that changes no hit.
fn random_params(numbers: &mut Numbers) -> BuildParams {
    let mut params = BuildParams::default();
    for parameter in PARAMETERS
        .iter()
        .filter(|parameter| !parameter.changes_hits)
    {
        let value = match (parameter.name, parameter.range) {
            // Widths between are stored as the next of these.
            ("branching_factor", _) => [2, 4, 8, 16][numbers.below(4) as usize].to_string(),
            // A scene has a depth below which no tree is.
            ("max_depth", _) => (10 + numbers.below(55)).to_string(),
            ("traversal_cost" | "intersection_cost", _) => numbers.cost().to_string(),
            // More cuts than anybody wants take long.
            ("split_budget", _) => (1.0 + numbers.below(1000) as f32 / 999.0).to_string(),
            (_, ParameterRange::Integers(min, max)) => {
                (min + numbers.below(max - min + 1)).to_string()
            }
            (_, ParameterRange::OneOf(values)) => {
                values[numbers.below(values.len() as u32) as usize].to_string()
            }
            (_, ParameterRange::Reals(min, max)) => {
                (min + (max - min) * numbers.below(1000) as f32 / 999.0).to_string()
            }
            (_, ParameterRange::Words(words)) => {
                words[numbers.below(words.len() as u32) as usize].to_owned()
            }
        };
        params
            .set(parameter.name, &value)
            .expect("a value of its range");
    }
    params
}

struct Stage {
    world: World,
    camera: Camera,
}

impl Stage {
    fn new(scene: &str) -> Self {
        let scene = generate::by_name(scene).expect("built in");
        let camera = scene.camera.expect("built-in scenes have a camera");
        Self {
            world: World::new(scene),
            camera,
        }
    }

    /// The bits of every value of a small picture.
    fn picture(&self, tree: &Bvh, integrator: Integrator, tile_size: u32) -> Vec<[u32; 3]> {
        let mut film = Film::new(48, 27).expect("a size");
        let shot = Shot {
            world: &self.world,
            camera: self.camera,
            integrator,
            seed: 5,
        };
        let tiles = TileLoop::new().with_tile_size(NonZeroU32::new(tile_size).expect("not 0"));
        let done = shot
            .render(&mut film, 0..2, &tiles, |_| tree)
            .expect("a camera");
        assert_eq!(done, raywright::imaging::Completion::Finished);
        film.mean()
            .pixels()
            .iter()
            .map(|p| p.map(f32::to_bits))
            .collect()
    }
}

const PATHS: Integrator = Integrator::Path { path_length: 3 };

#[test]
fn two_hundred_random_configurations_give_one_picture() {
    let stage = Stage::new("interior");
    let mut numbers = Numbers(11);
    let mut workspace = Default::default();
    let build = |params: &BuildParams, workspace: &mut _| stage.world.build_tree(params, workspace);
    let reference_tree = build(&BuildParams::default(), &mut workspace).expect("a tree");
    let expected = stage.picture(&reference_tree, PATHS, 32);
    assert!(
        expected.iter().filter(|p| **p != [0; 3]).count() > expected.len() / 2,
        "a picture of something"
    );
    let isas: Vec<Isa> = Isa::ALL
        .into_iter()
        .filter(|isa| isa.is_available())
        .collect();
    let (mut pictures, mut too_deep) = (0, 0);
    while pictures < 200 {
        let params = random_params(&mut numbers);
        let tree = match build(&params, &mut workspace) {
            Ok(tree) => tree,
            Err(BuildError::DepthLimit { .. }) => {
                too_deep += 1;
                assert!(too_deep < 100, "most configurations must have a tree");
                continue;
            }
            Err(error) => panic!("{params:?}: {error}"),
        };
        let isa = isas[pictures % isas.len()];
        let tree = tree.with_isa(isa).expect("available");
        let tile_size = [1, 7, 16, 32, 64][numbers.below(5) as usize];
        assert_eq!(
            stage.picture(&tree, PATHS, tile_size),
            expected,
            "{isa} {params:?}"
        );
        pictures += 1;
    }
}

#[test]
fn integer_coordinates_with_many_ties_give_one_picture() {
    let stage = Stage::new("voxel-terrain");
    let mut numbers = Numbers(3);
    let mut workspace = Default::default();
    let integrators = [PATHS, Integrator::View(View::PrimitiveIds)];
    let mut expected = None;
    for _ in 0..12 {
        let params = random_params(&mut numbers);
        let Ok(tree) = stage.world.build_tree(&params, &mut workspace) else {
            continue;
        };
        for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
            let tree = tree.clone().with_isa(isa).expect("available");
            let pictures = integrators.map(|integrator| stage.picture(&tree, integrator, 32));
            assert_eq!(
                &pictures,
                expected.get_or_insert_with(|| pictures.clone()),
                "{isa} {params:?}"
            );
        }
    }
    assert!(expected.is_some());
}

#[test]
fn threads_change_neither_tree_nor_picture() {
    let stage = Stage::new("interior");
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool");
        pool.install(|| {
            let tree = stage
                .world
                .build_tree(&BuildParams::default(), &mut Default::default())
                .expect("a tree");
            (
                tree.stats(),
                stage.picture(&tree, PATHS, 32),
                stage.picture(&tree, Integrator::View(View::Nodes), 32),
            )
        })
    };
    let one = run(1);
    for threads in [2, 7] {
        assert!(run(threads) == one, "{threads} threads");
    }
}

/// The tuner will race two trees inside one frame.
#[test]
fn tiles_may_be_traced_through_different_trees() {
    let stage = Stage::new("interior");
    let tree = |branching_factor| {
        let mut params = BuildParams::default();
        params.branching_factor = branching_factor;
        stage
            .world
            .build_tree(&params, &mut Default::default())
            .expect("a tree")
    };
    let (two, eight) = (tree(2), tree(8));
    let mut film = Film::new(48, 27).expect("a size");
    let shot = Shot {
        world: &stage.world,
        camera: stage.camera,
        integrator: PATHS,
        seed: 5,
    };
    let tiles = TileLoop::new().with_tile_size(NonZeroU32::new(8).expect("not 0"));
    let done = shot.render(&mut film, 0..2, &tiles, |tile| {
        if tile.index % 2 == 0 { &two } else { &eight }
    });
    assert_eq!(done, Ok(raywright::imaging::Completion::Finished));
    let bits: Vec<[u32; 3]> = film
        .mean()
        .pixels()
        .iter()
        .map(|p| p.map(f32::to_bits))
        .collect();
    assert_eq!(bits, stage.picture(&eight, PATHS, 32));
}

/// What `canonical` says is the same, is the same: a tuner need not try it twice.
#[test]
fn equal_canonical_parameters_build_equal_trees() {
    let stage = Stage::new("interior");
    let mut numbers = Numbers(23);
    let mut workspace = Default::default();
    for _ in 0..20 {
        let params = random_params(&mut numbers);
        let mut variant = params;
        variant.sah_block_size = 1 << params.sah_block_size.ilog2();
        variant.min_leaf_size = params.min_leaf_size.min(params.max_leaf_size);
        let factor = [0.25, 0.5, 2.0, 8.0][numbers.below(4) as usize];
        variant.traversal_cost = params.traversal_cost * factor;
        variant.intersection_cost = params.intersection_cost * factor;
        if params.intersection_cost > 0.0 {
            assert_eq!(params.canonical(), variant.canonical());
        }
        let mut tree = |params: &BuildParams| stage.world.build_tree(params, &mut workspace);
        let (Ok(tree), Ok(other)) = (tree(&params), tree(&variant)) else {
            continue;
        };
        let figures = |tree: &Bvh| {
            let stats = tree.stats();
            (
                stats.nodes,
                stats.leaves,
                stats.depth,
                stats.largest_leaf,
                stats.sah_nodes,
                stats.sah_blocks,
            )
        };
        assert_eq!(figures(&tree), figures(&other), "{params:?} {variant:?}");
        let nodes = |tree: &Bvh| stage.picture(tree, Integrator::View(View::Nodes), 32);
        assert_eq!(nodes(&tree), nodes(&other), "{params:?} {variant:?}");
    }
}
