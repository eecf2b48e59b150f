/* three.c on a bench: three motors with their encoders, computed, a command that stops, and an encoder whose cable breaks. The same steps
 * as firmware/src/bin/three.rs, the same bits. */
#include "omnistep.h"
#include "startup.h"

void at_start(void);
void every_period(void);
extern omni3_drive_output output;

/* A 12 V gear motor of 1 N.m and 33 rad/s, and what its wheel moves: as the vehicle omni3 has them. */
static const float STALL_N_M = 1.0f, SLOPE_N_M_S_RAD = 0.03f, INERTIA_KG_M2 = 0.013f, PERIOD_S = 0.001f;
static const float COUNTS_PER_RAD = 229.18312f; /* 1440 a turn */

enum {
    BREAKS = 2800,      /* in this period the cable of the second encoder breaks */
    PERIODS = 5500,     /* a shorted motor brakes the wheel from 17 rad/s, with 13 / 30 s */
    LAST = PERIODS - 1,
    BLEED = 500         /* periods of rest within which every torque falls to 0: control.rest.bleed_s */
};

static int period, rested; /* periods in a row with every reference at 0 */
static float rad_s[3], part[3], duties[3];
static bool opened[3], one_channel;
static uint16_t counters[3], stood;

/* A timer can always be read. Without supply or plug its counter stands; without one channel each edge of the other one counts up and down
 * again, as the shaft turns. */
bool read_counter(int wheel, uint32_t *counter) {
    *counter = counters[wheel];
    if (wheel == 1 && period >= BREAKS) {
        if (period == BREAKS) {
            stood = counters[wheel];
        }
        *counter = one_channel ? (uint16_t)(stood + counters[wheel] / 2 % 2) : stood;
    }
    return true;
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

/* Whatever the dead encoder reads: torque ends when it is said to end, and wheels with accepted readings are driven until then. */
static bool torque_ends(void) {
    const float *r = output.references.rad_s, *torque = output.torques.n_m;
    rested = r[0] == 0.0f && r[1] == 0.0f && r[2] == 0.0f ? rested + 1 : 0;
    bool driven = output.active[0] && output.active[2];
    bool none = !output.active[0] && !output.active[1] && !output.active[2] && torque[0] == 0.0f && torque[1] == 0.0f && torque[2] == 0.0f;
    return rested > BLEED ? none : driven;
}

/* What has to be so after a period: a hash alone would not say that the wheels turned. */
static bool as_expected(void) {
    bool good = torque_ends();
    for (int i = 0; i < 3; i++) {
        if (period == 1499) { /* at the command: within a hundredth of the fastest wheel's 11 rad/s */
            good = good && near(rad_s[i], output.references.rad_s[i], 0.11f) && output.mode == OMNI_DRIVE_MODE_NORMAL;
        } else if (period == 2299) { /* no command for 0.8 s: at rest */
            good = good && near(rad_s[i], 0.0f, 0.11f) && output.status == OMNI_COMMAND_STATUS_TIMED_OUT;
        } else if (period == LAST) { /* no redundancy: a safe stop, at the end of which every motor is shorted */
            good = good && near(rad_s[i], 0.0f, 0.11f) && output.mode == OMNI_DRIVE_MODE_SAFE_STOP && rested > BLEED && output.brake[i];
        }
    }
    if (period == BREAKS) {
        return good && output.faults[1] == 0;
    }
    /* The counter has stood for 0.1 s: it reads exactly 0. So it did for 0.1 s while half the motor's torque acted and others turned. */
    return good && (period != 3099 || (output.faults[1] == OMNI_FAULT_STUCK && output.brake[1]));
}

int main(void) {
    uint32_t hash = 0x811c9dc5u;
    bool good = true;
    for (int broken = 0; broken < 2; broken++) {
        one_channel = broken == 1;
        for (int i = 0; i < 3; i++) {
            rad_s[i] = part[i] = duties[i] = 0.0f;
            opened[i] = false;
        }
        counters[0] = 65000; /* wraps upwards */
        counters[1] = 500;   /* wraps downwards */
        counters[2] = 0;
        rested = 0;
        at_start();
        for (period = 0; period < PERIODS; period++) {
            every_period();
            for (int i = 0; i < 3; i++) {
                turn(i);
                hash = take(take(hash, duties[i]), rad_s[i]);
            }
            good = good && as_expected();
        }
    }
    print("three wheels: hash ");
    print_number(hash);
    print(good ? "\n" : ", not as expected\n");
    finish(good);
}
