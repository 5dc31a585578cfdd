//! What is written is what is read, and a file is there whole or not at all.

use std::fs;
use std::path::Path;

use proptest::prelude::*;
use raywright_imaging::{
    Display, FilmError, Image, ImageError, PfmError, ToneCurve, read_exr, read_pfm, write_exr,
    write_image, write_pfm, write_png,
};

/// Values that a careless conversion changes: both zeros, subnormals, extremes, infinities, NaN.
const DELICATE: [f32; 12] = [
    0.0,
    -0.0,
    1e-45,
    -1e-40,
    f32::MIN_POSITIVE,
    f32::MAX,
    f32::MIN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::NAN,
    0.1,
    -16_777_217.0,
];

fn delicate_image(width: u32, height: u32, shift: usize) -> Image {
    let mut image = Image::new(width, height).unwrap();
    let channels = image.pixels_mut().as_flattened_mut().iter_mut();
    channels
        .enumerate()
        .for_each(|(i, channel)| *channel = DELICATE[(i * 5 + shift) % 12]);
    image
}

fn bits(image: &Image) -> (u32, u32, Vec<u32>) {
    let canonical = |value: &f32| if value.is_nan() { f32::NAN } else { *value }.to_bits();
    let channels = image
        .pixels()
        .as_flattened()
        .iter()
        .map(canonical)
        .collect();
    (image.width(), image.height(), channels)
}

/// Names in a folder: nothing temporary may stay.
fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect()
}

#[test]
fn pfm_keeps_every_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.pfm");
    for (width, height) in [(1, 1), (5, 3), (3, 40)] {
        let image = delicate_image(width, height, 0);
        write_pfm(&path, &image).unwrap();
        assert_eq!(bits(&read_pfm(&path).unwrap()), bits(&image));
        assert_eq!(names(folder.path()), ["picture.pfm"]);
    }
}

#[test]
fn exr_keeps_every_bit_of_both_layers() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.exr");
    // 40 rows are more than one ZIP block.
    for (width, height) in [(1, 1), (5, 3), (3, 40)] {
        let colour = delicate_image(width, height, 0);
        let error = delicate_image(width, height, 7);
        write_exr(&path, &colour, None).unwrap();
        let (read, none) = read_exr(&path).unwrap();
        assert_eq!(bits(&read), bits(&colour));
        assert_eq!(none, None);
        write_exr(&path, &colour, Some(&error)).unwrap();
        let (read, read_error) = read_exr(&path).unwrap();
        assert_eq!(bits(&read), bits(&colour));
        assert_eq!(bits(&read_error.unwrap()), bits(&error));
        assert_eq!(names(folder.path()), ["picture.exr"]);
    }
}

#[test]
fn exr_layers_of_unequal_size() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.exr");
    let result = write_exr(
        &path,
        &delicate_image(4, 3, 0),
        Some(&delicate_image(3, 4, 0)),
    );
    assert!(matches!(
        result,
        Err(ImageError::LayerSizes {
            colour: [4, 3],
            standard_error: [3, 4],
            ..
        })
    ));
    assert!(!path.exists());
}

#[test]
fn png_holds_what_the_display_shows() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.png");
    let mut picture = Image::new(2, 2).unwrap();
    picture.set(1, 0, [0.18, 0.5, 4.0]);
    picture.set(0, 1, [-1.0, 1.0, f32::NAN]);
    let reinhard = Display {
        exposure_ev: 1.0,
        curve: ToneCurve::Reinhard,
    };
    for (display, lit) in [
        (Display::default(), [118, 188, 255]),
        (reinhard, [141, 188, 242]),
    ] {
        write_png(&path, &picture, &display).unwrap();
        let read = image::open(&path).unwrap();
        assert_eq!(read.color(), image::ColorType::Rgb8);
        let read = read.into_rgb8();
        assert_eq!(read.dimensions(), (2, 2));
        assert_eq!(read.get_pixel(0, 0).0, [0, 0, 0]);
        assert_eq!(read.get_pixel(1, 0).0, lit);
    }
}

#[test]
fn the_ending_chooses_the_format() {
    let folder = tempfile::tempdir().unwrap();
    let image = delicate_image(3, 2, 1);
    let begins = [
        ("a.png", &b"\x89PNG"[..]),
        ("b.exr", b"\x76\x2f\x31\x01"),
        ("c.PFM", b"PF\n"),
    ];
    for (name, magic) in begins {
        let path = folder.path().join(name);
        write_image(&path, &image).unwrap();
        assert!(fs::read(&path).unwrap().starts_with(magic), "{name}");
    }
    for name in ["picture.jpg", "picture", ".png"] {
        let path = folder.path().join(name);
        let error = write_image(&path, &image).unwrap_err();
        assert!(
            matches!(error, ImageError::UnknownExtension { .. }),
            "{name}: {error}"
        );
        let text = error.to_string();
        assert!(
            ["png", "exr", "pfm", name]
                .iter()
                .all(|word| text.contains(word)),
            "{text}"
        );
        assert!(!path.exists());
    }
}

