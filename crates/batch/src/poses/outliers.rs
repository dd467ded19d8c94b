//! Poses that the others contradict.

use statrs::distribution::{ContinuousCDF, Normal};

use super::pose_fit::{PoseFit, Poses};
use crate::diagnosis::SIGNIFICANT;
use crate::finding::{CHANNELS, OutlyingPose};

/// A fit without the poses that the others contradict.
pub(super) struct WithoutOutliers {
    pub(super) found: PoseFit,
    /// Whether each pose is among those of the fit.
    pub(super) kept: Vec<bool>,
    /// A pose that is contradicted, but kept because the others do not determine as much without
    /// it.
    suspect: Option<usize>,
}

/// Fits poses, and leaves out the one that the others contradict most, as long as there is one.
pub(super) fn without_outliers(poses: &Poses<'_>) -> WithoutOutliers {
    let count = poses.equations.len();
    let mut kept = vec![true; count];
    let mut found = poses.fit(&kept);
    let dimension = found.fit.null_space.directions().len();
    let mut suspect = None;
    // Where more than a quarter of the poses do not fit, the model does not.
    for _ in 0..(count / 4).max(1) {
        let Some(worst) = worst(&found, &kept) else {
            break;
        };
        kept[worst] = false;
        let next = poses.fit(&kept);
        if next.fit.null_space.directions().len() > dimension {
            (kept[worst], suspect) = (true, Some(worst));
            break;
        }
        found = next;
    }
    WithoutOutliers {
        found,
        kept,
        suspect,
    }
}

/// Returns the pose of a fit that is the least probable beside the others, if it is improbable for
/// the worst of all poses and both kinds of channels (Bonferroni).
fn worst(found: &PoseFit, kept: &[bool]) -> Option<usize> {
    let poses = found.rows.iter().zip(kept).enumerate();
    let of_poses = poses
        .filter(|(_, (_, kept))| **kept)
        .map(|(pose, (rows, _))| (found.fit.p_value(rows), pose));
    let (least, worst) = of_poses.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let tests = 2 * kept.iter().filter(|kept| **kept).count();
    (least * (tests as f64) < chance_beyond(SIGNIFICANT)).then_some(worst)
}

/// Returns the probability of a distance from zero of at least so many standard deviations, by
/// chance.
pub(super) fn chance_beyond(std_devs: f64) -> f64 {
    2.0 * Normal::standard().sf(std_devs)
}

impl WithoutOutliers {
    /// Returns the poses that the others contradict, given the numbers of the first and the last
    /// row of each pose.
    pub(super) fn outliers(&self, rows: &[(usize, usize)]) -> Vec<OutlyingPose> {
        let contradicted = |pose: &usize| !self.kept[*pose] || self.suspect == Some(*pose);
        let poses = (0..rows.len()).filter(contradicted);
        poses.map(|pose| self.outlier(pose, rows[pose])).collect()
    }

    fn outlier(&self, pose: usize, (first_row, last_row): (usize, usize)) -> OutlyingPose {
        let (fit, is_kept) = (&self.found.fit, self.kept[pose]);
        let channels = self.found.rows[pose].iter().enumerate();
        let distances = channels.map(|(channel, row)| {
            let residual = fit.residual(row, channel);
            let std_dev = fit.residual_std_dev(row, channel, is_kept);
            (channel, residual, (residual / std_dev).abs())
        });
        let farthest = distances.max_by(|a, b| a.2.total_cmp(&b.2));
        let (channel, residual, distance) = farthest.unwrap_or_default();
        OutlyingPose {
            pose: pose + 1,
            first_row,
            last_row,
            channel: CHANNELS[channel].into(),
            residual: residual.abs(),
            distance,
            is_left_out: !is_kept,
        }
    }
}
