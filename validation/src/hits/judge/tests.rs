//! Cases of the judge, those of real scenes among them.

use raywright_bvh::{BuildParams, Bvh};

use super::*;

/// Triangles at a vertex, seen at it exactly: what a miss of the first is.
fn class_of_a_miss(triangles: &[[Vec3; 3]], ray: &Ray) -> Class {
    let count = triangles.len() as u32;
    let indices = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let mesh = TriangleMesh::new(triangles.concat(), indices).unwrap();
    let first = Answer {
        t: 1.0,
        uv: [0.0; 2],
        ids: [0, 0],
    };
    Judge::new(&[&mesh], Accuracy::Robust).class(ray, None, Some(first))
}

/// A corner of a thing in sponza, at which front sides and back sides meet, all on one side of the ray.
#[test]
fn a_folded_fan_may_be_passed() {
    let at = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    let vertex = at(70.1934, 66.676, -27.6673);
    let behind = at(70.1934, 66.676, -28.3549);
    let left = at(70.0, 66.5982, -27.6673);
    let right = at(70.3211, 66.8583, -27.6673);
    let (top, middle) = (
        at(69.5978, 66.8285, -27.6673),
        at(69.6948, 66.676, -27.6673),
    );
    let fan = [
        [vertex, top, middle],
        [left, vertex, middle],
        [vertex, right, top],
        [behind, right, vertex],
        [left, behind, vertex],
    ];
    let ray = Ray::new(
        [129.56046, 51.22264, -54.941795],
        [-59.367058, 15.4533615, 27.274496],
    );
    assert_eq!(class_of_a_miss(&fan, &ray), Class::SilhouetteTie);
    // The engine does pass it.
    let indices = (0..5).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let mesh = TriangleMesh::new(fan.concat(), indices).unwrap();
    let mut params = BuildParams::default();
    params.accuracy = Accuracy::Robust;
    assert!(!Bvh::build(&[&mesh], &params).unwrap().any_hit(&ray));
    // The front alone ends there.
    assert_eq!(class_of_a_miss(&fan[..3], &ray), Class::SilhouetteTie);
}

/// `n` triangles around the origin, at heights of their own.
fn fan(n: u32) -> Vec<[Vec3; 3]> {
    let around = |i: u32| {
        let i = i % n;
        let turn = std::f32::consts::TAU * (i as f32 / n as f32);
        Vec3::new(turn.cos(), turn.sin(), 0.3 * (i % 2) as f32)
    };
    let triangles = (0..n).map(|i| [Vec3::ZERO, around(i), around(i + 1)]);
    triangles.collect()
}

#[test]
fn a_fan_around_the_ray_may_not_be_passed() {
    let ray = Ray::new([0.3, 0.2, 1.7], [-0.3, -0.2, -1.7]);
    for n in [3, 4, 5, 8, 100] {
        let closed = fan(n);
        assert_eq!(class_of_a_miss(&closed, &ray), Class::Leak, "{n}");
        // Twice the same, and with a wall on an edge, it is as closed.
        let twice = [&closed[..], &closed[..]].concat();
        assert_eq!(class_of_a_miss(&twice, &ray), Class::Leak, "{n}");
        let mut walled = closed.clone();
        walled.push([Vec3::ZERO, closed[0][1], Vec3::Z]);
        assert_eq!(class_of_a_miss(&walled, &ray), Class::Leak, "{n}");
        // Without a triangle it is open; so it is where a vertex is not welded.
        assert_eq!(
            class_of_a_miss(&closed[1..], &ray),
            Class::SilhouetteTie,
            "{n}"
        );
        let mut cracked = closed.clone();
        cracked[1][0].z = f32::MIN_POSITIVE;
        assert_eq!(class_of_a_miss(&cracked, &ray), Class::SilhouetteTie, "{n}");
    }
}

#[test]
fn a_miss_of_what_is_surely_hit_is_a_bug() {
    let ray = Ray::new([0.4, 0.3, 1.7], [0.0, 0.0, -1.7]);
    assert_eq!(class_of_a_miss(&fan(4), &ray), Class::Bug);
}

/// Walls at distances 1 and 2, and a sliver before them that the ray touches.
#[test]
fn what_is_missed_is_not_hidden_by_what_else_is_met() {
    let wall = |z: f32| [[-4.0, -4.0], [4.0, -4.0], [0.0, 8.0]].map(|[x, y]| Vec3::new(x, y, z));
    let sliver = [[0.0, 0.0], [1.0, 0.0], [1.0, 1e-38]].map(|[x, y]| Vec3::new(x, y, -0.5));
    let triangles = [wall(1.0), wall(2.0), sliver].concat();
    let mesh = TriangleMesh::new(triangles, vec![[0, 1, 2], [3, 4, 5], [6, 7, 8]]).unwrap();
    let meshes = [&mesh];
    let judge = Judge::new(&meshes, Accuracy::Robust);
    let ray = Ray::new([0.5, 0.0, -1.0], [0.0, 0.0, 1.0]);
    let hits = crate::exact::all_hits(&meshes, &ray);
    assert_eq!(hits.len(), 3);
    let answer = |primitive: u32, t: f32| Answer {
        t,
        uv: [0.395_833_34, 0.333_333_34],
        ids: [0, primitive],
    };
    let class = |ours: Option<Answer>| judge.class_beside_all(&ray, ours, &hits);
    assert_eq!(class(None), Class::Bug);
    assert_eq!(class(Some(answer(1, 3.0))), Class::Bug);
    assert!(class(Some(answer(0, 2.0))) <= Class::IllConditioned);
    // The right triangle, at no distance of its.
    assert_eq!(class(Some(answer(0, 2.001))), Class::Bug);
}

/// Two leaves, much as in the fireplace room: the other's triangle is seen so nearly edge-on that ours may find it as
/// far away as the next, where the other may not. The last triangle is there for the size of the room.
#[test]
fn what_ours_may_find_behind_its_hit_is_not_missed() {
    let at = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    let vertices = vec![
        at(1.252_509, 0.170_466_21, 0.413_876_74),
        at(1.252_509, 0.170_466_21, -0.000_428_262_22),
        at(1.252_969, 0.169_953_21, -0.000_428_262_22),
        at(1.25239, 0.170637, 0.413907),
        at(1.25239, 0.170637, 0.0),
        at(1.25279, 0.170066, 0.0),
        at(5.1, 5.1, 5.1),
    ];
    let mesh = TriangleMesh::new(vertices, vec![[0, 1, 2], [3, 4, 5], [6, 6, 6]]).unwrap();
    let meshes = [&mesh];
    let judge = Judge::new(&meshes, Accuracy::Robust);
    let ray = Ray::new(
        [1.1930043, 0.25524056, 0.14548281],
        [0.43218985, -0.61571866, 0.658865],
    );
    let answer = |t: f32, uv: [f32; 2], primitive: u32| {
        Some(Answer {
            t,
            uv,
            ids: [0, primitive],
        })
    };
    let ours = answer(0.137_689_37, [0.421_892_54, 0.006_958_74], 0);
    let other = answer(0.137_635_3, [0.182_385_96, 0.247_036_86], 1);
    assert_eq!(judge.class(&ray, ours, other), Class::CoplanarTie);
    // Without a hit near it, it is missed.
    assert_eq!(judge.class(&ray, None, other), Class::Bug);
}
