//! Rays in lanes. Each lane follows a ray of its own at its own pace: it skips what is empty, samples
//! what is not, and when enough lanes are done, the next rays of the tile take their places. So a
//! short ray does not wait for the end of long ones beside it.
//!
//! Front-to-back compositing with early ray termination: Levoy,
//! *Efficient Ray Tracing of Volume Data*, 1990.
//!
//! Invariants: operations and their order are those of `reference`, none fused, so that every pixel
//! has its bits; a sample that is skipped has opacity 0 and would change nothing.

use raywright_bvh::simd::{GatherLanes, LaneKernel};

use super::{
    Frame, RayResult, Work,
    field::{Field, Voxel},
    lanes::{LaneStates, NO_PIXEL, Waiting},
    space::Space,
    view::SMALLEST_STEP,
};

/// So many samples are taken before the distance map is asked again, which costs as much as a
/// quarter of a sample: a few samples too many, and 8 to 16 % less time than asking each time.
const SAMPLES_PER_CHECK: u32 = 4;

/// New rays are taken when so many of eight lanes are idle.
const IDLE_EIGHTHS: u32 = 2;

/// Casts the rays of a rectangle of pixels.
pub(crate) struct TileKernel<'a, V> {
    pub(crate) frame: &'a Frame<'a>,
    pub(crate) voxels: &'a [V],
    pub(crate) columns: std::ops::Range<u32>,
    pub(crate) rows: std::ops::Range<u32>,
    /// Results row by row.
    pub(crate) results: &'a mut [RayResult],
    pub(crate) work: &'a mut Work,
}

impl<V: Voxel> LaneKernel for TileKernel<'_, V> {
    type Output = ();

    #[inline(always)]
    fn run<const N: usize, L: GatherLanes<N>>(self) {
        let mut waiting = Vec::with_capacity(self.results.len());
        self.set_up::<N, L>(&mut waiting);
        if self.frame.distances.is_some() {
            self.cast::<N, L, true>(&waiting);
        } else {
            self.cast::<N, L, false>(&waiting);
        }
    }
}

