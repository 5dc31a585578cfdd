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
    Counts, Frame, RayResult, Work,
    field::{Field, Voxel},
    lanes::{LaneStates, Queue, Waiting},
    space::Space,
    sparse::Chosen,
    view::{NearRays, RayLattice, Rays, SMALLEST_STEP},
};
use crate::table::TransferTable;

/// So many pairs of samples are taken before the distance map is asked again: a few samples too
/// many, and less time than asking before each pair, by 8 % and more.
const PAIRS_PER_CHECK: u32 = 4;

/// Casts the rays of a rectangle of pixels.
pub(crate) struct TileKernel<'a, V> {
    pub(crate) frame: &'a Frame<'a>,
    pub(crate) voxels: &'a [V],
    pub(crate) columns: std::ops::Range<u32>,
    pub(crate) rows: std::ops::Range<u32>,
    /// Which of them have rays; the rectangle begins at an even column and row.
    pub(crate) chosen: Chosen<'a>,
    /// Results row by row.
    pub(crate) results: &'a mut [RayResult],
    pub(crate) work: &'a mut Work,
}

impl<V: Voxel> LaneKernel for TileKernel<'_, V> {
    type Output = ();

    #[inline(always)]
    fn run<const N: usize, L: GatherLanes<N>>(mut self) {
        let mut queue = Queue::default();
        self.set_up::<N, L>(&mut queue);
        let is_counted = self.frame.counts == Counts::PerRay;
        match (self.frame.details, self.frame.distances, is_counted) {
            (Some(details), _, false) => self.cast_detailed::<N, L, false>(queue, details),
            (Some(details), _, true) => self.cast_detailed::<N, L, true>(queue, details),
            (None, Some(_), false) => self.cast::<N, L, true, false, false>(queue),
            (None, Some(_), true) => self.cast::<N, L, true, false, true>(queue),
            (None, None, false) => self.cast::<N, L, false, true, false>(queue),
            (None, None, true) => self.cast::<N, L, false, true, true>(queue),
        }
    }
}

