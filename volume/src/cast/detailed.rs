//! Rays in lanes whose samples are more than looked up: the kernel for everything that `details` can
//! ask for. The twin of `kernel`, which knows nothing of it.
//!
//! Invariants: operations and their order are those of `details`, none fused. Where two samples
//! matter together a ray that leaves empty space takes the last sample in it first, so that the next
//! has one before it. Between two samples in one cube of empty blocks nothing is seen: the values on
//! the way are those of blocks whose ranges overlap, and none of the ranges shows anything. That
//! holds only where no value is missing; volumes with missing values are not skipped through then.

use raywright_bvh::simd::{GatherLanes, splat_all};

use super::{
    Work,
    details::{Details, RawSurface, SMALLEST_SQUARE, SURFACE_TURNS, Shade},
    field::{Field, Voxel},
    kernel::{Counted, Light, Look, TileKernel},
    lanes::{LaneStates, Queue},
    space::Space,
};
use crate::{appearance::Interpolation, slabs::SLAB_SIZE, table::FULL_COLOUR};

/// So many samples are taken before the distance map is asked again.
const SAMPLES_PER_CHECK: u32 = 4;

/// What is looked at in lanes.
struct Lanes<'a, const N: usize, L: GatherLanes<N>, V> {
    field: Field<'a, N, L, V>,
    details: &'a Details,
    step: [L; 3],
}

impl<const N: usize, L: GatherLanes<N>, V: Voxel> Lanes<'_, N, L, V> {
    #[inline(always)]
    fn value(&self, place: &[L; 3]) -> L {
        match self.details.interpolation {
            Interpolation::Nearest => self.field.nearest(place),
            Interpolation::Trilinear => self.field.value(place),
        }
    }

    #[inline(always)]
    fn shaded(&self, colour: [L; 3], place: &[L; 3]) -> [L; 3] {
        match &self.details.shade {
            Some(shade) => self.shade(shade, colour, place),
            None => colour,
        }
    }

    #[inline(always)]
    fn shade(&self, shade: &Shade, colour: [L; 3], place: &[L; 3]) -> [L; 3] {
        let one = L::splat(1.0);
        let mut gradient = *place;
        let mut direction = *place;
        for axis in 0..3 {
            let (mut before, mut behind) = (*place, *place);
            before[axis] = self.field.limited(axis, place[axis].sub(one));
            behind[axis] = self.field.limited(axis, place[axis].add(one));
            let difference = self.value(&behind).sub(self.value(&before));
            gradient[axis] = difference.mul(L::splat(shade.per_difference[axis]));
            direction[axis] = self.step[axis].mul(L::splat(shade.per_step[axis]));
        }
        let square = dot(gradient, gradient);
        let has_gradient = L::splat(SMALLEST_SQUARE).lt(square);
        let length = square.sqrt();
        let (straight, mirrored) = match shade.light {
            None => {
                let straight = dot(gradient, direction).div(length).abs();
                (straight, straight)
            }
            Some(light) => {
                let light = splat_all::<N, L>(light);
                let half = [
                    light[0].sub(direction[0]),
                    light[1].sub(direction[1]),
                    light[2].sub(direction[2]),
                ];
                let straight = dot(gradient, light).div(length).abs();
                let size = dot(half, half).sqrt().mul(length);
                let size = size.max(L::splat(f32::MIN_POSITIVE));
                (straight, dot(gradient, half).div(size).abs())
            }
        };
        let share = L::splat(shade.ambient).add(L::splat(shade.diffuse).mul(straight));
        let white = L::splat(shade.specular).mul(power(mirrored, shade.shininess));
        let mut shaded = colour;
        for shaded in &mut shaded {
            let lit = shaded.mul(share).add(white).min(L::splat(FULL_COLOUR));
            *shaded = L::select(has_gradient, lit, *shaded);
        }
        shaded
    }

    /// Lays a surface behind what rays have gathered where it is crossed.
    #[inline(always)]
    fn cross(
        &self,
        surface: &RawSurface,
        light: &mut Light<N, L>,
        k: L,
        [front, back]: [L; 2],
        crossed: L::Mask,
    ) {
        let (zero, one, raw) = (L::splat(0.0), L::splat(1.0), L::splat(surface.raw));
        let (mut near, mut near_value) = (zero, front);
        let (mut far, mut far_value) = (one, back);
        let rises = L::select(front.lt(raw), one, zero);
        let before = k.sub(one);
        let mut share = zero;
        for turn in 0..=SURFACE_TURNS {
            let part = raw.sub(near_value).div(far_value.sub(near_value));
            share = near.add(part.mul(far.sub(near)));
            if turn == SURFACE_TURNS {
                break;
            }
            let value = self.value(&self.field.place(before.add(share), &self.step));
            // Where both are 1 or both 0.
            let is_near = L::select(value.lt(raw), one, zero)
                .sub(rises)
                .abs()
                .le(zero);
            near = L::select(is_near, share, near);
            near_value = L::select(is_near, value, near_value);
            far = L::select(is_near, far, share);
            far_value = L::select(is_near, far_value, value);
        }
        let place = self.field.place(before.add(share), &self.step);
        let colour = self.shaded(splat_all::<N, L>(surface.colour), &place);
        light.add(L::select(crossed, L::splat(surface.opacity), zero), colour);
    }
}

