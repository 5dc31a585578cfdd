//! The tile loop changes no bit: threads, tiles and passes are matters of time alone.

use std::num::NonZeroU32;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::Vec3;
use proptest::prelude::*;
use raywright_imaging::{
    CancelToken, Completion, Film, Pixel, PixelSampler, Tile, TileLoop, TileView, dimension,
};

const WIDTH: u32 = 97;
const HEIGHT: u32 = 53;

fn tile_size(size: u32) -> NonZeroU32 {
    NonZeroU32::new(size).unwrap()
}

fn pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap()
}

/// A sample whose sum depends on the order of addition: values over six decades.
fn sample(x: u32, y: u32, index: u32) -> Vec3 {
    let sampler = PixelSampler::new(9, x, y, index);
    let [u, v] = sampler.uniform_2d(dimension::FILM);
    Vec3::new((u * 14.0).exp(), v, 1.0 / (u + 1e-3))
}

fn add_samples(tile: &Tile, view: &mut TileView<'_, '_>, indices: std::ops::Range<u32>) {
    for (x, y) in tile.pixels() {
        for index in indices.clone() {
            view.pixel_mut(x, y).add(sample(x, y, index));
        }
    }
}

/// The slow twin: one thread, no tiles.
fn naive(samples: u32) -> Vec<[u64; 6]> {
    let mut bits = Vec::new();
    for y in 0..HEIGHT {
        for x in 0..WIDTH {
            let mut pixel = Pixel::default();
            (0..samples).for_each(|index| pixel.add(sample(x, y, index)));
            bits.push(pixel_bits(&pixel));
        }
    }
    bits
}

fn pixel_bits(pixel: &Pixel) -> [u64; 6] {
    let ([a, b, c], [d, e, f]) = (pixel.mean(), pixel.standard_error());
    [a, b, c, d, e, f].map(f64::to_bits)
}

fn film_bits(film: &Film) -> Vec<[u64; 6]> {
    film.pixels().iter().map(pixel_bits).collect()
}

#[test]
fn same_bits_for_any_threads_tiles_and_passes() {
    let expected = naive(8);
    for threads in [1, 2, 7] {
        let pool = pool(threads);
        for size in [1, 7, 32, 64, 1000, u32::MAX] {
            for passes in [&[8u32][..], &[1, 1, 2, 4], &[3, 5]] {
                let mut film = Film::new(WIDTH, HEIGHT).unwrap();
                let mut first = 0;
                for count in passes {
                    let completion = pool.install(|| {
                        TileLoop::new()
                            .with_tile_size(tile_size(size))
                            .run(&mut film, |tile, view| {
                                add_samples(tile, view, first..first + count)
                            })
                    });
                    assert_eq!(completion, Completion::Finished);
                    first += count;
                }
                assert!(
                    film_bits(&film) == expected,
                    "{threads} threads, tiles of {size}, passes {passes:?}"
                );
            }
        }
    }
}

#[test]
fn the_comparison_would_see_another_order_of_samples() {
    let mut film = Film::new(WIDTH, HEIGHT).unwrap();
    let completion = TileLoop::new().run(&mut film, |tile, view| {
        add_samples(tile, view, 4..8);
        add_samples(tile, view, 0..4);
    });
    assert_eq!(completion, Completion::Finished);
    assert!(film_bits(&film) != naive(8));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn tiles_partition_the_picture(width in 1u32..80, height in 1u32..80, size in 1u32..100) {
        let mut film = Film::new(width, height).unwrap();
        let tiles = Mutex::new(Vec::new());
        let completion = TileLoop::new().with_tile_size(tile_size(size)).run(
            &mut film,
            |tile, view| {
                tiles.lock().unwrap().push(*tile);
                for (x, y) in tile.pixels() {
                    view.pixel_mut(x, y).add(Vec3::new(x as f32, y as f32, tile.index as f32));
                }
            },
        );
        prop_assert_eq!(completion, Completion::Finished);
        // Every pixel exactly once, and it is the one that was asked for.
        for y in 0..height {
            for x in 0..width {
                let tile = y / size * width.div_ceil(size) + x / size;
                prop_assert_eq!(film.pixel(x, y).count(), 1);
                prop_assert_eq!(film.pixel(x, y).mean(), [x, y, tile].map(f64::from));
            }
        }
        let mut tiles = tiles.into_inner().unwrap();
        tiles.sort_by_key(|tile| tile.index);
        let count = width.div_ceil(size) * height.div_ceil(size);
        prop_assert_eq!(tiles.len(), count as usize);
        prop_assert!(tiles.iter().enumerate().all(|(index, tile)| tile.index == index));
        prop_assert!(tiles.iter().all(|tile| (1..=size).contains(&tile.width)));
    }
}

