//! Pictures with fewer rays than pixels.
//!
//! First the rays of a lattice of pixels are cast; then those of pixels between rays of which some see
//! nothing and others something, since what lies on a silhouette can be had from neither; all other
//! pixels are the mean of the rays around them, which on the lattice two by two is bilinear.
//!
//! Invariants: a pixel that has a ray is that of the full picture, bit for bit; what is cast and by whom
//! changes no pixel.

use serde::{Deserialize, Serialize};

use super::Picture;

/// Pixels for which one ray is cast.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(rename_all = "kebab-case")]
pub enum PixelsPerRay {
    /// A ray for every pixel.
    #[default]
    One,
    /// A ray for every second pixel, like the black fields of a checkerboard.
    Checker,
    /// A ray for four pixels, two by two.
    Four,
}

impl PixelsPerRay {
    /// All of them, finest first.
    pub const ALL: [Self; 3] = [Self::One, Self::Checker, Self::Four];

    /// How many pixels share a ray.
    #[must_use]
    pub fn count(self) -> f64 {
        match self {
            Self::One => 1.0,
            Self::Checker => 2.0,
            Self::Four => 4.0,
        }
    }

    /// Whether a pixel has a ray of its own.
    fn has(self, x: u32, y: u32) -> bool {
        match self {
            Self::One => true,
            Self::Checker => (x ^ y) & 1 == 0,
            Self::Four => (x | y) & 1 == 0,
        }
    }

    /// The pixels whose rays stand for a pixel without one, in a picture of this size.
    fn around(self, [x, y]: [u32; 2], [width, height]: [u32; 2]) -> impl Iterator<Item = [u32; 2]> {
        let diagonal = self == Self::Four && x & y & 1 == 1;
        let (left, up) = (x.wrapping_sub(1), y.wrapping_sub(1));
        let candidates = if diagonal {
            [[left, up], [x + 1, up], [left, y + 1], [x + 1, y + 1]]
        } else {
            [[left, y], [x + 1, y], [x, up], [x, y + 1]]
        };
        candidates
            .into_iter()
            .filter(move |&[x, y]| x < width && y < height && self.has(x, y))
    }
}

/// The pixels whose rays are cast.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Chosen<'a> {
    /// Those of a lattice.
    Lattice(PixelsPerRay),
    /// Those that are marked, in a picture that is so wide.
    Marked { marks: &'a [bool], width: u32 },
}

impl Chosen<'_> {
    pub(crate) fn has(self, x: u32, y: u32) -> bool {
        match self {
            Self::Lattice(lattice) => lattice.has(x, y),
            Self::Marked { marks, width } => marks[y as usize * width as usize + x as usize],
        }
    }

    /// How many columns and rows there are to ask for in a rectangle whose corner is even.
    pub(crate) fn extent(self, width: u32, height: u32) -> [u32; 2] {
        match self {
            Self::Lattice(PixelsPerRay::Checker) => [width.div_ceil(2), height],
            Self::Lattice(PixelsPerRay::Four) => [width.div_ceil(2), height.div_ceil(2)],
            _ => [width, height],
        }
    }

    /// The pixel of such a column and row.
    pub(crate) fn pixel(self, column: u32, row: u32) -> [u32; 2] {
        match self {
            Self::Lattice(PixelsPerRay::Checker) => [2 * column + (row & 1), row],
            Self::Lattice(PixelsPerRay::Four) => [2 * column, 2 * row],
            _ => [column, row],
        }
    }
}

/// The pixels that need a ray besides those of the lattice.
pub(crate) fn silhouettes(picture: &Picture, lattice: PixelsPerRay) -> Vec<bool> {
    let size = [picture.image.width(), picture.image.height()];
    let is_empty = |[x, y]: [u32; 2]| picture.opacity[index(x, y, size)] == 0.0;
    let mut marks = vec![false; picture.opacity.len()];
    each_without(lattice, size, |x, y| {
        let mut around = lattice.around([x, y], size).map(is_empty);
        let first = around.next();
        // Without a neighbour there is nothing to take the mean of.
        marks[index(x, y, size)] = first.is_none_or(|first| around.any(|other| other != first));
    });
    marks
}

/// Gives every pixel that has no ray the mean of those around it.
pub(crate) fn fill(picture: &mut Picture, lattice: PixelsPerRay, marks: &[bool]) {
    let size = [picture.image.width(), picture.image.height()];
    each_without(lattice, size, |x, y| {
        let own = index(x, y, size);
        if marks[own] {
            return;
        }
        let (mut colour, mut opacity, mut end, mut count) = ([0.0; 3], 0.0, 0.0, 0.0_f32);
        for [x, y] in lattice.around([x, y], size) {
            let other = index(x, y, size);
            for (sum, c) in colour.iter_mut().zip(picture.image.pixels()[other]) {
                *sum += c;
            }
            opacity += picture.opacity[other];
            end += picture.end[other];
            count += 1.0;
        }
        picture.image.pixels_mut()[own] = colour.map(|c| c / count);
        picture.opacity[own] = opacity / count;
        picture.end[own] = (end / count).round();
    });
}

fn index(x: u32, y: u32, [width, _]: [u32; 2]) -> usize {
    y as usize * width as usize + x as usize
}

fn each_without(lattice: PixelsPerRay, [width, height]: [u32; 2], mut then: impl FnMut(u32, u32)) {
    for y in 0..height {
        for x in 0..width {
            if !lattice.has(x, y) {
                then(x, y);
            }
        }
    }
}
