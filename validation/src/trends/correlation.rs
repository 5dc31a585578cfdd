//! Spearman's rank correlation with a bootstrap interval, and whether two of them agree.

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// How often rounds are drawn again.
const DRAWS: usize = 2000;

/// What is left out at either end of the interval: 95 % are within.
const TAIL: f64 = 0.025;

/// A rank correlation, −1..=1, and its interval over rounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correlation {
    /// The mean over rounds; not a number if there was no round, or one value alone.
    pub rho: f64,
    /// The interval of 95 %.
    pub interval: [f64; 2],
}

impl Correlation {
    /// The correlation of places 0, 1, … and quantities within each round. A function of its input.
    #[must_use]
    pub fn of(rounds: &[Vec<f64>]) -> Self {
        if rounds.is_empty() || rounds.iter().any(|round| round.len() < 2) {
            return Self {
                rho: f64::NAN,
                interval: [f64::NAN; 2],
            };
        }
        let each: Vec<f64> = rounds.iter().map(|round| spearman(round)).collect();
        let mean = |sum: f64| sum / each.len() as f64;
        let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
        let mut means: Vec<f64> = (0..DRAWS)
            .map(|_| {
                mean(
                    (0..each.len())
                        .map(|_| each[random.random_range(0..each.len())])
                        .sum(),
                )
            })
            .collect();
        means.sort_by(f64::total_cmp);
        let at = |share: f64| means[(share * (DRAWS - 1) as f64).round() as usize];
        Self {
            rho: mean(each.iter().sum()),
            interval: [at(TAIL), at(1.0 - TAIL)],
        }
    }

    /// Whether there are values to correlate.
    #[must_use]
    pub fn is_known(&self) -> bool {
        !self.rho.is_nan()
    }

    /// 1 if the quantity rises, −1 if it falls, 0 if the interval holds 0.
    #[must_use]
    pub fn sign(&self) -> i32 {
        let [low, high] = self.interval;
        i32::from(low > 0.0) - i32::from(high < 0.0)
    }

    /// An arrow for [`sign`](Self::sign).
    #[must_use]
    pub fn arrow(&self) -> &'static str {
        match self.sign() {
            _ if !self.is_known() => "·",
            1 => "▲",
            -1 => "▼",
            _ => "–",
        }
    }
}

/// Whether a parameter does the same to both engines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Agreement {
    /// The same sign.
    Yes,
    /// Opposite signs.
    No,
    /// The interval of one holds 0, that of the other does not.
    OneFlat,
    /// Both intervals hold 0.
    BothFlat,
    /// One of them does not tell.
    Unknown,
}

impl Agreement {
    /// That of two correlations.
    #[must_use]
    pub fn of(a: &Correlation, b: &Correlation) -> Self {
        if !(a.is_known() && b.is_known()) {
            return Self::Unknown;
        }
        match (a.sign(), b.sign()) {
            (0, 0) => Self::BothFlat,
            (0, _) | (_, 0) => Self::OneFlat,
            (a, b) if a == b => Self::Yes,
            _ => Self::No,
        }
    }

    /// Its name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Yes => "yes",
            Self::No => "no",
            Self::OneFlat => "one is flat",
            Self::BothFlat => "both are flat",
            Self::Unknown => "not told",
        }
    }
}

/// Spearman's ρ of the places 0, 1, … and some numbers, equal ones with the mean of their ranks; 0 if all are equal.
#[must_use]
pub fn spearman(numbers: &[f64]) -> f64 {
    let rank = |x: f64| {
        let below = numbers.iter().filter(|&&y| y < x).count();
        let equal = numbers.iter().filter(|&&y| y == x).count();
        below as f64 + 0.5 * (equal as f64 - 1.0)
    };
    let middle = 0.5 * (numbers.len() as f64 - 1.0);
    let (mut product, mut places, mut ranks) = (0.0, 0.0, 0.0);
    for (place, &number) in numbers.iter().enumerate() {
        let (x, y) = (place as f64 - middle, rank(number) - middle);
        product += x * y;
        places += x * x;
        ranks += y * y;
    }
    if ranks == 0.0 {
        0.0
    } else {
        product / (places * ranks).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_by_hand() {
        assert_eq!(spearman(&[1.0, 2.0, 30.0]), 1.0);
        assert_eq!(spearman(&[3.0, 2.0, -1.0]), -1.0);
        assert_eq!(spearman(&[5.0, 5.0, 5.0]), 0.0);
        // Without ties: 1 − 6 Σd²/(n(n² − 1)), d = 0, 1, 1, 0.
        assert!((spearman(&[1.0, 3.0, 2.0, 4.0]) - 0.8).abs() < 1e-12);
        // Ranks 0.5, 0.5, 2 against 0, 1, 2: 1.5/√(2 · 1.5).
        assert!((spearman(&[1.0, 1.0, 2.0]) - 1.5 / 3.0_f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn intervals_hold_zero_where_rounds_disagree() {
        let one = Correlation::of(&[vec![1.0, 2.0, 3.0]]);
        assert_eq!((one.rho, one.interval, one.sign()), (1.0, [1.0, 1.0], 1));
        let rising = vec![1.0, 2.0, 3.0];
        let falling = vec![3.0, 2.0, 1.0];
        let mixed = Correlation::of(&[rising.clone(), falling.clone(), rising.clone(), falling]);
        assert_eq!((mixed.rho, mixed.sign()), (0.0, 0));
        assert!(!Correlation::of(&[]).is_known());
        assert!(!Correlation::of(&[vec![1.0]]).is_known());
        assert_eq!(Agreement::of(&one, &mixed), Agreement::OneFlat);
        assert_eq!(Agreement::of(&one, &one), Agreement::Yes);
        assert_eq!(
            Agreement::of(&one, &Correlation::of(&[])),
            Agreement::Unknown
        );
    }

    /// Of many sets of rounds without a trend, few have an interval without 0.
    #[test]
    fn noise_is_flat() {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
        let mut noise = || (0..5).map(|_| random.random::<f64>()).collect::<Vec<_>>();
        let trends = (0..200).filter(|_| {
            let rounds: Vec<_> = (0..9).map(|_| noise()).collect();
            Correlation::of(&rounds).sign() != 0
        });
        // 5 % are expected of many rounds, somewhat more of nine.
        assert!(trends.count() < 30);
    }
}
