/* The seven-wheel controller from C: the same steps as crates/omni-config/examples/c_reference.rs, the same bits.
 *
 * No C library: start-up code and the console (semihosting) are in startup.c. */
#include "constants.h" /* written by `omnistep export step --format c` */
#include "omnistep.h"
#include "startup.h"

static omni7_state state;
static omni_limiter_state limited;
static omni7_sample sample;

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

int main(void) {
    omni7_velocities measured = {{0}};
    omni_twist command = {1.3f, 0.1f, 0.2f}, twist, estimate; /* faster than allowed */
    uint32_t hash = 0x811c9dc5u;
    bool good = omni7_init(&state, &sample) && !omni7_init(0, &sample);

    for (int k = 0; k < 1000; k++) {
        /* Wheel 1 is held back for a while, so that the coordination has something to do. */
        for (int i = 0; i < 7; i++) {
            float part = (i == 0 && k >= 300 && k < 600) ? 0.25f : 0.75f;
            measured.rad_s[i] = part * sample.wheels.reference.rad_s[i];
        }
        good = good && omni_limit(&OMNI_LIMITER, &limited, &command, &twist);
        good = good && omni7_step(&OMNI_CONTROLLER, &state, &twist, &measured, &sample);
        for (int i = 0; i < 7; i++) {
            hash = take(hash, sample.wheels.applied.n_m[i]);
        }
    }
    good = good && omni7_estimate(&OMNI_CONTROLLER, &measured, &estimate);
    hash = take(take(take(hash, estimate.vx_m_s), estimate.vy_m_s), estimate.wz_rad_s);

    print("from C: " OMNI_VEHICLE ", " OMNI_POLICY ", hash ");
    print_number(hash);
    print(good ? "\n" : ", a call failed\n");
    finish(good);
}
