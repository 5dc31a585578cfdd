//! Our own recordings: every `SCENE.csv` and `SCENE.csv.gz` of a folder, as `raywright study record` writes
//! them.
//!
//! The reference of a row is the strong default; costs are divided by that of the weak one, so that they mean
//! what they mean in the shared tables. A frame that was given up costs what it took until then. Where cameras
//! stand is read from the file of cameras from which they were recorded, if it is found.
//! Invariants: frames of a scene were made in one way; no configuration is there twice.

use std::{
    collections::{BTreeMap, BTreeSet, HashMap, HashSet},
    error::Error,
    fs::{self, File},
    io::Read,
    path::{Path, PathBuf},
};

use flate2::read::MultiGzDecoder;
use raywright::tune::{ParameterSpace, SLOWEST_TRIAL, SpaceAxes};
use raywright_bvh::{BuildParams, PARAMETERS, Parameter, Quality};

use super::{DataSet, FRAME_PIXELS, PORTFOLIO, Problem, Row, State, WEAK};
use crate::scenes::{SceneCameras, cameras_file, scenes_folder};

/// What the recorder calls the weak default, and known-good configurations.
const WEAK_SOURCE: &str = "table-1-default";
const PORTFOLIO_SOURCE: &str = "portfolio";

/// Parameters that are younger than the recordings: all were made with their defaults.
const YOUNGER: [&str; 3] = ["collapse", "rays_in_flight", "ray_packets"];

/// A line of a recording.
#[derive(Clone, Debug)]
struct Line {
    scene: String,
    row: usize,
    run: String,
    source: String,
    params: BuildParams,
    /// `None`: the build was refused.
    times: Option<Times>,
}

/// Milliseconds.
#[derive(Clone, Debug)]
struct Times {
    camera: String,
    /// `None`: given up.
    render: Option<f64>,
    reference: f64,
    build: f64,
    reference_build: f64,
}

