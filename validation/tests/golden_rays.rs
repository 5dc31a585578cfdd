//! The golden rays find what exact fractions say, by every quality, branching factor and instruction set.

use std::path::Path;

use raywright_bvh::{Accuracy, BuildParams, Bvh, Isa, Quality, TriangleMesh};
use raywright_validation::golden::{Case, Expectation, GoldenRay, read_cases};

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

/// Rays that are asked of all trees find what is expected.
fn check(accuracy: Accuracy, is_asked: impl Fn(&GoldenRay) -> bool) {
    let Some(cases) = cases() else { return };
    let mut faults = Vec::new();
    for case in &cases {
        let mesh = case.mesh().expect("as expected");
        for (name, tree) in trees(&mesh, accuracy) {
            let rays = case.rays.iter().enumerate();
            for (index, golden) in rays.filter(|(_, golden)| is_asked(golden)) {
                if let Some(fault) = golden.fault(&tree, mesh.vertices()) {
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
    check(Accuracy::Fast, |golden| !golden.is_hard());
}

/// Equal triangles: the first is hit by all.
#[test]
fn of_equal_triangles_the_lowest_id_is_hit() {
    let Some(cases) = cases() else { return };
    let case = cases
        .iter()
        .find(|case| case.id == "identical-8")
        .expect("is there");
    let mesh = case.mesh().expect("as expected");
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
