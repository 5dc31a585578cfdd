//! The field between the voxels: how voxels lie for lanes, and what is interpolated from them.
//!
//! Voxels of 8 and 16 bits lie in pairs, each with the one below it in y, so that one fetch brings
//! the four corners of a cell in a plane. It takes twice the memory and half the fetches, which cost
//! more than what they bring.
//!
//! Invariants: the operations are those of `reference`, none fused. Of whole numbers the
//! interpolation with share 0 or 1 is exact, so that a sample on the far face may take the cell
//! beyond it: what it reads there has no weight. Floating point values might be missing there or
//! overflow in a difference, and their samples stay in the last cell.

use raywright_bvh::simd::{GatherLanes, splat_all};

use super::view::View;
use crate::grid::{Volume, Voxels};

/// Voxels as they lie for lanes.
#[derive(Clone, Debug)]
pub(crate) enum Layout<'a> {
    /// Each with the one below it, and one pair more.
    U8(Vec<[u8; 2]>),
    /// Each with the one below it, and one pair more.
    U16(Vec<[u16; 2]>),
    /// As in the volume.
    F32(&'a [f32]),
}

impl<'a> Layout<'a> {
    /// The layout of a volume.
    pub(crate) fn of(volume: &'a Volume) -> Self {
        match volume.padded() {
            Voxels::U8(voxels) => Self::U8(pairs(voxels, volume.dims())),
            Voxels::U16(voxels) => Self::U16(pairs(voxels, volume.dims())),
            Voxels::F32(voxels) => Self::F32(voxels),
        }
    }
}

/// Every voxel with the one below it, the last row with itself.
fn pairs<T: Copy + Default + Send + Sync>(
    voxels: &[T],
    [width, height, depth]: [usize; 3],
) -> Vec<[T; 2]> {
    let count = width * height * depth;
    let mut pairs = Vec::with_capacity(count + 1);
    for layer in voxels[..count].chunks_exact(width * height) {
        pairs.extend(layer.iter().zip(&layer[width..]).map(|(&a, &b)| [a, b]));
        pairs.extend(layer[width * (height - 1)..].iter().map(|&a| [a, a]));
    }
    pairs.push([T::default(); 2]);
    pairs
}

/// An item of a layout.
pub(crate) trait Voxel: Copy + Sync {
    /// Whether values are whole numbers, so that all interpolation with share 0 is exact.
    const IS_WHOLE: bool;

    /// The values at places.
    fn one<const N: usize, L: GatherLanes<N>>(voxels: &[Self], index: L::Int) -> L;

    /// The values at the corners of cells in a plane: at the place, to its right, below, below right.
    fn square<const N: usize, L: GatherLanes<N>>(
        voxels: &[Self],
        index: L::Int,
        next_row: L::Int,
    ) -> [L; 4];
}

macro_rules! pair {
    ($type:ty, $gather:ident) => {
        impl Voxel for [$type; 2] {
            const IS_WHOLE: bool = true;

            #[inline(always)]
            fn one<const N: usize, L: GatherLanes<N>>(voxels: &[Self], index: L::Int) -> L {
                L::$gather(voxels, index)[0]
            }

            #[inline(always)]
            fn square<const N: usize, L: GatherLanes<N>>(
                voxels: &[Self],
                index: L::Int,
                _next_row: L::Int,
            ) -> [L; 4] {
                let [here, below, right, below_right] = L::$gather(voxels, index);
                [here, right, below, below_right]
            }
        }
    };
}

pair!(u8, gather_squares_u8);
pair!(u16, gather_squares_u16);

impl Voxel for f32 {
    const IS_WHOLE: bool = false;

    #[inline(always)]
    fn one<const N: usize, L: GatherLanes<N>>(voxels: &[Self], index: L::Int) -> L {
        L::gather_pairs(voxels, index)[0]
    }

    #[inline(always)]
    fn square<const N: usize, L: GatherLanes<N>>(
        voxels: &[Self],
        index: L::Int,
        next_row: L::Int,
    ) -> [L; 4] {
        let [here, right] = L::gather_pairs(voxels, index);
        let [below, below_right] = L::gather_pairs(voxels, L::add_int(index, next_row));
        [here, right, below, below_right]
    }
}

/// Interpolates in lanes.
#[derive(Clone, Copy)]
pub(crate) struct Field<'a, const N: usize, L: GatherLanes<N>, V> {
    voxels: &'a [V],
    /// Where sample 0 of the rays lies.
    origin: [L; 3],
    /// The last voxel: samples are moved onto it.
    top: [L; 3],
    last_cell: [L::Int; 3],
    row: L::Int,
    rows: L::Int,
    next_row: L::Int,
    next_layer: L::Int,
    has_next_x: bool,
}

