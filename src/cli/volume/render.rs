//! `raywright volume render`: a picture of a volume, or the frames of an orbit around it.

use std::{
    f32::consts::TAU,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use clap::{Args, ValueEnum};
use raywright::{
    bvh::{Aabb, Vec3},
    imaging::{Camera, Display, ToneCurve, write_image, write_png},
    volume::{
        Behind, CastOptions, Picture, Raycaster, Skipping, Statistics, TransferFunction, View,
        Volume, Work, presets,
        view::{overview, read_transfer_function},
    },
};

use super::{look::LookOptions, source::VolumeOptions};
use crate::cli::{
    Failure, output,
    run_options::{RunOptions, cancel_on_interrupt},
};

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Skip {
    /// Take every sample of the box
    None,
    /// Jump by the distance to what can be seen
    Distance,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum BehindEnd {
    /// More of what was seen
    TheSame,
    /// Nothing, which darkens
    Nothing,
}

#[derive(Debug, Args)]
pub(crate) struct RenderArgs {
    #[command(flatten)]
    volume: VolumeOptions,
    /// Transfer function: a name in VOLUME.view.json, a file of points, or a preset (ramp, fire, soft-tissue, bone, surface); by default the first of the view file, `own` of a generated volume, or ramp
    #[arg(long, value_name = "NAME|FILE")]
    tf: Option<String>,
    #[command(flatten)]
    look: LookOptions,
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
    /// Where the picture goes: .png, or .exr or .pfm with the colours of the transfer function as they are (default: VOLUME.png in the current folder); --orbit adds -0000 and so on to the name
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Width in pixels
    #[arg(long, default_value_t = 512)]
    width: u32,
    /// Height in pixels
    #[arg(long, default_value_t = 512)]
    height: u32,
    /// Distance between samples in voxels, by the smallest spacing
    #[arg(long, default_value_t = 1.0)]
    step: f32,
    /// A ray ends when its opacity is above this; 1: never
    #[arg(long, default_value_t = 0.98)]
    termination: f32,
    /// What is taken to be behind the point at which a ray ends
    #[arg(long, value_enum, default_value_t = BehindEnd::TheSame)]
    behind: BehindEnd,
    /// Show only what is between two corners, in units of the spacing
    #[arg(long, value_name = "X,Y,Z,X,Y,Z", allow_hyphen_values = true)]
    clip: Option<String>,
    /// How empty space is left out; changes no pixel
    #[arg(long, value_enum, default_value_t = Skip::Distance)]
    skipping: Skip,
    /// Render so many frames around the target of the camera
    #[arg(long, value_name = "FRAMES", value_parser = clap::value_parser!(u32).range(1..))]
    orbit: Option<u32>,
    #[command(flatten)]
    run: RunOptions,
    /// Print times, work and settings as one JSON object
    #[arg(long)]
    json: bool,
}

#[derive(serde::Serialize)]
struct Report {
    schema_version: u32,
    volume: String,
    transfer_function: String,
    camera: String,
    output: PathBuf,
    frames: u32,
    width: u32,
    height: u32,
    step: f32,
    termination: f32,
    instruction_set: &'static str,
    /// Of all frames together.
    render_ms: f64,
    rays: u64,
    samples: u64,
    lit_samples: u64,
    skips: u64,
    interrupted: bool,
    notes: Vec<String>,
}

/// Renders and writes one picture or many; after an interruption, those that are finished stay.
pub(crate) fn run(args: &RenderArgs) -> Result<(), Failure> {
    let cancel = cancel_on_interrupt()?;
    args.run.install(|| {
        let stage = args.volume.prepare()?;
        let view = match &stage.view {
            Some(view) => Some(view.clone()),
            None => view_of(&args.volume.volume)?,
        };
        let (tf_name, function) = transfer_function(args, &stage.volume, view.as_ref())?;
        let (camera_name, camera) = camera(args, &stage.volume, view.as_ref())?;
        let mut options = CastOptions::default();
        options.step = args.step;
        options.termination = args.termination;
        options.isa = args.run.isa();
        options.behind = match args.behind {
            BehindEnd::TheSame => Behind::TheSame,
            BehindEnd::Nothing => Behind::Nothing,
        };
        options.clip = args.clip.as_deref().map(clip_box).transpose()?;
        options.skipping = match args.skipping {
            Skip::None => Skipping::None,
            Skip::Distance => Skipping::Distance,
        };
        let caster = Raycaster::new(&stage.volume)?;
        let prepared = caster.prepare_appearance(args.look.appearance(function)?)?;
        let path = args
            .output
            .clone()
            .unwrap_or_else(|| PathBuf::from(format!("{}.png", stem(&args.volume.volume))));
        let frames = args.orbit.unwrap_or(1);
        let bar = output::bar(frames as usize, "frames");
        let (mut time, mut work, mut done) = (Duration::ZERO, Work::default(), 0);
        for frame in 0..frames {
            if cancel.is_cancelled() {
                break;
            }
            let turned = orbited(&camera, frame as f32 / frames as f32);
            let start = Instant::now();
            let picture = prepared.render(&turned, [args.width, args.height], &options)?;
            time += start.elapsed();
            work.add(&picture.work);
            let numbered = args.orbit.map(|_| frame);
            write(&picture, &path, numbered)?;
            done += 1;
            bar.inc(1);
        }
        bar.finish_and_clear();
        let interrupted = done < frames;
        let render_ms = time.as_secs_f64() * 1e3;
        if args.json {
            output::json(&Report {
                schema_version: 1,
                volume: args.volume.volume.clone(),
                transfer_function: tf_name,
                camera: camera_name,
                output: path,
                frames: done,
                width: args.width,
                height: args.height,
                step: args.step,
                termination: args.termination,
                instruction_set: args.run.isa().name(),
                render_ms,
                rays: work.rays,
                samples: work.samples,
                lit_samples: work.lit_samples,
                skips: work.skips,
                interrupted,
                notes: stage.notes,
            })?;
        } else {
            let end = if interrupted { " (interrupted)" } else { "" };
            output::line(format_args!(
                "{}: {done} of {frames} frames, {render_ms:.1} ms, {:.2} million samples, {tf_name}, {camera_name}{end}",
                path.display(),
                work.samples as f64 / 1e6,
            ))?;
        }
        if interrupted {
            Err(Failure::Interrupted)
        } else {
            Ok(())
        }
    })
}

/// The box of six numbers.
fn clip_box(text: &str) -> Result<Aabb, Failure> {
    let numbers: Result<Vec<f32>, _> = text.split(',').map(|n| n.trim().parse()).collect();
    let numbers = <[f32; 6]>::try_from(numbers.unwrap_or_default());
    let [a, b, c, d, e, f] = numbers.map_err(|_| {
        Failure::with_hint(
            anyhow::anyhow!("{text} is no clip box"),
            "give two corners, as in 0,0,0,100,100,50",
        )
    })?;
    Ok(Aabb {
        min: Vec3::new(a, b, c),
        max: Vec3::new(d, e, f),
    })
}

/// The name of a volume without folder and endings.
fn stem(volume: &str) -> String {
    let name = Path::new(volume).file_name().unwrap_or_default();
    let name = name.to_string_lossy();
    name.split('.')
        .next()
        .filter(|s| !s.is_empty())
        .unwrap_or("volume")
        .to_owned()
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
    args: &RenderArgs,
    volume: &Volume,
    view: Option<&View>,
) -> Result<(String, TransferFunction), Failure> {
    let of_view = view.map(|view| &view.transfer_functions);
    let Some(name) = &args.tf else {
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
    args: &RenderArgs,
    volume: &Volume,
    view: Option<&View>,
) -> Result<(String, Camera), Failure> {
    let of_view = view.map(|view| &view.cameras);
    let Some(name) = &args.camera else {
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
    Ok((name.clone(), Camera::new(origin, target, up, args.fov)?))
}

/// The camera turned around its target, about its up direction, by a share of a full turn.
fn orbited(camera: &Camera, turn: f32) -> Camera {
    let axis = camera.up.normalize_or_zero();
    let (sine, cosine) = (turn * TAU).sin_cos();
    let arm = camera.origin - camera.target;
    // Rodrigues's formula.
    let turned = arm * cosine + axis.cross(arm) * sine + axis * axis.dot(arm) * (1.0 - cosine);
    Camera {
        origin: if turn == 0.0 {
            camera.origin
        } else {
            camera.target + turned
        },
        ..*camera
    }
}

fn write(picture: &Picture, path: &Path, frame: Option<u32>) -> Result<(), Failure> {
    let path = match frame {
        None => path.to_owned(),
        Some(frame) => {
            let stem = path.file_stem().unwrap_or_default().to_string_lossy();
            let ending = path.extension().unwrap_or_default().to_string_lossy();
            path.with_file_name(format!("{stem}-{frame:04}.{ending}"))
        }
    };
    // Colours of transfer functions are those of a screen.
    let screen = Display {
        curve: ToneCurve::Screen,
        ..Display::default()
    };
    match path.extension() {
        Some(ending) if ending.eq_ignore_ascii_case("png") => {
            write_png(&path, &picture.image, &screen)?;
        }
        _ => write_image(&path, &picture.image)?,
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_orbit_keeps_distance_and_height_and_comes_back() {
        let camera = Camera::new(Vec3::new(3.0, 1.0, 2.0), Vec3::ZERO, Vec3::Z, 30.0).unwrap();
        assert_eq!(orbited(&camera, 0.0), camera);
        let quarter = orbited(&camera, 0.25).origin;
        assert!(
            (quarter - Vec3::new(-1.0, 3.0, 2.0)).length() < 1e-5,
            "{quarter}"
        );
        assert!((orbited(&camera, 1.0).origin - camera.origin).length() < 1e-5);
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
