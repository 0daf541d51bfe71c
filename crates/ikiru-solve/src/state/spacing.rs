//! Even spacing: the steps from sample to sample are wanted to be of one length, so that a motion keeps its pace.

/// Adds up `w Σₜ (ℓₜ − ℓ̄)²`, `ℓₜ` being the length of a step over all degrees of freedom and `ℓ̄` the mean of all
/// steps. Its curvature by a step is at most `w`, that of as much weight on speed, which
/// the step's system takes in its place.
#[derive(Clone, Debug, Default)]
pub(crate) struct Spacing {
    pub(crate) weight: f64,
    lengths: Vec<f64>,
    mean: f64,
}

impl Spacing {
    #[cfg(test)]
    fn new(weight: f64) -> Self {
        Self { weight, ..Self::default() }
    }

    /// The cost, at the differences from sample to sample.
    pub(crate) fn cost(&mut self, n: usize, first: &[f64], n_samples: usize) -> f64 {
        if self.weight == 0.0 || n == 0 {
            return 0.0;
        }
        self.lengths.clear();
        let steps = first.chunks_exact(n).take(n_samples.saturating_sub(1));
        self.lengths.extend(steps.map(|step| step.iter().map(|d| d * d).sum::<f64>().sqrt()));
        self.mean = self.lengths.iter().sum::<f64>() / self.lengths.len().max(1) as f64;
        self.weight * self.lengths.iter().map(|length| (length - self.mean).powi(2)).sum::<f64>()
    }

    /// Adds half the gradient by the differences, as of the last [`cost`](Self::cost).
    pub(crate) fn add_pull(&self, n: usize, first: &[f64], pull: &mut [f64]) {
        if self.weight == 0.0 || n == 0 {
            return;
        }
        let steps = first.chunks_exact(n).zip(pull.chunks_exact_mut(n));
        for ((step, pull), length) in steps.zip(&self.lengths) {
            // A step of no length has no direction to grow in.
            if *length > 0.0 {
                let along = self.weight * (1.0 - self.mean / length);
                pull.iter_mut().zip(step).for_each(|(pull, d)| *pull += along * d);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ikiru_testkit::rigs::Random;

    #[test]
    fn the_gradient_is_that_of_central_differences() {
        let mut random = Random::new(2);
        let (n, n_samples) = (3, 6);
        let mut first: Vec<f64> = (0..n * n_samples).map(|_| random.between(-1.0, 1.0)).collect();
        let mut spacing = Spacing::new(0.7);
        spacing.cost(n, &first, n_samples);
        let mut pull = vec![0.0; n * n_samples];
        spacing.add_pull(n, &first, &mut pull);
        let values = first.clone();
        // The last step does not exist.
        for i in 0..n * (n_samples - 1) {
            let mut cost_at = |x: f64| {
                let kept = std::mem::replace(&mut first[i], x);
                let cost = Spacing::new(0.7).cost(n, &first, n_samples);
                first[i] = kept;
                cost
            };
            let (x, h) = (values[i], 1e-6);
            let numeric = (cost_at(x + h) - cost_at(x - h)) / (4.0 * h);
            assert!((numeric - pull[i]).abs() < 1e-7, "{numeric} is not {}", pull[i]);
        }
        assert!(pull[n * (n_samples - 1)..].iter().all(|p| *p == 0.0));
        let even = [0.3; 12];
        assert!(Spacing::new(1.0).cost(3, &even, 5) < 1e-30);
    }
}
