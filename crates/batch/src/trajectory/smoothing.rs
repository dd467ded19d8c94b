//! Splines through the measured motion alone, and the noise that they leave.

use std::ops::Range;

use nalgebra::{DMatrix, Vector3};

use super::bins::Layout;
use super::bordered::Bordered;
use super::segment::{Derivatives, Segment, base_motion, imaginary, quaternions};
use super::spline::order;
use super::{MotionEstimate, SETTINGS};
use crate::diagnosis::{FAR_BETTER, SIGNIFICANT};

/// Factors of the sixth difference of neighbouring values.
const SIXTH: [f64; 7] = [1.0, -6.0, 15.0, -20.0, 15.0, -6.0, 1.0];

/// Measurements of some columns at the bins of a segment: values, then rates of the same
/// coordinates, or values alone.
type Measured = Vec<DMatrix<f64>>;

/// Fits splines to measured columns with these variances of values and rates. Returns the
/// coefficients, row by row, and the residuals; `None` where the bins do not determine the splines.
fn fit(
    segment: &Segment,
    measured: &Measured,
    variances: [f64; 2],
) -> Option<(Vec<f64>, Measured)> {
    let columns = measured[0].ncols();
    let mut system = Bordered::zeros(segment.splines, order(), columns);
    for (bin, (&span, basis)) in segment.spans.iter().zip(&segment.bases).enumerate() {
        let mut block = DMatrix::zeros(order(), order());
        let mut border = DMatrix::zeros(order(), columns);
        for ((given, variance), splines) in measured.iter().zip(variances).zip(basis) {
            let weight = variance.recip();
            let splines = DMatrix::from_column_slice(order(), 1, splines);
            block.gemm(weight, &splines, &splines.transpose(), 1.0);
            border.gemm(weight, &splines, &given.rows(bin, 1), 1.0);
        }
        system.add(span, &block);
        system.add_to_border(span, &border);
    }
    system.factor()?;
    let (_, coefficients) = system.solve();
    let rest = |(kind, given): (usize, &DMatrix<f64>)| {
        DMatrix::from_fn(given.nrows(), columns, |bin, column| {
            let weights = segment.bases[bin][kind].iter().enumerate();
            let terms = weights.map(|(spline, weight)| {
                weight * coefficients[(segment.spans[bin] + spline) * columns + column]
            });
            given[(bin, column)] - terms.sum::<f64>()
        })
    };
    let residuals = measured.iter().enumerate().map(rest).collect();
    Some((coefficients, residuals))
}

/// Replaces the means of a segment by values at the mean times: a mean differs from them by half of
/// the second derivative times the spread of the times. The derivative is that of splines: with
/// that of neighbouring bins, noise above 10 Hz, which residuals show, would be larger than below,
/// where the motion is. `None` where the bins do not determine the splines.
pub(super) fn values_at_times(segment: &mut Segment) -> Option<()> {
    let (bins, channels) = (segment.bins.len(), segment.bins[0].values.len());
    let means = DMatrix::from_fn(bins, channels, |bin, k| segment.bins[bin].values[k]);
    let (coefficients, _) = fit(segment, &vec![means], [1.0; 2])?;
    for (k, bin) in segment.bins.iter_mut().enumerate() {
        for (spline, weight) in segment.bases[k][2].iter().enumerate() {
            let first = (segment.spans[k] + spline) * channels;
            let of_spline = &coefficients[first..first + channels];
            for (value, coefficient) in bin.values.iter_mut().zip(of_spline) {
                *value -= 0.5 * bin.spread_s2 * weight * coefficient;
            }
        }
    }
    Some(())
}

/// Returns the degrees of freedom of splines that values and rates with these variances determine:
/// derivatives of the logarithm of the determinant of the information by that of each weight.
fn determined(segment: &Segment, variances: [f64; 2]) -> Option<[f64; 2]> {
    let log_determinant = |of_values: f64| {
        let mut system = Bordered::zeros(segment.splines, order(), 1);
        for (&span, basis) in segment.spans.iter().zip(&segment.bases) {
            let mut block = DMatrix::zeros(order(), order());
            for (splines, weight) in basis.iter().zip([of_values, variances[0] / variances[1]]) {
                let splines = DMatrix::from_column_slice(order(), 1, splines);
                block.gemm(weight, &splines, &splines.transpose(), 1.0);
            }
            system.add(span, &block);
        }
        system.factor()?;
        Some(system.log_determinant())
    };
    let step = f64::EPSILON.cbrt();
    let [below, above] = [1.0 - step, 1.0 + step];
    let difference = log_determinant(above)? - log_determinant(below)?;
    let of_values = difference / (above / below).ln();
    Some([of_values, segment.splines as f64 - of_values])
}

