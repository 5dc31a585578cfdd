//! `accuracy`: what robust hits and small leaves cost in speed, beside what they are worth.

use std::{error::Error, fmt::Write as _, path::PathBuf};

use clap::Args;
use raywright_bvh::{Accuracy, Isa, LeafFormat, TriangleMesh};
use raywright_validation::{
    extremes::{self, ABSENT, Row},
    golden,
};

use super::{Verdict, extremes::write, trees::default_data};

/// Arguments of `accuracy`.
#[derive(Debug, Args)]
#[command(after_help = "\
lost: of three closed meshes, rays from inside that hit nothing, aimed at edges, at vertices, or anywhere with the mesh
10^6 from the origin. slivers: rays at a strip of triangles 10^-7 wide that hit another than the exact one. Errors are
p50 / p99 / largest in units of 2^-24. speed: to that of the first row in the same round, median (smallest … largest).
Hits are compared before times: exit code 1 if a leaf format changes any, or if a robust ray is lost.")]
pub(crate) struct AccuracyArgs {
    /// Rays of each kind and mesh
    #[arg(long, value_name = "N", default_value_t = 40_000)]
    rays: usize,
    /// Rounds of times, of all rows in turn
    #[arg(long, value_name = "N", default_value_t = 9)]
    rounds: usize,
    /// Scenes that are timed besides the three closed meshes, by the names of their folders
    #[arg(long = "scene", value_name = "NAME")]
    scenes: Vec<String>,
    /// The folder with scenes (default: ../shared/data beside the checkout)
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Writes a table of comma-separated values
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// Measures; prints the table.
pub(crate) fn run(args: &AccuracyArgs) -> Result<Verdict, Box<dyn Error>> {
    if args.rays == 0 || args.rounds == 0 {
        return Err("--rays and --rounds must be 1 at least".into());
    }
    let folder = args
        .data
        .clone()
        .unwrap_or_else(default_data)
        .join("scenes");
    let mut scenes = Vec::new();
    for name in &args.scenes {
        let set = golden::read_obj(&folder.join(name).join(format!("{name}.obj.gz")))?;
        let count = u32::try_from(set.triangles.len())?;
        let indices = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        scenes.push(TriangleMesh::new(set.triangles.concat(), indices)?);
    }
    let rows = extremes::measure(args.rays, args.rounds, scenes)?;
    println!(
        "{} rays of each kind and mesh, {} rounds, {}",
        args.rays,
        args.rounds,
        Isa::best().name()
    );
    println!(
        "\n{:<14} {:>8} {:>8} {:>8} {:>8} {:>8}   {:<24} {:>8} {:>9} {:>9}",
        "",
        "edges",
        "vertices",
        "far away",
        "slivers",
        "unlike",
        "speed",
        "Mrays/s",
        "build ms",
        "bytes/tri"
    );
    let mut csv = "test,leaves,rays,lost_at_edges,lost_at_vertices,lost_far_away,wrong_at_slivers,unlike_first,\
        ratio_min,ratio_median,ratio_max,mrays_best,build_ms,bytes_per_triangle,\
        t_p50,t_p99,t_max,u_p50,u_p99,u_max,v_p50,v_p99,v_max\n"
        .to_owned();
    for row in &rows {
        let [test, leaves] = names(row);
        let [low, median, high] = row.ratio();
        let best = row.rates.iter().copied().fold(0.0, f64::max);
        let counts = [
            row.lost_at_edges,
            row.lost_at_vertices,
            row.lost_far_away,
            row.wrong_at_slivers,
            row.unlike_first,
        ];
        print!("{:<14}", format!("{test}, {leaves}"));
        for count in counts {
            print!(" {count:>8}");
        }
        println!(
            "   {:<24} {best:>8.2} {:>9.1} {:>9.1}",
            format!("{median:.3} ({low:.3} … {high:.3})"),
            row.build_ms,
            row.bytes_per_triangle
        );
        let counts = counts.map(|count| count.to_string()).join(",");
        write!(
            csv,
            "{test},{leaves},{},{counts},{low:.4},{median:.4},{high:.4},{best:.3},{:.2},{:.2}",
            row.rays, row.build_ms, row.bytes_per_triangle
        )?;
        for error in row.errors.iter().flatten() {
            write!(csv, ",{error:.3}")?;
        }
        csv.push('\n');
    }
    println!(
        "\n{:<14} {:<28} {:<28} error of v",
        "", "error of t", "error of u"
    );
    for row in &rows {
        let [test, leaves] = names(row);
        let [t, u, v] = row
            .errors
            .map(|[p50, p99, max]| format!("{p50:.2} / {p99:.1} / {max:.2e}"));
        println!("{:<14} {t:<28} {u:<28} {v}", format!("{test}, {leaves}"));
    }
    for (what, why) in ABSENT {
        println!("\nabsent: {what} ({why})");
    }
    write(args.output.as_deref(), &csv)?;
    Ok(if is_sound(&rows) {
        Verdict::AllEqual
    } else {
        Verdict::SomethingDiffers
    })
}

fn names(row: &Row) -> [&'static str; 2] {
    let test = match row.accuracy {
        Accuracy::Fast => "fast",
        Accuracy::Robust => "robust",
    };
    let leaves = match row.leaf_format {
        LeafFormat::Edges => "edges",
        LeafFormat::Compact => "compact",
    };
    [test, leaves]
}

/// Whether leaf formats change no hit, and no robust ray is lost.
fn is_sound(rows: &[Row]) -> bool {
    rows.iter().all(|row| {
        let mut same_test = rows.iter().filter(|other| other.accuracy == row.accuracy);
        let lost = row.lost_at_edges + row.lost_at_vertices + row.lost_far_away;
        let same = same_test.all(|other| other.hits == row.hits);
        same && (row.accuracy == Accuracy::Fast || lost == 0)
    })
}
