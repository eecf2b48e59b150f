//! omni-core for C: see `include/omnistep.h`.
#![no_std]

mod drive;
mod estimate;
mod loops;
mod memory;
mod motion;
mod path;
mod status;
mod traction;

/// A panic that could happen is an error of the linker: it finds no such function.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    unsafe extern "C" {
        safe fn omnistep_a_panic_is_reachable() -> !;
    }
    omnistep_a_panic_is_reachable()
}

/// The functions of each wheel count, of `wheels.rs.in`.
mod wheels {
    use core::mem::MaybeUninit;

    use omni_core::drive::TractionDrive;
    use omni_core::estimate::Estimator;
    use omni_core::geometry::PlanarPose;
    use omni_core::loops::ControlSample;
    use omni_core::{BodyTwist, ControlState, Controller, Drive, WheelVelocities};

    use crate::drive::{self, Deviations, Input, Output};
    use crate::estimate::{self, PoseInput, PoseOutput};
    use crate::loops;
    use crate::memory::{DriveMemory, EstimatorMemory, TractionMemory};
    use crate::status::Status;
    use crate::traction::{self, Bodies, TractionOutput};

    include!(concat!(env!("OUT_DIR"), "/wheels.rs"));
}
