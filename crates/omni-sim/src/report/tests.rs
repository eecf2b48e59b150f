//! Tests of the reports' columns.

use super::*;
use omni_core::estimate::{EdgeEvent, EdgeKind};

fn report() -> Report {
    let wheel = |fault| DriveWheel {
        fault,
        excluded: fault.is_some(),
        brake: false,
    };
    Report {
        drive: Some(DriveReport {
            mode: DriveMode::SafeStop,
            motion_known: true,
            command: Some(CommandStatus::TimedOut),
            pose: pose([1.0, -2.0, 0.5]),
            deviations: None,
            wheels: vec![wheel(None), wheel(Some(Fault::Lost))],
        }),
        traction: Some(TractionReport {
            factor: 0.5,
            speed_m_s: 0.1,
            target_m_s: 0.2,
            thrust_n_m: 0.3,
            speed_wheel: Some(1),
            row: 2,
            mode: SupervisorMode::GaveUp,
            row_retries: 3,
            retries: 4,
            edge_m: 0.05,
            heading_rad: 0.4,
            gyro_zero_rad_s: -0.1,
            loops: TractionLoops::Fallback,
            drift_m_s: 0.0,
            wheels: [1.0, 2.0]
                .map(|slip_rad_s| TractionWheel {
                    slip_rad_s,
                    contact_n_m: -1.0,
                })
                .into(),
        }),
        own: Vec::new(),
        ground: Some(GroundReport {
            z_m: 0.5,
            std_z_m: 0.1,
            roll_rad: 0.2,
            pitch_rad: -0.3,
            wheels: vec![
                GroundWheel {
                    z_m: 0.25,
                    edge: None,
                },
                GroundWheel {
                    z_m: 0.75,
                    edge: Some(EdgeEvent {
                        kind: EdgeKind::Left,
                        wheel: 1,
                        height_m: -0.03,
                        height_deviation_m: 0.001,
                        place_m: [7.0, 8.0],
                        angle: Some([1.5, 0.01]),
                    }),
                },
            ],
        }),
        path: Some(PathReport {
            pose: pose([3.0, 4.0, 5.0]),
            waited_s: 6.0,
            estimated: pose([3.1, 4.1, 5.1]),
        }),
    }
}

fn columns() -> ReportColumns {
    ReportColumns::new(vec!["a".into(), "b".into()], [true; 2], Vec::new(), [true; 2])
}

#[test]
fn a_report_comes_back_from_its_columns_and_the_columns_from_their_names() {
    let (columns, report) = (columns(), report());
    let values = columns.values(&report);
    assert_eq!(values.len(), columns.names().len());
    let at = |name: &str| values[columns.names().iter().position(|each| each == name).expect(name)];
    assert_eq!(
        (at("drive_mode"), at("drive_fault_b"), at("traction_mode")),
        (2.0, 5.0, 3.0)
    );
    assert_eq!(
        (
            at("traction_speed_wheel"),
            at("traction_slip_rad_s_b"),
            at("path_y_m")
        ),
        (2.0, 2.0, 4.0)
    );
    assert_eq!(columns.report(&values), Some(report));
    assert_eq!(ReportColumns::named(columns.names()), columns);
    let own = ReportColumns::own(vec!["effort_n_m".into()]);
    assert_eq!(ReportColumns::named(own.names()), own);
    assert_eq!(own.report(&[7.0]).map(|report| report.own), Some(vec![7.0]));
}

#[test]
fn numbers_that_stand_for_nothing_are_no_report() {
    let columns = columns();
    let nothing = columns
        .report(&vec![f64::NAN; columns.names().len()])
        .expect("as many");
    assert_eq!(nothing, Report::default());
    assert!(columns.values(&nothing).iter().all(|value| value.is_nan()));
    let good = columns.values(&report());
    for wrong in [4.0, 0.5, -1.0, f64::INFINITY, 1e300] {
        let mut values = good.clone();
        values[0] = wrong;
        assert_eq!(columns.report(&values).expect("as many").drive, None, "{wrong}");
    }
    assert_eq!(columns.report(&good[1..]), None);
}