/// Returns the residuals of splines through values alone.
pub(super) fn residuals(segment: &Segment, values: DMatrix<f64>) -> Option<DMatrix<f64>> {
    Some(fit(segment, &vec![values], [1.0; 2])?.1.remove(0))
}

/// The coordinates that some channels measure, and how.
struct Group {
    /// First coordinate, and number of coordinates.
    coordinates: (usize, usize),
    measured: Vec<Measured>,
}

/// Sets the splines of all segments to the measured motion alone, and returns the standard
/// deviation of the noise of each channel of the motion, in its unit. At the quaternion are those
/// of small turns about the three axes of the inertial frame, then that of the length.
pub(super) fn smooth(segments: &mut [Segment], layout: Layout) -> Option<Vec<f64>> {
    let mut std_devs = vec![0.0; layout.effort()];
    for coordinate in 0..layout.joints + 3 {
        let [channel, rate] = layout.channels_of(coordinate);
        let column = |segment: &Segment, channel: usize| {
            DMatrix::from_fn(segment.bins.len(), 1, |bin, _| {
                segment.bins[bin].values[channel]
            })
        };
        let measured = segments
            .iter()
            .map(|segment| [channel, rate].map(|of| column(segment, of)).to_vec());
        let group = Group {
            coordinates: (coordinate, 1),
            measured: measured.collect(),
        };
        [std_devs[channel], std_devs[rate]] = smooth_group(segments, &group)?;
    }
    smooth_rotation(segments, layout, &mut std_devs)?;
    let [linear, angular] = layout.accelerations();
    for channel in linear.chain(angular.clone()) {
        std_devs[channel] = noise_of_values(segments, channel)?;
    }
    if let Some(channel) = layout.lengthening() {
        // Were it less certain than the turning, a slightly turned quaternion would mix both, and
        // the steps would not converge.
        std_devs[channel] = 0.5 * std_devs[angular].iter().fold(0.0, |a: f64, &b| a.max(b));
    }
    Some(std_devs)
}

/// Returns the standard deviation of what splines through the values of a channel alone leave. As
/// the noise of a measured acceleration, it does not depend on poses and velocities, so that these
/// can contradict it.
pub(super) fn noise_of_values(segments: &[Segment], channel: usize) -> Option<f64> {
    let (mut left, mut squares, mut freedom, mut bins) = (0.0, 0.0, 0.0, 0.0);
    for segment in segments {
        let count = segment.bins.len();
        let values = segment.bins.iter().map(|bin| bin.values[channel]);
        let values = DMatrix::from_iterator(count, 1, values);
        squares += values.norm_squared();
        left += residuals(segment, values)?.norm_squared();
        freedom += segment.freedom() * count as f64;
        bins += count as f64;
    }
    let least = SETTINGS.accuracy.powi(2) * squares / bins;
    Some((left / freedom + least + f64::MIN_POSITIVE.sqrt()).sqrt())
}

