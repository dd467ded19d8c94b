//! Vectors and matrices of three dimensions for every [`Real`]. nalgebra's need numbers that exist
//! without a proof of the processor, which lanes of a register are not.
//!
//! No closure handles a number here or in the recursion: a closure is compiled for the baseline of
//! the processor, so that one which is not inlined is many times slower.

use std::ops::{Add, Mul, Sub};

use nalgebra::{Matrix3, Vector3};

use crate::real::Real;

/// A vector.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vec3<T>(pub(crate) [T; 3]);

/// A matrix, by rows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mat3<T>(pub(crate) [[T; 3]; 3]);

impl<T: Real> Vec3<T> {
    /// Returns a vector that is the same in all lanes of `like`.
    #[inline(always)]
    pub(crate) fn splat(like: T, vector: &Vec3<f64>) -> Self {
        let [x, y, z] = vector.0;
        Self([like.splat(x), like.splat(y), like.splat(z)])
    }

    /// Returns the dot product.
    #[inline(always)]
    pub(crate) fn dot(self, other: Self) -> T {
        let ([x, y, z], [a, b, c]) = (self.0, other.0);
        x.mul_add(a, y.mul_add(b, z * c))
    }

    /// Returns the products of the entries: `xx, xy, xz, yy, yz, zz`.
    #[inline(always)]
    pub(crate) fn products(self) -> [T; 6] {
        let [x, y, z] = self.0;
        [x * x, x * y, x * z, y * y, y * z, z * z]
    }

    /// Returns `self × other`.
    #[inline(always)]
    pub(crate) fn cross(self, other: Self) -> Self {
        let ([x, y, z], [a, b, c]) = (self.0, other.0);
        Self([
            y.mul_add(c, -(z * b)),
            z.mul_add(a, -(x * c)),
            x.mul_add(b, -(y * a)),
        ])
    }
}

impl<T: Real> Mat3<T> {
    /// Returns a matrix that is the same in all lanes of `like`.
    #[inline(always)]
    pub(crate) fn splat(like: T, matrix: &Mat3<f64>) -> Self {
        let [x, y, z] = matrix.0;
        Self([
            Vec3::splat(like, &Vec3(x)).0,
            Vec3::splat(like, &Vec3(y)).0,
            Vec3::splat(like, &Vec3(z)).0,
        ])
    }

    /// Returns a column.
    #[inline(always)]
    pub(crate) fn column(&self, k: usize) -> Vec3<T> {
        Vec3([self.0[0][k], self.0[1][k], self.0[2][k]])
    }

    /// Returns the product of the transposed matrix with a vector.
    #[inline(always)]
    pub(crate) fn tr_mul(&self, vector: Vec3<T>) -> Vec3<T> {
        Vec3([
            self.column(0).dot(vector),
            self.column(1).dot(vector),
            self.column(2).dot(vector),
        ])
    }

    /// Returns `[dω]× + [ω]×²` for an angular acceleration and the [products](Vec3::products) of an
    /// angular velocity: the matrix that maps a vector fixed to a body to the acceleration of its
    /// tip relative to its foot, (31).
    #[inline(always)]
    pub(crate) fn omega_matrix([xx, xy, xz, yy, yz, zz]: [T; 6], dw: Vec3<T>) -> Self {
        let [a, b, c] = dw.0;
        Self([
            [-(yy + zz), xy - c, xz + b],
            [xy + c, -(xx + zz), yz - a],
            [xz - b, yz + a, -(xx + yy)],
        ])
    }
}

impl<T: Real> Mul<Vec3<T>> for &Mat3<T> {
    type Output = Vec3<T>;
    #[inline(always)]
    fn mul(self, vector: Vec3<T>) -> Vec3<T> {
        let [x, y, z] = self.0;
        Vec3([
            Vec3(x).dot(vector),
            Vec3(y).dot(vector),
            Vec3(z).dot(vector),
        ])
    }
}

impl<T: Real> Mul for &Mat3<T> {
    type Output = Mat3<T>;
    #[inline(always)]
    fn mul(self, other: Self) -> Mat3<T> {
        let [x, y, z] = self.0;
        Mat3([
            other.tr_mul(Vec3(x)).0,
            other.tr_mul(Vec3(y)).0,
            other.tr_mul(Vec3(z)).0,
        ])
    }
}

impl<T: Real> Add for Vec3<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let ([x, y, z], [a, b, c]) = (self.0, other.0);
        Self([x + a, y + b, z + c])
    }
}

impl<T: Real> Sub for Vec3<T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        let ([x, y, z], [a, b, c]) = (self.0, other.0);
        Self([x - a, y - b, z - c])
    }
}

impl<T: Real> Mul<T> for Vec3<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: T) -> Self {
        let [x, y, z] = self.0;
        Self([x * factor, y * factor, z * factor])
    }
}

impl From<&Vector3<f64>> for Vec3<f64> {
    fn from(vector: &Vector3<f64>) -> Self {
        Self([vector.x, vector.y, vector.z])
    }
}

impl From<Vec3<f64>> for Vector3<f64> {
    fn from(vector: Vec3<f64>) -> Self {
        vector.0.into()
    }
}

impl From<Matrix3<f64>> for Mat3<f64> {
    fn from(matrix: Matrix3<f64>) -> Self {
        Self([0, 1, 2].map(|row| [0, 1, 2].map(|column| matrix[(row, column)])))
    }
}

impl From<&Mat3<f64>> for Matrix3<f64> {
    fn from(matrix: &Mat3<f64>) -> Self {
        Self::from_fn(|row, column| matrix.0[row][column])
    }
}
