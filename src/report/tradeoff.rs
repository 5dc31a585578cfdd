//! The page of a study of speed against accuracy: one HTML file, as [`page`](super::page()) is.

use super::{
    markup::escape,
    number,
    page::{
        document, figure,
        table::{Cell, Table},
    },
    svg::{
        Size,
        marker::Marker,
        xy::{Layer, Mark, Plot, Range},
    },
};
use crate::study::tradeoff::{Knob, Outcome, Tradeoff};

/// What a study was about.
#[derive(Clone, Debug)]
pub struct TradeoffHeader {
    /// Name of the volume.
    pub volume: String,
    /// Everything that is needed to repeat the study: names and values.
    pub settings: Vec<(String, String)>,
    /// What is recommended, in sentences.
    pub advice: Vec<String>,
}

/// The page of a study as HTML.
pub fn tradeoff_page(header: &TradeoffHeader, study: &Tradeoff) -> String {
    let mut body = format!(
        "<h1>{}: speed against accuracy</h1>\n",
        escape(&header.volume)
    );
    for sentence in &header.advice {
        body.push_str(&format!(
            "<p class=\"verdict good\">{}</p>\n",
            escape(sentence)
        ));
    }
    body.push_str(&figure(
        &plot(study),
        "Each mark is one setting: the further left, the faster, the lower, the nearer to the \
         reference, which has a sample every eighth of a voxel and no early termination. The stepped \
         line is the least error to be had in a given time. Coloured marks turn one knob alone.",
    ));
    body.push_str("<h2>What no other setting beats</h2>\n");
    body.push_str(&table(study, study.front().into_iter()).html());
    for knob in Knob::ALL {
        let settings = knob.settings();
        let own = study
            .outcomes
            .iter()
            .filter(|o| settings.contains(&o.setting));
        body.push_str(&format!("<h2>One knob: {}</h2>\n", knob.name()));
        body.push_str(&table(study, own).html());
    }
    body.push_str("<h2>Settings of the study</h2>\n");
    let rows = header.settings.iter();
    body.push_str(
        &Table {
            head: vec!["what".into(), "value".into()],
            rows: rows
                .map(|(name, value)| vec![Cell::Text(name.clone()), Cell::Text(value.clone())])
                .collect(),
        }
        .html(),
    );
    document(&format!("{}: speed against accuracy", header.volume), &body)
}

/// Columns of a table of outcomes, for people.
pub const COLUMNS: [&str; 7] = [
    "setting",
    "time, ms",
    "÷ normal",
    "RMSE of 255",
    "largest of 255",
    "PSNR, dB",
    "SSIM",
];

/// The cells of an outcome, in the order of [`COLUMNS`].
pub fn cells(study: &Tradeoff, outcome: &Outcome) -> [String; 7] {
    let normal = study.normal().map_or(f64::NAN, Outcome::time_ms);
    let difference = &outcome.difference;
    [
        outcome.setting.words(),
        number::significant(outcome.time_ms(), 3),
        number::significant(outcome.time_ms() / normal, 3),
        number::significant(outcome.error(), 3),
        number::significant(difference.largest * 255.0, 3),
        number::significant(difference.psnr(), 3),
        number::significant(difference.ssim, 4),
    ]
}

fn table<'a>(study: &Tradeoff, outcomes: impl Iterator<Item = &'a Outcome>) -> Table {
    let row = |outcome: &Outcome| {
        let [setting, rest @ ..] = cells(study, outcome);
        let mut row = vec![Cell::Text(setting)];
        row.extend(rest.map(Cell::Number));
        row
    };
    Table {
        head: COLUMNS.map(str::to_owned).to_vec(),
        rows: outcomes.map(row).collect(),
    }
}

fn plot(study: &Tradeoff) -> String {
    let marks = |class: &str, is_shown: &dyn Fn(&Outcome) -> bool| -> Vec<Mark> {
        let shown = study.outcomes.iter().filter(|o| is_shown(o));
        shown
            .map(|outcome| Mark {
                x: outcome.time_ms(),
                y: outcome.error(),
                class: class.to_owned(),
                title: outcome.setting.words(),
            })
            .collect()
    };
    let mut layers = vec![
        Layer::Marks {
            name: "other settings".into(),
            marker: Marker::Circle,
            radius: 2.5,
            marks: marks("plain mark", &|_| true),
        },
        Layer::Steps {
            name: "least error".into(),
            class: "incumbent",
            points: study
                .front()
                .iter()
                .map(|o| (o.time_ms(), o.error()))
                .collect(),
        },
    ];
    for (knob, marker, class) in [
        (Knob::Resolution, Marker::Cross, "bad cross"),
        (Knob::Interpolation, Marker::Triangle, "s3 mark"),
        (Knob::Integration, Marker::Square, "s2 mark"),
        (Knob::Termination, Marker::Diamond, "s1 mark"),
        (Knob::Step, Marker::Circle, "s0 mark"),
    ] {
        let settings = knob.settings();
        layers.push(Layer::Marks {
            name: knob.name().into(),
            marker,
            radius: 5.0,
            marks: marks(class, &|o| settings.contains(&o.setting)),
        });
    }
    Plot {
        size: Size {
            width: 900.0,
            height: 520.0,
        },
        description: "Error against time of all settings",
        x_label: "time of a picture, ms",
        y_label: "root mean square error, levels of 255",
        y_range: Range::Fitted,
        layers,
    }
    .draw()
}
