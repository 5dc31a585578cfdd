//! Rays and hits in files: CSV, and the array format of NumPy.
//!
//! Invariants: what is no table of six or eight columns is an error that names the row; the file that is
//! written holds each number without loss.

use std::{
    fs::File,
    io::{BufReader, BufWriter, Read, Write},
    path::Path,
};

use anyhow::{Context, anyhow, bail};
use raywright::bvh::{Hit, Ray};

use super::super::Failure;

/// Columns of rays with their interval, and without.
const COLUMNS: [usize; 2] = [8, 6];

/// A form of tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    Csv,
    Npy,
}

impl Form {
    /// That of a file, by the ending of its name.
    pub(super) fn of(path: &Path) -> Result<Self, Failure> {
        let ending = path.extension().map(|ending| ending.to_ascii_lowercase());
        match ending.as_deref().and_then(|ending| ending.to_str()) {
            Some("csv") => Ok(Self::Csv),
            Some("npy") => Ok(Self::Npy),
            _ => Err(Failure::with_hint(
                anyhow!("{} is neither .csv nor .npy", path.display()),
                "the ending of the name says what a file is",
            )),
        }
    }
}

/// What rays hit, in their order.
#[derive(Debug, PartialEq)]
pub(super) enum Hits {
    Closest(Vec<Option<Hit>>),
    Any(Vec<bool>),
}

impl Hits {
    /// How many hit something.
    pub(super) fn count(&self) -> usize {
        match self {
            Self::Closest(hits) => hits.iter().flatten().count(),
            Self::Any(hits) => hits.iter().filter(|hit| **hit).count(),
        }
    }

    fn columns(&self) -> &'static [&'static str] {
        match self {
            Self::Closest(_) => &["t", "u", "v", "geometry_id", "primitive_id"],
            Self::Any(_) => &["hit"],
        }
    }
}

/// Reads rays; and how many of their numbers had to be rounded.
pub(super) fn read_rays(path: &Path) -> Result<(Vec<Ray>, usize), Failure> {
    let form = Form::of(path)?;
    let read = || {
        let file = BufReader::new(File::open(path)?);
        let rows = match form {
            Form::Csv => csv_rows(file)?,
            Form::Npy => npy_rows(file)?,
        };
        let mut rounded = 0;
        let rays = rows.rays(&mut rounded);
        anyhow::Ok((rays, rounded))
    };
    read()
        .with_context(|| format!("cannot read rays from {}", path.display()))
        .map_err(Failure::from)
}

/// Numbers of a table, row by row.
struct Rows {
    columns: usize,
    values: Vec<f64>,
}

impl Rows {
    fn rays(&self, rounded: &mut usize) -> Vec<Ray> {
        let mut number = |value: f64| {
            let single = value as f32;
            *rounded += usize::from(f64::from(single) != value && !value.is_nan());
            single
        };
        let rows = self.values.chunks_exact(self.columns);
        rows.map(|row| {
            let mut numbers = row.iter().map(|&value| number(value));
            let mut next = || numbers.next().unwrap_or(f32::NAN);
            let place = std::array::from_fn(|_| next());
            let range = (self.columns == 8).then(|| [next(), next()]);
            super::ray(place, range)
        })
        .collect()
    }
}

fn check_columns(columns: usize) -> anyhow::Result<()> {
    if COLUMNS.contains(&columns) {
        return Ok(());
    }
    bail!("rows of {columns} numbers: there must be six, or eight with t_min and t_max");
}

fn csv_rows(file: impl Read) -> anyhow::Result<Rows> {
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(file);
    let (mut columns, mut values) = (0, Vec::new());
    for (index, record) in reader.records().enumerate() {
        let record = record?;
        let numbers: Result<Vec<f64>, _> = record.iter().map(str::parse).collect();
        // A head has no number at all.
        let is_head = index == 0 && record.iter().all(|field| field.parse::<f64>().is_err());
        if is_head {
            continue;
        }
        let line = record.position().map_or(0, csv::Position::line);
        let numbers = numbers.with_context(|| format!("line {line} has what is no number"))?;
        check_columns(numbers.len()).with_context(|| format!("line {line}"))?;
        columns = numbers.len();
        values.extend(numbers);
    }
    Ok(Rows {
        columns: columns.max(1),
        values,
    })
}