#[test]
fn errors_name_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let absent = folder.path().join("absent.pfm");
    let in_absent_folder = folder.path().join("absent/picture.pfm");
    for error in [
        read_pfm(&absent).unwrap_err(),
        read_exr(&absent).unwrap_err(),
        write_image(&in_absent_folder, &delicate_image(1, 1, 0)).unwrap_err(),
    ] {
        assert!(matches!(error, ImageError::Io { .. }));
        assert!(error.to_string().contains("absent"), "{error}");
    }
    fs::write(&absent, "P6").unwrap();
    let error = read_pfm(&absent).unwrap_err();
    assert!(matches!(
        error,
        ImageError::Pfm {
            source: PfmError::Magic { .. },
            ..
        }
    ));
}

/// A write that fails at its last step: the target is a folder.
#[test]
fn a_failed_write_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.pfm");
    fs::create_dir(&path).unwrap();
    let result = write_pfm(&path, &delicate_image(2, 2, 0));
    assert!(matches!(result, Err(ImageError::Io { .. })));
    assert_eq!(names(folder.path()), ["picture.pfm"]);
}

/// Valid EXR files that hold no picture of ours.
#[test]
fn exr_without_the_channels_or_too_large() {
    use exr::prelude::*;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.exr");
    let write = |size: (usize, usize), names: &[&str]| {
        let samples = || FlatSamples::F32(vec![0.5; size.0 * size.1]);
        let channels = names.iter().map(|&name| AnyChannel::new(name, samples()));
        let channels = AnyChannels::sort(channels.collect());
        exr::prelude::Image::from_channels(size, channels)
            .write()
            .to_file(&path)
            .unwrap();
    };
    write((2, 2), &["R", "G", "Z"]);
    assert!(matches!(read_exr(&path), Err(ImageError::Exr { .. })));
    write((65537, 1), &["R", "G", "B"]);
    let result = read_exr(&path);
    assert!(
        matches!(
            result,
            Err(ImageError::Size {
                source: FilmError::Side { .. },
                ..
            })
        ),
        "{result:?}"
    );
}

/// A whole EXR file, and the places of the bytes that must stay. Those are the middle bytes of the
/// coordinates of its data window: damage there can make a picture of a size that is permitted but
/// takes gigabytes. The lowest and the highest byte make it smaller than 256 x 256 or too large.
fn exr_bytes() -> (Vec<u8>, [usize; 8]) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.exr");
    write_exr(
        &path,
        &delicate_image(5, 20, 0),
        Some(&delicate_image(5, 20, 1)),
    )
    .unwrap();
    let bytes = fs::read(&path).unwrap();
    let attribute = b"dataWindow\0box2i\0\x10\0\0\0";
    let length = attribute.len();
    let at = bytes
        .windows(length)
        .position(|window| window == attribute)
        .unwrap()
        + length;
    assert_eq!(
        bytes[at..at + 16],
        [0, 0, 0, 0, 0, 0, 0, 0, 4, 0, 0, 0, 19, 0, 0, 0]
    );
    (bytes, [1, 2, 5, 6, 9, 10, 13, 14].map(|byte| at + byte))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn a_damaged_exr_gives_a_picture_or_an_error(
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..4),
        window in prop::collection::vec((0usize..16, any::<u8>()), 0..2),
        length in any::<prop::sample::Index>(),
        truncate in any::<bool>(),
    ) {
        let (mut bytes, keep) = exr_bytes();
        let start = keep[0] - 1;
        let somewhere = damage.into_iter().map(|(at, byte)| (at.index(bytes.len()), byte));
        let in_window = window.into_iter().map(|(at, byte)| (start + at, byte));
        for (at, byte) in somewhere.chain(in_window).collect::<Vec<_>>() {
            if !keep.contains(&at) {
                bytes[at] = byte;
            }
        }
        if truncate {
            bytes.truncate(length.index(bytes.len()));
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("damaged.exr");
        fs::write(&path, &bytes).unwrap();
        match read_exr(&path) {
            Ok((colour, _)) => prop_assert!(colour.width().max(colour.height()) <= 256),
            Err(error) => prop_assert!(error.to_string().contains("damaged.exr")),
        }
    }
}
