//! Laws of the controller's keys: parts of policies, refusals, names.

use omni_core::Coordination;
use omni_core::loops::{AntiWindup, Integral, Saturation};

use crate::{Override, Scenario};

fn load(keys: &[&str]) -> Result<Scenario, String> {
    let overrides: Vec<_> = keys
        .iter()
        .map(|key| Override::parse(key).expect("key=value"))
        .collect();
    Scenario::load("step", &overrides).map_err(|error| error.to_string())
}

#[test]
fn every_pair_of_the_grid_is_reachable_from_every_policy() {
    for policy in Coordination::<f64>::PRESETS {
        for (name, saturation) in [
            ("clip", Saturation::Clip),
            ("scale_torques", Saturation::ScaleTorques),
            (
                "{ scale_references = { floor = 0.3 } }",
                Saturation::ScaleReferences { floor: 0.3 },
            ),
        ] {
            for (integral_name, integral) in [("per_wheel", Integral::PerWheel), ("shared", Integral::Shared)]
            {
                let keys = [
                    format!("control.policy={policy}"),
                    format!("control.saturation={name}"),
                    format!("control.integral={integral_name}"),
                ];
                let own = load(&keys.each_ref().map(String::as_str)).expect("every pair means something");
                assert_eq!(
                    own.coordination::<f64>().expect("known"),
                    Coordination::new(saturation, integral)
                );
                let written = name.replace(
                    "{ scale_references = { floor = 0.3 } }",
                    "scale_references+floor=0.3",
                );
                assert_eq!(
                    own.control.law(),
                    format!("{policy}+saturation={written}+integral={integral_name}")
                );
            }
        }
    }
}

#[test]
fn what_a_law_does_not_look_at_is_refused_by_key() {
    for (keys, said) in [
        (
            vec!["control.policy=independent", "control.saturation.clip.floor=0.5"],
            "built-in step: control.saturation.clip: expected empty table",
        ),
        (
            vec![
                "control.policy=independent",
                "control.saturation.scale_references.floor=1.5",
            ],
            "built-in step: control.saturation.scale_references.floor: 1.5, allowed: 0 to 1",
        ),
        (
            vec!["control.policy=scale_references", "control.anti_windup=none"],
            "built-in step: control.anti_windup: none, allowed: conditioned or clamp where references are scaled",
        ),
        (
            vec![
                "control.policy=independent",
                "control.anti_windup.back_calculation.tracking_time_s=0",
            ],
            "built-in step: control.anti_windup.back_calculation.tracking_time_s: 0, allowed: 0.000001 to 1000000",
        ),
        (
            vec![
                "control.policy=independent",
                "control.anti_windup.clamp.tracking_time_s=1",
            ],
            "built-in step: control.anti_windup.clamp.tracking_time_s: unknown field `tracking_time_s`, expected `limit_n_m`",
        ),
        (
            vec!["control.policy=independent", "control.max_retries=3"],
            "built-in step: control.max_retries: 3, allowed: only with control.policy = \"traction\" or \"traction_runup\"",
        ),
        (
            vec!["control.integral_zone_rad_s=-1"],
            "built-in step: control.integral_zone_rad_s: -1, allowed: 0 to 1000000",
        ),
        (
            vec!["control.policy=traction", "control.proportional_limit_n_m=1"],
            "built-in step: control.proportional_limit_n_m: 1, allowed: only with a policy of wheel speed loops: independent, \
             scale_torques, scale_references, shared_integral",
        ),
    ] {
        assert_eq!(load(&keys).expect_err("refused"), said);
    }
    let unknown = load(&["control.saturation=clipp"]).expect_err("refused");
    assert!(
        unknown.starts_with("built-in step: control.saturation: ") && unknown.contains("`clip`"),
        "{unknown}"
    );
}

#[test]
fn how_torque_ends_at_rest_is_kept_under_another_policy() {
    let scaled = load(&["control.policy=scale_torques", "control.rest.bleed_s=0.1"]).expect("a scenario");
    let rest = |policy: &str| scaled.with_policy(policy).expect("a preset").control.rest.bleed_s;
    assert_eq!(["independent", "traction"].map(rest), [0.1, 0.1]);
}

#[test]
fn bounds_of_terms_reach_the_loops_and_the_name_of_the_law() {
    let pid = |keys: &[&str]| {
        let own = load(keys).expect("a scenario");
        let pid = own.wheel_control::<f64, 7>().expect("its loops").pid;
        (
            own.control.law(),
            pid.integral_zone_rad_s,
            pid.proportional_limit_n_m,
        )
    };
    let keys = [
        "control.policy=scale_torques",
        "control.integral_zone_rad_s=2",
        "control.proportional_limit_n_m=0.5",
    ];
    let name = "scale_torques+integral_zone_rad_s=2+proportional_limit_n_m=0.5";
    assert_eq!(pid(&keys), (name.to_owned(), 2.0, 0.5));
    let none = f64::INFINITY;
    assert_eq!(pid(&keys[..1]), ("scale_torques".to_owned(), none, none));
    let own = load(&keys).expect("a scenario");
    assert!(
        own.with_policy("independent")
            .expect("a preset")
            .control
            .is_preset()
    );
}

#[test]
fn anti_windup_takes_what_is_left_out_from_the_vehicle() {
    let law = |keys: &[&str]| {
        let keys = [&["control.policy=independent"], keys].concat();
        let own = load(&keys).expect("a scenario");
        own.wheel_control::<f64, 7>().expect("its loops").pid.anti_windup
    };
    let vehicle = load(&[]).expect("step").vehicle().clone();
    let gains = vehicle.gains.expect("chugo7 has its own");
    assert_eq!(law(&[]), AntiWindup::None);
    assert_eq!(
        law(&["control.anti_windup={ back_calculation = {} }"]),
        AntiWindup::BackCalculation {
            tracking_time_s: gains.kp_n_m_s_rad / gains.ki_n_m_rad
        }
    );
    assert_eq!(
        law(&["control.anti_windup={ clamp = {} }"]),
        AntiWindup::Clamp {
            limit_n_m: vehicle.motor.stall_torque_n_m
        }
    );
    assert_eq!(
        law(&["control.anti_windup.clamp.limit_n_m=0.5"]),
        AntiWindup::Clamp { limit_n_m: 0.5 }
    );
}
