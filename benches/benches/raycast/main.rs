//! Is a picture of a volume sooner cast by us than by VTK's CPU mapper?
//!
//! Run: `cargo bench -p raywright-benches --bench raycast [-- VOLUME…] [--rounds=N]`
//!
//! The volumes of the shared data, both transfer functions, both cameras, two steps, 512 × 512
//! pixels, the same threshold of termination. VTK comes from the Python package `vtk`; without it, or
//! without the data, nothing is compared and no goal is judged.
//!
//! Method: one thread, processor time of each process; per view VTK and every instruction set take
//! turns, each round after an untimed frame of its own; the ratio is that of medians. Pictures are
//! compared first: their root mean square difference must not exceed what the shared reference gives
//! for another caster by more than a quarter and half a grey level.

mod vtk;

use std::{env, fs, path::PathBuf, time::Duration};

use raywright_benches::{clock::Clock, goals::Goals};
use raywright_bvh::Isa;
use raywright_tracer::imaging::{Display, ToneCurve};
use raywright_volume::{CastOptions, LoadOptions, Picture, Raycaster, View, load_volume};
use vtk::Vtk;

const VOLUMES: [&str; 9] = [
    "stent.nrrd",
    "chest.nii.gz",
    "head_mr.nii.gz",
    "lung.json",
    "head_ct_be.nii.gz",
    "nuclei.nhdr",
    "fingers.nrrd",
    "isabel.nrrd",
    "tomo.nrrd",
];
const SIZE: [u32; 2] = [512, 512];
const STEPS: [f32; 2] = [1.0, 0.5];
/// Goals of the median and the worst ratio of VTK's time to ours.
const GOALS: [(Isa, f64, Option<f64>); 3] = [
    (Isa::Avx512, 4.5, Some(2.8)),
    (Isa::Avx2, 3.5, Some(2.2)),
    (Isa::Portable, 1.5, None),
];

