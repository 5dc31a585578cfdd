//! Which values of which parameters.

use raywright_bvh::BuildParams;

/// The values of one parameter, in the order of their numbers; words in the order of Embree's own numbers.
#[derive(Debug, PartialEq)]
pub struct Sweep {
    /// A parameter of [`PARAMETERS`](raywright_bvh::PARAMETERS).
    pub parameter: &'static str,
    /// Its values, as [`BuildParams::set`] reads them.
    pub values: &'static [&'static str],
    /// Where the other parameters stay.
    pub(super) base: Base,
}

/// Where parameters stay.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Base {
    /// The defaults of `rtcBuildBVH`.
    Builder,
    /// The same, with spatial splits.
    Splits,
    /// Embree's scene of medium quality.
    Scene,
}

const COSTS: &[&str] = &["0.25", "0.5", "1", "2", "4", "8"];

/// Embree's eleven in the order of our table, then the room for references that spatial splits make
/// (`primitiveArrayCapacity`).
pub const SWEEPS: [Sweep; 12] = [
    builder("quality", &["morton", "binned-sah", "spatial-splits"]),
    builder("branching_factor", &["2", "4", "8", "16"]),
    builder("max_depth", &["18", "22", "26", "32", "48"]),
    builder("sah_block_size", &["1", "2", "4", "8", "16", "32"]),
    builder("min_leaf_size", &["1", "2", "4", "8", "16", "32"]),
    builder("max_leaf_size", &["1", "2", "4", "8", "16", "32"]),
    builder("traversal_cost", COSTS),
    builder("intersection_cost", COSTS),
    scene("dynamics", &["dynamic", "static"]),
    scene("leaf_format", &["edges", "compact"]),
    scene("accuracy", &["fast", "robust"]),
    Sweep {
        parameter: "split_budget",
        values: &["1", "1.1", "1.2", "1.5", "2"],
        base: Base::Splits,
    },
];

const fn builder(parameter: &'static str, values: &'static [&'static str]) -> Sweep {
    Sweep {
        parameter,
        values,
        base: Base::Builder,
    }
}

const fn scene(parameter: &'static str, values: &'static [&'static str]) -> Sweep {
    Sweep {
        parameter,
        values,
        base: Base::Scene,
    }
}

impl Sweep {
    /// Where the other parameters stay.
    #[must_use]
    pub fn base(&self) -> BuildParams {
        let mut params = match self.base {
            Base::Scene => BuildParams::embree_scene_medium(),
            Base::Builder | Base::Splits => BuildParams::embree_api_default(),
        };
        if self.base == Base::Splits {
            params.quality = raywright_bvh::Quality::SpatialSplits;
        }
        params
    }

    /// The parameters with a value of the sweep.
    ///
    /// # Panics
    /// If there is no such value.
    #[must_use]
    pub fn params(&self, place: usize) -> BuildParams {
        let mut params = self.base();
        params
            .set(self.parameter, self.values[place])
            .expect("values of the table are understood");
        params
    }

    /// Whether it is a flag of Embree's scenes.
    #[must_use]
    pub fn is_flag(&self) -> bool {
        self.base == Base::Scene
    }
}

#[cfg(test)]
mod tests {
    use raywright_bvh::PARAMETERS;

    use super::*;

    #[test]
    fn the_eleven_are_swept_in_order_over_values_that_are_valid() {
        let eleven = PARAMETERS[..11].iter().map(|parameter| parameter.name);
        assert!(eleven.eq(SWEEPS[..11].iter().map(|sweep| sweep.parameter)));
        for sweep in &SWEEPS {
            let texts = (0..sweep.values.len()).map(|place| {
                let params = sweep.params(place);
                assert_eq!(params.validate(), Ok(()), "{sweep:?}");
                params.get(sweep.parameter).unwrap().to_string()
            });
            assert!(texts.eq(sweep.values.iter().copied()), "{sweep:?}");
        }
    }
}
