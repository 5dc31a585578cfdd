//! The kit passes accelerators that are right, and finds deliberate faults in others.

use raywright_bvh::{Accuracy, BuildParams, Bvh, Ray, TriangleMesh, Vec3};
use raywright_validation::{
    exact,
    hits::Answer,
    kit::{Accelerator, Checker, Finding, MeshClass, Trial, cases},
};

/// What a triangle test says: distance and weights of vertices 1 and 2.
type Tested = Option<(f64, [f64; 2])>;

/// A loop over all triangles of a mesh with a triangle test in f64.
struct Loop<T> {
    mesh: TriangleMesh,
    test: T,
}

impl<T: Fn([Vec3; 3], &Ray) -> Tested> Accelerator for Loop<T> {
    fn closest_hit(&self, ray: &Ray) -> Option<Answer> {
        let count = self.mesh.triangles().len() as u32;
        let hits = (0..count).filter_map(|id| {
            let (t, uv) = (self.test)(self.mesh.corners(id), ray)?;
            let uv = uv.map(|x| x as f32);
            let ids = [0, id];
            let t = t as f32;
            Some(Answer { t, uv, ids })
        });
        hits.min_by(|a, b| a.t.total_cmp(&b.t))
    }

    fn any_hit(&self, ray: &Ray) -> bool {
        self.closest_hit(ray).is_some()
    }
}

/// Whether the line of a ray meets a triangle exactly; where it meets its plane, in f64.
fn evaluated(corners: [Vec3; 3], ray: &Ray) -> (bool, Tested) {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let (e1, e2, from) = (b - a, c - a, origin - a);
    let (p, q) = (direction.cross(e2), from.cross(e1));
    let whole = e1.dot(p);
    let uv = [from.dot(p), direction.dot(q)].map(|x| x / whole);
    (exact::is_met(corners, ray), Some((e2.dot(q) / whole, uv)))
}

fn is_within(ray: &Ray, t: f64) -> bool {
    f64::from(ray.t_min) <= t && t <= f64::from(ray.t_max)
}

/// The exact test.
fn right(corners: [Vec3; 3], ray: &Ray) -> Tested {
    let (is_met, tested) = evaluated(corners, ray);
    tested.filter(|&(t, _)| is_met && is_within(ray, t))
}

fn looped<T>(test: T) -> impl Fn(&TriangleMesh) -> Loop<T>
where
    T: Fn([Vec3; 3], &Ray) -> Tested + Clone,
{
    move |mesh| Loop {
        mesh: mesh.clone(),
        test: test.clone(),
    }
}

/// The fault that is found, in a mesh of few triangles.
fn found<A: Accelerator>(accuracy: Accuracy, build: impl Fn(&TriangleMesh) -> A) -> Finding {
    let counterexample = Trial::new(accuracy).run(build).expect_err("a fault");
    let triangles = counterexample.mesh.triangles().len();
    let finding = counterexample.fault.finding;
    // A surface that leaks is closed around the ray.
    let most = if finding == Finding::Leak { 12 } else { 3 };
    assert!(triangles <= most, "{counterexample}");
    finding
}

#[test]
fn the_exact_loop_passes_as_either() {
    for accuracy in [Accuracy::Fast, Accuracy::Robust] {
        let outcome = Trial::new(accuracy).run(looped(right));
        assert!(outcome.is_ok(), "{accuracy:?}: {}", outcome.unwrap_err());
    }
}

#[test]
fn our_trees_pass() {
    let presets = [
        BuildParams::embree_scene_medium(),
        BuildParams::embree_scene_high(),
        BuildParams::embree_scene_compact(),
        BuildParams::embree_mesh_morton(),
    ];
    for accuracy in [Accuracy::Fast, Accuracy::Robust] {
        for (seed, mut params) in (0..).zip(presets) {
            params.accuracy = accuracy;
            let trial = Trial::new(accuracy).with_seed(seed);
            let outcome = trial.run(|mesh| Bvh::build(&[mesh], &params).expect("a tree"));
            assert!(outcome.is_ok(), "{params:?}: {}", outcome.unwrap_err());
        }
    }
}

#[test]
fn an_edge_with_the_wrong_sign_is_found() {
    let test = |corners, ray: &Ray| {
        let (_, tested) = evaluated(corners, ray);
        tested.filter(|&(t, [u, v])| u >= 0.0 && v >= 0.0 && u + v > 1.0 && is_within(ray, t))
    };
    assert_eq!(found(Accuracy::Fast, looped(test)), Finding::Wrong);
}

/// A plane through the origin of a ray that is parallel to it: zero times infinity.
#[test]
fn a_box_test_without_widening_is_found() {
    let boxed = |widening: f32| {
        looped(move |corners: [Vec3; 3], ray: &Ray| {
            let [a, b, c] = corners;
            let pad = Vec3::splat(widening * a.abs().max(b.abs()).max(c.abs()).max_element());
            let (low, high) = (a.min(b).min(c) - pad, a.max(b).max(c) + pad);
            let (mut enter, mut exit) = (ray.t_min, ray.t_max);
            for axis in 0..3 {
                let inverse = 1.0 / ray.direction[axis];
                let [p, q] = [low, high].map(|plane| (plane[axis] - ray.origin[axis]) * inverse);
                enter = enter.max(p.min(q));
                exit = exit.min(p.max(q));
            }
            // Distances are off by three roundings.
            let is_entered = enter <= exit * (1.0 + 4.0 * f32::EPSILON);
            is_entered.then(|| right(corners, ray)).flatten()
        })
    };
    assert_eq!(found(Accuracy::Robust, boxed(0.0)), Finding::Leak);
    let outcome = Trial::new(Accuracy::Robust).run(boxed(1e-5));
    assert!(outcome.is_ok(), "{}", outcome.unwrap_err());
}

