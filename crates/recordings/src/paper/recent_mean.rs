//! Moving average over the last seconds, in constant memory.

/// Number of bins into which the span is divided. The mean covers the span to within one bin.
const BINS: usize = 100;

/// Sum of the values in one bin of time.
#[derive(Clone, Copy, Debug, Default)]
struct Bin {
    sum: [f64; 10],
    count: u64,
}

/// Mean of ten values over the last `span_s` seconds.
#[derive(Clone, Debug)]
pub(crate) struct RecentMean {
    span_s: f64,
    bins: Box<[Bin; BINS]>,
    /// Number of the newest bin, counted from time zero.
    newest: i64,
}

impl RecentMean {
    /// Creates an empty average over a positive span, s.
    pub(crate) fn new(span_s: f64) -> Self {
        Self {
            span_s,
            bins: Box::new([Bin::default(); BINS]),
            newest: i64::MIN,
        }
    }

    /// Adds values at a time, s, which must not decrease.
    pub(crate) fn push(&mut self, time_s: f64, values: &[f64; 10]) {
        let number = (time_s / self.span_s * BINS as f64).floor() as i64;
        if number != self.newest {
            let passed = number.saturating_sub(self.newest).min(BINS as i64);
            for back in 0..passed {
                self.bins[place(number - back)] = Bin::default();
            }
            self.newest = number;
        }
        let bin = &mut self.bins[place(number)];
        for (sum, value) in bin.sum.iter_mut().zip(values) {
            *sum += value;
        }
        bin.count += 1;
    }

    /// Returns the mean; `None` before the first value.
    pub(crate) fn mean(&self) -> Option<[f64; 10]> {
        let count: u64 = self.bins.iter().map(|bin| bin.count).sum();
        let mut mean = [0.0; 10];
        for bin in self.bins.iter() {
            for (mean, sum) in mean.iter_mut().zip(&bin.sum) {
                *mean += sum / count as f64;
            }
        }
        (count > 0).then_some(mean)
    }
}

/// Returns the place of a bin in the ring. Numbers may be negative.
fn place(number: i64) -> usize {
    number.rem_euclid(BINS as i64) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean of the last 10 s of a ramp over 100 s is its value at 95 s.
    #[test]
    fn covers_the_last_span_and_no_more() {
        let mut recent = RecentMean::new(10.0);
        assert_eq!(recent.mean(), None);
        for k in -20_000..100_000 {
            let time_s = f64::from(k) * 1e-3;
            recent.push(time_s, &[time_s; 10]);
        }
        assert!((recent.mean().unwrap()[3] - 95.0).abs() < 1e-3);
    }

    /// After a pause longer than the span, the mean has no values from before it.
    #[test]
    fn forgets_across_a_pause() {
        let mut recent = RecentMean::new(1.0);
        recent.push(0.0, &[5.0; 10]);
        recent.push(1e9, &[7.0; 10]);
        assert_eq!(recent.mean(), Some([7.0; 10]));
    }
}
