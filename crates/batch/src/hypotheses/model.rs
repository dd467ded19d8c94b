//! The measured wrench as a function of the payload and of everything that may be assumed wrongly.

use nalgebra::{
    DMatrix, DVector, Matrix3, Matrix6, Rotation3, SMatrix, SVector, Vector1, Vector3, Vector4,
    Vector6,
};
use tactid_dynamics::cross;
use tactid_identify::equations::acceleration_columns;

use super::windows::{SLIGHT, Window, Windows};
use crate::finding::Hypothesis;

/// Parameters of the payload with the differences from what is assumed.
#[derive(Clone, Debug)]
pub(super) struct Model {
    /// Inertial parameters of the load.
    pub(super) parameters: SVector<f64, 10>,
    /// Constant part of the wrench in the frame of the sensor, N and N m.
    pub(super) offset: Vector6<f64>,
    /// Mass, kg, and first moments, kg m, in the tool frame, whose weight is added to the wrench.
    pub(super) weight: Vector4<f64>,
    /// Whether this weight acts along the gravity that is assumed, whatever gravity is.
    pub(super) is_along_given: bool,
    /// Gravity in the inertial frame, m/s². Its size does not change in a fit: at rest, that and
    /// the mass are one thing, and beside accelerations, another size is a weight, which the report
    /// names.
    pub(super) gravity: Vector3<f64>,
    /// Gravity that is assumed, in the inertial frame, m/s².
    pub(super) given_gravity: Vector3<f64>,
    /// Origin of the sensor in its assumed frame, m.
    pub(super) place: Vector3<f64>,
    /// Rotation from the assumed frame of the sensor to the true one.
    pub(super) rotation: Matrix3<f64>,
    /// Gain of each channel.
    pub(super) gains: Vector6<f64>,
    /// Delay of the wrench, s.
    pub(super) delay_s: f64,
    /// True less measured position of each joint, rad.
    pub(super) zeros: DVector<f64>,
    /// Signed permutation that brings the measured channels to their places.
    pub(super) axes: Matrix6<f64>,
}

/// Maps from the tool frame towards the measured channels, which all windows share.
pub(super) struct Chain {
    placed: Matrix6<f64>,
    turned: Matrix6<f64>,
    measured: Matrix6<f64>,
    /// Rotation and gains alone.
    after_place: Matrix6<f64>,
}

/// The sum over all windows of the products of the whitened columns, of which the last one is the
/// residual.
pub(super) struct Sums {
    /// Products of the columns, with the residual as the last column.
    pub(super) products: DMatrix<f64>,
    /// Whitened residuals of each window.
    pub(super) residuals: Vec<Vector6<f64>>,
    /// Sum of the squares of the noise, which the products do not contain.
    noise_squares: f64,
}

impl Sums {
    /// Sum of the squares of the residuals beyond the noise of these parameters, and of the noise
    /// of the given ones.
    ///
    /// Parameters that take less part in the motion have less of its noise, and would seem to
    /// explain the wrenches better.
    pub(super) fn squares(&self) -> f64 {
        let last = self.products.nrows() - 1;
        self.products[(last, last)].max(0.0) + self.noise_squares
    }

    /// Returns the sums of the columns in some places, with the residual as the last one.
    pub(super) fn of(&self, mut places: Vec<usize>) -> Self {
        places.push(self.products.nrows() - 1);
        let of = |i: usize, j: usize| self.products[(places[i], places[j])];
        Self {
            products: DMatrix::from_fn(places.len(), places.len(), of),
            residuals: Vec::new(),
            noise_squares: self.noise_squares,
        }
    }

    /// Subtracts the products of the noise of a window's columns (Fuller 1987), which are those of
    /// the parameters and the residual.
    fn subtract_noise(&mut self, columns: &[Vector6<f64>]) {
        let last = self.products.nrows() - 1;
        let place = |k: usize| if k < 10 { k } else { last };
        for (i, left) in columns.iter().enumerate() {
            for (j, right) in columns[..=i].iter().enumerate() {
                self.products[(place(i), place(j))] -= left.dot(right);
            }
        }
    }

    /// Adds the products of a window's columns below and on the diagonal.
    fn add(&mut self, columns: &[Vector6<f64>]) {
        for (i, left) in columns.iter().enumerate() {
            for (j, right) in columns[..=i].iter().enumerate() {
                self.products[(i, j)] += left.dot(right);
            }
        }
        self.residuals.extend(columns.last());
    }
}

