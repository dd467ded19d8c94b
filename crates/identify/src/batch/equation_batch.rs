//! The equations of a whole recording, in bounded memory.

use crate::equations::Equation;

/// More equations than this are not kept: neighbours are merged, which halves the cutoff.
const MOST: usize = 30_000;

/// Equations in the order of time.
#[derive(Clone, Debug, Default)]
pub struct EquationBatch {
    equations: Vec<Equation>,
    /// Number of windows each equation is the mean of: a power of two.
    merged: u32,
    /// Windows to be merged with the next ones.
    pending: Vec<Equation>,
}

impl EquationBatch {
    /// The equations, in the order of time.
    #[must_use]
    pub fn equations(&self) -> &[Equation] {
        &self.equations
    }

    /// Number of windows of which each equation is the mean: a power of two; 0 before the first.
    #[must_use]
    pub fn merged(&self) -> u32 {
        self.merged
    }

    /// Adds an equation, later than all before.
    pub fn push(&mut self, equation: &Equation) {
        self.merged = self.merged.max(1);
        self.pending.push(equation.clone());
        if self.pending.len() < self.merged as usize {
            return;
        }
        self.equations.extend(merge(&self.pending));
        self.pending.clear();
        if self.equations.len() >= MOST {
            self.equations = self.equations.chunks(2).filter_map(merge).collect();
            self.merged *= 2;
        }
    }
}

/// The mean of equations, which is an equation.
fn merge(equations: &[Equation]) -> Option<Equation> {
    let (first, others) = equations.split_first()?;
    if others.is_empty() {
        return Some(first.clone());
    }
    let share = 1.0 / equations.len() as f64;
    let mut mean = Equation::new(first.rows.len());
    let middle_s = equations
        .iter()
        .map(|equation| equation.time_s)
        .sum::<f64>()
        * share;
    mean.clear(middle_s);
    for equation in equations {
        mean.add_mean(equation, share);
    }
    Some(mean)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::equations::Row;

    /// However long the recording, no more than the bound is kept, and nothing is lost: the mean over
    /// all equations stays what it was.
    #[test]
    fn memory_is_bounded_and_nothing_lost() {
        let mut records = EquationBatch::default();
        let count = 4 * MOST;
        for k in 0..count {
            let mut equation = Equation::new(1);
            equation.clear(k as f64);
            let row = Row {
                target: k as f64,
                ..Row::zero()
            };
            equation.add(&[row], 1.0, 0.0, 1.0);
            equation.finish();
            equation.rates[0] = -(k as f64);
            records.push(&equation);
        }
        assert!(records.equations.len() <= MOST);
        assert_eq!(records.merged, 8);
        let kept = records.equations.len() as f64;
        let mean = |of: fn(&Equation) -> f64| records.equations.iter().map(of).sum::<f64>() / kept;
        let target = (count - 1) as f64 / 2.0;
        assert!((mean(|e| e.rows[0].target) - target).abs() < 1e-6 * target);
        assert!((mean(|e| e.rates[0]) + target).abs() < 1e-6 * target);
        assert!((mean(|e| e.time_s) - target).abs() < 1e-6 * target);
    }
}
