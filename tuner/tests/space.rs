//! Spaces: what they refuse, and properties of decode, encode and canonical over random spaces.

use proptest::prelude::*;
use raywright_tuner::{CanonRule, Config, Kind, Param, Scale, Space, SpaceError, Value};

/// The printed space of a tree builder: conditions, constraint and rules at once.
fn builder_space() -> Space {
    Space::new(vec![
        Param::ordinal("quality", vec![1, 2, 3], ""),
        Param::integer("block", 1..=32, Scale::Linear, "").active_if("quality", [2, 3]),
        Param::integer("least", 1..=32, Scale::Linear, ""),
        Param::integer("most", 1..=32, Scale::Linear, "").active_if("quality", [2, 3]),
        Param::real("above", 0.0..=10.0, Scale::Linear, "").active_if("quality", [2, 3]),
        Param::real("below", 0.0..=10.0, Scale::Linear, "").active_if("quality", [2, 3]),
        Param::boolean("compact", ""),
    ])
    .and_then(|space| space.with_at_most("least", "most"))
    .and_then(|space| space.with_canon(CanonRule::FloorToPowerOfTwo("block".to_owned())))
    .and_then(|space| {
        space.with_canon(CanonRule::OnlyRatio {
            numerator: "above".to_owned(),
            denominator: "below".to_owned(),
        })
    })
    .unwrap()
}

fn builder_config(quality: i64, block: i64, above: f64, below: f64) -> Config {
    builder_space()
        .config(&[
            ("quality", quality.into()),
            ("block", block.into()),
            ("least", 2.into()),
            ("most", 9.into()),
            ("above", above.into()),
            ("below", below.into()),
            ("compact", false.into()),
        ])
        .unwrap()
}

fn scale() -> impl Strategy<Value = Scale> {
    prop_oneof![Just(Scale::Linear), Just(Scale::Log)]
}

fn integer_kind() -> impl Strategy<Value = Kind> {
    let small = (1i64..100, 0i64..100);
    let large = (1i64..1_000_000, 0i64..900_000_000_000);
    (prop_oneof![small, large], scale()).prop_map(|((min, width), scale)| Kind::Integer {
        min,
        max: min + width,
        scale,
    })
}

fn negative_kind() -> impl Strategy<Value = Kind> {
    (-1000i64..1000, 0i64..3000).prop_map(|(min, width)| Kind::Integer {
        min,
        max: min + width,
        scale: Scale::Linear,
    })
}

fn ordinal_kind() -> impl Strategy<Value = Kind> {
    prop::collection::btree_set(-50i64..50, 1..9)
        .prop_map(|values| Kind::Ordinal(values.into_iter().collect()))
}

fn real_kind() -> impl Strategy<Value = Kind> {
    let positive = (-11i32..11, 1.0f64..10.0, 1e-5f64..1e3, scale()).prop_map(
        |(exponent, digits, width, scale)| {
            let min = digits * 10f64.powi(exponent);
            let max = (min * (1.0 + width)).min(1e12);
            Kind::Real { min, max, scale }
        },
    );
    let linear = (-1e3f64..1e3, 0.1f64..1e4).prop_map(|(min, width)| Kind::Real {
        min,
        max: min + width,
        scale: Scale::Linear,
    });
    prop_oneof![positive, linear]
}

fn kind() -> impl Strategy<Value = Kind> {
    prop_oneof![
        Just(Kind::Bool),
        integer_kind(),
        negative_kind(),
        ordinal_kind(),
        real_kind()
    ]
}

fn param(name: &str, kind: Kind) -> Param {
    Param {
        name: name.to_owned(),
        kind,
        active_if: None,
        doc: String::new(),
    }
}