impl<V: Voxel> TileKernel<'_, V> {
    /// The rays that have samples, in small squares of pixels.
    #[inline(always)]
    fn set_up<const N: usize, L: GatherLanes<N>>(&self, waiting: &mut Vec<Waiting>) {
        const SIDE: u32 = 4;
        let (width, height) = (self.columns.len() as u32, self.rows.len() as u32);
        let lanes_down = N as u32 / SIDE;
        for y in (0..height).step_by(lanes_down as usize) {
            for x in (0..width).step_by(SIDE as usize) {
                let (mut xs, mut ys) = ([0.0; N], [0.0; N]);
                for lane in 0..N as u32 {
                    xs[lane as usize] = (self.columns.start + x + lane % SIDE) as f32 + 0.5;
                    ys[lane as usize] = (self.rows.start + y + lane / SIDE) as f32 + 0.5;
                }
                let (steps, first, last) = self.lattice::<N, L>(L::load(&xs), L::load(&ys));
                let (first, last) = (first.store(), last.store());
                let steps = [steps[0].store(), steps[1].store(), steps[2].store()];
                for lane in 0..N {
                    let (x, y) = (x + lane as u32 % SIDE, y + lane as u32 / SIDE);
                    if x < width && y < height && first[lane] <= last[lane] {
                        waiting.push(Waiting {
                            step: [steps[0][lane], steps[1][lane], steps[2][lane]],
                            first: first[lane],
                            last: last[lane],
                            pixel: y * width + x,
                        });
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn lattice<const N: usize, L: GatherLanes<N>>(&self, x: L, y: L) -> ([L; 3], L, L) {
        let view = &self.frame.view;
        let across = x.sub(L::splat(view.centre[0]));
        let down = y.sub(L::splat(view.centre[1]));
        let mut d = [across; 3];
        for (axis, d) in d.iter_mut().enumerate() {
            let forward = L::splat(view.frame[0][axis]);
            let right = L::splat(view.frame[1][axis]).mul(across);
            let below = L::splat(view.frame[2][axis]).mul(down);
            *d = forward.add(right).add(below);
        }
        let square = d[0].mul(d[0]).add(d[1].mul(d[1])).add(d[2].mul(d[2]));
        let unit = L::splat(1.0).div(square.sqrt());
        let (mut first, mut last) = (L::splat(1.0), L::splat(view.last_sample));
        let mut steps = d;
        for (axis, step) in steps.iter_mut().enumerate() {
            *step = step.mul(unit).mul(L::splat(view.scale[axis]));
            let eye = L::splat(view.eye[axis]);
            let is_still = step.abs().lt(L::splat(SMALLEST_STEP));
            let reciprocal = L::splat(1.0).div(*step);
            let a = L::splat(view.low[axis]).sub(eye).mul(reciprocal);
            let b = L::splat(view.high[axis]).sub(eye).mul(reciprocal);
            let inside = (view.low[axis]..=view.high[axis]).contains(&view.eye[axis]);
            let still_last = L::splat(if inside { view.last_sample } else { -1.0 });
            first = first.max(L::select(is_still, L::splat(1.0), a.min(b)));
            last = last.min(L::select(is_still, still_last, a.max(b)));
        }
        let zero = L::splat(0.0);
        (steps, zero.sub(zero.sub(first).floor()), last.floor())
    }

    #[inline(always)]
    fn cast<const N: usize, L: GatherLanes<N>, const SKIP: bool>(self, waiting: &[Waiting]) {
        let Frame {
            volume,
            view,
            table,
            termination,
            distances,
            ..
        } = self.frame;
        let field = Field::<N, L, V>::new(volume, view, self.voxels);
        let space = distances.map(|map| Space::<N, L>::new(map, view.border));
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let (scale, offset) = (L::splat(table.scale), L::splat(table.offset));
        let last_entry = L::splat((table.opacities.len() - 1) as f32);
        let threshold = L::splat(*termination);

        let mut lanes = LaneStates::<N>::idle();
        let mut next = 0;
        let (mut samples, mut lit_samples, mut skips) = (0_u64, 0_u64, 0_u64);
        let refill = N as u32 - N as u32 * IDLE_EIGHTHS / 8;
        loop {
            // Idle lanes take rays.
            for lane in 0..N {
                if lanes.k[lane] <= lanes.last[lane] {
                    continue;
                }
                if lanes.pixel[lane] != NO_PIXEL {
                    self.results[lanes.pixel[lane] as usize] = lanes.result(lane);
                    lanes.pixel[lane] = NO_PIXEL;
                }
                if let Some(ray) = waiting.get(next) {
                    next += 1;
                    lanes.take(lane, ray);
                }
            }
            let step = [
                L::load(&lanes.step[0]),
                L::load(&lanes.step[1]),
                L::load(&lanes.step[2]),
            ];
            let mut last = L::load(&lanes.last);
            let mut k = L::load(&lanes.k);
            let mut r = L::load(&lanes.colour[0]);
            let mut g = L::load(&lanes.colour[1]);
            let mut b = L::load(&lanes.colour[2]);
            let mut opacity = L::load(&lanes.opacity);
            let exits = space.map(|space| space.exits(&step));
            let enough = if next < waiting.len() { refill } else { 1 };
            let mut unchecked = 0;
            loop {
                let active = k.le(last);
                let count = L::bits(active).count_ones();
                if count < enough {
                    break;
                }
                let place = field.place(k, &step);
                if SKIP
                    && unchecked == 0
                    && let (Some(space), Some(exits)) = (space, exits)
                {
                    let (block, distance) = space.distance(&field.cell(&place));
                    let is_empty = zero.lt(distance) & active;
                    if L::bits(is_empty) != 0 {
                        let inside = space.samples_inside(&exits, &block, distance, &place);
                        k = L::select(is_empty, k.add(inside).add(one), k);
                        skips += u64::from(L::bits(is_empty).count_ones());
                        continue;
                    }
                    unchecked = SAMPLES_PER_CHECK;
                }
                unchecked -= u32::from(SKIP);
                samples += u64::from(count);
                let raw = field.value(&place);
                // The first operand of max() is dropped if it is NaN, and nothing is seen of it.
                let entry = raw.mul(scale).add(offset).max(zero).min(last_entry).round();
                let seen = if V::IS_WHOLE {
                    active
                } else {
                    active & raw.le(raw)
                };
                let alpha = L::gather(&table.opacities, entry, seen);
                let is_lit = zero.lt(alpha);
                if L::bits(is_lit) != 0 {
                    lit_samples += u64::from(L::bits(is_lit).count_ones());
                    let weight = one.sub(opacity).mul(alpha);
                    let [red, green, blue] = L::gather_triples(&table.colours, entry);
                    r = r.add(weight.mul(red));
                    g = g.add(weight.mul(green));
                    b = b.add(weight.mul(blue));
                    opacity = opacity.add(weight);
                    // A ray that is done ends before its next sample.
                    let is_done = threshold.lt(opacity) & active;
                    last = L::select(is_done, k, last);
                }
                k = L::select(active, k.add(one), k);
            }
            lanes.k = k.store();
            lanes.last = last.store();
            lanes.colour = [r.store(), g.store(), b.store()];
            lanes.opacity = opacity.store();
            let all_idle = (0..N).all(|lane| lanes.k[lane] > lanes.last[lane]);
            if all_idle && next == waiting.len() {
                break;
            }
        }
        for lane in 0..N {
            if lanes.pixel[lane] != NO_PIXEL {
                self.results[lanes.pixel[lane] as usize] = lanes.result(lane);
            }
        }
        self.work.rays += waiting.len() as u64;
        self.work.samples += samples;
        self.work.lit_samples += lit_samples;
        self.work.skips += skips;
    }
}
