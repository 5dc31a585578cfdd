//! From linear radiance to the bytes of a screen.
//!
//! Idea: exposure, tone curve, sRGB transfer function, rounding, each channel by itself. For
//! display only: nothing that is computed from a picture goes through here.
//!
//! Sources: IEC 61966-2-1 (sRGB); Reinhard, Stark, Shirley, Ferwerda: Photographic tone
//! reproduction for digital images, 2002, equation 3.
//!
//! Invariants: every f32 has a byte. What is not a number is shown black, as are negative values;
//! positive infinity is shown white.

/// How a picture is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Display {
    /// Exposure value: the picture is scaled by 2^`exposure_ev`. Default 0.
    pub exposure_ev: f32,
    /// What becomes of values that a screen cannot show.
    pub curve: ToneCurve,
}

/// Map from scaled radiance to the range 0..=1 of a screen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum ToneCurve {
    /// x, cut off at 1: exact where it can be, blind above.
    #[default]
    Clamp,
    /// x/(1 + x): everything is visible, nothing is quite white.
    Reinhard,
    /// x as the value of the screen itself, cut off at 1: for colours that were chosen on a screen,
    /// as those of transfer functions are, and mixed as such.
    Screen,
}

impl Display {
    /// The byte that shows linear `radiance`.
    pub fn encode(&self, radiance: f32) -> u8 {
        let scaled = f64::from(radiance) * f64::from(self.exposure_ev).exp2();
        // The comparison is false for what is not a number as well.
        let positive = if scaled > 0.0 { scaled } else { 0.0 };
        let toned = match self.curve {
            ToneCurve::Clamp => positive.min(1.0),
            // The same as x/(1 + x), but 1 instead of ∞/∞ at infinity.
            ToneCurve::Reinhard => 1.0 - 1.0 / (1.0 + positive),
            ToneCurve::Screen => return (positive.min(1.0) * 255.0).round() as u8,
        };
        (srgb_from_linear(toned) * 255.0).round() as u8
    }
}

/// sRGB transfer function on 0..=1.
fn srgb_from_linear(linear: f64) -> f64 {
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_of_the_screen_pass_through() {
        let display = Display {
            curve: ToneCurve::Screen,
            ..Display::default()
        };
        for byte in 0..=255_u8 {
            assert_eq!(display.encode(f32::from(byte) / 255.0), byte);
        }
        let odd = [-1.0, f32::NAN, 2.0, f32::INFINITY];
        assert_eq!(odd.map(|v| display.encode(v)), [0, 0, 255, 255]);
    }

    const CLAMP: Display = Display {
        exposure_ev: 0.0,
        curve: ToneCurve::Clamp,
    };
    const REINHARD: Display = Display {
        exposure_ev: 0.0,
        curve: ToneCurve::Reinhard,
    };

    #[test]
    fn golden_values_of_the_transfer_function() {
        // Computed from the definition with 30 digits.
        let golden = [
            (0.0, 0),
            (0.000_1, 0),
            (0.001, 3),
            (0.003, 10),
            (0.0032, 11),
            (0.01, 25),
            (0.05, 63),
            (0.18, 118),
            (0.214, 127),
            (0.5, 188),
            (0.9, 243),
            (1.0, 255),
        ];
        for (linear, byte) in golden {
            assert_eq!(CLAMP.encode(linear), byte, "linear {linear}");
        }
    }

    #[test]
    fn every_byte_survives_the_inverse_of_the_standard() {
        for byte in 0..=255u8 {
            let encoded = f64::from(byte) / 255.0;
            let linear = if encoded <= 0.04045 {
                encoded / 12.92
            } else {
                ((encoded + 0.055) / 1.055).powf(2.4)
            };
            assert_eq!(CLAMP.encode(linear as f32), byte);
        }
    }

    #[test]
    fn values_that_no_screen_shows() {
        for display in [CLAMP, REINHARD] {
            assert_eq!(display.encode(f32::NAN), 0);
            assert_eq!(display.encode(-1.0), 0);
            assert_eq!(display.encode(f32::NEG_INFINITY), 0);
            assert_eq!(display.encode(f32::INFINITY), 255);
        }
        assert_eq!(CLAMP.encode(f32::MAX), 255);
        let blinding = Display {
            exposure_ev: f32::INFINITY,
            ..CLAMP
        };
        assert_eq!([0.0, 1e-30].map(|value| blinding.encode(value)), [0, 255]);
        let unset = Display {
            exposure_ev: f32::NAN,
            ..CLAMP
        };
        assert_eq!(unset.encode(1.0), 0);
    }

    #[test]
    fn exposure_is_a_power_of_two() {
        for (ev, radiance) in [(1.0, 0.25), (-1.0, 1.0), (3.0, 0.0625)] {
            let display = Display {
                exposure_ev: ev,
                ..CLAMP
            };
            assert_eq!(display.encode(radiance), CLAMP.encode(0.5));
        }
    }

    #[test]
    fn reinhard_halves_one() {
        assert_eq!(REINHARD.encode(1.0), CLAMP.encode(0.5));
        assert_eq!(REINHARD.encode(4.0), CLAMP.encode(0.8));
    }

    #[test]
    fn brighter_is_never_shown_darker() {
        for display in [CLAMP, REINHARD] {
            let shown: Vec<u8> = (0..4000).map(|i| display.encode(i as f32 * 1e-3)).collect();
            assert!(shown.is_sorted());
        }
    }
}
