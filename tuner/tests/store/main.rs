//! The store: damage, merging, killed writers, queries, the file format.

mod common;
mod damage;
mod format;
mod kill;
mod merge;
mod query;
mod writer;
