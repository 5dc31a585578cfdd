//! The rays that wait for lanes and those that are in them, between two loops.

use raywright_bvh::simd::GatherLanes;

use super::{RayResult, view::RayLattice};

/// A ray that waits for a lane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Waiting {
    pub(crate) samples: RayLattice,
    pub(crate) pixel: u32,
}

const NO_PIXEL: u32 = u32::MAX;

/// The rays in the lanes between two loops.
pub(crate) struct LaneStates<const N: usize> {
    origin: [[f32; N]; 3],
    number: [f32; N],
    pub(crate) step: [[f32; N]; 3],
    pub(crate) k: [f32; N],
    pub(crate) last: [f32; N],
    pub(crate) colour: [[f32; N]; 3],
    pub(crate) opacity: [f32; N],
    /// The value of the sample before, NaN if there is none.
    pub(crate) front: [f32; N],
    pixel: [u32; N],
}

impl<const N: usize> LaneStates<N> {
    #[inline(always)]
    pub(crate) fn idle() -> Self {
        Self {
            origin: [[0.0; N]; 3],
            number: [0.0; N],
            step: [[1.0; N]; 3],
            k: [0.0; N],
            last: [-1.0; N],
            colour: [[0.0; N]; 3],
            opacity: [0.0; N],
            front: [f32::NAN; N],
            pixel: [NO_PIXEL; N],
        }
    }

    /// Idle lanes give their results and take rays from `next` on.
    #[inline(always)]
    pub(crate) fn refill(
        &mut self,
        waiting: &[Waiting],
        next: &mut usize,
        results: &mut [RayResult],
    ) {
        for lane in 0..N {
            if self.k[lane] <= self.last[lane] {
                continue;
            }
            if self.pixel[lane] != NO_PIXEL {
                results[self.pixel[lane] as usize] = self.result(lane);
                self.pixel[lane] = NO_PIXEL;
            }
            if let Some(ray) = waiting.get(*next) {
                *next += 1;
                self.take(lane, ray);
            }
        }
    }

    /// Where sample 0 of each ray lies, in voxels.
    #[inline(always)]
    pub(crate) fn origins<L: GatherLanes<N>>(&self) -> [L; 3] {
        let [x, y, z] = &self.origin;
        [L::load(x), L::load(y), L::load(z)]
    }

    /// Whether no lane has a ray.
    #[inline(always)]
    pub(crate) fn are_idle(&self) -> bool {
        self.pixel.iter().all(|&pixel| pixel == NO_PIXEL)
    }

    #[inline(always)]
    fn take(&mut self, lane: usize, ray: &Waiting) {
        let samples = &ray.samples;
        for axis in 0..3 {
            self.origin[axis][lane] = samples.origin[axis];
            self.step[axis][lane] = samples.step[axis];
            self.colour[axis][lane] = 0.0;
        }
        self.opacity[lane] = 0.0;
        self.front[lane] = f32::NAN;
        self.number[lane] = samples.number;
        self.k[lane] = samples.first;
        self.last[lane] = samples.last;
        self.pixel[lane] = ray.pixel;
    }

    #[inline(always)]
    fn result(&self, lane: usize) -> RayResult {
        RayResult {
            colour: [
                self.colour[0][lane],
                self.colour[1][lane],
                self.colour[2][lane],
            ],
            opacity: self.opacity[lane],
            end: self.last[lane] + 1.0 + self.number[lane],
        }
    }
}