/// The first bytes of an array of NumPy.
const NPY_MAGIC: &[u8] = b"\x93NUMPY";

/// NumPy Enhancement Proposal 1: magic, version, length of a header, which is a literal of Python, numbers.
fn npy_rows(mut file: impl Read) -> anyhow::Result<Rows> {
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes)?;
    let (header, data) = npy_parts(&bytes).context("no array of NumPy")?;
    let field = |name: &str| {
        let place = header.split_once(&format!("'{name}':"));
        let place = place.with_context(|| format!("an array of NumPy without {name}"));
        place.map(|(_, rest)| rest.trim_start())
    };
    let kind = field("descr")?.split('\'').nth(1).unwrap_or_default();
    let is_fortran = field("fortran_order")?.starts_with("True");
    let shape = field("shape")?.split(['(', ')']).nth(1).unwrap_or_default();
    let sides = shape
        .split(',')
        .map(str::trim)
        .filter(|side| !side.is_empty());
    let sides: Vec<usize> = sides.map(str::parse).collect::<Result<_, _>>()?;
    let &[rows, columns] = &sides[..] else {
        bail!("an array of {} dimensions: there must be two", sides.len());
    };
    check_columns(columns)?;
    let mut values: Vec<f64> = match kind {
        "<f4" => numbers(data, |b| f64::from(f32::from_le_bytes(b))),
        ">f4" => numbers(data, |b| f64::from(f32::from_be_bytes(b))),
        "<f8" => numbers(data, f64::from_le_bytes),
        ">f8" => numbers(data, f64::from_be_bytes),
        _ => bail!("numbers of type {kind}: they must be f4 or f8"),
    };
    if rows.checked_mul(columns) != Some(values.len()) {
        bail!("{} numbers for {rows} rows of {columns}", values.len());
    }
    if is_fortran {
        values = (0..values.len())
            .map(|place| values[place % columns * rows + place / columns])
            .collect();
    }
    Ok(Rows { columns, values })
}

/// Header and data of an array.
fn npy_parts(bytes: &[u8]) -> Option<(&str, &[u8])> {
    let rest = bytes.strip_prefix(NPY_MAGIC)?;
    let (version, rest) = rest.split_at_checked(2)?;
    let (length, rest) = if version[0] == 1 {
        let (length, rest) = rest.split_first_chunk()?;
        (usize::from(u16::from_le_bytes(*length)), rest)
    } else {
        let (length, rest) = rest.split_first_chunk()?;
        (usize::try_from(u32::from_le_bytes(*length)).ok()?, rest)
    };
    let (header, data) = rest.split_at_checked(length)?;
    Some((std::str::from_utf8(header).ok()?, data))
}

fn numbers<const N: usize>(data: &[u8], number: impl Fn([u8; N]) -> f64) -> Vec<f64> {
    let (numbers, _) = data.as_chunks::<N>();
    numbers.iter().map(|&bytes| number(bytes)).collect()
}

/// Writes hits.
pub(super) fn write_hits(path: &Path, form: Form, hits: &Hits) -> Result<(), Failure> {
    let write = || {
        let file = BufWriter::new(File::create(path)?);
        match form {
            Form::Csv => write_csv(file, hits),
            Form::Npy => write_npy(file, hits),
        }
    };
    write()
        .with_context(|| format!("cannot write hits to {}", path.display()))
        .map_err(Failure::from)
}

fn write_csv(mut file: impl Write, hits: &Hits) -> anyhow::Result<()> {
    writeln!(file, "{}", hits.columns().join(","))?;
    match hits {
        Hits::Any(hits) => {
            for hit in hits {
                writeln!(file, "{}", u8::from(*hit))?;
            }
        }
        Hits::Closest(hits) => {
            for hit in hits {
                match hit {
                    // The shortest digits that give the number again.
                    Some(hit) => writeln!(
                        file,
                        "{},{},{},{},{}",
                        hit.t, hit.u, hit.v, hit.geometry_id, hit.primitive_id
                    )?,
                    None => writeln!(file, "inf,0,0,-1,-1")?,
                }
            }
        }
    }
    Ok(file.flush()?)
}

