//! From boxes of primitives to a binary or wide tree of records, whatever the layout in memory
//! that is made of it afterwards.

pub(crate) mod binning;
pub(crate) mod partition;
pub(crate) mod primitive;
pub(crate) mod record;
pub(crate) mod recursion;
pub(crate) mod tasks;

/// The temporary memory of a build, for reuse by the next one.
#[derive(Debug, Default)]
pub struct BuildWorkspace {
    pub(crate) references: Vec<primitive::PrimitiveRef>,
    pub(crate) scratch: Vec<primitive::PrimitiveRef>,
    pub(crate) leaf_ids: Vec<u32>,
    pub(crate) records: Vec<record::Record>,
}

impl BuildWorkspace {
    /// Bytes held for the next build.
    #[must_use]
    pub fn bytes(&self) -> usize {
        (self.references.capacity() + self.scratch.capacity())
            * size_of::<primitive::PrimitiveRef>()
            + self.leaf_ids.capacity() * size_of::<u32>()
            + self.records.capacity() * size_of::<record::Record>()
    }
}
