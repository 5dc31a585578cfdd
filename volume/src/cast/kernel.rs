//! Rays in lanes. Each lane follows a ray of its own at its own pace: it skips what is empty, samples
//! what is not, and when enough lanes are done, the next rays of the tile take their places. So a
//! short ray does not wait for the end of long ones beside it.
//!
//! Empty space: Zuiderveld, Koning, Viergever, *Acceleration of Ray-Casting Using 3-D Distance
//! Transforms*, 1992, on blocks. Front-to-back compositing with early ray termination: Levoy,
//! *Efficient Ray Tracing of Volume Data*, 1990.
//!
//! Invariants: operations and their order are those of `reference`, none fused, so that every pixel
//! has its bits; a sample that is skipped has opacity 0 and would change nothing.

use raywright_bvh::simd::{GatherLanes, LaneKernel, splat_all};

use super::{Frame, RayResult, Work, view::SMALLEST_STEP};
use crate::table::ENTRY;

/// So many samples are taken before the distance map is asked again, which costs as much as a
/// quarter of a sample: a few samples too many, and 8 to 16 % less time than asking each time.
const SAMPLES_PER_CHECK: u32 = 4;

/// New rays are taken when so many of eight lanes are idle.
const IDLE_EIGHTHS: u32 = 2;

/// Voxels of one type.
pub(crate) trait Voxel: Copy + Sync {
    /// The values at places and behind them.
    fn pairs<const N: usize, L: GatherLanes<N>>(voxels: &[Self], index: L::Int) -> [L; 2];
}

macro_rules! voxel {
    ($type:ty, $gather:ident) => {
        impl Voxel for $type {
            #[inline(always)]
            fn pairs<const N: usize, L: GatherLanes<N>>(voxels: &[Self], index: L::Int) -> [L; 2] {
                L::$gather(voxels, index)
            }
        }
    };
}

voxel!(u8, gather_pairs_u8);
voxel!(u16, gather_pairs_u16);
voxel!(f32, gather_pairs_f32);