impl Model {
    /// Returns the model of a payload with all assumptions as given.
    pub(super) fn new(
        parameters: SVector<f64, 10>,
        joints: usize,
        given_gravity: Vector3<f64>,
    ) -> Self {
        Self {
            parameters,
            offset: Vector6::zeros(),
            weight: Vector4::zeros(),
            is_along_given: false,
            gravity: given_gravity,
            given_gravity,
            place: Vector3::zeros(),
            rotation: Matrix3::identity(),
            gains: Vector6::repeat(1.0),
            delay_s: 0.0,
            zeros: DVector::zeros(joints),
            axes: Matrix6::identity(),
        }
    }

    /// Returns the model for robots of so many joints, without errors of their zeros.
    pub(super) fn with_joints(self, joints: usize) -> Self {
        let zeros = DVector::zeros(joints);
        Self { zeros, ..self }
    }

    /// Returns whether the residuals are larger than the noise of the windows, which stays hidden
    /// where these are the whole error.
    pub(super) fn leaves_unexplained(&self, windows: &Windows) -> bool {
        let chain = self.chain(windows);
        let squares = windows.windows.iter().map(|window| {
            let residual = self.residual(window, &chain, &self.of_load(window)) * window.root;
            residual
                .component_mul(&windows.measured)
                .component_div(&windows.noise)
                .norm_squared()
        });
        squares.sum::<f64>() > (1.0 + SLIGHT) * windows.measurements()
    }

    /// Returns the wrench of the load in the tool frame.
    pub(super) fn of_load(&self, window: &Window) -> Vector6<f64> {
        self.regressor(window) * self.parameters + self.of_weight(window) * self.weight
    }

    /// Returns the measured wrench of a window without the delay.
    pub(super) fn measured(&self, window: &Window) -> Vector6<f64> {
        window.target + window.rate * self.delay_s
    }

    /// Returns what the model leaves of the wrench of a window.
    pub(super) fn residual(
        &self,
        window: &Window,
        chain: &Chain,
        of_load: &Vector6<f64>,
    ) -> Vector6<f64> {
        let predicted = chain.measured * of_load + self.offset;
        self.axes * self.measured(window) - predicted
    }

    /// Number of unknowns of some hypotheses together with the parameters.
    pub(super) fn columns(&self, active: &[Hypothesis]) -> usize {
        let of_active = active.iter().map(|each| each.columns(self.zeros.len()));
        10 + of_active.sum::<usize>()
    }

    pub(super) fn chain(&self, windows: &Windows) -> Chain {
        let mut place = Matrix6::identity();
        place
            .fixed_view_mut::<3, 3>(3, 0)
            .copy_from(&-cross(&self.place));
        let mut turn = Matrix6::zeros();
        turn.fixed_view_mut::<3, 3>(0, 0).copy_from(&self.rotation);
        turn.fixed_view_mut::<3, 3>(3, 3).copy_from(&self.rotation);
        let gains = Matrix6::from_diagonal(&self.gains);
        let placed = place * windows.sensor_from_tool;
        Chain {
            placed,
            turned: turn * placed,
            measured: gains * turn * placed,
            after_place: gains * turn,
        }
    }

    /// Returns the regressor of the wrench in the tool frame with this gravity and these zeros of
    /// the joints.
    fn regressor(&self, window: &Window) -> SMatrix<f64, 6, 10> {
        let mut regressor = window.regressor;
        for (derivative, zero) in window.of_zeros.iter().zip(&self.zeros) {
            if *zero != 0.0 {
                regressor += derivative * *zero;
            }
        }
        let mut of_weight = regressor.fixed_columns_mut::<4>(0);
        of_weight -= self.of_change(window);
        regressor
    }

    /// Returns the wrench in the tool frame of each kg and of each kg m of the weight.
    fn of_weight(&self, window: &Window) -> SMatrix<f64, 6, 4> {
        if self.is_along_given {
            window.gravity
        } else {
            window.gravity + self.of_change(window)
        }
    }

    /// Returns what the change of gravity adds to the wrench of a weight.
    fn of_change(&self, window: &Window) -> SMatrix<f64, 6, 4> {
        acceleration_columns(&(window.tool_from_world * (self.gravity - self.given_gravity)))
    }

