/* What a step of a drive with traction control costs from C. The vehicle is that of constants.h. */
#include "constants.h" /* written by `omnistep export firmware/scenarios/traction.toml --format c`, for any vehicle */
#include "count.h"
#include "hash.h"
#include "named.h"

static C(traction_drive_state) state;
static C(traction_drive_output) output;

static bool measure(const char *which, float more_rad_s) {
    C(drive_input) input = {0};
    omni_body_readings bodies = {.hinges_received = true, .imu_received = true};
    uint32_t most = 0;
    bool good = done(C(traction_drive_init)(&OMNI_DRIVE, &state, &output));
    bodies.imu.specific_force_m_s2[2] = 9.81f;
    for (int k = 0; k < 800; k++) {
        for (int i = 0; i < OMNI_WHEELS; i++) {
            input.measured.rad_s[i] = output.drive.references.rad_s[i] + 0.01f * (float)((k + 3 * i) % 5);
            input.received[i] = true;
        }
        /* It slips more and more, so that the reading is no jump. */
        input.measured.rad_s[0] = input.measured.rad_s[0] + more_rad_s * 0.00125f * (float)k;
        input.commanded = true;
        input.command = (omni_twist){0.3f, 0.0f, 0.0f};
        uint32_t before = SYSTICK[2];
        good = good && done(C(traction_drive_step)(&OMNI_DRIVE, &state, &input, &bodies, &output));
        uint32_t cost = instructions_since(before);
        most = cost > most ? cost : most;
    }
    say("drive with traction control, ", which, most);
    return good;
}

int main(void) {
    start_counting();
    finish(measure("free", 0.0f) && measure("slipping", 3.0f));
}
