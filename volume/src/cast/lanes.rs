//! The rays that wait for lanes and those that are in them, between two loops.

use super::RayResult;

/// A ray that waits for a lane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Waiting {
    pub(crate) step: [f32; 3],
    pub(crate) first: f32,
    pub(crate) last: f32,
    pub(crate) pixel: u32,
}

const NO_PIXEL: u32 = u32::MAX;

/// The rays in the lanes between two loops.
pub(crate) struct LaneStates<const N: usize> {
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

    /// Whether no lane has a ray.
    #[inline(always)]
    pub(crate) fn are_idle(&self) -> bool {
        self.pixel.iter().all(|&pixel| pixel == NO_PIXEL)
    }

    #[inline(always)]
    fn take(&mut self, lane: usize, ray: &Waiting) {
        for axis in 0..3 {
            self.step[axis][lane] = ray.step[axis];
            self.colour[axis][lane] = 0.0;
        }
        self.opacity[lane] = 0.0;
        self.front[lane] = f32::NAN;
        self.k[lane] = ray.first;
        self.last[lane] = ray.last;
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
            end: self.last[lane] + 1.0,
        }
    }
}
