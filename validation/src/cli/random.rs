//! `trees --random`: random builds beside Embree.
//!
//! Embree partitions 3072 primitives and more by as many threads as the process may use cores,
//! whatever its device was told, and with spatial splits the order of equal parts of a triangle can
//! then change a tree (seed 54177 beside version 4.4 on two cores). So the process keeps to one
//! core; ours still builds with two threads.

use std::{error::Error, path::Path};

use raywright_bvh::Quality;
use raywright_validation::{
    golden::{self, GoldenQuality},
    random::RandomBuild,
};

use super::{Verdict, embree_or_skip, table::Table};

/// Scenes whose parts are built over, where they are there: architecture, a scene of extreme sizes
/// with many triangles without area, plants, whole coordinates.
const SCENES: [&str; 4] = [
    "sponza_dabrovic",
    "conference",
    "fireplace_room",
    "voxel_terrain",
];

/// Compares builds with the seeds `seed`, `seed + 1`, …
pub(super) fn run(builds: u64, seed: u64, scenes: &Path) -> Result<Verdict, Box<dyn Error>> {
    if !keep_to_one_core() {
        println!("not kept to one core: Embree's high quality may differ from itself");
    }
    rayon::ThreadPoolBuilder::new()
        .num_threads(2)
        .build_global()?;
    let Some(embree) = embree_or_skip()? else {
        return Ok(Verdict::AllEqual);
    };
    let device = embree.device(1)?;
    let mut sets = Vec::new();
    for name in SCENES {
        let path = scenes.join(name).join(format!("{name}.obj.gz"));
        if path.exists() {
            sets.push(golden::read_obj(&path)?);
        } else {
            println!("without {name}: there is no {}", path.display());
        }
    }
    println!(
        "Embree {} ({}), {}",
        device.version(),
        device.instruction_set(),
        embree.path().display()
    );
    let mut table = Table::default();
    let mut workspace = Default::default();
    for seed in seed..seed.saturating_add(builds) {
        let build = RandomBuild::new(seed, &sets);
        let (outcome, difference) = build.compare(&device, &mut workspace);
        let quality = match build.params.quality {
            Quality::Morton => GoldenQuality::Low,
            Quality::SpatialSplits => GoldenQuality::High,
            _ => GoldenQuality::Medium,
        };
        table.add(quality, &build.to_string(), outcome, || {
            let difference = difference.unwrap_or_default();
            Some(format!(
                "{difference}\n    repeat: trees --random 1 --seed {seed}"
            ))
        });
    }
    table.print(&format!("{builds} random builds, first seed {seed}"));
    Ok(if table.differs() {
        Verdict::SomethingDiffers
    } else {
        Verdict::AllEqual
    })
}

/// Whether it could be done. Threads that are started later inherit it.
#[cfg(target_os = "linux")]
pub(super) fn keep_to_one_core() -> bool {
    use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};

    let Ok(allowed) = sched_getaffinity(None) else {
        return false;
    };
    let Some(first) = (0..CpuSet::MAX_CPU).find(|&core| allowed.is_set(core)) else {
        return false;
    };
    let mut one = CpuSet::new();
    one.set(first);
    sched_setaffinity(None, &one).is_ok()
}

#[cfg(not(target_os = "linux"))]
pub(super) fn keep_to_one_core() -> bool {
    false
}
