//! Is a ray through our trees faster than one through Embree's, and by how much?
//!
//! Run: `cargo bench -p raywright-benches --bench trace [--features peers] [-- SCENE…]`
//!
//! Scenes are sponza, conference, bmw_m6, fireplace_room and dragon of the shared data, or the
//! built-in ones. Five sets of rays each, about 64 thousand rays: primary, one diffuse bounce, the
//! same shuffled, shadow, and segments between random points. Embree is found as
//! `raywright_validation::embree` says; without it our own rows are printed and no goal is judged.
//!
//! Method: answers are compared ray by ray before a time is taken. One thread: CPU time of the
//! thread, engines in turns by chunks of rays, the first round dropped, median and quartiles of the
//! ratio within a round. Two threads: wall time, which other jobs disturb, without goals. The row
//! "again" is the same scene of Embree built once more and shows the noise.

mod choice;
mod embree;
mod engine;
mod ours;
#[cfg(feature = "peers")]
mod peers;
mod summary;
mod table;
mod threads;

use std::{env, time::Instant};

use raywright_benches::{
    goals::Goals,
    rays::{RaySet, SIDE, random_segments, ray_sets},
    scenes::{BenchScene, real_or_built_in},
};
use raywright_bvh::Isa;
use raywright_validation::embree::{Device, Embree};

use engine::Engine;
use summary::Summary;

const SCENES: [&str; 5] = ["sponza", "conference", "bmw_m6", "fireplace_room", "dragon"];

/// Side of the picture whose rays the automatic choice is made by: none of those that are measured.
const TRAINING_SIDE: u32 = 128;

/// Sets that are measured by two threads.
const THREADED_SETS: [&str; 2] = ["diffuse", "shadow"];

/// Embree with all that this machine has, and held to AVX2.
struct Devices {
    widest: Device,
    avx2: Option<Device>,
}

fn main() {
    let start = Instant::now();
    let arguments: Vec<String> = env::args().skip(1).filter(|a| a != "--bench").collect();
    let names: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let devices = devices();
    let mut summary = Summary::default();
    for scene in real_or_built_in(if names.is_empty() { &SCENES } else { &names }) {
        measure(&scene, devices.as_ref(), &mut summary);
    }
    println!("\ntook {:.0} s", start.elapsed().as_secs_f64());
    if devices.is_some() {
        let mut goals = Goals::default();
        summary.judge(&mut goals);
        goals.print();
    }
}

fn devices() -> Option<Devices> {
    let embree = match Embree::find() {
        Ok(embree) => embree,
        Err(error) => {
            println!("only our own rows, no goals: {error}");
            return None;
        }
    };
    let widest = embree.device(1).expect("a device");
    println!(
        "Embree {} ({}), {}; ours: {}",
        widest.version(),
        widest.instruction_set(),
        embree.path().display(),
        Isa::best()
    );
    if widest.major() < 4 {
        println!("a system's version 3 may check assertions: its times are not fair");
    }
    let avx2 = Isa::Avx2.is_available().then(|| {
        let device = embree.device_held_to(1, Isa::Avx2).expect("a device");
        println!("held to AVX2, Embree has {}", device.instruction_set());
        device
    });
    Some(Devices { widest, avx2 })
}

fn measure(scene: &BenchScene, devices: Option<&Devices>, summary: &mut Summary) {
    println!(
        "\n{}: {} triangles",
        scene.name,
        scene.mesh.triangles().len()
    );
    let mut engines: Vec<Engine<'_>> = Vec::new();
    if let Some(devices) = devices {
        engines.extend(embree::engines(devices, &scene.mesh));
    }
    engines.extend(ours::engines(&scene.mesh));
    #[cfg(feature = "peers")]
    engines.extend(peers::engines(&scene.mesh));
    table::print_bytes(&engines);
    summary.note_bytes(&scene.name, &engines);

    for (set, training) in sets(scene, SIDE).iter().zip(&sets(scene, TRAINING_SIDE)) {
        let choice = choice::fastest(&engines, training);
        let measured = table::measure(set, &engines, choice);
        summary.add(&scene.name, set.name, &measured);
        if THREADED_SETS.contains(&set.name) {
            threads::table(set, &engines);
        }
    }
}

/// All sets of a scene, from a picture of side `side`.
fn sets(scene: &BenchScene, side: u32) -> Vec<RaySet> {
    let world = &scene.world;
    let tree = world
        .build_tree(&Default::default(), &mut Default::default())
        .expect("a tree");
    let mut sets = ray_sets(world, &tree, side);
    let shuffled = sets[1].shuffled("diffuse shuffled");
    sets.insert(2, shuffled);
    sets.push(random_segments(world.bounds(), side));
    sets
}
