#include "omnistep.h"
#include "constants.h" /* omnistep export base.toml --format c > constants.h */

/* The board: these are yours. */
bool read_counter(int wheel, uint32_t *counter); /* of a timer in encoder mode; false where it cannot be read */
bool read_command(omni_twist *command);          /* m/s, m/s, rad/s; false where none came since the last period */
void set_duty(int wheel, float duty);            /* PWM and direction of a bridge: -1 to 1; 0 shorts the motor, which brakes */
void open_bridge(int wheel);                     /* the wheel rolls freely */

static omni3_drive_state state;
static omni_encoder_state encoders[OMNI_WHEELS];
omni3_drive_output output;

void at_start(void) {
    omni3_drive_init(&OMNI_DRIVE, &state, &output);
    for (int i = 0; i < OMNI_WHEELS; i++) {
        omni_encoder_init(&encoders[i]);
    }
}

/* To be called from a timer's interrupt, every OMNI_PERIOD_US. */
void every_period(void) {
    omni3_drive_input input = {0};
    for (int i = 0; i < OMNI_WHEELS; i++) {
        uint32_t counter;
        input.received[i] = read_counter(i, &counter);
        if (input.received[i]) {
            omni_encoder_step(&OMNI_ENCODER, &encoders[i], counter, OMNI_NAN, &input.measured.rad_s[i]);
        } else {
            omni_encoder_missed(&OMNI_ENCODER, &encoders[i]); /* a period too: the next velocity is right */
        }
    }
    input.commanded = read_command(&input.command);
    omni3_drive_step(&OMNI_DRIVE, &state, &input, &output);
    for (int i = 0; i < OMNI_WHEELS; i++) {
        float duty = 0.0f;
        if (output.brake[i]) {
            set_duty(i, 0.0f);
        } else if (output.active[i]) {
            omni_duty(&OMNI_MOTORS[i], output.torques.n_m[i], output.measured.rad_s[i], &duty);
            set_duty(i, duty);
        } else {
            open_bridge(i);
        }
    }
}