#[inline(always)]
fn dot<const N: usize, L: GatherLanes<N>>(a: [L; 3], b: [L; 3]) -> L {
    a[0].mul(b[0]).add(a[1].mul(b[1])).add(a[2].mul(b[2]))
}

/// x^n for n ≥ 1, by squares.
#[inline(always)]
fn power<const N: usize, L: GatherLanes<N>>(mut x: L, mut n: u32) -> L {
    let mut result = L::splat(1.0);
    while n > 0 {
        if n & 1 == 1 {
            result = result.mul(x);
        }
        x = x.mul(x);
        n >>= 1;
    }
    result
}

impl<V: Voxel> TileKernel<'_, V> {
    #[inline(always)]
    pub(crate) fn cast_detailed<const N: usize, L: GatherLanes<N>, const COUNT: bool>(
        self,
        mut queue: Queue,
        details: &Details,
    ) {
        let frame = self.frame;
        let shape = Field::<N, L, V>::new(frame.volume, &frame.view, self.voxels);
        let needs_front = details.needs_front();
        let space = frame
            .distances
            .map(|map| Space::<N, L>::new(map, frame.view.border));
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let look = Look::<N, L>::new(frame.table, V::IS_WHOLE);
        let threshold = L::splat(frame.termination);

        let mut lanes = LaneStates::<N>::idle();
        let mut work = Work::default();
        while let Some(enough) =
            lanes.refill::<true, COUNT>(&mut queue, frame.termination, self.results)
        {
            let field = shape.seen_from(lanes.origins());
            let step = [
                L::load(&lanes.step[0]),
                L::load(&lanes.step[1]),
                L::load(&lanes.step[2]),
            ];
            let view = Lanes {
                field,
                details,
                step,
            };
            let mut last = L::load(&lanes.last);
            let mut k = L::load(&lanes.k);
            let mut front = L::load(&lanes.front);
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
                // How many samples further the next one is that matters.
                let mut ahead = one;
                if unchecked == 0
                    && let (Some(space), Some(exits)) = (space, exits)
                {
                    let (block, distance) = space.distance(&field.cell(&place));
                    let inside = space.samples_inside(&exits, &block, distance, &place);
                    // With a sample before it that is the last one inside, else the first outside.
                    let far = if needs_front { inside } else { inside.add(one) };
                    ahead = L::select(zero.lt(distance) & one.lt(far), far, one);
                    let skipped = one.lt(ahead) & active;
                    work.skips += u64::from(L::bits(skipped).count_ones());
                    if COUNT {
                        counts.skip(skipped);
                    }
                    unchecked = SAMPLES_PER_CHECK;
                }
                unchecked = unchecked.saturating_sub(1);
                work.samples += u64::from(count);
                if COUNT {
                    counts.sample(active);
                }
                let back = view.value(&place);
                let before = light.opacity;
                for surface in &details.surfaces {
                    let raw = L::splat(surface.raw);
                    let crossed = front.lt(raw) & raw.le(back) & active;
                    if L::bits(crossed) != 0 {
                        view.cross(surface, &mut light, k, [front, back], crossed);
                    }
                }
                for surface in details.surfaces.iter().rev() {
                    let raw = L::splat(surface.raw);
                    let crossed = back.lt(raw) & raw.le(front) & active;
                    if L::bits(crossed) != 0 {
                        view.cross(surface, &mut light, k, [front, back], crossed);
                    }
                }
                let (alpha, item, colours) = match &details.slabs {
                    Some(slabs) => {
                        let seen = front.le(front) & back.le(back) & active;
                        let row = slabs.index.lanes(front);
                        let row = L::mul_int(row, L::splat_int(SLAB_SIZE as i32));
                        let item = L::add_int(row, slabs.index.lanes(back));
                        let alpha = L::gather(&slabs.opacities, item, seen);
                        (alpha, item, &slabs.colours[..])
                    }
                    None => {
                        let (entry, alpha) = look.opacity(back, active);
                        (alpha, entry, frame.table.colours)
                    }
                };
                if L::bits(zero.lt(alpha)) != 0 {
                    let colour = L::gather_triples(colours, item);
                    light.add(alpha, view.shaded(colour, &place));
                }
                work.lit_samples += u64::from(L::bits(before.lt(light.opacity)).count_ones());
                // A ray that is done ends before its next sample.
                last = L::select(threshold.lt(light.opacity) & active, k, last);
                front = L::select(one.lt(ahead), L::splat(f32::NAN), back);
                k = L::select(active, k.add(ahead), k);
            }
            lanes.k = k.store();
            lanes.last = last.store();
            lanes.front = front.store();
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