#[test]
fn a_tile_reaches_no_pixel_of_another() {
    for (x, y) in [(7, 8), (12, 8), (8, 7), (8, 12), (0, 0), (u32::MAX, 8)] {
        let outcome = std::panic::catch_unwind(|| {
            let mut film = Film::new(20, 20).unwrap();
            TileLoop::new()
                .with_tile_size(tile_size(4))
                .run(&mut film, |tile, view| {
                    // The tile with corners (8, 8) and (12, 12).
                    if tile.index == 12 {
                        view.pixel_mut(x, y);
                    }
                })
        });
        assert!(outcome.is_err(), "({x}, {y})");
    }
}

#[test]
fn progress_tells_each_count_once() {
    let seen = Mutex::new(Vec::new());
    let observer = |done: usize, total: usize| seen.lock().unwrap().push((done, total));
    let mut film = Film::new(WIDTH, HEIGHT).unwrap();
    let completion = pool(3).install(|| {
        TileLoop::new()
            .with_tile_size(tile_size(16))
            .with_progress(&observer)
            .run(&mut film, |_, _| ())
    });
    assert_eq!(completion, Completion::Finished);
    let mut seen = seen.into_inner().unwrap();
    seen.sort_unstable();
    assert_eq!(seen, (1..=28).map(|done| (done, 28)).collect::<Vec<_>>());
}

#[test]
fn cancelled_before_the_start() {
    let cancel = CancelToken::new();
    cancel.clone().cancel();
    let mut film = Film::new(WIDTH, HEIGHT).unwrap();
    let completion = TileLoop::new()
        .with_cancel(&cancel)
        .run(&mut film, |tile, view| add_samples(tile, view, 0..1));
    assert_eq!(
        completion,
        Completion::Cancelled {
            tiles_done: 0,
            tiles: 8
        }
    );
    assert_eq!(film.samples(), 0);
}

/// After the stop was asked for, no thread begins another tile, so that the delay is that of one
/// tile; what was done is kept, and is what an uninterrupted pass would have put there.
#[test]
fn cancelled_on_the_way() {
    let expected = naive(2);
    for threads in [1, 2, 7] {
        let cancel = CancelToken::new();
        let begun = AtomicUsize::new(0);
        let mut film = Film::new(WIDTH, HEIGHT).unwrap();
        let completion = pool(threads).install(|| {
            TileLoop::new()
                .with_tile_size(tile_size(8))
                .with_cancel(&cancel)
                .run(&mut film, |tile, view| {
                    if begun.fetch_add(1, Ordering::Relaxed) == 20 {
                        cancel.cancel();
                    }
                    add_samples(tile, view, 0..2);
                })
        });
        let begun = begun.into_inner();
        let Completion::Cancelled { tiles_done, tiles } = completion else {
            panic!("finished in spite of the token");
        };
        assert_eq!(tiles, 91);
        assert!(
            tiles_done <= 20 && tiles_done + threads >= 21,
            "{tiles_done} done"
        );
        // A thread may have looked at the token just before it was set.
        assert!(
            begun <= 20 + threads,
            "{begun} tiles begun on {threads} threads"
        );
        let mut untouched = 0;
        for (pixel, expected) in film.pixels().iter().zip(&expected) {
            match pixel.count() {
                0 => untouched += 1,
                count => {
                    assert_eq!(count, 2);
                    assert_eq!(pixel_bits(pixel), *expected);
                }
            }
        }
        assert!(untouched > 0);
    }
}

#[test]
fn work_that_returns_early_is_not_complete() {
    let cancel = CancelToken::new();
    let mut film = Film::new(8, 8).unwrap();
    let completion = TileLoop::new()
        .with_cancel(&cancel)
        .run(&mut film, |tile, view| {
            for (x, y) in tile.pixels() {
                if cancel.is_cancelled() {
                    return;
                }
                view.pixel_mut(x, y).add(Vec3::ONE);
                if (x, y) == (3, 2) {
                    cancel.cancel();
                }
            }
        });
    assert_eq!(
        completion,
        Completion::Cancelled {
            tiles_done: 0,
            tiles: 1
        }
    );
    assert_eq!(film.samples(), 2 * 8 + 4);
    assert_eq!((film.pixel(3, 2).count(), film.pixel(4, 2).count()), (1, 0));
}
