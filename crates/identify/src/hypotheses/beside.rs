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
            Hypothesis::Axes if is_given => starts = self.axes_beside(present),
            Hypothesis::Axes => return None,
            // Without the weight that there is, or with one that there is not, the mass of a fit is
            // next to nothing.
            Hypothesis::Gravity => starts.extend([0.0, -1.0].map(|scale| Model {
                gravity: present.model.gravity * scale,
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

    /// Returns the best axes beside the causes of a fit. An unknown gravity may have taken the
    /// place of the opposite sign of all channels, which only accelerations tell from it.
    fn axes_beside(&self, present: &Fitted) -> Vec<Model> {
        let mut models: Vec<Model> = self
            .best_axes(present, axes::candidates())
            .into_iter()
            .collect();
        if present.active.contains(&Hypothesis::Gravity) {
            let mut opposite = present.clone();
            opposite.model.gravity = -present.model.gravity;
            let all = axes::candidates().chain([Matrix6::identity()]);
            models.extend(self.best_axes(&opposite, all));
        }
        models.retain(|model| model.axes != Matrix6::identity());
        models
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
        let fresh = Model::new(
            present.model.parameters,
            self.joints,
            present.model.given_gravity,
        );
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
