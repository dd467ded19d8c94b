//! Loops over all windows, compiled for the vector unit of the processor at hand.

#[cfg(test)]
use super::products::{Products, WIDTH};

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

/// Checks that sums of products have the same digits on the widest unit as on the baseline: the
/// compiler neither fuses a product and a sum, nor changes the order of sums.
#[cfg(test)]
pub(super) fn assert_same_digits(sums: impl Computation<Output = [Products; 2]> + Copy) {
    let digits = |products: Products| {
        let entries = (0..WIDTH * WIDTH).map(|k| products.entry(k / WIDTH, k % WIDTH));
        entries.map(f64::to_bits).collect::<Vec<_>>()
    };
    let baseline = sums.compute().map(digits);
    assert!(baseline.iter().flatten().any(|&bits| bits != 0));
    assert_eq!(baseline, sums.on_widest_unit().map(digits));
}
