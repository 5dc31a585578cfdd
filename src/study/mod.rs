//! Studies: what knobs do, measured. They use the engine as anybody would, and read the clock.

pub mod steering;
pub mod tradeoff;
