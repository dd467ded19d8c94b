//! Loops over all windows, compiled for the vector unit of the processor at hand.

/// A computation that is compiled for each vector unit.
///
/// Results do not depend on the processor: wider units compute more entries at once, but neither
/// change the order of a sum nor round a product and a sum only once.
pub(super) trait Computation: Sized {
    type Output;

    /// Computes the result. It and all that it calls must be inlined (`#[inline(always)]`): a
    /// function of its own is compiled for the baseline. A closure cannot be marked so.
    fn compute(self) -> Self::Output;

    /// Computes the result with the widest vector unit that the processor has.
    fn on_widest_unit(self) -> Self::Output {
        pulp::Arch::new().dispatch(OnUnit(self))
    }
}

/// Lets pulp compile a computation for each vector unit.
struct OnUnit<C>(C);

impl<C: Computation> pulp::WithSimd for OnUnit<C> {
    type Output = C::Output;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> C::Output {
        self.0.compute()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sums of products with the lengths and the order of those of a fit.
    struct Sums<'a>(&'a [f64]);

    impl Computation for Sums<'_> {
        type Output = [f64; 10];

        #[inline(always)]
        fn compute(self) -> [f64; 10] {
            let mut sums = [0.0; 10];
            for row in self.0.chunks_exact(11) {
                for k in 0..10 {
                    sums[k] += row[k] * row[10] - row[9 - k] * row[k];
                }
            }
            sums
        }
    }

    /// A wider unit gives the same digits: the compiler does not fuse a product and a sum, nor
    /// change the order of sums.
    #[test]
    fn results_do_not_depend_on_the_unit() {
        let numbers: Vec<f64> = (1..11_000).map(|k| (1.7 * f64::from(k)).sin()).collect();
        let baseline = Sums(&numbers).compute();
        let widest = Sums(&numbers).on_widest_unit();
        assert_eq!(baseline.map(f64::to_bits), widest.map(f64::to_bits));
    }
}
