//! Whether another tree is faster, from some tiles of one frame.
//!
//! No configuration changes a pixel, so that the tiles of a frame may be traced through two trees. Some tiles
//! are traced through a candidate, as many through the incumbent; what each is expected to take with the
//! incumbent is known from earlier frames. What tiles of the candidate took over what was expected, divided
//! by the same of the tiles of the incumbent, is the ratio of the two: the speed of the machine at the moment
//! is in both, and how dear a tile is in neither.
//!
//! Ratio estimation and the jackknife over pairs: Cochran, *Sampling Techniques*, 1977, section 6. A probe
//! goes on with twice as many tiles for as long as it has not decided, up to half of the frame.
//!
//! A tile that takes much longer than its like was interrupted by something else on the machine, or much shorter
//! because it was so when it was learned what to expect; either is taken for one that was not.
//!
//! Invariants: a ratio of times that are all multiplied by a number is the same; bounds lie on both sides of
//! the ratio; no pairs decide nothing.

/// Candidate tiles of the first, second, … part of a probe, as shares of the frame, altogether.
pub(super) const SHARES: [f64; 4] = [1.0 / 32.0, 1.0 / 8.0, 1.0 / 4.0, 1.0 / 2.0];

/// Quantile of the normal distribution of a one-sided bound of 95 %.
const ONE_SIDED: f64 = 1.645;

/// The same of 99 %, for what is accepted: a probe is looked at several times, and there are many.
const SURE: f64 = 2.326;

/// A candidate is rejected when the lower bound of its cost over that of the incumbent is above this…
const WORSE: f64 = 1.02;
/// …or, before more than the first part is rendered, when it is expected to be above this.
const MUCH_WORSE: f64 = 1.25;

/// Times what is usual of a tile from which it was interrupted.
pub(super) const INTERRUPTED: f64 = 3.0;

/// Pairs below which bounds are not believed; and pairs that it takes to accept.
const FEW_PAIRS: usize = 5;
const ENOUGH_PAIRS: usize = 16;

/// Standard deviation of the logarithm of a ratio beside what its pairs show: that of the tree itself, which
/// lies elsewhere in memory the next time. Paired ratios of whole frames repeat to about this.
const LEAST_DEVIATION: f64 = 0.003;

/// Two tiles of one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// Seconds of the tile of the candidate, and what it was expected to take with the incumbent.
    pub candidate: [f64; 2],
    /// The same of the tile of the incumbent.
    pub incumbent: [f64; 2],
}

/// The time of a candidate over that of the incumbent, to render.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProbeRatio {
    /// The logarithm of the ratio.
    pub log: f64,
    /// Its standard deviation.
    pub deviation: f64,
    /// Pairs of tiles.
    pub pairs: usize,
}

impl ProbeRatio {
    /// From pairs; `None` if there are none, or times that are no times.
    #[must_use]
    pub fn of(pairs: &[Pair]) -> Option<Self> {
        let pairs = &without_interruptions(pairs);
        let sum = |pairs: &mut dyn Iterator<Item = &Pair>| {
            pairs.fold([0.0; 4], |mut sum, pair| {
                let [a, b] = pair.candidate;
                let [c, d] = pair.incumbent;
                for (sum, value) in sum.iter_mut().zip([a, b, c, d]) {
                    *sum += value;
                }
                sum
            })
        };
        let log = |[a, b, c, d]: [f64; 4]| (a / b).ln() - (c / d).ln();
        let all = sum(&mut pairs.iter());
        let own = log(all);
        if !own.is_finite() {
            return None;
        }
        let count = pairs.len() as f64;
        let without: Vec<f64> = pairs
            .iter()
            .map(|pair| {
                let one = sum(&mut std::iter::once(pair));
                log(std::array::from_fn(|i| all[i] - one[i]))
            })
            .collect();
        let mean = without.iter().sum::<f64>() / count;
        let squares: f64 = without.iter().map(|value| (value - mean).powi(2)).sum();
        let variance = squares * (count - 1.0) / count;
        let deviation = if pairs.len() < FEW_PAIRS || !variance.is_finite() {
            f64::INFINITY
        } else {
            variance.sqrt().hypot(LEAST_DEVIATION)
        };
        Some(Self {
            log: own,
            deviation,
            pairs: pairs.len(),
        })
    }