impl<V: Voxel> TileKernel<'_, V> {
    /// Whether a pixel of the rectangle has a ray, given that its place was asked for.
    fn has(&self, x: u32, y: u32) -> bool {
        match self.chosen {
            Chosen::Lattice(_) => true,
            marked => marked.has(self.columns.start + x, self.rows.start + y),
        }
    }

    /// The rays that have samples, in small squares of pixels.
    #[inline(always)]
    fn set_up<const N: usize, L: GatherLanes<N>>(&mut self, queue: &mut Queue) {
        const SIDE: u32 = 4;
        let frame = self.frame;
        let view = &frame.view;
        let (width, height) = (self.columns.len() as u32, self.rows.len() as u32);
        let lanes_down = N as u32 / SIDE;
        let mut rays = [RayLattice::NONE; N];
        let mut hits = Vec::new();
        queue.rays.reserve(self.results.len());
        // The loops that ask for parts: all but that with the distance map.
        let has_parts = frame.details.is_some() || frame.distances.is_none();
        let [across, down] = self.chosen.extent(width, height);
        for y in (0..down).step_by(lanes_down as usize) {
            for x in (0..across).step_by(SIDE as usize) {
                let (mut xs, mut ys, mut jitter) = ([0.0; N], [0.0; N], [0.0; N]);
                for lane in 0..N as u32 {
                    let [column, row] = self.chosen.pixel(x + lane % SIDE, y + lane / SIDE);
                    let (column, row) = (self.columns.start + column, self.rows.start + row);
                    xs[lane as usize] = column as f32 + 0.5;
                    ys[lane as usize] = row as f32 + 0.5;
                    jitter[lane as usize] = view.jitter_of(column, row);
                }
                match &view.rays {
                    Rays::Near(near) => self.lattice::<N, L>(near, xs, ys, jitter, &mut rays),
                    Rays::Exact(exact) => {
                        for (lane, ray) in rays.iter_mut().enumerate() {
                            *ray = exact.lattice(view, xs[lane], ys[lane], jitter[lane]);
                        }
                    }
                }
                for (lane, samples) in rays.iter().enumerate() {
                    let lane = lane as u32;
                    let [x, y] = self.chosen.pixel(x + lane % SIDE, y + lane / SIDE);
                    let is_outside = x >= width || y >= height;
                    if is_outside || samples.first > samples.last || !self.has(x, y) {
                        continue;
                    }
                    self.work.rays += 1;
                    let pixel = y * width + x;
                    let start = queue.intervals.len() as u32;
                    if let Some(enclosure) = frame.enclosure {
                        let beside = frame.needs_front();
                        enclosure.intervals(samples, beside, &mut hits, |first, last| {
                            queue.intervals.push([first, last]);
                        });
                        if queue.intervals.len() as u32 == start {
                            self.results[pixel as usize].end = samples.last + 1.0 + samples.number;
                            continue;
                        }
                    }
                    if has_parts {
                        queue.parts.push([start, queue.intervals.len() as u32]);
                    }
                    queue.rays.push(Waiting {
                        samples: *samples,
                        pixel,
                    });
                }
            }
        }
        self.work.skips += queue.intervals.len() as u64;
    }

    /// The rays through points of the picture, moved by a share of a step.
    #[inline(always)]
    fn lattice<const N: usize, L: GatherLanes<N>>(
        &self,
        near: &NearRays,
        x: [f32; N],
        y: [f32; N],
        jitter: [f32; N],
        rays: &mut [RayLattice; N],
    ) {
        let view = &self.frame.view;
        let across = L::load(&x).sub(L::splat(near.centre[0]));
        let down = L::load(&y).sub(L::splat(near.centre[1]));
        let jitter = L::load(&jitter);
        let mut d = [across; 3];
        for (axis, d) in d.iter_mut().enumerate() {
            let forward = L::splat(near.frame[0][axis]);
            let right = L::splat(near.frame[1][axis]).mul(across);
            let below = L::splat(near.frame[2][axis]).mul(down);
            *d = forward.add(right).add(below);
        }
        let square = d[0].mul(d[0]).add(d[1].mul(d[1])).add(d[2].mul(d[2]));
        let unit = L::splat(1.0).div(square.sqrt());
        let (first_sample, last_sample) =
            (L::splat(view.first_sample()), L::splat(view.last_sample));
        let (mut first, mut last) = (first_sample, last_sample);
        let (mut origins, mut steps) = (d, d);
        for axis in 0..3 {
            let step = d[axis].mul(unit).mul(L::splat(near.scale[axis]));
            let origin = L::splat(near.eye[axis]).add(jitter.mul(step));
            let (low, high) = (L::splat(view.low[axis]), L::splat(view.high[axis]));
            let is_still = step.abs().lt(L::splat(SMALLEST_STEP));
            let reciprocal = L::splat(1.0).div(step);
            let a = low.sub(origin).mul(reciprocal);
            let b = high.sub(origin).mul(reciprocal);
            let is_inside = low.le(origin) & origin.le(high);
            let still_last = L::select(is_inside, last_sample, L::splat(-1.0));
            first = first.max(L::select(is_still, first_sample, a.min(b)));
            last = last.min(L::select(is_still, still_last, a.max(b)));
            (origins[axis], steps[axis]) = (origin, step);
        }
        let zero = L::splat(0.0);
        let first = zero.sub(zero.sub(first).floor()).store();
        let last = last.floor().store();
        let [origins, steps] = [origins, steps].map(|v| [v[0].store(), v[1].store(), v[2].store()]);
        for lane in 0..N {
            rays[lane] = RayLattice {
                origin: [origins[0][lane], origins[1][lane], origins[2][lane]],
                step: [steps[0][lane], steps[1][lane], steps[2][lane]],
                first: first[lane],
                last: last[lane],
                number: 0.0,
            };
        }
    }

    #[inline(always)]
    fn cast<
        const N: usize,
        L: GatherLanes<N>,
        const SKIP: bool,
        const PARTS: bool,
        const COUNT: bool,
    >(
        self,
        mut queue: Queue,
    ) {
        let Frame {
            volume,
            view,
            table,
            termination,
            distances,
            ..
        } = self.frame;
        let shape = Field::<N, L, V>::new(volume, view, self.voxels);
        let space = distances.map(|map| Space::<N, L>::new(map, view.border));
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let look = Look::<N, L>::new(table, V::IS_WHOLE);
        let threshold = L::splat(*termination);

        let mut lanes = LaneStates::<N>::idle();
        let mut work = Work::default();
        while let Some(enough) =
            lanes.refill::<PARTS, COUNT>(&mut queue, *termination, self.results)
        {
            let field = shape.seen_from(lanes.origins());
            let step = [
                L::load(&lanes.step[0]),
                L::load(&lanes.step[1]),
                L::load(&lanes.step[2]),
            ];
            let mut last = L::load(&lanes.last);
            let mut k = L::load(&lanes.k);
            let mut light = Light::<N, L> {
                colour: [
                    L::load(&lanes.colour[0]),
                    L::load(&lanes.colour[1]),
                    L::load(&lanes.colour[2]),
                ],
                opacity: L::load(&lanes.opacity),
            };
            let exits = space.map(|space| space.exits(&step));
            let mut counts = Counted::<N, L>::of(&lanes);
            let mut unchecked = 0;
            loop {
                let active = k.le(last);
                let count = L::bits(active).count_ones();
                if count < enough {
                    break;
                }
                work.packet_steps += 1;
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
                        work.skips += u64::from(L::bits(is_empty).count_ones());
                        if COUNT {
                            counts.skip(is_empty);
                        }
                        continue;
                    }
                    unchecked = PAIRS_PER_CHECK;
                }
                unchecked -= u32::from(SKIP);
                // Two samples at a time: while one waits for its fetches, the other is computed.
                let second = k.add(one);
                let has_second = second.le(last);
                work.samples += u64::from(count + L::bits(has_second).count_ones());
                if COUNT {
                    counts.sample(active);
                    counts.sample(has_second);
                }
                let value = field.value(&place);
                let second_value = field.value(&field.place(second, &step));
                let (entry, alpha) = look.opacity(value, active);
                let (second_entry, second_alpha) = look.opacity(second_value, has_second);
                if L::bits(zero.lt(alpha.max(second_alpha))) != 0 {
                    let colour = L::gather_triples(table.colours, entry);
                    let second_colour = L::gather_triples(table.colours, second_entry);
                    work.lit_samples += u64::from(L::bits(zero.lt(alpha)).count_ones());
                    light.add(alpha, colour);
                    // A ray that is done ends before its next sample.
                    last = L::select(threshold.lt(light.opacity) & active, k, last);
                    let second_alpha = L::select(second.le(last), second_alpha, zero);
                    work.lit_samples += u64::from(L::bits(zero.lt(second_alpha)).count_ones());
                    light.add(second_alpha, second_colour);
                    last = L::select(threshold.lt(light.opacity) & second.le(last), second, last);
                }
                k = L::select(active, second.add(one), k);
            }
            lanes.k = k.store();
            lanes.last = last.store();
            let [r, g, b] = light.colour;
            lanes.colour = [r.store(), g.store(), b.store()];
            lanes.opacity = light.opacity.store();
            if COUNT {
                counts.store(&mut lanes);
            }
        }
        self.work.add(&work);
    }
}