fn write_npy(mut file: impl Write, hits: &Hits) -> anyhow::Result<()> {
    let rows = match hits {
        Hits::Any(hits) => hits.len(),
        Hits::Closest(hits) => hits.len(),
    };
    let columns = hits.columns().len();
    let header =
        format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({rows}, {columns}), }}");
    // Numbers begin at a multiple of 64: 10 bytes are before the header, and a line ends it.
    let width = (header.len() + 11).next_multiple_of(64) - 11;
    let header = format!("{header:<width$}\n");
    file.write_all(NPY_MAGIC)?;
    file.write_all(&[1, 0])?;
    file.write_all(&u16::try_from(header.len())?.to_le_bytes())?;
    file.write_all(header.as_bytes())?;
    let mut write = |value: f64| file.write_all(&value.to_le_bytes());
    match hits {
        Hits::Any(hits) => {
            for hit in hits {
                write(f64::from(u8::from(*hit)))?;
            }
        }
        Hits::Closest(hits) => {
            for hit in hits {
                let row = match hit {
                    Some(hit) => {
                        let [t, u, v] = [hit.t, hit.u, hit.v].map(f64::from);
                        let ids = [hit.geometry_id, hit.primitive_id].map(f64::from);
                        [t, u, v, ids[0], ids[1]]
                    }
                    None => [f64::INFINITY, 0.0, 0.0, -1.0, -1.0],
                };
                for value in row {
                    write(value)?;
                }
            }
        }
    }
    Ok(file.flush()?)
}

#[cfg(test)]
mod tests {
    use raywright::bvh::{BuildParams, Bvh, TriangleMesh, Vec3};

    use super::*;

    fn rays_of(text: &str) -> anyhow::Result<Vec<Ray>> {
        Ok(csv_rows(text.as_bytes())?.rays(&mut 0))
    }

    #[test]
    fn rows_of_six_and_eight_with_and_without_a_head() {
        let expected = Ray::new([0.0, 1.0, 2.0], [0.0, -1.0, 0.5]);
        let head = "ox,oy,oz,dx,dy,dz\n";
        for text in ["0,1,2,0,-1,0.5\n", "# mine\n 0, 1 ,2,0,-1,5e-1"] {
            assert_eq!(rays_of(text).unwrap(), [expected]);
            assert_eq!(rays_of(&format!("{head}{text}")).unwrap(), [expected]);
        }
        let limited = rays_of("0,1,2,0,-1,0.5,0.25,inf\n").unwrap();
        assert_eq!(limited, [expected.with_range(0.25, f32::INFINITY)]);
        assert_eq!(rays_of("").unwrap(), []);
        assert_eq!(rays_of(head).unwrap(), []);
    }

    #[test]
    fn what_is_no_table_of_rays_names_its_line() {
        for (text, said) in [
            ("1,2,3\n", "line 1"),
            ("0,1,2,0,-1,0\n0,1,2,0,x,0\n", "line 2"),
            ("0,1,2,0,-1,0\n0,1,2,0,-1,0,0,1\n", "line: 2"),
        ] {
            let error = format!("{:#}", rays_of(text).unwrap_err());
            assert!(error.contains(said), "{error}");
        }
    }

    fn array(kind: &str, order: &str, shape: &str, data: &[u8]) -> Vec<u8> {
        let header =
            format!("{{'descr': '{kind}', 'fortran_order': {order}, 'shape': ({shape}), }}\n");
        let length = (header.len() as u16).to_le_bytes();
        [NPY_MAGIC, &[1, 0], &length, header.as_bytes(), data].concat()
    }