fn values(config: &Config) -> Vec<Value> {
    config.iter().map(|(_, value)| value).collect()
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 2000,
        // Found bugs become named cases; no file is written beside the tests.
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn encoding_is_undone_by_decoding(kind in kind(), unit in 0.0f64..=1.0) {
        let space = Space::new(vec![param("x", kind)]).unwrap();
        let config = space.decode(&[unit]);
        prop_assert_eq!(space.check(&config), Ok(()));
        let encoded = space.encode(&config);
        prop_assert!((0.0..=1.0).contains(&encoded[0]));
        prop_assert_eq!(space.decode(&encoded), config);
    }

    #[test]
    fn given_reals_are_encoded_exactly(kind in real_kind(), part in 0.0f64..=1.0) {
        let space = Space::new(vec![param("x", kind)]).unwrap();
        let Kind::Real { min, max, .. } = space.params()[0].kind else { unreachable!() };
        let value = (min + part * (max - min)).clamp(min, max);
        let config = space.config(&[("x", value.into())]).unwrap();
        let held = config.real("x").unwrap();
        prop_assert!((held - value).abs() <= 1e-9 * min.abs().max(max.abs()));
        prop_assert_eq!(space.decode(&space.encode(&config)), config);
    }

    #[test]
    fn integers_decode_monotonically(kind in integer_kind(), a in 0.0f64..=1.0, b in 0.0f64..=1.0) {
        let space = Space::new(vec![param("x", kind)]).unwrap();
        let at = |unit: f64| space.decode(&[unit]).integer("x").unwrap();
        prop_assert!(at(a.min(b)) <= at(a.max(b)));
    }

    #[test]
    fn constraints_hold_between_any_ranges(
        kinds in prop_oneof![
            (integer_kind(), ordinal_kind()),
            (ordinal_kind(), integer_kind()),
            (ordinal_kind(), ordinal_kind()),
            (negative_kind(), negative_kind()),
            (real_kind(), real_kind()),
        ],
        units in (0.0f64..=1.0, 0.0f64..=1.0),
    ) {
        let space = Space::new(vec![param("a", kinds.0), param("b", kinds.1)]).unwrap();
        // One of the two directions is possible with any two ranges.
        let space = space.clone().with_at_most("a", "b").or(space.with_at_most("b", "a")).unwrap();
        let config = space.decode(&[units.0, units.1]);
        prop_assert_eq!(space.check(&config), Ok(()));
        prop_assert_eq!(space.decode(&space.encode(&config)), config);
    }

    #[test]
    fn canonical_is_idempotent(units in prop::collection::vec(0.0f64..=1.0, 7)) {
        let space = builder_space();
        let config = space.decode(&units);
        prop_assert_eq!(space.check(&config), Ok(()));
        prop_assert_eq!(space.decode(&space.encode(&config)), config.clone());
        let canonical = space.canonical(&config);
        prop_assert_eq!(space.canonical(&canonical), canonical);
    }

    #[test]
    fn inactive_values_do_not_matter(units in prop::collection::vec(0.0f64..=1.0, 3)) {
        // Quality 1 leaves block, most and both costs without effect; least stays below any most.
        let config = |rest: f64| {
            let point = [0.0, rest, 0.2 * units[0], 0.5 + rest / 2.0, rest, units[1] * rest, units[2]];
            builder_space().decode(&point)
        };
        let space = builder_space();
        prop_assert_eq!(space.canonical(&config(0.1)), space.canonical(&config(0.9)));
    }

    #[test]
    fn decoding_takes_any_number(units in prop::collection::vec(any::<f64>(), 7)) {
        let space = builder_space();
        prop_assert_eq!(space.check(&space.decode(&units)), Ok(()));
    }
}

#[test]
fn every_bin_has_the_same_width() {
    let space = Space::new(vec![
        Param::integer("n", 1..=5, Scale::Linear, ""),
        Param::ordinal("o", vec![2, 4, 8], ""),
        Param::boolean("b", ""),
    ])
    .unwrap();
    let mut counts = std::collections::BTreeMap::new();
    for index in 0..3000 {
        let unit = (f64::from(index) + 0.5) / 3000.0;
        for (name, value) in space.decode(&[unit; 3]).iter() {
            *counts
                .entry((name.to_owned(), value.to_string()))
                .or_insert(0) += 1;
        }
    }
    for ((name, value), count) in counts {
        let expected = match name.as_str() {
            "n" => 600,
            "o" => 1000,
            _ => 1500,
        };
        assert_eq!(count, expected, "{name} = {value}");
    }
}

#[test]
fn logarithmic_scales_give_each_octave_the_same_room() {
    let space = Space::new(vec![
        Param::integer("n", 1..=63, Scale::Log, ""),
        Param::real("x", 1.0..=64.0, Scale::Log, ""),
    ])
    .unwrap();
    // The bins of 1..=63 reach from ln 1 to ln 64: six octaves.
    for octave in 0..6 {
        let unit = (f64::from(octave) + 0.001) / 6.0;
        let config = space.decode(&[unit, f64::from(octave) / 6.0]);
        assert_eq!(config.integer("n"), Some(1 << octave));
        assert_eq!(config.real("x"), Some(f64::from(1 << octave)));
    }
}

