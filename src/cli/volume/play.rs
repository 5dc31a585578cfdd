//! `raywright volume play`: a sequence as a user would see it, each frame in its time as far as it can
//! be had.

use std::path::PathBuf;

use clap::{
    Args,
    builder::{PossibleValue, PossibleValuesParser, TypedValueParser},
};
use raywright::{
    report::timeline::{Timeline, TimelineHeader, timeline_page},
    study::steering::{Clock, FrameRow, Run, Stage, Summary, Way, play},
    volume::{
        Estimator, Raycaster, Sequence,
        sequence::script::{Start, thirty_seconds},
        steer::Resolution,
    },
};

use super::{render::write_picture, script::views, source::VolumeOptions};
use crate::cli::{
    Failure, output,
    run_options::{RunOptions, cancel_on_interrupt},
};

#[derive(Debug, Args)]
pub(crate) struct PlayArgs {
    #[command(flatten)]
    volume: VolumeOptions,
    /// A recorded sequence (.json); by default thirty scripted seconds
    #[arg(long, value_name = "FILE")]
    sequence: Option<PathBuf>,
    /// Seed of the scripted sequence
    #[arg(long, default_value_t = 1)]
    script_seed: u64,
    /// Write the sequence to this file too
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Frames per second that are aimed at
    #[arg(long, default_value_t = 10.0)]
    target_fps: f64,
    /// How the step is chosen
    #[arg(long, value_parser = ways(), default_value = Way::Parts.key())]
    mode: Way,
    /// Let our ways leave out rays where steps of two voxels are not enough
    #[arg(long)]
    fewer_rays: bool,
    /// Tell the time by counted work instead of the wall: repeatable to the last bit
    #[arg(long)]
    work_clock: bool,
    /// Width in pixels
    #[arg(long, default_value_t = 512)]
    width: u32,
    /// Height in pixels
    #[arg(long, default_value_t = 512)]
    height: u32,
    /// Write every so many frames as a picture
    #[arg(long, value_name = "FRAMES", value_parser = clap::value_parser!(u32).range(1..))]
    save_every: Option<u32>,
    /// Folder for VOLUME-timeline.html and frames
    #[arg(short, long, default_value = ".")]
    output: PathBuf,
    #[command(flatten)]
    run: RunOptions,
}

/// The ways by their names.
fn ways() -> impl TypedValueParser<Value = Way> {
    let values = Way::ALL.map(|way| PossibleValue::new(way.key()).help(way.what()));
    PossibleValuesParser::new(values).map(|key| {
        let named = Way::ALL.into_iter().find(|way| way.key() == key);
        named.expect("a value that is possible")
    })
}

/// Plays and leaves a timeline; after an interruption, that of the frames so far.
pub(crate) fn run(args: &PlayArgs) -> Result<(), Failure> {
    let cancel = cancel_on_interrupt()?;
    if !(args.target_fps > 0.0 && args.target_fps.is_finite()) {
        return Err(anyhow::anyhow!("--target-fps {}: it must be above 0", args.target_fps).into());
    }
    args.run.install(|| {
        let stage = args.volume.prepare()?;
        let sequence = match &args.sequence {
            Some(path) => Sequence::read(path)?,
            None => {
                let views = views(&args.volume, &stage)?;
                let name = &args.volume.volume;
                thirty_seconds(name, &stage.volume, &views, Start::Sparse, args.script_seed)
            }
        };
        if let Some(path) = &args.record {
            sequence.write(path)?;
        }
        let folder = output::folder(&args.output)?;
        let caster = Raycaster::new(&stage.volume)?;
        let estimator = Estimator::new(&stage.volume);
        let size = [args.width, args.height];
        let mut own = Stage::new(&stage.volume, &caster, &estimator, size);
        if args.fewer_rays {
            own.resolution = Resolution::Ladder;
        }
        let clock = if args.work_clock {
            Clock::Work {
                noise: 0.0,
                seed: 1,
            }
        } else {
            Clock::Wall
        };
        let target = 1.0 / args.target_fps;
        let name = args.volume.stem();
        let bar = output::bar((sequence.duration_s * 1e3) as usize, "");
        let (mut frame, mut fault) = (0_u32, None);
        let run = play(&own, &sequence, args.mode, target, clock, |row, image| {
            bar.set_position((row.time * 1e3) as u64);
            bar.set_message(live(row, target));
            if args
                .save_every
                .is_some_and(|every| frame.is_multiple_of(every))
            {
                let path = folder.join(format!("{name}-{frame:05}.png"));
                fault = write_picture(image, &path).err();
            }
            frame += 1;
            fault.is_none() && !cancel.is_cancelled()
        })?;
        bar.finish_and_clear();
        if let Some(fault) = fault {
            return Err(fault);
        }
        let sentence = sentence(&run);
        output::line(&sentence)?;
        let page = folder.join(format!("{name}-timeline.html"));
        let header = TimelineHeader {
            title: format!("{name}: {} frames per second aimed at", args.target_fps),
            sentences: vec![sentence],
            settings: [
                ("way", run.way.name().to_owned()),
                (
                    "clock",
                    if args.work_clock { "work" } else { "wall" }.to_owned(),
                ),
                (
                    "picture",
                    format!("{} × {} pixels", args.width, args.height),
                ),
                ("instruction set", args.run.isa().name().to_owned()),
                ("threads", rayon::current_num_threads().to_string()),
            ]
            .map(|(name, value)| (name.to_owned(), value))
            .to_vec(),
            ..TimelineHeader::default()
        };
        let timeline = Timeline {
            title: "Frame by frame".into(),
            runs: vec![&run],
            pictures: Vec::new(),
            caption: String::new(),
        };
        std::fs::write(&page, timeline_page(&header, &[timeline]))?;
        output::line(page.display())?;
        if cancel.is_cancelled() {
            return Err(Failure::Interrupted);
        }
        Ok(())
    })
}

/// What the user sees of a frame while it plays.
fn live(row: &FrameRow, target: f64) -> String {
    format!(
        "{:5.1} s, {:6.1} ms of {:.1}, step {:.2}{}",
        row.time,
        1e3 * row.frame_time,
        1e3 * target,
        row.step,
        if row.frame_time > target {
            " (late)"
        } else {
            ""
        },
    )
}

/// What became of it all.
fn sentence(run: &Run) -> String {
    let s = Summary::of([run].into_iter());
    format!(
        "{} frames, {}: mean step {:.2}, {:.1} % late, slowest {:.2} of the target, 95th percentile {:.2}, predictions off by {:.1} %",
        s.frames,
        run.way.name(),
        s.mean_step,
        100.0 * s.slow,
        1.0 + s.error_up,
        s.percentiles[1],
        100.0 * s.prediction,
    )
}
