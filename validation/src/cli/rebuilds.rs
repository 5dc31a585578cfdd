//! `rebuilds`: many builds of a scene in one process and one workspace, each tree in the memory of
//! the last; the memory of the process must not grow after the third build.

use std::{error::Error, fs, path::PathBuf};

use clap::Args;
use raywright_bvh::{BuildParams, BuildWorkspace, Bvh, TriangleMesh};
use raywright_validation::golden;

use super::{Verdict, trees::default_data};

/// Builds of each quality after which memory is as large as it will be: buffers that change places
/// grow in the second.
const WARM_UP: usize = 3;

/// Resident memory may grow by so many kibibytes: pages of the program itself that are used late.
const TOLERANCE_KIB: usize = 1024;

/// Arguments of `rebuilds`.
#[derive(Debug, Args)]
#[command(after_help = "\
Resident memory is printed after some builds, where the system tells it (Linux). Exit code 1 if it
is more after the last build than after the third one of each quality, or if the workspace is.")]
pub(crate) struct RebuildsArgs {
    /// The folder with scenes (default: ../shared/data beside the checkout)
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Which scene
    #[arg(long, value_name = "NAME", default_value = "conference")]
    scene: String,
    /// How many builds
    #[arg(long, value_name = "N", default_value_t = 200)]
    count: usize,
    /// How many threads
    #[arg(long, value_name = "N", default_value_t = 1)]
    threads: usize,
    /// Quality of the builds; several are built in turn
    #[arg(long = "quality", value_name = "QUALITY", default_value = "binned-sah")]
    qualities: Vec<String>,
}

/// Builds, and says on standard output what the memory was.
pub(crate) fn run(args: &RebuildsArgs) -> Result<Verdict, Box<dyn Error>> {
    let data = args.data.clone().unwrap_or_else(default_data);
    let name = &args.scene;
    let path = data
        .join("scenes")
        .join(name)
        .join(format!("{name}.obj.gz"));
    if !path.exists() {
        println!("skipped, nothing built: there is no {}", path.display());
        return Ok(Verdict::AllEqual);
    }
    rayon::ThreadPoolBuilder::new()
        .num_threads(args.threads)
        .build_global()?;
    let mut settings = Vec::new();
    for quality in &args.qualities {
        let mut params = BuildParams::default();
        params.set("quality", quality)?;
        settings.push(params);
    }
    let mesh = mesh_of(&path)?;
    println!(
        "{name}, {} triangles, {} builds, {} thread(s), {}",
        mesh.triangles().len(),
        args.count,
        args.threads,
        args.qualities.join(", "),
    );
    let warm = WARM_UP * settings.len();
    let mut workspace = BuildWorkspace::default();
    let (mut before, mut last) = (None, None);
    for build in 1..=args.count {
        let params = &settings[build % settings.len()];
        let tree = Bvh::build_in(&[&mesh], params, &mut workspace)?;
        tree.recycle(&mut workspace);
        let now = Memory::now(&workspace);
        if build == warm {
            before = Some(now);
        }
        if build == warm || build == args.count || build.is_multiple_of(50) {
            println!("  build {build}: {now}");
        }
        last = Some(now);
    }
    let (Some(before), Some(last)) = (before, last) else {
        return Err(format!("a comparison needs more than {warm} builds").into());
    };
    if last.has_grown_since(&before) {
        println!("memory has grown");
        return Ok(Verdict::SomethingDiffers);
    }
    println!("no growth after build {warm}");
    Ok(Verdict::AllEqual)
}

fn mesh_of(path: &std::path::Path) -> Result<TriangleMesh, Box<dyn Error>> {
    let triangles = golden::read_obj(path)?.triangles;
    let indices = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
    Ok(TriangleMesh::new(triangles.concat(), indices.collect())?)
}

/// What is held after a build.
#[derive(Clone, Copy, Debug)]
struct Memory {
    /// Bytes of the workspace, the last tree included.
    workspace: usize,
    /// Kibibytes of the process that are resident, now and at most; none where nobody tells.
    resident: Option<[usize; 2]>,
}

impl Memory {
    fn now(workspace: &BuildWorkspace) -> Self {
        let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
        let field = |name: &str| {
            let line = status.lines().find_map(|line| line.strip_prefix(name))?;
            line.trim_end_matches("kB").trim().parse().ok()
        };
        let resident = field("VmRSS:").zip(field("VmHWM:"));
        Self {
            workspace: workspace.bytes(),
            resident: resident.map(|(now, most)| [now, most]),
        }
    }

    fn has_grown_since(&self, before: &Self) -> bool {
        let resident = self.resident.zip(before.resident);
        self.workspace > before.workspace
            || resident.is_some_and(|(own, before)| {
                (0..2).any(|which| own[which] > before[which] + TOLERANCE_KIB)
            })
    }
}

impl std::fmt::Display for Memory {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "workspace {} KiB", self.workspace / 1024)?;
        match self.resident {
            Some([now, most]) => write!(f, ", resident {now} KiB, at most {most} KiB"),
            None => write!(f, ", resident unknown"),
        }
    }
}
