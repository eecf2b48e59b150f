//! Steps a simulation by hand, with a command of one's own in every control period: drive to a place.
//!
//! Prints where the vehicle is, twice a second. An omni-directional vehicle goes straight there without turning.
#![expect(clippy::print_stdout, reason = "an example speaks on standard output")]

use omni_core::geometry::{PlanarPose, WorldTwist};
use omni_sim::{Error, Simulation, config::Scenario};

const GOAL_M: [f64; 2] = [0.6, 0.8];

fn main() -> Result<(), Error> {
    let mut simulation = Simulation::new(&Scenario::load("flat", &[])?)?;
    println!("time [s]  x [m]   y [m]  heading [deg]");
    for period in 0..=5000 {
        let pose = simulation.observation().pose.planar();
        let PlanarPose { x_m, y_m, yaw_rad } = pose;
        if period % 500 == 0 {
            let time_s = simulation.time_ns() as f64 * 1e-9;
            println!("{time_s:6.1}  {x_m:7.3} {y_m:7.3} {:+9.2}", yaw_rad.to_degrees());
        }
        // Towards the goal, at most 0.3 m/s and slower near it, heading 0: in the world's directions ...
        let (dx, dy) = (GOAL_M[0] - x_m, GOAL_M[1] - y_m);
        let per_m = 0.3 / dx.hypot(dy).max(0.15);
        let twist = WorldTwist {
            vx_m_s: dx * per_m,
            vy_m_s: dy * per_m,
            wz_rad_s: -yaw_rad,
        };
        // ... and in the vehicle's own.
        simulation.step(&twist.to_body(&pose))?;
    }
    let [x_m, y_m, _] = simulation.observation().pose.position_m;
    let off_m = (GOAL_M[0] - x_m).hypot(GOAL_M[1] - y_m);
    println!("{:.1} mm from the goal", 1e3 * off_m);
    assert!(off_m < 0.01);
    Ok(())
}
