//! How a volume is looked at: transfer functions and cameras by name, from `NAME.view.json`; and
//! transfer functions alone, in the same form: a list of points `[value, r, g, b, opacity]`.
//!
//! ```json
//! { "transfer_functions": { "sparse": [[0, 0, 0, 0, 0], [255, 1, 1, 1, 0.8]] },
//!   "cameras": { "overview": { "position": [9, 9, 9], "focal": [0, 0, 0], "up": [0, 0, 1],
//!                              "vfov_deg": 30 } } }
//! ```
//!
//! Cameras are in the space of the grid, world = index · spacing. Other names in the file are notes
//! for its readers and are passed over.

use std::{
    collections::BTreeMap,
    fs::File,
    io::{self, Read},
    path::{Path, PathBuf},
};

use glam::Vec3;
use raywright_imaging::{Camera, CameraError};
use serde::Deserialize;

use crate::{grid::Volume, transfer::TransferFunction};

/// Bytes of a file at most: 10^5 points of a transfer function are about 5 MB.
const MAX_BYTES: u64 = 1 << 26;

/// Transfer functions and cameras by name.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct View {
    /// Transfer functions.
    pub transfer_functions: BTreeMap<String, TransferFunction>,
    /// Cameras.
    pub cameras: BTreeMap<String, Camera>,
}

/// Why a file gave no view or transfer function.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ViewError {
    /// The file could not be read or written.
    #[error("cannot access {}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        source: io::Error,
    },
    /// More bytes than any view has.
    #[error("{}: larger than the limit of {limit} bytes", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// The limit.
        limit: u64,
    },
    /// The text is not JSON of the right form, or a transfer function in it is none.
    #[error("{}", path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// What, and in which line.
        source: serde_json::Error,
    },
    /// A camera describes no view.
    #[error("{}: camera `{name}`", path.display())]
    Camera {
        /// The file.
        path: PathBuf,
        /// The name of the camera.
        name: String,
        /// Why not.
        source: CameraError,
    },
}

#[derive(Deserialize)]
struct ViewFile {
    #[serde(default)]
    transfer_functions: BTreeMap<String, TransferFunction>,
    #[serde(default)]
    cameras: BTreeMap<String, CameraFile>,
}

#[derive(Deserialize)]
struct CameraFile {
    position: [f32; 3],
    focal: [f32; 3],
    up: [f32; 3],
    vfov_deg: f32,
}

impl View {
    /// Reads a view file.
    ///
    /// # Errors
    /// See [`ViewError`].
    pub fn read(path: &Path) -> Result<Self, ViewError> {
        Self::parse(&read(path)?, path)
    }

    /// Parses the bytes of a view file; `path` is for messages.
    ///
    /// # Errors
    /// See [`ViewError`].
    pub fn parse(bytes: &[u8], path: &Path) -> Result<Self, ViewError> {
        let file: ViewFile = serde_json::from_slice(bytes).map_err(json_fault(path))?;
        let cameras = file.cameras.into_iter().map(|(name, camera)| {
            let made = Camera::new(
                camera.position.into(),
                camera.focal.into(),
                camera.up.into(),
                camera.vfov_deg,
            );
            match made {
                Ok(camera) => Ok((name, camera)),
                Err(source) => Err(ViewError::Camera {
                    path: path.into(),
                    name,
                    source,
                }),
            }
        });
        Ok(Self {
            cameras: cameras.collect::<Result<_, _>>()?,
            transfer_functions: file.transfer_functions,
        })
    }

    /// The view file that belongs to a volume file: `a/head.nii.gz` has `a/head.view.json`.
    #[must_use]
    pub fn path_for(volume: &Path) -> PathBuf {
        let name = volume.file_name().unwrap_or_default().to_string_lossy();
        let lower = name.to_lowercase();
        let ending = crate::load::KNOWN_ENDINGS
            .iter()
            .filter(|ending| lower.ends_with(*ending))
            .map(|ending| ending.len())
            .max();
        let stem = name.len() - ending.unwrap_or(0);
        // Lower case may have another length; then the whole name is kept.
        let stem = name.get(..stem).unwrap_or(&name);
        volume.with_file_name(format!("{stem}.view.json"))
    }
}

/// Reads a transfer function: a list of points.
///
/// # Errors
/// See [`ViewError`].
pub fn read_transfer_function(path: &Path) -> Result<TransferFunction, ViewError> {
    serde_json::from_slice(&read(path)?).map_err(json_fault(path))
}

/// Writes a transfer function: a list of points, one a line.
///
/// # Errors
/// [`ViewError::Io`].
pub fn write_transfer_function(path: &Path, function: &TransferFunction) -> Result<(), ViewError> {
    let lines: Result<Vec<String>, _> = function
        .points()
        .iter()
        .map(serde_json::to_string)
        .collect();
    let text = format!("[\n {}\n]\n", lines.map_err(json_fault(path))?.join(",\n "));
    std::fs::write(path, text).map_err(|source| ViewError::Io {
        path: path.into(),
        source,
    })
}

