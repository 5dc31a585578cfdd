//! Runs for tests, made by arithmetic: shaped as real ones are, the same on every machine.

use super::record::{
    ComparisonRow, FrameRecord, ProbeRecord, RunHeader, RunRecord, RunSummary, SCHEMA_VERSION,
    Spread,
};

/// A finished run that won, with `frames` frames; one in sixteen fails.
pub(crate) fn run(frames: usize) -> RunRecord {
    let mut frames: Vec<FrameRecord> = (0..frames).map(frame).collect();
    let mut lowest: Option<f64> = None;
    for frame in &mut frames {
        if let Some(cost) = frame.cost_ms
            && lowest.is_none_or(|lowest| cost < lowest)
        {
            lowest = Some(cost);
            frame.is_incumbent = true;
        }
        frame.incumbent_cost_ms = lowest;
    }
    RunRecord {
        header: header(frames.len()),
        summary: Some(RunSummary {
            rounds: 15,
            comparison: vec![
                row("tuned", "3", 38.2, 1.0),
                row("Table 1's default", "1", 50.4, 1.32),
                row("Embree's scene setting", "2", 39.7, 1.04),
            ],
            interrupted: false,
        }),
        frames,
    }
}

/// One frame of the search; its values depend on `index` alone.
pub(crate) fn frame(index: usize) -> FrameRecord {
    let quality = 1 + pick(index, 1, 3);
    let branching_factor = [2, 4, 8][pick(index, 2, 3)];
    let max_depth = 12 + pick(index, 3, 52);
    let sah_block_size = 1 << pick(index, 4, 6);
    let max_leaf_size = 1 + pick(index, 5, 32);
    let min_leaf_size = 1 + pick(index, 6, max_leaf_size);
    let traversal_cost = pick(index, 7, 1000) as f64 / 100.0;
    let intersection_cost = pick(index, 8, 1000) as f64 / 100.0;
    let config = [
        ("quality", quality.to_string()),
        ("branching_factor", branching_factor.to_string()),
        ("max_depth", max_depth.to_string()),
        ("sah_block_size", sah_block_size.to_string()),
        ("min_leaf_size", min_leaf_size.to_string()),
        ("max_leaf_size", max_leaf_size.to_string()),
        ("traversal_cost", traversal_cost.to_string()),
        ("intersection_cost", intersection_cost.to_string()),
    ]
    .map(|(name, value)| (name.to_string(), value))
    .to_vec();
    let failed = index % 16 == 11;
    let build = 6.0 + 9.0 * (quality * quality) as f64 - 0.12 * max_leaf_size as f64;
    let render = 36.0
        + 60.0 / (quality * branching_factor) as f64
        + 0.4 * max_leaf_size as f64
        + 0.3 * (traversal_cost - 4.0).abs()
        + pick(index, 9, 100) as f64 / 70.0;
    FrameRecord {
        frame: index,
        config,
        build_ms: (!failed).then_some(build),
        render_ms: (!failed).then_some(render),
        cost_ms: (!failed).then_some(render),
        failure: failed.then(|| format!("the tree is deeper than {max_depth} levels")),
        incumbent_cost_ms: None,
        is_incumbent: false,
        frame_ms: None,
        probe: None,
        reason: None,
    }
}

