//! The ways to leave out empty space side by side: what each takes to prepare, how many samples it
//! leaves, and the time of a picture over that with the distance map. All pictures are equal, and are
//! compared.
//!
//! ```text
//! cargo run --release -p raywright-volume --example ways_to_skip -- VOLUME...
//! ```
//!
//! Volumes have a view file beside them. Pictures have 512 × 512 pixels and a step of one voxel; ways
//! take turns, and figures are medians of rounds.

use std::{error::Error, path::Path, time::Instant};

use raywright_bvh::{BuildWorkspace, Quality};
use raywright_volume::{
    CastOptions, EnclosureKind, EnclosureParams, LoadOptions, Raycaster, Skipping, View,
    load_volume,
};

const SIZE: [u32; 2] = [512; 2];
const ROUNDS: usize = 7;

fn main() -> Result<(), Box<dyn Error>> {
    let mut ways = vec![("none".to_owned(), Skipping::None, None)];
    for (kind, name) in [
        (EnclosureKind::Hull, "hull"),
        (EnclosureKind::Segments, "segments"),
    ] {
        for (block_edge, quality) in [
            (16, Quality::BinnedSah),
            (8, Quality::BinnedSah),
            (8, Quality::Morton),
            (4, Quality::BinnedSah),
        ] {
            let mut params = EnclosureParams::new(kind);
            params.block_edge = block_edge;
            params.build.quality = quality;
            let name = format!("{name} {block_edge} {quality:?}");
            ways.push((name, Skipping::Enclosure, Some(params)));
        }
    }
    for file in std::env::args().skip(1) {
        let path = Path::new(&file);
        let volume = load_volume(path, &LoadOptions::default())?.volume;
        let view = View::read(&View::path_for(path))?;
        let caster = Raycaster::new(&volume)?;
        let mut workspace = BuildWorkspace::default();
        for (tf, function) in &view.transfer_functions {
            let mut prepared = caster.prepare(function);
            let camera = view.cameras["overview"];
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            println!("{name} {tf}: way, build ms, samples ÷ distance, time ÷ distance (range)");
            for (way, skipping, enclosure) in &ways {
                let mut build_ms = 0.0;
                if let Some(params) = enclosure {
                    // The first build takes fresh memory.
                    for _ in 0..2 {
                        let start = Instant::now();
                        prepared.enclose(params, &mut workspace)?;
                        build_ms = start.elapsed().as_secs_f64() * 1e3;
                    }
                }
                let mut ratios = Vec::new();
                let mut samples = [0; 2];
                for _ in 0..ROUNDS {
                    let mut times = [0.0; 2];
                    let mut pictures = Vec::new();
                    for (turn, skipping) in [Skipping::Distance, *skipping].into_iter().enumerate()
                    {
                        let mut options = CastOptions::default();
                        options.skipping = skipping;
                        let start = Instant::now();
                        let picture = prepared.render(camera, SIZE, &options)?;
                        times[turn] = start.elapsed().as_secs_f64();
                        samples[turn] = picture.work.samples;
                        pictures.push(picture.image);
                    }
                    assert_eq!(pictures[0], pictures[1], "skipping changed a pixel");
                    ratios.push(times[1] / times[0]);
                }
                ratios.sort_by(f64::total_cmp);
                println!(
                    "  {way:<24} {build_ms:7.2} {:6.2} {:6.2} ({:.2}-{:.2})",
                    samples[1] as f64 / samples[0].max(1) as f64,
                    ratios[ROUNDS / 2],
                    ratios[0],
                    ratios[ROUNDS - 1],
                );
            }
        }
    }
    Ok(())
}
