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
use npyz::{NpyFile, Order, TypeChar, WriterBuilder};
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

fn npy_rows(file: impl Read) -> anyhow::Result<Rows> {
    let array = NpyFile::new(file).context("no array of NumPy")?;
    let &[_, columns] = array.shape() else {
        bail!(
            "an array of {} dimensions: there must be two",
            array.shape().len()
        );
    };
    let columns = usize::try_from(columns)?;
    check_columns(columns)?;
    let order = array.order();
    let dtype = array.dtype();
    let npyz::DType::Plain(kind) = &dtype else {
        bail!("an array of records: its numbers must be f4 or f8");
    };
    let mut values: Vec<f64> = match (kind.type_char(), kind.size_field()) {
        (TypeChar::Float, 4) => {
            let values = array.into_vec::<f32>()?;
            values.into_iter().map(f64::from).collect()
        }
        (TypeChar::Float, 8) => array.into_vec()?,
        _ => bail!("numbers of type {}: they must be f4 or f8", dtype.descr()),
    };
    if order == Order::Fortran {
        let rows = values.len() / columns;
        values = (0..values.len())
            .map(|place| values[place % columns * rows + place / columns])
            .collect();
    }
    Ok(Rows { columns, values })
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

fn write_npy(file: impl Write, hits: &Hits) -> anyhow::Result<()> {
    let rows = match hits {
        Hits::Any(hits) => hits.len(),
        Hits::Closest(hits) => hits.len(),
    };
    let shape = [rows as u64, hits.columns().len() as u64];
    let options = npyz::WriteOptions::new().default_dtype().shape(&shape);
    let mut writer = options.writer(file).begin_nd()?;
    match hits {
        Hits::Any(hits) => {
            writer.extend(hits.iter().map(|hit| f64::from(u8::from(*hit))))?;
        }
        Hits::Closest(hits) => writer.extend(hits.iter().flat_map(|hit| match hit {
            Some(hit) => {
                let ids = [hit.geometry_id, hit.primitive_id].map(f64::from);
                let [t, u, v] = [hit.t, hit.u, hit.v].map(f64::from);
                [t, u, v, ids[0], ids[1]]
            }
            None => [f64::INFINITY, 0.0, 0.0, -1.0, -1.0],
        }))?,
    }
    Ok(writer.finish()?)
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

    #[test]
    fn arrays_in_either_order_and_both_precisions() {
        let values = [0.0, 1.0, 2.0, 0.0, -1.0, 0.5, 3.0, 4.0, 5.0, 1.0, 0.1, 0.0];
        let expected = [
            Ray::new([0.0, 1.0, 2.0], [0.0, -1.0, 0.5]),
            Ray::new([3.0, 4.0, 5.0], [1.0, 0.1, 0.0]),
        ];
        for order in [Order::C, Order::Fortran] {
            let in_order = |place: usize| match order {
                Order::C => values[place],
                Order::Fortran => values[place % 2 * 6 + place / 2],
            };
            let options = || {
                npyz::WriteOptions::new()
                    .default_dtype()
                    .shape(&[2, 6])
                    .order(order)
            };
            let mut double = Vec::new();
            let mut writer = options().writer(&mut double).begin_nd().unwrap();
            writer.extend((0..12).map(in_order)).unwrap();
            writer.finish().unwrap();
            let mut single = Vec::new();
            let options = npyz::WriteOptions::new()
                .default_dtype()
                .shape(&[2, 6])
                .order(order);
            let mut writer = options.writer(&mut single).begin_nd().unwrap();
            writer
                .extend((0..12).map(|place| in_order(place) as f32))
                .unwrap();
            writer.finish().unwrap();
            let read = |bytes: &[u8]| {
                let mut rounded = 0;
                (npy_rows(bytes).unwrap().rays(&mut rounded), rounded)
            };
            // 0.1 is no binary fraction.
            assert_eq!(read(&double), (expected.to_vec(), 1));
            assert_eq!(read(&single), (expected.to_vec(), 0));
        }
    }

    #[test]
    fn other_arrays_are_errors() {
        let bytes = |shape: &[u64]| {
            let mut bytes = Vec::new();
            let options = npyz::WriteOptions::new().default_dtype().shape(shape);
            let mut writer = options.writer(&mut bytes).begin_nd().unwrap();
            writer
                .extend((0..shape.iter().product()).map(|n| n as i64))
                .unwrap();
            writer.finish().unwrap();
            bytes
        };
        for (shape, said) in [
            (&[12][..], "dimensions"),
            (&[2, 5], "rows of 5"),
            (&[2, 6], "i8"),
        ] {
            let error = npy_rows(&bytes(shape)[..]).err().map(|e| format!("{e:#}"));
            assert!(
                error.as_ref().is_some_and(|e| e.contains(said)),
                "{error:?}"
            );
        }
        assert!(npy_rows(&b"no array"[..]).is_err());
        // Cut off.
        let whole = bytes(&[2, 6]);
        assert!(npy_rows(&whole[..whole.len() - 1]).is_err());
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
        let numbers: Vec<f32> = fields[..3].iter().map(|f| f.parse().unwrap()).collect();
        assert_eq!(numbers, [hit.t, hit.u, hit.v]);
        assert_eq!(fields[3..], ["7", "4294967294"]);
        let mut bytes = Vec::new();
        write_npy(&mut bytes, &hits).unwrap();
        let values: Vec<f64> = NpyFile::new(&bytes[..]).unwrap().into_vec().unwrap();
        let expected = [hit.t, hit.u, hit.v].map(f64::from);
        assert_eq!(values[..5], [f64::INFINITY, 0.0, 0.0, -1.0, -1.0]);
        assert_eq!(values[5..8], expected);
        assert_eq!(values[8..], [7.0, 4_294_967_294.0]);
    }
}
