//! Pictures a part at a time: with a step of its own for each, or for as long as there is time.
//!
//! Invariant: with one step a picture is that of [`Prepared::render`], bit for bit. What depends on the
//! step alone is made when the step changes.

use raywright_imaging::{AnyCamera, Camera};

use super::{
    CastError, CastOptions, Picture, PixelsPerRay, Prepared, Work, blank, complete,
    sparse::Chosen,
    tiles::{self, cast_bands, cast_tiles},
};

impl Prepared<'_> {
    /// The same picture part by part, with a step for each: before each part `step` is asked, which is
    /// told the number of the part and the work of those before. [`parts`](super::parts) says which rows
    /// they have. Numbers of samples in [`Picture::end`] are those of the part. Where pixels share rays,
    /// those of silhouettes between them come last, with the step of the last part.
    ///
    /// # Errors
    /// As [`Prepared::render`].
    pub fn render_in_parts(
        &self,
        camera: impl Into<AnyCamera>,
        size: [u32; 2],
        options: &CastOptions,
        mut step: impl FnMut(usize, &Work) -> f32,
    ) -> Result<Picture, CastError> {
        let rays = camera.into().picture_frame(size[0], size[1])?;
        let mut picture = blank(size, options)?;
        let mut options = *options;
        options.check()?;
        let mut tables = self.tables(options.step);
        let mut work = Work::default();
        let lattice = options.pixels_per_ray;
        for (part, bands) in tiles::bands_of_parts(&mut picture).into_iter().enumerate() {
            options.step = step(part, &work);
            if options.step != tables.step {
                options.check()?;
                tables = self.tables(options.step);
            }
            work.add(&self.with_tables(&rays, &options, &tables, |frame| {
                cast_bands(frame, size[0], bands, Chosen::Lattice(lattice), options.isa)
            })?);
        }
        picture.work = work;
        if lattice != PixelsPerRay::One {
            self.with_tables(&rays, &options, &tables, |frame| {
                complete(&mut picture, lattice, |picture, chosen| {
                    cast_tiles(frame, picture, chosen, options.isa);
                });
            })?;
        }
        Ok(picture)
    }

    /// A picture of which nothing is there yet, for [`Prepared::render_rows`].
    pub(crate) fn blank(
        &self,
        camera: Camera,
        size: [u32; 2],
        options: &CastOptions,
    ) -> Result<Picture, CastError> {
        self.picture(camera.into(), size, options, |_, _, _| {})
    }

    /// Casts the rows of a picture from `row` on, for as long as `go_on` says so, which is asked before each
    /// few rows with the work of those before. Returns the first row that is not there yet.
    pub(crate) fn render_rows(
        &self,
        camera: Camera,
        options: &CastOptions,
        picture: &mut Picture,
        row: u32,
        mut go_on: impl FnMut(&Work) -> bool,
    ) -> Result<u32, CastError> {
        let size = [picture.image.width(), picture.image.height()];
        let rays = AnyCamera::from(camera).picture_frame(size[0], size[1])?;
        let mut work = Work::default();
        let end = self.with_frame(&rays, options, |frame| {
            let mut bands = tiles::bands_from(picture, row).into_iter().peekable();
            while let Some(next) = bands.peek() {
                let row = next.first_row();
                if !go_on(&work) {
                    return row;
                }
                let few = bands.by_ref().take(rayon::current_num_threads()).collect();
                let all = Chosen::Lattice(PixelsPerRay::One);
                work.add(&cast_bands(frame, size[0], few, all, options.isa));
            }
            size[1]
        })?;
        picture.work.add(&work);
        Ok(end)
    }
}
