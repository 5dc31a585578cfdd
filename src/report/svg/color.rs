//! Colour as rank: a scale from best to worst that keeps its order for colour-blind readers.
//!
//! The anchors are those of *viridis* (Nathaniel J. Smith and Stéfan van der Walt, 2015), whose
//! lightness is monotonic. The best always has the strongest contrast with the page: dark violet on
//! white, yellow on black. Plots therefore name a step of the ramp by class, and the style sheet
//! gives it a colour for either background.

use super::{Anchor, Size, drawing, text};

/// Steps of the ramp; more could not be told apart.
const STEPS: usize = 24;

/// Nine equidistant colours of viridis, as red, green, blue.
const ANCHORS: [[f64; 3]; 9] = [
    [68.0, 1.0, 84.0],
    [71.0, 44.0, 122.0],
    [59.0, 81.0, 139.0],
    [44.0, 113.0, 142.0],
    [33.0, 144.0, 141.0],
    [39.0, 173.0, 129.0],
    [92.0, 200.0, 99.0],
    [170.0, 220.0, 50.0],
    [253.0, 231.0, 37.0],
];

/// The part of the ramp used on white, best first: the lightest yellow would be invisible.
const ON_LIGHT: [f64; 2] = [0.0, 0.92];
/// The part of the ramp used on black, best first: the darkest violet would be invisible.
const ON_DARK: [f64; 2] = [1.0, 0.17];

/// Class of the colour for `rank`, 0 for the best and 1 for the worst.
pub(crate) fn class(rank: f64) -> String {
    let step = (rank.clamp(0.0, 1.0) * (STEPS - 1) as f64).round() as usize;
    format!("r{step}")
}

/// The rules that give all classes of [`class`] their colours, for both backgrounds.
pub(crate) fn style_sheet() -> String {
    let rules = |[best, worst]: [f64; 2]| -> String {
        (0..STEPS)
            .map(|step| {
                let fraction = step as f64 / (STEPS - 1) as f64;
                let [red, green, blue] = viridis(best + fraction * (worst - best));
                format!(".r{step}{{color:#{red:02x}{green:02x}{blue:02x}}}")
            })
            .collect()
    };
    format!(
        "{}\n@media (prefers-color-scheme:dark){{{}}}\n",
        rules(ON_LIGHT),
        rules(ON_DARK)
    )
}

/// The ramp from best to worst; `labels` are written below it, equally far apart.
pub(crate) fn legend(title: &str, labels: &[String]) -> String {
    let size = Size {
        width: 420.0,
        height: 56.0,
    };
    let (left, right) = (34.0, size.width - 34.0);
    let width = (right - left) / STEPS as f64;
    let mut content = text("label", left, 14.0, Anchor::Start, title);
    for step in 0..STEPS {
        // Half a pixel more, so that no background shows through the seams.
        content.push_str(&format!(
            "<rect class=\"fill r{step}\" x=\"{:.2}\" y=\"22\" width=\"{:.2}\" height=\"12\"/>\n",
            left + step as f64 * width,
            width + if step + 1 < STEPS { 0.5 } else { 0.0 },
        ));
    }
    let gaps = labels.len().saturating_sub(1).max(1) as f64;
    for (index, label) in labels.iter().enumerate() {
        let x = left + index as f64 / gaps * (right - left);
        content.push_str(&text("tick", x, 50.0, Anchor::Middle, label));
    }
    drawing(size, title, &content)
}

/// The colour at `position`, from 0 (dark violet) to 1 (yellow).
fn viridis(position: f64) -> [u8; 3] {
    let scaled = position.clamp(0.0, 1.0) * (ANCHORS.len() - 1) as f64;
    let below = (scaled as usize).min(ANCHORS.len() - 2);
    let weight = scaled - below as f64;
    std::array::from_fn(|channel| {
        let [low, high] = [ANCHORS[below][channel], ANCHORS[below + 1][channel]];
        (low + weight * (high - low)).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance of WCAG 2.1.
    fn luminance(color: [u8; 3]) -> f64 {
        let [red, green, blue] = color.map(|channel| {
            let value = f64::from(channel) / 255.0;
            if value <= 0.040_45 {
                value / 12.92
            } else {
                ((value + 0.055) / 1.055).powf(2.4)
            }
        });
        0.2126 * red + 0.7152 * green + 0.0722 * blue
    }

    #[test]
    fn the_ramp_grows_lighter_everywhere() {
        for step in 0..100 {
            let [below, above] =
                [step, step + 1].map(|at| luminance(viridis(f64::from(at) / 100.0)));
            assert!(below < above, "{step}");
        }
    }

    #[test]
    fn the_ends_are_the_first_and_last_anchor() {
        assert_eq!(viridis(0.0), [68, 1, 84]);
        assert_eq!(viridis(1.0), [253, 231, 37]);
        assert_eq!(viridis(7.0), viridis(1.0));
    }

    #[test]
    fn the_best_stands_out_from_either_background() {
        let contrast = |color: [u8; 3], ground: [u8; 3]| {
            let [one, other] = [luminance(color), luminance(ground)];
            (one.max(other) + 0.05) / (one.min(other) + 0.05)
        };
        assert!(contrast(viridis(ON_LIGHT[0]), [255, 255, 255]) > 7.0);
        assert!(contrast(viridis(ON_DARK[0]), [20, 22, 26]) > 7.0);
        assert!(contrast(viridis(ON_LIGHT[1]), [255, 255, 255]) > 1.3);
        assert!(contrast(viridis(ON_DARK[1]), [20, 22, 26]) > 1.3);
    }

    #[test]
    fn every_class_has_a_rule_on_both_backgrounds() {
        let style_sheet = style_sheet();
        for rank in 0..=200 {
            let rule = format!(".{}{{", class(f64::from(rank) / 200.0));
            assert_eq!(style_sheet.matches(&rule).count(), 2, "{rule}");
        }
    }

    #[test]
    fn ranks_outside_are_clamped() {
        assert_eq!(class(-1.0), "r0");
        assert_eq!(class(2.0), format!("r{}", STEPS - 1));
    }

    #[test]
    fn the_legend_bears_its_labels() {
        let drawn = legend("cost", &["1 ms".to_string(), "2 ms".to_string()]);
        assert!(drawn.contains(">1 ms<") && drawn.contains(">2 ms<"));
        let single = legend("cost", &["1 ms".to_string()]);
        assert!(single.contains(">1 ms<") && !single.contains("NaN"));
    }
}