/// What rays in lanes took.
pub(crate) struct Counted<const N: usize, L: GatherLanes<N>> {
    samples: L,
    skips: L,
}

impl<const N: usize, L: GatherLanes<N>> Counted<N, L> {
    #[inline(always)]
    pub(crate) fn of(lanes: &LaneStates<N>) -> Self {
        Self {
            samples: L::load(&lanes.samples),
            skips: L::load(&lanes.skips),
        }
    }

    #[inline(always)]
    pub(crate) fn sample(&mut self, mask: L::Mask) {
        self.samples = L::select(mask, self.samples.add(L::splat(1.0)), self.samples);
    }

    #[inline(always)]
    pub(crate) fn skip(&mut self, mask: L::Mask) {
        self.skips = L::select(mask, self.skips.add(L::splat(1.0)), self.skips);
    }

    #[inline(always)]
    pub(crate) fn store(&self, lanes: &mut LaneStates<N>) {
        lanes.samples = self.samples.store();
        lanes.skips = self.skips.store();
    }
}

/// The opacity of values.
pub(crate) struct Look<'a, const N: usize, L: GatherLanes<N>> {
    table: &'a TransferTable<'a>,
    scale: L,
    offset: L,
    last: L,
    is_whole: bool,
}

impl<'a, const N: usize, L: GatherLanes<N>> Look<'a, N, L> {
    #[inline(always)]
    pub(crate) fn new(table: &'a TransferTable<'a>, is_whole: bool) -> Self {
        Self {
            table,
            scale: L::splat(table.index.scale),
            offset: L::splat(table.index.offset),
            last: L::splat(table.index.last),
            is_whole,
        }
    }

    /// The entries of raw values, and opacities where the mask is set and the value is not missing.
    #[inline(always)]
    pub(crate) fn opacity(&self, raw: L, mask: L::Mask) -> (L::Int, L) {
        let place = raw.mul(self.scale).add(self.offset);
        let place = if self.is_whole {
            // What is interpolated between the smallest and the largest value has an entry.
            place
        } else {
            // The first operand of max() is dropped if it is NaN.
            place.max(L::splat(0.0)).min(self.last)
        };
        let entry = place.round();
        let seen = if self.is_whole {
            mask
        } else {
            mask & raw.le(raw)
        };
        (entry, L::gather(&self.table.opacities, entry, seen))
    }
}

/// What rays have gathered.
pub(crate) struct Light<const N: usize, L: GatherLanes<N>> {
    pub(crate) colour: [L; 3],
    pub(crate) opacity: L,
}

impl<const N: usize, L: GatherLanes<N>> Light<N, L> {
    #[inline(always)]
    pub(crate) fn add(&mut self, alpha: L, colour: [L; 3]) {
        let weight = L::splat(1.0).sub(self.opacity).mul(alpha);
        for (sum, colour) in self.colour.iter_mut().zip(colour) {
            *sum = sum.add(weight.mul(colour));
        }
        self.opacity = self.opacity.add(weight);
    }
}