/// A run of probes beside an incumbent that gets better: of twelve frames one is the incumbent's
/// alone and one fails.
pub(crate) fn probed(frames: usize) -> RunRecord {
    let mut run = run(frames);
    run.header.metric = "total".to_string();
    run.header.policy = Some("probes".to_string());
    run.header.frames_per_tree = Some(16.0);
    let mut incumbent = 55.0;
    for (index, frame) in run.frames.iter_mut().enumerate() {
        let build = frame.build_ms;
        (frame.failure, frame.is_incumbent) = (None, index == 0);
        frame.reason = Some("gaussian-process: expected improvement".to_string());
        let noise = 1.0 + (pick(index, 10, 100) as f64 - 50.0) / 4000.0;
        if index == 0 || index % 12 == 7 {
            frame.reason = (index == 0).then(|| "start".to_string());
            frame.build_ms = (index == 0).then_some(24.0);
            frame.render_ms = Some(incumbent * noise);
            frame.frame_ms = Some(incumbent * noise + if index == 0 { 24.0 } else { 0.0 });
        } else if index % 12 == 11 {
            frame.failure = Some("the tree is deeper than 17 levels".to_string());
            (frame.build_ms, frame.render_ms) = (None, None);
            frame.frame_ms = Some(incumbent * noise + 3.0);
            frame.probe = Some(probe(0.0, 0, f64::NAN, "failed"));
        } else {
            let ratio = 0.93 + pick(index, 11, 100) as f64 / 160.0;
            let (share, pairs, decision) = match ratio {
                ratio if ratio < 0.97 => (0.8, 60, "accepted"),
                ratio if ratio > 1.5 => (1.0 / 32.0, 3, "given up"),
                ratio if ratio > 1.04 => (0.125, 30, "rejected"),
                _ => (0.5, 120, "undecided"),
            };
            frame.probe = Some(probe(share, pairs, ratio, decision));
            frame.render_ms = Some(incumbent * ratio);
            let rendering = incumbent * noise * (1.0 + share * (ratio - 1.0));
            frame.frame_ms = Some(build.unwrap_or(20.0) + rendering);
            if decision == "accepted" && incumbent * ratio > 36.0 {
                incumbent *= ratio;
                frame.is_incumbent = true;
            }
        }
        frame.cost_ms = frame
            .render_ms
            .map(|render| render + build.unwrap_or(20.0) / 16.0);
        frame.incumbent_cost_ms = Some(incumbent + 1.5);
    }
    run
}

/// A probe with the bounds that so many pairs have.
pub(crate) fn probe(share: f64, pairs: usize, ratio: f64, decision: &str) -> ProbeRecord {
    let deviation = if pairs < 5 {
        f64::INFINITY
    } else {
        1.645 * 0.2 / (pairs as f64).sqrt()
    };
    ProbeRecord {
        share,
        pairs,
        ratio,
        lower: ratio * (-deviation).exp(),
        upper: ratio * deviation.exp(),
        decision: decision.to_string(),
    }
}

fn header(frames_planned: usize) -> RunHeader {
    let indicators = (0..17)
        .map(|index| (format!("indicator_{index}"), 0.37 * 10f64.powi(index - 5)))
        .collect();
    RunHeader {
        schema_version: SCHEMA_VERSION,
        version: "0.1.0".to_string(),
        scene: "sponza".to_string(),
        triangles: 262_267,
        width: 1280,
        height: 720,
        path_length: 3,
        metric: "render".to_string(),
        search: "hybrid".to_string(),
        seed: 42,
        threads: 8,
        instruction_set: "avx512".to_string(),
        frames_planned,
        indicators,
        policy: None,
        frames_per_tree: None,
    }
}

/// A row of the comparison that has `ratio` × the cost of the tuned row.
pub(crate) fn row(name: &str, quality: &str, cost: f64, ratio: f64) -> ComparisonRow {
    let mut config = frame(0).config;
    config[0].1 = quality.to_string();
    ComparisonRow {
        name: name.to_string(),
        config,
        build_ms: spread(24.0, 0.08),
        render_ms: spread(cost, 0.015),
        cost_ms: spread(cost, 0.015),
        cost_ratio_to_tuned: spread(ratio, 0.008),
    }
}

/// Quartiles `relative` below and above the median.
pub(crate) fn spread(median: f64, relative: f64) -> Spread {
    Spread {
        median,
        lower: median * (1.0 - relative),
        upper: median * (1.0 + relative),
    }
}

/// A number below `bound`, scattered over `index` and `lane` (the mixing of SplitMix64).
fn pick(index: usize, lane: u64, bound: usize) -> usize {
    let mut state = (index as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ (lane << 32);
    state = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    state = (state ^ (state >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((state ^ (state >> 31)) % bound as u64) as usize
}
