//! Several numbers in one register: [`Real`] for the vector units of processors.

use std::ops::{Add, Mul, Neg, Sub};

use crate::real::Real;

/// Lanes of a register, which can be filled from memory and written to it.
pub(crate) trait Lanes: Real {
    /// Number of lanes, at most [`MOST_LANES`].
    const COUNT: usize;

    /// Returns the first [`COUNT`](Self::COUNT) numbers.
    fn read(self, numbers: &[f64; MOST_LANES]) -> Self;

    /// Writes the lanes to the first [`COUNT`](Self::COUNT) numbers.
    fn write(self, numbers: &mut [f64; MOST_LANES]);
}

/// Largest number of lanes: a register of AVX-512.
pub(crate) const MOST_LANES: usize = 8;

/// Four lanes for every processor: two registers of SSE2 or NEON.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FourLanes(wide::f64x4);

impl FourLanes {
    pub(crate) const ZERO: Self = Self(wide::f64x4::ZERO);
}

macro_rules! four_lanes_operator {
    ($operator:ident, $method:ident) => {
        impl $operator for FourLanes {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(self.0.$method(other.0))
            }
        }
    };
}
four_lanes_operator!(Add, add);
four_lanes_operator!(Sub, sub);
four_lanes_operator!(Mul, mul);

impl Neg for FourLanes {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl Mul<f64> for FourLanes {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        Self(self.0 * wide::f64x4::splat(factor))
    }
}

impl Real for FourLanes {
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        Self(self.0 * factor.0 + term.0)
    }

    #[inline(always)]
    fn splat(self, number: f64) -> Self {
        Self(wide::f64x4::splat(number))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.abs())
    }
}

impl Lanes for FourLanes {
    const COUNT: usize = 4;

    #[inline(always)]
    fn read(self, numbers: &[f64; MOST_LANES]) -> Self {
        let [a, b, c, d, ..] = *numbers;
        Self(wide::f64x4::new([a, b, c, d]))
    }

    #[inline(always)]
    fn write(self, numbers: &mut [f64; MOST_LANES]) {
        numbers[..4].copy_from_slice(&self.0.to_array());
    }
}

/// A register of a vector unit that was found at run time. The proof of it is part of the value and
/// takes no memory.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Register<S: pulp::Simd> {
    simd: S,
    lanes: S::f64s,
}

impl<S: pulp::Simd> Register<S> {
    #[inline(always)]
    pub(crate) fn zero(simd: S) -> Self {
        Self {
            simd,
            lanes: simd.splat_f64s(0.0),
        }
    }

    #[inline(always)]
    fn with(self, lanes: S::f64s) -> Self {
        Self { lanes, ..self }
    }
}

impl<S: pulp::Simd> Add for Register<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.with(self.simd.add_f64s(self.lanes, other.lanes))
    }
}

impl<S: pulp::Simd> Sub for Register<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.with(self.simd.sub_f64s(self.lanes, other.lanes))
    }
}

impl<S: pulp::Simd> Mul for Register<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.with(self.simd.mul_f64s(self.lanes, other.lanes))
    }
}

impl<S: pulp::Simd> Mul<f64> for Register<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        self.with(self.simd.mul_f64s(self.lanes, self.simd.splat_f64s(factor)))
    }
}

impl<S: pulp::Simd> Neg for Register<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.with(self.simd.neg_f64s(self.lanes))
    }
}

impl<S: pulp::Simd> Real for Register<S> {
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        self.with(
            self.simd
                .mul_add_e_f64s(self.lanes, factor.lanes, term.lanes),
        )
    }

    #[inline(always)]
    fn splat(self, number: f64) -> Self {
        self.with(self.simd.splat_f64s(number))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        self.with(self.simd.abs_f64s(self.lanes))
    }
}

impl<S: pulp::Simd> Lanes for Register<S> {
    const COUNT: usize = S::F64_LANES;

    #[inline(always)]
    fn read(self, numbers: &[f64; MOST_LANES]) -> Self {
        let bytes = pulp::bytemuck::cast_slice(&numbers[..Self::COUNT]);
        self.with(pulp::bytemuck::pod_read_unaligned(bytes))
    }

    #[inline(always)]
    fn write(self, numbers: &mut [f64; MOST_LANES]) {
        let bytes = pulp::bytemuck::cast_slice_mut(&mut numbers[..Self::COUNT]);
        bytes.copy_from_slice(pulp::bytemuck::bytes_of(&self.lanes));
    }
}
