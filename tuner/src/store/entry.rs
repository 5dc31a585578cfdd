//! A record as it is known: its stamp, its time, what it says, and the bytes it came from.
//!
//! Payload: one line of JSON, an object with the fields `writer`, `sequence` and `time` beside
//! those of its body. Invariants: what [`Entry::new`] accepts is read back equal; the bytes of a
//! record that was read are kept, so that copying it changes nothing, known or not.

use super::body::{Body, Fields, Json};
use super::frame::{Frame, MAX_PAYLOAD_BYTES};
use super::{Stamp, StoreError};

const WRITER: &str = "writer";
const SEQUENCE: &str = "sequence";
const TIME: &str = "time";

const SPACE: u32 = 1;
const MACHINE: u32 = 2;
const SCENE: u32 = 3;
const STATE: u32 = 4;
const TRIAL_OPEN: u32 = 5;
const OUTCOME: u32 = 6;
const NOTE: u32 = 7;
const ALIAS: u32 = 8;

/// Name of a kind of record; `None` if this version does not know it.
pub fn kind_name(kind: u32) -> Option<&'static str> {
    Some(match kind {
        SPACE => "space",
        MACHINE => "machine",
        SCENE => "scene",
        STATE => "state",
        TRIAL_OPEN => "trial-open",
        OUTCOME => "outcome",
        NOTE => "note",
        ALIAS => "alias",
        _ => return None,
    })
}

/// A stored record.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    stamp: Stamp,
    time: f64,
    body: Body,
    frame: Frame,
}

impl Entry {
    /// The record of `body`, written at `time`.
    pub(crate) fn new(stamp: Stamp, time: f64, body: Body) -> Result<Entry, StoreError> {
        if !time.is_finite() {
            let name = TIME.to_owned();
            return Err(StoreError::NotFinite { name, value: time });
        }
        body.check()?;
        let (kind, mut fields) = encode(&body).ok_or(StoreError::NotRepresentable)?;
        fields.insert(WRITER.to_owned(), stamp.writer.as_str().into());
        fields.insert(SEQUENCE.to_owned(), stamp.sequence.into());
        fields.insert(TIME.to_owned(), time.into());
        let mut payload =
            serde_json::to_vec(&Json::Object(fields)).map_err(|_| StoreError::NotRepresentable)?;
        payload.push(b'\n');
        if payload.len() > MAX_PAYLOAD_BYTES {
            return Err(StoreError::TooLong {
                bytes: payload.len(),
                max: MAX_PAYLOAD_BYTES,
            });
        }
        let frame = Frame { kind, payload };
        match Entry::read(frame) {
            Ok(read) if read.stamp == stamp && read.time == time && read.body == body => Ok(read),
            _ => Err(StoreError::NotRepresentable),
        }
    }

    /// Understands a record, or gives it back if it does not say who wrote it.
    pub(crate) fn read(frame: Frame) -> Result<Entry, Frame> {
        match decode(&frame) {
            Some((stamp, time, body)) => Ok(Entry {
                stamp,
                time,
                body,
                frame,
            }),
            None => Err(frame),
        }
    }

    /// Who wrote it, and the how-manieth it was.
    pub fn stamp(&self) -> &Stamp {
        &self.stamp
    }

    /// When it was written, as told: seconds since 1970-01-01 00:00 UTC.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// What it says.
    pub fn body(&self) -> &Body {
        &self.body
    }

    /// Number of its kind in the file.
    pub fn kind(&self) -> u32 {
        self.frame.kind
    }

    /// Its JSON text as stored, without the line feed.
    pub fn json(&self) -> &str {
        let text = std::str::from_utf8(&self.frame.payload).unwrap_or_default();
        text.trim_end()
    }

    pub(crate) fn frame(&self) -> &Frame {
        &self.frame
    }
}

fn encode(body: &Body) -> Option<(u32, Fields)> {
    let (kind, json) = match body {
        Body::Space(body) => (SPACE, serde_json::to_value(body)),
        Body::Machine(body) => (MACHINE, serde_json::to_value(body)),
        Body::Scene(body) => (SCENE, serde_json::to_value(body)),
        Body::State(body) => (STATE, serde_json::to_value(body)),
        Body::TrialOpen(body) => (TRIAL_OPEN, serde_json::to_value(body)),
        Body::Outcome(body) => (OUTCOME, serde_json::to_value(body)),
        Body::Note(body) => (NOTE, serde_json::to_value(body)),
        Body::Alias(body) => (ALIAS, serde_json::to_value(body)),
        Body::Other { kind, fields } => (*kind, Ok(Json::Object(fields.clone()))),
    };
    match json.ok()? {
        Json::Object(fields) => Some((kind, fields)),
        _ => None,
    }
}

fn decode(frame: &Frame) -> Option<(Stamp, f64, Body)> {
    let mut fields: Fields = serde_json::from_slice(&frame.payload).ok()?;
    let stamp = Stamp {
        writer: serde_json::from_value(fields.remove(WRITER)?).ok()?,
        sequence: fields.remove(SEQUENCE)?.as_u64()?,
    };
    let time = fields.remove(TIME)?.as_f64()?;
    let json = Json::Object(fields.clone());
    let known = match frame.kind {
        SPACE => serde_json::from_value(json).ok().map(Body::Space),
        MACHINE => serde_json::from_value(json).ok().map(Body::Machine),
        SCENE => serde_json::from_value(json).ok().map(Body::Scene),
        STATE => serde_json::from_value(json).ok().map(Body::State),
        TRIAL_OPEN => serde_json::from_value(json).ok().map(Body::TrialOpen),
        OUTCOME => serde_json::from_value(json).ok().map(Body::Outcome),
        NOTE => serde_json::from_value(json).ok().map(Body::Note),
        ALIAS => serde_json::from_value(json).ok().map(Body::Alias),
        _ => None,
    };
    let kind = frame.kind;
    Some((stamp, time, known.unwrap_or(Body::Other { kind, fields })))
}
