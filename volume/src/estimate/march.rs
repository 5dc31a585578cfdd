//! A ray of an estimate, from block to block.
//!
//! Amanatides, Woo, *A Fast Voxel Traversal Algorithm for Ray Tracing*, 1987, each border computed anew. A piece
//! of the ray is what lies in one block; where the blocks of a caster are known and not all of them show
//! something, a piece has parts, each taken for what its middle is in.
//!
//! Invariant: a function of view, preparation, place in the picture, and the numbers of frame and square.

use super::{
    BLOCK_SHIFT, EstimatedRay, Medium, PreparedEstimate, small_blocks::SmallBlocks,
    tausworthe::HybridTausworthe,
};
use crate::cast::{
    reference::lattice,
    view::{RayLattice, SMALLEST_STEP, View},
};

/// Distance between draws, in lengths of a voxel.
const COARSE_STEP: f32 = 8.0;

/// Parts of a piece.
const PARTS: usize = 4;

/// What the rays of an estimate read.
pub(super) struct March<'a> {
    pub(super) view: View,
    pub(super) prepared: &'a PreparedEstimate<'a>,
    pub(super) step: f32,
    pub(super) termination: f32,
    /// What a ray has to pass to be as opaque as that.
    pub(super) most_depth: f32,
}

/// A part of a ray in one block, in numbers of samples.
#[derive(Clone, Copy)]
struct Piece {
    start: f32,
    end: f32,
    block: usize,
}

/// What is known of a ray on its way, in numbers of samples.
struct Passed {
    /// What the ray went through, as the integral of extinction.
    depth: f32,
    /// Where it becomes opaque.
    end: f32,
    lit: f32,
    seen: f32,
    /// The end of what can be seen so far.
    empty_from: f32,
    jumps: f32,
}

