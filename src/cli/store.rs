//! `raywright store`: what tuning runs left in a folder of logs: looked at, checked, merged, exported.

use std::{
    fs::File,
    io::{self, BufWriter, Write},
    num::NonZeroU32,
    path::PathBuf,
};

use clap::{Args, Subcommand, ValueEnum};
use raywright::{
    tune::Memory,
    tuner::store::{Changed, DamagePlace, Facts, Store, kind_name},
};

use super::{Failure, memory::now, output, tune::MetricOption};

#[derive(Debug, Subcommand)]
pub(crate) enum StoreCommand {
    /// Count what there is: records by kind, outcomes by machine and scene
    List(Folder),
    /// The best configuration of each machine, scene and space
    Best(BestOptions),
    /// Look for damage; exit code 1 if there is any
    Fsck(Folder),
    /// Add the records of other stores; those that are there already are no second time
    Merge(Merge),
    /// Write all logs anew without what is damaged
    Compact(Folder),
    /// Write all outcomes with their trials as a table, or all records as JSON lines
    Export(Export),
}

#[derive(Debug, Args)]
pub(crate) struct Folder {
    /// The folder of the store
    store: PathBuf,
}

#[derive(Debug, Args)]
pub(crate) struct BestOptions {
    /// The folder of the store
    store: PathBuf,
    /// What is to be small
    #[arg(long, value_enum, default_value_t = MetricOption::Total)]
    metric: MetricOption,
    /// Frames that a tree serves, with the metric total
    #[arg(long, default_value_t = NonZeroU32::MIN)]
    frames_per_tree: NonZeroU32,
}

