/* Every function of the library once, with null pointers: each says no. Linked, it proves that none can panic. */
#include "omnistep.h"
#include "startup.h"

/* Those that every wheel count has. */
#define ANY(n)                                                                                                    \
    (omni##n##_init(0, 0) || omni##n##_step(0, 0, 0, 0, 0) || omni##n##_estimate(0, 0, 0) ||                      \
     omni##n##_drive_init(0, 0, 0) || omni##n##_drive_step(0, 0, 0, 0) || omni##n##_drive_release_safe_stop(0) || \
     omni##n##_drive_reset_pose(0, 0.0f, 0.0f, 0.0f) || omni##n##_drive_deviations(0, 0))

int main(void) {
    bool any = ANY(3) || ANY(4) || ANY(6) || ANY(7) || omni_limit(0, 0, 0, 0) || omni_encoder_init(0) ||
               omni_encoder_step(0, 0, 0, 0.0f, 0) || omni_duty(0, 0.0f, 0.0f, 0);
    print(any ? "a null pointer was taken\n" : "every function of the library refuses null pointers\n");
    finish(!any);
}
