//! Do our trees cost less to build than Embree's of the same kind? Rays: `--bench trace`.
//!
//! Run: `cargo bench -p raywright-benches --bench build [--features peers] [-- SCENE…]`
//!
//! Scenes are sponza, conference, bmw_m6 and dragon of the shared data, or the built-in ones. Per
//! scene, our builds beside `rtcCommitScene` of the same quality (low: of the mesh too, which is
//! Morton order), `Hierarchy::build` beside `rtcBuildBVH`, and with `peers` other crates. Embree is
//! found as `raywright_validation::embree` says; without it, nothing is compared and no goal is
//! judged.
//!
//! Method: rounds in turns, the first dropped, median and quartiles of the ratio within a round;
//! what is timed follows an untimed run of its own kind. A row "again" shows the noise.
//! One thread: CPU time of the process. Two threads: wall time, no goals. Embree's number of threads acts on a whole process, so each number has a
//! process of its own.

mod builds;
#[cfg(feature = "peers")]
mod peers;

use std::{env, process};

use raywright_benches::{goals::Goals, scenes::real_or_built_in};
use raywright_validation::embree::Embree;

const SCENES: [&str; 4] = ["sponza", "conference", "bmw_m6", "dragon"];
const THREADS: &str = "--threads=";

fn main() {
    let arguments: Vec<String> = env::args().skip(1).filter(|a| a != "--bench").collect();
    let threads = arguments.iter().find_map(|a| a.strip_prefix(THREADS));
    match threads.and_then(|n| n.parse().ok()) {
        Some(threads) => {
            let names: Vec<&str> = arguments[1..].iter().map(String::as_str).collect();
            part(threads, &names);
        }
        None => {
            // The goals come last.
            for threads in [2, 1] {
                let program = env::current_exe().expect("this program");
                let status = process::Command::new(program)
                    .arg(format!("{THREADS}{threads}"))
                    .args(&arguments)
                    .status()
                    .expect("this program runs");
                if !status.success() {
                    process::exit(status.code().unwrap_or(1));
                }
            }
        }
    }
}

/// All that is measured with one number of threads.
fn part(threads: usize, names: &[&str]) {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build_global()
        .expect("the first pool");
    println!("\n=== {threads} thread(s); load {}", load());
    let embree = Embree::find();
    let device = match &embree {
        Ok(embree) => {
            let device = embree.device(threads).expect("a device");
            println!(
                "Embree {} ({}), {}",
                device.version(),
                device.instruction_set(),
                embree.path().display()
            );
            if device.major() < 4 {
                println!("a system's version 3 may check assertions: its times are not fair");
            }
            Some(device)
        }
        Err(error) => {
            println!("skipped, nothing is compared: {error}");
            None
        }
    };
    let names = if names.is_empty() { &SCENES } else { names };
    let mut builds = builds::Summary::default();
    for scene in real_or_built_in(names) {
        println!(
            "\n{}: {} triangles",
            scene.name,
            scene.mesh.triangles().len()
        );
        builds.measure(&scene, device.as_ref(), threads);
    }
    if threads == 1 && device.is_some() {
        let mut goals = Goals::default();
        builds.judge(&mut goals);
        goals.print();
    }
}

/// The load averages, where the system gives them.
fn load() -> String {
    std::fs::read_to_string("/proc/loadavg")
        .map(|text| text.split(' ').take(3).collect::<Vec<_>>().join(" "))
        .unwrap_or_else(|_| "unknown".into())
}