/// A ray that waits for a lane.
#[derive(Clone, Copy, Debug)]
struct Waiting {
    step: [f32; 3],
    first: f32,
    last: f32,
    pixel: u32,
}

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
            view,
            table,
            termination,
            ..
        } = self.frame;
        let [eye_x, eye_y, eye_z] = splat_all::<N, L>(view.eye);
        let zero = L::splat(0.0);
        let one = L::splat(1.0);
        let top = splat_all::<N, L>(view.last_voxel);
        let dims = self.frame.volume.dims();
        // A single layer has no second one to interpolate with; it lies at distance 0 of itself.
        let stride = |axis: usize, stride: usize| if dims[axis] > 1 { stride as i32 } else { 0 };
        let last_cell = dims.map(|n| n.saturating_sub(2) as i32);
        let last_cell = [
            L::splat_int(last_cell[0]),
            L::splat_int(last_cell[1]),
            L::splat_int(last_cell[2]),
        ];
        let row = L::splat_int(dims[0] as i32);
        let rows = L::splat_int(dims[1] as i32);
        let next_row = L::splat_int(stride(1, dims[0]));
        let next_layer = L::splat_int(stride(2, dims[0] * dims[1]));
        let has_next_x = dims[0] > 1;
        let (scale, offset) = (L::splat(table.scale), L::splat(table.offset));
        let last_entry = L::splat((table.len() - 1) as f32);
        let threshold = L::splat(*termination);
        let (blocks_across, blocks_down, shift) = match self.frame.distances {
            Some(map) => (map.dims[0] as i32, map.dims[1] as i32, map.shift),
            None => (0, 0, 0),
        };
        let (blocks_across, blocks_down) = (L::splat_int(blocks_across), L::splat_int(blocks_down));
        let edge = L::splat((1_u32 << shift) as f32);
        let border = L::splat(view.border);

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
            let step_x = L::load(&lanes.step[0]);
            let step_y = L::load(&lanes.step[1]);
            let step_z = L::load(&lanes.step[2]);
            let mut last = L::load(&lanes.last);
            let mut k = L::load(&lanes.k);
            let mut r = L::load(&lanes.colour[0]);
            let mut g = L::load(&lanes.colour[1]);
            let mut b = L::load(&lanes.colour[2]);
            let mut opacity = L::load(&lanes.opacity);
            let exits = [
                Exit::<L>::new::<N>(step_x, edge, border),
                Exit::<L>::new::<N>(step_y, edge, border),
                Exit::<L>::new::<N>(step_z, edge, border),
            ];
            let enough = if next < waiting.len() { refill } else { 1 };
            let mut unchecked = 0;
            loop {
                let active = k.le(last);
                let count = L::bits(active).count_ones();
                if count < enough {
                    break;
                }
                let x = k.mul(step_x).add(eye_x).max(zero).min(top[0]);
                let y = k.mul(step_y).add(eye_y).max(zero).min(top[1]);
                let z = k.mul(step_z).add(eye_z).max(zero).min(top[2]);
                let cell_x = L::min_int(x.truncate(), last_cell[0]);
                let cell_y = L::min_int(y.truncate(), last_cell[1]);
                let cell_z = L::min_int(z.truncate(), last_cell[2]);
                if SKIP
                    && unchecked == 0
                    && let Some(map) = self.frame.distances
                {
                    let block_x = L::shift_int(cell_x, shift);
                    let block_y = L::shift_int(cell_y, shift);
                    let block_z = L::shift_int(cell_z, shift);
                    let block = L::add_int(L::mul_int(block_z, blocks_down), block_y);
                    let block = L::add_int(L::mul_int(block, blocks_across), block_x);
                    let distance = L::from_int(L::gather_bytes(&map.distances, block));
                    let is_empty = zero.lt(distance) & active;
                    if L::bits(is_empty) != 0 {
                        let along_x =
                            exits[0].samples::<N>(L::from_int(block_x), distance, edge, x);
                        let along_y =
                            exits[1].samples::<N>(L::from_int(block_y), distance, edge, y);
                        let along_z =
                            exits[2].samples::<N>(L::from_int(block_z), distance, edge, z);
                        let inside = along_x.min(along_y).min(along_z).max(zero).floor();
                        k = L::select(is_empty, k.add(inside).add(one), k);
                        skips += u64::from(L::bits(is_empty).count_ones());
                        continue;
                    }
                    unchecked = SAMPLES_PER_CHECK;
                }
                unchecked -= u32::from(SKIP);
                samples += u64::from(count);
                let share_x = x.sub(L::from_int(cell_x));
                let share_y = y.sub(L::from_int(cell_y));
                let share_z = z.sub(L::from_int(cell_z));
                let base = L::mul_int(L::add_int(L::mul_int(cell_z, rows), cell_y), row);
                let base = L::add_int(base, cell_x);
                let above = L::add_int(base, next_layer);
                let v00 = along_x::<N, L, V>(self.voxels, base, share_x, has_next_x);
                let v01 = along_x::<N, L, V>(
                    self.voxels,
                    L::add_int(base, next_row),
                    share_x,
                    has_next_x,
                );
                let v10 = along_x::<N, L, V>(self.voxels, above, share_x, has_next_x);
                let v11 = along_x::<N, L, V>(
                    self.voxels,
                    L::add_int(above, next_row),
                    share_x,
                    has_next_x,
                );
                let v0 = lerp(v00, v01, share_y);
                let v1 = lerp(v10, v11, share_y);
                let raw = lerp(v0, v1, share_z);
                // The first operand of max() is dropped if it is NaN, and nothing is seen of it.
                let place = raw.mul(scale).add(offset).max(zero).min(last_entry);
                let seen = active & raw.le(raw);
                let entry = L::mul_int(place.round(), L::splat_int(ENTRY as i32));
                let alpha = L::gather(&table.entries, L::add_int(entry, L::splat_int(3)), seen);
                let is_lit = zero.lt(alpha);
                if L::bits(is_lit) != 0 {
                    lit_samples += u64::from(L::bits(is_lit).count_ones());
                    let weight = one.sub(opacity).mul(alpha);
                    let red = L::gather(&table.entries, entry, is_lit);
                    let green =
                        L::gather(&table.entries, L::add_int(entry, L::splat_int(1)), is_lit);
                    let blue =
                        L::gather(&table.entries, L::add_int(entry, L::splat_int(2)), is_lit);
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

/// Where a ray leaves the blocks around it along one axis.
struct Exit<L> {
    /// 1 or −1.
    sign: L,
    /// The far border of a block against its near one, less the margin, in voxels.
    border: L,
    /// Samples per voxel, with the sign of the step.
    per_voxel: L,
}

impl<L> Exit<L> {
    #[inline(always)]
    fn new<const N: usize>(step: L, edge: L, margin: L) -> Self
    where
        L: GatherLanes<N>,
    {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let is_back = step.lt(zero);
        let sign = L::select(is_back, L::splat(-1.0), one);
        // A ray that stands still along this axis has a long way to go.
        let size = step.abs().max(L::splat(SMALLEST_STEP));
        Self {
            sign,
            border: L::select(is_back, edge, zero).sub(sign.mul(margin)),
            per_voxel: sign.div(size),
        }
    }

    /// So many samples on is the border of the cube of blocks around `block` in which nothing can be
    /// seen, `distance` being that of the nearest block in which something can.
    #[inline(always)]
    fn samples<const N: usize>(&self, block: L, distance: L, edge: L, place: L) -> L
    where
        L: GatherLanes<N>,
    {
        let border = block
            .add(self.sign.mul(distance))
            .mul(edge)
            .add(self.border);
        border.sub(place).mul(self.per_voxel)
    }
}

#[inline(always)]
fn lerp<const N: usize, L: GatherLanes<N>>(a: L, b: L, share: L) -> L {
    a.add(b.sub(a).mul(share))
}

/// The values at cells, interpolated along x.
#[inline(always)]
fn along_x<const N: usize, L: GatherLanes<N>, V: Voxel>(
    voxels: &[V],
    index: L::Int,
    share: L,
    has_next: bool,
) -> L {
    let [here, next] = V::pairs::<N, L>(voxels, index);
    if has_next {
        lerp(here, next, share)
    } else {
        here
    }
}

const NO_PIXEL: u32 = u32::MAX;

/// The rays in the lanes between two loops.
struct LaneStates<const N: usize> {
    step: [[f32; N]; 3],
    k: [f32; N],
    last: [f32; N],
    colour: [[f32; N]; 3],
    opacity: [f32; N],
    pixel: [u32; N],
}

impl<const N: usize> LaneStates<N> {
    #[inline(always)]
    fn idle() -> Self {
        Self {
            step: [[1.0; N]; 3],
            k: [0.0; N],
            last: [-1.0; N],
            colour: [[0.0; N]; 3],
            opacity: [0.0; N],
            pixel: [NO_PIXEL; N],
        }
    }

    #[inline(always)]
    fn take(&mut self, lane: usize, ray: &Waiting) {
        for axis in 0..3 {
            self.step[axis][lane] = ray.step[axis];
            self.colour[axis][lane] = 0.0;
        }
        self.opacity[lane] = 0.0;
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
