//! What `raywright tune --store` remembers: which machine and which scene times belong to.

use std::{
    path::Path,
    process,
    time::{SystemTime, UNIX_EPOCH},
};

use raywright::{
    bvh::{BuildParams, PARAMETERS},
    tracer::Indicators,
    tune::{Memory, ParameterSpace, Settings, described, indicator_facts},
    tuner::store::{Fact, Facts, Machine, Scene, Store, SyncPolicy, WriterId},
};
use sysinfo::{CpuRefreshKind, RefreshKind, System};

use super::{Failure, scene::Stage};

/// Seconds since 1970.
pub(crate) fn now() -> Result<f64, Failure> {
    Ok(SystemTime::now().duration_since(UNIX_EPOCH)?.as_secs_f64())
}

/// The memory of a run in the store of a folder, which is made if there is none. Parameters in `fixed` have
/// their value in `base`.
pub(crate) fn open(
    folder: &Path,
    space: &ParameterSpace,
    base: &BuildParams,
    fixed: &[&str],
    stage: &Stage,
    settings: &Settings,
) -> Result<Memory, Failure> {
    let time = now()?;
    let store = Store::open(folder)?;
    let nanoseconds = (time * 1e9) as u64;
    let id = WriterId::new(&format!("tune-{nanoseconds:x}-{:x}", process::id()))?;
    let writer = store.writer(&id, SyncPolicy::EachRecord)?;
    Ok(Memory::new(
        &store,
        writer,
        time,
        space.space(),
        machine(settings),
        scene(base, fixed, stage, settings),
    )?)
}

/// What runs the frames.
fn machine(settings: &Settings) -> Machine {
    let refresh = RefreshKind::nothing().with_cpu(CpuRefreshKind::nothing());
    let system = System::new_with_specifics(refresh);
    let processor = system.cpus().first().map_or("unknown", |cpu| cpu.brand());
    let text = |text: &str| Fact::from(text.trim());
    let name = |name: &str| name.to_owned();
    Machine::new(Facts::from([
        (name("processor"), text(processor)),
        (name("cores"), Fact::from(system.cpus().len() as i64)),
        (
            name("threads"),
            Fact::from(rayon::current_num_threads() as i64),
        ),
        (name("instruction_set"), text(settings.isa.name())),
        (name("architecture"), text(std::env::consts::ARCH)),
        (name("system"), text(std::env::consts::OS)),
        (
            name("engine"),
            text(concat!("raywright ", env!("CARGO_PKG_VERSION"))),
        ),
    ]))
}

/// What is rendered, and all that is not searched.
fn scene(base: &BuildParams, fixed: &[&str], stage: &Stage, settings: &Settings) -> Scene {
    let scene = stage.world.scene();
    let camera = stage.camera;
    let mut facts = Facts::from([
        ("name".to_owned(), Fact::from(stage.name.as_str())),
        (
            "triangles".to_owned(),
            Fact::from(scene.triangle_count() as i64),
        ),
        ("width".to_owned(), Fact::from(i64::from(settings.width))),
        ("height".to_owned(), Fact::from(i64::from(settings.height))),
        (
            "path_length".to_owned(),
            Fact::from(i64::from(settings.path_length)),
        ),
    ]);
    facts.extend(indicator_facts(&Indicators::of(scene, &camera)));
    // What is not searched is part of what is measured.
    let is_fixed = |name: &str| {
        let parameter = PARAMETERS.iter().find(|p| p.name == name);
        fixed.contains(&name) || parameter.is_some_and(|p| p.changes_hits)
    };
    for (name, value) in described(base) {
        if is_fixed(&name) {
            facts.insert(format!("fixed {name}"), Fact::Text(value));
        }
    }
    Scene::new(facts)
}