    /// Both, if they are independent of each other.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        let weights = [self, other].map(|ratio| ratio.deviation.powi(-2));
        let weight = weights[0] + weights[1];
        if weight == 0.0 {
            return other;
        }
        Self {
            log: (self.log * weights[0] + other.log * weights[1]) / weight,
            deviation: weight.powf(-0.5),
            pairs: self.pairs + other.pairs,
        }
    }

    /// The ratio, and its lower and upper bound of 95 %, each by itself.
    #[must_use]
    pub fn bounds(self) -> [f64; 3] {
        self.bounds_at(ONE_SIDED)
    }

    fn bounds_at(self, quantile: f64) -> [f64; 3] {
        let reach = quantile * self.deviation;
        [self.log, self.log - reach, self.log + reach].map(f64::exp)
    }
}

/// Pairs without interruptions: a tile that took more than [`INTERRUPTED`] times what is usual on its side was
/// interrupted now, and one that took less than that part of it when it was learned what to expect.
fn without_interruptions(pairs: &[Pair]) -> Vec<Pair> {
    let usual = |side: fn(&Pair) -> [f64; 2]| {
        let mut factors: Vec<f64> = pairs
            .iter()
            .map(|pair| side(pair)[0] / side(pair)[1])
            .collect();
        factors.sort_by(f64::total_cmp);
        factors.get(factors.len() / 2).copied().unwrap_or(f64::NAN)
    };
    let [candidate, incumbent] = [usual(|pair| pair.candidate), usual(|pair| pair.incumbent)];
    // A NaN is kept.
    let mended = |[time, expected]: [f64; 2], usual: f64| {
        if time > INTERRUPTED * usual * expected {
            [INTERRUPTED * usual * expected, expected]
        } else if INTERRUPTED * time < usual * expected {
            [time, time / usual]
        } else {
            [time, expected]
        }
    };
    pairs
        .iter()
        .map(|pair| Pair {
            candidate: mended(pair.candidate, candidate),
            incumbent: mended(pair.incumbent, incumbent),
        })
        .collect()
}

/// Standard deviation of the time of one build, as a share, at least: 6 to 8 % for single builds on a shared machine.
pub(super) const BUILD_DEVIATION: f64 = 0.06;

/// What is done with a candidate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decision {
    /// It is faster.
    Accepted,
    /// It is slower, or not worth more tiles.
    Rejected,
    /// Nothing can be said yet.
    Undecided,
}

impl Decision {
    /// Its name in a log.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Accepted => "accepted",
            Self::Rejected => "rejected",
            Self::Undecided => "undecided",
        }
    }
}

/// What a frame costs with either tree, seconds: the build's share and rendering with the incumbent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Costs {
    /// Of a frame with the incumbent.
    pub render: f64,
    /// The share of the build of the incumbent that a frame bears.
    pub incumbent_build: f64,
    /// The same of the candidate, measured once.
    pub candidate_build: f64,
    /// The standard deviation of the time of one build, as a share of it.
    pub build_deviation: f64,
}

impl Costs {
    /// The cost of the candidate over that of the incumbent, if it renders in `ratio` times the time.
    #[must_use]
    pub fn ratio(&self, ratio: f64) -> f64 {
        (self.candidate_build + ratio * self.render) / (self.incumbent_build + self.render)
    }

    /// The cost of the candidate over that of the incumbent, and its lower and upper bound of 95 %, each by
    /// itself.
    #[must_use]
    pub fn bounds(&self, ratio: ProbeRatio) -> [f64; 3] {
        self.bounds_at(ratio, ONE_SIDED)
    }

    fn bounds_at(&self, ratio: ProbeRatio, quantile: f64) -> [f64; 3] {
        let [expected, lower, upper] = ratio.bounds_at(quantile).map(|bound| self.ratio(bound));
        let build = quantile * self.build_deviation * self.candidate_build
            / (self.incumbent_build + self.render);
        [
            expected,
            expected - (expected - lower).hypot(build),
            expected + (upper - expected).hypot(build),
        ]
    }

    /// What is to be done with a candidate.
    #[must_use]
    pub fn decide(&self, ratio: ProbeRatio) -> Decision {
        let [expected, lower, _] = self.bounds(ratio);
        let [_, _, upper] = self.bounds_at(ratio, SURE);
        if lower > WORSE || (ratio.pairs >= FEW_PAIRS && expected > MUCH_WORSE) {
            Decision::Rejected
        } else if upper < 1.0 && ratio.pairs >= ENOUGH_PAIRS {
            Decision::Accepted
        } else {
            Decision::Undecided
        }
    }
}

/// What the parts of one probe have told.
#[derive(Debug, Default)]
pub(super) struct Evidence {
    pairs: Vec<Pair>,
    parts: usize,
}

