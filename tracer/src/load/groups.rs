//! Which triangles belong to which mesh, and which material a mesh has.
//!
//! One mesh per object, group and material, in the order of first appearance; a name that comes
//! back continues its mesh. Materials are matched at the end, since a file may name a library
//! after its use.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use raywright_bvh::{TriangleMesh, Vec3};

use super::warning::{Place, WarningKind, Warnings};
use crate::scene::{Material, Mesh};

/// Albedo of surfaces whose material is not known.
const UNKNOWN_DIFFUSE: f32 = 0.5;

/// The name of the material and of the mesh where the file names none.
const DEFAULT_NAME: &str = "default";

/// Numbers for names, in the order of their first appearance.
#[derive(Debug, Default)]
struct Names {
    numbers: HashMap<String, usize>,
    /// Each name with the line where it appeared first.
    list: Vec<(String, usize)>,
}

impl Names {
    /// The number of a name; the empty name has none.
    fn number(&mut self, name: String, line: usize) -> Option<usize> {
        if name.is_empty() {
            return None;
        }
        Some(match self.numbers.entry(name) {
            Entry::Occupied(known) => *known.get(),
            Entry::Vacant(new) => {
                self.list.push((new.key().clone(), line));
                *new.insert(self.list.len() - 1)
            }
        })
    }
}

/// What decides to which mesh a face belongs; numbers of names, `None` where none is in force.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
struct MeshKey {
    object: Option<usize>,
    group: Option<usize>,
    material: Option<usize>,
}

/// Triangles by mesh.
#[derive(Debug, Default)]
pub(super) struct Groups {
    names: Names,
    materials: Names,
    /// What is in force.
    key: MeshKey,
    /// The mesh of `key`, once a face needed it.
    current: Option<usize>,
    mesh_of_key: HashMap<MeshKey, usize>,
    /// Triangles with indices into the positions of the whole file.
    meshes: Vec<(MeshKey, Vec<[u32; 3]>)>,
}

impl Groups {
    /// Begins an object, which ends the group in force. An empty name ends both.
    pub(super) fn object(&mut self, name: String, line: usize) {
        self.key.object = self.names.number(name, line);
        self.key.group = None;
        self.current = None;
    }

    /// Begins a group of the object; an empty name ends it.
    pub(super) fn group(&mut self, name: String, line: usize) {
        self.key.group = self.names.number(name, line);
        self.current = None;
    }

    /// Changes the material; an empty name is none.
    pub(super) fn material(&mut self, name: String, line: usize) {
        self.key.material = self.materials.number(name, line);
        self.current = None;
    }

    /// The triangles of the mesh in force, with indices into the positions of the whole file.
    pub(super) fn triangles(&mut self) -> &mut Vec<[u32; 3]> {
        let mesh = match self.current {
            Some(mesh) => mesh,
            None => *self.mesh_of_key.entry(self.key).or_insert_with(|| {
                self.meshes.push((self.key, Vec::new()));
                self.meshes.len() - 1
            }),
        };
        self.current = Some(mesh);
        &mut self.meshes[mesh].1
    }

    /// The meshes that have triangles, with places in `materials`, to which a grey one is added
    /// for each name that it lacks, and for meshes without a name (Twinklebear/tobj#30).
    pub(super) fn into_meshes(
        mut self,
        positions: &[Vec3],
        materials: &mut Vec<Material>,
        warnings: &mut Warnings,
    ) -> Vec<Mesh> {
        self.meshes.retain(|(_, triangles)| !triangles.is_empty());
        let places = self.match_materials(materials, warnings);
        let mut local = vec![u32::MAX; positions.len()];
        let meshes = std::mem::take(&mut self.meshes).into_iter();
        meshes
            .map(|(key, triangles)| Mesh {
                name: self.mesh_name(key),
                triangles: compact(positions, triangles, &mut local),
                material: places[&key.material],
            })
            .collect()
    }

    fn match_materials(
        &self,
        materials: &mut Vec<Material>,
        warnings: &mut Warnings,
    ) -> HashMap<Option<usize>, usize> {
        let known: HashMap<String, usize> = materials
            .iter()
            .enumerate()
            .map(|(place, material)| (material.name.clone(), place))
            .collect();
        let mut places = HashMap::new();
        for (key, _) in &self.meshes {
            places.entry(key.material).or_insert_with(|| {
                let named = key.material.map(|number| &self.materials.list[number]);
                if let Some(&place) = named.and_then(|(name, _)| known.get(name)) {
                    return place;
                }
                if let Some((name, line)) = named {
                    let place = Place {
                        library: None,
                        line: *line,
                    };
                    warnings.add(WarningKind::UnknownMaterial, place, name.as_bytes());
                }
                let name = named.map_or(DEFAULT_NAME, |(name, _)| name);
                materials.push(Material::diffuse(name, Vec3::splat(UNKNOWN_DIFFUSE)));
                materials.len() - 1
            });
        }
        places
    }

    /// `object`, `group` or `object/group`.
    fn mesh_name(&self, key: MeshKey) -> String {
        let names: Vec<&str> = [key.object, key.group]
            .into_iter()
            .flatten()
            .map(|number| self.names.list[number].0.as_str())
            .collect();
        if names.is_empty() {
            DEFAULT_NAME.to_owned()
        } else {
            names.join("/")
        }
    }
}

/// The triangles with vertices of their own. `local` is `u32::MAX` for every position, before and
/// after.
fn compact(positions: &[Vec3], mut triangles: Vec<[u32; 3]>, local: &mut [u32]) -> TriangleMesh {
    let mut used = Vec::new();
    for index in triangles.iter_mut().flatten() {
        let slot = &mut local[*index as usize];
        if *slot == u32::MAX {
            *slot = used.len() as u32;
            used.push(*index);
        }
        *index = *slot;
    }
    let vertices = used
        .iter()
        .map(|&index| positions[index as usize])
        .collect();
    for &index in &used {
        local[index as usize] = u32::MAX;
    }
    TriangleMesh::new(vertices, triangles)
        .expect("faces were checked for range, finite corners and number when they were read")
}
