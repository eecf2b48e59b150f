//! Waypoints with times.

use super::*;

#[test]
fn times_are_met_on_the_way_and_waiting_is_waited() {
    let timed = |x, y, time_s| Waypoint {
        time_s: Some(time_s),
        ..Waypoint::at(x, y)
    };
    let path = [
        Waypoint::at(0.0, 0.0),
        Waypoint::at(0.5, 0.0),
        timed(1.0, 0.0, 4.0),
        timed(3.0, 0.0, 8.0),
        timed(3.0, 0.0, 12.0),
        Waypoint::at(3.0, 1.0),
    ];
    let planner = planner::<f64>();
    let plan = Plan::of(&planner, &path);
    for (time_s, x, speed) in [
        (4.0, 1.0, 0.2..0.3),
        (8.0, 3.0, -1e-9..1e-6),
        (11.999, 3.0, -1e-9..1e-6),
    ] {
        let sample = plan.trajectory().at(time_s);
        assert!(
            (sample.pose.x_m - x).abs() < 1e-8,
            "{time_s}: {}",
            sample.pose.x_m
        );
        assert!(
            speed.contains(&sample.speed_m_s),
            "{time_s}: {}",
            sample.speed_m_s
        ); // 1 m in 4 s on average
    }
    check(&planner, &limits(), &plan).expect("within limits");
    check_motion(&plan, false).expect("moves as it says");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, ..ProptestConfig::default() })]

    /// Straight on through waypoints, some with a time: a quarter later than limits need, up to ten
    /// times that. Nearer times may be rejected: at a waypoint with a time the vehicle is no faster than the mean
    /// before and after it. Of 200,000 such paths none was.
    #[test]
    fn every_time_that_is_not_too_soon_is_met_and_nothing_is_unknown(
        ways in prop::collection::vec((0.05_f64..3.0, prop::option::of(1.25_f64..10.0)), 1..5),
    ) {
        let planner = planner::<f64>();
        let mut path = vec![Waypoint::at(0.0, 0.0)];
        for (way_m, _) in &ways {
            path.push(Waypoint::at(path[path.len() - 1].x_m + way_m, 0.0));
        }
        for (i, (_, slower)) in ways.iter().enumerate() {
            let Some(slower) = slower else { continue };
            // The soonest to stop there, as long as that is behind the times before.
            let soonest = Plan::of(&planner, &path[..=i + 1]).trajectory().duration_s();
            prop_assert!(soonest.is_finite());
            path[i + 1].time_s = Some(soonest * slower);
        }
        let plan = Plan::of(&planner, &path);
        for sample in plan.samples(0.01) {
            let known = [sample.pose.x_m, sample.speed_m_s, sample.acceleration[0]];
            prop_assert!(known.iter().all(|value| value.is_finite()), "{} s: {known:?}", sample.time_s);
        }
        for waypoint in &path {
            let Some(time_s) = waypoint.time_s else { continue };
            let x_m = plan.trajectory().at(time_s).pose.x_m;
            // 64 halvings of a speed, over up to 100 s.
            prop_assert!((x_m - waypoint.x_m).abs() < 1e-8, "{x_m} at {time_s}, not {}", waypoint.x_m);
        }
    }
}
