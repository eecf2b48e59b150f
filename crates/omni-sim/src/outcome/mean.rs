//! Root mean squares, and the window over which forces are averaged.

/// Averages of forces \[ns\]: 10 ms; shorter ones depend on the physics step.
pub(super) const WINDOW_NS: u64 = 10_000_000;

/// The root of the mean of squares.
#[derive(Default)]
pub(super) struct Mean {
    squares: f64,
    count: f64,
}

impl Mean {
    pub(super) fn add(&mut self, x: f64) {
        self.squares += x * x;
        self.count += 1.0;
    }

    pub(super) fn root(&self) -> f64 {
        (self.squares / self.count).sqrt() // NaN where there is nothing to average
    }
}
