//! T16, T22, T24: values that are no numbers or too large ones, more than can be numbered or held, and calls that make no
//! sense. Each gets a typed error or a valid answer.

use raywright_bvh::{
    Accuracy, BuildError, BuildParams, BuildWorkspace, Bvh, MeshError, ParameterFault, Quality,
    Ray, TriangleMesh, Vec3,
};

use super::{
    ExtremesError, Findings, Settings, meshes,
    modes::{ACCURACIES, QUALITIES, Sampler, bits, qualities_and_widths, with},
};

const TRIANGLE: [Vec3; 3] = [Vec3::ZERO, Vec3::X, Vec3::Y];

/// T16.
pub(super) fn vertices(_: &Settings, findings: &mut Findings) -> Result<(), ExtremesError> {
    let all = || ACCURACIES.into_iter().flat_map(qualities_and_widths);
    let mut sampler = Sampler::new(16);
    let sound = meshes::random_soup(200, 16)?;
    let rays: Vec<Ray> = (0..100)
        .map(|_| {
            let triangle = sampler.triangle(&sound);
            let (from, to) = (3.0 * sampler.vector(), sampler.on(triangle));
            Ray::new(from, to - from)
        })
        .collect();
    // The triangle that is to be bad is a point in the mesh that has none.
    const BAD: usize = 77;
    let mut point = sound.triangles().to_vec();
    point[BAD] = [point[0][0]; 3];
    let without = TriangleMesh::new(sound.vertices().to_vec(), point)?;
    let mut expected = Vec::new();
    for params in all() {
        let tree = Bvh::build(&[&without], &params)?;
        let hits = rays.iter().map(|ray| bits(tree.closest_hit(ray)));
        expected.push(hits.collect::<Vec<_>>());
    }
    let (mut strict, mut skipped, mut refused) = (0, 0, 0);
    for coordinate in 0..9 {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut vertices = sound.vertices().to_vec();
            let vertex = 3 * BAD + coordinate / 3;
            vertices[vertex][coordinate % 3] = bad;
            let got = TriangleMesh::new(vertices.clone(), sound.triangles().to_vec());
            let named = MeshError::NonFiniteVertex {
                triangle: BAD,
                vertex: vertex as u32,
            };
            findings.demand(got == Err(named), || {
                format!("vertex {vertex} {bad}: {got:?}")
            });
            strict += 1;
            let (mesh, count) =
                TriangleMesh::skipping_non_finite(vertices, sound.triangles().to_vec())?;
            findings.demand(count == 1, || {
                format!("{count} triangles are skipped, not 1")
            });
            for (params, expected) in all().zip(&expected) {
                let tree = Bvh::build(&[&mesh], &params)?;
                let hits = rays.iter().map(|ray| bits(tree.closest_hit(ray)));
                findings.demand(hits.eq(expected.iter().copied()), || {
                    format!("skipping {bad} changes hits: {params:?}")
                });
                skipped += 1;
            }
        }
        for bad in [f32::MAX, f32::MIN, 2f32.powi(101)] {
            let mut corners = TRIANGLE;
            corners[coordinate / 3][coordinate % 3] = bad;
            let mesh = meshes::soup(&[TRIANGLE, corners])?;
            for params in all() {
                let got = Bvh::build(&[&mesh], &params);
                let is_refused = matches!(
                    &got,
                    Err(BuildError::CoordinateRange { largest, .. }) if *largest == bad.abs()
                );
                findings.demand(is_refused, || {
                    format!("coordinate {bad:e}: {:?}", got.err())
                });
                refused += 1;
            }
        }
    }
    findings.figure(
        "errors that name triangle and vertex",
        strict,
        "dropped in silence",
    );
    findings.figure("trees as without the triangle that is skipped", skipped, "");
    findings.figure(
        "refusals of coordinates of 2^101 and more",
        refused,
        "accepted below 1.8e18, then dropped in silence",
    );
    findings.deviates(
        "a finite coordinate beyond 2^100 is named by its value, not by its triangle, and is not skipped",
    );
    Ok(())
}

