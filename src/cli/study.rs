//! `raywright study`: measurements that are kept as data.
//!
//! `record` appends one row per configuration and camera as soon as it is there; a table that has rows
//! already is gone on with, so that a recording can be stopped at any moment. `gains` has a file of its own.

mod gains;

use std::{
    collections::{BTreeMap, HashSet},
    fmt::Write as _,
    fs::{self, OpenOptions},
    io::Write as _,
    path::{Path, PathBuf},
};

use clap::{Args, Subcommand};
use raywright::{
    bvh::BuildParams,
    imaging::{Camera, CancelToken},
    tracer::Integrator,
    tune::{
        Metric, ParameterSpace, Recorded, Recorder, Settings, SpaceAxes, WallClock, described,
        milliseconds, portfolio, random_params,
    },
};
use serde::Deserialize;

use super::{
    Failure, output,
    run_options::{RunOptions, cancel_on_interrupt},
    scene::SceneOptions,
};

#[derive(Debug, Subcommand)]
pub(crate) enum StudyCommand {
    /// Record what many configurations take in a scene: one row per configuration and camera
    Record(RecordArgs),
    /// What tuning gains on the default parameters, by real frames of several scenes and seeds
    Gains(gains::GainsArgs),
}

#[derive(Debug, Args)]
pub(crate) struct RecordArgs {
    #[command(flatten)]
    scene: SceneOptions,
    /// A file with named cameras of scenes: {"scenes": {NAME: {"cameras": [{"name", "eye", "target", "up",
    /// "fov_y_deg"}]}}}; by default there is one camera
    #[arg(long, value_name = "FILE")]
    cameras: Option<PathBuf>,
    /// Cameras that are taken from the file, from the first
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..))]
    views: u32,
    /// Configurations, known-good ones among them
    #[arg(long, default_value_t = 300, value_parser = clap::value_parser!(u32).range(1..))]
    configurations: u32,
    /// Frames with each configuration and camera, in turns with the default parameters: medians count
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..))]
    repeats: u32,
    /// Width of a frame in pixels
    #[arg(long, default_value_t = 320)]
    width: u32,
    /// Height of a frame in pixels
    #[arg(long, default_value_t = 180)]
    height: u32,
    /// Scattering events of a path, K
    #[arg(long, default_value_t = Integrator::DEFAULT_PATH_LENGTH)]
    path_length: u32,
    /// Seed of the configurations and of the pictures
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The table, which is gone on with if it is there
    #[arg(short, long, default_value = "recording.csv")]
    output: PathBuf,
    #[command(flatten)]
    run: RunOptions,
}

/// Runs a command.
pub(crate) fn run(command: &StudyCommand) -> Result<(), Failure> {
    let cancel = cancel_on_interrupt()?;
    match command {
        StudyCommand::Record(args) => args.run.install(|| record(args, &cancel)),
        StudyCommand::Gains(args) => args.run.install(|| gains::run(args, &cancel)),
    }
}

#[derive(Deserialize)]
struct CameraFile {
    scenes: BTreeMap<String, SceneCameras>,
}

#[derive(Deserialize)]
struct SceneCameras {
    cameras: Vec<NamedCamera>,
}

#[derive(Deserialize)]
struct NamedCamera {
    name: String,
    eye: [f32; 3],
    target: [f32; 3],
    up: [f32; 3],
    fov_y_deg: f32,
}

/// The first cameras of a scene in a file.
fn cameras(path: &Path, scene: &str, count: usize) -> Result<Vec<(String, Camera)>, Failure> {
    let mut file: CameraFile = serde_json::from_str(&fs::read_to_string(path)?)?;
    let Some(own) = file.scenes.remove(scene) else {
        let names: Vec<String> = file.scenes.into_keys().collect();
        return Err(Failure::with_hint(
            anyhow::anyhow!("{} has no scene {scene}", path.display()),
            format!("it has {}", names.join(", ")),
        ));
    };
    let cameras = own.cameras.into_iter().take(count).map(|line| {
        let camera = Camera {
            origin: line.eye.into(),
            target: line.target.into(),
            up: line.up.into(),
            vertical_fov_degrees: line.fov_y_deg,
        };
        (line.name, camera)
    });
    Ok(cameras.collect())
}

