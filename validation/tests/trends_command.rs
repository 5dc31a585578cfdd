//! `trends` on a small scene: rows, files and page are there, and with Embree's rounding trees and costs are Embree's.

use std::{collections::BTreeMap, fs, path::Path, process::Command};

use raywright_validation::trends::{Quantity, SWEEPS};

type Row = BTreeMap<String, String>;

fn rows(path: &Path) -> Vec<Row> {
    let mut reader = csv::Reader::from_path(path).expect("a table");
    reader
        .deserialize()
        .map(|row| row.expect("a row"))
        .collect()
}

#[test]
fn a_small_scene_has_rows_files_and_a_page() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut command = Command::new(env!("CARGO_BIN_EXE_raywright-validation"));
    command.args([
        "trends",
        "--scene",
        "uniform1000",
        "--scene",
        "diagonals500",
    ]);
    command.args([
        "--rounds",
        "2",
        "--rays",
        "100",
        "--rounding",
        "embree",
        "-o",
    ]);
    let output = command.arg(folder.path()).output().expect("it runs");
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    if text.starts_with("skipped") {
        eprintln!("{text}");
        return;
    }
    // 1: noise may push times of so small a scene in opposite directions.
    assert!(matches!(output.status.code(), Some(0 | 1)), "{text}");

    let measured = rows(&folder.path().join("measurements.csv"));
    for sweep in &SWEEPS {
        for scene in ["uniform1000", "diagonals500"] {
            for value in sweep.values {
                let own = |quantity: Quantity, engine: &str| -> Vec<&str> {
                    let wanted = [
                        ("scene", scene),
                        ("parameter", sweep.parameter),
                        ("value", value),
                        ("engine", engine),
                        ("quantity", quantity.name()),
                    ];
                    let is_wanted = |row: &&Row| wanted.iter().all(|&(key, text)| row[key] == text);
                    let found = measured.iter().filter(is_wanted);
                    found.map(|row| &*row["measured"]).collect()
                };
                let place = format!("{scene}, {} {value}", sweep.parameter);
                for quantity in Quantity::ALL {
                    let [ours, theirs] = ["ours", "Embree"].map(|engine| own(quantity, engine));
                    let rounds = match quantity {
                        Quantity::BuildTime | Quantity::TraceTime => 2,
                        Quantity::Memory => 1,
                        _ if sweep.is_flag() => 0,
                        _ => 1,
                    };
                    let counts = (ours.len(), theirs.len());
                    assert_eq!(counts, (rounds, rounds), "{place}, {quantity:?}");
                    let positive = |text: &&str| text.parse::<f64>().expect("a number") >= 0.0;
                    assert!(ours.iter().chain(&theirs).all(positive), "{place}");
                    let is_of_trees = !matches!(
                        quantity,
                        Quantity::BuildTime | Quantity::TraceTime | Quantity::Memory
                    );
                    if is_of_trees {
                        assert_eq!(ours, theirs, "{place}, {quantity:?}");
                    }
                }
            }
        }
    }

    let trends = rows(&folder.path().join("trends.csv"));
    assert_eq!(trends.len(), 2 * (9 * 7 + 3 * 3));
    for row in &trends {
        let is_of_trees = ["nodes visited", "blocks tested", "SAH cost", "tree nodes"]
            .contains(&&*row["quantity"]);
        if is_of_trees {
            assert_eq!(row["ours_rho"], row["embree_rho"], "{row:?}");
            let same = ["yes", "both are flat"].contains(&&*row["same_direction"]);
            assert!(same, "{row:?}");
        }
        let line = text.lines().find(|line| {
            ["parameter", "quantity", "scene"]
                .iter()
                .all(|&key| line.contains(&row[key]))
        });
        assert!(
            line.is_some_and(|line| line.ends_with(&row["same_direction"])),
            "{row:?}"
        );
    }
    // Smaller leaves are more nodes.
    let is_leaf_size =
        |row: &&Row| row["parameter"] == "min_leaf_size" && row["quantity"] == "tree nodes";
    assert!(
        trends
            .iter()
            .filter(is_leaf_size)
            .all(|row| row["ours_rho"] == "-1")
    );

    let page = fs::read_to_string(folder.path().join("trends.html")).expect("a page");
    assert_eq!(page.matches("<svg").count(), 9 * 7 + 3 * 3);
    for sweep in &SWEEPS {
        assert!(page.contains(&format!("<h2>{}</h2>", sweep.parameter)));
    }
    assert!(!page.contains("<script") && !page.contains("<link") && !page.contains("src="));
}