/// Sets the splines of the base's quaternion, and its standard deviations.
fn smooth_rotation(segments: &mut [Segment], layout: Layout, std_devs: &mut [f64]) -> Option<()> {
    let (of_turn, of_rate) = (layout.quaternion(), layout.angular_velocity());
    let first = layout.joints + 3;
    let mut of_columns = [1.0; 2];
    for pass in 0..2 {
        let measured = segments.iter().map(|segment| {
            let bins = segment.bins.len();
            let values = DMatrix::from_fn(bins, 4, |bin, k| segment.bins[bin].values[of_turn + k]);
            let rate = |bin: usize| {
                let values = &segment.bins[bin].values;
                let q = match pass {
                    0 => nalgebra::Vector4::from_column_slice(&values[of_turn..of_turn + 4]),
                    _ => quaternions(&segment.at(bin))[0],
                };
                let rate = Vector3::from_column_slice(&values[of_rate..of_rate + 3]);
                imaginary(&q).tr_mul(&rate) * 0.5
            };
            let rates: Vec<_> = (0..bins).map(rate).collect();
            let rates = DMatrix::from_fn(bins, 4, |bin, k| rates[bin][k]);
            vec![values, rates]
        });
        let group = Group {
            coordinates: (first, 4),
            measured: measured.collect(),
        };
        of_columns = smooth_group(segments, &group)?;
    }
    let (mut squares, mut freedom) = ([0.0; 6], [0.0; 2]);
    for segment in segments.iter() {
        let taken = determined(segment, of_columns.map(|std_dev| std_dev * std_dev))?;
        for (freedom, taken) in freedom.iter_mut().zip(taken) {
            *freedom += (segment.bins.len() as f64 - taken).max(1.0);
        }
        for (bin, found) in segment.bins.iter().enumerate() {
            let at = segment.at(bin);
            let (turn, rate) = rotation_residuals(&at, &found.values, layout);
            for (square, rest) in squares.iter_mut().zip(turn.iter().chain(&rate)) {
                *square += rest * rest;
            }
        }
    }
    let root = |k: usize| (squares[k] / freedom[k / 3]).sqrt();
    let roots: [f64; 6] = std::array::from_fn(root);
    let largest = roots[..3].iter().fold(f64::EPSILON, |a, &b| a.max(b));
    for axis in 0..3 {
        std_devs[of_turn + axis] = roots[axis].max(f64::EPSILON);
        std_devs[of_rate + axis] = roots[3 + axis].max(f64::EPSILON);
    }
    // The length of the quaternion is exact; it is held as the turns are.
    std_devs[of_turn + 3] = 0.5 * largest;
    Some(())
}

/// Returns what the motion leaves of the measured rotation, a small rotation in the inertial frame,
/// and of the measured angular velocity.
pub(super) fn rotation_residuals(
    at: &Derivatives,
    values: &[f64],
    layout: Layout,
) -> (Vector3<f64>, Vector3<f64>) {
    let [q, ..] = quaternions(at);
    let first = layout.quaternion();
    let measured = nalgebra::Vector4::from_column_slice(&values[first..first + 4]);
    let rate = Vector3::from_column_slice(&values[first + 4..first + 7]);
    let turn = imaginary(&q) * measured * (2.0 / q.norm_squared());
    (turn, rate - base_motion(at).angular_velocity)
}

/// Sets the coefficients of some coordinates, and returns the standard deviations of their values
/// and rates, which are the same for all of them.
fn smooth_group(segments: &mut [Segment], group: &Group) -> Option<[f64; 2]> {
    let (first, columns) = group.coordinates;
    let sizes = [0, 1].map(|kind| {
        let largest = group.measured.iter().map(|measured| measured[kind].amax());
        largest.fold(0.0, f64::max)
    });
    // Smaller noise is rounding. A locked joint reports velocities of exactly zero.
    let least = [sizes[0], sizes[1].max(SETTINGS.knots_hz * sizes[0])];
    let floors = least.map(|size| (f64::EPSILON * size * size).max(f64::MIN_POSITIVE.sqrt()));
    let mut variances = floors.map(|_| 1.0);
    let [values, rates] = sizes;
    // Until residuals are known, noise is taken to be in proportion to the measurements.
    if values > 0.0 && rates > 0.0 {
        variances = sizes.map(|size| size * size);
    }
    // The ratio of the two variances converges at once: values and rates differ in frequency.
    for _ in 0..3 {
        let (mut squares, mut freedom) = ([0.0; 2], [0.0; 2]);
        for (segment, measured) in segments.iter_mut().zip(&group.measured) {
            let (coefficients, residuals) = fit(segment, measured, variances)?;
            for (spline, row) in coefficients.chunks_exact(columns).enumerate() {
                let begin = spline * segment.coordinates + first;
                segment.coefficients[begin..begin + columns].copy_from_slice(row);
            }
            for (square, rest) in squares.iter_mut().zip(&residuals) {
                *square += rest.norm_squared();
            }
            let count = (columns * segment.bins.len()) as f64;
            for (freedom, taken) in freedom.iter_mut().zip(determined(segment, variances)?) {
                *freedom += (count - columns as f64 * taken).max(1.0);
            }
        }
        for (k, variance) in variances.iter_mut().enumerate() {
            *variance = (squares[k] / freedom[k]).max(floors[k]);
        }
    }
    Some(variances.map(f64::sqrt))
}

