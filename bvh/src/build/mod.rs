//! From boxes of primitives to a binary or wide tree of records, whatever the layout in memory
//! that is made of it afterwards.

pub(crate) mod binning;
pub(crate) mod partition;
pub(crate) mod primitive;
pub(crate) mod record;
pub(crate) mod recursion;
pub(crate) mod tasks;

/// A primitive in a leaf.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct LeafReference {
    /// Which geometry.
    pub geometry_id: u32,
    /// Which of its primitives.
    pub primitive_id: u32,
}

/// The temporary memory of a build, for reuse by the next one.
#[derive(Debug, Default)]
pub struct BuildWorkspace {
    pub(crate) references: Vec<primitive::PrimitiveRef>,
    pub(crate) scratch: Vec<primitive::PrimitiveRef>,
    pub(crate) leaves: Vec<LeafReference>,
    pub(crate) records: Vec<record::Record>,
}

impl BuildWorkspace {
    /// Bytes held for the next build.
    #[must_use]
    pub fn bytes(&self) -> usize {
        (self.references.capacity() + self.scratch.capacity())
            * size_of::<primitive::PrimitiveRef>()
            + self.leaves.capacity() * size_of::<LeafReference>()
            + self.records.capacity() * size_of::<record::Record>()
    }
}