/// T22.
pub(super) fn limits(settings: &Settings, findings: &mut Findings) -> Result<(), ExtremesError> {
    numbers(findings)?;
    memory(settings, findings)?;
    findings.deviates(
        "an allocator that fails is not tested: to write one needs unsafe code. The workspace is limited before it is taken; the tree itself is not",
    );
    Ok(())
}

/// One mesh many times: counts that no memory holds, refused before any is taken.
fn numbers(findings: &mut Findings) -> Result<(), ExtremesError> {
    const PART: usize = 1 << 16;
    let many = TriangleMesh::new(TRIANGLE.to_vec(), vec![[0, 1, 2]; PART])?;
    let one_less = TriangleMesh::new(TRIANGLE.to_vec(), vec![[0, 1, 2]; PART - 1])?;
    let few = TriangleMesh::new(TRIANGLE.to_vec(), vec![[0, 1, 2]])?;
    let points = TriangleMesh::new(vec![Vec3::ZERO; 1 << 20], vec![])?;
    let limit = TriangleMesh::MAX_TRIANGLES;
    // So many that the whole is the limit exactly.
    let mut most = vec![&many; limit / PART];
    most.push(&one_less);
    let mut workspace = BuildWorkspace::default();
    workspace.control.memory_limit = Some(1 << 20);
    for quality in QUALITIES {
        let params = with(quality, 8, Accuracy::Robust);
        let got = Bvh::build_in(&most, &params, &mut workspace).err();
        findings.demand(matches!(got, Some(BuildError::MemoryLimit { .. })), || {
            format!("{limit} triangles: {got:?}")
        });
        for more in [1, 1 << 29, 3 << 29] {
            let mut meshes = most.clone();
            meshes.push(&few);
            meshes.extend(vec![&many; (more - 1) / PART]);
            let got = Bvh::build_in(&meshes, &params, &mut workspace).err();
            let is_named = matches!(
                got,
                Some(BuildError::Mesh(MeshError::TooManyTriangles { count, .. })) if count > limit
            );
            findings.demand(is_named, || format!("{limit} + {more} triangles: {got:?}"));
        }
        let meshes = vec![&points; 1 << 12];
        let got = Bvh::build_in(&meshes, &params, &mut workspace).err();
        let is_named = matches!(
            got,
            Some(BuildError::TreeTooLarge {
                parts: "vertices",
                ..
            })
        );
        findings.demand(is_named, || format!("2^32 vertices: {got:?}"));
    }
    findings.figure("most triangles", limit, "");
    Ok(())
}

/// Limits of memory from nothing to what is needed.
fn memory(settings: &Settings, findings: &mut Findings) -> Result<(), ExtremesError> {
    let steps = (settings.rays / 80).clamp(20, 500);
    let mesh = meshes::cube(16)?.mesh;
    let ray = Ray::new([0.4, 0.45, 0.5], [0.1, 0.2, 1.0]);
    let mut refusals = 0;
    for quality in QUALITIES {
        let params = with(quality, 8, Accuracy::Robust);
        let mut workspace = BuildWorkspace::default();
        let old = Bvh::build_in(&[&mesh], &params, &mut workspace)?;
        let before = bits(old.closest_hit(&ray));
        let needed = BuildWorkspace::bytes_needed(mesh.triangles().len(), &params);
        for step in 0..steps {
            let limit = needed * step / steps;
            workspace.control.memory_limit = Some(limit);
            let got = Bvh::build_in(&[&mesh], &params, &mut workspace).err();
            findings.demand(
                got == Some(BuildError::MemoryLimit { needed, limit }),
                || format!("{quality:?}, {limit} bytes of {needed}: {got:?}"),
            );
            refusals += 1;
        }
        workspace.control.memory_limit = Some(needed);
        let new = Bvh::build_in(&[&mesh], &params, &mut workspace)?;
        findings.demand(workspace.bytes() <= needed, || {
            format!("{quality:?} holds {} bytes of {needed}", workspace.bytes())
        });
        let hits = [&old, &new].map(|tree| bits(tree.closest_hit(&ray)));
        findings.demand(before.is_some() && hits == [before; 2], || {
            format!("{quality:?}: a refused build changed a tree")
        });
    }
    findings.figure("builds refused by a limit of memory", refusals, "");
    Ok(())
}

