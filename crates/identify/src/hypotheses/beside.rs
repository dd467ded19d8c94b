//! Fits with one hypothesis more, or one less, than another one.

use nalgebra::Matrix6;

use super::Search;
use super::axes::{self, AxesSearch};
use super::fitted::Fitted;
use super::model::Model;
use crate::finding::Hypothesis;

impl Search<'_> {
    /// Fits a further hypothesis beside those of a fit.
    pub(super) fn with(&self, present: &Fitted, hypothesis: Hypothesis) -> Option<Fitted> {
        let active = [&present.active[..], &[hypothesis]].concat();
        let start = || present.model.clone();
        let mut starts = vec![start()];
        let is_given = present.model.axes == Matrix6::identity();
        match hypothesis {
            Hypothesis::Axes if is_given => {
                starts = vec![self.best_axes(present, axes::candidates())?]
            }
            Hypothesis::Axes => return None,
            Hypothesis::Weight if present.active.contains(&Hypothesis::Gravity) => {
                starts = vec![start().with_size_of(&self.windows.given_gravity)];
            }
            // Without the weight that there is, or with one that there is not, the mass of a fit is
            // next to nothing.
            Hypothesis::Gravity => starts.extend([-1.0, -2.0].map(|scale| Model {
                gravity: self.windows.given_gravity * scale,
                ..start()
            })),
            Hypothesis::SensorRotation if is_given => {
                let turned = axes::turns().map(|turn| axes::of_both(&turn, &turn));
                let best = self.best_axes(present, turned)?;
                let rotation = best.axes.fixed_view::<3, 3>(0, 0).transpose();
                starts.push(Model {
                    axes: Matrix6::identity(),
                    rotation: rotation * rotation.determinant().signum(),
                    ..best
                });
            }
            _ => {}
        }
        let fits = starts
            .iter()
            .filter_map(|start| Fitted::new(self.windows, start, &active));
        fits.min_by(|a, b| a.squares.total_cmp(&b.squares))
    }

    fn best_axes(
        &self,
        present: &Fitted,
        candidates: impl Iterator<Item = Matrix6<f64>>,
    ) -> Option<Model> {
        let search = AxesSearch::new(self.windows, present)?;
        let best = search.best(candidates)?;
        Some(search.model(&best))
    }

    /// Fits without an active hypothesis.
    pub(super) fn without(&self, present: &Fitted, dropped: Hypothesis) -> Option<Fitted> {
        let is_kept = |each: &Hypothesis| *each != dropped;
        let active: Vec<_> = present.active.iter().copied().filter(is_kept).collect();
        let fresh = Model::new(present.model.parameters, self.joints);
        let mut start = present.model.clone();
        match dropped {
            Hypothesis::Offset => start.offset = fresh.offset,
            Hypothesis::Weight => start.weight = fresh.weight,
            Hypothesis::Gravity => start.gravity = fresh.gravity,
            Hypothesis::SensorPlace => start.place = fresh.place,
            Hypothesis::SensorRotation => start.rotation = fresh.rotation,
            Hypothesis::AxisGains => start.gains = fresh.gains,
            Hypothesis::Delay => start.delay_s = fresh.delay_s,
            Hypothesis::JointZeros => start.zeros = fresh.zeros,
            Hypothesis::Axes => start.axes = fresh.axes,
        }
        Fitted::new(self.windows, &start, &active)
    }
}