    /// Returns the sums for the parameters and some hypotheses.
    pub(super) fn sums(&self, windows: &Windows, active: &[Hypothesis]) -> Sums {
        let chain = self.chain(windows);
        let unknowns = self.columns(active);
        let is_saturated = active.contains(&Hypothesis::Saturation);
        // The noise is that of the channel that is measured, wherever it belongs.
        let precisions = windows
            .measured
            .component_div(&(self.axes.abs() * windows.std_devs));
        let mut columns = Vec::with_capacity(unknowns + 1);
        let mut sums = Sums {
            products: DMatrix::zeros(unknowns + 1, unknowns + 1),
            residuals: Vec::with_capacity(windows.windows.len()),
            noise_squares: windows.noise_squares,
        };
        for window in &windows.windows {
            columns.clear();
            self.fill(window, &chain, active, &mut columns);
            let mut factors = precisions * window.root;
            if is_saturated {
                windows.leave_out_cut(window, columns.last(), &mut factors);
            }
            for column in &mut columns {
                column.component_mul_assign(&factors);
            }
            sums.add(&columns);
            columns.clear();
            self.fill_noise(window, &chain, &mut columns);
            for column in &mut columns {
                column.component_mul_assign(&factors);
            }
            sums.subtract_noise(&columns);
        }
        sums.products.fill_upper_triangle_with_lower_triangle();
        for &held in &windows.held {
            fix(&mut sums.products, held, &Vector1::new(1.0));
        }
        if let Some(first) = first_column_of(Hypothesis::AxisGains, active, self.zeros.len()) {
            // A common factor of the gains is one of the load, too.
            fix(
                &mut sums.products,
                first,
                &self.gains.map(f64::signum).normalize(),
            );
        }
        if let Some(first) = first_column_of(Hypothesis::Gravity, active, self.zeros.len()) {
            if self.gravity == Vector3::zeros() {
                (0..3).for_each(|k| fix(&mut sums.products, first, &Vector3::ith(k, 1.0)));
            } else {
                fix(&mut sums.products, first, &self.gravity.normalize());
            }
        }
        sums
    }

    /// Adds the columns of a window and its residual.
    pub(super) fn fill(
        &self,
        window: &Window,
        chain: &Chain,
        active: &[Hypothesis],
        columns: &mut Vec<Vector6<f64>>,
    ) {
        let regressor = self.regressor(window);
        let of_weight = self.of_weight(window);
        let of_load = regressor * self.parameters + of_weight * self.weight;
        let rate = self.axes * window.rate;
        let regressor = chain.measured * regressor;
        columns.extend(regressor.column_iter().map(Into::<Vector6<f64>>::into));
        for each in active {
            match each {
                Hypothesis::Offset => add(columns, &Matrix6::identity()),
                Hypothesis::Weight => add(columns, &(chain.measured * of_weight)),
                Hypothesis::Gravity => add(columns, &(chain.measured * self.of_gravity(window))),
                Hypothesis::SensorPlace => {
                    let force = (chain.placed * of_load).fixed_rows::<3>(0).into_owned();
                    add(
                        columns,
                        &(chain.after_place.fixed_columns::<3>(3) * cross(&force)),
                    );
                }
                Hypothesis::SensorRotation => {
                    add(columns, &self.of_rotation(&(chain.turned * of_load)));
                }
                Hypothesis::AxisGains => {
                    add(columns, &Matrix6::from_diagonal(&(chain.turned * of_load)));
                }
                Hypothesis::Delay => columns.push(-rate),
                Hypothesis::JointZeros => {
                    let of_zeros = window.of_zeros.iter();
                    columns.extend(of_zeros.map(|each| chain.measured * (each * self.parameters)));
                }
                Hypothesis::Axes | Hypothesis::Saturation => {}
            }
        }
        columns.push(self.residual(window, chain, &of_load));
    }

    /// Adds the noise of the columns of the parameters and of the residual.
    fn fill_noise(&self, window: &Window, chain: &Chain, columns: &mut Vec<Vector6<f64>>) {
        let regressor = chain.measured * window.regressor_noise;
        add(columns, &regressor);
        columns.push(self.axes * window.target_noise - regressor * self.parameters);
    }

    /// Returns the derivative of the wrench in the tool frame with respect to gravity.
    fn of_gravity(&self, window: &Window) -> SMatrix<f64, 6, 3> {
        let mut columns = SMatrix::<f64, 6, 3>::zeros();
        for (k, change) in window.tool_from_world.column_iter().enumerate() {
            columns.set_column(k, &-self.of_acceleration(&change.into_owned()));
        }
        columns
    }

