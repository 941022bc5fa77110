//! What the theory predicts from the variances of primal and gradients, if both are stationary and
//! independent of one another.

/// Variances of the means over the samples of a render.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Variances {
    /// Of the primal: ‖F‖²/n.
    pub primal: f64,
    /// Of a difference between two pixels, the mean over the directions: ‖G‖²/n.
    pub gradient: f64,
}

/// |D|² of differences along one axis at a frequency in cycles per pixel: from 0 to 4.
pub fn difference_power(frequency: f64) -> f64 {
    2.0 - 2.0 * (std::f64::consts::TAU * frequency).cos()
}

impl Variances {
    /// The squared error of the screened solve where differences have the power `d2` = |D|². With α = 0 that of gradients alone, which have no mean: infinite for d2 = 0.
    pub fn screened(&self, alpha: f64, d2: f64) -> f64 {
        let screen = alpha * alpha;
        (screen * screen * self.primal + d2 * self.gradient) / (screen + d2).powi(2)
    }

    /// The same where both are estimated from the same samples, of g(x) = f(x) − f(x − 1) by a shift
    /// without distortion. Then the mean of f·g is ‖G‖²/2, as ‖g‖² is twice ‖f‖² less its correlation over
    /// one pixel, and the errors of primal and gradients are correlated:
    /// 2α² Re(D)·‖G‖²/2 = α²|D|²‖G‖²/2 more in the numerator.
    pub fn screened_shared(&self, alpha: f64, d2: f64) -> f64 {
        let screen = alpha * alpha;
        self.screened(alpha, d2) + 0.5 * screen * d2 * self.gradient / (screen + d2).powi(2)
    }

    /// The α with the least error at every frequency: α² = ‖G‖²/‖F‖².
    pub fn best_alpha(&self) -> f64 {
        (self.gradient / self.primal).sqrt()
    }
}
