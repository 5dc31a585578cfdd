//! How far the estimates of early ray termination are off, by scene: for every view of the volumes
//! given, the ratio of estimated to true samples in the hull of what can be seen, and the mean error
//! of a ray over the mean true count.
//!
//! ```text
//! cargo run --release -p raywright-volume --example estimate_errors -- VOLUME...
//! ```
//!
//! Volumes have a view file beside them. Pictures have 512 × 512 pixels and a step of one voxel.

use std::{error::Error, path::Path};

use raywright_bvh::BuildWorkspace;
use raywright_volume::{
    CastOptions, Counts, EnclosureKind, EnclosureParams, EstimateMethod, Estimator, LoadOptions,
    Raycaster, Skipping, View, load_volume,
};

const SIZE: [u32; 2] = [512; 2];

fn main() -> Result<(), Box<dyn Error>> {
    println!("{:<44} estimated ÷ true          error of a ray", "");
    print!("{:<18} {:<12} {:<12}", "volume", "function", "camera");
    println!("{0} {0}", " linear cube   mean  ");
    for file in std::env::args().skip(1) {
        let path = Path::new(&file);
        let volume = load_volume(path, &LoadOptions::default())?.volume;
        let view = View::read(&View::path_for(path))?;
        let caster = Raycaster::new(&volume)?;
        let estimator = Estimator::new(&volume);
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        for (tf, function) in &view.transfer_functions {
            let mut prepared = caster.prepare(function);
            let hull = EnclosureParams::new(EnclosureKind::Hull);
            prepared.enclose(&hull, &mut BuildWorkspace::default())?;
            for (camera_name, camera) in &view.cameras {
                let mut options = CastOptions::default();
                options.skipping = Skipping::Enclosure;
                options.counts = Counts::PerRay;
                let picture = prepared.render(*camera, SIZE, &options)?;
                let (mut ratios, mut errors) = (Vec::new(), Vec::new());
                for method in EstimateMethod::ALL {
                    let estimate = estimator
                        .prepare(function, method)
                        .estimate(*camera, SIZE, &options, 0)?;
                    let (mut found, mut expected, mut off) = (0.0, 0.0, 0.0);
                    for (tile, ray) in (0..).zip(&estimate.rays) {
                        // The pixel in the middle of the square.
                        let [x, y] = [tile % estimate.tiles[0], tile / estimate.tiles[0]]
                            .map(|i| i * estimate.tile_size + estimate.tile_size / 2);
                        let work = picture.ray_work[(y * SIZE[0] + x) as usize];
                        let samples = f64::from(work.samples);
                        found += samples;
                        expected += f64::from(ray.samples());
                        off += (f64::from(ray.samples()) - samples).abs();
                    }
                    ratios.push(expected / found);
                    errors.push(off / found);
                }
                print!("{name:<18} {tf:<12} {camera_name:<12}");
                for value in ratios.iter().chain(&errors) {
                    print!(" {value:6.3}");
                }
                println!();
            }
        }
    }
    Ok(())
}
