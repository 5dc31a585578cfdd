//! Does every kernel have its instruction set?
//!
//! A function that is not inlined into the one entry of a kernel is compiled without its instruction set, and each
//! operation on lanes becomes a call: several times slower than the portable kernel, and as right. So every kernel (node
//! width, leaf format, accuracy, closest or any hit, rays alone, in turns or side by side) is timed beside its portable
//! twin; one that is far behind has lost its instruction set.

use raywright_benches::{clock::Clock, rays::RaySet, turns::measure_chunks};
use raywright_bvh::{Accuracy, BuildParams, Bvh, Hit, Isa, LeafFormat, Ray, RayPackets};
use raywright_tracer::World;

const ROUNDS: usize = 7;

/// Speed in terms of the portable kernel below which one has lost its instruction set: without a fault 0.92 was the
/// least that was seen, with one 0.4 to 0.69.
const LEAST_SPEED: f64 = 0.7;

/// How kernels are called: each has an entry of its own.
const CALLS: [(&str, Call); 5] = [
    ("closest hit", Call::Closest),
    ("any hit", Call::Any),
    ("8 in flight", Call::Batch(8, RayPackets::Off)),
    ("packets", Call::Batch(1, RayPackets::On)),
    ("any, packets", Call::AnyBatch),
];

#[derive(Clone, Copy)]
enum Call {
    Closest,
    Any,
    Batch(u32, RayPackets),
    AnyBatch,
}

/// What a call gives, for comparison.
#[derive(Default, PartialEq)]
struct Answers {
    hits: Vec<Option<Hit>>,
    are_hit: Vec<bool>,
}

impl Call {
    fn ask(self, tree: &Bvh, rays: &[Ray], answers: &mut Answers) {
        match self {
            Self::Closest => {
                answers.hits.clear();
                answers
                    .hits
                    .extend(rays.iter().map(|ray| tree.closest_hit(ray)));
            }
            Self::Any => {
                answers.are_hit.clear();
                answers
                    .are_hit
                    .extend(rays.iter().map(|ray| tree.any_hit(ray)));
            }
            Self::Batch(..) => tree.closest_hits(rays, &mut answers.hits),
            Self::AnyBatch => tree.any_hits(rays, &mut answers.are_hit),
        }
    }

    fn prepare(self, tree: Bvh) -> Bvh {
        match self {
            Self::Batch(in_flight, packets) => tree
                .with_rays_in_flight(in_flight)
                .with_ray_packets(packets),
            Self::AnyBatch => tree.with_ray_packets(RayPackets::On),
            Self::Closest | Self::Any => tree,
        }
    }
}

/// Prints the speeds of all kernels in terms of the portable ones. Returns those that have lost their instruction set.
pub(super) fn lost_kernels(world: &World, set: &RaySet) -> Vec<String> {
    println!(
        "\nkernels in terms of their portable twins, {}, {ROUNDS} rounds in turns",
        set.name
    );
    let isas: Vec<Isa> = Isa::ALL
        .into_iter()
        .filter(|isa| isa.is_available())
        .collect();
    print!("{:<44}", "");
    isas[1..]
        .iter()
        .for_each(|isa| print!("{:>8}", isa.to_string()));
    println!();
    let mut lost = Vec::new();
    for params in every_kernel() {
        let tree = world
            .build_tree(&params, &mut Default::default())
            .expect("a tree");
        for (name, call) in CALLS {
            let trees: Vec<Bvh> = isas
                .iter()
                .map(|&isa| call.prepare(tree.clone().with_isa(isa).expect("it is available")))
                .collect();
            let speeds = speeds(call, &trees, &set.rays);
            let words =
                ["leaf_format", "accuracy"].map(|name| params.get(name).expect("a parameter"));
            let what = format!(
                "{} children, {}, {}, {name}",
                params.branching_factor, words[0], words[1]
            );
            print!("{what:<44}");
            for (isa, speed) in isas.iter().zip(&speeds).skip(1) {
                print!("{speed:>8.2}");
                if *speed < LEAST_SPEED {
                    lost.push(format!(
                        "{what}, {isa}: {speed:.2} of the portable kernel's speed"
                    ));
                }
            }
            println!();
        }
    }
    lost
}

/// Every accuracy, leaf format and width that has kernels of its own.
fn every_kernel() -> impl Iterator<Item = BuildParams> {
    let formats = [LeafFormat::Edges, LeafFormat::Compact];
    let kinds = [Accuracy::Fast, Accuracy::Robust]
        .into_iter()
        .flat_map(move |accuracy| formats.map(|leaf_format| (accuracy, leaf_format)));
    kinds.flat_map(|(accuracy, leaf_format)| {
        [2, 4, 8, 16].map(|branching_factor| {
            let mut params = BuildParams::default();
            params.accuracy = accuracy;
            params.leaf_format = leaf_format;
            params.branching_factor = branching_factor;
            params
        })
    })
}

/// The speeds of trees in terms of the first, which all give its answers: the upper quartiles, since whoever disturbs
/// does not disturb most rounds.
fn speeds(call: Call, trees: &[Bvh], rays: &[Ray]) -> Vec<f64> {
    let mut answers = Answers::default();
    let mut expected = Answers::default();
    call.ask(&trees[0], rays, &mut expected);
    for tree in trees {
        call.ask(tree, rays, &mut answers);
        assert!(answers == expected, "{}: another answer", tree.isa());
    }
    let turns = measure_chunks(trees.len(), ROUNDS, 1, Clock::ThreadCpu, |engine, _| {
        call.ask(&trees[engine], rays, &mut answers);
        std::hint::black_box(&mut answers);
    });
    turns.speed.iter().map(|speed| speed.quartiles[1]).collect()
}
