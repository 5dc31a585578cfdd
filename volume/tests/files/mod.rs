//! Small valid volume files, written independently of the readers, for tests and the fuzzer.
#![allow(
    dead_code,
    unreachable_pub,
    reason = "every test uses a part of this, and it is public to none"
)]

use std::{collections::BTreeMap, io::Write};

/// Files of a folder in memory.
pub type Files = BTreeMap<String, Vec<u8>>;

/// One file.
pub fn one(name: &str, bytes: impl Into<Vec<u8>>) -> Files {
    Files::from([(name.to_owned(), bytes.into())])
}

/// One gzip member.
pub fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(bytes).expect("memory");
    encoder.finish().expect("memory")
}

/// A NIfTI header under construction.
#[derive(Clone)]
pub struct Nifti {
    pub version: u8,
    pub big: bool,
    pub bytes: Vec<u8>,
}

impl Nifti {
    /// A valid header of version 1 or 2: 3 x 2 x 2 voxels of type i16, distances 1, 2, 3.
    pub fn new(version: u8, big: bool) -> Self {
        let size = if version == 1 { 348 } else { 540 };
        let mut this = Self {
            version,
            big,
            bytes: vec![0; size + 4],
        };
        this.put(0, &(size as i32).to_le_bytes());
        if version == 1 {
            this.bytes[344..348].copy_from_slice(b"n+1\0");
        } else {
            this.bytes[4..12].copy_from_slice(b"n+2\0\r\n\x1a\n");
        }
        this.dim(0, 3).dim(1, 3).dim(2, 2).dim(3, 2);
        this.datatype(4, 16);
        this.pixdim(0, 1.0)
            .pixdim(1, 1.0)
            .pixdim(2, 2.0)
            .pixdim(3, 3.0);
        this.vox_offset(size as f64 + 4.0);
        this
    }

    /// Bytes, given the lowest first.
    pub fn put(&mut self, at: usize, little: &[u8]) -> &mut Self {
        let mut bytes = little.to_vec();
        if self.big {
            bytes.reverse();
        }
        self.bytes[at..at + bytes.len()].copy_from_slice(&bytes);
        self
    }

    fn real(&mut self, at: [usize; 2], index: usize, value: f64) -> &mut Self {
        if self.version == 1 {
            self.put(at[0] + 4 * index, &(value as f32).to_le_bytes())
        } else {
            self.put(at[1] + 8 * index, &value.to_le_bytes())
        }
    }

    pub fn dim(&mut self, index: usize, value: i64) -> &mut Self {
        if self.version == 1 {
            self.put(40 + 2 * index, &(value as i16).to_le_bytes())
        } else {
            self.put(16 + 8 * index, &value.to_le_bytes())
        }
    }

    pub fn datatype(&mut self, code: i16, bits: i16) -> &mut Self {
        let at = if self.version == 1 { 70 } else { 12 };
        self.put(at, &code.to_le_bytes())
            .put(at + 2, &bits.to_le_bytes())
    }

    pub fn pixdim(&mut self, index: usize, value: f64) -> &mut Self {
        self.real([76, 104], index, value)
    }

    pub fn vox_offset(&mut self, value: f64) -> &mut Self {
        if self.version == 1 {
            self.put(108, &(value as f32).to_le_bytes())
        } else {
            self.put(168, &(value as i64).to_le_bytes())
        }
    }

    pub fn scale(&mut self, slope: f64, intercept: f64) -> &mut Self {
        self.real([112, 176], 0, slope)
            .real([116, 184], 0, intercept)
    }

    fn code(&mut self, at: [usize; 2], code: i16) -> &mut Self {
        if self.version == 1 {
            self.put(at[0], &code.to_le_bytes())
        } else {
            self.put(at[1], &i32::from(code).to_le_bytes())
        }
    }

    /// b, c, d and the origin.
    pub fn qform(&mut self, code: i16, numbers: [f64; 6]) -> &mut Self {
        self.code([252, 344], code);
        for (index, number) in numbers.into_iter().enumerate() {
            self.real([256, 352], index, number);
        }
        self
    }

    /// Three rows of four.
    pub fn sform(&mut self, code: i16, rows: [f64; 12]) -> &mut Self {
        self.code([254, 348], code);
        for (index, number) in rows.into_iter().enumerate() {
            self.real([280, 400], index, number);
        }
        self
    }

    /// The file: header and voxels.
    pub fn with(&self, voxels: &[u8]) -> Vec<u8> {
        [&self.bytes, voxels].concat()
    }

