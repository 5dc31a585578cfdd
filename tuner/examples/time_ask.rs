//! What an ask and a tell take: a space of seven axes, 100 trials told, for every search.
//!
//! `cargo run --release -p raywright-tuner --example time_ask`

use std::{error::Error, time::Instant};

use raywright_tuner::{Outcome, Param, SEARCH_NAMES, Scale, Space, Tuner, search_by_name};

fn main() -> Result<(), Box<dyn Error>> {
    let axis = |i| Param::real(&format!("x{i}"), 0.0..=1.0, Scale::Linear, "An axis.");
    for name in SEARCH_NAMES {
        let space = Space::new((0..7).map(axis).collect())?;
        let search = search_by_name(name).ok_or("a name in SEARCH_NAMES")?;
        let mut tuner = Tuner::new(space, search, 1);
        let mut times = Vec::new();
        for trial in 0..200 {
            let start = Instant::now();
            let trial_id = tuner.ask();
            let mut cost = 1.0;
            for i in 0..7 {
                let x = trial_id.config.real(&format!("x{i}")).ok_or("an axis")?;
                cost += (x - 0.4).powi(2) * f64::from(i);
            }
            tuner.tell(trial_id.id, Outcome::Done { cost })?;
            if trial >= 100 {
                times.push(1e6 * start.elapsed().as_secs_f64());
            }
        }
        times.sort_by(f64::total_cmp);
        println!(
            "{name:20} {:8.1} µs in the median, {:8.1} at most",
            times[50], times[99]
        );
    }
    Ok(())
}
