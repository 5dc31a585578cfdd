//! Goals of a benchmark: met or missed, and which were missed.

/// Counts goals.
#[derive(Debug, Default)]
pub struct Goals {
    met: usize,
    missed: Vec<String>,
}

impl Goals {
    /// Counts one; `what` is printed if it is missed.
    pub fn check(&mut self, what: String, met: bool) {
        if met {
            self.met += 1
        } else {
            self.missed.push(what)
        }
    }

    /// Prints the missed ones and the count.
    pub fn print(&self) {
        println!();
        for missed in &self.missed {
            println!("missed: {missed}");
        }
        println!(
            "goals: {} of {} met",
            self.met,
            self.met + self.missed.len()
        );
    }
}
