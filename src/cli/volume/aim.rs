//! Flags that say what of a volume is looked at, and from where.

use std::path::Path;

use clap::Args;
use raywright::{
    bvh::Vec3,
    imaging::{AnyCamera, Camera, OrthographicCamera},
    volume::{
        Statistics, TransferFunction, View, Volume, presets,
        view::{overview, read_transfer_function},
    },
};

use super::source::VolumeStage;
use crate::cli::Failure;

#[derive(Debug, Args)]
pub(crate) struct AimOptions {
    /// Transfer function: a name in VOLUME.view.json, a file of points, or a preset (ramp, fire, soft-tissue, bone, surface); by default the first of the view file, `own` of a generated volume, or ramp
    #[arg(long, value_name = "NAME|FILE")]
    tf: Option<String>,
    /// Camera: a name in VOLUME.view.json, or nine numbers: position, target, up; by default the whole volume
    #[arg(
        long,
        value_name = "NAME|X,Y,Z,X,Y,Z,X,Y,Z",
        allow_hyphen_values = true
    )]
    camera: Option<String>,
    /// Vertical field of view of a camera of nine numbers, degrees
    #[arg(long, default_value_t = 30.0)]
    fov: f32,
    /// Parallel rays: the picture is as high as the camera's view at its target
    #[arg(long)]
    orthographic: bool,
}

/// A transfer function and a camera, with their names.
#[derive(Clone, Debug)]
pub(crate) struct Aim {
    pub(crate) function_name: String,
    pub(crate) function: TransferFunction,
    pub(crate) camera_name: String,
    pub(crate) camera: AnyCamera,
}

impl AimOptions {
    /// What they say for a volume of this name.
    pub(crate) fn at(&self, stage: &VolumeStage, name: &str) -> Result<Aim, Failure> {
        let view = match &stage.view {
            Some(view) => Some(view.clone()),
            None => view_of(name)?,
        };
        let (function_name, function) = transfer_function(self, &stage.volume, view.as_ref())?;
        let (camera_name, camera) = camera(self, &stage.volume, view.as_ref())?;
        let camera = if self.orthographic {
            let arm = camera.target - camera.origin;
            let half = 0.5 * camera.vertical_fov_degrees.to_radians();
            let height = 2.0 * arm.length() * half.tan();
            OrthographicCamera::new(camera.origin, camera.target, camera.up, height)?.into()
        } else {
            camera.into()
        };
        Ok(Aim {
            function_name,
            function,
            camera_name,
            camera,
        })
    }
}

/// The view file beside a volume, if there is one.
fn view_of(volume: &str) -> Result<Option<View>, Failure> {
    let path = View::path_for(Path::new(volume));
    if path.is_file() {
        Ok(Some(View::read(&path)?))
    } else {
        Ok(None)
    }
}

fn transfer_function(
    options: &AimOptions,
    volume: &Volume,
    view: Option<&View>,
) -> Result<(String, TransferFunction), Failure> {
    let of_view = view.map(|view| &view.transfer_functions);
    let Some(name) = &options.tf else {
        if let Some((name, function)) = of_view.and_then(|all| all.first_key_value()) {
            return Ok((name.clone(), function.clone()));
        }
        return Ok(("ramp".into(), named_preset("ramp", volume)?));
    };
    if let Some(function) = of_view.and_then(|all| all.get(name)) {
        return Ok((name.clone(), function.clone()));
    }
    if Path::new(name).is_file() {
        return Ok((name.clone(), read_transfer_function(Path::new(name))?));
    }
    named_preset(name, volume)
        .map(|function| (name.clone(), function))
        .map_err(|failure| {
            let known = of_view.map(|all| all.keys().cloned().collect::<Vec<_>>().join(", "));
            match (failure, known) {
                (Failure::Error { error, hint }, Some(known)) => Failure::with_hint(
                    error,
                    format!("this volume has {known}; {}", hint.unwrap_or_default()),
                ),
                (failure, _) => failure,
            }
        })
}

fn named_preset(name: &str, volume: &Volume) -> Result<TransferFunction, Failure> {
    let window = presets::window(volume, &Statistics::of(volume));
    presets::preset(name, window).ok_or_else(|| {
        let names: Vec<&str> = presets::PRESETS.iter().map(|(name, _)| *name).collect();
        Failure::with_hint(
            anyhow::anyhow!("there is no transfer function {name}"),
            format!("presets are {}; or give a file of points", names.join(", ")),
        )
    })
}

fn camera(
    options: &AimOptions,
    volume: &Volume,
    view: Option<&View>,
) -> Result<(String, Camera), Failure> {
    let of_view = view.map(|view| &view.cameras);
    let Some(name) = &options.camera else {
        let camera = of_view.and_then(|all| all.get("overview")).copied();
        return Ok((
            "overview".into(),
            camera.unwrap_or_else(|| overview(volume)),
        ));
    };
    if let Some(camera) = of_view.and_then(|all| all.get(name)) {
        return Ok((name.clone(), *camera));
    }
    if name == "overview" {
        return Ok((name.clone(), overview(volume)));
    }
    let numbers: Result<Vec<f32>, _> = name.split(',').map(|n| n.trim().parse()).collect();
    let numbers = numbers.unwrap_or_default();
    let Ok([a, b, c, d, e, f, g, h, i]) = <[f32; 9]>::try_from(numbers) else {
        let known = of_view.map_or("overview".into(), |all| {
            all.keys().cloned().collect::<Vec<_>>().join(", ")
        });
        return Err(Failure::with_hint(
            anyhow::anyhow!("there is no camera {name}"),
            format!("this volume has {known}; or give nine numbers: position, target, up"),
        ));
    };
    let [origin, target, up] = [[a, b, c], [d, e, f], [g, h, i]].map(Vec3::from);
    Ok((name.clone(), Camera::new(origin, target, up, options.fov)?))
}
