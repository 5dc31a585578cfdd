//! `extremes`: what breaks ray tracers, class by class, with Embree's figures beside.

use std::{
    error::Error,
    fs,
    path::{Path, PathBuf},
};

use clap::Args;
use raywright_bvh::Isa;
use raywright_validation::extremes::{CLASSES, Class, ELSEWHERE, Findings, GOLDEN, Settings};

use super::{Verdict, trees::default_data};

/// Arguments of `extremes`.
#[derive(Debug, Args)]
#[command(after_help = "\
pass: the criterion of the class holds. fail: it does not. recorded: it holds as far as it was tested or is promised,
and the lines marked ! say what was not. Figures of Embree 4.4 are those of its documents: 40,000 rays where no other
number is given.")]
pub(crate) struct ExtremesArgs {
    /// Rays of each cell: of each mesh, kind and accuracy
    #[arg(long, value_name = "N", default_value_t = 40_000)]
    rays: usize,
    /// Only these classes, as T06,T11
    #[arg(long, value_name = "CLASSES", value_delimiter = ',', value_parser = class_number)]
    only: Vec<u32>,
    /// The folder with golden rays (default: ../shared/data beside the checkout)
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Writes a table of comma-separated values
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

fn class_number(text: &str) -> Result<u32, String> {
    let digits = text.trim_start_matches(['T', 't']);
    let number = digits
        .parse()
        .map_err(|_| "classes are T01, T02, …".to_owned())?;
    if classes().any(|class| class.number == number) {
        return Ok(number);
    }
    let elsewhere = ELSEWHERE.iter().find(|(other, ..)| *other == number);
    Err(match elsewhere {
        Some((_, title, place)) => format!("{title} are tested elsewhere: {place}"),
        None => "there is no such class".to_owned(),
    })
}

fn classes() -> impl Iterator<Item = Class> {
    CLASSES.into_iter().chain([GOLDEN])
}

/// Runs the classes; says on standard output what came of each.
pub(crate) fn run(args: &ExtremesArgs) -> Result<Verdict, Box<dyn Error>> {
    if args.rays == 0 {
        return Err("--rays must be 1 at least".into());
    }
    let data = args.data.clone().unwrap_or_else(default_data);
    let settings = Settings {
        rays: args.rays,
        golden: data.join("golden/robust/cases.json"),
    };
    println!(
        "{} rays of each cell, best instruction set {}",
        args.rays,
        Isa::best().name()
    );
    let mut csv = "class,title,verdict,kind,what,raywright,embree\n".to_owned();
    let mut counts = [0; 3];
    for class in classes().filter(|class| args.only.is_empty() || args.only.contains(&class.number))
    {
        eprint!("T{:02} … ", class.number);
        let start = std::time::Instant::now();
        let findings = class.run(&settings);
        eprintln!("{:.1} s", start.elapsed().as_secs_f64());
        counts[findings.verdict() as usize] += 1;
        print(&class, &findings);
        add_to_csv(&mut csv, &class, &findings);
    }
    if args.only.is_empty() {
        println!("\ntested elsewhere");
        for (number, title, place) in ELSEWHERE {
            println!("T{number:02} {title:<42} {place}");
        }
    }
    let [pass, fail, recorded] = counts;
    println!("\n{pass} pass, {fail} fail, {recorded} recorded");
    write(args.output.as_deref(), &csv)?;
    Ok(if fail == 0 {
        Verdict::AllEqual
    } else {
        Verdict::SomethingDiffers
    })
}

/// Faults of one class that are printed.
const MOST_FAULTS: usize = 5;

fn print(class: &Class, findings: &Findings) {
    println!(
        "\nT{:02} {:<42} {}",
        class.number,
        class.title,
        findings.verdict()
    );
    for figure in &findings.figures {
        print!("    {:<62} {}", figure.what, figure.ours);
        if figure.embree.is_empty() {
            println!();
        } else {
            println!("   (Embree {})", figure.embree);
        }
    }
    for deviation in &findings.deviations {
        println!("  ! {deviation}");
    }
    for fault in findings.faults.iter().take(MOST_FAULTS) {
        println!("  fault: {fault}");
    }
    if findings.faults.len() > MOST_FAULTS {
        println!("  and {} more faults", findings.faults.len() - MOST_FAULTS);
    }
}

/// A field of a table of comma-separated values.
fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\""))
}

fn add_to_csv(csv: &mut String, class: &Class, findings: &Findings) {
    let mut line = |kind: &str, what: &str, ours: &str, embree: &str| {
        let fields = [
            class.title,
            &findings.verdict().to_string(),
            kind,
            what,
            ours,
            embree,
        ];
        let fields = fields.map(quoted).join(",");
        csv.push_str(&format!("T{:02},{fields}\n", class.number));
    };
    line("verdict", "", "", "");
    for figure in &findings.figures {
        line("figure", &figure.what, &figure.ours, figure.embree);
    }
    for deviation in &findings.deviations {
        line("deviation", deviation, "", "");
    }
    for fault in &findings.faults {
        line("fault", fault, "", "");
    }
}

pub(super) fn write(path: Option<&Path>, text: &str) -> Result<(), Box<dyn Error>> {
    match path {
        Some(path) => {
            fs::write(path, text).map_err(|error| format!("{}: {error}", path.display()).into())
        }
        None => Ok(()),
    }
}