#[test]
fn typed_decimals_stay_as_they_are() {
    let space = Space::new(vec![Param::real("x", 0.0..=10.0, Scale::Linear, "")]).unwrap();
    for value in [0.0, 0.1, 0.7, 1.0, 3.3, 9.99, 10.0] {
        assert_eq!(
            space.config(&[("x", value.into())]).unwrap().real("x"),
            Some(value)
        );
    }
}

#[test]
fn canonical_joins_what_does_the_same() {
    let space = builder_space();
    let canonical = |quality, block, above, below| {
        space.canonical(&builder_config(quality, block, above, below))
    };
    assert_eq!(canonical(2, 5, 1.0, 3.0), canonical(2, 7, 2.0, 6.0));
    assert_eq!(canonical(2, 1, 5.0, 0.0), canonical(2, 1, 0.0, 0.0));
    assert_eq!(canonical(1, 5, 1.0, 3.0), canonical(1, 32, 9.0, 0.1));
    assert_ne!(canonical(2, 5, 1.0, 3.0), canonical(2, 8, 1.0, 3.0));
    assert_ne!(canonical(2, 5, 1.0, 3.0), canonical(2, 5, 1.0, 2.0));
    assert_ne!(canonical(2, 5, 1.0, 3.0), canonical(3, 5, 1.0, 3.0));
    let joined = canonical(2, 5, 1.0, 6.0);
    assert_eq!(joined.integer("block"), Some(4));
    assert_eq!(
        (joined.real("above"), joined.real("below")),
        (Some(0.25), Some(1.5))
    );
    // The greater side of the constraint rests at its highest value.
    assert_eq!(canonical(1, 5, 1.0, 3.0).integer("most"), Some(32));
}

#[test]
fn inactive_parameters_may_be_left_out() {
    let space = builder_space();
    let given = [
        ("quality", 1.into()),
        ("least", 4.into()),
        ("compact", true.into()),
    ];
    let config = space.config(&given).unwrap();
    assert_eq!(values(&config)[2], Value::Integer(4));
    let active = [
        ("quality", 2.into()),
        ("least", 4.into()),
        ("compact", true.into()),
    ];
    assert_eq!(
        space.config(&active),
        Err(SpaceError::Missing {
            name: "block".to_owned()
        })
    );
}

#[test]
fn a_configuration_is_checked() {
    let space = Space::new(vec![
        Param::integer("a", 1..=8, Scale::Linear, ""),
        Param::integer("b", 4..=9, Scale::Linear, ""),
    ])
    .and_then(|space| space.with_at_most("a", "b"))
    .unwrap();
    let error = |given: &[(&str, Value)]| space.config(given).unwrap_err().to_string();
    assert_eq!(error(&[("a", 1.into())]), "parameter b is missing");
    assert_eq!(error(&[("c", 1.into())]), "there is no parameter c");
    assert_eq!(
        error(&[("a", 1.into()), ("a", 1.into())]),
        "parameter a is given twice"
    );
    assert_eq!(
        error(&[("a", 9.into())]),
        "parameter a cannot be 9: it is an integer in 1..=8"
    );
    assert_eq!(
        error(&[("a", 1.0.into())]),
        "parameter a cannot be 1: it is an integer in 1..=8"
    );
    assert_eq!(
        error(&[("a", 6.into()), ("b", 5.into())]),
        "a = 6 must be at most b = 5"
    );
    let foreign = builder_space().decode(&[0.5; 7]);
    assert_eq!(space.check(&foreign), Err(SpaceError::ForeignConfig));
}

#[test]
fn impossible_params_are_refused() {
    let refuse = |param: Param| Space::new(vec![param]).unwrap_err();
    #[expect(
        clippy::reversed_empty_ranges,
        reason = "it is the empty range that is refused"
    )]
    let empty = Param::integer("x", 3..=2, Scale::Linear, "");
    assert!(matches!(refuse(empty), SpaceError::EmptyRange { .. }));
    for values in [vec![], vec![1, 1], vec![2, 1]] {
        assert!(matches!(
            refuse(Param::ordinal("x", values, "")),
            SpaceError::EmptyRange { .. }
        ));
    }
    let log = Param::integer("x", 0..=2, Scale::Log, "");
    assert!(matches!(refuse(log), SpaceError::LogOfNonPositive { .. }));
    let log = Param::real("x", 0.0..=2.0, Scale::Log, "");
    assert!(matches!(refuse(log), SpaceError::LogOfNonPositive { .. }));
    let wide = Param::integer("x", i64::MIN..=i64::MAX, Scale::Linear, "");
    assert!(matches!(refuse(wide), SpaceError::UnusableRange { .. }));
    for (min, max) in [
        (0.0, f64::INFINITY),
        (f64::NAN, 1.0),
        (0.0, 1e13),
        (0.0, 1e-13),
        (1.0, 1.0 + 1e-9),
    ] {
        let real = Param::real("x", min..=max, Scale::Linear, "");
        assert!(
            matches!(refuse(real), SpaceError::UnusableRange { .. }),
            "{min}..={max}"
        );
    }
    assert_eq!(Space::new(vec![]), Err(SpaceError::NoParams));
    let twice = Space::new(vec![Param::boolean("x", ""), Param::boolean("x", "")]);
    assert_eq!(
        twice,
        Err(SpaceError::DuplicateParam {
            name: "x".to_owned()
        })
    );
}

