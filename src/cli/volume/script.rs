//! What the scripted sequence shows of a volume.

use raywright::{
    imaging::Camera,
    volume::{View, Volume, presets as looks, sequence::script::Views},
};

use super::source::{VolumeOptions, VolumeStage};
use crate::cli::Failure;

/// Two transfer functions and two cameras.
pub(super) fn views(options: &VolumeOptions, stage: &VolumeStage) -> Result<Views, Failure> {
    if let Some(view) = &stage.view {
        return own_views(view, &stage.volume);
    }
    let path = View::path_for(options.volume.as_ref());
    Views::of(&View::read(&path)?).ok_or_else(|| {
        Failure::with_hint(
            anyhow::anyhow!("{} has too few views", path.display()),
            "it needs transfer functions sparse and dense, and cameras overview and close",
        )
    })
}

/// Of a generated volume.
fn own_views(view: &View, volume: &Volume) -> Result<Views, Failure> {
    let [low, high] = volume.range();
    let at = |share: f32| low + (high - low) * share;
    let parts = (
        view.transfer_functions.get("own"),
        view.cameras.get("overview"),
        looks::preset("fire", [at(0.55), at(0.8)]),
    );
    let (Some(dense), Some(overview), Some(sparse)) = parts else {
        return Err(anyhow::anyhow!("a generated volume without a view").into());
    };
    Ok(Views {
        sparse,
        dense: dense.clone(),
        overview: *overview,
        close: Camera {
            origin: overview.target + (overview.origin - overview.target) * 0.3,
            ..*overview
        },
    })
}