    /// Twelve voxels of type i16: −5, −4, … 6.
    pub fn file(&self) -> Vec<u8> {
        let voxels = (-5_i16..7).flat_map(|v| match self.big {
            true => v.to_be_bytes(),
            false => v.to_le_bytes(),
        });
        self.with(&voxels.collect::<Vec<u8>>())
    }
}

/// An NRRD header: the fields that must be there, and further lines.
pub fn nrrd_header(voxel_type: &str, encoding: &str, lines: &str) -> String {
    format!(
        "NRRD0004\n# a comment\ntype: {voxel_type}\ndimension: 3\nsizes: 3 2 2\n\
         encoding: {encoding}\nendian: little\n{lines}"
    )
}

/// A small valid file of every kind that a reader has, by the name of the reader: files, and which
/// of them to load.
pub fn seeds(reader: &str) -> Vec<(Files, String)> {
    let mut seeds = Vec::new();
    let mut add = |name: &str, files: Files| seeds.push((files, name.to_owned()));
    let shorts: Vec<u8> = (-5_i16..7).flat_map(i16::to_le_bytes).collect();
    let floats: Vec<u8> = (0..12)
        .flat_map(|i| {
            let value = if i == 7 { f32::NAN } else { i as f32 * 0.5 };
            value.to_le_bytes()
        })
        .collect();
    match reader {
        "nrrd" => {
            let directions = "space: left-posterior-superior\n\
                              space directions: (1,0,0) (0,2,0) (0,0,3)\nspace origin: (5,6,7)\n\
                              kinds: domain domain domain\nkey:=value\n";
            let raw = nrrd_header("short", "raw", directions) + "\n";
            add("a.nrrd", one("a.nrrd", [raw.as_bytes(), &shorts].concat()));
            let zip = nrrd_header("float", "gzip", "spacings: 1 nan 0.5\n") + "\n";
            let zipped = [zip.as_bytes(), &gzip(&floats)].concat();
            add("a.nrrd", one("a.nrrd", zipped));
            for (encoding, data) in [("raw", floats.clone()), ("gzip", gzip(&floats))] {
                let lines = "data file: a.raw\nline skip: 0\nbyte skip: -1\n";
                let mut files = one("a.nhdr", nrrd_header("float", encoding, lines));
                files.insert("a.raw".into(), data);
                add("a.nhdr", files);
            }
        }
        "nifti" => {
            for version in [1, 2] {
                for big in [false, true] {
                    let mut nifti = Nifti::new(version, big);
                    nifti
                        .scale(2.0, -1.0)
                        .qform(1, [0.1, 0.2, 0.3, 1.0, 2.0, 3.0]);
                    let rows = [1., 0., 0., 4., 0., 2., 0., 5., 0., 0., 3., 6.];
                    nifti.sform(2, rows);
                    add("a.nii", one("a.nii", nifti.file()));
                    add("a.nii.gz", one("a.nii.gz", gzip(&nifti.file())));
                }
            }
            let mut header = Nifti::new(1, false);
            header.bytes[344..348].copy_from_slice(b"ni1\0");
            let mut files = one("a.hdr", header.vox_offset(0.0).bytes.clone());
            files.insert("a.img".into(), shorts);
            add("a.hdr", files.clone());
            add("a.img", files);
        }
        "raw" => {
            for (compression, file) in [("none", "a.raw"), ("gzip", "a.raw.gz")] {
                let json = format!(
                    r#"{{"format": "raywright-raw-1", "file": "{file}", "type": "f32",
                    "compression": "{compression}", "endian": "little", "dims": [3, 2, 2],
                    "spacing": [1, 2, 3], "origin": [0, 0, 1], "order": "x fastest",
                    "slope": 2, "intercept": 1, "bytes_uncompressed": 48}}"#
                );
                let mut files = one("a.json", json);
                let data = match compression {
                    "none" => floats.clone(),
                    _ => gzip(&floats),
                };
                files.insert(file.into(), data);
                add("a.json", files);
            }
        }
        "view" => {
            let json = r#"{"transfer_functions": {"sparse": [[0,0,0,0,0],[2.5,1,0.5,0,0.3],[2.5,1,1,1,1]]},
                "cameras": {"close": {"position": [1,2,3], "focal": [0,0,0], "up": [0,0,1], "vfov_deg": 50}}}"#;
            add("a.view.json", one("a.view.json", json));
        }
        _ => {}
    }
    seeds
}
