//! Fits with one hypothesis more, or one less, than another one.

use nalgebra::Matrix6;

use super::Search;
use super::axes::{self, AxesSearch};
use super::fitted::Fitted;
use super::model::Model;
use crate::finding::Hypothesis;
use crate::fit::CONVERGED_ENOUGH;

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
            // The ends are those of channels in their places.
            Hypothesis::Saturation if !is_given => return None,
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
        let mut both = [Hypothesis::Weight, Hypothesis::Gravity].iter();
        if both.all(|each| active.contains(each)) && hypothesis != Hypothesis::Axes {
            starts.extend(Self::with_other_weight(&start()));
        }
        self.simplest_best(&starts, &active)
    }

    /// Returns the starts with a weight along the gravity that is assumed in the place of one along
    /// gravity, as a controller subtracts it that does not know how its base is mounted, or the
    /// other way round.
    ///
    /// Of gravity, such a weight hides the sign of what is along the assumed one: the start near
    /// that is the first one.
    fn with_other_weight(start: &Model) -> [Model; 2] {
        [start.given_gravity, start.gravity].map(|gravity| Model {
            is_along_given: !start.is_along_given,
            gravity,
            ..start.clone()
        })
    }

    /// Returns the fit from some starts with the least residuals; of those that leave as little but
    /// for rounding, the one that changes the fewest channels. With an unknown gravity, only
    /// accelerations tell axes from those with all signs turned.
    fn simplest_best(&self, starts: &[Model], active: &[Hypothesis]) -> Option<Fitted> {
        let fits = starts.iter();
        let fits = fits.filter_map(|start| Fitted::new(self.windows, start, active));
        let fits: Vec<Fitted> = fits.collect();
        let least = fits.iter().map(|fitted| fitted.squares);
        let most = (1.0 + CONVERGED_ENOUGH) * least.fold(f64::INFINITY, f64::min);
        let best = fits.into_iter().filter(|fitted| fitted.squares <= most);
        best.min_by_key(|fitted| changed_channels(&fitted.model.axes))
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
            // An inexact direction hides the best axes, but has not changed the sign of the mass.
            let is_positive = present.model.parameters[0] > 0.0;
            if is_positive && present.model.axes == Matrix6::identity() {
                models.push(Model {
                    axes: -Matrix6::identity(),
                    ..opposite.model
                });
            }
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
            Hypothesis::Weight => {
                (start.weight, start.is_along_given) = (fresh.weight, fresh.is_along_given);
            }
            Hypothesis::Gravity => {
                (start.gravity, start.is_along_given) = (fresh.gravity, fresh.is_along_given);
            }
            Hypothesis::SensorPlace => start.place = fresh.place,
            Hypothesis::SensorRotation => start.rotation = fresh.rotation,
            Hypothesis::AxisGains => start.gains = fresh.gains,
            Hypothesis::Delay => start.delay_s = fresh.delay_s,
            Hypothesis::JointZeros => start.zeros = fresh.zeros,
            Hypothesis::Axes => start.axes = fresh.axes,
            Hypothesis::Saturation => {}
        }
        let mut starts = vec![start];
        if dropped == Hypothesis::Weight && active.contains(&Hypothesis::Gravity) {
            // Beside a weight of twice the payload, gravity and the mass have the opposite sign.
            starts.push(Model {
                gravity: -starts[0].gravity,
                ..starts[0].clone()
            });
        }
        self.simplest_best(&starts, &active)
    }
}

/// Returns how many channels are not in their places with their sign.
fn changed_channels(axes: &Matrix6<f64>) -> usize {
    axes.diagonal()
        .iter()
        .filter(|entry| **entry != 1.0)
        .count()
}
