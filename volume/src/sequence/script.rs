//! The scripted sequence: thirty seconds in which everything happens that makes frame times jump.
//!
//! | part | seconds | what |
//! | --- | --- | --- |
//! | A | 0–6 | a whole orbit at constant distance, around a tilted axis |
//! | B | 6–10 | in to the close camera, and half of the way back |
//! | C | 10–16 | another orbit; the other transfer function at 11, back at 13, and three switches from 15 on, 0.2 s apart |
//! | D | 16–20 | nothing moves |
//! | E | 20–25 | a fast orbit, 180° a second, with a blend over 3 s to the other transfer function |
//! | F | 25–30 | straight through the volume; a switch in the middle of it, at 28 |
//!
//! The seed tilts the axes and chooses the senses of rotation.
//!
//! Invariant: the same arguments give the same sequence.

use glam::{DMat3, DVec3};
use raywright_imaging::Camera;

use super::{CameraKey, Event, EventKind, FORMAT, Sequence, TransferKey, camera::between};
use crate::{grid::Volume, steer::unit, transfer::TransferFunction, view::View};

/// The end, seconds.
const DURATION: f64 = 30.0;

/// Degrees between two keys of an orbit: so few that a great circle is nearly the small one.
const KEY_DEGREES: f64 = 15.0;

/// Largest tilt of an axis of rotation from the direction that is up, radians.
const MAX_TILT: f64 = 0.5;

/// How a volume is looked at in the script.
#[derive(Clone, Debug, PartialEq)]
pub struct Views {
    /// A transfer function that shows little.
    pub sparse: TransferFunction,
    /// One that shows much.
    pub dense: TransferFunction,
    /// A camera that shows all of the volume.
    pub overview: Camera,
    /// One near to it.
    pub close: Camera,
}

impl Views {
    /// Those of a view file, by the names `sparse`, `dense`, `overview` and `close`; `None` if one of
    /// them is not there.
    #[must_use]
    pub fn of(view: &View) -> Option<Self> {
        let function = |name: &str| view.transfer_functions.get(name).cloned();
        let camera = |name: &str| view.cameras.get(name).copied();
        Some(Self {
            sparse: function("sparse")?,
            dense: function("dense")?,
            overview: camera("overview")?,
            close: camera("close")?,
        })
    }
}

/// The transfer function a sequence begins with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// The sparse one.
    Sparse,
    /// The dense one.
    Dense,
}

/// The scripted sequence for a volume, 1024 × 1024 pixels, 30 frames a second.
#[must_use]
pub fn thirty_seconds(
    name: &str,
    volume: &Volume,
    views: &Views,
    start: Start,
    seed: u64,
) -> Sequence {
    let mut keys = Keys {
        keys: vec![CameraKey::new(0.0, &views.overview)],
        seed,
        draws: 0,
    };
    // A
    keys.orbit(6.0, 360.0);
    // B
    keys.go_to(8.5, &views.close);
    let back = between(&views.close, &views.overview, 0.5);
    keys.go_to(10.0, &back);
    // C, D
    keys.orbit(16.0, 240.0);
    keys.rest(20.0);
    // E
    keys.orbit(25.0, 900.0);
    // F
    keys.fly_through(30.0, volume);
    let (own, other) = match start {
        Start::Sparse => (&views.sparse, &views.dense),
        Start::Dense => (&views.dense, &views.sparse),
    };
    let key = |t: f64, points: &TransferFunction, blend_s: f64| TransferKey {
        t,
        points: points.clone(),
        blend_s,
    };
    Sequence {
        format: FORMAT.to_owned(),
        volume: name.to_owned(),
        duration_s: DURATION,
        fps: 30.0,
        viewport: [1024, 1024],
        camera: keys.keys,
        tf: vec![
            key(0.0, own, 0.0),
            key(11.0, other, 0.0),
            key(13.0, own, 0.0),
            key(15.0, other, 0.0),
            key(15.2, own, 0.0),
            key(15.4, other, 0.0),
            key(21.0, own, 3.0),
            key(28.0, other, 0.0),
        ],
        events: vec![Event {
            t: 16.0,
            kind: EventKind::Idle { duration_s: 4.0 },
        }],
        seed,
        note: format!(
            "A 0-6 orbit, B 6-10 zoom, C 10-16 orbit with switches, D 16-20 rest, E 20-25 fast orbit \
             with a blend, F 25-30 through the volume; begins {}",
            match start {
                Start::Sparse => "sparse",
                Start::Dense => "dense",
            }
        ),
    }
}

