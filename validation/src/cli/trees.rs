//! `trees`: golden lines, or random builds, against our builder.

use std::{
    env,
    error::Error,
    path::{Path, PathBuf},
};

use clap::{Args, ValueEnum};
use raywright_bvh::{BuildParams, BuildWorkspace};
use raywright_validation::{
    Tree, TriangleSet,
    golden::{
        self, DebugTree, Figures, Fnv, GoldenQuality, Line, Outcome, SceneLevel, Steps, read_lines,
    },
};

use super::{Verdict, table::Table};

/// Where the shared data lies, seen from the checkout.
const SHARED_DATA: &str = "../shared/data";

/// Arguments of `trees`.
#[derive(Debug, Args)]
#[command(after_help = "\
Files of DIR/golden/trees: debug_steps (the sets themselves), debug_trees (whole trees: a difference
is named by its node), sets and scenes (hashes), scene_level (statistics of Embree's own scenes).
Scenes are read from DIR/scenes.

A line is equal if its tree has the hash of Embree's tree, with the order of children and leaves.
'only order' has the same tree in another order. 'equal refs' are lines whose tree depends on
Embree's thread library: only the number of references is compared. Lines that need the reciprocal
estimate of the golden machine (an AMD Zen 4) are skipped on processors with another.

Random builds need Embree (version 4 for full parity): RAYWRIGHT_EMBREE names a library file or a
folder with one; else the system's libraries and target/embree of the workspace are tried, which
tools/fetch-embree fills. Without one the command says so and has compared nothing.")]
pub(crate) struct TreesArgs {
    /// The folder with golden/trees and scenes (default: ../shared/data beside the checkout)
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Only this procedural set or scene; may be given more than once
    #[arg(long = "set", value_name = "NAME")]
    sets: Vec<String>,
    /// Only this quality; may be given more than once
    #[arg(long = "quality", value_name = "QUALITY")]
    qualities: Vec<QualityArg>,
    /// In place of the golden lines, N random builds beside an Embree library
    #[arg(long, value_name = "N", num_args = 0..=1, default_missing_value = "2000", conflicts_with_all = ["sets", "qualities"])]
    random: Option<u64>,
    /// The seed of the first random build; each further build has the next seed
    #[arg(long, value_name = "S", default_value_t = 1, requires = "random")]
    seed: u64,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum QualityArg {
    Low,
    Medium,
    High,
}

impl From<QualityArg> for GoldenQuality {
    fn from(arg: QualityArg) -> Self {
        match arg {
            QualityArg::Low => Self::Low,
            QualityArg::Medium => Self::Medium,
            QualityArg::High => Self::High,
        }
    }
}

/// Compares all files; says on standard output what came of it.
pub(crate) fn run(args: &TreesArgs) -> Result<Verdict, Box<dyn Error>> {
    let data = args.data.clone().unwrap_or_else(default_data);
    if let Some(builds) = args.random {
        return super::random::run(builds, args.seed, &data.join("scenes"));
    }
    let run = Run {
        folder: data.join("golden/trees"),
        scenes: data.join("scenes"),
        args,
    };
    if !run.folder.is_dir() {
        let folder = run.folder.display();
        return Err(format!("no golden trees in {folder}; name their folder by --data").into());
    }
    let generator_differs = run.steps()?;
    let tables = [
        run.debug_trees()?,
        run.lines("sets.jsonl")?,
        run.lines("scenes.jsonl")?,
        run.scene_level()?,
    ];
    if tables.iter().all(Table::is_empty) {
        return Err("no golden line has such a --set and --quality: nothing was compared".into());
    }
    Ok(if generator_differs || tables.iter().any(Table::differs) {
        Verdict::SomethingDiffers
    } else {
        Verdict::AllEqual
    })
}

/// Beside the workspace: Cargo names this crate's folder to programs that it runs; otherwise the
/// current folder is taken for the workspace.
pub(super) fn default_data() -> PathBuf {
    let workspace = env::var_os("CARGO_MANIFEST_DIR")
        .map(PathBuf::from)
        .and_then(|member| member.parent().map(Path::to_path_buf))
        .unwrap_or_default();
    workspace.join(SHARED_DATA)
}

struct Run<'a> {
    folder: PathBuf,
    scenes: PathBuf,
    args: &'a TreesArgs,
}

impl Run<'_> {
    fn wants_set(&self, name: &str) -> bool {
        self.args.sets.is_empty() || self.args.sets.iter().any(|set| set == name)
    }

    fn wants(&self, name: &str, quality: GoldenQuality) -> bool {
        let qualities = &self.args.qualities;
        self.wants_set(name)
            && (qualities.is_empty() || qualities.iter().any(|&arg| quality == arg.into()))
    }

    fn set(&self, name: &str) -> Result<TriangleSet, Box<dyn Error>> {
        match golden::procedural(name) {
            Some(set) => Ok(set),
            None => Ok(golden::read_obj(
                &self.scenes.join(name).join(format!("{name}.obj.gz")),
            )?),
        }
    }

    /// The generator of the sets. What the builder does inside is not compared here.
    fn steps(&self) -> Result<bool, Box<dyn Error>> {
        let steps: Vec<Steps> = read_lines(&self.folder.join("debug_steps.jsonl"))?;
        let mut wrong = Vec::new();
        let mut compared = 0;
        for step in steps.iter().filter(|step| self.wants_set(&step.set)) {
            compared += 1;
            let set = self.set(&step.set)?;
            if Fnv::of_vertices(&set.triangles) != step.vertices_hash {
                wrong.push(step.set.as_str());
            }
        }
        println!("debug_steps.jsonl: vertices of {compared} sets");
        if !wrong.is_empty() {
            println!("  the generator is wrong for {}", wrong.join(", "));
        }
        Ok(!wrong.is_empty())
    }

    fn debug_trees(&self) -> Result<Table, Box<dyn Error>> {
        let lines: Vec<DebugTree> = read_lines(&self.folder.join("debug_trees.jsonl"))?;
        let mut table = Table::default();
        let mut workspace = BuildWorkspace::default();
        for DebugTree { line, tree } in &lines {
            if !self.wants(&line.set, line.quality) {
                continue;
            }
            let set = self.set(&line.set)?;
            let expected = tree.as_ref().map(golden::tree_of_json);
            compare_line(line, &set, &mut workspace, &mut table, |ours| {
                let difference = ours.first_difference(expected.as_ref()?)?;
                Some(format!("{difference} (ours against Embree's)"))
            });
        }
        table.print("debug_trees.jsonl");
        Ok(table)
    }

    fn lines(&self, file: &str) -> Result<Table, Box<dyn Error>> {
        let lines: Vec<Line> = read_lines(&self.folder.join(file))?;
        let mut table = Table::default();
        let mut workspace = BuildWorkspace::default();
        for lines in lines.chunk_by(|a, b| a.set == b.set) {
            let name = &lines[0].set;
            let wanted = |line: &&Line| self.wants(name, line.quality);
            let lines: Vec<&Line> = lines.iter().filter(wanted).collect();
            if lines.is_empty() {
                continue;
            }
            let set = self.set(name)?;
            if set.triangles.len() > 10_000 {
                eprintln!("{name}: {} lines", lines.len());
            }
            for line in lines {
                compare_line(line, &set, &mut workspace, &mut table, |_| None);
            }
        }
        table.print(file);
        Ok(table)
    }

    fn scene_level(&self) -> Result<Table, Box<dyn Error>> {
        let lines: Vec<SceneLevel> = read_lines(&self.folder.join("scene_level.jsonl"))?;
        let mut table = Table::default();
        let mut workspace = BuildWorkspace::default();
        for lines in lines.chunk_by(|a, b| a.set == b.set) {
            if !self.wants_set(&lines[0].set) {
                continue;
            }
            let set = self.set(&lines[0].set)?;
            let (primitives, bounds) = (set.primitives(), set.bounds());
            // Many combinations of quality and flags build the same tree.
            let mut built: Vec<(BuildParams, Result<Figures, String>)> = Vec::new();
            for line in lines {
                let quality = line.built_quality();
                if !self.wants(&line.set, quality) {
                    continue;
                }
                let outcome = match golden::scene_level_parameters(line) {
                    Err(why) => Outcome::Skipped(why),
                    Ok(params) => {
                        let known = built.iter().position(|(known, _)| *known == params);
                        let place = known.unwrap_or_else(|| {
                            let tree = golden::build(&set, &primitives, &params, &mut workspace);
                            let figures =
                                tree.map(|tree| Figures::of(&tree, &bounds, params.sah_block_size));
                            built.push((params, figures));
                            built.len() - 1
                        });
                        match &built[place].1 {
                            Err(error) => Outcome::Different(format!("refused ({error})")),
                            Ok(figures) => {
                                golden::compare_scene_level(line, figures, params.branching_factor)
                            }
                        }
                    }
                };
                let name = format!(
                    "{}, scene {} {}, mesh {}",
                    line.set,
                    line.scene_quality.name(),
                    line.scene_flags,
                    line.geometry_quality.name()
                );
                table.add(quality, &name, outcome, || None);
            }
        }
        table.print("scene_level.jsonl (rows by what is built)");
        Ok(table)
    }
}

fn compare_line(
    line: &Line,
    set: &TriangleSet,
    workspace: &mut BuildWorkspace,
    table: &mut Table,
    details: impl FnOnce(&Tree) -> Option<String>,
) {
    let (outcome, ours) = golden::compare(line, set, &set.primitives(), workspace);
    let name = format!("{}, case {}", line.set, line.case);
    table.add(line.quality, &name, outcome, || details(ours.as_ref()?));
}
