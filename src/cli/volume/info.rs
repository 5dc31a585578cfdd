//! `raywright volume info`: what is in a volume.

use std::time::Instant;

use clap::Args;
use raywright::volume::{Statistics, load::Placement};

use super::source::{VolumeOptions, VolumeStage};
use crate::cli::{
    Failure, output,
    rows::{number, section},
};

#[derive(Debug, Args)]
pub(crate) struct InfoArgs {
    #[command(flatten)]
    volume: VolumeOptions,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

#[derive(serde::Serialize)]
struct Report {
    schema_version: u32,
    volume: String,
    /// `generated`, or the format of the file.
    format: String,
    dims: [usize; 3],
    voxels: usize,
    spacing: [f32; 3],
    /// The type in the file.
    #[serde(rename = "type")]
    voxel_type: &'static str,
    endian: Option<&'static str>,
    compressed: bool,
    /// Bytes of the voxels in the file, without compression.
    data_bytes: u64,
    memory_type: &'static str,
    memory_bytes: usize,
    /// Value = number in memory · slope + intercept.
    slope: f32,
    intercept: f32,
    range: [f32; 2],
    mean: f64,
    /// Voxels without a value.
    missing: usize,
    /// Voxels that were infinite.
    infinite: usize,
    /// The one that is used, then others.
    orientations: Vec<Orientation>,
    load_ms: f64,
    warnings: Vec<String>,
}

#[derive(serde::Serialize)]
struct Orientation {
    source: String,
    space: String,
    axes: [[f32; 3]; 3],
    origin: [f32; 3],
}

impl From<&Placement> for Orientation {
    fn from(placement: &Placement) -> Self {
        Self {
            source: placement.source.to_string(),
            space: placement.space.clone(),
            axes: placement.orientation.axes.map(Into::into),
            origin: placement.orientation.origin.into(),
        }
    }
}

/// Prints the report.
pub(crate) fn run(args: &InfoArgs) -> Result<(), Failure> {
    let start = Instant::now();
    let stage = args.volume.prepare()?;
    let load_ms = start.elapsed().as_secs_f64() * 1e3;
    let report = Report::of(&args.volume.volume, stage, load_ms);
    if args.json {
        output::json(&report)
    } else {
        report.print()
    }
}

impl Report {
    fn of(name: &str, stage: VolumeStage, load_ms: f64) -> Self {
        let VolumeStage {
            volume,
            source,
            notes,
            ..
        } = stage;
        let voxels = volume.voxels();
        let source = source.as_ref();
        Self {
            schema_version: 1,
            volume: name.into(),
            format: source.map_or("generated".into(), |s| s.format.to_string()),
            dims: volume.dims(),
            voxels: voxels.len(),
            spacing: volume.spacing(),
            voxel_type: source.map_or(voxels.type_name(), |s| s.voxel_type.name()),
            endian: source.and_then(|s| s.endian).map(|endian| endian.name()),
            compressed: source.is_some_and(|s| s.compressed),
            data_bytes: source.map_or(voxels.bytes() as u64, |s| s.data_bytes),
            memory_type: voxels.type_name(),
            memory_bytes: voxels.bytes(),
            slope: volume.scale().slope,
            intercept: volume.scale().intercept,
            range: volume.range(),
            mean: Statistics::of(&volume).mean,
            missing: volume.missing(),
            infinite: volume.clamped(),
            orientations: source.map_or(Vec::new(), |s| {
                s.placements.iter().map(Into::into).collect()
            }),
            load_ms,
            warnings: notes,
        }
    }

    fn print(&self) -> Result<(), Failure> {
        let vector = |v: [f32; 3]| v.map(|n| number(n.into())).join(" ");
        let [x, y, z] = self.dims;
        let stored = [
            Some(self.voxel_type),
            self.endian,
            self.compressed.then_some("gzip"),
        ];
        let stored: Vec<&str> = stored.into_iter().flatten().collect();
        let rows = [
            ("format", self.format.clone()),
            ("dims", format!("{x} x {y} x {z}")),
            ("voxels", self.voxels.to_string()),
            ("spacing", vector(self.spacing)),
            ("type", stored.join(", ")),
            ("data bytes", self.data_bytes.to_string()),
            (
                "memory",
                format!("{} bytes, {}", self.memory_bytes, self.memory_type),
            ),
            ("slope", number(self.slope.into())),
            ("intercept", number(self.intercept.into())),
            ("range", self.range.map(|v| number(v.into())).join(" .. ")),
            ("mean", number(self.mean)),
            ("missing values", self.missing.to_string()),
            ("infinite values", self.infinite.to_string()),
            ("load_ms", number(self.load_ms)),
        ];
        section(&self.volume, rows)?;
        for orientation in &self.orientations {
            let title = match orientation.space.as_str() {
                "" => format!("orientation by {}", orientation.source),
                space => format!("orientation by {} in space `{space}`", orientation.source),
            };
            let [i, j, k] = orientation.axes;
            let rows = [
                ("x axis", vector(i)),
                ("y axis", vector(j)),
                ("z axis", vector(k)),
                ("origin", vector(orientation.origin)),
            ];
            section(&title, rows)?;
        }
        Ok(())
    }
}
