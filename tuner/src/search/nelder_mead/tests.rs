//! Nelder–Mead move by move, on a simplex whose points can be computed by hand.

use super::*;

/// A search whose hypercube is replaced by the given vertices.
fn with_vertices(vertices: &[([f64; 2], f64)]) -> LatinHypercubeNelderMead {
    let mut search = LatinHypercubeNelderMead::new();
    search.begin(&[0.0, 0.0], 1);
    search.hypercube.clear();
    for (point, mean) in vertices {
        search.absorb(point, estimate(*mean));
    }
    search
}

fn estimate(mean: f64) -> Estimate {
    Estimate {
        mean,
        samples: 1,
        noise: 0.0,
    }
}

/// Centroid of the two best is (0.5, 0.25), the worst is (0.25, 0.5).
fn simplex() -> LatinHypercubeNelderMead {
    with_vertices(&[([0.25, 0.25], 1.0), ([0.75, 0.25], 2.0), ([0.25, 0.5], 3.0)])
}

/// Tells costs to the proposals in turn and returns steps and points, with the one after them.
fn walk(search: &mut LatinHypercubeNelderMead, costs: &[f64]) -> Vec<(&'static str, Vec<f64>)> {
    let mut seen = Vec::new();
    for (ticket, cost) in (0..).zip(costs) {
        let proposal = search.propose(ticket);
        search.observe(Some(ticket), &proposal.point, estimate(*cost));
        seen.push((proposal.step, proposal.point));
    }
    let last = search.propose(u64::MAX);
    search.withdraw(u64::MAX);
    seen.push((last.step, last.point));
    seen
}

fn means(search: &LatinHypercubeNelderMead) -> Vec<f64> {
    search.vertices.iter().map(|vertex| vertex.mean).collect()
}

#[test]
fn a_middling_reflection_is_accepted() {
    let mut search = simplex();
    let steps = walk(&mut search, &[1.5]);
    assert_eq!(steps[0], ("reflect", vec![0.75, 0.0]));
    assert_eq!(steps[1].0, "reflect");
    assert_eq!(means(&search), [1.0, 1.5, 2.0]);
}

#[test]
fn a_best_reflection_is_expanded_and_the_better_one_kept() {
    let mut search = simplex();
    let steps = walk(&mut search, &[0.5, 0.25]);
    // (1, -0.25), projected.
    assert_eq!(steps[1], ("expand", vec![1.0, 0.0]));
    assert_eq!(means(&search), [0.25, 1.0, 2.0]);
    let mut search = simplex();
    walk(&mut search, &[0.5, 0.75]);
    assert_eq!(means(&search), [0.5, 1.0, 2.0]);
}

#[test]
fn contractions_go_to_the_better_side() {
    let mut search = simplex();
    let steps = walk(&mut search, &[2.5, 2.25]);
    assert_eq!(steps[1], ("contract-outside", vec![0.625, 0.125]));
    assert_eq!(means(&search), [1.0, 2.0, 2.25]);
    let mut search = simplex();
    let steps = walk(&mut search, &[4.0, 2.25]);
    assert_eq!(steps[1], ("contract-inside", vec![0.375, 0.375]));
    assert_eq!(means(&search), [1.0, 2.0, 2.25]);
}

#[test]
fn a_failed_contraction_is_followed_by_a_draw_not_a_shrink() {
    let mut search = simplex();
    let steps = walk(&mut search, &[4.0, 3.5, 2.75]);
    assert!(steps[2].0.starts_with("draw-"), "{steps:?}");
    assert_eq!(means(&search), [1.0, 2.0, 2.75]);
    let mut search = simplex();
    let steps = walk(&mut search, &[4.0, 3.5, 5.0]);
    assert_eq!(steps[3].0, "reflect");
    assert_eq!(means(&search), [1.0, 2.0, 3.0]);
}

