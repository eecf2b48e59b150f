/* The control task of a base with four mecanum wheels: counters of encoders in, duty cycles of bridges out. */
#include "base.h"

#include "constants.h" /* omnistep export mecanum.toml --format c > constants.h */

static omni4_drive_state state;
static omni_encoder_state encoders[OMNI_WHEELS];
omni4_drive_output base_output;

void base_start(void) {
    omni4_drive_init(&OMNI_DRIVE, &state, &base_output);
    for (int i = 0; i < OMNI_WHEELS; i++) {
        omni_encoder_init(&encoders[i]);
    }
}

void base_period(void) {
    const float no_edge_time = __builtin_nanf("");
    omni4_drive_input input = {0};
    for (int i = 0; i < OMNI_WHEELS; i++) {
        uint32_t counter;
        input.received[i] = read_counter(i, &counter);
        if (input.received[i]) {
            omni_encoder_step(&OMNI_ENCODER, &encoders[i], counter, no_edge_time, &input.measured.rad_s[i]);
        } else {
            omni_encoder_missed(&OMNI_ENCODER, &encoders[i]); /* a period too: the next velocity is right */
        }
    }
    input.commanded = read_command(&input.command);
    omni4_drive_step(&OMNI_DRIVE, &state, &input, &base_output);
    for (int i = 0; i < OMNI_WHEELS; i++) {
        float torque_n_m = base_output.torques.n_m[i], velocity_rad_s = base_output.measured.rad_s[i], duty = 0.0f;
        if (base_output.brake[i]) {
            set_duty(i, 0.0f);
        } else if (base_output.active[i] &&
                   omni_duty(&OMNI_MOTORS[i], torque_n_m, velocity_rad_s, &duty) == OMNI_STATUS_OK) {
            set_duty(i, duty);
        } else {
            open_bridge(i);
        }
    }
}
