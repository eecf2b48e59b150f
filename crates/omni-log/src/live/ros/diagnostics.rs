//! What is wrong with a run's vehicle, as diagnostics: its torque limits, traction control and faults.

use omni_config::Scenario;
use omni_core::DriveMode;
use omni_core::drive::Fault;
use omni_core::traction::SupervisorMode;
use omni_sim::controller::ControlSample;
use omni_sim::{DriveReport, Period, TractionReport};

use crate::message_rates::Pace;
use crate::ros2::{DiagnosticArray, DiagnosticStatus, Header, KeyValue};

/// Part of the time at a limit that is worth a warning.
const MUCH: f64 = 0.5;

/// Level of a part, what is wrong with it, and more about it.
type Found = (u8, String, Vec<KeyValue>);

/// Collects what happened between two messages.
pub(super) struct Diagnostics {
    /// Node that the names begin with.
    node: String,
    wheels: Vec<String>,
    pace: Pace,
    /// Control periods since the last message, and in how many of them each wheel was at its limit.
    periods: u32,
    limited: Vec<u32>,
}

impl Diagnostics {
    /// Of a node in a namespace, at that pace.
    pub(super) fn new(scenario: &Scenario, namespace: &str, pace: Pace) -> Self {
        let wheels = &scenario.vehicle().wheel;
        let namespace = namespace.trim_matches('/');
        let separator = if namespace.is_empty() { "" } else { "/" };
        Self {
            node: format!("{namespace}{separator}omnistep"),
            wheels: wheels.iter().map(|wheel| wheel.name.clone()).collect(),
            pace,
            periods: 0,
            limited: vec![0; wheels.len()],
        }
    }

    /// Takes a control period in. The message, if one is due.
    pub(super) fn push(&mut self, period: &Period) -> Option<DiagnosticArray> {
        self.periods += 1;
        for (limited, wheel) in self.limited.iter_mut().zip(&period.control.wheels) {
            *limited += u32::from(wheel.saturated() == 1.0);
        }
        let time_ns = period.observed.time_ns;
        self.pace.due(time_ns).then(|| {
            let status = self.status(&period.control);
            self.periods = 0;
            self.limited.fill(0);
            DiagnosticArray {
                header: Header::new(time_ns, ""),
                status,
            }
        })
    }

    fn status(&self, sample: &ControlSample) -> Vec<DiagnosticStatus> {
        let traction = sample.report.traction.as_ref().map(traction);
        let drive = sample.report.drive.as_ref().map(|drive| self.drive(drive));
        let parts = [
            ("torque limits", Some(self.torque_limits(sample.common_factor))),
            ("traction control", traction),
            ("wheel encoders", drive),
        ];
        let known = parts.into_iter().filter_map(|(part, found)| Some((part, found?)));
        known
            .map(|(part, (level, message, values))| DiagnosticStatus {
                level,
                name: format!("{}: {part}", self.node),
                message,
                hardware_id: String::new(),
                values,
            })
            .collect()
    }

    fn torque_limits(&self, common_factor: f64) -> Found {
        let parts = self
            .limited
            .iter()
            .map(|limited| f64::from(*limited) / f64::from(self.periods.max(1)));
        let named: Vec<_> = self.wheels.iter().zip(parts).collect();
        let much = named.iter().filter(|(_, part)| *part >= MUCH);
        let much: Vec<_> = much.map(|(name, _)| name.as_str()).collect();
        let mut values = vec![value("common_factor", common_factor)];
        values.extend(
            named
                .iter()
                .map(|(name, part)| value(&format!("part of the time, {name}"), part)),
        );
        if much.is_empty() {
            (DiagnosticStatus::OK, "within the limits".into(), values)
        } else {
            let message = format!("at the torque limit: {}", much.join(", "));
            (DiagnosticStatus::WARN, message, values)
        }
    }

    fn drive(&self, drive: &DriveReport) -> Found {
        let (level, message) = match drive.mode {
            DriveMode::Normal => (DiagnosticStatus::OK, "every wheel drives"),
            DriveMode::Degraded => (DiagnosticStatus::WARN, "drives without some wheels"),
            DriveMode::SafeStop => (
                DiagnosticStatus::ERROR,
                "stopped: too few wheels determine the motion",
            ),
            DriveMode::EmergencyStop => (DiagnosticStatus::ERROR, "emergency stop"),
            _ => (DiagnosticStatus::WARN, "in another mode"),
        };
        let wheels = self.wheels.iter().zip(&drive.wheels);
        let values = wheels.map(|(name, wheel)| value(name, fault(wheel.fault)));
        (level, message.into(), values.collect())
    }
}

