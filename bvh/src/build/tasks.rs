//! The few ways in which a build uses threads, each with a serial form for builds without the
//! feature `parallel`. Results never depend on the number of threads.

/// Ranges below this are built by the thread that has them: a task costs about a microsecond, a
/// range of this size some hundred.
pub(crate) const TASK_SIZE: usize = 4096;

/// Ranges from this size on are binned and partitioned in pieces of [`PIECE_SIZE`] by all threads.
pub(crate) const PIECES_FROM: usize = 1 << 16;

/// Size of a piece.
pub(crate) const PIECE_SIZE: usize = 1 << 14;

/// Runs both, at the same time if the pool has threads.
#[cfg(feature = "parallel")]
pub(crate) fn join<A: Send, B: Send>(
    a: impl FnOnce() -> A + Send,
    b: impl FnOnce() -> B + Send,
) -> (A, B) {
    rayon::join(a, b)
}

/// Runs both in turn.
#[cfg(not(feature = "parallel"))]
pub(crate) fn join<A: Send, B: Send>(
    a: impl FnOnce() -> A + Send,
    b: impl FnOnce() -> B + Send,
) -> (A, B) {
    (a(), b())
}

/// Whether a range of `n` is worth being divided into pieces.
pub(crate) fn in_pieces(n: usize) -> bool {
    n >= PIECES_FROM && threads() > 1
}

#[cfg(feature = "parallel")]
fn threads() -> usize {
    rayon::current_num_threads()
}

#[cfg(not(feature = "parallel"))]
fn threads() -> usize {
    1
}

/// Maps every piece and merges the results two by two.
pub(crate) fn map_merge<T: Sync, R: Send>(
    items: &[T],
    map: &(impl Fn(&[T]) -> R + Sync),
    merge: &(impl Fn(R, R) -> R + Sync),
) -> R {
    if items.len() <= PIECE_SIZE {
        return map(items);
    }
    let (left, right) = items.split_at(items.len() / 2);
    let (left, right) = join(
        || map_merge(left, map, merge),
        || map_merge(right, map, merge),
    );
    merge(left, right)
}
