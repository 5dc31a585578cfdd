//! The few ways in which a build uses threads, each with a serial form for builds without the
//! feature `parallel`. Results never depend on the number of threads.

use crate::error::BuildError;

/// Ranges below this are built by the thread that has them: a task costs about a microsecond, a
/// range of this size some hundred.
pub(crate) const TASK_SIZE: usize = 4096;

/// Ranges from this size on are binned and partitioned in pieces of [`PIECE_SIZE`] by all threads.
pub(crate) const PIECES_FROM: usize = 1 << 16;

/// Size of a piece.
pub(crate) const PIECE_SIZE: usize = 1 << 14;

/// Runs both, at the same time if the pool has several threads. A single one would only hand the
/// work to itself.
#[cfg(feature = "parallel")]
pub(crate) fn join<A: Send, B: Send>(
    a: impl FnOnce() -> A + Send,
    b: impl FnOnce() -> B + Send,
) -> (A, B) {
    if threads() > 1 {
        rayon::join(a, b)
    } else {
        (a(), b())
    }
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

/// Whether what is below a node of `n` references is worth being given to several threads.
pub(crate) fn is_task(n: usize) -> bool {
    n >= TASK_SIZE && threads() > 1
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

/// Treats the items piece by piece.
pub(crate) fn for_each_piece<T: Send>(items: &mut [T], treat: &(impl Fn(&mut [T]) + Sync)) {
    for_each_piece_of(items, PIECE_SIZE, treat);
}

/// Treats the items in pieces of at most `size`, which is not 0.
pub(crate) fn for_each_piece_of<T: Send>(
    items: &mut [T],
    size: usize,
    treat: &(impl Fn(&mut [T]) + Sync),
) {
    if items.len() <= size {
        return treat(items);
    }
    let (left, right) = items.split_at_mut(items.len() / 2);
    join(
        || for_each_piece_of(left, size, treat),
        || for_each_piece_of(right, size, treat),
    );
}

/// Treats the items piece by piece until one fails; tells of each piece where it begins, `begin`
/// being the place of the first item.
pub(crate) fn try_for_each_piece_from<T: Send>(
    begin: usize,
    items: &mut [T],
    treat: &(impl Fn(usize, &mut [T]) -> Result<(), BuildError> + Sync),
) -> Result<(), BuildError> {
    if items.len() <= PIECE_SIZE {
        return treat(begin, items);
    }
    let middle = items.len() / 2;
    let (left, right) = items.split_at_mut(middle);
    let (left, right) = join(
        || try_for_each_piece_from(begin, left, treat),
        || try_for_each_piece_from(begin + middle, right, treat),
    );
    left.and(right)
}

/// Fills each result from its job, at the same time where jobs are large. `memory` goes from job
/// to job; another thread gets memory of its own. A failure of an earlier job hides those of later
/// ones.
pub(crate) fn fill_from_jobs<J: Send, T: Send, M: Default + Send, E: Send>(
    jobs: &mut [Option<J>],
    results: &mut [T],
    memory: &mut M,
    size: &(impl Fn(&J) -> usize + Sync),
    run: &(impl Fn(J, &mut M) -> Result<T, E> + Sync),
) -> Result<(), E> {
    let total: usize = jobs.iter().flatten().map(size).sum();
    if total < TASK_SIZE || jobs.len() == 1 {
        for (job, result) in jobs.iter_mut().zip(results) {
            if let Some(job) = job.take() {
                *result = run(job, memory)?;
            }
        }
        return Ok(());
    }
    let middle = jobs.len() / 2;
    let (jobs_a, jobs_b) = jobs.split_at_mut(middle);
    let (results_a, results_b) = results.split_at_mut(middle);
    let (a, b) = join(
        || fill_from_jobs(jobs_a, results_a, memory, size, run),
        || fill_from_jobs(jobs_b, results_b, &mut M::default(), size, run),
    );
    a.and(b)
}
