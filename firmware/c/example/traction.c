/* A whole drive under traction control from C: a slipping wheel, a time-out, a climb as hinges and the inertial measurement unit see it, a
 * silent encoder, a hot motor, an emergency stop, no unit. The same steps as crates/omni-config/examples/c_traction_reference.rs, the same
 * bits. */
#include "hash.h"
#include "omnistep.h"
#include "startup.h"
#include "traction_constants.h" /* written by `omnistep export firmware/scenarios/traction.toml --format c` */

static omni7_traction_drive_state state;
static omni7_traction_drive_output output;

/* How each wheel's rolling direction points along x: wheels 2 and 6 are across. */
static const float ALONG[7] = {1.0f, 0.0f, -1.0f, 1.0f, 1.0f, 0.0f, -1.0f};

/* The vehicle on flat ground: 20 kg on wheels of 66 mm, for 1 ms. */
static float rolled(float speed_m_s) {
    float force_n = -5.0f * speed_m_s;
    for (int i = 0; i < 7; i++) {
        force_n = force_n + ALONG[i] * output.drive.torques.n_m[i] / 0.066f;
    }
    return speed_m_s + force_n * 0.00005f;
}

static int shorted(void) {
    int count = 0;
    for (int i = 0; i < 7; i++) {
        count += output.drive.brake[i];
    }
    return count;
}

static bool rests(void) {
    bool none = true;
    for (int i = 0; i < 7; i++) {
        none = none && output.drive.torques.n_m[i] == 0.0f && !output.drive.active[i];
    }
    return none;
}

/* What has to be so after period k. */
static bool as_expected(int k) {
    const omni7_drive_output *drive = &output.drive;
    switch (k) {
    case 700:
        return drive->mode == OMNI_DRIVE_MODE_NORMAL && output.speed_m_s > 0.27f && output.speed_m_s < 0.33f && output.factor > 0.9f;
    case 950: /* the first wheel is too fast: less torque than the fifth, which does the same */
        return output.loops == OMNI_TRACTION_LOOPS_TRACTION && output.slip_rad_s[0] > 1.0f && drive->torques.n_m[0] < drive->torques.n_m[4];
    case 1800: /* no command for 0.2 s */
        return drive->status == OMNI_COMMAND_STATUS_TIMED_OUT && output.target_m_s == 0.0f;
    case 3000: /* held up by a step that the front climbs */
        return output.loops == OMNI_TRACTION_LOOPS_TRACTION && output.thrust_n_m > 1.0f;
    case 3550:
        return drive->mode == OMNI_DRIVE_MODE_DEGRADED && drive->torques.n_m[3] == 0.0f && drive->torques.n_m[0] != 0.0f;
    case 3850:
        return drive->torques.n_m[4] >= -0.01f && drive->torques.n_m[4] <= 0.01f;
    case 4999: /* every torque has ended, every motor is shorted */
        return drive->mode == OMNI_DRIVE_MODE_EMERGENCY_STOP && rests() && shorted() == 7;
    case 5999: /* without the unit too */
        return drive->mode == OMNI_DRIVE_MODE_NORMAL && output.speed_m_s > 0.25f && drive->pose.x_m > 0.5f;
    default:
        return true;
    }
}

int main(void) {
    omni7_drive_input input = {0};
    omni_body_readings bodies = {0};
    omni_deviations off;
    float speed_m_s = 0.0f;
    uint32_t hash = HASH_START;
    bool good = omni7_traction_drive_step(&OMNI_DRIVE, &state, &input, &bodies, &output) == OMNI_STATUS_NOT_READY &&
                omni7_traction_drive_init(&OMNI_DRIVE, 0, &output) == OMNI_STATUS_NULL_POINTER;
    good = good && done(omni7_traction_drive_init(&OMNI_DRIVE, &state, &output));

    for (int k = 0; k < 6000; k++) {
        bool climbs = within(k, 2600, 3200);
        speed_m_s = climbs ? 0.15f : rolled(speed_m_s);
        input.commanded = k % 20 == 0 && !within(k, 1300, 2000);
        input.command = (omni_twist){0.3f, 0.0f, 0.0f};
        for (int i = 0; i < 7; i++) {
            /* A reading that never changes is of an encoder that is stuck, so these ripple. */
            input.measured.rad_s[i] = ALONG[i] * speed_m_s / 0.066f + 0.01f * (float)((k + 3 * i) % 5);
            input.received[i] = !(i == 3 && within(k, 3400, 3600));
        }
        if (within(k, 800, 1000)) { /* it slips more and more */
            input.measured.rad_s[0] = input.measured.rad_s[0] + 0.02f * (float)(k - 800);
        }
        /* The front frame goes up, then all is level. */
        bodies.hinges_received = !within(k, 5500, 6000);
        bodies.hinges_rad[0] = climbs ? -0.0002f * (float)(k - 2600) : 0.0f;
        bodies.hinges_rad_s[0] = climbs ? -0.2f : 0.0f;
        bodies.hinges_rad[1] = 0.01f;
        bodies.imu_received = bodies.hinges_received;
        bodies.imu = (omni_imu){.rate_rad_s = {0.0f, 0.0f, 0.002f}, .specific_force_m_s2 = {0.0f, 0.0f, 9.81f}, .pitch_rad = 0.02f};
        input.limited[4] = within(k, 3700, 3900); /* a hot motor */
        input.torque_ranges.lower_n_m[4] = -0.01f;
        input.torque_ranges.upper_n_m[4] = 0.01f;
        input.emergency = within(k, 4200, 5000);
        if (k == 5000) {
            good = good && done(omni7_traction_drive_reset_pose(&state, 0.5f, 0.1f, 0.0f)) &&
                   omni7_traction_drive_reset_pose(&state, OMNI_NAN, 0.0f, 0.0f) == OMNI_STATUS_NOT_FINITE;
        }
        good = good && done(omni7_traction_drive_step(&OMNI_DRIVE, &state, &input, &bodies, &output)) && as_expected(k);
        for (int i = 0; i < 7; i++) {
            hash = take(take(take(hash, output.drive.torques.n_m[i]), output.slip_rad_s[i]), output.contact_n_m[i]);
            hash = take_byte(take_byte(hash, output.drive.faults[i]), output.drive.brake[i]);
        }
        hash = take_byte(take_byte(take_byte(hash, output.drive.mode), output.loops), output.supervisor);
        hash = take_byte(hash, (uint8_t)(output.speed_wheel + 1));
        hash = take(take(take(hash, output.speed_m_s), output.target_m_s), output.thrust_n_m);
        hash = take(take(take(hash, output.yaw_rad_s), output.heading_rad), output.gyro_zero_rad_s);
        hash = take_pose(hash, &output.drive.pose);
    }
    good = good && done(omni7_traction_drive_release_safe_stop(&state)) && done(omni7_traction_drive_deviations(&state, &off));
    hash = take(take(take(hash, off.x_m), off.y_m), off.yaw_rad);

    print("from C: traction control of " OMNI_VEHICLE ", hash ");
    print_number(hash);
    print(good ? "\n" : ", not as expected\n");
    finish(good);
}