/// A camera that shows the whole volume, from in front, above and the right; z is up.
///
/// It stands 1.9 diagonals from the centre with a field of view of 30 degrees, as the cameras
/// `overview` of the test volumes do.
#[must_use]
pub fn overview(volume: &Volume) -> Camera {
    let diagonal = volume.extent().length().max(volume.unit_length());
    let target = volume.extent() * 0.5;
    let direction = Vec3::new(0.497, -0.795, 0.348).normalize();
    Camera {
        origin: target + direction * (1.9 * diagonal),
        target,
        up: Vec3::Z,
        vertical_fov_degrees: 30.0,
    }
}

fn read(path: &Path) -> Result<Vec<u8>, ViewError> {
    let io_fault = |source| ViewError::Io {
        path: path.into(),
        source,
    };
    if !std::fs::metadata(path).map_err(io_fault)?.is_file() {
        return Err(io_fault(io::Error::other("not a regular file")));
    }
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(io_fault)?;
    let mut limited = file.take(MAX_BYTES + 1);
    limited.read_to_end(&mut bytes).map_err(io_fault)?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(ViewError::TooLarge {
            path: path.into(),
            limit: MAX_BYTES,
        });
    }
    Ok(bytes)
}

fn json_fault(path: &Path) -> impl FnOnce(serde_json::Error) -> ViewError {
    let path = path.into();
    move |source| ViewError::Json { path, source }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::{ValueScale, Voxels};

    fn parse(text: &str) -> Result<View, ViewError> {
        View::parse(text.as_bytes(), Path::new("a.view.json"))
    }

    #[test]
    fn functions_and_cameras_by_name() {
        let view = parse(
            r#"{"volume": "a.nrrd", "transfer_functions": {"sparse": [[0,0,0,0,0],[5,1,1,1,0.5]]},
            "cameras": {"close": {"position": [0,-9,0], "focal": [0,0,0], "up": [0,0,1], "vfov_deg": 50}}}"#,
        )
        .unwrap();
        assert_eq!(view.transfer_functions["sparse"].points().len(), 2);
        let camera = view.cameras["close"];
        assert_eq!(
            (camera.origin, camera.vertical_fov_degrees),
            (Vec3::new(0.0, -9.0, 0.0), 50.0)
        );
        assert_eq!(parse("{}").unwrap(), View::default());
    }

    #[test]
    fn what_is_refused() {
        for (text, expected) in [
            ("", "a.view.json"),
            (
                "{\"transfer_functions\": {\"x\": []}}",
                "at least one point",
            ),
            (
                "{\"transfer_functions\": {\"x\": [[0,0,0,0,1.5]]}}",
                "opacity is 1.5",
            ),
            (
                "{\"transfer_functions\": {\"x\": [[0,0,0,0,1e999]]}}",
                "line 1",
            ),
            ("{\"cameras\": {\"c\": {\"position\": [0,0,0]}}}", "focal"),
            (
                "{\"cameras\": {\"c\": {\"position\": [0,0,0], \"focal\": [0,0,0], \"up\": [0,0,1], \"vfov_deg\": 50}}}",
                "camera `c`",
            ),
        ] {
            let error = parse(text).unwrap_err();
            let cause = std::error::Error::source(&error).map(ToString::to_string);
            let message = format!("{error}: {}", cause.unwrap_or_default());
            assert!(message.contains(expected), "{message}");
        }
    }

    #[test]
    fn transfer_functions_there_and_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.json");
        let function = crate::presets::preset("fire", [0.1, 0.7]).unwrap();
        write_transfer_function(&path, &function).unwrap();
        assert_eq!(read_transfer_function(&path).unwrap(), function);
        let absent = read_transfer_function(&folder.path().join("u.json"));
        assert!(matches!(absent, Err(ViewError::Io { .. })));
    }

    #[test]
    fn names_of_view_files() {
        for (volume, view) in [
            ("a/head.nii.gz", "a/head.view.json"),
            ("a.b.NHDR", "a.b.view.json"),
            ("lung.json", "lung.view.json"),
            ("x", "x.view.json"),
        ] {
            assert_eq!(View::path_for(Path::new(volume)), Path::new(view));
        }
    }

    #[test]
    fn an_overview_of_any_volume() {
        for dims in [[1, 1, 1], [100, 2, 1], [3, 4, 5]] {
            let count = dims.iter().product();
            let voxels = Voxels::U8(vec![0; count]);
            let volume = Volume::new(dims, [0.1, 1.0, 9.0], voxels, ValueScale::default());
            overview(&volume.unwrap()).validate().unwrap();
        }
    }
}
