//! VTK's CPU mapper in a process of its own, through a small Python program.

use std::{
    io::{BufRead, BufReader, Write},
    path::PathBuf,
    process::{Child, ChildStdin, ChildStdout, Command, Stdio},
    time::Duration,
};

use raywright_tracer::imaging::Camera;
use raywright_volume::{TransferFunction, Volume, VoxelSlice};
use serde::Deserialize;
use serde_json::{Value, json};

/// A program that renders frames with VTK.
pub(crate) struct Vtk {
    child: Child,
    orders: ChildStdin,
    answers: BufReader<ChildStdout>,
    folder: PathBuf,
    /// Its version.
    pub(crate) version: String,
}

/// A frame of VTK.
pub(crate) struct Frame {
    /// Processor times.
    pub(crate) cpu: Vec<Duration>,
    /// RGB, row by row from the top.
    pub(crate) pixels: Vec<u8>,
}

#[derive(Deserialize)]
struct Times {
    cpu: Vec<f64>,
}

impl Vtk {
    /// Starts it.
    ///
    /// # Errors
    /// Why it is not there.
    pub(crate) fn start() -> Result<Self, String> {
        let program = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/raycast/vtk_frames.py");
        let mut child = Command::new("python3")
            .arg(program)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .map_err(|error| format!("python3: {error}"))?;
        let (Some(orders), Some(answers)) = (child.stdin.take(), child.stdout.take()) else {
            return Err("no pipes to python3".into());
        };
        let folder = std::env::temp_dir().join(format!("raywright-raycast-{}", child.id()));
        std::fs::create_dir_all(&folder).map_err(|error| error.to_string())?;
        let mut vtk = Self {
            child,
            orders,
            answers: BufReader::new(answers),
            folder,
            version: String::new(),
        };
        let hello = vtk.answer()?;
        match hello["version"].as_str() {
            Some(version) => vtk.version = version.into(),
            None => return Err(format!("{}", hello["error"])),
        }
        Ok(vtk)
    }

    /// Gives it a volume, with values in the type of the file where they are integers.
    pub(crate) fn load(&mut self, volume: &Volume) -> Result<(), String> {
        let file = self.folder.join("voxels.raw");
        let (kind, bytes) = values_of(volume);
        std::fs::write(&file, bytes).map_err(|error| error.to_string())?;
        self.ask(&json!({"volume": {
            "file": file, "type": kind, "dims": volume.dims(), "spacing": volume.spacing(),
        }}))
        .map(|_| ())
    }

    /// Renders a frame, once untimed and `rounds` times.
    pub(crate) fn frame(
        &mut self,
        function: &TransferFunction,
        camera: &Camera,
        size: [u32; 2],
        step: f32,
        threads: usize,
        rounds: usize,
    ) -> Result<Frame, String> {
        let picture = self.folder.join("picture.raw");
        let points: Vec<[f32; 5]> = function.points().iter().map(|&p| p.into()).collect();
        let answer = self.ask(&json!({"frame": {
            "points": points, "threads": threads, "step": step, "size": size, "rounds": rounds,
            "position": camera.origin.to_array(), "focal": camera.target.to_array(),
            "up": camera.up.to_array(), "fov": camera.vertical_fov_degrees, "picture": picture,
        }}))?;
        let times: Times = serde_json::from_value(answer).map_err(|error| error.to_string())?;
        Ok(Frame {
            cpu: times.cpu.into_iter().map(Duration::from_secs_f64).collect(),
            pixels: std::fs::read(&picture).map_err(|error| error.to_string())?,
        })
    }

    fn ask(&mut self, order: &Value) -> Result<Value, String> {
        writeln!(self.orders, "{order}").map_err(|error| error.to_string())?;
        self.answer()
    }

    fn answer(&mut self) -> Result<Value, String> {
        let mut line = String::new();
        let read = self
            .answers
            .read_line(&mut line)
            .map_err(|error| error.to_string())?;
        if read == 0 {
            return Err("it ended without an answer".into());
        }
        serde_json::from_str(&line).map_err(|error| format!("{error}: {line}"))
    }
}

impl Drop for Vtk {
    fn drop(&mut self) {
        // A program that is still busy has nothing more to say.
        let _ = self.child.kill();
        let _ = self.child.wait();
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

/// The values of a volume as bytes, and their type in the words of numpy.
fn values_of(volume: &Volume) -> (&'static str, Vec<u8>) {
    let values = |volume: &Volume| -> Vec<f32> {
        let voxels = volume.voxels();
        (0..voxels.len())
            .map(|i| volume.value_of(voxels.get(i)))
            .collect()
    };
    let [low, high] = volume.range();
    match volume.voxels() {
        VoxelSlice::F32(_) => (
            "<f4",
            values(volume)
                .iter()
                .flat_map(|v| v.to_le_bytes())
                .collect(),
        ),
        _ if low >= 0.0 && high <= 255.0 => {
            ("u1", values(volume).iter().map(|&v| v as u8).collect())
        }
        _ if low >= 0.0 => (
            "<u2",
            values(volume)
                .iter()
                .flat_map(|&v| (v as u16).to_le_bytes())
                .collect(),
        ),
        _ if low >= -128.0 && high <= 127.0 => (
            "i1",
            values(volume).iter().map(|&v| v as i8 as u8).collect(),
        ),
        _ => (
            "<i2",
            values(volume)
                .iter()
                .flat_map(|&v| (v as i16).to_le_bytes())
                .collect(),
        ),
    }
}