fn traction(report: &TractionReport) -> Found {
    let (level, message) = match report.mode {
        SupervisorMode::Drive => (DiagnosticStatus::OK, "drives as commanded"),
        SupervisorMode::BackOff => (DiagnosticStatus::WARN, "backs off for another try"),
        SupervisorMode::RunUp => (DiagnosticStatus::WARN, "runs up for another try"),
        SupervisorMode::GaveUp => (DiagnosticStatus::ERROR, "gave up: no retry is left"),
        _ => (DiagnosticStatus::WARN, "in another mode"),
    };
    let values = vec![
        value("retries", report.retries),
        value("speed_m_s", report.speed_m_s),
        value("target_m_s", report.target_m_s),
    ];
    (level, message.into(), values)
}

fn fault(fault: Option<Fault>) -> &'static str {
    match fault {
        None => "no fault",
        Some(Fault::NotANumber) => "not a number",
        Some(Fault::Jump) => "impossible jump",
        Some(Fault::Stuck) => "stuck",
        Some(Fault::Silent) => "silent",
        Some(Fault::Lost) => "declared lost",
        Some(_) => "faulty",
    }
}

fn value(key: &str, value: impl ToString) -> KeyValue {
    KeyValue {
        key: key.into(),
        value: value.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use omni_config::Override;
    use omni_sim::Simulation;

    use super::*;

    /// A second of a drive over flat ground, as of a node in a namespace.
    fn a_second(policy: &str, change: impl Fn(&mut Period)) -> Vec<DiagnosticStatus> {
        let scenario = Scenario::load("flat", &[Override::new("control.policy", policy)]).expect("built-in");
        let mut simulation = Simulation::new(&scenario).expect("valid");
        let mut diagnostics = Diagnostics::new(&scenario, "/robot1", Pace::hz(1.0));
        let mut sent = Vec::new();
        while simulation.time_ns() < 1_000_000_000 {
            simulation.step(&simulation.scenario_command()).expect("finite");
            let mut period = simulation.period().clone();
            change(&mut period);
            sent.extend(diagnostics.push(&period));
        }
        // The first period has one as well, as every topic.
        assert_eq!(sent.len(), 2);
        sent.pop().expect("the last").status
    }

    fn levels(status: &[DiagnosticStatus]) -> Vec<(u8, &str)> {
        status.iter().map(|one| (one.level, one.name.as_str())).collect()
    }

    #[test]
    fn a_part_is_named_by_its_node_and_only_known_parts_are() {
        assert_eq!(
            levels(&a_second("independent", |_| {})),
            [(DiagnosticStatus::OK, "robot1/omnistep: torque limits")]
        );
        let with_traction = [
            (DiagnosticStatus::OK, "robot1/omnistep: torque limits"),
            (DiagnosticStatus::OK, "robot1/omnistep: traction control"),
        ];
        assert_eq!(levels(&a_second("traction", |_| {})), with_traction);
    }

    #[test]
    fn a_wheel_at_its_limit_is_named_and_a_given_up_climb_is_an_error() {
        let status = a_second("traction", |period| {
            let wheel = &mut period.control.wheels[3];
            wheel.requested_n_m = 2.0 * wheel.limit_upper_n_m + 1.0;
            if let Some(traction) = &mut period.control.report.traction {
                traction.mode = SupervisorMode::GaveUp;
            }
        });
        let [limits, traction] = &status[..] else {
            panic!("two parts")
        };
        assert_eq!(limits.level, DiagnosticStatus::WARN);
        assert_eq!(limits.message, "at the torque limit: 4");
        assert!(limits.values.contains(&value("part of the time, 4", 1.0)));
        assert_eq!(traction.level, DiagnosticStatus::ERROR);
        assert!(traction.values.iter().any(|one| one.key == "retries"));
    }

    #[test]
    fn a_drive_without_a_wheel_warns_and_says_which() {
        let report = |mode, fault| DriveReport {
            mode,
            motion_known: true,
            command: None,
            pose: omni_core::geometry::PlanarPose::origin(),
            deviations: None,
            wheels: vec![
                omni_sim::DriveWheel {
                    fault,
                    excluded: fault.is_some(),
                    brake: false,
                };
                7
            ],
        };
        let scenario = Scenario::load("flat", &[]).expect("built-in");
        let diagnostics = Diagnostics::new(&scenario, "/", Pace::hz(1.0));
        assert_eq!(diagnostics.node, "omnistep");
        for (mode, fault, level, said) in [
            (DriveMode::Normal, None, DiagnosticStatus::OK, "no fault"),
            (
                DriveMode::Degraded,
                Some(Fault::Stuck),
                DiagnosticStatus::WARN,
                "stuck",
            ),
            (
                DriveMode::SafeStop,
                Some(Fault::Silent),
                DiagnosticStatus::ERROR,
                "silent",
            ),
        ] {
            let (found, _, values) = diagnostics.drive(&report(mode, fault));
            assert_eq!((found, values.len()), (level, 7));
            assert_eq!(values[0], value("1", said));
        }
    }
}