/// Keys of the camera, one part after the other.
struct Keys {
    keys: Vec<CameraKey>,
    seed: u64,
    draws: u64,
}

impl Keys {
    fn last(&self) -> &CameraKey {
        &self.keys[self.keys.len() - 1]
    }

    /// A number in 0..1.
    fn draw(&mut self) -> f64 {
        self.draws += 1;
        unit(self.seed, self.draws)
    }

    fn go_to(&mut self, t: f64, camera: &Camera) {
        self.keys.push(CameraKey::new(t, camera));
    }

    fn rest(&mut self, t: f64) {
        let last = *self.last();
        self.keys.push(CameraKey { t, ..last });
    }

    /// Turns the camera, its `up` too, around an axis through the point looked at.
    fn orbit(&mut self, end: f64, degrees: f64) {
        let start = *self.last();
        let camera = start.camera();
        let arm = (camera.origin - camera.target).as_dvec3();
        let up = camera.up.as_dvec3();
        // The part of `up` that is across the view; leaning over it would look from above.
        let view = arm.normalize();
        let across = (up - view * up.dot(view)).normalize();
        let tilt = (self.draw() * 2.0 - 1.0) * MAX_TILT;
        let axis = DMat3::from_axis_angle(view, tilt) * across;
        let sense = if self.draw() < 0.5 { -1.0 } else { 1.0 };
        let count = (degrees / KEY_DEGREES).ceil();
        for key in 1..=count as u32 {
            let share = f64::from(key) / count;
            let angle = (sense * degrees * share).to_radians();
            let turn = DMat3::from_axis_angle(axis, angle);
            let turned = Camera {
                origin: (camera.target.as_dvec3() + turn * arm).as_vec3(),
                up: (turn * up).as_vec3(),
                ..camera
            };
            self.go_to(start.t + (end - start.t) * share, &turned);
        }
    }