    /// Returns the wrench in the tool frame that a gravity of the opposite sign exerts on what it
    /// acts on.
    fn of_acceleration(&self, acceleration: &Vector3<f64>) -> Vector6<f64> {
        acceleration_columns(acceleration) * self.weighed()
    }

    /// Returns the derivative of a wrench with respect to a rotation of the sensor, given the
    /// wrench in its true axes.
    fn of_rotation(&self, wrench: &Vector6<f64>) -> SMatrix<f64, 6, 3> {
        let mut columns = SMatrix::<f64, 6, 3>::zeros();
        for first in [0, 3] {
            let turned = -cross(&wrench.fixed_rows::<3>(first).into_owned());
            columns.fixed_rows_mut::<3>(first).copy_from(&turned);
        }
        Matrix6::from_diagonal(&self.gains) * columns
    }

    /// Returns the model after a step of the unknowns.
    pub(super) fn moved(&self, step: &DVector<f64>, active: &[Hypothesis]) -> Self {
        let mut moved = self.clone();
        moved.parameters += step.fixed_rows::<10>(0);
        let mut of_gravity = Vector3::zeros();
        let mut first = 10;
        for each in active {
            let count = each.columns(self.zeros.len());
            let own = step.rows(first, count);
            match each {
                Hypothesis::Offset => moved.offset += own,
                Hypothesis::Weight => moved.weight += own,
                Hypothesis::Gravity => of_gravity += own,
                Hypothesis::SensorPlace => moved.place += own,
                Hypothesis::SensorRotation => {
                    let turn = Vector3::new(own[0], own[1], own[2]);
                    moved.rotation = Rotation3::new(turn).into_inner() * moved.rotation;
                }
                Hypothesis::AxisGains => moved.gains += own,
                Hypothesis::Delay => moved.delay_s += own[0],
                Hypothesis::JointZeros => moved.zeros += own,
                Hypothesis::Axes | Hypothesis::Saturation => {}
            }
            first += count;
        }
        // The force is linear in the mass and in the weight, both of which have moved.
        let ratio = moved.weighed()[0] / self.weighed()[0];
        let is_near = ratio.abs() > SLIGHT && ratio.is_finite();
        let turned = self.gravity + of_gravity / if is_near { ratio } else { 1.0 };
        let direction = turned.try_normalize(0.0);
        moved.gravity = direction.map_or(turned, |direction| direction * self.gravity.norm());
        moved
    }

    /// Returns the mass, kg, and the first moments, kg m, whose weight turns with gravity.
    fn weighed(&self) -> Vector4<f64> {
        let load = self.parameters.fixed_rows::<4>(0);
        if self.is_along_given {
            load.into()
        } else {
            load - self.weight
        }
    }

    /// Divides the gains by their median: most axes are right.
    pub(super) fn normalize_gains(&mut self) {
        let mut sizes: Vec<f64> = self.gains.iter().map(|gain| gain.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        let median = 0.5 * (sizes[2] + sizes[3]);
        if median.is_normal() {
            self.gains /= median;
            self.parameters *= median;
        }
    }
}

/// Returns the first column of a hypothesis among those of the active ones.
pub(super) fn first_column_of(
    hypothesis: Hypothesis,
    active: &[Hypothesis],
    joints: usize,
) -> Option<usize> {
    let place = active.iter().position(|each| *each == hypothesis)?;
    let before = active[..place].iter().map(|each| each.columns(joints));
    Some(10 + before.sum::<usize>())
}

/// Keeps unknowns, whose first column is given, from moving along a direction, a unit vector: what
/// the measurements say about it is left out, and it is known.
fn fix<const N: usize>(products: &mut DMatrix<f64>, first: usize, direction: &SVector<f64, N>) {
    let largest = (first..first + N).fold(0.0f64, |a, k| a.max(products[(k, k)]));
    let mut rows = products.fixed_rows_mut::<N>(first);
    rows -= direction * (direction.transpose() * &rows);
    let mut columns = products.fixed_columns_mut::<N>(first);
    columns -= (&columns * direction) * direction.transpose();
    let mut own = products.fixed_view_mut::<N, N>(first, first);
    own += direction * direction.transpose() * largest;
}

/// Adds the columns of a matrix.
fn add<const N: usize>(columns: &mut Vec<Vector6<f64>>, matrix: &SMatrix<f64, 6, N>) {
    columns.extend(matrix.column_iter().map(Into::<Vector6<f64>>::into));
}
