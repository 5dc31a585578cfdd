//! What the benchmarks share: rays as a path tracer shoots them, measurement in turns, tables.
//!
//! Method: engines trace the same rays in the same order; results are compared before times are
//! believed; rounds are taken in turns, beginning with another engine each time; a figure is the
//! ratio to the first engine within a round, as median and quartiles. Which clock is used is said
//! beside each table; wall time wants a quiet machine.
#![forbid(unsafe_code)]

pub mod clock;
pub mod goals;
pub mod rays;
pub mod recordings;
pub mod scenes;
pub mod turns;
