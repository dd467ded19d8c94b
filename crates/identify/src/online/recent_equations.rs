//! The most recent equations, in a fixed amount of memory.

use crate::equations::Equation;
use educe::Educe;

/// Number of equations that are kept: those of 10 s at a cutoff of 10 Hz.
const RECENT_EQUATIONS: usize = 324;

/// The most recent equations, at most 324. Nothing is allocated after construction but for
/// [`in_order`](Self::in_order).
#[derive(Debug, Educe)]
#[educe(Clone)]
pub struct RecentEquations {
    equations: Vec<Equation>,
    /// Number of equations so far, of which the most recent ones are kept.
    count: usize,
}

impl RecentEquations {
    /// Creates the memory for equations of so many channels.
    pub(crate) fn new(channels: usize) -> Self {
        Self {
            equations: vec![Equation::new(channels); RECENT_EQUATIONS],
            count: 0,
        }
    }

    /// Adds an equation, in place of the oldest one where there is no room.
    pub(crate) fn push(&mut self, equation: &Equation) {
        self.equations[self.count % RECENT_EQUATIONS].clone_from(equation);
        self.count += 1;
    }

    /// Discards all equations.
    pub(crate) fn clear(&mut self) {
        self.count = 0;
    }

    /// Returns a copy of the equations in the order of time.
    #[must_use]
    pub fn in_order(&self) -> Vec<Equation> {
        let (newer, older) = self.equations.split_at(self.count % RECENT_EQUATIONS);
        if self.count < RECENT_EQUATIONS {
            newer.to_vec()
        } else {
            [older, newer].concat()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The most recent equations are kept in the order of time, and none after clearing.
    #[test]
    fn keeps_the_most_recent_ones_in_order() {
        let mut recent = RecentEquations::new(1);
        let mut equation = Equation::new(1);
        for count in 0..3 * RECENT_EQUATIONS {
            let times: Vec<usize> = recent
                .in_order()
                .iter()
                .map(|e| e.time_s as usize)
                .collect();
            let expected: Vec<usize> = (count.saturating_sub(RECENT_EQUATIONS)..count).collect();
            assert_eq!(times, expected);
            equation.time_s = count as f64;
            recent.push(&equation);
        }
        recent.clear();
        assert!(recent.in_order().is_empty());
    }
}