/// The recordings of a folder as one data set; `None` if it has none.
pub(super) fn read(folder: &Path) -> Result<Option<DataSet>, Box<dyn Error>> {
    let mut lines = Vec::new();
    for path in files(folder)? {
        let read = table(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        lines.extend(read);
    }
    if lines.is_empty() {
        return Ok(None);
    }
    let described = [folder, &scenes_folder()]
        .iter()
        .find_map(|folder| cameras_file(folder))
        .unwrap_or_default();
    data_set(&lines, &described).map(Some)
}

/// Files that are tables by their names, in the order of these.
fn files(folder: &Path) -> Result<Vec<PathBuf>, Box<dyn Error>> {
    if !folder.is_dir() {
        return Ok(Vec::new());
    }
    let mut files = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if name.ends_with(".csv") || name.ends_with(".csv.gz") {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

fn table(path: &Path) -> Result<Vec<Line>, Box<dyn Error>> {
    let file = File::open(path)?;
    let is_packed = path.extension().is_some_and(|ending| ending == "gz");
    let text: Box<dyn Read> = match is_packed {
        true => Box::new(MultiGzDecoder::new(file)),
        false => Box::new(file),
    };
    let mut reader = csv::Reader::from_reader(text);
    let mut lines = Vec::new();
    for cells in reader.deserialize() {
        let cells: HashMap<String, String> = cells?;
        let number = lines.len() + 2;
        lines.push(line(&cells).map_err(|error| format!("line {number}: {error}"))?);
    }
    Ok(lines)
}

fn line(cells: &HashMap<String, String>) -> Result<Line, Box<dyn Error>> {
    let text = |name: &str| {
        let cell = cells.get(name).map(String::as_str);
        cell.ok_or_else(|| format!("no column {name}"))
    };
    let number = |name: &str| -> Result<f64, Box<dyn Error>> {
        let number: f64 = text(name)?
            .parse()
            .map_err(|_| format!("{name}: no number"))?;
        match number.is_finite() && number > 0.0 {
            true => Ok(number),
            false => Err(format!("{name}: {number} is no time").into()),
        }
    };
    let mut params = BuildParams::default();
    let recorded = |parameter: &&Parameter| !YOUNGER.contains(&parameter.name);
    for parameter in PARAMETERS.iter().filter(recorded) {
        params.set(parameter.name, text(parameter.name)?)?;
    }
    let times = match text("fail")? {
        "0" => Some(Times {
            camera: text("cam")?.to_owned(),
            render: match text("render_ms")? {
                "" => None,
                _ => Some(number("render_ms")?),
            },
            reference: number("ref_ms")?,
            build: number("build_ms")?,
            reference_build: number("ref_build_ms")?,
        }),
        _ => None,
    };
    Ok(Line {
        scene: text("scene")?.to_owned(),
        row: text("row")?.parse().map_err(|_| "row: no number")?,
        run: text("run")?.to_owned(),
        source: text("source")?.to_owned(),
        params,
        times,
    })
}

fn data_set(
    lines: &[Line],
    described: &HashMap<String, SceneCameras>,
) -> Result<DataSet, Box<dyn Error>> {
    let space = |axes| ParameterSpace::new(&BuildParams::default(), &YOUNGER, axes);
    let spaces = [space(SpaceAxes::Printed)?, space(SpaceAxes::Canonical)?];
    let mut scenes: BTreeMap<&str, Vec<&Line>> = BTreeMap::new();
    for line in lines {
        scenes.entry(&line.scene).or_default().push(line);
    }
    let mut problems = BTreeMap::new();
    for (scene, lines) in scenes {
        for problem in scene_problems(scene, &lines, &spaces, described.get(scene))? {
            problems.insert(problem.name.clone(), problem);
        }
    }
    Ok(DataSet {
        name: "own recordings".into(),
        spaces: spaces.map(|space| space.space().clone()),
        problems: problems.into_values().collect(),
    })
}

/// A problem for each camera of a scene.
fn scene_problems(
    scene: &str,
    lines: &[&Line],
    spaces: &[ParameterSpace; 2],
    described: Option<&SceneCameras>,
) -> Result<Vec<Problem>, Box<dyn Error>> {
    let run = &lines[0].run;
    if lines.iter().any(|line| line.run != *run) {
        return Err(format!("{scene} was recorded in two ways").into());
    }
    let frames = FRAME_PIXELS / pixels(run).ok_or_else(|| format!("{scene}: run {run}"))?;
    let strong = BuildParams::default();
    let mut splits = strong;
    splits.quality = Quality::SpatialSplits;
    let mut morton = strong;
    morton.quality = Quality::Morton;
    let name = |line: &Line| match line.source.as_str() {
        WEAK_SOURCE => WEAK,
        PORTFOLIO_SOURCE => {
            let mut named = PORTFOLIO.iter().zip([strong, splits, morton]);
            let own = named.find(|(_, params)| *params == line.params);
            own.map_or("", |(name, _)| name)
        }
        _ => "",
    };
    let times = lines.iter().filter_map(|line| line.times.as_ref());
    let cameras: BTreeSet<&str> = times.map(|times| times.camera.as_str()).collect();
    let mut problems = Vec::new();
    for camera in cameras {
        let is_own = |line: &&Line| {
            let times = line.times.as_ref();
            times.is_none_or(|times| times.camera == camera)
        };
        let own: Vec<&Line> = lines.iter().copied().filter(is_own).collect();
        let mut seen = HashSet::new();
        if !own.iter().all(|line| seen.insert(line.row)) {
            return Err(format!("{scene} {camera}: a row that is there twice").into());
        }
        let times = || own.iter().filter_map(|line| line.times.as_ref());
        let frame = frames * median(times().map(|times| times.reference));
        let build = median(times().map(|times| times.reference_build));
        let costs = |times: &Times| {
            let render = times
                .render
                .map_or(f64::from(SLOWEST_TRIAL), |render| render / times.reference);
            [render, (frame * render + times.build) / (frame + build)]
        };
        let weak = own.iter().find(|line| line.source == WEAK_SOURCE);
        let weak = weak.and_then(|line| Some(costs(line.times.as_ref()?)));
        let weak = weak.ok_or_else(|| format!("{scene} {camera}: no weak default"))?;
        let row = |line: &&Line| -> Result<Row, Box<dyn Error>> {
            let costs = line.times.as_ref().map(costs);
            Ok(Row {
                name: name(line).to_owned(),
                configs: [
                    spaces[0].config(&line.params)?,
                    spaces[1].config(&line.params)?,
                ],
                costs: costs.map(|costs| [costs[0] / weak[0], costs[1] / weak[1]]),
                build: line.times.as_ref().map_or(0.0, |t| t.build) / (frame + build) / weak[1],
            })
        };
        let seconds = [frame * weak[0] / 1e3, (frame + build) * weak[1] / 1e3];
        problems.push(Problem {
            name: format!("{scene} {camera}"),
            state: described.and_then(|scenes| state(scene, camera, scenes, seconds)),
            rows: own.iter().map(row).collect::<Result<_, _>>()?,
        });
    }
    Ok(problems)
}

/// Pixels of a frame, of which a run tells first: `320x180 path …`.
fn pixels(run: &str) -> Option<f64> {
    let (width, height) = run.split(' ').next()?.split_once('x')?;
    let pixels = width.parse::<u32>().ok()? as f64 * height.parse::<u32>().ok()? as f64;
    Some(pixels).filter(|&pixels| pixels > 0.0)
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn state(scene: &str, camera: &str, described: &SceneCameras, seconds: [f64; 2]) -> Option<State> {
    let own = described
        .cameras
        .iter()
        .find(|own| own.name.as_deref() == Some(camera))?;
    let (min, max) = (described.bounds_min?, described.bounds_max?);
    let squares = min.iter().zip(max).map(|(min, max)| (max - min).powi(2));
    let mut features = vec![described.triangles?, squares.sum::<f64>().sqrt()];
    features.extend(own.eye.iter().chain(&own.target).map(|&x| f64::from(x)));
    features.push(f64::from(own.fov_y_deg));
    Some(State {
        scene: scene.to_owned(),
        features,
        seconds,
    })
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use flate2::{Compression, write::GzEncoder};
    use raywright::tune::described;

    use super::*;
    use crate::recordings::{Metric, SpaceKind, data_sets};

    /// Number, source, parameters, and for each camera render and reference; none: the build was refused.
    type TestRow<'a> = (usize, &'a str, BuildParams, Option<[(f64, f64); 2]>);

    /// A table of such rows as the recorder writes it. All builds take 2 ms, the reference 1 ms.
    fn text(rows: &[TestRow<'_>]) -> String {
        let default = described(&BuildParams::default());
        let names: Vec<&str> = default.iter().map(|(name, _)| name.as_str()).collect();
        let names = names.join(",");
        let behind = "nodes,leaves,refs,bytes,depth,sah_nodes,sah_blocks";
        let mut text = format!(
            "scene,row,run,source,{names},fail,cam,reps,render_ms,ref_ms,build_ms,ref_build_ms,{behind}\n"
        );
        for (row, source, params, frames) in rows {
            let own = described(params);
            let values: Vec<&str> = own.iter().map(|(_, value)| value.as_str()).collect();
            let before = format!("hut,{row},640x480 path 3,{source},{}", values.join(","));
            match frames {
                None => text += &format!("{before},1,,,,,,1.0,,,,,,,\n"),
                Some(frames) => {
                    for (camera, (render, reference)) in ["door", "roof"].iter().zip(frames) {
                        let render = match render.is_finite() {
                            true => render.to_string(),
                            false => String::new(),
                        };
                        text += &format!(
                            "{before},0,{camera},3,{render},{reference},2.0,1.0,9,9,9,9,3,1.5,0.5\n"
                        );
                    }
                }
            }
        }
        text
    }

    fn table_text() -> String {
        let default = BuildParams::default();
        let mut shallow = default;
        shallow.max_depth = 9;
        text(&[
            (
                0,
                WEAK_SOURCE,
                BuildParams::embree_api_default(),
                Some([(20.0, 10.0), (6.0, 4.0)]),
            ),
            (
                2,
                "portfolio",
                default,
                Some([(11.0, 11.0), (f64::INFINITY, 4.0)]),
            ),
            (5, "random", shallow, None),
        ])
    }

    const CAMERAS: &str = r#"{"scenes": {"hut": {"triangles": 7, "bounds_min": [0, 0, 0],
        "bounds_max": [2, 3, 6], "cameras": [{"name": "door", "eye": [1, 2, 3], "target": [4, 5, 6],
        "up": [0, 1, 0], "fov_y_deg": 50}]}}}"#;

    #[test]
    fn packed_and_plain_tables_are_read_alike() {
        let (plain, packed) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        fs::write(plain.path().join("hut.csv"), table_text()).unwrap();
        let file = File::create(packed.path().join("hut.csv.gz")).unwrap();
        let mut encoder = GzEncoder::new(file, Compression::fast());
        encoder.write_all(table_text().as_bytes()).unwrap();
        encoder.finish().unwrap();
        for folder in [&plain, &packed] {
            fs::write(folder.path().join("cameras.json"), CAMERAS).unwrap();
            let sets = data_sets(Some(folder.path())).unwrap();
            let [set] = &sets[..] else {
                panic!("{} sets", sets.len())
            };
            let [door, roof] = &set.problems[..] else {
                panic!("{set:?}")
            };
            assert_eq!(
                (door.name.as_str(), roof.name.as_str()),
                ("hut door", "hut roof")
            );
            assert_eq!(door.named(WEAK, Metric::Render), Some(1.0));
            assert_eq!(door.named(WEAK, Metric::Total), Some(1.0));
            assert_eq!(door.named("strong8", Metric::Render), Some(0.5));
            // One frame: (11 · 1 + 2) / (11 + 1) over (11 · 2 + 2) / (11 + 1); 11 is the later median.
            assert_eq!(door.named("strong8", Metric::Total), Some(13.0 / 24.0));
            // Given up after ten times the reference.
            assert_eq!(roof.named("strong8", Metric::Render), Some(10.0 / 1.5));
            assert_eq!(roof.rows.len(), 3);
            assert!(roof.rows[2].costs.is_none() && roof.rows[2].name.is_empty());
            for kind in [SpaceKind::Printed, SpaceKind::Canonical] {
                assert_eq!(door.rows[2].config(kind).integer("max_depth"), Some(9));
                assert_eq!(set.space(kind).check(door.rows[2].config(kind)), Ok(()));
            }
            let state = door.state.as_ref().unwrap();
            assert_eq!(
                state.features,
                [7.0, 7.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 50.0]
            );
            assert_eq!(state.seconds(Metric::Render), 0.022);
            assert!(roof.state.is_none());
        }
    }

    #[test]
    fn what_is_no_recording_is_refused_with_its_line() {
        let folder = tempfile::tempdir().unwrap();
        assert!(data_sets(Some(folder.path())).unwrap().is_empty());
        let whole = table_text();
        let twice = format!("{whole}{}", whole.split_once('\n').unwrap().1);
        let faults = [
            (
                whole.replace("20,10", "soon,10"),
                "line 2: render_ms: no number",
            ),
            (whole.replace("ref_ms", "ms"), "line 2: no column ref_ms"),
            (whole.replace("11,11", "11,-1"), "line 4: ref_ms"),
            (
                whole.replace(WEAK_SOURCE, "random"),
                "hut door: no weak default",
            ),
            (whole.replacen("640x480", "640x9", 1), "in two ways"),
            (whole.replace("640x480", "large"), "run large"),
            (twice, "twice"),
        ];
        for (text, expected) in faults {
            fs::write(folder.path().join("hut.csv"), text).unwrap();
            let error = data_sets(Some(folder.path())).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}, not {expected}");
        }
    }
}
