//! The check that a run is long enough for its vehicle to cross.

use crate::{Command, Scenario};

impl Command {
    /// The earliest time \[s\] at which a vehicle that follows the command has covered `way_m` \[m\]; none if the
    /// command never covers this distance. On a ramp between two directions it is taken to be as fast as on one between
    /// their speeds, which it never is: no vehicle is earlier.
    ///
    /// ```
    /// let command = omni_config::Scenario::load("step", &[])?.command; // 0.3 m/s after a ramp of 0.3 s
    /// assert!((command.earliest_s(1.0).unwrap() - (0.3 + (1.0 - 0.045) / 0.3)).abs() < 1e-12);
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn earliest_s(&self, way_m: f64) -> Option<f64> {
        let own = (0.0, libm::hypot(self.vx_m_s, self.vy_m_s), self.ramp_s);
        let later = self
            .then
            .iter()
            .map(|then| (then.at_s, libm::hypot(then.vx_m_s, then.vy_m_s), then.ramp_s));
        let ends = self.then.iter().map(|then| then.at_s).chain([f64::INFINITY]);
        let (mut left_m, mut speed) = (way_m, 0.0);
        for ((from_s, whole, ramp_s), end_s) in std::iter::once(own).chain(later).zip(ends) {
            let ramp = ramp_s.min(end_s - from_s);
            if ramp > 0.0 {
                let gain = (whole - speed) / ramp_s;
                let gone_m = (speed + gain * ramp / 2.0) * ramp;
                if gone_m >= left_m {
                    // left = v t + a t^2 / 2, written so that a = 0 is no matter.
                    let root = (speed * speed + 2.0 * gain * left_m).max(0.0).sqrt();
                    return Some(from_s + 2.0 * left_m / (speed + root));
                }
                left_m -= gone_m;
                speed += gain * ramp;
            }
            if ramp_s > end_s - from_s {
                continue;
            }
            speed = whole;
            if speed > 0.0 {
                let needs_s = left_m / speed;
                if from_s + ramp_s + needs_s <= end_s {
                    return Some(from_s + ramp_s + needs_s);
                }
                left_m -= speed * (end_s - from_s - ramp_s);
            }
        }
        None
    }

    /// Whether it is ever commanded to turn.
    pub(crate) fn turns(&self) -> bool {
        self.comes_by_itself() || self.wz_rad_s != 0.0 || self.then.iter().any(|then| then.wz_rad_s != 0.0)
    }
}

impl Scenario {
    /// Error message if `duration_s` cannot suffice: even a vehicle that follows the command exactly would not have
    /// every wheel beyond the obstacle by then. One line; none if it may suffice, on flat ground, and of a table of
    /// twists. Of a path, that the run ends before it does.
    ///
    /// ```
    /// use omni_config::{Override, Scenario};
    /// let of = |duration_s| Scenario::load("step", &[Override::new("duration_s", duration_s)]).map(|scenario| scenario.too_short());
    /// assert_eq!(of(3.5)?, None); // 1 m at 0.3 m/s, from rest: 3.48 s
    /// assert!(of(3.4)?.is_some_and(|said| said.starts_with("duration_s = 3.4 is too short: the rear wheels start 1.00 m before")));
    /// let square = Scenario::load("square", &[Override::new("duration_s", 5.0)])?;
    /// assert!(square.too_short().is_some_and(|said| said.starts_with("duration_s = 5 is too short: the path takes ")));
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn too_short(&self) -> Option<String> {
        if let Ok(Some(path)) = self.planned_path() {
            let takes_s = path.duration_s();
            // A duration that was rounded to hundredths is as long.
            return (takes_s > self.duration_s + 5e-3).then(|| {
                let duration_s = self.duration_s;
                format!("duration_s = {duration_s} is too short: the path takes {takes_s:.2} s")
            });
        }
        let obstacle = self
            .terrain
            .obstacle()
            .filter(|_| !self.command.comes_by_itself())?;
        let ahead_m = self.rearmost_m() + self.start.x_m + self.perturbation.start_m;
        let way_m = obstacle.to_m - ahead_m;
        let earliest_s = self.command.earliest_s(way_m);
        if earliest_s.is_some_and(|earliest_s| earliest_s <= self.duration_s) {
            return None;
        }
        let duration_s = self.duration_s;
        let way = format!("the rear wheels start {way_m:.2} m before the obstacle's far side, and");
        Some(match earliest_s {
            Some(seconds) => format!(
                "duration_s = {duration_s} is too short: {way} the command needs at least {seconds:.2} s to move them there"
            ),
            None => format!("no duration_s is long enough: {way} the command never moves them there"),
        })
    }

    /// Position of the rearmost wheel along the path at the start, as far forward as the perturbation may move it, from
    /// the origin \[m\]. If the vehicle is commanded to turn, the foremost position of the wheels'
    /// mean: at any heading, some wheel is no further forward.
    fn rearmost_m(&self) -> f64 {
        let wheels = || self.vehicle().wheel.iter().map(|wheel| wheel.position_m);
        let spread_rad = self.perturbation.yaw_rad;
        if self.command.turns() || spread_rad > 0.5 {
            let count = wheels().count() as f64;
            let mean = |k: usize| wheels().map(|place| place[k]).sum::<f64>() / count;
            return libm::hypot(mean(0), mean(1));
        }
        let at = |heading_rad: f64| {
            let (sin, cos) = (libm::sin(heading_rad), libm::cos(heading_rad));
            wheels()
                .map(|[x, y]| cos * x - sin * y)
                .fold(f64::INFINITY, f64::min)
        };
        let headings = (-8..=8).map(|part| self.start.heading_rad + spread_rad * f64::from(part) / 8.0);
        headings.map(at).fold(f64::NEG_INFINITY, f64::max)
    }
}
