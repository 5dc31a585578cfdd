//! A living room in daylight.
//!
//! Idea: what real interiors do to a tree builder in one picture. Walls are single quads of many
//! square metres; drapes, vases and leaves are thousands of triangles of square millimetres; chair
//! legs, canes and lamp cords are long, thin and turned out of the axes, where boxes fit worst.
//! Light comes through a window as sun and sky, from a panel in the ceiling, and from a lamp.
//!
//! This file is the room and its light; `furniture` is what stands in it.
//!
//! Units are metres; the room is x −4…4, y 0…3, z −3…3, the window is at x = −4.

use glam::Vec2;
use raywright_bvh::Vec3;
use raywright_imaging::Camera;

use super::noise::{Random, value_noise};
use super::shapes::{Shapes, turn};
use crate::scene::{Light, Material, Mesh, Scene};

/// The detail for about 200,000 triangles.
pub const DEFAULT_DETAIL: u32 = 16;

/// Meshes and their materials, and how finely round things are divided.
pub(super) struct Room {
    detail: u32,
    pub(super) random: Random,
    meshes: Vec<Mesh>,
    materials: Vec<Material>,
}

/// The room. Triangles of curved things grow with the square of `detail`, which is clamped to
/// 1..=128; flat things stay as they are.
#[must_use]
pub fn interior(detail: u32) -> Scene {
    let mut room = Room {
        detail: detail.clamp(1, 128),
        random: Random::new(2),
        meshes: Vec::new(),
        materials: Vec::new(),
    };
    room.shell();
    room.window();
    room.drapes();
    room.lights();
    room.rug();
    room.sofa();
    room.table();
    room.chair(Vec2::new(1.9, -0.35), 0.55);
    room.chair(Vec2::new(1.35, 1.25), 0.15);
    room.shelf();
    room.pictures();
    room.plant();
    room.canes();
    Scene {
        meshes: room.meshes,
        materials: room.materials,
        lights: vec![
            Light::Constant {
                radiance: Vec3::new(1.6, 2.0, 2.7),
            },
            Light::Directional {
                direction: Vec3::new(0.72, -0.52, -0.26),
                irradiance: Vec3::new(34.0, 30.0, 24.0),
            },
        ],
        camera: Some(Camera {
            origin: Vec3::new(3.55, 1.55, 2.75),
            target: Vec3::new(-1.15, 0.95, -1.05),
            up: Vec3::Y,
            vertical_fov_degrees: 52.0,
        }),
    }
}

impl Room {
    /// `count` divisions at the default detail, and at least `least`.
    pub(super) fn divisions(&self, count: u32, least: u32) -> u32 {
        (count * self.detail / DEFAULT_DETAIL).max(least)
    }

    pub(super) fn add(
        &mut self,
        name: &str,
        albedo: [f32; 3],
        make: impl FnOnce(&mut Self, &mut Shapes),
    ) {
        self.add_emitter(name, albedo, [0.0; 3], make);
    }

    fn add_emitter(
        &mut self,
        name: &str,
        albedo: [f32; 3],
        radiance: [f32; 3],
        make: impl FnOnce(&mut Self, &mut Shapes),
    ) {
        let mut shapes = Shapes::default();
        make(self, &mut shapes);
        let material = Material::diffuse(name, Vec3::from_array(albedo))
            .with_emission(Vec3::from_array(radiance));
        self.meshes
            .push(shapes.into_mesh(name, self.materials.len()));
        self.materials.push(material);
    }

    fn shell(&mut self) {
        let (wide, high, deep) = (8.0 * Vec3::X, 3.0 * Vec3::Y, 6.0 * Vec3::Z);
        let low = Vec3::new(-4.0, 0.0, -3.0);
        self.add("floor", [0.46, 0.30, 0.18], |_, s| s.quad(low, deep, wide));
        self.add("ceiling", [0.85, 0.85, 0.83], |_, s| {
            s.quad(low + high, wide, deep);
        });
        self.add("walls", [0.76, 0.73, 0.66], |_, s| {
            s.quad(low + wide, deep, high);
            s.quad(low + wide + deep, -wide, high);
        });
        self.add("accent wall", [0.30, 0.46, 0.46], |_, s| {
            s.quad(low, wide, high);
        });
        self.add("skirting", [0.82, 0.82, 0.80], |_, s| {
            s.cuboid(low, Vec3::new(4.0, 0.09, -2.98));
            s.cuboid(Vec3::new(3.98, 0.0, -2.98), Vec3::new(4.0, 0.09, 3.0));
        });
    }