#[test]
fn global_draws_become_rare() {
    let share = |iteration| {
        let mut search = simplex();
        search.iteration = iteration;
        let draws = (0..4000).filter(|_| matches!(search.draw().step, Step::Global));
        draws.count() as f64 / 4000.0
    };
    // Standard deviation of a share is at most 0.008.
    for (iteration, expected) in [(0, 0.5), (20, 0.3), (1_000_000, 0.1)] {
        let share = share(iteration);
        assert!(
            (share - expected).abs() < 0.04,
            "iteration {iteration}: {share}"
        );
    }
}

#[test]
fn good_points_are_confirmed_and_bad_ones_are_not() {
    let mut search = simplex();
    search.iteration = 40;
    for vertex in &mut search.vertices[1..] {
        vertex.samples = 2;
    }
    let steps = walk(&mut search, &[]);
    assert_eq!(steps[0], ("resample", vec![0.25, 0.25]));
    search.vertices[0].samples = 2;
    search.current = None;
    // Refused on one measurement.
    assert_eq!(walk(&mut search, &[4.0])[1].0, "contract-inside");
    search.current = None;
    // Asked for once more before it is accepted.
    let again = walk(&mut search, &[1.5]);
    assert_eq!(again[0], again[1]);
    assert_eq!(means(&search), [1.0, 2.0, 3.0]);
}

#[test]
fn of_equal_costs_the_older_is_better() {
    let mut search = with_vertices(&[([0.1, 0.2], 2.0), ([0.8, 0.3], 2.0), ([0.4, 0.9], 1.0)]);
    assert_eq!(search.vertices[1].point, [0.1, 0.2]);
    search.absorb(&[0.5, 0.5], estimate(2.0));
    assert_eq!(search.vertices[2].point, [0.8, 0.3]);
}

#[test]
fn a_collapsed_simplex_begins_anew_with_its_best_vertex() {
    let collapsed = [
        [
            ([0.5, 0.5], 1.0),
            ([0.5001, 0.5], 2.0),
            ([0.5, 0.5001], 3.0),
        ],
        [([0.5, 0.5], 1.0), ([0.1, 0.5], 1.0), ([0.5, 0.9], 1.0)],
    ];
    for vertices in collapsed {
        let mut search = with_vertices(&vertices);
        assert_eq!(search.propose(0).step, "latin-hypercube");
        assert_eq!(search.propose(1).step, "latin-hypercube");
        assert_eq!(search.propose(2).step, "explore");
        assert_eq!(search.vertices.len(), 1);
        assert_eq!(search.vertices[0].point, [0.5, 0.5]);
    }
}

#[test]
fn failures_are_not_kept_as_the_best() {
    let mut search = with_vertices(&[
        ([0.1, 0.5], f64::INFINITY),
        ([0.9, 0.5], f64::INFINITY),
        ([0.5, 0.1], f64::INFINITY),
    ]);
    for ticket in 0..3 {
        assert_eq!(search.propose(ticket).step, "latin-hypercube");
    }
    assert!(search.vertices.is_empty());
}

#[test]
fn random_points_bridge_a_pending_move_and_may_enter() {
    let mut search = simplex();
    assert_eq!(search.propose(0).step, "reflect");
    let aside = search.propose(1);
    assert_eq!(aside.step, "explore");
    search.observe(Some(1), &aside.point, estimate(0.5));
    assert_eq!(means(&search), [0.5, 1.0, 2.0]);
    // The move is still the search's next decision.
    assert_eq!(search.propose(2).step, "explore");
}

#[test]
fn starts_join_the_first_simplex() {
    let mut search = LatinHypercubeNelderMead::new();
    search.begin(&[0.0, 0.0], 1);
    search.observe(None, &[0.3, 0.3], estimate(0.1));
    let costs = [5.0, 6.0, 7.0];
    for (ticket, cost) in (0..).zip(costs) {
        let point = search.propose(ticket).point;
        search.observe(Some(ticket), &point, estimate(cost));
    }
    assert_eq!(means(&search), [0.1, 5.0, 6.0]);
    assert_eq!(search.propose(3).step, "reflect");
}
