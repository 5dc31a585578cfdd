//! Tuning what is no ray tracer: a sort with a few knobs, on data of its own.
//!
//! Short pieces are sorted by insertion, longer ones are divided around the median of some elements, or
//! merged. What pays depends on the data: here they are rows of numbers of which many are sorted already.
//! The cost is the number of comparisons and moves, so that the outcome is the same on every machine; a
//! program would tell the time.
//!
//! Run: `cargo run --release --example 06_tune_a_sort`

use raywright::tuner::{Config, Outcome, Param, Scale, Space, Tuner, search_by_name};

/// Comparisons and moves.
#[derive(Default)]
struct Effort(u64);

impl Effort {
    fn less(&mut self, a: u32, b: u32) -> bool {
        self.0 += 1;
        a < b
    }
}

/// The knobs.
struct Knobs {
    /// Pieces up to this length are sorted by insertion.
    insertion: usize,
    /// Merges, where it is true; divides otherwise.
    merges: bool,
    /// Of so many elements the median divides a piece.
    pivots: usize,
}

impl Knobs {
    fn of(config: &Config) -> Option<Self> {
        Some(Self {
            insertion: config.integer("insertion")? as usize,
            merges: config.boolean("merges")?,
            // It is no knob of a sort that merges.
            pivots: config.integer("pivots").unwrap_or(1) as usize,
        })
    }

    fn sort(&self, piece: &mut [u32], effort: &mut Effort) {
        if piece.len() <= self.insertion.max(1) {
            insertion_sort(piece, effort);
        } else if self.merges {
            let middle = piece.len() / 2;
            self.sort(&mut piece[..middle], effort);
            self.sort(&mut piece[middle..], effort);
            // What is in order already is left as it is.
            if effort.less(piece[middle], piece[middle - 1]) {
                merge(piece, middle, effort);
            }
        } else {
            let border = self.divide(piece, effort);
            let (low, high) = piece.split_at_mut(border);
            self.sort(low, effort);
            self.sort(&mut high[1..], effort);
        }
    }

    /// Smaller elements before the border, the pivot at it, the others behind.
    fn divide(&self, piece: &mut [u32], effort: &mut Effort) -> usize {
        let count = self.pivots.min(piece.len());
        let last = piece.len() - 1;
        // Some elements from all over the piece, to its beginning; their median to its end.
        for i in 0..count {
            piece.swap(i, i + (last - i) * i / count.max(2));
        }
        insertion_sort(&mut piece[..count], effort);
        piece.swap(count / 2, last);
        let mut border = 0;
        for i in 0..last {
            if effort.less(piece[i], piece[last]) {
                piece.swap(i, border);
                effort.0 += 2;
                border += 1;
            }
        }
        piece.swap(border, last);
        border
    }
}

fn insertion_sort(piece: &mut [u32], effort: &mut Effort) {
    for end in 1..piece.len() {
        let mut place = end;
        while place > 0 && effort.less(piece[place], piece[place - 1]) {
            piece.swap(place, place - 1);
            effort.0 += 2;
            place -= 1;
        }
    }
}

fn merge(piece: &mut [u32], middle: usize, effort: &mut Effort) {
    let left = piece[..middle].to_vec();
    let (mut l, mut r) = (0, middle);
    for place in 0..piece.len() {
        if l == left.len() {
            break;
        }
        if r < piece.len() && effort.less(piece[r], left[l]) {
            piece[place] = piece[r];
            r += 1;
        } else {
            piece[place] = left[l];
            l += 1;
        }
        effort.0 += 1;
    }
    effort.0 += left.len() as u64;
}

/// Rows of numbers: every other one rises but for some of its elements.
fn data() -> Vec<Vec<u32>> {
    let mut state = 1_u32;
    let mut random = move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        state >> 8
    };
    let mut row = |row: usize| -> Vec<u32> {
        let element = |i: u32| match row.is_multiple_of(2) && random() % 10 > 0 {
            true => i << 12,
            false => random(),
        };
        (0..1000).map(element).collect()
    };
    (0..20).map(&mut row).collect()
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let space = Space::new(vec![
        Param::integer(
            "insertion",
            1..=256,
            Scale::Log,
            "Longest piece that is sorted by insertion.",
        ),
        Param::boolean(
            "merges",
            "Whether pieces are merged; they are divided otherwise.",
        ),
        Param::ordinal(
            "pivots",
            vec![1, 3, 5, 9, 15],
            "Elements of which the median divides.",
        )
        .active_if("merges", [false]),
    ])?;
    let data = data();
    let search = search_by_name("gaussian-process").ok_or("a search")?;
    let mut tuner = Tuner::new(space, search, 1);
    let mut best = f64::INFINITY;
    for _ in 0..40 {
        let trial = tuner.ask();
        let knobs = Knobs::of(&trial.config).ok_or("a configuration of this space")?;
        let mut effort = Effort::default();
        for row in &data {
            let mut row = row.clone();
            knobs.sort(&mut row, &mut effort);
            assert!(row.is_sorted());
        }
        let cost = effort.0 as f64 / data.len() as f64;
        tuner.tell(trial.id, Outcome::Done { cost })?;
        if cost < best {
            best = cost;
            println!("{cost:>8.0} per row: {}", trial.canonical);
        }
    }
    Ok(())
}
