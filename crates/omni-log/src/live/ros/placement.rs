//! Places the vehicle where another node says, as RViz does with *2D Pose Estimate*.

use std::sync::Arc;

use omni_config::{Override, Scenario};
use omni_sim::Simulation;

use super::frames::Frames;
use crate::live::controls::Controls;
use crate::ros2::PoseWithCovarianceStamped;

/// Lets the run begin anew from poses of other nodes.
pub(super) struct Placement {
    pub(super) scenario: Scenario,
    pub(super) frames: Arc<Frames>,
    pub(super) controls: Arc<Controls>,
}

impl Placement {
    /// The run begins anew with the vehicle there, or a line why it cannot: then nothing changes.
    pub(super) fn take(&self, asked: &PoseWithCovarianceStamped) -> Result<(), String> {
        let to = self.frames.in_map(&asked.header, &asked.pose.pose)?;
        let start = [
            Override::new("start.x_m", to.x_m),
            Override::new("start.y_m", to.y_m),
            Override::new("start.heading_rad", to.yaw_rad),
        ];
        let placed = self.scenario.with(&self.scenario.name, &start);
        let placed = placed.map_err(|error| error.to_string())?;
        // What the physics cannot begin with would end the run.
        Simulation::new(&placed).map_err(|error| error.to_string())?;
        self.controls.start_again_as(placed);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ros2::{Header, Pose, PoseWithCovariance};

    fn at(x: f64, y: f64) -> PoseWithCovarianceStamped {
        let pose = Pose {
            position: [x, y, 0.0].into(),
            orientation: [0.0, 0.0, 1.0, 0.0].into(), // turned by half a turn
        };
        PoseWithCovarianceStamped {
            header: Header::new(0, "map"),
            pose: PoseWithCovariance {
                pose,
                ..PoseWithCovariance::default()
            },
        }
    }

    #[test]
    fn a_vehicle_is_placed_where_its_scenario_allows_it_and_otherwise_nothing_changes() {
        let placement = Placement {
            scenario: Scenario::load("step", &[]).expect("built-in"),
            frames: Arc::new(Frames::new("")),
            controls: Arc::default(),
        };
        // The riser is at 0.7 m; numbers that are none are no place.
        for (x, part) in [
            (0.5, "terrain.start_x_m"),
            (f64::NAN, "start.x_m"),
            (f64::INFINITY, "start.x_m"),
        ] {
            let said = placement.take(&at(x, 0.0)).expect_err(part);
            assert!(said.contains(part) && said.contains("allowed"), "{said}");
            assert!(!placement.controls.starts_again());
        }
        assert_eq!(placement.take(&at(-1.5, 0.25)), Ok(()));
        assert!(placement.controls.take_start_again());
        let placed = placement.controls.take_placed().expect("a scenario");
        assert_eq!((placed.start.x_m, placed.start.y_m), (-1.5, 0.25));
        assert!((placed.start.heading_rad.abs() - std::f64::consts::PI).abs() < 1e-12);
        // A reset after it is of the scenario's own start.
        placement.controls.start_again();
        assert!(placement.controls.take_placed().is_none());
    }
}
