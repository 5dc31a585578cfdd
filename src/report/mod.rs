//! What a tuning run leaves behind for readers: a log for programs, a page for people.
//!
//! [`record`] is the data. [`log`] writes it as JSON lines while the run goes on; [`page`] makes one
//! HTML file of a whole run. The page needs no network, no script and no second file: a page that
//! was mailed or archived reads the same in ten years. Both are made from the records alone; nothing
//! in this room measures, searches or reads a clock.

pub mod log;
pub mod record;

pub(crate) mod markup;
pub(crate) mod number;
pub(crate) mod svg;

mod page;
pub mod timeline;
pub mod tradeoff;

pub use page::page;

#[cfg(test)]
pub(crate) mod example;