impl<'a, const N: usize, L: GatherLanes<N>, V: Voxel> Field<'a, N, L, V> {
    #[inline(always)]
    pub(crate) fn new(volume: &Volume, view: &View, voxels: &'a [V]) -> Self {
        let dims = volume.dims();
        // A single layer has no second one to interpolate with; it lies at distance 0 of itself.
        let stride = |axis: usize, stride: usize| if dims[axis] > 1 { stride as i32 } else { 0 };
        let last_cell = dims.map(|n| n.saturating_sub(2) as i32);
        Self {
            voxels,
            origin: splat_all::<N, L>([0.0; 3]),
            top: splat_all::<N, L>(view.last_voxel),
            last_cell: [
                L::splat_int(last_cell[0]),
                L::splat_int(last_cell[1]),
                L::splat_int(last_cell[2]),
            ],
            row: L::splat_int(dims[0] as i32),
            rows: L::splat_int(dims[1] as i32),
            next_row: L::splat_int(stride(1, dims[0])),
            next_layer: L::splat_int(stride(2, dims[0] * dims[1])),
            has_next_x: dims[0] > 1,
        }
    }

    /// The field as rays from there see it.
    #[inline(always)]
    pub(crate) fn seen_from(mut self, origin: [L; 3]) -> Self {
        self.origin = origin;
        self
    }

    /// Where sample `k` of rays lies, in voxels.
    #[inline(always)]
    pub(crate) fn place(&self, k: L, step: &[L; 3]) -> [L; 3] {
        let mut place = *step;
        for axis in 0..3 {
            place[axis] = self.limited(axis, k.mul(step[axis]).add(self.origin[axis]));
        }
        place
    }

    /// A coordinate moved into the volume.
    #[inline(always)]
    pub(crate) fn limited(&self, axis: usize, coordinate: L) -> L {
        coordinate.max(L::splat(0.0)).min(self.top[axis])
    }

    /// The raw value of the voxel that is nearest to a place.
    #[inline(always)]
    pub(crate) fn nearest(&self, place: &[L; 3]) -> L {
        let half = L::splat(0.5);
        let x = place[0].add(half).truncate();
        let y = place[1].add(half).truncate();
        let z = place[2].add(half).truncate();
        let index = L::add_int(L::mul_int(z, self.rows), y);
        let index = L::add_int(L::mul_int(index, self.row), x);
        V::one(self.voxels, index)
    }

    /// The cell of a place, one of those that blocks own.
    #[inline(always)]
    pub(crate) fn cell(&self, place: &[L; 3]) -> [L::Int; 3] {
        [
            L::min_int(place[0].truncate(), self.last_cell[0]),
            L::min_int(place[1].truncate(), self.last_cell[1]),
            L::min_int(place[2].truncate(), self.last_cell[2]),
        ]
    }

    /// The raw value at a place.
    #[inline(always)]
    pub(crate) fn value(&self, place: &[L; 3]) -> L {
        let [x, y, z] = if V::IS_WHOLE {
            [
                place[0].truncate(),
                place[1].truncate(),
                place[2].truncate(),
            ]
        } else {
            self.cell(place)
        };
        let share_x = place[0].sub(L::from_int(x));
        let share_y = place[1].sub(L::from_int(y));
        let share_z = place[2].sub(L::from_int(z));
        let base = L::add_int(L::mul_int(z, self.rows), y);
        let base = L::add_int(L::mul_int(base, self.row), x);
        let near = self.in_plane(base, share_x, share_y);
        let far = self.in_plane(L::add_int(base, self.next_layer), share_x, share_y);
        lerp(near, far, share_z)
    }

    #[inline(always)]
    fn in_plane(&self, index: L::Int, share_x: L, share_y: L) -> L {
        let [here, right, below, below_right] =
            V::square::<N, L>(self.voxels, index, self.next_row);
        if V::IS_WHOLE || self.has_next_x {
            let above = lerp(here, right, share_x);
            lerp(above, lerp(below, below_right, share_x), share_y)
        } else {
            lerp(here, below, share_y)
        }
    }
}

#[inline(always)]
fn lerp<const N: usize, L: GatherLanes<N>>(a: L, b: L, share: L) -> L {
    a.add(b.sub(a).mul(share))
}
