//! Loops over all windows, compiled for the vector unit of the processor at hand.

/// A computation that is compiled for each vector unit.
///
/// Results do not depend on the processor: wider units compute more entries at once, but neither change the order of a sum
/// nor round a product and a sum only once.
pub(super) trait Computation: Sized {
    type Output;

    /// Computes the result. It and all that it calls must be inlined (`#[inline(always)]`): a function of its own is compiled
    /// for the baseline. A closure cannot be marked so.
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
