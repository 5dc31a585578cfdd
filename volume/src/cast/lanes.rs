//! The rays that wait for lanes and those that are in them, between two loops.
//!
//! Invariant: a ray leaves its lane when it is opaque enough or at the end of its last interval, and
//! takes all its intervals in the same lane.

use raywright_bvh::simd::GatherLanes;

use super::{RayResult, RayWork, view::RayLattice};

/// A ray that waits for a lane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Waiting {
    pub(crate) samples: RayLattice,
    pub(crate) pixel: u32,
}

/// The rays of a tile.
#[derive(Clone, Debug, Default)]
pub(crate) struct Queue {
    pub(crate) rays: Vec<Waiting>,
    /// Where rays have parts, the intervals of each: from one to before another.
    pub(crate) parts: Vec<[u32; 2]>,
    /// Numbers of first and last samples.
    pub(crate) intervals: Vec<[f32; 2]>,
    next: usize,
}

/// New rays are taken when so many of eight lanes are idle.
const IDLE_EIGHTHS: u32 = 3;

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
    pub(crate) samples: [f32; N],
    pub(crate) skips: [f32; N],
    /// Number of the last sample of the ray.
    ray_last: [f32; N],
    /// The intervals that are left.
    intervals: [[u32; 2]; N],
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
            samples: [0.0; N],
            skips: [0.0; N],
            ray_last: [-1.0; N],
            intervals: [[0; 2]; N],
            pixel: [NO_PIXEL; N],
        }
    }

    /// Idle lanes go on with the next interval of their rays, where rays have `PARTS`, or give their
    /// results, with their work if that is to `COUNT`, and take the next rays. Returns how many lanes
    /// must stay busy until the next time; `None` if all is done.
    #[inline(always)]
    pub(crate) fn refill<const PARTS: bool, const COUNT: bool>(
        &mut self,
        queue: &mut Queue,
        termination: f32,
        results: &mut [RayResult],
    ) -> Option<u32> {
        let (mut busy, mut is_more) = (0, false);
        for lane in 0..N {
            if self.k[lane] <= self.last[lane] {
                busy += 1;
                is_more |= PARTS && self.intervals[lane][0] < self.intervals[lane][1];
                continue;
            }
            if self.pixel[lane] != NO_PIXEL {
                let mut last = self.last[lane];
                if PARTS && self.opacity[lane] <= termination {
                    if self.take_interval(lane, queue) {
                        busy += 1;
                        continue;
                    }
                    last = self.ray_last[lane];
                }
                results[self.pixel[lane] as usize] = self.result::<COUNT>(lane, last);
                self.pixel[lane] = NO_PIXEL;
            }
            if let Some(ray) = queue.rays.get(queue.next) {
                self.take(lane, ray);
                if COUNT {
                    (self.samples[lane], self.skips[lane]) = (0.0, 0.0);
                }
                if PARTS {
                    self.ray_last[lane] = ray.samples.last;
                    let part = queue.parts[queue.next];
                    self.intervals[lane] = part;
                    self.skips[lane] = (part[1] - part[0]) as f32;
                    self.take_interval(lane, queue);
                }
                queue.next += 1;
                busy += 1;
            }
        }
        is_more |= queue.next < queue.rays.len();
        let idle = if is_more {
            N as u32 * IDLE_EIGHTHS / 8
        } else {
            busy
        };
        (busy > 0).then(|| busy.saturating_sub(idle).max(1))
    }

    /// Where sample 0 of each ray lies, in voxels.
    #[inline(always)]
    pub(crate) fn origins<L: GatherLanes<N>>(&self) -> [L; 3] {
        let [x, y, z] = &self.origin;
        [L::load(x), L::load(y), L::load(z)]
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

    /// Goes on with the next interval of a ray, if there is one.
    #[inline(always)]
    fn take_interval(&mut self, lane: usize, queue: &Queue) -> bool {
        let [next, end] = self.intervals[lane];
        if next == end {
            return false;
        }
        [self.k[lane], self.last[lane]] = queue.intervals[next as usize];
        self.intervals[lane][0] += 1;
        self.front[lane] = f32::NAN;
        true
    }

    #[inline(always)]
    fn result<const COUNT: bool>(&self, lane: usize, last: f32) -> RayResult {
        RayResult {
            colour: [
                self.colour[0][lane],
                self.colour[1][lane],
                self.colour[2][lane],
            ],
            opacity: self.opacity[lane],
            end: last + 1.0 + self.number[lane],
            work: if COUNT {
                RayWork {
                    samples: self.samples[lane] as u32,
                    skips: self.skips[lane] as u32,
                }
            } else {
                RayWork::default()
            },
        }
    }
}
