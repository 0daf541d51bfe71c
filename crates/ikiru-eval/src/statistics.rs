//! Mean, spread and quantiles.

/// What a list of numbers looks like.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Summary {
    /// The mean.
    pub mean: f64,
    /// The standard deviation over the list, as the paper reports it.
    pub deviation: f64,
    /// The middle value.
    pub median: f64,
    /// The value that 99 of 100 do not exceed.
    pub p99: f64,
}

impl Summary {
    /// Of any numbers; all zero where there are none.
    #[must_use]
    pub fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let mut values: Vec<f64> = values.into_iter().collect();
        if values.is_empty() {
            return Self::default();
        }
        values.sort_unstable_by(f64::total_cmp);
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / n;
        Self {
            mean,
            deviation: variance.sqrt(),
            median: quantile(&values, 0.5),
            p99: quantile(&values, 0.99),
        }
    }
}

/// The value at a part of a sorted list, interpolated between neighbours; 0 for an empty one.
pub(crate) fn quantile(sorted: &[f64], part: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return 0.0 };
    let at = part * last as f64;
    let (below, above) = (sorted[at.floor() as usize], sorted[at.ceil() as usize]);
    below + (above - below) * at.fract()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_a_list_known_by_hand() {
        let summary = Summary::of([4.0, 1.0, 2.0, 5.0]);
        assert_eq!((summary.mean, summary.median), (3.0, 3.0));
        assert!((summary.deviation - 2.5_f64.sqrt()).abs() < 1e-15);
        assert!((summary.p99 - 4.97).abs() < 1e-12);
        assert_eq!(Summary::of([]), Summary::default());
        assert_eq!(Summary::of([7.0]).p99, 7.0);
    }
}