#[test]
fn impossible_conditions_are_refused() {
    let refuse = |conditional: Param| {
        let params = vec![
            Param::ordinal("quality", vec![1, 2], ""),
            Param::real("x", 0.0..=1.0, Scale::Linear, ""),
            conditional,
        ];
        Space::new(params).unwrap_err()
    };
    let param = || Param::boolean("y", "");
    let unknown = refuse(param().active_if("z", [1]));
    assert!(matches!(unknown, SpaceError::ConditionNotEarlier { .. }));
    let itself = refuse(param().active_if("y", [true]));
    assert!(matches!(itself, SpaceError::ConditionNotEarlier { .. }));
    let real = refuse(param().active_if("x", [0.5]));
    assert!(matches!(real, SpaceError::ConditionNotDiscrete { .. }));
    let never = refuse(param().active_if("quality", Vec::<Value>::new()));
    assert!(matches!(never, SpaceError::ConditionNotDiscrete { .. }));
    let impossible = refuse(param().active_if("quality", [3]));
    assert!(matches!(impossible, SpaceError::NotAValue { .. }));
}

#[test]
fn impossible_constraints_are_refused() {
    let space = || {
        Space::new(vec![
            Param::integer("a", 1..=4, Scale::Linear, ""),
            Param::integer("b", 3..=9, Scale::Linear, ""),
            Param::integer("c", 5..=9, Scale::Linear, ""),
            Param::real("x", 0.0..=1.0, Scale::Linear, ""),
            Param::boolean("y", ""),
        ])
        .unwrap()
    };
    for (lesser, greater) in [("c", "a"), ("a", "x"), ("y", "a"), ("a", "a")] {
        let refused = space().with_at_most(lesser, greater).unwrap_err();
        assert!(
            matches!(refused, SpaceError::NotOrderable { .. }),
            "{lesser} <= {greater}"
        );
    }
    let unknown = space().with_at_most("a", "z").unwrap_err();
    assert_eq!(
        unknown,
        SpaceError::UnknownParam {
            name: "z".to_owned()
        }
    );
    let chain = space()
        .with_at_most("a", "b")
        .unwrap()
        .with_at_most("b", "c")
        .unwrap_err();
    assert_eq!(
        chain,
        SpaceError::ConstrainedTwice {
            name: "b".to_owned()
        }
    );
}

#[test]
fn impossible_rules_are_refused() {
    let space = || {
        Space::new(vec![
            Param::integer("zero", 0..=4, Scale::Linear, ""),
            Param::integer("decides", 1..=4, Scale::Linear, ""),
            Param::boolean("y", "").active_if("decides", [3]),
            Param::real("x", 0.0..=1.0, Scale::Linear, ""),
            Param::real("negative", -1.0..=1.0, Scale::Linear, ""),
        ])
        .unwrap()
    };
    let floor = |name: &str| CanonRule::FloorToPowerOfTwo(name.to_owned());
    let ratio = |numerator: &str, denominator: &str| CanonRule::OnlyRatio {
        numerator: numerator.to_owned(),
        denominator: denominator.to_owned(),
    };
    for rule in [
        floor("zero"),
        floor("x"),
        ratio("x", "negative"),
        ratio("x", "zero"),
    ] {
        let refused = space().with_canon(rule.clone()).unwrap_err();
        assert!(
            matches!(refused, SpaceError::RuleDoesNotFit { .. }),
            "{rule:?}"
        );
    }
    for rule in [floor("decides"), ratio("x", "x")] {
        let refused = space().with_canon(rule.clone()).unwrap_err();
        assert!(matches!(refused, SpaceError::RuledTwice { .. }), "{rule:?}");
    }
}