    /// The wall with the opening, its reveal, and the frame; no glass.
    fn window(&mut self) {
        const OUTER: f32 = -4.3;
        let (y, z) = ([0.75, 2.5], [-1.9, 1.3]);
        self.add("window wall", [0.76, 0.73, 0.66], |_, s| {
            let part = |s: &mut Shapes, y: [f32; 2], z: [f32; 2]| {
                let origin = Vec3::new(-4.0, y[0], z[0]);
                s.quad(origin, (y[1] - y[0]) * Vec3::Y, (z[1] - z[0]) * Vec3::Z);
            };
            part(s, [0.0, y[0]], [-3.0, 3.0]);
            part(s, [y[1], 3.0], [-3.0, 3.0]);
            part(s, y, [-3.0, z[0]]);
            part(s, y, [z[1], 3.0]);
            let out = (OUTER + 4.0) * Vec3::X;
            let (up, along) = ((y[1] - y[0]) * Vec3::Y, (z[1] - z[0]) * Vec3::Z);
            let low = Vec3::new(-4.0, y[0], z[0]);
            s.quad(low, out, along);
            s.quad(low + up, along, out);
            s.quad(low, up, out);
            s.quad(low + along, out, up);
        });
        self.add("window frame", [0.88, 0.88, 0.86], |_, s| {
            let bar = |s: &mut Shapes, y: [f32; 2], z: [f32; 2]| {
                let depth = [OUTER + 0.02, OUTER + 0.09];
                s.cuboid(
                    Vec3::new(depth[0], y[0], z[0]),
                    Vec3::new(depth[1], y[1], z[1]),
                );
            };
            for at in [y[0], y[1] - 0.07, 1.9] {
                bar(s, [at, at + 0.07], z);
            }
            for at in [z[0], z[1] - 0.07, -0.85, 0.2] {
                bar(s, y, [at, at + 0.07]);
            }
            s.cuboid(Vec3::new(-4.25, 0.72, -2.0), Vec3::new(-3.88, 0.745, 1.4));
        });
    }

    fn drapes(&mut self) {
        self.add("drapes", [0.62, 0.20, 0.15], |room, s| {
            let size = [room.divisions(200, 24), room.divisions(44, 4)];
            for (seed, z) in [(11, -2.55), (12, 1.3)] {
                s.sheet(size, |u, v| {
                    // Pleats are narrow at the rod and wander towards the hem.
                    let hem = 1.0 - v;
                    let wander = hem * 0.5 * (value_noise(seed, [6.0 * u, 2.0 * v, 0.0]) - 0.5);
                    let (pleat, _) = turn(9.0 * u + wander, 1.0);
                    let depth = (0.035 + 0.03 * hem) * pleat;
                    let spread = 0.65 + 0.12 * hem * hem;
                    let across = z + 0.33 + spread * (0.5 - u);
                    Vec3::new(-3.82 + depth, 0.04 + 2.66 * v, across)
                });
            }
        });
        self.add("drape rod", [0.12, 0.10, 0.09], |room, s| {
            let (a, b) = (Vec3::new(-3.82, 2.74, -2.75), Vec3::new(-3.82, 2.74, 2.15));
            s.rod(a, b, 0.016, 12);
            for end in [a, b] {
                s.sphere(end, 0.04, room.divisions(24, 6));
            }
        });
    }

    fn lights(&mut self) {
        self.add_emitter("ceiling panel", [0.8; 3], [11.0, 10.2, 9.0], |_, s| {
            s.quad(Vec3::new(0.2, 2.98, -0.6), 1.4 * Vec3::X, 1.0 * Vec3::Z);
        });
        let foot = Vec3::new(-3.1, 0.0, -2.35);
        self.add("lamp", [0.15, 0.13, 0.12], |room, s| {
            let segments = room.divisions(48, 8);
            let base = [
                [0.0, 0.0],
                [0.17, 0.0],
                [0.16, 0.02],
                [0.03, 0.035],
                [0.0, 0.036],
            ];
            s.lathe(foot, segments, &base);
            s.rod(foot + 0.03 * Vec3::Y, foot + 1.5 * Vec3::Y, 0.011, 12);
        });
        self.add("lamp shade", [0.80, 0.72, 0.55], |room, s| {
            let segments = room.divisions(72, 12);
            s.lathe(foot, segments, &[[0.24, 1.36], [0.23, 1.42], [0.15, 1.72]]);
        });
        self.add_emitter("lamp bulb", [0.8; 3], [70.0, 48.0, 26.0], |_, s| {
            s.sphere(foot + 1.54 * Vec3::Y, 0.04, 10);
        });
    }

    fn rug(&mut self) {
        self.add("rug", [0.70, 0.62, 0.50], |room, s| {
            let size = [room.divisions(150, 4), room.divisions(100, 4)];
            s.sheet(size, |u, v| {
                let (x, z) = (-1.9 + 3.0 * v, -0.95 + 2.3 * u);
                let pile = value_noise(21, [40.0 * x, 0.0, 40.0 * z]);
                Vec3::new(x, 0.012 + 0.012 * pile, z)
            });
        });
    }
}
