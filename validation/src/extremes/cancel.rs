//! T23: builds that are stopped, and callbacks that panic. Waits are times, and the best of some tries: others use the
//! machine too.

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use raywright_bvh::{
    Accuracy, BuildControl, BuildError, BuildParams, BuildWorkspace, Bvh, Ray, TriangleMesh,
};

use super::{
    ExtremesError, Findings, Settings, meshes,
    modes::{QUALITIES, bits, with},
};

/// How soon a cancelled build must end.
const SOON: Duration = Duration::from_millis(10);

/// How often each wait is measured.
const TRIES: u32 = 5;

/// T23.
pub(super) fn cancel(settings: &Settings, findings: &mut Findings) -> Result<(), ExtremesError> {
    let mesh = meshes::random_soup((settings.rays * 5).clamp(10_000, 200_000), 23)?;
    let count = mesh.triangles().len();
    let ray = Ray::new([0.0, 0.0, -3.0], [0.01, 0.02, 1.0]);
    for quality in QUALITIES {
        let params = with(quality, 8, Accuracy::Robust);
        let mut workspace = BuildWorkspace::default();
        let start = Instant::now();
        let old = Bvh::build_in(&[&mesh], &params, &mut workspace)?;
        let whole = start.elapsed();
        let before = bits(old.closest_hit(&ray));
        let mut waits = Vec::new();
        for k in 0..8 {
            // The best of some: others use the machine.
            let mut best = None;
            for _ in 0..TRIES {
                let after = whole.mul_f64(0.1 * f64::from(k));
                let wait = cancelled_after(after, &mesh, &params, &mut workspace);
                findings.faults.extend(wait.as_ref().err().cloned());
                best = best.into_iter().chain(wait.ok().flatten()).min();
            }
            waits.extend(best);
        }
        let longest = waits.iter().max().copied().unwrap_or_default();
        // Few rays are for tests, which run beside others: no clock is to be trusted there.
        findings.demand(longest <= SOON || settings.are_few(), || {
            format!("{quality:?}: a cancelled build of {count} triangles ends after {longest:?}")
        });
        findings.figure(
            format!("{quality:?}, {count} triangles: longest wait for the end"),
            format!(
                "{:.2} ms of {:.0}",
                1e3 * longest.as_secs_f64(),
                1e3 * whole.as_secs_f64()
            ),
            "",
        );
        panicking(&mesh, &params, &mut workspace, findings);
        workspace.control = BuildControl::default();
        let again = Bvh::build_in(&[&mesh], &params, &mut workspace)?;
        let same = [&old, &again].map(|tree| bits(tree.closest_hit(&ray))) == [before; 2];
        findings.demand(same && again.stats() == old.stats(), || {
            format!("{quality:?}: trees before and after a cancelled build differ")
        });
    }
    findings.deviates(
        "a panic of the caller's own callback is passed on to the caller, not turned into an error",
    );
    Ok(())
}

/// Cancels a build from another thread; how long it goes on then. None if it was done before.
fn cancelled_after(
    after: Duration,
    mesh: &TriangleMesh,
    params: &BuildParams,
    workspace: &mut BuildWorkspace,
) -> Result<Option<Duration>, String> {
    let cancelled = Arc::new(AtomicBool::new(false));
    workspace.control = BuildControl {
        cancelled: Some(cancelled.clone()),
        ..BuildControl::default()
    };
    let (result, end, told) = thread::scope(|scope| {
        let teller = scope.spawn(move || {
            thread::sleep(after);
            let now = Instant::now();
            cancelled.store(true, Ordering::Relaxed);
            now
        });
        let result = Bvh::build_in(&[mesh], params, workspace);
        let end = Instant::now();
        (result, end, teller.join())
    });
    let told = told.map_err(|_| "the thread that cancels panicked".to_owned())?;
    match result {
        Ok(_) => Ok(None),
        Err(BuildError::Cancelled) => Ok(Some(end.saturating_duration_since(told))),
        Err(error) => Err(format!("a cancelled build says {error}")),
    }
}

/// A callback that panics: the caller gets the panic, and workspace and threads go on.
fn panicking(
    mesh: &TriangleMesh,
    params: &BuildParams,
    workspace: &mut BuildWorkspace,
    findings: &mut Findings,
) {
    /// Carries no message, so that it is not mistaken for a fault of the engine.
    struct OfCaller;
    workspace.control = BuildControl {
        progress: Some(Arc::new(|_, _| {
            std::panic::resume_unwind(Box::new(OfCaller))
        })),
        ..BuildControl::default()
    };
    let result = catch_unwind(AssertUnwindSafe(|| {
        Bvh::build_in(&[mesh], params, workspace).map(|_| ())
    }));
    let is_passed_on = result.is_err_and(|payload| payload.is::<OfCaller>());
    findings.demand(is_passed_on, || {
        format!("{:?}: the panic of a callback is lost", params.quality)
    });
}
