/* three.c on a bench: three motors with their encoders, computed, and a command that stops. The same steps as firmware/src/bin/three.rs,
 * the same bits. */
#include "omnistep.h"
#include "startup.h"

void at_start(void);
void every_period(void);
extern omni3_drive_output output;

/* A 12 V gear motor of 1 N.m and 33 rad/s, and what its wheel moves: as the vehicle omni3 has them. */
static const float STALL_N_M = 1.0f, SLOPE_N_M_S_RAD = 0.03f, INERTIA_KG_M2 = 0.013f, PERIOD_S = 0.001f;
static const float COUNTS_PER_RAD = 229.18312f; /* 1440 a turn */

static int period;
static float rad_s[3], part[3], duties[3];
static bool opened[3];
static uint16_t counters[3] = {65000, 500, 0}; /* the first wraps upwards, the second downwards */

bool read_counter(int wheel, uint32_t *counter) {
    *counter = counters[wheel];
    return !(wheel == 1 && period >= 2800); /* its cable breaks */
}

bool read_command(omni_twist *command) {
    *command = (omni_twist){0.4f, 0.2f, 0.5f};
    return period % 20 == 0 && (period < 1500 || period >= 2300);
}

void set_duty(int wheel, float duty) {
    duties[wheel] = duty;
    opened[wheel] = false;
}

void open_bridge(int wheel) { opened[wheel] = true; }

static void turn(int i) {
    float torque = opened[i] ? 0.0f : STALL_N_M * duties[i] - SLOPE_N_M_S_RAD * rad_s[i];
    rad_s[i] = rad_s[i] + torque / INERTIA_KG_M2 * PERIOD_S;
    part[i] = part[i] + rad_s[i] * PERIOD_S * COUNTS_PER_RAD;
    int whole = (int)part[i];
    part[i] = part[i] - (float)whole;
    counters[i] = (uint16_t)(counters[i] + whole);
}

/* FNV-1a over the bits of a number. */
static uint32_t take(uint32_t hash, float value) {
    union {
        float number;
        uint8_t bytes[4];
    } bits = {.number = value};
    for (int i = 0; i < 4; i++) {
        hash = (hash ^ bits.bytes[i]) * 0x01000193u;
    }
    return hash;
}

static bool near(float value, float wanted, float off) { return value > wanted - off && value < wanted + off; }

/* What has to be so after a period: a hash alone would not say that the wheels turned. */
static bool as_expected(void) {
    bool good = true;
    for (int i = 0; i < 3; i++) {
        if (period == 1499) { /* at the command: within a hundredth of the fastest wheel's 11 rad/s */
            good = good && near(rad_s[i], output.references.rad_s[i], 0.11f) && output.mode == OMNI_DRIVE_MODE_NORMAL;
        } else if (period == 2299) { /* no command for 0.8 s: at rest */
            good = good && near(rad_s[i], 0.0f, 0.11f) && output.status == OMNI_COMMAND_STATUS_TIMED_OUT;
        } else if (period == 4999) { /* no redundancy: a safe stop; the blind one is braked by its shorted motor alone, with 13 / 30 s */
            good = good && near(rad_s[i], 0.0f, 0.11f) && output.mode == OMNI_DRIVE_MODE_SAFE_STOP;
        }
    }
    return good && (period != 2999 || output.brake[1]);
}

int main(void) {
    uint32_t hash = 0x811c9dc5u;
    bool good = true;
    at_start();
    for (period = 0; period < 5000; period++) {
        every_period();
        for (int i = 0; i < 3; i++) {
            turn(i);
            hash = take(take(hash, duties[i]), rad_s[i]);
        }
        good = good && as_expected();
    }
    print("three wheels: hash ");
    print_number(hash);
    print(good ? "\n" : ", not as expected\n");
    finish(good);
}
