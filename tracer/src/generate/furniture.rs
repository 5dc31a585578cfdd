//! What stands in the room of `interior`: each function adds the meshes of one thing.
//!
//! Vases, cushions and leaves are the many small triangles; chair legs and canes are the long thin
//! ones in all directions.

use glam::{Mat3, Vec2};
use raywright_bvh::Vec3;

use super::interior::Room;
use super::shapes::{Shapes, turn};

impl Room {
    pub(super) fn sofa(&mut self) {
        let back = -2.75;
        self.add("sofa", [0.22, 0.30, 0.42], |room, s| {
            let segments = room.divisions(64, 8);
            let mut part = |centre: [f32; 3], half_size: [f32; 3]| {
                let centre = Vec3::from_array(centre) + Vec3::new(-1.1, 0.0, back);
                s.cushion(centre, Vec3::from_array(half_size), segments);
            };
            part([0.0, 0.26, 0.45], [1.15, 0.15, 0.45]);
            part([0.0, 0.60, 0.08], [1.15, 0.32, 0.13]);
            part([-1.12, 0.42, 0.45], [0.13, 0.25, 0.46]);
            part([1.12, 0.42, 0.45], [0.13, 0.25, 0.46]);
            part([-0.5, 0.44, 0.52], [0.50, 0.10, 0.38]);
            part([0.5, 0.44, 0.52], [0.50, 0.10, 0.38]);
        });
        for (name, albedo, at) in [
            ("cushion ochre", [0.72, 0.48, 0.10], [-1.75, 0.70, 0.33]),
            ("cushion white", [0.78, 0.76, 0.70], [-1.35, 0.67, 0.40]),
            ("cushion rust", [0.58, 0.20, 0.10], [-0.42, 0.69, 0.34]),
        ] {
            self.add(name, albedo, |room, s| {
                let segments = room.divisions(48, 8);
                let centre = Vec3::new(at[0], at[1], back + at[2]);
                s.cushion(centre, Vec3::new(0.22, 0.21, 0.09), segments);
            });
        }
        self.add("sofa feet", [0.12, 0.08, 0.05], |_, s| {
            for (x, z) in [(-2.1, 0.1), (-0.1, 0.1), (-2.1, 0.8), (-0.1, 0.8)] {
                let top = Vec3::new(x, 0.14, back + z);
                s.rod(top, Vec3::new(x, 0.0, back + z), 0.022, 10);
            }
        });
    }

    /// A round table on three slanted legs, with vases, a bowl of fruit and a globe.
    pub(super) fn table(&mut self) {
        let centre = Vec3::new(-0.75, 0.0, -0.1);
        let top = centre + 0.46 * Vec3::Y;
        self.add("table", [0.42, 0.26, 0.13], |room, s| {
            let segments = room.divisions(96, 12);
            let plate = [
                [0.0, 0.42],
                [0.60, 0.42],
                [0.62, 0.43],
                [0.62, 0.45],
                [0.61, 0.46],
                [0.0, 0.46],
            ];
            s.lathe(centre, segments, &plate);
            for leg in 0..3 {
                let (cos, sin) = turn(leg as f32 + 0.4, 3.0);
                let outwards = Vec3::new(cos, 0.0, sin);
                s.rod(
                    top + 0.3 * outwards - 0.03 * Vec3::Y,
                    centre + 0.5 * outwards,
                    0.018,
                    10,
                );
            }
        });
        let vases = [
            ("vase blue", [0.10, 0.22, 0.48], [-0.28, -0.20], 0.34, 0.0),
            ("vase white", [0.82, 0.80, 0.76], [-0.40, 0.10], 0.22, 0.35),
            ("vase green", [0.16, 0.38, 0.24], [-0.05, -0.36], 0.27, 0.7),
        ];
        for (name, albedo, [x, z], height, phase) in vases {
            self.add(name, albedo, |room, s| {
                let (segments, rings) = (room.divisions(112, 10), room.divisions(72, 8));
                let outline = |i: u32| {
                    let t = i as f32 / rings as f32;
                    let (belly, _) = turn(0.62 * t - 0.25 + 0.1 * phase, 1.0);
                    [height * (0.19 + 0.12 * belly), height * t]
                };
                let foot = [[0.0, 0.0]];
                let profile: Vec<[f32; 2]> =
                    foot.into_iter().chain((0..=rings).map(outline)).collect();
                s.lathe(top + Vec3::new(x, 0.0, z), segments, &profile);
            });
        }
        let bowl = top + Vec3::new(0.22, 0.0, 0.16);
        self.add("bowl", [0.52, 0.50, 0.46], |room, s| {
            let segments = room.divisions(96, 10);
            let profile = [
                [0.0, 0.0],
                [0.07, 0.0],
                [0.13, 0.03],
                [0.175, 0.08],
                [0.17, 0.082],
                [0.125, 0.037],
                [0.065, 0.012],
                [0.0, 0.01],
            ];
            s.lathe(bowl, segments, &profile);
        });
        for (name, albedo, phase) in [
            ("oranges", [0.80, 0.34, 0.04], 0.0),
            ("limes", [0.38, 0.55, 0.06], 0.5),
        ] {
            self.add(name, albedo, |room, s| {
                let segments = room.divisions(40, 8);
                for i in 0..4 {
                    let (cos, sin) = turn(i as f32 + phase, 4.0);
                    let height = 0.06 + 0.035 * phase;
                    let radius = 0.085 - 0.02 * phase;
                    let place = Vec3::new(radius * cos, height, radius * sin);
                    s.sphere(bowl + place, 0.042 - 0.01 * phase, segments);
                }
            });
        }
    }

