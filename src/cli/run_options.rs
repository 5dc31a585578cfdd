//! Options that several commands share: threads, instruction set, BVH parameters, interruption.

use clap::Args;
use raywright::{
    bvh::{BuildParams, Isa, PARAMETERS, Parameter, ParameterRange},
    imaging::CancelToken,
};

use super::Failure;

/// How to run.
#[derive(Clone, Debug, Args)]
pub(crate) struct RunOptions {
    /// Threads that build and render; 0 for all
    #[arg(long, default_value_t = 0, env = "RAYWRIGHT_THREADS")]
    pub(crate) threads: usize,
    /// Instruction set of the traversal kernels: portable, avx2 or avx512; the best by default
    #[arg(long, env = "RAYWRIGHT_ISA", value_parser = isa)]
    pub(crate) isa: Option<Isa>,
}

impl RunOptions {
    /// The instruction set to use.
    pub(crate) fn isa(&self) -> Isa {
        self.isa.unwrap_or_else(Isa::best)
    }

    /// Runs `work` in a pool of the threads asked for.
    pub(crate) fn install<T: Send>(
        &self,
        work: impl FnOnce() -> Result<T, Failure> + Send,
    ) -> Result<T, Failure> {
        rayon::ThreadPoolBuilder::new()
            .num_threads(self.threads)
            .build()?
            .install(work)
    }
}

fn isa(name: &str) -> Result<Isa, String> {
    let known = || Isa::ALL.map(Isa::name).join(", ");
    let isa = Isa::by_name(name).ok_or_else(|| format!("known are {}", known()))?;
    if isa.is_available() {
        Ok(isa)
    } else {
        Err("this machine does not have it".into())
    }
}

/// Parameters of batches of rays. Every command traces one ray at a time, so they are none of its options.
const OF_BATCHES: [&str; 2] = ["rays_in_flight", "ray_packets"];

/// The parameters that commands have.
fn parameters() -> impl Iterator<Item = &'static Parameter> {
    PARAMETERS
        .iter()
        .filter(|parameter| !OF_BATCHES.contains(&parameter.name))
}

/// BVH parameters on a command line.
#[derive(Clone, Debug, Default, Args)]
pub(crate) struct ParameterOptions {
    /// Set a BVH parameter, for example -D branching_factor=4; may be repeated (tune does not search it then)
    #[arg(short = 'D', value_name = "NAME=VALUE")]
    parameters: Vec<String>,
}

impl ParameterOptions {
    /// Whether none was given.
    pub(crate) fn is_empty(&self) -> bool {
        self.parameters.is_empty()
    }

    /// `base` with the parameters that were given, checked.
    pub(crate) fn applied_to(&self, base: BuildParams) -> Result<BuildParams, Failure> {
        let mut params = base;
        for (name, value) in self.split() {
            let Some(value) = value else {
                return Err(Failure::with_hint(
                    anyhow::anyhow!("-D {name} has no value"),
                    "write -D NAME=VALUE",
                ));
            };
            if OF_BATCHES.contains(&name) {
                return Err(Failure::with_hint(
                    anyhow::anyhow!(
                        "{name} acts on rays that a program traces in batches; commands trace them one at a time"
                    ),
                    parameter_names(),
                ));
            }
            params
                .set(name, value)
                .map_err(|fault| Failure::with_hint(fault, hint(name)))?;
        }
        params.validate().map_err(|faults| {
            let text: Vec<String> = faults.iter().map(ToString::to_string).collect();
            Failure::with_hint(anyhow::anyhow!(text.join("; ")), parameter_names())
        })?;
        Ok(params)
    }

    /// The names that were given.
    pub(crate) fn names(&self) -> Vec<&str> {
        self.split().map(|(name, _)| name).collect()
    }

    fn split(&self) -> impl Iterator<Item = (&str, Option<&str>)> {
        self.parameters
            .iter()
            .map(|text| match text.split_once('=') {
                Some((name, value)) => (name.trim(), Some(value.trim())),
                None => (text.trim(), None),
            })
    }
}

/// The parameter table, for help.
pub(crate) fn parameter_help() -> String {
    let default = BuildParams::default();
    let rows = parameters().map(|parameter| {
        let range = match parameter.range {
            ParameterRange::Integers(min, max) => format!("{min}..={max}"),
            ParameterRange::Reals(min, max) => format!("{min}..={max} (real)"),
            ParameterRange::OneOf(values) => values
                .iter()
                .map(ToString::to_string)
                .collect::<Vec<_>>()
                .join("|"),
            ParameterRange::Words(words) => words.join("|"),
        };
        let value = default
            .get(parameter.name)
            .map_or_else(String::new, |value| value.to_string());
        format!(
            "  {:<18} {:<16} [{value}] {}\n",
            parameter.name, range, parameter.meaning
        )
    });
    format!(
        "BVH parameters for -D: values, [default], meaning\n{}",
        rows.collect::<String>()
    )
}

/// Advice for a name that is none: the nearest one that is.
fn hint(name: &str) -> String {
    let nearest = parameters()
        .map(|p| p.name)
        .min_by_key(|known| edit_distance(name, known));
    match nearest {
        Some(nearest) if nearest != name && edit_distance(name, nearest) <= 4 => {
            format!("did you mean {nearest}?")
        }
        _ => parameter_names(),
    }
}

fn parameter_names() -> String {
    let names: Vec<&str> = parameters().map(|p| p.name).collect();
    format!("parameters are {}", names.join(", "))
}

/// Single-letter changes that turn one word into the other (Levenshtein).
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, from) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, &to) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(from != to);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

/// A token that Ctrl-C sets; a second Ctrl-C ends the process at once.
pub(crate) fn cancel_on_interrupt() -> Result<CancelToken, Failure> {
    let token = CancelToken::new();
    let handle = token.clone();
    ctrlc::set_handler(move || {
        if handle.is_cancelled() {
            std::process::exit(130);
        }
        handle.cancel();
        eprintln!("\nstopping after what is under way; press again to end at once");
    })?;
    Ok(token)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edit_distance_counts_changes() {
        assert_eq!(edit_distance("max_dept", "max_depth"), 1);
        assert_eq!(edit_distance("kitten", "sitting"), 3);
        assert_eq!(edit_distance("", "abc"), 3);
    }

    #[test]
    fn a_misspelt_name_gets_a_suggestion() {
        assert_eq!(hint("branching_facto"), "did you mean branching_factor?");
        assert!(hint("xyz").starts_with("parameters are quality, "));
    }
}
