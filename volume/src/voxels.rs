//! Raw voxel values in memory, of the narrowest type that holds those of the file.

/// Items that a volume keeps behind its last voxel: words of four bytes are read where two voxels
/// are wanted.
pub(crate) const PADDING: usize = 3;

/// Raw values, x fastest, then y, then z.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Voxels {
    /// 8 bits without sign.
    U8(Vec<u8>),
    /// 16 bits without sign.
    U16(Vec<u16>),
    /// Floating point; what is not finite is replaced when a [`Volume`](crate::grid::Volume) is made.
    F32(Vec<f32>),
}

impl Voxels {
    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::U8(values) => values.len(),
            Self::U16(values) => values.len(),
            Self::F32(values) => values.len(),
        }
    }

    /// Adds what is read beyond the end.
    pub(crate) fn pad(&mut self) {
        match self {
            Self::U8(values) => values.extend([0; PADDING]),
            Self::U16(values) => values.extend([0; PADDING]),
            Self::F32(values) => values.extend([0.0; PADDING]),
        }
    }

    /// The first `len` of them.
    pub(crate) fn slice(&self, len: usize) -> VoxelSlice<'_> {
        match self {
            Self::U8(values) => VoxelSlice::U8(&values[..len]),
            Self::U16(values) => VoxelSlice::U16(&values[..len]),
            Self::F32(values) => VoxelSlice::F32(&values[..len]),
        }
    }

    /// The smallest and largest value that is not NaN; `None` if there is none.
    pub(crate) fn range(&self) -> Option<[f32; 2]> {
        fn of<T: Copy + PartialOrd>(values: &[T]) -> Option<[T; 2]> {
            // Only NaN cannot be compared with itself.
            let mut finite = values
                .iter()
                .copied()
                .filter(|v| v.partial_cmp(v).is_some());
            let first = finite.next()?;
            Some(finite.fold([first; 2], |[low, high], v| {
                [
                    if v < low { v } else { low },
                    if v > high { v } else { high },
                ]
            }))
        }
        match self {
            Self::U8(values) => Some(of(values)?.map(f32::from)),
            Self::U16(values) => Some(of(values)?.map(f32::from)),
            Self::F32(values) => of(values),
        }
    }
}

/// Raw values of a volume, x fastest, then y, then z.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum VoxelSlice<'a> {
    /// 8 bits without sign.
    U8(&'a [u8]),
    /// 16 bits without sign.
    U16(&'a [u16]),
    /// Floating point; finite or NaN.
    F32(&'a [f32]),
}

impl VoxelSlice<'_> {
    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::U8(values) => values.len(),
            Self::U16(values) => values.len(),
            Self::F32(values) => values.len(),
        }
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The type of each, by its name in Rust.
    #[must_use]
    pub fn type_name(&self) -> &'static str {
        match self {
            Self::U8(_) => "u8",
            Self::U16(_) => "u16",
            Self::F32(_) => "f32",
        }
    }

    /// Bytes of memory.
    #[must_use]
    pub fn bytes(&self) -> usize {
        match self {
            Self::U8(values) => size_of_val(&values[..]),
            Self::U16(values) => size_of_val(&values[..]),
            Self::F32(values) => size_of_val(&values[..]),
        }
    }

    /// The raw value at a place, as a number.
    ///
    /// # Panics
    /// If there is no such place.
    #[must_use]
    pub fn get(&self, index: usize) -> f32 {
        match self {
            Self::U8(values) => values[index].into(),
            Self::U16(values) => values[index].into(),
            Self::F32(values) => values[index],
        }
    }
}
