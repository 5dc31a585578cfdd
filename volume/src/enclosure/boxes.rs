//! The blocks in which something can be seen as few boxes: runs along x, grown along y, then along z,
//! as long as all that is added is lit and in no other box.

use raywright_bvh::{Aabb, Vec3};

use super::LitBlocks;

/// Boxes that hold every lit block once, each wider by a margin, in voxels.
pub(super) fn boxes(blocks: &LitBlocks, margin: f32) -> Vec<Aabb> {
    let [across, down, layers] = blocks.dims;
    let mut left = blocks.lit.clone();
    let row = |y: usize, z: usize| (z * down + y) * across;
    let mut boxes = Vec::new();
    for z in 0..layers {
        for y in 0..down {
            let mut x = 0;
            while x < across {
                if !left[row(y, z) + x] {
                    x += 1;
                    continue;
                }
                let run = left[row(y, z)..][x..across].iter().take_while(|&&lit| lit);
                let end = x + run.count();
                let is_lit = |left: &[bool], y, z| left[row(y, z)..][x..end].iter().all(|&lit| lit);
                let mut bottom = y + 1;
                while bottom < down && is_lit(&left, bottom, z) {
                    bottom += 1;
                }
                let mut behind = z + 1;
                while behind < layers && (y..bottom).all(|y| is_lit(&left, y, behind)) {
                    behind += 1;
                }
                for z in z..behind {
                    for y in y..bottom {
                        left[row(y, z)..][x..end].fill(false);
                    }
                }
                let sides = [
                    blocks.borders(0, x, end, margin),
                    blocks.borders(1, y, bottom, margin),
                    blocks.borders(2, z, behind, margin),
                ];
                boxes.push(Aabb {
                    min: Vec3::from(sides.map(|side| side[0])),
                    max: Vec3::from(sides.map(|side| side[1])),
                });
                x = end;
            }
        }
    }
    boxes
}
