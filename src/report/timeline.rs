//! Frame times over a sequence, drawn: what figure 3 of Bruder, Frey, Ertl, 2016, shows, as plots and as
//! one HTML page.

use super::{
    markup::escape,
    page::{
        document, figure, picture,
        table::{Cell, Table},
    },
    svg::{
        Size,
        xy::{Layer, Plot, Range},
    },
};
use crate::study::steering::{FrameRow, Run, Way};

/// A sequence in some ways.
#[derive(Clone, Debug)]
pub struct Timeline<'a> {
    /// Volume and sequence, for people.
    pub title: String,
    /// The runs, all with the same moments.
    pub runs: Vec<&'a Run>,
    /// Pictures beside each other below its plots, as PNG.
    pub pictures: Vec<Vec<u8>>,
    /// What the pictures show.
    pub caption: String,
}

/// What stands on a page beside its timelines.
#[derive(Clone, Debug, Default)]
pub struct TimelineHeader {
    /// The title.
    pub title: String,
    /// Sentences below it.
    pub sentences: Vec<String>,
    /// A head and rows of figures; empty: no table.
    pub table: Vec<Vec<String>>,
    /// How many columns of the table are names.
    pub names: usize,
    /// Settings: names and values.
    pub settings: Vec<(String, String)>,
}

/// The page of some timelines as HTML.
pub fn timeline_page(header: &TimelineHeader, timelines: &[Timeline<'_>]) -> String {
    let mut body = format!("<h1>{}</h1>\n", escape(&header.title));
    for sentence in &header.sentences {
        body.push_str(&format!("<p>{}</p>\n", escape(sentence)));
    }
    if let Some((head, rows)) = header.table.split_first() {
        let row = |row: &Vec<String>| {
            let cells = row.iter().enumerate().map(|(column, text)| {
                if column < header.names {
                    Cell::Text(text.clone())
                } else {
                    Cell::Number(text.clone())
                }
            });
            cells.collect()
        };
        let table = Table {
            head: head.clone(),
            rows: rows.iter().map(row).collect(),
        };
        body.push_str(&table.html());
    }
    for timeline in timelines {
        body.push_str(&format!("<h2>{}</h2>\n", escape(&timeline.title)));
        body.push_str(&figures(timeline));
        if !timeline.pictures.is_empty() {
            let pictures = timeline
                .pictures
                .iter()
                .map(|png| picture(&timeline.caption, png));
            let beside = format!(
                "<div class=\"beside\">{}</div>",
                pictures.collect::<String>()
            );
            body.push_str(&figure(&beside, &timeline.caption));
        }
    }
    let settings = header.settings.iter();
    let table = Table {
        head: vec!["setting".into(), "value".into()],
        rows: settings
            .map(|(name, value)| vec![Cell::Text(name.clone()), Cell::Text(value.clone())])
            .collect(),
    };
    body.push_str("<h2>Settings</h2>\n");
    body.push_str(&table.html());
    document(&header.title, &body)
}

fn figures(timeline: &Timeline<'_>) -> String {
    let target = timeline.runs.first().map_or(f64::NAN, |run| run.target);
    let mut html = figure(
        &plot(timeline, "frame time, ms", Some(1e3 * target), |f| {
            1e3 * f.frame_time
        }),
        "The time of each frame; the horizontal line is the target. Above it the user waits.",
    );
    html.push_str(&figure(
        &plot(timeline, "step, voxels", None, |frame| frame.step),
        "The step of each frame: the shorter, the finer the picture.",
    ));
    html.push_str(&figure(
        &plot(timeline, "predicted ÷ measured time", Some(1.0), |frame| {
            frame.predicted / frame.cast_time
        }),
        "Predictions for the quality that was drawn; the horizontal line is a right one.",
    ));
    html.push_str(&figure(
        &plot(
            timeline,
            "estimated − true samples, millions",
            Some(0.0),
            |frame| (frame.estimated - frame.samples) / 1e6,
        ),
        "How far off the estimated number of samples is, before anything learned.",
    ));
    html
}

fn plot(
    timeline: &Timeline<'_>,
    label: &str,
    level: Option<f64>,
    value: impl Fn(&FrameRow) -> f64,
) -> String {
    let mut layers: Vec<Layer> = timeline
        .runs
        .iter()
        .map(|run| Layer::Steps {
            name: run.way.name().into(),
            class: class(run.way),
            points: run
                .frames
                .iter()
                .map(|frame| (frame.time, value(frame)))
                .collect(),
        })
        .collect();
    if let Some(y) = level {
        layers.push(Layer::Level {
            name: String::new(),
            class: "bad".into(),
            y,
            band: (y, y),
        });
    }
    Plot {
        size: Size {
            width: 900.0,
            height: 300.0,
        },
        description: label,
        x_label: "time of the sequence, seconds",
        y_label: label,
        y_range: Range::Fitted,
        layers,
    }
    .draw()
}

/// The colour of a way.
fn class(way: Way) -> &'static str {
    match way {
        Way::NoAdapt => "plain",
        Way::LastFrame => "s1",
        Way::Paper => "s0",
        Way::Ours => "s2",
        Way::Parts => "incumbent",
        Way::TwoPass => "s3",
    }
}