    /// Comes near within a quarter of the time, then straight through the middle of the volume and as
    /// far out on the other side. The point looked at keeps its distance ahead.
    fn fly_through(&mut self, end: f64, volume: &Volume) {
        let start = *self.last();
        let camera = start.camera();
        let centre = volume.extent().as_dvec3() * 0.5;
        let reach = volume.extent().as_dvec3().length() * 0.6;
        let reach = reach.max(f64::from(volume.unit_length()));
        let forward = (camera.target - camera.origin).as_dvec3().normalize();
        let at = |place: DVec3| Camera {
            origin: place.as_vec3(),
            target: (place + forward * reach).as_vec3(),
            ..camera
        };
        let begin = start.t + (end - start.t) * 0.25;
        self.go_to(begin, &at(centre - forward * reach));
        self.go_to(end, &at(centre + forward * reach));
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::{
        grid::{ValueScale, Voxels},
        transfer::ControlPoint,
        view::overview,
    };

    fn volume(dims: [usize; 3]) -> Volume {
        let voxels = Voxels::U8(vec![0; dims.iter().product()]);
        Volume::new(dims, [1.0, 1.0, 2.0], voxels, ValueScale::default()).unwrap()
    }

    fn views(volume: &Volume) -> Views {
        let function = |opacity| {
            let point = ControlPoint {
                value: 0.0,
                colour: [1.0; 3],
                opacity,
            };
            TransferFunction::new(vec![point]).unwrap()
        };
        let overview = overview(volume);
        let close = Camera {
            origin: overview.target + (overview.origin - overview.target) * 0.25,
            vertical_fov_degrees: 50.0,
            ..overview
        };
        Views {
            sparse: function(0.1),
            dense: function(0.9),
            overview,
            close,
        }
    }

    #[test]
    fn what_happens_when() {
        let volume = volume([40, 30, 20]);
        let views = views(&volume);
        for (start, seed) in [(Start::Sparse, 1), (Start::Dense, 2), (Start::Sparse, 99)] {
            let sequence = thirty_seconds("v.nrrd", &volume, &views, start, seed);
            sequence.check().unwrap();
            assert_eq!(
                sequence,
                thirty_seconds("v.nrrd", &volume, &views, start, seed)
            );
            assert_eq!(sequence.frames(), 900);
            let at = |time: f64| sequence.at(time).unwrap();
            let opacity = |time: f64| at(time).function.at(0.0)[3];
            let (own, other) = match start {
                Start::Sparse => (0.1, 0.9),
                Start::Dense => (0.9, 0.1),
            };
            for (time, expected) in [
                (0.0, own),
                (10.99, own),
                (11.0, other),
                (13.0, own),
                (15.1, other),
                (15.3, own),
                (19.0, other),
                (22.5, 0.5),
                (24.1, own),
                (29.0, other),
            ] {
                assert!(
                    (opacity(time) - expected).abs() < 1e-6,
                    "{time}: {}",
                    opacity(time)
                );
            }
            // A: at constant distance, all around, back where it began.
            let distance = |time: f64| {
                let camera = at(time).camera;
                (camera.origin - camera.target).length()
            };
            for step in 0..60 {
                let time = f64::from(step) * 0.1;
                assert!(
                    (distance(time) / distance(0.0) - 1.0).abs() < 1e-4,
                    "{time}"
                );
            }
            let moved = (at(6.0).camera.origin - at(0.0).camera.origin).length();
            assert!(moved < 1e-3 * distance(0.0), "{moved}");
            let side = (at(3.0).camera.origin - at(0.0).camera.origin).length();
            assert!(side > distance(0.0));
            // B
            assert_eq!(at(8.5).camera, views.close);
            assert!((distance(10.0) / distance(8.5) - 2.0).abs() < 1e-4);
            // D
            assert_eq!(at(16.0).camera, at(19.999).camera);
            assert!(at(16.0).idle && at(19.9).idle && !at(15.9).idle && !at(20.0).idle);
            // E: 180 degrees a second, in the plane across the axis.
            let start = at(20.0).camera;
            let half = at(21.0).camera;
            let opposite = (start.origin - start.target) + (half.origin - half.target);
            assert!(opposite.length() < 2.0 * 0.6 * distance(20.0));
            assert!(at(22.0).blending && !at(24.5).blending);
            // F: inside at the switch, and out again.
            let inside = |time: f64| {
                let place = at(time).camera.origin;
                place.cmpge(Vec3::ZERO).all() && place.cmple(volume.extent()).all()
            };
            assert!(inside(28.1) && !inside(25.5) && !inside(30.0));
        }
        let [a, b] = [1, 2].map(|seed| thirty_seconds("v", &volume, &views, Start::Sparse, seed));
        assert_ne!(a.camera, b.camera);
    }

    #[test]
    fn every_frame_of_any_volume_has_a_view() {
        for dims in [[1, 1, 1], [100, 2, 1], [3, 40, 50]] {
            let volume = volume(dims);
            for seed in 0..20 {
                let sequence = thirty_seconds("v", &volume, &views(&volume), Start::Sparse, seed);
                sequence.check().unwrap();
                for frame in 0..=sequence.frames() {
                    sequence.at(sequence.time_of(frame)).unwrap();
                }
            }
        }
    }
}