/// Returns for each channel of the motion the variance of white noise with its sixth differences, and of
/// the error of splines, a fraction of its largest value. For joints, that is the largest distance from
/// the first position, or the largest velocity, of all of them, 1 m counting as 1 rad: what the control
/// of a held joint leaves is nothing beside the others. A channel that never changes has a variance of zero.
pub(super) fn sixth_differences(segments: &[Segment], layout: Layout) -> Vec<f64> {
    let (joints, power) = (layout.joints, SIXTH.iter().map(|of| of * of).sum::<f64>());
    let difference_and_size = |channel: usize| {
        let (mut squares, mut count, mut size) = (0.0, 0.0, 0.0f64);
        for segment in segments {
            let values = |k: usize| segment.bins[k].values[channel];
            let origin = if channel < joints { values(0) } else { 0.0 };
            for first in 0..segment.bins.len().saturating_sub(SIXTH.len() - 1) {
                let terms = SIXTH.iter().enumerate();
                let difference: f64 = terms.map(|(k, factor)| factor * values(first + k)).sum();
                squares += difference * difference;
                count += 1.0;
                size = size.max((values(first) - origin).abs());
            }
        }
        (squares / (power * f64::max(count, 1.0)), size)
    };
    let channels: Vec<(f64, f64)> = (0..layout.effort()).map(difference_and_size).collect();
    let largest = |kind: Range<usize>| channels[kind].iter().fold(0.0, |a: f64, of| a.max(of.1));
    let most = [0..joints, joints..2 * joints].map(largest);
    let of_channel = |(channel, &(variance, size)): (usize, &(f64, f64))| {
        let of_joints = most.get(channel / joints).filter(|_| size > 0.0);
        let size = of_joints.unwrap_or(&size);
        variance + (SETTINGS.accuracy * size).powi(2)
    };
    channels.iter().enumerate().map(of_channel).collect()
}

