//! Samplers of Python libraries, behind a script that is asked and told in lines of JSON.
//!
//! The script is `peers.py`; what the lines mean is said there. It sees the space itself, not a cube: ordinals,
//! scales, and which parameter has a meaning when. A search has no way to say that it failed: the first failure
//! is kept here, and the search proposes the middle of the cube from then on.

use std::{
    env,
    ffi::OsStr,
    io::{BufRead, BufReader, Write},
    process::{Child, ChildStdin, ChildStdout, Command, Stdio},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use raywright_tuner::{Config, Estimate, Kind, Param, Proposal, Scale, Search, Space, Value};
use serde_json::{Map, Value as Json, json};

const SCRIPT: &str = include_str!("../peers.py");
/// Names another Python than [`PROGRAM`].
const VARIABLE: &str = "RAYWRIGHT_PEERS_PYTHON";
const PROGRAM: &str = "python3";

/// A running script.
#[derive(Debug)]
struct Process {
    child: Child,
    requests: Option<ChildStdin>,
    answers: BufReader<ChildStdout>,
    failure: Option<String>,
}

impl Process {
    fn start(program: &OsStr) -> Result<Process, String> {
        let mut child = Command::new(program)
            .args(["-c", SCRIPT])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            // Warnings of libraries; errors are answers.
            .stderr(Stdio::null())
            .spawn()
            .map_err(|error| format!("{}: {error}", program.display()))?;
        let answers = child.stdout.take().ok_or("no pipe")?;
        Ok(Process {
            requests: child.stdin.take(),
            answers: BufReader::new(answers),
            child,
            failure: None,
        })
    }

    fn request(&mut self, request: &Json) -> Result<Json, String> {
        let requests = self.requests.as_mut().ok_or("no pipe")?;
        let mut line = String::new();
        writeln!(requests, "{request}")
            .and_then(|()| requests.flush())
            .and_then(|()| self.answers.read_line(&mut line))
            .map_err(|error| error.to_string())?;
        if line.is_empty() {
            return Err("the script has ended".into());
        }
        let answer: Json = serde_json::from_str(&line).map_err(|error| error.to_string())?;
        match answer.get("error").and_then(Json::as_str) {
            Some(error) => Err(error.to_owned()),
            None => Ok(answer),
        }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // The script ends with its input.
        self.requests = None;
        let _ = self.child.wait();
    }
}

/// Python with some of the samplers.
#[derive(Debug)]
pub(super) struct Python {
    names: Vec<String>,
    process: Arc<Mutex<Process>>,
}

impl Python {
    /// The Python that [`VARIABLE`] names or else the first of the path, if it has a sampler.
    pub(super) fn open() -> Result<Python, String> {
        let program = env::var_os(VARIABLE).unwrap_or_else(|| PROGRAM.into());
        let output = Command::new(&program)
            .args(["-c", SCRIPT, "--check"])
            .output()
            .map_err(|error| format!("{}: {error}", program.display()))?;
        let text = String::from_utf8_lossy(&output.stdout);
        let names: Vec<String> = text.lines().map(str::to_owned).collect();
        if names.is_empty() {
            return Err(format!(
                "{} has none of them; {VARIABLE} names another",
                program.display()
            ));
        }
        let process = Arc::new(Mutex::new(Process::start(&program)?));
        Ok(Python { names, process })
    }

    pub(super) fn has(&self, name: &str) -> bool {
        self.names.iter().any(|own| own == name)
    }

    /// A search of a space of which one runs at a time: its beginning is the end of the one before.
    pub(super) fn sampler(&self, name: &'static str, space: &Space, frames: usize) -> Sampler {
        Sampler {
            name,
            space: space.clone(),
            frames,
            process: Arc::clone(&self.process),
        }
    }

    /// The first failure since that was asked last.
    pub(super) fn failure(&self) -> Option<String> {
        lock(&self.process).failure.take()
    }
}

fn lock(process: &Mutex<Process>) -> MutexGuard<'_, Process> {
    process.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A sampler as a search.
#[derive(Debug)]
pub(super) struct Sampler {
    name: &'static str,
    space: Space,
    frames: usize,
    process: Arc<Mutex<Process>>,
}

impl Sampler {
    fn request(&self, request: &Json) -> Option<Json> {
        let mut process = lock(&self.process);
        if process.failure.is_some() {
            return None;
        }
        match process.request(request) {
            Ok(answer) => Some(answer),
            Err(failure) => {
                process.failure = Some(failure);
                None
            }
        }
    }

    /// The configuration of an answer.
    fn config(&self, answer: &Json) -> Option<Config> {
        let values = answer.get("config")?.as_object()?;
        let values: Option<Vec<(&str, Value)>> = values
            .iter()
            .map(|(name, value)| {
                let param = self
                    .space
                    .params()
                    .iter()
                    .find(|param| param.name == *name)?;
                let value = match param.kind {
                    Kind::Bool => Value::Bool(value.as_bool()?),
                    Kind::Integer { .. } | Kind::Ordinal(_) => Value::Integer(value.as_i64()?),
                    Kind::Real { .. } => Value::Real(value.as_f64()?),
                };
                Some((name.as_str(), value))
            })
            .collect();
        self.space.config(&values?).ok()
    }
}

impl Search for Sampler {
    fn name(&self) -> &'static str {
        self.name
    }

    fn begin(&mut self, _steps: &[f64], seed: u64) {
        let params: Vec<Json> = self.space.params().iter().map(described).collect();
        // Python's libraries take seeds of 32 bits.
        let begin = json!({
            "sampler": self.name, "seed": seed as u32, "frames": self.frames, "space": params,
        });
        self.request(&json!({"begin": begin}));
    }

    fn propose(&mut self, _ticket: u64) -> Proposal {
        let answer = self.request(&json!({"ask": true}));
        let config = answer.as_ref().and_then(|answer| self.config(answer));
        if let (Some(answer), None) = (&answer, &config) {
            lock(&self.process).failure = Some(format!("no configuration: {answer}"));
        }
        let point = config.map(|config| self.space.encode(&config));
        Proposal {
            point: point.unwrap_or_else(|| vec![0.5; self.space.dimensions()]),
            samples: 1,
            step: "ask",
        }
    }

    fn observe(&mut self, _ticket: Option<u64>, point: &[f64], estimate: Estimate) {
        let config = active(&self.space, &self.space.decode(point));
        let cost = Some(estimate.mean).filter(|cost| cost.is_finite());
        self.request(&json!({"tell": {"config": config, "cost": cost}}));
    }

    fn withdraw(&mut self, _ticket: u64) {}
}

