/* The seven-wheel controller from C: the same steps as crates/omni-config/examples/c_reference.rs, the same bits.
 *
 * No C library: start-up code and the console (semihosting) are in startup.c. */
#include "constants.h" /* written by `omnistep export step --format c` */
#include "hash.h"
#include "omnistep.h"
#include "startup.h"

static omni7_state state;
static omni_limiter_state limited;
static omni7_sample sample;

int main(void) {
    omni7_velocities measured = {{0}};
    omni_twist command = {1.3f, 0.1f, 0.2f}, twist, estimate; /* faster than allowed */
    uint32_t hash = HASH_START;
    bool good = done(omni7_init(&state, &sample)) && omni7_init(0, &sample) == OMNI_STATUS_NULL_POINTER;

    for (int k = 0; k < 1000; k++) {
        /* Wheel 1 is held back for a while, so that the coordination has something to do. */
        for (int i = 0; i < 7; i++) {
            float part = (i == 0 && k >= 300 && k < 600) ? 0.25f : 0.75f;
            measured.rad_s[i] = part * sample.wheels.reference.rad_s[i];
        }
        good = good && done(omni_limit(&OMNI_LIMITER, &limited, &command, &twist));
        good = good && done(omni7_step(&OMNI_CONTROLLER, &state, &twist, &measured, &sample));
        for (int i = 0; i < 7; i++) {
            hash = take(hash, sample.wheels.applied.n_m[i]);
        }
    }
    good = good && done(omni7_estimate(&OMNI_CONTROLLER, &measured, &estimate));
    hash = take_twist(hash, &estimate);

    print("from C: " OMNI_VEHICLE ", " OMNI_POLICY ", hash ");
    print_number(hash);
    print(good ? "\n" : ", a call failed\n");
    finish(good);
}
