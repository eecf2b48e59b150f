/* Four computed motors with encoders instead of a board: two seconds with commands, and two without. */
#include "base.h"

enum { WHEELS = 4, PERIODS = 4000, LAST_COMMAND = 2000 };

/* A 3 N.m gear motor and what its wheel moves, as the vehicle mecanum4 has them. */
static const float STALL_N_M = 3.0f, SLOPE_N_M_S_RAD = 0.1f, INERTIA_KG_M2 = 0.038f, PERIOD_S = 0.001f;
static const float COUNTS_PER_RAD = 229.18312f; /* 1440 a turn */
static const omni_twist COMMAND = {0.5f, 0.2f, 0.4f};

static int period;
static float rad_s[WHEELS], part[WHEELS], duties[WHEELS];
static bool opened[WHEELS];
static uint16_t counters[WHEELS];

bool read_counter(int wheel, uint32_t *counter) {
    *counter = counters[wheel];
    return true;
}

bool read_command(omni_twist *command) {
    *command = COMMAND;
    return period % 20 == 0 && period < LAST_COMMAND;
}

void set_duty(int wheel, float duty) {
    duties[wheel] = duty;
    opened[wheel] = false;
}

void open_bridge(int wheel) { opened[wheel] = true; }

/* Rounded before it is added to anything: a fused multiply-add, which only some processors have, gives other bits. */
static float product(float a, float b) {
    volatile float rounded = a * b;
    return rounded;
}

static void turn(int i) {
    float torque_n_m = opened[i] ? 0.0f : product(STALL_N_M, duties[i]) - product(SLOPE_N_M_S_RAD, rad_s[i]);
    rad_s[i] += product(torque_n_m / INERTIA_KG_M2, PERIOD_S);
    part[i] += product(product(rad_s[i], PERIOD_S), COUNTS_PER_RAD);
    int whole = (int)part[i];
    part[i] -= (float)whole;
    counters[i] = (uint16_t)(counters[i] + whole);
}

/* FNV-1a over the bits of a number. */
static uint32_t take(uint32_t hash, float value) {
    union {
        float number;
        uint32_t bits;
    } both;
    both.number = value;
    for (int i = 0; i < 32; i += 8) {
        hash = (hash ^ (both.bits >> i & 0xffu)) * 0x01000193u;
    }
    return hash;
}

static bool near(float value, float wanted, float off) { return value > wanted - off && value < wanted + off; }

/* At the commanded twist before the commands end, to a fiftieth; at rest and without torque at the end. */
static bool as_expected(void) {
    const omni_twist *twist = &base_output.estimated;
    bool good = base_output.mode == OMNI_DRIVE_MODE_NORMAL;
    if (period == LAST_COMMAND - 1) {
        good = good && near(twist->vx_m_s, COMMAND.vx_m_s, 0.01f) && near(twist->vy_m_s, COMMAND.vy_m_s, 0.01f);
        good = good && near(twist->wz_rad_s, COMMAND.wz_rad_s, 0.02f);
    } else if (period == PERIODS - 1) {
        good = good && base_output.status == OMNI_COMMAND_STATUS_TIMED_OUT;
        for (int i = 0; i < WHEELS; i++) {
            good = good && near(rad_s[i], 0.0f, 0.05f) && !base_output.active[i] && base_output.torques.n_m[i] == 0.0f;
        }
    }
    return good;
}

bench_result bench_run(void) {
    bench_result result = {0x811c9dc5u, true};
    for (int i = 0; i < WHEELS; i++) {
        rad_s[i] = part[i] = duties[i] = 0.0f;
        opened[i] = false;
    }
    counters[0] = counters[2] = 65000; /* these wrap upwards */
    counters[1] = counters[3] = 500;
    base_start();
    for (period = 0; period < PERIODS; period++) {
        base_period();
        for (int i = 0; i < WHEELS; i++) {
            turn(i);
            result.hash = take(take(result.hash, duties[i]), rad_s[i]);
        }
        result.good = result.good && as_expected();
    }
    return result;
}
