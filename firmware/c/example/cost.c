/* What the steps of loops and drive cost from C, whose constants the library's compiler does not know. The vehicle is that of constants.h. */
#include "constants.h" /* written by `omnistep export` of a scenario with a [drive] of defaults */
#include "count.h"
#include "hash.h"
#include "named.h"

static C(state) state;
static C(sample) sample;
static omni_limiter_state limited;
static C(drive_state) drive_state;
static C(drive_output) output;

/* The most of 400 periods in which the wheels read `part` of what they are asked for. */
static bool measure(const char *which, float part) {
    C(velocities) measured = {{0}};
    C(drive_input) input = {0};
    omni_twist command = {0.3f, 0.1f, 0.2f}, twist;
    uint32_t loops = 0, drive = 0;
    bool good = done(C(init)(&state, &sample)) && done(C(drive_init)(&OMNI_DRIVE, &drive_state, &output));
    limited = (omni_limiter_state){0};
    for (int k = 0; k < 400; k++) {
        for (int i = 0; i < OMNI_WHEELS; i++) {
            measured.rad_s[i] = part * sample.wheels.reference.rad_s[i];
            input.measured.rad_s[i] = part * output.references.rad_s[i];
            input.received[i] = true;
        }
        input.commanded = true;
        input.command = command;
        uint32_t before = SYSTICK[2];
        good = good && done(omni_limit(&OMNI_LIMITER, &limited, &command, &twist));
        good = good && done(C(step)(&OMNI_CONTROLLER, &state, &twist, &measured, &sample));
        uint32_t cost = instructions_since(before);
        loops = cost > loops ? cost : loops;
        before = SYSTICK[2];
        good = good && done(C(drive_step)(&OMNI_DRIVE, &drive_state, &input, &output));
        cost = instructions_since(before);
        drive = cost > drive ? cost : drive;
    }
    say("step, ", which, loops);
    say("drive, ", which, drive);
    return good;
}

int main(void) {
    start_counting();
    finish(measure("free", 1.0f) && measure("saturated", 0.3f));
}