#[derive(Debug, Args)]
pub(crate) struct Merge {
    /// The folder that gets the records
    store: PathBuf,
    /// Folders whose records it gets; they are not changed
    #[arg(required = true)]
    from: Vec<PathBuf>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Format {
    /// A row for each outcome
    Csv,
    /// A line for each record
    Json,
}

#[derive(Debug, Args)]
pub(crate) struct Export {
    /// The folder of the store
    store: PathBuf,
    /// How it is written
    #[arg(long, value_enum, default_value_t = Format::Csv)]
    format: Format,
    /// Where it goes (default: standard output)
    #[arg(short, long)]
    output: Option<PathBuf>,
}

/// Runs a command.
pub(crate) fn run(command: &StoreCommand) -> Result<(), Failure> {
    match command {
        StoreCommand::List(folder) => list(&opened(&folder.store)?),
        StoreCommand::Best(options) => best(options),
        StoreCommand::Fsck(folder) => fsck(&opened(&folder.store)?),
        StoreCommand::Merge(merge) => {
            let from = merge
                .from
                .iter()
                .map(opened)
                .collect::<Result<Vec<_>, _>>()?;
            let store = Store::open(&merge.store)?;
            for other in from {
                let contents = other.read()?;
                let changed = store.import(&contents.records)?;
                output::line(format_args!(
                    "{}: {} records, {}",
                    other.folder().display(),
                    contents.records.len(),
                    sizes(&changed)
                ))?;
            }
            Ok(())
        }
        StoreCommand::Compact(folder) => {
            let changed = opened(&folder.store)?.compact(now()?)?;
            output::line(sizes(&changed))?;
            Ok(())
        }
        StoreCommand::Export(export) => {
            let records = opened(&export.store)?.read()?.records;
            let mut out: Box<dyn Write> = match &export.output {
                Some(path) => Box::new(BufWriter::new(File::create(path)?)),
                None => Box::new(BufWriter::new(io::stdout().lock())),
            };
            match export.format {
                Format::Csv => records.write_csv(&mut out)?,
                Format::Json => records.write_json_lines(&mut out)?,
            }
            Ok(out.flush()?)
        }
    }
}

/// A store that there is: reading makes no folder.
fn opened(folder: &PathBuf) -> Result<Store, Failure> {
    if folder.is_dir() {
        Ok(Store::open(folder)?)
    } else {
        Err(anyhow::anyhow!("{} is no folder", folder.display()).into())
    }
}

fn list(store: &Store) -> Result<(), Failure> {
    let contents = store.read()?;
    let stats = contents.records.stats();
    output::line(format_args!(
        "{} files, {} records; trials: {} done, {} failed, {} cancelled, {} open",
        contents.files.len(),
        contents.records.len(),
        stats.done,
        stats.failed,
        stats.cancelled,
        stats.open
    ))?;
    for (kind, count) in &stats.by_kind {
        output::line(format_args!("{:>8} {}", count, kind_of(*kind)))?;
    }
    for (machine, count) in &stats.by_machine {
        output::line(format_args!(
            "machine {}: {count} outcomes",
            machine.as_str()
        ))?;
    }
    for (scene, count) in &stats.by_scene {
        output::line(format_args!("scene {}: {count} outcomes", scene.as_str()))?;
    }
    Ok(())
}

/// A paragraph for each machine, scene and space.
fn best(options: &BestOptions) -> Result<(), Failure> {
    let records = opened(&options.store)?.read()?.records;
    let metric = options.metric.metric(options.frames_per_tree);
    let all = records.best(|outcome| Memory::cost(outcome, metric));
    if all.is_empty() {
        output::note("nothing was measured");
    }
    for best in all {
        let fact = |facts: Option<&Facts>, name: &str| -> String {
            facts
                .and_then(|facts| facts.get(name))
                .map_or_else(|| "?".into(), ToString::to_string)
        };
        let scene = records.scene(&best.scene).map(|scene| &scene.facts);
        let machine = records.machine(&best.machine).map(|machine| &machine.facts);
        output::line(format_args!(
            "{} ({}×{}, K = {}) on {}, {} threads, {}",
            fact(scene, "name"),
            fact(scene, "width"),
            fact(scene, "height"),
            fact(scene, "path_length"),
            fact(machine, "processor"),
            fact(machine, "threads"),
            fact(machine, "instruction_set"),
        ))?;
        output::line(format_args!(
            "  {:.2} ms over {} trials, the best of {} configurations (space {})",
            best.cost * 1e3,
            best.n,
            best.of,
            best.space.as_str()
        ))?;
        let values: Vec<String> = (best.config.iter())
            .map(|(name, value)| format!("{name}={value}"))
            .collect();
        output::line(format_args!("  {}", values.join(" ")))?;
    }
    Ok(())
}

fn fsck(store: &Store) -> Result<(), Failure> {
    let report = store.fsck()?;
    for file in &report.files {
        let records: usize = file.by_kind.values().sum();
        let path = file.path.display();
        output::line(format_args!(
            "{path}: {records} records, {} bytes",
            file.bytes
        ))?;
        for damage in &file.damage {
            let place = match damage.place {
                DamagePlace::Head => "the beginning",
                DamagePlace::Middle => "between records",
                DamagePlace::Tail => "the end, or a record that is being written",
            };
            output::line(format_args!(
                "  damaged: {} bytes from byte {} on: {place}",
                damage.bytes, damage.offset
            ))?;
        }
    }
    for path in &report.newer {
        output::line(format_args!("{}: of a later version", path.display()))?;
    }
    if report.conflicts > 0 {
        output::line(format_args!(
            "{} records with two contents",
            report.conflicts
        ))?;
    }
    if report.is_clean() {
        Ok(())
    } else {
        Err(Failure::Check)
    }
}

fn kind_of(kind: u32) -> String {
    kind_name(kind).map_or_else(|| format!("kind {kind}"), str::to_owned)
}

fn sizes(changed: &Changed) -> String {
    format!(
        "{} files written anew, {} bytes before, {} after",
        changed.files, changed.bytes_before, changed.bytes_after
    )
}
