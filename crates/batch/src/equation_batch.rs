//! The equations of a whole recording, in bounded memory.

use tactid_identify::equations::Equation;

/// Number of equations at which neighbours are merged, which halves their number and the cutoff.
const MOST_EQUATIONS: usize = 30_000;

/// Equations in the order of time, at most 30 000: more are merged with their neighbours, which
/// halves the cutoff of the filter.
#[derive(Clone, Debug, Default)]
pub struct EquationBatch {
    equations: Vec<Equation>,
    /// Number of windows of which each equation is the mean.
    merged: u32,
    /// Windows that wait to be merged with the next ones.
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
        if self.equations.len() >= MOST_EQUATIONS {
            self.equations = self.equations.chunks(2).filter_map(merge).collect();
            self.merged *= 2;
        }
    }
}

/// Returns the mean of equations, which is an equation; `None` without any.
fn merge(equations: &[Equation]) -> Option<Equation> {
    let (first, others) = equations.split_first()?;
    if others.is_empty() {
        return Some(first.clone());
    }
    let weight = 1.0 / equations.len() as f64;
    let mut mean = Equation::new(first.rows.len());
    let middle_s = equations
        .iter()
        .map(|equation| equation.time_s)
        .sum::<f64>()
        * weight;
    mean.time_s = middle_s;
    for equation in equations {
        mean.add_mean(equation, weight);
    }
    Some(mean)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The number of equations is bounded for a recording of any length, and merging changes no
    /// mean.
    #[test]
    fn memory_is_bounded_and_nothing_lost() {
        let mut batch = EquationBatch::default();
        let count = 4 * MOST_EQUATIONS;
        for k in 0..count {
            let mut equation = Equation::new(1);
            equation.time_s = k as f64;
            equation.rows[0].target = k as f64;
            equation.rates[0] = -(k as f64);
            batch.push(&equation);
        }
        assert!(batch.equations.len() <= MOST_EQUATIONS);
        assert_eq!(batch.merged, 8);
        let length = batch.equations.len() as f64;
        let mean = |of: fn(&Equation) -> f64| batch.equations.iter().map(of).sum::<f64>() / length;
        let target = (count - 1) as f64 / 2.0;
        assert!((mean(|e| e.rows[0].target) - target).abs() < 1e-6 * target);
        assert!((mean(|e| e.rates[0]) + target).abs() < 1e-6 * target);
        assert!((mean(|e| e.time_s) - target).abs() < 1e-6 * target);
    }
}