/// T24.
pub(super) fn hostile(_: &Settings, findings: &mut Findings) -> Result<(), ExtremesError> {
    let got = TriangleMesh::new(TRIANGLE.to_vec(), vec![[0, 1, 2], [0, 1, u32::MAX]]);
    let named = MeshError::IndexOutOfRange {
        triangle: 1,
        index: u32::MAX,
        vertex_count: 3,
    };
    findings.demand(got == Err(named), || format!("index out of range: {got:?}"));
    let (empty, one) = (meshes::soup(&[])?, meshes::soup(&[TRIANGLE])?);
    let two = meshes::soup(&[TRIANGLE; 2])?;
    let ray = Ray::new([0.25, 0.25, 1.0], [0.0, 0.0, -1.0]);
    let mut refusals = 0;
    for accuracy in ACCURACIES {
        for params in qualities_and_widths(accuracy) {
            let id = |meshes: &[&TriangleMesh], params: &BuildParams| {
                let tree = Bvh::build(meshes, params)?;
                let hit = tree.closest_hit(&ray);
                Ok::<_, BuildError>(hit.map(|hit| (hit.geometry_id, hit.primitive_id)))
            };
            let mut leaves = params;
            (leaves.min_leaf_size, leaves.max_leaf_size) = (64, 64);
            let mut single = params;
            (single.min_leaf_size, single.max_leaf_size) = (1, 1);
            let mut free = params;
            (free.traversal_cost, free.intersection_cost) = (0.0, 0.0);
            let mut three = params;
            three.branching_factor = 3;
            for params in [params, leaves, single, free, three] {
                for (scene, expected) in [
                    (&[][..], None),
                    (&[&empty], None),
                    (&[&one], Some((0, 0))),
                    (&[&empty, &two, &empty], Some((1, 0))),
                ] {
                    let got = id(scene, &params)?;
                    findings.demand(got == expected, || format!("{got:?}: {params:?}"));
                }
            }
            type Change = fn(&mut BuildParams);
            let changes: [(&str, Change); 12] = [
                ("branching_factor", |p| p.branching_factor = 0),
                ("branching_factor", |p| p.branching_factor = 1),
                ("branching_factor", |p| p.branching_factor = 17),
                ("traversal_cost", |p| p.traversal_cost = f32::NAN),
                ("traversal_cost", |p| p.traversal_cost = -1.0),
                ("intersection_cost", |p| p.intersection_cost = f32::INFINITY),
                ("intersection_cost", |p| {
                    p.intersection_cost = -f32::MIN_POSITIVE
                }),
                ("max_leaf_size", |p| p.max_leaf_size = 0),
                ("min_leaf_size", |p| p.min_leaf_size = u32::MAX),
                ("max_depth", |p| p.max_depth = 0),
                ("sah_block_size", |p| p.sah_block_size = 0),
                ("split_budget", |p| p.split_budget = f32::NAN),
            ];
            for (parameter, change) in changes {
                let mut changed = params;
                change(&mut changed);
                let got = Bvh::build(&[&one], &changed).err();
                let is_named = matches!(
                    &got,
                    Some(BuildError::Parameters(faults)) if matches!(
                        faults[..], [ParameterFault::OutOfRange { name, .. }] if name == parameter)
                );
                findings.demand(is_named, || format!("{parameter}: {got:?}"));
                refusals += 1;
            }
        }
    }
    let shallow = {
        let mut params = with(Quality::BinnedSah, 2, Accuracy::Fast);
        (params.max_depth, params.max_leaf_size, params.min_leaf_size) = (2, 1, 1);
        Bvh::build(&[&meshes::cube(4)?.mesh], &params).err()
    };
    findings.demand(
        matches!(shallow, Some(BuildError::DepthLimit { .. })),
        || format!("a tree deeper than allowed: {shallow:?}"),
    );
    findings.figure("refusals by name of the parameter", refusals, "");
    Ok(())
}
