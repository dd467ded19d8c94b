//! The mean over the last few seconds, in constant memory.

/// The span is kept in this many pieces; the mean covers it to within one piece.
const PIECES: usize = 100;

#[derive(Clone, Copy, Debug, Default)]
struct Piece {
    sum: [f64; 10],
    count: u64,
}

/// Mean of ten values over the last `span_s`.
#[derive(Clone, Debug)]
pub(crate) struct RecentMean {
    span_s: f64,
    pieces: Box<[Piece; PIECES]>,
    /// The number of the piece that is being filled, counted from time zero.
    newest: i64,
}

impl RecentMean {
    pub(crate) fn new(span_s: f64) -> Self {
        Self {
            span_s,
            pieces: Box::new([Piece::default(); PIECES]),
            newest: i64::MIN,
        }
    }

    /// Times must not decrease.
    pub(crate) fn push(&mut self, time_s: f64, values: &[f64; 10]) {
        let number = (time_s / self.span_s * PIECES as f64).floor() as i64;
        if number != self.newest {
            let passed = number.saturating_sub(self.newest).min(PIECES as i64);
            for back in 0..passed {
                self.pieces[slot(number - back)] = Piece::default();
            }
            self.newest = number;
        }
        let piece = &mut self.pieces[slot(number)];
        for (sum, value) in piece.sum.iter_mut().zip(values) {
            *sum += value;
        }
        piece.count += 1;
    }

    /// `None` before the first value.
    pub(crate) fn mean(&self) -> Option<[f64; 10]> {
        let count: u64 = self.pieces.iter().map(|piece| piece.count).sum();
        let mut mean = [0.0; 10];
        for piece in self.pieces.iter() {
            for (mean, sum) in mean.iter_mut().zip(&piece.sum) {
                *mean += sum / count as f64;
            }
        }
        (count > 0).then_some(mean)
    }
}

/// Where a piece stands in the ring; numbers may be negative.
fn slot(number: i64) -> usize {
    number.rem_euclid(PIECES as i64) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a ramp over 100 s, the mean of the last 10 s is its value at 95 s.
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

    /// After a pause longer than the span nothing from before it is left.
    #[test]
    fn forgets_across_a_pause() {
        let mut recent = RecentMean::new(1.0);
        recent.push(0.0, &[5.0; 10]);
        recent.push(1e9, &[7.0; 10]);
        assert_eq!(recent.mean(), Some([7.0; 10]));
    }
}
