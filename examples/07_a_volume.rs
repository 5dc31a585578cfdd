//! A picture of a volume made by hand: a ball of fog with a hard core, its core as a surface.
//!
//! Run: `cargo run --release --example 07_a_volume`

use raywright::{
    bvh::Vec3,
    imaging::{Camera, write_image},
    volume::{
        Appearance, CastOptions, ControlPoint, IsoSurface, Raycaster, Shading, TransferFunction,
        ValueScale, Volume, Voxels,
    },
};

const SIDE: usize = 96;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // 255 in the middle, 0 at the faces.
    let value = |i: usize| {
        let place = [i % SIDE, i / SIDE % SIDE, i / (SIDE * SIDE)];
        let centred = Vec3::from(place.map(|p| p as f32 / (SIDE - 1) as f32 - 0.5));
        (255.0 * (1.0 - 2.0 * centred.length()).max(0.0)) as u8
    };
    let voxels = Voxels::U8((0..SIDE * SIDE * SIDE).map(value).collect());
    let volume = Volume::new([SIDE; 3], [1.0; 3], voxels, ValueScale::default())?;

    // Value, red, green, blue, opacity of one voxel's length.
    let points = [
        [0.0, 0.2, 0.4, 1.0, 0.0],
        [20.0, 0.2, 0.4, 1.0, 0.0],
        [200.0, 0.6, 0.8, 1.0, 0.03],
    ];
    let fog = TransferFunction::new(points.map(ControlPoint::from).to_vec())?;
    let mut appearance = Appearance::from(fog);
    appearance.surfaces.push(IsoSurface {
        value: 170.0,
        colour: [1.0, 0.55, 0.2],
        opacity: 1.0,
    });
    appearance.shading = Some(Shading::default());

    let middle = Vec3::splat(SIDE as f32 * 0.5);
    let camera = Camera::new(
        middle + Vec3::new(90.0, -140.0, 70.0),
        middle,
        Vec3::Z,
        35.0,
    )?;
    let caster = Raycaster::new(&volume)?;
    let prepared = caster.prepare_appearance(appearance)?;
    let picture = prepared.render(camera, [320, 240], &CastOptions::default())?;
    let work = picture.work;
    println!(
        "{} rays, {} samples, {} jumps",
        work.rays, work.samples, work.skips
    );
    write_image("a_volume.png", &picture.image)?;
    Ok(())
}