impl March<'_> {
    /// The ray through a point of the picture, and the steps that it took. Its jumps are counted so many times,
    /// if at all.
    pub(super) fn ray(
        &self,
        [x, y]: [f32; 2],
        [frame, tile]: [u32; 2],
        jumps_count: Option<f32>,
    ) -> (EstimatedRay, u64) {
        let samples = lattice(&self.view, x, y, 0.0);
        let small = self.prepared.small.as_ref();
        let jumping = small.zip(jumps_count);
        let mut steps = 0;
        let (mut front, mut back) = (f32::INFINITY, f32::NEG_INFINITY);
        let mut passed = Passed {
            depth: 0.0,
            end: f32::INFINITY,
            lit: 0.0,
            seen: 0.0,
            empty_from: samples.first,
            jumps: 0.0,
        };
        self.pieces(&samples, |piece| {
            steps += 1;
            if !self.prepared.lit[piece.block] {
                return;
            }
            front = front.min(piece.start);
            back = piece.end;
            if passed.end < f32::INFINITY {
                return;
            }
            let (share, mask) = small.map_or((1.0, u64::MAX), |small| small.of(piece.block));
            let mut pass = |part: Piece| {
                // Nobody jumps over less than a sample.
                if let Some((small, _)) = jumping
                    && part.start >= passed.empty_from + 1.0
                {
                    passed.jumps += small.jumps(&samples, passed.empty_from, part.start);
                }
                self.pass(&mut passed, part, share);
            };
            if mask == u64::MAX {
                pass(piece);
                return;
            }
            let length = (piece.end - piece.start) / PARTS as f32;
            for index in 0..PARTS {
                let start = piece.start + index as f32 * length;
                let middle = start + 0.5 * length;
                let place: [f32; 3] =
                    std::array::from_fn(|axis| middle * samples.step[axis] + samples.origin[axis]);
                if mask & SmallBlocks::bit(place) != 0 {
                    let end = start + length;
                    pass(Piece {
                        start,
                        end,
                        ..piece
                    });
                }
            }
        });
        if let Some((small, _)) = jumping
            && passed.end == f32::INFINITY
        {
            passed.jumps += small.jumps(&samples, passed.empty_from, samples.last);
        }
        let mut ray = EstimatedRay {
            jumps: match (small, jumps_count) {
                (Some(_), count) => passed.jumps * count.unwrap_or(0.0),
                (None, _) => steps as f32,
            },
            ..EstimatedRay::default()
        };
        if front >= back {
            return (ray, steps);
        }
        if let Medium::Drawn(opacities) = &self.prepared.medium {
            let mut numbers = HybridTausworthe::new(frame, tile);
            // Samples from draw to draw.
            let stride = COARSE_STEP / self.step;
            let mut opacity = 0.0;
            let mut k = front;
            while k < back {
                let next = (k + stride).min(back);
                let block = self.block_at(&samples, (k + next) * 0.5);
                let drawn = opacities.draw(block, numbers.unit());
                steps += 1;
                opacity += (1.0 - opacity) * (1.0 - (1.0 - drawn).powf((next - k) * self.step));
                k = next;
                if opacity > self.termination {
                    passed.end = k;
                    // As much of what is left as of the whole.
                    let share = (k - front) / (back - front);
                    passed.lit *= share;
                    passed.seen *= share;
                    break;
                }
            }
        }
        ray.front = front + samples.number;
        ray.back = back + samples.number;
        ray.end = passed.end.min(back) + samples.number;
        (ray.lit, ray.seen) = (passed.lit, passed.seen);
        (ray, steps)
    }

    /// Goes through a part of a ray in which something can be seen, as in a `share` of its block.
    fn pass(&self, passed: &mut Passed, part: Piece, share: f32) {
        passed.empty_from = part.end;
        if let Medium::Mean(extinctions) = &self.prepared.medium {
            let most = self.most_depth;
            // All that there is in the block is in that share.
            let per_sample = extinctions[part.block] / share * self.step;
            let more = per_sample * (part.end - part.start);
            if passed.depth <= most && passed.depth + more > most {
                // The sample that passes it is half a step behind, on average.
                passed.end = part.start + (most - passed.depth) / per_sample + 0.5;
            }
            passed.depth += more;
        }
        let samples = (part.end.min(passed.end) - part.start).max(0.0);
        passed.lit += samples;
        passed.seen += samples * (self.prepared.seen_shares[part.block] / share).min(1.0);
    }

    /// The block along one axis at a sample.
    fn block_along(&self, axis: usize, samples: &RayLattice, k: f32) -> usize {
        let place = (k * samples.step[axis] + samples.origin[axis]).max(0.0);
        (place as usize >> BLOCK_SHIFT).min(self.prepared.dims[axis] - 1)
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        let [across, down, _] = self.prepared.dims;
        (z * down + y) * across + x
    }

    fn block_at(&self, samples: &RayLattice, k: f32) -> usize {
        self.index(std::array::from_fn(|axis| {
            self.block_along(axis, samples, k)
        }))
    }

    /// Tells the parts of a ray in the blocks that it passes, in order.
    fn pieces(&self, samples: &RayLattice, mut tell: impl FnMut(Piece)) {
        let RayLattice {
            origin,
            step,
            first,
            last,
            ..
        } = *samples;
        if first > last {
            return;
        }
        let per_step = step.map(|step| 1.0 / step);
        let mut block = [0, 1, 2].map(|axis| self.block_along(axis, samples, first));
        // The number of the sample at which the ray leaves its block along an axis.
        let exit = |axis: usize, block: usize| {
            let inner = if step[axis] < 0.0 { block } else { block + 1 };
            let is_last = inner == 0 || inner == self.prepared.dims[axis];
            if is_last || step[axis].abs() < SMALLEST_STEP {
                f32::INFINITY
            } else {
                ((inner << BLOCK_SHIFT) as f32 - origin[axis]) * per_step[axis]
            }
        };
        let mut exits = [0, 1, 2].map(|axis| exit(axis, block[axis]));
        let mut start = first;
        loop {
            let next = exits[0].min(exits[1]).min(exits[2]);
            let end = next.min(last + 1.0);
            if end > start {
                tell(Piece {
                    start,
                    end,
                    block: self.index(block),
                });
                start = end;
            }
            if next > last {
                return;
            }
            for axis in 0..3 {
                if exits[axis] <= next {
                    // Not beyond the border: there is no exit.
                    block[axis] = if step[axis] < 0.0 {
                        block[axis] - 1
                    } else {
                        block[axis] + 1
                    };
                    exits[axis] = exit(axis, block[axis]);
                }
            }
        }
    }
}