fn record(args: &RecordArgs, cancel: &CancelToken) -> Result<(), Failure> {
    let stage = args.scene.prepare()?;
    let views = match &args.cameras {
        Some(path) => cameras(path, &stage.name, args.views as usize)?,
        None => vec![("default".to_owned(), stage.camera)],
    };
    let (names, views): (Vec<String>, Vec<Camera>) = views.into_iter().unzip();
    let settings = Settings {
        width: args.width,
        height: args.height,
        path_length: args.path_length,
        metric: Metric::Render,
        seed: args.seed,
        isa: args.run.isa(),
    };
    let reference = BuildParams::default();
    let configurations = configurations(args)?;
    let run = format!(
        "{}x{} path {} seed {} {} threads {}",
        args.width,
        args.height,
        args.path_length,
        args.seed,
        settings.isa.name(),
        rayon::current_num_threads()
    );
    let done = rows_of(&args.output, [&stage.name, &run], &reference, views.len())?;
    let mut file = OpenOptions::new()
        .create(true)
        .append(true)
        .open(&args.output)?;
    if file.metadata()?.len() == 0 {
        file.write_all(header(&reference).as_bytes())?;
    }
    let mut recorder = Recorder::new(
        &stage.world,
        &views,
        settings,
        &reference,
        args.repeats as usize,
        WallClock::start(),
    )?;
    let bar = output::bar(configurations.len(), "recording");
    for (index, (source, params)) in configurations.iter().enumerate() {
        if !done.contains(&index) {
            let Some(recorded) = recorder.record(params, cancel)? else {
                bar.finish_and_clear();
                return Err(Failure::Interrupted);
            };
            let row = Row {
                scene: &stage.name,
                index,
                run: &run,
                source,
                params,
                repeats: args.repeats,
            };
            // All rows of a configuration at once: it is there, or it is not.
            file.write_all(row.lines(&names, &recorded).as_bytes())?;
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    output::line(args.output.display())?;
    Ok(())
}

/// The configurations with their origin: Embree's defaults, the portfolio, and random ones.
fn configurations(args: &RecordArgs) -> Result<Vec<(&'static str, BuildParams)>, Failure> {
    let mut named = vec![
        ("table-1-default", BuildParams::embree_api_default()),
        ("embree-scene", BuildParams::embree_scene_medium()),
    ];
    let default = BuildParams::default();
    for metric in [Metric::Render, Metric::Total] {
        for params in portfolio(&default, metric, SpaceAxes::Canonical) {
            if named.iter().all(|known| *known != ("portfolio", params)) {
                named.push(("portfolio", params));
            }
        }
    }
    named.truncate(args.configurations as usize);
    let space = ParameterSpace::new(&default, &[], SpaceAxes::Canonical)?;
    let known: Vec<BuildParams> = named.iter().map(|(_, params)| *params).collect();
    let left = args.configurations as usize - named.len();
    let random = random_params(&space, &known, left, args.seed);
    named.extend(random.into_iter().map(|params| ("random", params)));
    Ok(named)
}

const BEFORE: &str = "scene,row,run,source";
const BEHIND: &str = "fail,cam,reps,render_ms,ref_ms,build_ms,ref_build_ms,nodes,leaves,refs,bytes,depth,sah_nodes,sah_blocks";

fn header(params: &BuildParams) -> String {
    let names: Vec<String> = described(params)
        .into_iter()
        .map(|(name, _)| name)
        .collect();
    format!("{BEFORE},{},{BEHIND}\n", names.join(","))
}

/// The configurations of a scene that a table has already. A last one of which a part is missing is cut
/// off: a line without an end, or fewer lines than there are `cameras`.
fn rows_of(
    path: &Path,
    [scene, run]: [&str; 2],
    params: &BuildParams,
    cameras: usize,
) -> Result<HashSet<usize>, Failure> {
    let Ok(text) = fs::read_to_string(path) else {
        return Ok(HashSet::new());
    };
    let is_whole = |line: &&str| line.ends_with('\n');
    let lines: Vec<&str> = text.split_inclusive('\n').filter(is_whole).collect();
    let Some((&first, rows)) = lines.split_first() else {
        // Not even a head: whatever it is, it is begun anew if it could be one.
        return match header(params).starts_with(&text) {
            true => Ok(fs::write(path, "").map(|()| HashSet::new())?),
            false => Err(another(path)),
        };
    };
    if first != header(params) {
        return Err(another(path));
    }
    let fail = first.split(',').position(|name| name == "fail");
    let key = |line: &str| {
        let mut cells = line.split(',');
        Some((
            cells.next()?.to_owned(),
            cells.next()?.parse::<usize>().ok()?,
        ))
    };
    let mut whole = rows.len();
    if let Some(last) = rows.last() {
        let own = rows
            .iter()
            .rev()
            .take_while(|line| key(line) == key(last))
            .count();
        let failed = fail.and_then(|column| last.split(',').nth(column)) == Some("1");
        if !failed && own < cameras {
            whole -= own;
        }
    }
    let own = || {
        rows.iter()
            .filter(|line| line.split(',').next() == Some(scene))
    };
    // Rows that were recorded otherwise are no rows of this recording.
    if own().any(|line| line.split(',').nth(2) != Some(run)) {
        return Err(another(path));
    }
    let kept = first.len() + rows[..whole].iter().map(|line| line.len()).sum::<usize>();
    if kept < text.len() {
        let file = OpenOptions::new().write(true).open(path)?;
        file.set_len(kept as u64)?;
    }
    let kept = rows[..whole].iter().filter_map(|line| key(line));
    let kept = kept.filter(|(name, _)| name == scene);
    Ok(kept.map(|(_, row)| row).collect())
}

fn another(path: &Path) -> Failure {
    Failure::with_hint(
        anyhow::anyhow!("{} is another table", path.display()),
        "give another file with --output",
    )
}

struct Row<'a> {
    scene: &'a str,
    index: usize,
    /// How frames were made.
    run: &'a str,
    source: &'a str,
    params: &'a BuildParams,
    repeats: u32,
}

impl Row<'_> {
    /// A line for each camera; one without a camera if there is no tree.
    fn lines(&self, cameras: &[String], recorded: &Recorded) -> String {
        let values: Vec<String> = described(self.params).into_iter().map(|(_, v)| v).collect();
        let before = format!(
            "{},{},{},{},{}",
            self.scene,
            self.index,
            self.run,
            self.source,
            values.join(",")
        );
        let mut text = String::new();
        let Ok(tree) = &recorded.tree else {
            let _ = writeln!(
                text,
                "{before},1,,,,,,{:.3},,,,,,,",
                milliseconds(recorded.reference_build)
            );
            return text;
        };
        for (camera, frame) in cameras.iter().zip(&tree.cameras) {
            let stats = &tree.stats;
            let render = frame
                .render
                .map_or_else(String::new, |time| format!("{:.3}", milliseconds(time)));
            let _ = writeln!(
                text,
                "{before},0,{camera},{},{render},{:.3},{:.3},{:.3},{},{},{},{},{},{:.5},{:.5}",
                self.repeats,
                milliseconds(frame.reference),
                milliseconds(tree.build),
                milliseconds(recorded.reference_build),
                stats.nodes,
                stats.leaves,
                stats.references,
                stats.bytes,
                stats.depth,
                stats.sah_nodes,
                stats.sah_blocks,
            );
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_gone_on_with_and_no_other_is_touched() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("table.csv");
        let params = BuildParams::default();
        let rows = |cameras| rows_of(&path, ["a", "x"], &params, cameras);
        assert!(rows(1).unwrap().is_empty());
        let text = format!("{}a,0,x,\na,3,x,\nb,5,x,\na,4", header(&params));
        fs::write(&path, &text).unwrap();
        assert_eq!(rows(1).unwrap(), HashSet::from([0, 3]));
        assert_eq!(fs::read_to_string(&path).unwrap(), text[..text.len() - 3]);
        let two = format!("{}a,0,x,\na,0,x,\na,1,x,\n", header(&params));
        fs::write(&path, &two).unwrap();
        assert_eq!(rows(2).unwrap(), HashSet::from([0]));
        assert_eq!(fs::read_to_string(&path).unwrap(), two[..two.len() - 7]);
        fs::write(&path, &text[..10]).unwrap();
        assert!(rows(1).unwrap().is_empty() && fs::read(&path).unwrap().is_empty());
        let otherwise = format!("{}a,0,y,\n", header(&params));
        for other in [&otherwise[..], "other\n1\n", "other"] {
            fs::write(&path, other).unwrap();
            assert!(rows(1).is_err());
            assert_eq!(fs::read_to_string(&path).unwrap(), other);
        }
    }
}