/// Returns why splines do not follow the motion, if they do not: they leave of a channel of so many
/// bins far more than the variance of white noise with the same sixth differences, because the motion has
/// frequencies that are too high, or because velocities that nobody measured are zero: splines then
/// leave more than sixteen times as much as splines through values alone (`of_values`). Of a joint
/// that is locked, both leave the noise, which may have more power at low frequencies than white
/// noise.
pub(super) fn unfollowed(
    layout: Layout,
    left: &[f64],
    of_differences: &[f64],
    of_values: &[f64],
    bins: usize,
) -> Option<MotionEstimate> {
    // By so much a variance is smaller by chance: neighbouring differences are correlated, and three
    // of them are worth one.
    let chance = 1.0 + SIGNIFICANT * (6.0 / bins as f64).sqrt();
    let of_coordinate = |coordinate: usize| {
        layout
            .channels_of(coordinate)
            .map(|channel| (left[channel], of_differences[channel]))
    };
    let sum = |channels: Range<usize>| {
        let left = left[channels.start..channels.start + 3].iter();
        (
            left.sum::<f64>(),
            of_differences[channels].iter().sum::<f64>(),
        )
    };
    let (of_turns, of_rates) = (layout.quaternion(), layout.angular_velocity());
    let (of_turning, noise) = sum(of_turns..of_rates);
    // A small turn changes a quaternion by half of it.
    let [linear, angular] = layout.accelerations();
    let of_rotation = [(of_turning, 4.0 * noise), sum(of_rates..linear.start)];
    let of_acceleration = |channel: usize| [(left[channel], of_differences[channel]); 2];
    let pairs = (0..layout.joints + 3).map(|coordinate| {
        (
            of_coordinate(coordinate),
            of_values[layout.channels_of(coordinate)[0]],
        )
    });
    let of_rotation = (
        of_rotation,
        4.0 * of_values[of_turns..of_turns + 3].iter().sum::<f64>(),
    );
    let mut reason = None;
    let accelerations = (linear.start..angular.end).map(|channel| (of_acceleration(channel), 0.0));
    for (pairs, alone) in pairs.chain([of_rotation]).chain(accelerations) {
        // A channel that is zero throughout measures nothing.
        let is_left = |(left, noise): (f64, f64)| {
            noise > 0.0 && left * FAR_BETTER > chance * noise.max(f64::MIN_POSITIVE.sqrt())
        };
        if is_left(pairs[0]) && pairs[1].1 == 0.0 && is_left((pairs[0].0 * FAR_BETTER, alone)) {
            return Some(MotionEstimate::NoVelocities);
        }
        if pairs.into_iter().any(is_left) {
            reason = Some(MotionEstimate::TooFast);
        }
    }
    reason
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, UnitQuaternion};
    use rand::{RngExt, SeedableRng, rngs::SmallRng};
    use rand_distr::StandardNormal;
    use tactid_dynamics::{BaseKind, Manipulator};
    use tactid_identify::BaseState;
    use tactid_identify::equations::{EquationSettings, Sample};

    use super::super::bins::SampleBins;
    use super::*;

    const HINGE: &str = r#"<robot name="hinge"><link name="base"/><link name="tip"/>
      <joint name="hinge" type="continuous"><parent link="base"/><child link="tip"/></joint>
      </robot>"#;

    /// Returns the bins of a minute at 1 kHz in which the joint and the base oscillate, with white
    /// noise of these standard deviations of values, rad and m, and of rates.
    fn oscillation([of_values, of_rates]: [f64; 2]) -> SampleBins {
        let robot = Manipulator::from_urdf(HINGE, BaseKind::Floating).unwrap();
        let mut bins = SampleBins::new(&robot, 0, &EquationSettings::default(), None);
        let mut random = SmallRng::seed_from_u64(3);
        let mut noise = |std_dev: f64| -> Vector3<f64> {
            Vector3::from_fn(|_, _| std_dev * random.sample::<f64, _>(StandardNormal))
        };
        for k in 0..60_000 {
            let (sin, cos) = (8e-3 * f64::from(k)).sin_cos();
            let turned = UnitQuaternion::from_scaled_axis(Vector3::x() * sin);
            let turned = UnitQuaternion::from_scaled_axis(noise(of_values)) * turned;
            let position = Vector3::y() * sin + noise(of_values);
            bins.push(
                &Sample {
                    time_s: 1e-3 * f64::from(k),
                    base: BaseState {
                        pose: Isometry3::from_parts(position.into(), turned),
                        velocity: Vector3::y() * 8.0 * cos + noise(of_rates),
                        angular_velocity: Vector3::x() * 8.0 * cos + noise(of_rates),
                        ..BaseState::fixed()
                    },
                    joint_position: &[sin + noise(of_values).x],
                    joint_velocity: &[8.0 * cos + noise(of_rates).x],
                    joint_effort: &[sin + noise(of_values).x],
                    wrenches: &[],
                },
                k == 0,
            );
        }
        bins.finish();
        bins
    }

    /// The noise of bins is that of means of so many samples, 17 in a sixtieth of a second: for
    /// values and rates of the joint and of the base, whichever determine the splines, and for an
    /// effort.
    #[test]
    fn the_noise_of_bins_is_that_of_their_samples() {
        for of_samples in [[1e-3, 1e-2], [1e-3, 1e-1], [1e-4, 1e-2]] {
            let bins = oscillation(of_samples);
            let layout = bins.layout();
            let stretch = &bins.stretches()[0];
            let mut segments = [Segment::new(stretch, layout.coordinates())];
            values_at_times(&mut segments[0]).unwrap();
            let found = smooth(&mut segments, layout).unwrap();
            let [segment] = segments;
            let efforts = segment.bins.iter().map(|bin| bin.values[layout.effort()]);
            let efforts = DMatrix::from_iterator(stretch.len(), 1, efforts);
            let left = residuals(&segment, efforts).unwrap().norm_squared();
            let of_effort = (left / (segment.freedom() * stretch.len() as f64)).sqrt();
            let mean = |channels: Range<usize>| {
                let squares = found[channels.clone()].iter().map(|found| found.powi(2));
                (squares.sum::<f64>() / channels.len() as f64).sqrt()
            };
            let (position, turn) = (layout.position(), layout.quaternion());
            let of_values = [0..1, position..position + 3, turn..turn + 3].map(mean);
            let of_rates = [1..2, position + 3..turn, turn + 4..turn + 7].map(mean);
            let ratios = of_values.into_iter().chain([of_effort]);
            let ratios = ratios.map(|found| found / of_samples[0]);
            let ratios = ratios.chain(of_rates.map(|found| found / of_samples[1]));
            let ratios: Vec<f64> = ratios.map(|ratio| ratio * 17f64.sqrt()).collect();
            let are_found = ratios.iter().all(|ratio| (ratio - 1.0).abs() < 0.06);
            assert!(are_found, "{of_samples:?}: {ratios:.3?}");
        }
    }
}
