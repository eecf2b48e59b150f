//! Rollers that are doubtful: mounted for the other side.

use crate::{Error, Vehicle, WheelSpec};

/// Rollers are doubtful where the vehicle's lever against turning is below this part of what they
/// would give mounted the other way round.
const LEVER_PART: f64 = 0.7;
/// Wheels are doubtful that with the other roller angles make the motion so many times as well conditioned.
const WRONG_HAND: f64 = 1.5;
/// Wheels that are closer to the middle of all than this part of their radius are at no corner.
const AT_A_CORNER: f64 = 0.1;

impl Vehicle {
    /// Rollers that are mounted the other way round than they turn the vehicle best.
    pub(super) fn mirrored_rollers(&self) -> Result<Option<String>, Error> {
        let mut mirrored = self.clone();
        for wheel in &mut mirrored.wheel {
            wheel.roller_angle_rad = -wheel.roller_angle_rad;
        }
        // Rollers mirrored may not move it at all: then they are right as they are.
        let Ok((other, _)) = mirrored.levers_m() else {
            return Ok(None);
        };
        let (own, _) = self.levers_m()?;
        Ok((own < LEVER_PART * other).then(|| {
            format!(
                "roller_angle_rad: the wheels' forces have a lever arm of {own:.3} m about the centre of the wheels, {other:.3} m with the other sign: the vehicle \
                 hardly turns; choose signs with which the roller axes on the ground form a diamond"
            )
        }))
    }

    /// Wheels whose rollers are mounted in the opposite sense to the other wheels' layout.
    pub(super) fn wrong_hand(&self) -> Result<Option<String>, Error> {
        if let Some(wrong) = self.beside_the_diamond() {
            let why = "the roller axes on the ground should form a diamond";
            return Ok((!wrong.is_empty()).then(|| self.other_hands(&wrong, why)));
        }
        let (_, own) = self.actuators()?;
        let oblique = |index: &usize| self.wheel[*index].roller_angle_rad != 0.0;
        let wheels: Vec<_> = (0..self.wheel.len()).filter(oblique).collect();
        let single = wheels.iter().map(|index| vec![*index]);
        let pairs = wheels.iter().flat_map(|one| {
            wheels
                .iter()
                .filter(move |other| *other > one)
                .map(|other| vec![*one, *other])
        });
        let mut best = None;
        for wrong in single.chain(pairs) {
            let mut turned = self.clone();
            for index in &wrong {
                turned.wheel[*index].roller_angle_rad *= -1.0;
            }
            if let Ok((_, condition)) = turned.actuators()
                && best.as_ref().is_none_or(|(least, _)| condition < *least)
            {
                best = Some((condition, wrong));
            }
        }
        let wrong = best.filter(|(condition, _)| own > WRONG_HAND * condition);
        Ok(wrong.map(|(condition, wrong)| {
            let why = format!(
                "the condition number is {own:.2}, and {condition:.2} with the other sign (1 is best)"
            );
            self.other_hands(&wrong, &why)
        }))
    }

    /// Of four mecanum wheels at four corners, those whose rollers' axes are not on the diamond that those of
    /// the others lie on; none of other layouts. Rollers that are all mounted the other way round have none.
    fn beside_the_diamond(&self) -> Option<Vec<usize>> {
        let [first, _, _, _] = self.wheel.as_slice() else {
            return None;
        };
        let [ahead_x, ahead_y] = first.rolling_direction;
        let [mut middle_x, mut middle_y] = [0.0; 2];
        for wheel in &self.wheel {
            middle_x += wheel.position_m[0] / self.wheel.len() as f64;
            middle_y += wheel.position_m[1] / self.wheel.len() as f64;
        }
        let corner = |wheel: &WheelSpec| {
            let [dx, dy] = wheel.rolling_direction;
            let across =
                (dx * ahead_y - dy * ahead_x).abs() / (libm::hypot(dx, dy) * libm::hypot(ahead_x, ahead_y));
            let (x, y) = (wheel.position_m[0] - middle_x, wheel.position_m[1] - middle_y);
            let along = (x * ahead_x + y * ahead_y) / libm::hypot(ahead_x, ahead_y);
            let aside = (y * ahead_x - x * ahead_y) / libm::hypot(ahead_x, ahead_y);
            let near = along.abs().min(aside.abs()) < AT_A_CORNER * wheel.radius_m;
            let usual = across < 0.02 && wheel.roller_angle_rad != 0.0 && !near;
            usual.then_some((along > 0.0, aside > 0.0))
        };
        let mut corners = self.wheel.iter().map(corner).collect::<Option<Vec<_>>>()?;
        let crosses = |(wheel, (front, left)): (&WheelSpec, &(bool, bool))| {
            (wheel.roller_angle_rad > 0.0) == (front == left)
        };
        let wrong: Vec<_> = self.wheel.iter().zip(&corners).map(crosses).collect();
        corners.sort_unstable();
        corners.dedup();
        if corners.len() != 4 {
            return None;
        }
        if wrong.iter().all(|wrong| *wrong) {
            return Some(Vec::new());
        }
        Some((0..wrong.len()).filter(|index| wrong[*index]).collect())
    }

    /// The line about wheels that look like wheels of the other side.
    fn other_hands(&self, wrong: &[usize], why: &str) -> String {
        let wheels = || wrong.iter().map(|index| &self.wheel[*index]);
        let names: Vec<_> = wheels().map(|wheel| wheel.name.as_str()).collect();
        let angles: Vec<_> = wheels().map(|wheel| wheel.roller_angle_rad.to_string()).collect();
        let looks = match wrong {
            [_] => "looks like that of a wheel for the other side",
            _ => "look like those of wheels for the other side",
        };
        format!(
            "wheel {}: roller_angle_rad = {} {looks}: {why}",
            names.join(", "),
            angles.join(", ")
        )
    }
}
