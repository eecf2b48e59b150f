/* The control task of a robot with four mecanum wheels under traction control. */
#include "omnistep.h"
#include "constants.h" /* omnistep export control.toml --format c > constants.h */

/* The board: these are yours. */
bool read_counter(int wheel, uint32_t *counter);      /* of a timer in encoder mode; false where it cannot be read */
bool read_inertial(float gyro_deg_s[3], float acc_g[3]); /* x forward, y left, z up; false where nothing new came */
bool read_command(omni_twist *command);               /* m/s, m/s, rad/s; false where none came since the last period */
bool emergency_pressed(void);                         /* true for as long as it is pressed */
bool released(void);                                  /* true once the robot has been looked at and may go on */
void set_duty(int wheel, float duty);                 /* PWM and direction of a bridge: -1 to 1; 0 shorts the motor */
void open_bridge(int wheel);                          /* the wheel rolls freely */

enum { UNIT_IS_SILENT = 20 }; /* after so many periods without a new reading of the unit */

static omni4_traction_drive_state state;
static omni_encoder_state encoders[OMNI_WHEELS];
static omni_imu imu;
static int imu_age; /* periods since its last reading */
omni4_traction_drive_output output;

void at_start(void) {
    omni4_traction_drive_init(&OMNI_DRIVE, &state, &output);
    for (int i = 0; i < OMNI_WHEELS; i++) {
        omni_encoder_init(&encoders[i]);
    }
    omni_imu_init(&imu);
    imu_age = UNIT_IS_SILENT;
}

static void read_unit(omni_body_readings *bodies) {
    float gyro_deg_s[3], acc_g[3];
    imu_age++;
    if (read_inertial(gyro_deg_s, acc_g)) {
        for (int i = 0; i < 3; i++) {
            imu.rate_rad_s[i] = 0.017453293f * gyro_deg_s[i];
            imu.specific_force_m_s2[i] = 9.81f * acc_g[i];
        }
        if (omni_imu_update_angles(&imu, 1e-6f * OMNI_PERIOD_US * (float)imu_age) == OMNI_STATUS_OK) {
            imu_age = 0;
        }
    }
    bodies->imu = imu;
    bodies->imu_received = imu_age < UNIT_IS_SILENT;
    if (!bodies->imu_received) {
        omni_imu_init(&imu); /* its next reading begins anew */
        imu_age = UNIT_IS_SILENT;
    }
}

/* To be called from a timer's interrupt, every OMNI_PERIOD_US. */
void every_period(void) {
    omni4_drive_input input = {0};
    omni_body_readings bodies = {0};
    for (int i = 0; i < OMNI_WHEELS; i++) {
        uint32_t counter;
        input.received[i] = read_counter(i, &counter);
        if (input.received[i]) {
            omni_encoder_step(&OMNI_ENCODER, &encoders[i], counter, OMNI_NAN, &input.measured.rad_s[i]);
        } else {
            omni_encoder_missed(&OMNI_ENCODER, &encoders[i]); /* a period too: the next velocity is right */
        }
    }
    read_unit(&bodies);
    input.commanded = read_command(&input.command);
    input.emergency = emergency_pressed();
    if (output.drive.mode == OMNI_DRIVE_MODE_SAFE_STOP && released()) {
        omni4_traction_drive_release_safe_stop(&state);
    }
    omni4_traction_drive_step(&OMNI_DRIVE, &state, &input, &bodies, &output);
    for (int i = 0; i < OMNI_WHEELS; i++) {
        const omni4_drive_output *drive = &output.drive;
        float duty = 0.0f;
        if (drive->brake[i]) {
            set_duty(i, 0.0f);
        } else if (drive->active[i]) {
            omni_duty(&OMNI_MOTORS[i], drive->torques.n_m[i], drive->measured.rad_s[i], &duty);
            set_duty(i, duty);
        } else {
            open_bridge(i);
        }
    }
}
