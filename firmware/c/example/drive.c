/* The whole Drive from C, through commands, a time-out, a silent encoder, a slipping wheel, an emergency stop and a safe stop: the
 * same steps as crates/omni-config/examples/c_drive_reference.rs, the same bits. */
#include "drive_constants.h" /* written by `omnistep export firmware/scenarios/drive.toml --format c` */
#include "hash.h"
#include "omnistep.h"
#include "startup.h"

static omni7_drive_state state;
static omni7_drive_output output;

/* Motors that are to be shorted. */
static int shorted(void) {
    int count = 0;
    for (int i = 0; i < 7; i++) {
        count += output.brake[i];
    }
    return count;
}

/* Control periods in which `control.rest.bleed_s` of the scenario ends all torque: 0.5 s of 1 ms. */
#define BLEED_PERIODS 500

/* For how many periods every reference has been 0. */
static int rested;

/* Torque must have ended by then, and is exactly 0 from then on. */
static bool ends_torque(void) {
    bool rests = true, none = true;
    for (int i = 0; i < 7; i++) {
        rests = rests && output.references.rad_s[i] == 0.0f;
        none = none && output.torques.n_m[i] == 0.0f && !output.active[i];
    }
    rested = rests ? rested + 1 : 0;
    return rested <= BLEED_PERIODS || none;
}

/* What has to be so after period k: a hash alone would not say that the stops happened. */
static bool as_expected(int k) {
    switch (k) {
    case 900:
        return output.mode == OMNI_DRIVE_MODE_NORMAL && output.estimated.vx_m_s > 0.2f;
    case 1500: /* no command for 0.5 s */
        return output.status == OMNI_COMMAND_STATUS_TIMED_OUT && output.references.rad_s[0] == 0.0f && output.torques.n_m[0] < 1e-3f;
    case 1650: /* the others start without it */
        return output.torques.n_m[0] <= 0.0f && output.saturated[0] && output.active[0] && output.torques.n_m[3] > 0.0f;
    case 2100: /* released, while the others drive on */
        return output.mode == OMNI_DRIVE_MODE_DEGRADED && output.faults[2] == OMNI_FAULT_SILENT && !output.active[2] && shorted() == 0;
    case 2440: /* it has said what the others say for long enough */
        return output.mode == OMNI_DRIVE_MODE_NORMAL && output.active[2];
    case 2540: /* it slips: left out, but controlled */
        return output.excluded[4] && output.active[4] && output.faults[4] == OMNI_FAULT_NONE;
    case 2580: /* in the air */
        return output.excluded[6] && output.active[6];
    case 2980:
        return output.mode == OMNI_DRIVE_MODE_EMERGENCY_STOP && output.references.rad_s[0] == 0.0f;
    case 3250: /* the motion is undetermined: every motor is shorted */
        return output.mode == OMNI_DRIVE_MODE_SAFE_STOP && !output.motion_known && shorted() == 7;
    case 3650: /* readings are back, and the motors, but it waits for a release */
        return output.mode == OMNI_DRIVE_MODE_SAFE_STOP && shorted() == 0;
    case 3800: /* where it was said to be, at most 1 mm on */
        return output.pose.x_m > 0.999f && output.pose.x_m < 1.001f;
    case 3900:
        return output.rejected && output.status != OMNI_COMMAND_STATUS_TIMED_OUT;
    case 4399:
        return output.mode == OMNI_DRIVE_MODE_NORMAL && output.estimated.vx_m_s > 0.2f;
    case 5499: /* stopped for good: no torque, and every motor shorted */
        return output.mode == OMNI_DRIVE_MODE_EMERGENCY_STOP && rested > BLEED_PERIODS && shorted() == 7;
    default:
        return true;
    }
}

int main(void) {
    omni7_drive_input input = {0};
    omni_deviations off;
    float wheels[7] = {0};
    uint32_t hash = HASH_START;
    /* Memory that was not made ready is refused, and so are null pointers. */
    bool good = omni7_drive_step(&OMNI_DRIVE, &state, &input, &output) == OMNI_STATUS_NOT_READY &&
                omni7_drive_init(&OMNI_DRIVE, 0, &output) == OMNI_STATUS_NULL_POINTER;
    good = good && done(omni7_drive_init(&OMNI_DRIVE, &state, &output));

    for (int k = 0; k < 5500; k++) {
        /* Every 20 ms a command; none at all for a while, and once nonsense. */
        input.commanded = k % 20 == 0 && !within(k, 1000, 1600);
        input.command = (omni_twist){k == 3900 ? __builtin_nanf("") : 0.6f, 0.1f, 0.2f};
        for (int i = 0; i < 7; i++) {
            /* Wheels take 20 ms to follow: readings that change all at once and then stay are of encoders that are stuck. One that
             * is released rolls on. */
            if (output.active[i]) {
                wheels[i] = wheels[i] + 0.05f * (output.references.rad_s[i] - wheels[i]);
            }
            input.measured.rad_s[i] = wheels[i];
            input.received[i] = !within(k, 3200, 3300) && !(i == 2 && within(k, 2000, 2200));
        }
        if (within(k, 2450, 2550)) {
            input.measured.rad_s[4] = input.measured.rad_s[4] + 5.0f;
        }
        input.lifted[6] = within(k, 2560, 2590);
        input.emergency = within(k, 2600, 3000) || k >= 4400;
        /* A motor is hot, so that nothing is asked of it forwards; later a wheel goes over an edge. */
        input.limited[0] = within(k, 1600, 1800);
        input.torque_ranges.lower_n_m[0] = -0.5f;
        input.path_factor[3] = within(k, 1850, 1900) ? 1.2f : 0.0f; /* 0: flat ground */
        if (k == 3700) {
            good = good && done(omni7_drive_release_safe_stop(&state));
        } else if (k == 3800) {
            good = good && done(omni7_drive_reset_pose(&state, 1.0f, 2.0f, 0.5f));
        }
        good = good && done(omni7_drive_step(&OMNI_DRIVE, &state, &input, &output)) && ends_torque() && as_expected(k);
        for (int i = 0; i < 7; i++) {
            hash = take(hash, output.torques.n_m[i]);
            hash = take_byte(hash, output.faults[i]);
            hash = take_byte(hash, output.excluded[i]);
            hash = take_byte(hash, output.brake[i]);
        }
        hash = take_byte(take_byte(hash, output.mode), output.motion_known);
        hash = take_pose(hash, &output.pose);
    }
    good = good && done(omni7_drive_deviations(&state, &off));
    hash = take(take(take(hash, off.x_m), off.y_m), off.yaw_rad);

    print("from C: the drive of " OMNI_VEHICLE ", hash ");
    print_number(hash);
    print(good ? "\n" : ", not as expected\n");
    finish(good);
}
