//! `omnistep drive`.

mod keys;

use std::io::Write;
use std::ops::ControlFlow;
use std::sync::atomic::Ordering;

use omni_config::{Override, Rest, Scenario, Vehicle};
use omni_log::{Live, Opened, Pilot, Until, driving_pace, run_live};
use omni_sim::Simulation;

use crate::Error;
use crate::args::{DriveArgs, with_vehicle};
use crate::compare::headline_for;
use crate::live::{explain, page_of, show};
use crate::notices::announce_vehicle;
use crate::output::say;
use crate::room::obstacle_at_m;
use crate::scenario_or_vehicle::scenario_or_vehicle;
use crate::signals::stop_flag;
use keys::Keys;

/// The bumps of [`ground_for`]: their height as a part of the smallest wheel's radius, at most so
/// high \[m\]; the first is no nearer than this \[m\].
const BUMP_OF_RADIUS: f64 = 1.0 / 3.0;
const HIGHEST_M: f64 = 0.02;
const NEAREST_M: f64 = 0.7;
/// Torque ends this long after a key is released \[s\], where the scenario does not say: a vehicle
/// without friction stands by then in every direction, also in one in which few wheels push.
const BLEED_S: f64 = 1.5;

/// Runs until it is ended, driven by keys and from the page, and prints its table.
pub(super) fn drive(args: DriveArgs, out: &mut dyn Write) -> Result<(), Error> {
    let mut overrides = with_vehicle(args.vehicle.as_deref(), &args.overrides)?;
    if let Some(policy) = &args.policy {
        overrides.push(Override::new("control.policy", policy.as_str()));
    }
    let rest_is_set = overrides
        .iter()
        .any(|each| each.key().starts_with("control.rest"));
    let mut scenario = scenario(&args.name, overrides)?;
    if !rest_is_set && scenario.control.rest == Rest::default() {
        scenario.control.rest.bleed_s = BLEED_S;
    }
    announce_vehicle(&scenario);
    let pilot = Pilot::new();
    let mut live = Live::new(args.port);
    (live.until, live.stands, live.allow_control) = (Until::Stopped, true, true);
    (live.real_time_factor, live.origins) = (args.real_time_factor, args.origins);
    live.pilot = Some(pilot.clone());
    live.own_page = true;
    let no_keys = args.no_keys;
    let opened = |place: &Opened| {
        if let Opened::Port(address) = place {
            let page = page_of(address);
            say(&format!(
                "open {page} in a browser to drive and to watch; Ctrl-C ends it"
            ));
        }
    };
    let (mut begun, mut keys) = (false, None);
    let stop = stop_flag();
    let watch = |simulation: Option<&Simulation>, _| {
        if !std::mem::replace(&mut begun, true) && !no_keys {
            keys = Keys::open(driving_pace(&scenario), pilot.clone());
        }
        let ended = match (&mut keys, simulation) {
            (Some(keys), Some(simulation)) => keys.look(simulation),
            _ => false,
        };
        if ended || stop.load(Ordering::SeqCst) {
            keys = None; // the terminal is as it was before anything else takes time
            return Ok(ControlFlow::Break(()));
        }
        Ok::<_, Error>(ControlFlow::Continue(()))
    };
    let warn = |line: &str| keys::say_between(&format!("live: {line}"));
    let ran = run_live(&scenario, &live, opened, warn, watch);
    drop(keys); // where the run ended by itself the terminal is still theirs
    let (outcome, ended) = ran?;
    let headline = headline_for(&scenario, "driven by hand");
    show(&headline, &outcome, args.json, out)?;
    if args.explain {
        explain(&outcome, out)?;
    }
    ended.map_or(Ok(()), |error| Err(error.into()))
}

/// A scenario by its name, or a vehicle by its name on a ground that fits it.
fn scenario(name: &str, overrides: Vec<Override>) -> Result<Scenario, Error> {
    match scenario_or_vehicle(name, overrides, || Ok(ground_for(&Vehicle::load(name)?))) {
        // Of two lists of names the one with a name that may have been meant.
        Err(unknown @ omni_config::Error::UnknownName { .. }) => Err(match Vehicle::load(name) {
            Err(other) if other.to_string().contains("(did you mean ") => other.into(),
            _ => unknown.into(),
        }),
        other => other.map_err(|error| error.to_command("drive").into()),
    }
}

/// Bumps that a vehicle's wheels can climb, with room before the first; level ground if balls represent its wheels only
/// on level ground.
fn ground_for(vehicle: &Vehicle) -> (&'static str, Vec<Override>) {
    if vehicle.beyond_balls_ahead().is_some() {
        return ("flat", Vec::new());
    }
    let radii = vehicle.wheel.iter().map(|wheel| wheel.radius_m);
    let height_m = (BUMP_OF_RADIUS * radii.fold(f64::INFINITY, f64::min)).min(HIGHEST_M);
    let bumps = vec![
        Override::new("terrain.height_m", height_m),
        Override::new("terrain.width_m", 2.0 * height_m), // half round
        Override::new("terrain.start_x_m", obstacle_at_m(vehicle, NEAREST_M)),
    ];
    ("bumps", bumps)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_vehicle_meets_bumps_only_where_balls_are_its_wheels_there() {
        let ground = |name: &str| {
            scenario(name, Vec::new())
                .expect("a vehicle")
                .terrain
                .described()
                .to_string()
        };
        assert!(ground("chugo7").contains("bumps"), "{}", ground("chugo7"));
        assert!(ground("mecanum4").contains("flat"), "{}", ground("mecanum4"));
    }
}
