//! Flags that say how empty space is left out.

use clap::{Args, ValueEnum};
use raywright::volume::{CastOptions, EnclosureKind, EnclosureParams, Prepared, Skipping};

use crate::cli::{Failure, run_options::ParameterOptions};

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Skip {
    /// Take every sample of the box
    None,
    /// Jump by the distance to what can be seen
    Distance,
    /// From the first to the last face around what can be seen, by a tree of triangles
    Hull,
    /// All parts of a ray in blocks in which something can be seen, by a tree of boxes
    Segments,
}

#[derive(Debug, Args)]
pub(crate) struct SkipOptions {
    /// How empty space is left out; changes no pixel
    #[arg(long, value_enum, default_value_t = Skip::Distance)]
    skipping: Skip,
    /// Cells along the edge of the blocks of a hull or segments: 4, 8, 16 (default) and so on
    #[arg(long)]
    block_edge: Option<u32>,
    #[command(flatten)]
    parameters: ParameterOptions,
}

impl SkipOptions {
    /// Builds what is asked for and says so in the options of pictures.
    pub(crate) fn apply(
        &self,
        prepared: &mut Prepared<'_>,
        options: &mut CastOptions,
    ) -> Result<(), Failure> {
        let kind = match self.skipping {
            Skip::None => {
                options.skipping = Skipping::None;
                return self.without_tree();
            }
            Skip::Distance => {
                options.skipping = Skipping::Distance;
                return self.without_tree();
            }
            Skip::Hull => EnclosureKind::Hull,
            Skip::Segments => EnclosureKind::Segments,
        };
        let mut params = EnclosureParams::new(kind);
        params.block_edge = self.block_edge.unwrap_or(params.block_edge);
        params.build = self.parameters.applied_to(params.build)?;
        prepared.enclose(&params, &mut Default::default())?;
        options.skipping = Skipping::Enclosure;
        Ok(())
    }

    /// Refuses what only a tree has a use for.
    fn without_tree(&self) -> Result<(), Failure> {
        if self.block_edge.is_none() && self.parameters.is_empty() {
            return Ok(());
        }
        Err(Failure::with_hint(
            anyhow::anyhow!("there is no tree that --block-edge and -D could be about"),
            "give --skipping hull or --skipping segments too",
        ))
    }
}
