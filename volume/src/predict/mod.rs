//! What a frame will take, before it is drawn.

mod krls;
mod symmetric;

pub use krls::{Krls, KrlsError, KrlsParams, KrlsPrediction, Learned};