#[test]
fn an_interval_that_is_not_heeded_is_found() {
    let test = |corners, ray: &Ray| {
        let (is_met, tested) = evaluated(corners, ray);
        tested.filter(|&(t, _)| is_met && t >= 0.0)
    };
    assert_eq!(found(Accuracy::Fast, looped(test)), Finding::Wrong);
    let without_t_min = |corners, ray: &Ray| right(corners, &ray.with_range(0.0, ray.t_max));
    assert_eq!(found(Accuracy::Fast, looped(without_t_min)), Finding::Wrong);
}

#[test]
fn wrong_triangles_are_found() {
    let numbered = |number: fn(u32, u32) -> u32| {
        move |mesh: &TriangleMesh| {
            let right = looped(right)(mesh);
            let count = mesh.triangles().len() as u32;
            let closest = move |ray: &Ray| {
                let mut answer = right.closest_hit(ray)?;
                answer.ids[1] = number(answer.ids[1], count);
                Some(answer)
            };
            let any = looped(self::right)(mesh);
            (closest, move |ray: &Ray| any.any_hit(ray))
        }
    };
    let next = numbered(|id, count| (id + 1) % count);
    assert_eq!(found(Accuracy::Fast, next), Finding::Wrong);
    let beyond = numbered(|_, count| count);
    assert_eq!(found(Accuracy::Fast, beyond), Finding::NoSuchTriangle);
}

#[test]
fn any_hit_that_does_not_heed_t_max_is_found() {
    let build = |mesh: &TriangleMesh| {
        let [right, endless] = [mesh, mesh].map(looped(self::right));
        let any = move |ray: &Ray| endless.any_hit(&ray.with_range(ray.t_min, f32::INFINITY));
        (move |ray: &Ray| right.closest_hit(ray), any)
    };
    assert_eq!(found(Accuracy::Fast, build), Finding::AnyHit);
}

#[test]
fn edges_that_belong_to_nobody_are_a_leak() {
    let test = |corners, ray: &Ray| {
        right(corners, ray).filter(|&(_, [u, v])| u > 1e-9 && v > 1e-9 && u + v < 1.0 - 1e-9)
    };
    assert_eq!(found(Accuracy::Robust, looped(test)), Finding::Leak);
    // Which a fast test may do.
    let outcome = Trial::new(Accuracy::Fast).run(looped(test));
    assert!(outcome.is_ok(), "{}", outcome.unwrap_err());
}

/// The farthest in place of the closest hit.
#[test]
fn a_hit_that_is_not_the_closest_is_found() {
    let build = |mesh: &TriangleMesh| {
        let [mesh, other] = [mesh.clone(), mesh.clone()];
        let last = move |ray: &Ray| {
            let hits = exact::all_hits(&[&mesh], ray);
            hits.last().map(|hit| Answer {
                t: hit.t as f32,
                uv: hit.uv.map(|x| x as f32),
                ids: [hit.geometry_id, hit.primitive_id],
            })
        };
        (last, move |ray: &Ray| looped(right)(&other).any_hit(ray))
    };
    assert_eq!(found(Accuracy::Fast, build), Finding::Wrong);
}

#[test]
fn ours_as_the_peer_finds_what_is_wrong() {
    use proptest::{
        strategy::{Strategy, ValueTree},
        test_runner::TestRunner,
    };

    let mut runner = TestRunner::deterministic();
    let (mut right_ones, mut faults) = (0, 0);
    for _ in 0..50 {
        let case = cases(MeshClass::Terrain)
            .new_tree(&mut runner)
            .expect("a case")
            .current();
        let meshes = [&case.mesh];
        let mut params = BuildParams::default();
        params.accuracy = Accuracy::Robust;
        let ours = Bvh::build(&meshes, &params).expect("a tree");
        let checker = Checker::new(&meshes, Accuracy::Robust);
        let wrong = |corners, ray: &Ray| right(corners, ray).map(|(t, uv)| (1.01 * t, uv));
        for ray in &case.rays {
            checker
                .beside(&looped(right)(&case.mesh), &ours, ray)
                .expect("right");
            let outcome = checker.beside(&looped(wrong)(&case.mesh), &ours, ray);
            if ours.closest_hit(ray).is_some_and(|hit| hit.t > 0.0) {
                faults += u32::from(outcome.is_err());
                right_ones += 1;
            }
        }
    }
    assert!(
        faults > 50 && 10 * faults > 9 * right_ones,
        "{faults} of {right_ones}"
    );
}

/// The triangle beyond the edge is a line: nothing continues the surface there, and a watertight test may miss.
#[test]
fn beyond_a_line_there_is_no_surface() {
    let vertices = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, -1.0],
        [-1.0, 0.0, 1.0],
        [0.0, 0.0, 1.0],
    ];
    let [line, beyond] = [[0, 2, 1], [1, 0, 2]];
    let mesh = TriangleMesh::new(
        vertices.map(Vec3::from_array).to_vec(),
        vec![line, beyond, [1, 0, 3]],
    );
    let mesh = mesh.expect("a mesh");
    let meshes = [&mesh];
    let checker = Checker::new(&meshes, Accuracy::Robust);
    let nothing = (|_: &Ray| None, |_: &Ray| false);
    let at_edge = Ray::new([0.5, 1.0, -0.5], [0.0, -1.0, 0.0]);
    assert_eq!(checker.beside_exact(&nothing, &at_edge), Ok(()));
    let within = Ray::new([0.25, 1.0, 0.25], [0.0, -1.0, 0.0]);
    let fault = checker
        .beside_exact(&nothing, &within)
        .expect_err("it is missed");
    assert_eq!(fault.finding, Finding::Wrong);
}
