//! Embree's scenes, by single rays and by packets.

use std::fmt;

use raywright_bvh::{Accuracy, LeafFormat, Ray, TriangleMesh};
use raywright_validation::embree::{BuildQuality, Device, Scene, SceneSettings};

use super::{
    Devices,
    engine::{Answers, Engine, Role, Trace, stored},
};

/// What is asked of Embree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum EmbreeScene {
    Medium,
    High,
    Robust,
    Compact,
    /// Medium once more: the noise.
    Again,
    /// Medium, eight rays at a time.
    Packets,
    /// Medium, held to AVX2.
    Avx2,
}

impl EmbreeScene {
    /// The fastest of them is what a user of Embree could have.
    pub(crate) const BEST: [Self; 3] = [Self::Medium, Self::High, Self::Packets];

    fn settings(self) -> SceneSettings {
        let mut settings = SceneSettings::of_quality(match self {
            Self::High => BuildQuality::High,
            _ => BuildQuality::Medium,
        });
        match self {
            Self::Robust => settings.accuracy = Accuracy::Robust,
            Self::Compact => settings.leaf_format = LeafFormat::Compact,
            _ => {}
        }
        settings
    }
}

impl fmt::Display for EmbreeScene {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Medium => "medium",
            Self::High => "high",
            Self::Robust => "robust",
            Self::Compact => "compact",
            Self::Again => "medium again",
            Self::Packets => "medium, packets of 8",
            Self::Avx2 => "medium, held to AVX2",
        })
    }
}

/// All of them; medium, to which the others are compared, comes first.
pub(crate) fn engines<'a>(devices: &'a Devices, mesh: &TriangleMesh) -> Vec<Engine<'a>> {
    use EmbreeScene::{Again, Avx2, Compact, High, Medium, Packets, Robust};
    let widest = [Medium, High, Robust, Compact, Packets, Again];
    let of_widest = widest
        .iter()
        .map(|&kind| engine(&devices.widest, mesh, kind));
    let held = devices.avx2.iter().map(|device| engine(device, mesh, Avx2));
    of_widest.chain(held).collect()
}

fn engine<'a>(device: &'a Device, mesh: &TriangleMesh, kind: EmbreeScene) -> Engine<'a> {
    let scene = device.scene(&[mesh], &kind.settings()).expect("a scene");
    let before = device.bytes();
    let scene = scene.commit().expect("committed");
    let bytes = device.bytes().saturating_sub(before);
    Engine {
        role: Role::Embree(kind),
        bytes_per_triangle: Some(bytes as f64 / mesh.triangles().len() as f64),
        tracer: match kind {
            EmbreeScene::Packets => Box::new(InPackets(scene)),
            _ => Box::new(OneByOne(scene)),
        },
    }
}

struct OneByOne<'a>(Scene<'a>);

impl Trace for OneByOne<'_> {
    fn closest(&self, rays: &[Ray], answers: &mut Answers) {
        answers.fill_closest(rays, |ray| stored(self.0.closest_hit(ray)));
    }

    fn any(&self, rays: &[Ray], answers: &mut Answers) {
        answers.fill_any(rays, |ray| self.0.any_hit(ray));
    }
}

struct InPackets<'a>(Scene<'a>);

impl Trace for InPackets<'_> {
    fn closest(&self, rays: &[Ray], answers: &mut Answers) {
        self.0.closest_hits(rays, &mut answers.embree_hits);
        answers.closest.clear();
        let hits = answers.embree_hits.iter();
        answers.closest.extend(hits.map(|&hit| stored(hit)));
    }

    fn any(&self, rays: &[Ray], answers: &mut Answers) {
        self.0.any_hits(rays, &mut answers.is_hit);
    }
}