/// A parameter as the script wants it.
fn described(param: &Param) -> Json {
    let mut own = match &param.kind {
        Kind::Bool => json!({"kind": "ordinal", "values": [false, true]}),
        Kind::Ordinal(values) => json!({"kind": "ordinal", "values": values}),
        Kind::Integer { min, max, scale } => {
            json!({"kind": "integer", "low": min, "high": max, "log": *scale == Scale::Log})
        }
        Kind::Real { min, max, scale } => {
            json!({"kind": "real", "low": min, "high": max, "log": *scale == Scale::Log})
        }
    };
    own["name"] = json!(param.name);
    if let Some(condition) = &param.active_if {
        let values: Vec<Json> = condition
            .values
            .iter()
            .map(|&value| number(value))
            .collect();
        own["when"] = json!({"name": condition.param, "values": values});
    }
    own
}

/// The values that have a meaning in a configuration.
fn active(space: &Space, config: &Config) -> Map<String, Json> {
    let mut values = Map::new();
    for (param, (name, value)) in space.params().iter().zip(config.iter()) {
        let is_active = param.active_if.as_ref().is_none_or(|condition| {
            values.contains_key(&condition.param)
                && config
                    .get(&condition.param)
                    .is_some_and(|value| condition.values.contains(&value))
        });
        if is_active {
            values.insert(name.to_owned(), number(value));
        }
    }
    values
}

fn number(value: Value) -> Json {
    match value {
        Value::Bool(value) => json!(value),
        Value::Integer(value) => json!(value),
        Value::Real(value) => json!(value),
    }
}