    #[test]
    fn arrays_in_either_order_and_both_precisions() {
        let values = [0.0, 1.0, 2.0, 0.0, -1.0, 0.5, 3.0, 4.0, 5.0, 1.0, 0.1, 0.0];
        let expected = [
            Ray::new([0.0, 1.0, 2.0], [0.0, -1.0, 0.5]),
            Ray::new([3.0, 4.0, 5.0], [1.0, 0.1, 0.0]),
        ];
        for order in ["False", "True"] {
            let in_order = (0..12).map(|place| match order {
                "False" => values[place],
                _ => values[place % 2 * 6 + place / 2],
            });
            let in_order: Vec<f64> = in_order.collect();
            let double: Vec<u8> = in_order.iter().flat_map(|x| x.to_le_bytes()).collect();
            let single = in_order.iter().flat_map(|&x| (x as f32).to_be_bytes());
            let single: Vec<u8> = single.collect();
            let read = |kind: &str, data: &[u8]| {
                let mut rounded = 0;
                let bytes = array(kind, order, "2, 6", data);
                (npy_rows(&bytes[..]).unwrap().rays(&mut rounded), rounded)
            };
            // 0.1 is no binary fraction.
            assert_eq!(read("<f8", &double), (expected.to_vec(), 1));
            assert_eq!(read(">f4", &single), (expected.to_vec(), 0));
        }
    }

    #[test]
    fn other_arrays_are_errors() {
        for (kind, shape, said) in [
            ("<f8", "12,", "dimensions"),
            ("<f8", "2, 5", "rows of 5"),
            ("<i8", "2, 6", "i8"),
            ("<f8", "3, 6", "12 numbers"),
        ] {
            let bytes = array(kind, "False", shape, &[0; 96]);
            let error = npy_rows(&bytes[..]).err().map(|e| format!("{e:#}"));
            assert!(
                error.as_ref().is_some_and(|e| e.contains(said)),
                "{error:?}"
            );
        }
        assert!(npy_rows(&b"no array"[..]).is_err());
        let whole = array("<f8", "False", "2, 6", &[0; 96]);
        for cut in 0..whole.len() {
            assert!(npy_rows(&whole[..cut]).is_err(), "{cut}");
        }
    }

    #[test]
    fn hits_are_written_without_loss() {
        let corners = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
        let mesh = TriangleMesh::new(corners, vec![[0, 1, 2]]).unwrap();
        let tree = Bvh::build(&[&mesh], &BuildParams::default()).unwrap();
        let ray = Ray::new([0.1, 0.3, 0.7], [0.0, 0.0, -1.0]);
        let mut hit = tree.closest_hit(&ray).unwrap();
        (hit.geometry_id, hit.primitive_id) = (7, u32::MAX - 1);
        let hits = Hits::Closest(vec![None, Some(hit)]);
        let mut text = Vec::new();
        write_csv(&mut text, &hits).unwrap();
        let text = String::from_utf8(text).unwrap();
        let mut lines = text.lines();
        assert_eq!(lines.next(), Some("t,u,v,geometry_id,primitive_id"));
        assert_eq!(lines.next(), Some("inf,0,0,-1,-1"));
        let fields: Vec<&str> = lines.next().unwrap().split(',').collect();
        let written: Vec<f32> = fields[..3].iter().map(|f| f.parse().unwrap()).collect();
        assert_eq!(written, [hit.t, hit.u, hit.v]);
        assert_eq!(fields[3..], ["7", "4294967294"]);
        let mut bytes = Vec::new();
        write_npy(&mut bytes, &hits).unwrap();
        let (header, data) = npy_parts(&bytes).unwrap();
        assert!(header.contains("(2, 5)") && (bytes.len() - data.len()).is_multiple_of(64));
        let values = numbers(data, f64::from_le_bytes);
        let expected = [hit.t, hit.u, hit.v].map(f64::from);
        assert_eq!(values[..5], [f64::INFINITY, 0.0, 0.0, -1.0, -1.0]);
        assert_eq!(values[5..8], expected);
        assert_eq!(values[8..], [7.0, 4_294_967_294.0]);
    }
}
