/* Every function of the library once, with null pointers: each says no. Linked, it proves that none can panic. */
#include "omnistep.h"
#include "startup.h"

/* Those that every wheel count has. */
#define STOPS(kind)                                                                                               \
    (done(kind##_release_safe_stop(0)) || done(kind##_reset_pose(0, 0.0f, 0.0f, 0.0f)) || done(kind##_deviations(0, 0)))
#define ANY(n)                                                                                                    \
    (done(omni##n##_init(0, 0)) || done(omni##n##_step(0, 0, 0, 0, 0)) || done(omni##n##_estimate(0, 0, 0)) ||    \
     done(omni##n##_drive_init(0, 0, 0)) || done(omni##n##_drive_step(0, 0, 0, 0)) || STOPS(omni##n##_drive) ||   \
     done(omni##n##_traction_drive_init(0, 0, 0)) || done(omni##n##_traction_drive_step(0, 0, 0, 0, 0)) ||        \
     STOPS(omni##n##_traction_drive) || done(omni##n##_estimator_init(0, 0, 0)) ||                                \
     done(omni##n##_estimator_step(0, 0, 0, 0)) || done(omni##n##_estimator_reset(0, 0, 0)))

static bool done(omni_status status) { return status != OMNI_STATUS_NULL_POINTER; }

int main(void) {
    bool any = ANY(3) || ANY(4) || ANY(5) || ANY(6) || ANY(7) || ANY(8) || done(omni_limit(0, 0, 0, 0)) ||
               done(omni_encoder_init(0)) || done(omni_encoder_step(0, 0, 0, 0.0f, 0)) ||
               done(omni_encoder_step_after(0, 0, 0, 0.0f, 0.0f, 0)) || done(omni_encoder_missed(0, 0)) || done(omni_imu_init(0)) ||
               done(omni_imu_update_angles(0, 0.0f)) || done(omni_duty(0, 0.0f, 0.0f, 0)) ||
               done(omni_duty_at(0, 0.0f, 0.0f, 1.0f, 0)) || done(omni_trajectory_at(0, 0.0f, 0)) ||
               done(omni_trajectory_duration(0, 0)) || done(omni_follow(0, 0, 0, 0));
    print(any ? "a null pointer was taken\n" : "every function of the library refuses null pointers\n");
    finish(!any);
}