impl Evidence {
    /// Adds the pairs of a part: the ratio in this frame, that together with what was known `before`, and what
    /// is decided; `None` if nothing can be said.
    ///
    /// A tree that was built just now lies in the caches, and the other does not: the first part says whether
    /// the candidate is hopeless, and no more.
    pub(super) fn add_part(
        &mut self,
        part: impl IntoIterator<Item = Pair>,
        costs: &Costs,
        before: Option<ProbeRatio>,
    ) -> Option<(ProbeRatio, ProbeRatio, Decision)> {
        let is_first = self.parts == 0;
        if self.parts == 1 {
            self.pairs.clear();
        }
        self.parts += 1;
        self.pairs.extend(part);
        let ratio = ProbeRatio::of(&self.pairs)?;
        let all = before.map_or(ratio, |before| before.and(ratio));
        let decision = match costs.decide(all) {
            Decision::Accepted if is_first => Decision::Undecided,
            decision => decision,
        };
        Some((ratio, all, decision))
    }
}

/// Tiles in an order in which each beginning is spread over the picture: multiples of the golden section.
pub(super) fn spread_order(tiles: usize, frame: u32) -> Vec<usize> {
    let gcd = |mut a: usize, mut b: usize| {
        while b != 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    let golden = ((tiles as f64) * 0.618_033_988_75) as usize;
    let stride = (golden.max(1)..).find(|&stride| gcd(stride, tiles) == 1);
    let stride = stride.unwrap_or(1);
    // Another beginning for each frame.
    let begin = (f64::from(frame) * 0.754_877_666_25).fract() * tiles as f64;
    (0..tiles)
        .map(|k| (begin as usize + k * stride) % tiles)
        .collect()
}

/// The tile of a pair that is the candidate's in a frame, and that of the incumbent: by chance, so that no half of the
/// tiles is the candidate's again and again.
pub(super) fn turn([a, b]: [usize; 2], frame: u32) -> [usize; 2] {
    // The high bits of a product with an odd number are spread well.
    let key = (a as u64) << 32 | u64::from(frame);
    let mixed = key.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    if (mixed ^ mixed >> 32).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 63 == 0 {
        [a, b]
    } else {
        [b, a]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tiles of very different cost, on a machine of some speed, with noise in turns.
    fn pairs(count: usize, ratio: f64, speed: f64, noise: f64) -> Vec<Pair> {
        (0..count)
            .map(|i| {
                let expected = [1.0, 30.0, 7.0, 0.2, 12.0][i % 5];
                let twin = [9.0, 0.5, 14.0, 25.0][i % 4];
                let odd = |k: usize| 1.0 + noise * [0.0, 1.0, -1.0, 0.5, -0.6, 0.1, 0.0][k % 7];
                Pair {
                    candidate: [expected * ratio * speed * odd(i), expected],
                    incumbent: [twin * speed * odd(i + 3), twin],
                }
            })
            .collect()
    }

    #[test]
    fn speed_of_the_machine_and_dear_tiles_cancel() {
        for speed in [0.1, 1.0, 7.0] {
            let ratio = ProbeRatio::of(&pairs(40, 0.8, speed, 0.0)).unwrap();
            assert!((ratio.log - 0.8_f64.ln()).abs() < 1e-12);
            assert!((ratio.deviation - LEAST_DEVIATION).abs() < 1e-9);
        }
    }

    #[test]
    fn bounds_hold_the_truth() {
        let ratio = ProbeRatio::of(&pairs(40, 0.9, 1.0, 0.05)).unwrap();
        let [middle, lower, upper] = ratio.bounds();
        assert!(lower < 0.9 && 0.9 < upper && lower < middle && middle < upper);
        assert!(ratio.deviation < 0.03, "{ratio:?}");
        // Twice the pairs, less doubt; and so do two probes.
        let more = ProbeRatio::of(&pairs(160, 0.9, 1.0, 0.05)).unwrap();
        assert!(more.deviation < 0.7 * ratio.deviation);
        let both = ratio.and(ratio);
        assert!((both.deviation - ratio.deviation / 2.0_f64.sqrt()).abs() < 1e-12);
        assert_eq!(both.log, ratio.log);
    }

    #[test]
    fn interruptions_are_no_slowness() {
        let mut odd = pairs(60, 0.9, 1.0, 0.05);
        odd[7].candidate[0] += 500.0;
        odd[31].incumbent[0] += 300.0;
        let [middle, lower, upper] = ProbeRatio::of(&odd).unwrap().bounds();
        assert!((0.85..0.95).contains(&middle), "{middle}");
        assert!(lower < 0.9 && 0.9 < upper);
    }

    #[test]
    fn interruptions_of_the_frame_before_are_no_speed() {
        let mut odd = pairs(60, 1.0, 1.0, 0.05);
        odd[7].candidate[1] += 900.0;
        odd[31].candidate[1] += 400.0;
        let ratio = ProbeRatio::of(&odd).unwrap();
        let [middle, ..] = ratio.bounds();
        assert!((0.95..1.05).contains(&middle), "{middle}");
        let costs = Costs {
            render: 1.0,
            incumbent_build: 0.0,
            candidate_build: 0.0,
            build_deviation: BUILD_DEVIATION,
        };
        assert_eq!(costs.decide(ratio), Decision::Undecided);
    }

    #[test]
    fn few_pairs_or_odd_times_decide_nothing() {
        let costs = Costs {
            render: 1.0,
            incumbent_build: 0.0,
            candidate_build: 0.0,
            build_deviation: BUILD_DEVIATION,
        };
        assert_eq!(ProbeRatio::of(&[]), None);
        for count in 1..FEW_PAIRS {
            let ratio = ProbeRatio::of(&pairs(count, 3.0, 1.0, 0.1)).unwrap();
            assert_eq!(costs.decide(ratio), Decision::Undecided);
        }
        let mut odd = pairs(20, 1.0, 1.0, 0.1);
        odd[3].candidate[0] = f64::NAN;
        assert_eq!(ProbeRatio::of(&odd), None);
    }

    #[test]
    fn decisions() {
        let render_only = Costs {
            render: 1.0,
            incumbent_build: 0.0,
            candidate_build: 0.0,
            build_deviation: BUILD_DEVIATION,
        };
        let decide = |costs: Costs, ratio| {
            costs.decide(ProbeRatio::of(&pairs(60, ratio, 1.0, 0.03)).unwrap())
        };
        assert_eq!(decide(render_only, 0.9), Decision::Accepted);
        assert_eq!(decide(render_only, 1.0), Decision::Undecided);
        assert_eq!(decide(render_only, 1.1), Decision::Rejected);
        // What is saved in rendering is lost in the build.
        let with_build = Costs {
            candidate_build: 0.5,
            incumbent_build: 0.1,
            ..render_only
        };
        assert_eq!(decide(with_build, 0.9), Decision::Rejected);
        assert!((with_build.ratio(0.6) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_first_part_of_a_probe_rejects_and_accepts_nothing() {
        let costs = Costs {
            render: 1.0,
            incumbent_build: 0.0,
            candidate_build: 0.0,
            build_deviation: BUILD_DEVIATION,
        };
        let decided = |parts: &[f64], before: Option<ProbeRatio>| {
            let mut evidence = Evidence::default();
            let decisions = parts.iter().map(|&ratio| {
                let part = evidence.add_part(pairs(60, ratio, 1.0, 0.02), &costs, before);
                part.unwrap().2
            });
            decisions.collect::<Vec<_>>()
        };
        use Decision::{Accepted, Rejected, Undecided};
        assert_eq!(decided(&[0.93, 1.0, 1.0], None), [Undecided; 3]);
        assert_eq!(decided(&[0.93, 0.93], None), [Undecided, Accepted]);
        assert_eq!(decided(&[1.3], None), [Rejected]);
        // Nor together with an earlier probe.
        let before = ProbeRatio::of(&pairs(60, 0.93, 1.0, 0.02));
        assert_eq!(decided(&[0.93, 0.93], before), [Undecided, Accepted]);
    }

    #[test]
    fn any_two_frames_share_half_of_the_candidates_tiles() {
        let own = |frame: u32| -> Vec<bool> {
            let mut own = vec![false; 200];
            for pair in spread_order(200, frame).chunks_exact(2) {
                own[turn([pair[0], pair[1]], frame)[0]] = true;
            }
            own
        };
        for (a, b) in (0..40).flat_map(|a| (0..a).map(move |b| (a, b))) {
            let both = own(a).into_iter().zip(own(b)).filter(|&(a, b)| a && b);
            let count = both.count();
            assert!((25..=75).contains(&count), "{a} {b} {count}");
        }
    }

    #[test]
    fn an_order_is_a_permutation_and_its_beginning_is_spread() {
        for tiles in [1, 2, 3, 7, 64, 240, 1000] {
            for frame in [0, 1, 77] {
                let mut order = spread_order(tiles, frame);
                if tiles == 240 {
                    let mut first: Vec<usize> = order[..30].to_vec();
                    first.sort_unstable();
                    let gaps = first.windows(2).map(|pair| pair[1] - pair[0]);
                    assert!(gaps.max() <= Some(16), "{first:?}");
                }
                order.sort_unstable();
                assert!(order.into_iter().eq(0..tiles));
            }
        }
    }
}
