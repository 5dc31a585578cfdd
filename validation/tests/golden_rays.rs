//! The golden rays find what exact fractions say, by every quality, branching factor and instruction set.

use std::path::Path;

use raywright_bvh::{Accuracy, BuildParams, Bvh, Isa, MeshError, Quality, Ray, TriangleMesh, Vec3};
use raywright_validation::golden::{Case, Expectation, GoldenRay, read_cases};

/// Below this weight the neighbour across the edge is as good.
const NEIGHBOUR: f64 = 1e-6;

/// Distances are right to this share of the ray's way and of the farthest vertex.
const DISTANCE: f64 = 1.0 / (1 << 20) as f64;

/// The golden file beside the checkout; says so if there is none.
fn cases() -> Option<Vec<Case>> {
    let path =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/golden/robust/cases.json");
    if !path.is_file() {
        eprintln!("skipped: no golden rays in {}", path.display());
        return None;
    }
    let cases = read_cases(&path).expect("as its README says");
    assert_eq!(cases.len(), 23);
    assert_eq!(cases.iter().map(|case| case.rays.len()).sum::<usize>(), 168);
    Some(cases)
}

/// The mesh of a case, without the triangle that is not sound.
fn mesh(case: &Case) -> TriangleMesh {
    let strict = TriangleMesh::new(case.vertices(), case.triangles.clone());
    match &case.build {
        None => strict.expect("sound"),
        Some(refusal) if refusal.skip.is_some() => {
            let error = strict.expect_err("a triangle is not sound");
            let said = &refusal.strict;
            assert!(
                matches!(
                    error,
                    MeshError::NonFiniteVertex {
                        triangle: 2,
                        vertex: 4
                    }
                ) && said.contains("prim:2,vertex:4"),
                "{}: {error}, not {said}",
                case.id
            );
            let skipping =
                TriangleMesh::skipping_non_finite(case.vertices(), case.triangles.clone());
            let (mesh, skipped) = skipping.expect("its indices are in range");
            assert_eq!(skipped, 1, "{}", case.id);
            mesh
        }
        Some(refusal) => {
            let mut triangles = case.triangles.clone();
            triangles.push([0, 1, 4]);
            let error = TriangleMesh::new(case.vertices(), triangles).expect_err("out of range");
            assert!(
                matches!(
                    error,
                    MeshError::IndexOutOfRange {
                        triangle: 2,
                        index: 4,
                        vertex_count: 4
                    }
                ),
                "{}: {error}, not {}",
                case.id,
                refusal.strict
            );
            strict.expect("sound without it")
        }
    }
}

/// What is wrong with a tree's answer, if anything.
fn fault(tree: &Bvh, vertices: &[Vec3], golden: &GoldenRay) -> Option<String> {
    let ray = golden.ray();
    let hit = tree.closest_hit(&ray);
    if tree.any_hit(&ray) != hit.is_some() {
        return Some(format!("any hit says otherwise than {hit:?}"));
    }
    let (hit, expected) = match (hit, golden.expect, golden.t) {
        (None, Expectation::Miss | Expectation::InvalidRay, _) => return None,
        (Some(hit), Expectation::Hit, Some(t)) => (hit, t),
        (hit, expect, _) => return Some(format!("{expect:?}, got {hit:?}")),
    };
    let is_near = golden.min_bary.is_some_and(|weight| weight < NEIGHBOUR);
    if !golden.accept_prims.contains(&hit.primitive_id) && !is_near {
        return Some(format!("{hit:?} is none of {:?}", golden.accept_prims));
    }
    let far = vertices.iter().filter(|vertex| vertex.is_finite());
    let far = far.map(|&vertex| (vertex - ray.origin).as_dvec3().length());
    let way = far.fold(0.0, f64::max) / ray.direction.as_dvec3().length();
    let error = (f64::from(hit.t) - expected).abs();
    if error > DISTANCE * (expected.abs() + way) {
        return Some(format!("t = {} is off by {error}", hit.t));
    }
    let weights = [hit.u, hit.v, 1.0 - hit.u - hit.v];
    if weights
        .iter()
        .any(|weight| !(-1e-6..=1.000_001).contains(weight))
    {
        return Some(format!("weights {weights:?}"));
    }
    None
}

fn trees(mesh: &TriangleMesh, accuracy: Accuracy) -> impl Iterator<Item = (String, Bvh)> + '_ {
    let qualities = [
        Quality::Morton,
        Quality::Agglomerative,
        Quality::BinnedSah,
        Quality::SpatialSplits,
        Quality::Optimized,
    ];
    let isas = Isa::ALL.into_iter().filter(|isa| isa.is_available());
    let all = isas.flat_map(move |isa| {
        qualities
            .into_iter()
            .flat_map(move |quality| [2, 4, 8, 16].map(|factor| (isa, quality, factor)))
    });
    all.map(move |(isa, quality, branching_factor)| {
        let mut params = BuildParams::default();
        params.quality = quality;
        params.branching_factor = branching_factor;
        params.accuracy = accuracy;
        let tree = Bvh::build(&[mesh], &params).expect("built");
        let name = format!("{quality:?}, {branching_factor}, {}", isa.name());
        (name, tree.with_isa(isa).expect("available"))
    })
}

/// Asks all trees of an accuracy with all rays that are to be judged.
fn check(accuracy: Accuracy, is_judged: impl Fn(&GoldenRay) -> bool) {
    let Some(cases) = cases() else { return };
    let mut faults = Vec::new();
    for case in &cases {
        let mesh = mesh(case);
        for (name, tree) in trees(&mesh, accuracy) {
            for (index, golden) in case.rays.iter().enumerate() {
                if !is_judged(golden) {
                    continue;
                }
                if let Some(fault) = fault(&tree, mesh.vertices(), golden) {
                    faults.push(format!("{} {index} ({name}): {fault}", case.id));
                }
            }
        }
    }
    assert!(
        faults.is_empty(),
        "{} faults:\n{}",
        faults.len(),
        faults.join("\n")
    );
}

#[test]
fn the_robust_test_finds_what_exact_fractions_say() {
    check(Accuracy::Robust, |_| true);
}

#[test]
fn the_fast_test_errs_on_borders_and_ends_of_intervals_alone() {
    check(Accuracy::Fast, |golden| {
        let Ray { t_min, t_max, .. } = golden.ray();
        let t = golden.t.unwrap_or(f64::NAN);
        let is_end = [t_min, t_max].map(f64::from).contains(&t);
        !golden.is_on_border() && !is_end
    });
}

/// Equal triangles: the first is hit by all.
#[test]
fn of_equal_triangles_the_lowest_id_is_hit() {
    let Some(cases) = cases() else { return };
    let case = cases
        .iter()
        .find(|case| case.id == "identical-8")
        .expect("is there");
    let mesh = mesh(case);
    for accuracy in [Accuracy::Fast, Accuracy::Robust] {
        for (name, tree) in trees(&mesh, accuracy) {
            for golden in case
                .rays
                .iter()
                .filter(|ray| ray.expect == Expectation::Hit)
            {
                let hit = tree.closest_hit(&golden.ray()).expect("a hit");
                assert_eq!(hit.primitive_id, 0, "{name}");
            }
        }
    }
}
