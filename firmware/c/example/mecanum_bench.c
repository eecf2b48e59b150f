/* mecanum.c on a bench: a computed robot that drives straight ahead, stands before a step for a while, and loses the wires of two encoders. */
#include "omnistep.h"
#include "startup.h"

void at_start(void);
void every_period(void);
extern omni4_traction_drive_output output;

/* Four 3 N.m gear motors, and what they move: as the vehicle mecanum4 has them. */
static const float STALL_N_M = 3.0f, SLOPE_N_M_S_RAD = 0.1f, INERTIA_KG_M2 = 0.152f, PERIOD_S = 0.001f;
static const float COUNTS_PER_RAD = 229.18312f; /* 1440 a turn */
static const float RADIUS_M = 0.076f;

/* What happens, in periods. */
enum {
    PUSHED = 500,     /* the stick is pushed from the start, let go, and pushed again 100 periods later */
    STEP = 2500,      /* the wheels stand at a step */
    CLIMBED = 4300,   /* while it pushes again */
    FIRST_CUT = 6500, /* the wires of two encoders, one after the other */
    SECOND_CUT = 8500,
    MENDED = 14000,   /* the robot has been looked at, and its stick is let go and pushed as above */
    PRESSED = 17000,  /* the emergency stop */
    PERIODS = 20000
};

static int period;
static float gained_m_s2, rad_s, part, duties[4];
static float beyond_rad; /* how far the wheels are beyond the step, while it is there */
static bool opened[4];
static uint16_t counter_now, stood[4];

static bool cut(int wheel) { return period < MENDED && ((wheel == 0 && period >= FIRST_CUT) || (wheel == 3 && period >= SECOND_CUT)); }

/* A timer can always be read; without its wire it stands. */
bool read_counter(int wheel, uint32_t *counter) {
    if (!cut(wheel)) {
        stood[wheel] = counter_now;
    }
    *counter = stood[wheel];
    return true;
}

/* A unit with 200 readings a second, on a robot that stays level. */
bool read_inertial(float gyro_deg_s[3], float acc_g[3]) {
    for (int i = 0; i < 3; i++) {
        gyro_deg_s[i] = 0.0f;
    }
    acc_g[0] = gained_m_s2 / 9.81f;
    acc_g[1] = 0.0f;
    acc_g[2] = 1.0f;
    return period % 5 == 0;
}

bool read_command(omni_twist *command) {
    int since = period < MENDED ? period : period - MENDED;
    *command = (omni_twist){since >= PUSHED && since < PUSHED + 100 ? 0.0f : 0.4f, 0.0f, 0.0f};
    return period % 20 == 0;
}

bool emergency_pressed(void) { return period >= PRESSED; }

bool released(void) { return period >= MENDED; }

void set_duty(int wheel, float duty) {
    duties[wheel] = duty;
    opened[wheel] = false;
}

void open_bridge(int wheel) { opened[wheel] = true; }

/* The robot rolls as one. Its wheels do not get over the step, but back from it. */
static void roll(void) {
    float torque_n_m = 0.0f, before_rad_s = rad_s;
    for (int i = 0; i < 4; i++) {
        torque_n_m += opened[i] ? 0.0f : STALL_N_M * duties[i] - SLOPE_N_M_S_RAD * rad_s;
    }
    rad_s += torque_n_m / INERTIA_KG_M2 * PERIOD_S;
    if (period >= STEP && period < CLIMBED) {
        beyond_rad += rad_s * PERIOD_S;
        if (beyond_rad > 0.0f) {
            rad_s = beyond_rad = 0.0f;
        }
    }
    gained_m_s2 = (rad_s - before_rad_s) / PERIOD_S * RADIUS_M;
    part += rad_s * PERIOD_S * COUNTS_PER_RAD;
    int whole = (int)part;
    part -= (float)whole;
    counter_now = (uint16_t)(counter_now + whole);
}

static bool near(float value, float wanted, float off) { return value > wanted - off && value < wanted + off; }

/* Every wheel's torque in this range. */
static bool torques(float least_n_m, float most_n_m) {
    bool good = true;
    for (int i = 0; i < 4; i++) {
        good = good && output.drive.torques.n_m[i] >= least_n_m && output.drive.torques.n_m[i] <= most_n_m;
    }
    return good;
}

static bool rests(void) {
    bool good = near(rad_s, 0.0f, 0.05f) && torques(0.0f, 0.0f);
    for (int i = 0; i < 4; i++) {
        good = good && !output.drive.active[i] && output.drive.brake[i];
    }
    return good;
}

/* What has to be so after a period. */
static bool as_expected(void) {
    const omni4_drive_output *drive = &output.drive;
    switch (period) {
    case PUSHED - 1: /* a stick that is pushed at the start moves nothing */
        return near(rad_s, 0.0f, 0.01f) && drive->mode == OMNI_DRIVE_MODE_NORMAL;
    case STEP - 1:
        return near(rad_s, drive->references.rad_s[0], 0.2f) && drive->references.rad_s[0] > 3.0f && output.speed_m_s > 0.38f;
    case STEP + 300: /* held up: the motors push with what they have */
        return torques(0.99f * STALL_N_M, STALL_N_M);
    case STEP + 900: /* back, for another try with a run-up */
        return output.supervisor == OMNI_SUPERVISOR_MODE_BACK_OFF && beyond_rad < -0.3f;
    case FIRST_CUT - 1:
        return near(rad_s, drive->references.rad_s[0], 0.2f) && drive->mode == OMNI_DRIVE_MODE_NORMAL;
    case SECOND_CUT - 1: /* the wheel without its encoder is let go, and the others drive on */
        return drive->mode == OMNI_DRIVE_MODE_DEGRADED && drive->faults[0] == OMNI_FAULT_STUCK && opened[0] && rad_s > 3.0f;
    case MENDED - 1: /* two wheels do not determine how the robot moves */
        return drive->mode == OMNI_DRIVE_MODE_SAFE_STOP && rests();
    case MENDED + PUSHED - 1: /* let go on, with the stick still pushed */
        return drive->mode == OMNI_DRIVE_MODE_NORMAL && near(rad_s, 0.0f, 0.05f);
    case PRESSED - 1:
        return drive->mode == OMNI_DRIVE_MODE_NORMAL && near(rad_s, drive->references.rad_s[0], 0.2f) && rad_s > 3.0f;
    case PERIODS - 1:
        return drive->mode == OMNI_DRIVE_MODE_EMERGENCY_STOP && rests();
    default:
        return true;
    }
}

int main(void) {
    bool good = true;
    at_start();
    for (period = 0; period < PERIODS; period++) {
        every_period();
        roll();
        if (!as_expected()) {
            print("not as expected in period ");
            print_number((uint32_t)period);
            print("\n");
            good = false;
        }
    }
    print(good ? "four mecanum wheels under traction control: as expected\n" : "");
    finish(good);
}
