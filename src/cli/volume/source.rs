//! The volume that a command works on: a file, raw voxels with a description, or a generated one.

use std::{path::Path, str::FromStr};

use clap::Args;
use raywright::volume::{
    Generated, View, Volume, generate,
    load::{
        CompanionFiles, Endian, LoadError, LoadOptions, MissingValues, RawLayout, SourceFacts,
        VoxelType, load_volume,
    },
};

use crate::cli::{Failure, output};

/// Sizes of a generated volume.
const GENERATED_DIMS: [u64; 3] = [128; 3];

/// Which volume.
#[derive(Clone, Debug, Args)]
pub(crate) struct VolumeOptions {
    /// A file (.nrrd, .nhdr, .nii, .nii.gz, .hdr, .img, .json, .raw) or a generated volume (supernova, nebula, marschner-lobb)
    pub(crate) volume: String,
    /// Voxels along x, y, z: of raw voxels, or of a generated volume (default there: 128,128,128)
    #[arg(long, value_name = "X,Y,Z", value_parser = triple::<u64>)]
    dims: Option<[u64; 3]>,
    /// Read the file as raw voxels of this type: u8, i8, u16, i16, u32, i32, f32 or f64
    #[arg(long = "type", value_name = "TYPE", requires = "dims")]
    voxel_type: Option<VoxelType>,
    /// Order of bytes of raw voxels: little or big
    #[arg(long, requires = "voxel_type")]
    endian: Option<Endian>,
    /// Distances between raw voxels
    #[arg(long, value_name = "X,Y,Z", value_parser = triple::<f64>, requires = "voxel_type")]
    spacing: Option<[f64; 3]>,
    /// Bytes before the first raw voxel
    #[arg(long, value_name = "BYTES", requires = "voxel_type")]
    byte_skip: Option<u64>,
    /// Give this value to voxels that have none (NaN); otherwise what touches them is transparent
    #[arg(long, value_name = "VALUE", allow_hyphen_values = true)]
    fill: Option<f32>,
    /// Let a header name a file outside its folder; for headers that you trust
    #[arg(long)]
    data_anywhere: bool,
    /// Seed of a generated volume
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// A volume that is ready.
#[derive(Debug)]
pub(crate) struct VolumeStage {
    pub(crate) volume: Volume,
    /// How the file stores it; `None` if it was generated.
    pub(crate) source: Option<SourceFacts>,
    /// The view that was generated with it.
    pub(crate) view: Option<View>,
    /// What the user should know about it.
    pub(crate) notes: Vec<String>,
}

impl VolumeOptions {
    /// A volume by its name alone.
    pub(crate) fn named(volume: &str) -> Self {
        Self {
            volume: volume.to_owned(),
            dims: None,
            voxel_type: None,
            endian: None,
            spacing: None,
            byte_skip: None,
            fill: None,
            data_anywhere: false,
            seed: 1,
        }
    }

    /// The name of the volume without folder and endings.
    pub(crate) fn stem(&self) -> String {
        stem(&self.volume)
    }

    /// Loads or generates the volume, and tells on standard error what the user should know.
    pub(crate) fn prepare(&self) -> Result<VolumeStage, Failure> {
        let path = Path::new(&self.volume);
        if generate::NAMES.contains(&self.volume.as_str()) && !path.exists() {
            let Generated {
                volume,
                transfer_function,
                camera,
                ..
            } = self.generate()?;
            let mut view = View::default();
            view.transfer_functions
                .insert("own".into(), transfer_function);
            view.cameras.insert("overview".into(), camera);
            return Ok(VolumeStage {
                volume,
                source: None,
                view: Some(view),
                notes: Vec::new(),
            });
        }
        if self.dims.is_some() && self.voxel_type.is_none() {
            return Err(Failure::with_hint(
                anyhow::anyhow!("--dims is for raw voxels and for generated volumes"),
                "give --type too if the file has raw voxels",
            ));
        }
        let loaded = load_volume(path, &self.load_options()).map_err(|error| {
            match hint(&error, path.exists()) {
                Some(hint) => Failure::with_hint(error, hint),
                None => error.into(),
            }
        })?;
        let notes: Vec<String> = loaded.warnings.iter().map(ToString::to_string).collect();
        for note in &notes {
            output::note(format_args!("note: {note}"));
        }
        Ok(VolumeStage {
            volume: loaded.volume,
            source: Some(loaded.source),
            view: None,
            notes,
        })
    }

    fn generate(&self) -> Result<Generated, Failure> {
        let dims = self.dims.unwrap_or(GENERATED_DIMS);
        let dims = dims.map(|size| usize::try_from(size).unwrap_or(usize::MAX));
        let made = generate::by_name(&self.volume, dims, self.seed);
        made.map_err(|error| Failure::with_hint(error, "choose other sizes with --dims"))
    }

    fn load_options(&self) -> LoadOptions {
        let mut options = LoadOptions::default();
        if let (Some(dims), Some(voxel_type)) = (self.dims, self.voxel_type) {
            let mut raw = RawLayout::new(dims, voxel_type)
                .with_spacing(self.spacing.unwrap_or([1.0; 3]))
                .with_byte_skip(self.byte_skip.unwrap_or(0));
            raw.endian = self.endian;
            options = options.with_raw(raw);
        }
        if let Some(value) = self.fill {
            options = options.with_missing(MissingValues::Fill(value));
        }
        if self.data_anywhere {
            options = options.with_companions(CompanionFiles::Anywhere);
        }
        options
    }
}

/// What the user may try.
fn hint(error: &LoadError, exists: bool) -> Option<String> {
    match error {
        LoadError::UnknownFormat { .. } | LoadError::NotDescribed { .. } if exists => {
            Some("describe raw voxels: --dims 256,256,128 --type u16 --endian little".into())
        }
        LoadError::OutsideFolder { .. } => {
            Some("if you trust the header, --data-anywhere permits it".into())
        }
        _ if !exists => Some(format!(
            "give a file, or a generated volume: {}",
            generate::NAMES.join(", ")
        )),
        _ => None,
    }
}

fn triple<T: FromStr>(text: &str) -> Result<[T; 3], String> {
    let numbers: Result<Vec<T>, _> = text.split(',').map(|n| n.trim().parse()).collect();
    numbers
        .ok()
        .and_then(|numbers| numbers.try_into().ok())
        .ok_or_else(|| "three numbers are needed, as in 256,256,128".into())
}

fn stem(volume: &str) -> String {
    let name = Path::new(volume).file_name().unwrap_or_default();
    let name = name.to_string_lossy();
    name.split('.')
        .next()
        .filter(|s| !s.is_empty())
        .unwrap_or("volume")
        .to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triples() {
        assert_eq!(triple("1, 2,3"), Ok([1_u64, 2, 3]));
        assert_eq!(triple("1.5,2,3e-1"), Ok([1.5_f64, 2.0, 0.3]));
        for text in ["1,2", "1,2,3,4", "a,b,c", "-1,2,3", ""] {
            assert!(triple::<u64>(text).is_err(), "{text}");
        }
    }

    #[test]
    fn names_of_pictures() {
        for (volume, expected) in [
            ("a/b/chest.nii.gz", "chest"),
            ("nebula", "nebula"),
            (".nrrd", "volume"),
        ] {
            assert_eq!(stem(volume), expected);
        }
    }
}
