//! `raywright volume render`: a picture of a volume, or the frames of an orbit around it.

use std::{
    f32::consts::TAU,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use clap::{Args, ValueEnum};
use raywright::{
    bvh::{Aabb, Vec3},
    imaging::{AnyCamera, Display, Image, ToneCurve, write_image, write_png},
    volume::{Behind, CastOptions, Counts, Jitter, Raycaster, Work, cast::PixelsPerRay},
};

use super::{
    aim::AimOptions,
    look::LookOptions,
    maps::{Maps, Method, Show},
    skip::SkipOptions,
    source::VolumeOptions,
};
use crate::cli::{
    Failure, output,
    run_options::{RunOptions, cancel_on_interrupt},
};

#[derive(Clone, Copy, Debug, ValueEnum)]
enum BehindEnd {
    /// More of what was seen
    TheSame,
    /// Nothing, which darkens
    Nothing,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Rays {
    /// Each has its own
    One,
    /// Two, as on a checkerboard
    Checker,
    /// Four, two by two
    Four,
}

#[derive(Debug, Args)]
pub(crate) struct RenderArgs {
    #[command(flatten)]
    volume: VolumeOptions,
    #[command(flatten)]
    aim: AimOptions,
    #[command(flatten)]
    look: LookOptions,
    /// What to show
    #[arg(long, value_enum, default_value_t = Show::Colours)]
    show: Show,
    /// How the end of rays is estimated, where that is shown
    #[arg(long, value_enum, default_value_t = Method::Mean)]
    estimate: Method,
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
    /// Move the samples of each pixel by a share of a step of its own: rings become noise
    #[arg(long)]
    jitter: bool,
    /// Pixels that share a ray; those without one are made of their neighbours, save on silhouettes
    #[arg(long, value_enum, default_value_t = Rays::One)]
    pixels_per_ray: Rays,
    #[command(flatten)]
    skip: SkipOptions,
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
        let aim = args.aim.at(&stage, &args.volume.volume)?;
        let mut options = CastOptions::default();
        options.step = args.step;
        options.termination = args.termination;
        options.isa = args.run.isa();
        options.behind = match args.behind {
            BehindEnd::TheSame => Behind::TheSame,
            BehindEnd::Nothing => Behind::Nothing,
        };
        options.clip = args.clip.as_deref().map(clip_box).transpose()?;
        options.pixels_per_ray = match args.pixels_per_ray {
            Rays::One => PixelsPerRay::One,
            Rays::Checker => PixelsPerRay::Checker,
            Rays::Four => PixelsPerRay::Four,
        };
        if args.jitter {
            options.jitter = Jitter::PerPixel;
        }
        let caster = Raycaster::new(&stage.volume)?;
        let appearance = args.look.appearance(aim.function.clone())?;
        let mut prepared = caster.prepare_appearance(appearance)?;
        args.skip.apply(&mut prepared, &mut options)?;
        let maps = args
            .show
            .map()
            .map(|map| Maps::new(map, &stage.volume, &aim.function, args.estimate.into()));
        options.counts = maps.as_ref().map_or(Counts::Total, Maps::counts);
        let path = args
            .output
            .clone()
            .unwrap_or_else(|| PathBuf::from(format!("{}.png", args.volume.stem())));
        let frames = args.orbit.unwrap_or(1);
        let bar = output::bar(frames as usize, "frames");
        let (mut time, mut work, mut done) = (Duration::ZERO, Work::default(), 0);
        for frame in 0..frames {
            if cancel.is_cancelled() {
                break;
            }
            let turned = orbited(aim.camera, frame as f32 / frames as f32);
            let start = Instant::now();
            let picture = prepared.render(turned, [args.width, args.height], &options)?;
            time += start.elapsed();
            work.add(&picture.work);
            let image = match &maps {
                Some(maps) => maps.draw(&picture, turned, &options)?,
                None => picture.image,
            };
            write(&image, &path, args.orbit.map(|_| frame))?;
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
                transfer_function: aim.function_name,
                camera: aim.camera_name,
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
                "{}: {done} of {frames} frames, {render_ms:.1} ms, {:.2} million samples, {}, {}{end}",
                path.display(),
                work.samples as f64 / 1e6,
                aim.function_name,
                aim.camera_name,
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

/// The camera turned around its target, about its up direction, by a share of a full turn.
fn orbited(camera: AnyCamera, turn: f32) -> AnyCamera {
    if turn == 0.0 {
        return camera;
    }
    let axis = camera.up().normalize_or_zero();
    let (sine, cosine) = (turn * TAU).sin_cos();
    let arm = camera.origin() - camera.target();
    // Rodrigues's formula.
    let turned = arm * cosine + axis.cross(arm) * sine + axis * axis.dot(arm) * (1.0 - cosine);
    camera.with_origin(camera.target() + turned)
}

fn write(image: &Image, path: &Path, frame: Option<u32>) -> Result<(), Failure> {
    let path = match frame {
        None => path.to_owned(),
        Some(frame) => {
            let stem = path.file_stem().unwrap_or_default().to_string_lossy();
            let ending = path.extension().unwrap_or_default().to_string_lossy();
            path.with_file_name(format!("{stem}-{frame:04}.{ending}"))
        }
    };
    write_picture(image, &path)
}

/// Writes a picture; colours of transfer functions are those of a screen.
pub(super) fn write_picture(image: &Image, path: &Path) -> Result<(), Failure> {
    let screen = Display {
        curve: ToneCurve::Screen,
        ..Display::default()
    };
    match path.extension() {
        Some(ending) if ending.eq_ignore_ascii_case("png") => write_png(path, image, &screen)?,
        _ => write_image(path, image)?,
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use raywright::imaging::Camera;

    use super::*;

    #[test]
    fn an_orbit_keeps_distance_and_height_and_comes_back() {
        let camera = Camera::new(Vec3::new(3.0, 1.0, 2.0), Vec3::ZERO, Vec3::Z, 30.0).unwrap();
        let camera = AnyCamera::from(camera);
        assert_eq!(orbited(camera, 0.0), camera);
        let quarter = orbited(camera, 0.25).origin();
        assert!(
            (quarter - Vec3::new(-1.0, 3.0, 2.0)).length() < 1e-5,
            "{quarter}"
        );
        assert!((orbited(camera, 1.0).origin() - camera.origin()).length() < 1e-5);
    }
}