fn main() {
    let arguments: Vec<String> = env::args().skip(1).filter(|a| a != "--bench").collect();
    let rounds = arguments.iter().find_map(|a| a.strip_prefix("--rounds="));
    let rounds = rounds.and_then(|n| n.parse().ok()).unwrap_or(3);
    let wanted: Vec<&String> = arguments.iter().filter(|a| !a.starts_with("--")).collect();
    rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build_global()
        .expect("the first pool");
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    let isas: Vec<Isa> = GOALS
        .iter()
        .map(|g| g.0)
        .filter(|isa| isa.is_available())
        .collect();
    let mut vtk = match Vtk::start() {
        Ok(vtk) => {
            println!(
                "VTK {}, one thread; {}",
                vtk.version,
                Clock::ProcessCpu.name()
            );
            vtk
        }
        Err(why) => return println!("skipped: no VTK (Python package vtk): {why}"),
    };
    let reference = fs::read_to_string(folder.join("volume-reference/samples.csv"));
    println!(
        "{:<34}{:>9}{:>10}{}   rmse",
        "view",
        "VTK ms",
        "Msamples",
        isas.iter()
            .map(|isa| format!("{:>16} Ms/s", isa.name()))
            .collect::<String>()
    );
    let mut ratios = vec![Vec::new(); isas.len()];
    let mut too_different = Vec::new();
    for file in VOLUMES {
        let name = file.split('.').next().unwrap_or(file);
        if !wanted.is_empty() && !wanted.iter().any(|w| *w == name) {
            continue;
        }
        let path = folder.join("volumes").join(file);
        let Ok(loaded) = load_volume(&path, &LoadOptions::default()) else {
            println!("without {name}: {} is not there", path.display());
            continue;
        };
        let view = View::read(&View::path_for(&path)).expect("a view beside every volume");
        let caster = Raycaster::new(&loaded.volume).expect("a volume of usual size");
        vtk.load(&loaded.volume).expect("VTK takes every volume");
        for (tf, function) in &view.transfer_functions {
            let prepared = caster.prepare(function);
            for (place, camera) in &view.cameras {
                for step in STEPS {
                    let cast = |isa| {
                        let mut options = CastOptions::default();
                        (options.step, options.isa) = (step, isa);
                        prepared.render(camera, SIZE, &options).expect("a picture")
                    };
                    let mut times = vec![Vec::new(); isas.len()];
                    let (mut theirs, mut pixels) = (Vec::new(), Vec::new());
                    for _ in 0..rounds {
                        let frame = vtk
                            .frame(function, camera, SIZE, step, 1, 1)
                            .expect("a frame");
                        theirs.extend(frame.cpu);
                        pixels = frame.pixels;
                        for (times, &isa) in times.iter_mut().zip(&isas) {
                            drop(cast(isa));
                            times.push(Clock::ProcessCpu.time(|| cast(isa)));
                        }
                    }
                    let picture = cast(isas[0]);
                    let samples = picture.work.samples as f64;
                    let theirs = median(theirs);
                    let mut line = String::new();
                    for (ratios, times) in ratios.iter_mut().zip(times) {
                        let own = median(times);
                        let ratio = theirs / own;
                        ratios.push((ratio, format!("{name} {tf} {place} {step}")));
                        line += &format!("{ratio:>12.2}{:>8.0}", samples / own / 1e6);
                    }
                    let difference = difference(&picture, &pixels);
                    println!(
                        "{:<34}{:>9.1}{:>10.2}{line} {difference:>6.2}",
                        format!("{name} {tf} {place} {step}"),
                        theirs * 1e3,
                        samples / 1e6
                    );
                    let row = format!("{name},{tf},{place},{step:.1},");
                    let rows = reference.iter().flat_map(|text| text.lines());
                    let known = rows.filter(|line| line.starts_with(&row)).find_map(|line| {
                        line.split(',')
                            .nth(14)
                            .and_then(|rmse| rmse.parse::<f64>().ok())
                    });
                    if known.is_some_and(|known| difference > 1.25 * known + 0.5) {
                        too_different.push(format!("{row} {difference:.2} against {known:?}"));
                    }
                }
            }
        }
    }
    if ratios.iter().all(Vec::is_empty) {
        return println!("skipped: no volumes");
    }
    let mut goals = Goals::default();
    println!("\nVTK's time ÷ ours");
    for (isa, ratios) in isas.iter().zip(&mut ratios) {
        ratios.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (median, worst) = (ratios[ratios.len() / 2].0, &ratios[0]);
        println!(
            "{isa}: median {median:.2}, worst {:.2} ({})",
            worst.0, worst.1
        );
        let goal = GOALS
            .iter()
            .find(|goal| goal.0 == *isa)
            .expect("a goal for each");
        goals.check(
            format!("{isa}: median {median:.2}, goal {}", goal.1),
            median >= goal.1,
        );
        if let Some(least) = goal.2 {
            goals.check(
                format!("{isa}: worst {:.2}, goal {least}", worst.0),
                worst.0 >= least,
            );
        }
    }
    goals.check(
        format!(
            "pictures differ more than they should: {}",
            too_different.join("; ")
        ),
        too_different.is_empty(),
    );
    goals.print();
}

fn median(mut times: Vec<Duration>) -> f64 {
    times.sort();
    times[times.len() / 2].as_secs_f64()
}

/// The root mean square difference of two pictures in grey levels.
fn difference(picture: &Picture, theirs: &[u8]) -> f64 {
    let screen = Display {
        curve: ToneCurve::Screen,
        ..Display::default()
    };
    let own = picture
        .image
        .pixels()
        .iter()
        .flatten()
        .map(|&v| screen.encode(v));
    let squares = own
        .zip(theirs)
        .map(|(a, &b)| (f64::from(a) - f64::from(b)).powi(2));
    (squares.sum::<f64>() / theirs.len().max(1) as f64).sqrt()
}