    /// A stick chair, turned by a part of a full turn.
    pub(super) fn chair(&mut self, at: Vec2, part_of_turn: f32) {
        let (cos, sin) = turn(part_of_turn, 1.0);
        let place = move |x: f32, y: f32, z: f32| {
            Vec3::new(at.x + cos * x - sin * z, y, at.y + sin * x + cos * z)
        };
        self.add("chair", [0.50, 0.34, 0.18], |_, s| {
            let axes = Mat3::from_cols(
                Vec3::new(cos, 0.0, sin) * 0.22,
                Vec3::Y * 0.015,
                Vec3::new(-sin, 0.0, cos) * 0.21,
            );
            s.block(place(0.0, 0.45, 0.0), axes);
            for (x, z) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
                let (upper, lower) = (
                    place(0.16 * x, 0.44, 0.15 * z),
                    place(0.23 * x, 0.0, 0.22 * z),
                );
                s.rod(upper, lower, 0.013, 10);
            }
            for i in 0..7 {
                let x = i as f32 / 3.0 - 1.0;
                let foot = place(0.18 * x, 0.46, -0.19);
                s.rod(foot, place(0.23 * x, 0.93, -0.29), 0.007, 8);
            }
            s.rod(
                place(-0.27, 0.93, -0.29),
                place(0.27, 0.93, -0.29),
                0.017,
                12,
            );
        });
    }

    /// Boards at the back wall, and books that lean a little.
    pub(super) fn shelf(&mut self) {
        let (left, right, depth) = (1.25, 3.35, [-2.97, -2.68]);
        let levels: [f32; 5] = [0.12, 0.56, 1.0, 1.44, 1.88];
        self.add("shelf", [0.30, 0.19, 0.10], |_, s| {
            for level in levels {
                s.cuboid(
                    Vec3::new(left, level - 0.025, depth[0]),
                    Vec3::new(right, level, depth[1]),
                );
            }
            for x in [left - 0.03, right] {
                s.cuboid(
                    Vec3::new(x, 0.0, depth[0]),
                    Vec3::new(x + 0.03, 1.9, depth[1]),
                );
            }
        });
        let covers = [
            ("books red", [0.55, 0.08, 0.07]),
            ("books navy", [0.07, 0.12, 0.30]),
            ("books cream", [0.76, 0.69, 0.52]),
            ("books green", [0.10, 0.28, 0.14]),
            ("books ochre", [0.66, 0.42, 0.08]),
        ];
        let mut books: [Shapes; 5] = Default::default();
        for level in &levels[..4] {
            let mut x = left + 0.02;
            while x < right - 0.09 {
                let random = &mut self.random;
                let thickness = random.between(0.018, 0.055);
                let height = random.between(0.22, 0.36);
                let width = random.between(0.16, 0.24);
                let lean = random.between(-0.012, 0.012);
                let centre = Vec3::new(
                    x + 0.5 * thickness,
                    level + 0.5 * height,
                    -2.95 + 0.5 * width,
                );
                let axes = Mat3::from_cols(Vec3::X, Vec3::new(lean, 1.0, 0.0), Vec3::Z)
                    * Mat3::from_diagonal(0.5 * Vec3::new(thickness, height, width));
                let cover = random.between(0.0, covers.len() as f32) as usize;
                books[cover].block(centre, axes);
                // Some places stay empty.
                x += thickness + 0.006 + f32::max(0.0, random.between(-1.0, 0.16));
            }
        }
        for ((name, albedo), shapes) in covers.into_iter().zip(books) {
            self.add(name, albedo, |_, s| *s = shapes);
        }
        self.add("globe", [0.30, 0.48, 0.60], |room, s| {
            let segments = room.divisions(120, 12);
            s.sphere(Vec3::new(2.8, 2.06, -2.82), 0.16, segments);
        });
    }

    pub(super) fn pictures(&mut self) {
        let frames = [
            (
                "picture ochre",
                [0.80, 0.56, 0.18],
                [-2.0, 1.75],
                [0.36, 0.26],
            ),
            (
                "picture blue",
                [0.16, 0.32, 0.52],
                [-1.1, 1.70],
                [0.28, 0.36],
            ),
            (
                "picture rose",
                [0.72, 0.38, 0.36],
                [-0.3, 1.80],
                [0.30, 0.22],
            ),
        ];
        for (name, albedo, [x, y], [wide, high]) in frames {
            self.add(name, albedo, |_, s| {
                let low = Vec3::new(x - wide, y - high, -2.965);
                s.quad(low, 2.0 * wide * Vec3::X, 2.0 * high * Vec3::Y);
            });
        }
        self.add("picture frames", [0.08, 0.07, 0.06], |_, s| {
            for (_, _, [x, y], [wide, high]) in frames {
                let corner = |u: f32, v: f32| Vec3::new(x + u * wide, y + v * high, -2.965);
                let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
                for (i, &(u, v)) in corners.iter().enumerate() {
                    let (next_u, next_v) = corners[(i + 1) % 4];
                    s.rod(corner(u, v), corner(next_u, next_v), 0.018, 4);
                }
            }
        });
    }

    /// A plant with hundreds of bent leaves on thin stems.
    pub(super) fn plant(&mut self) {
        let pot = Vec3::new(-3.3, 0.0, 1.1);
        self.add("pot", [0.62, 0.34, 0.22], |room, s| {
            let profile = [
                [0.0, 0.0],
                [0.15, 0.0],
                [0.21, 0.38],
                [0.22, 0.40],
                [0.20, 0.40],
                [0.19, 0.36],
                [0.0, 0.36],
            ];
            s.lathe(pot, room.divisions(72, 10), &profile);
        });
        let (mut stems, mut leaves) = (Shapes::default(), Shapes::default());
        let size = [self.divisions(4, 2), self.divisions(6, 2)];
        for _ in 0..26 {
            let random = &mut self.random;
            let (cos, sin) = turn(random.between(0.0, 1.0), 1.0);
            let outwards = Vec3::new(cos, 0.0, sin) * random.between(0.1, 0.5);
            let height = random.between(0.5, 1.25);
            let foot = pot + Vec3::new(0.3 * outwards.x, 0.36, 0.3 * outwards.z);
            let along = |t: f32| foot + outwards * (t * t) + height * t * Vec3::Y;
            for i in 0..6 {
                stems.rod(along(i as f32 / 6.0), along((i + 1) as f32 / 6.0), 0.006, 6);
            }
            for i in 0..24 {
                let (cos, sin) = turn(random.between(0.0, 1.0), 1.0);
                let outwards = Vec3::new(cos, 0.0, sin);
                let across = Vec3::new(-sin, 0.0, cos);
                let length = random.between(0.12, 0.24);
                let droop = random.between(0.2, 0.9);
                let root = along((0.3 * 24.0 + 0.7 * i as f32) / 24.0);
                leaves.sheet(size, |u, v| {
                    // Pointed at both ends, but not to a point: no triangle may vanish.
                    let width = length * (0.02 + 0.9 * v * (1.0 - v));
                    let bend = 0.5 * v - droop * v * v;
                    let fold = 0.3 * width * (2.0 * u - 1.0).abs();
                    root + length * v * outwards
                        + (length * bend + fold) * Vec3::Y
                        + (u - 0.5) * width * across
                });
            }
        }
        self.add("stems", [0.16, 0.22, 0.08], |_, s| *s = stems);
        self.add("leaves", [0.10, 0.30, 0.08], |_, s| *s = leaves);
    }

    /// Canes in a tall jar: triangles of a metre and a half in length and some millimetres in
    /// width, in all directions.
    pub(super) fn canes(&mut self) {
        let jar = Vec3::new(0.72, 0.0, -2.55);
        self.add("jar", [0.24, 0.22, 0.21], |room, s| {
            let profile = [
                [0.0, 0.0],
                [0.12, 0.0],
                [0.17, 0.25],
                [0.11, 0.52],
                [0.12, 0.55],
                [0.10, 0.55],
                [0.10, 0.5],
                [0.0, 0.5],
            ];
            s.lathe(jar, room.divisions(72, 10), &profile);
        });
        self.add("canes", [0.62, 0.50, 0.28], |room, s| {
            for _ in 0..60 {
                let random = &mut room.random;
                let (cos, sin) = turn(random.between(0.0, 1.0), 1.0);
                let outwards = Vec3::new(cos, 0.0, sin) * random.between(0.01, 0.09);
                let reach = random.between(1.5, 4.0);
                let foot = jar + 0.5 * Vec3::Y + 0.6 * outwards;
                let tip = foot + reach * outwards + random.between(0.7, 1.4) * Vec3::Y;
                s.rod(foot, tip, random.between(0.003, 0.006), 6);
            }
        });
    }
}
