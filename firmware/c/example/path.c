/* A path followed from C, by the pose that an estimator finds from wheels and an inertial measurement unit. The same steps as
 * firmware/src/bin/follow.rs, the same bits. */
#include "hash.h"
#include "omnistep.h"
#include "path_constants.h" /* written by `omnistep export figure_eight --format c` */
#include "startup.h"

static omni4_state state;
static omni4_sample sample;
static omni4_estimator_state estimating;
static omni_estimator_output estimated;

int main(void) {
    omni4_estimator_input input = {0};
    omni_trajectory_sample on_the_way;
    omni_follow_sample follow;
    omni4_velocities wheels = {{0}};
    omni_twist moves = {0.0f, 0.0f, 0.0f}, moved;
    uint32_t hash = HASH_START;
    float duration_s = 0.0f;
    bool good = omni4_estimator_step(&OMNI_ESTIMATOR, &estimating, &input, &estimated) == OMNI_STATUS_NOT_READY;
    good = good && done(omni4_init(&state, &sample)) && done(omni_trajectory_duration(&OMNI_TRAJECTORY, &duration_s));
    good = good && done(omni4_estimator_init(&OMNI_ESTIMATOR, &estimating, &estimated));

    int end = (int)(duration_s * 1000.0f);
    for (int k = 0; k < end + 1000; k++) {
        good = good && done(omni_trajectory_at(&OMNI_TRAJECTORY, (float)k * 0.001f, &on_the_way));
        good = good && done(omni_follow(&OMNI_FOLLOWER, &on_the_way, &estimated.pose, &follow));
        good = good && done(omni4_step(&OMNI_CONTROLLER, &state, &follow.twist, &wheels, &sample));
        for (int i = 0; i < 4; i++) {
            /* Wheels take 20 ms to follow. */
            wheels.rad_s[i] = wheels.rad_s[i] + 0.05f * (sample.wheels.reference.rad_s[i] - wheels.rad_s[i]);
            input.measured.rad_s[i] = wheels.rad_s[i];
            input.received[i] = !(i == 2 && within(k, 3000, 3400));
        }
        if (within(k, 5000, 5200)) {
            input.measured.rad_s[1] = input.measured.rad_s[1] + 4.0f; /* it slips */
        }
        input.imu_received = !within(k, 7000, 7500);
        moved = moves;
        good = good && done(omni4_estimate(&OMNI_CONTROLLER, &wheels, &moves));
        input.imu.rate_rad_s[2] = moves.wz_rad_s;
        input.imu.specific_force_m_s2[0] = (moves.vx_m_s - moved.vx_m_s) * 1000.0f - moves.wz_rad_s * moves.vy_m_s;
        input.imu.specific_force_m_s2[1] = (moves.vy_m_s - moved.vy_m_s) * 1000.0f + moves.wz_rad_s * moves.vx_m_s;
        input.imu.specific_force_m_s2[2] = 9.81f;
        input.commanded_rest = on_the_way.done;
        if (k == 9000) { /* a camera sees it 1 cm ahead */
            omni_pose seen = {estimated.pose.x_m + 0.01f, estimated.pose.y_m, estimated.pose.yaw_rad};
            omni_deviations off = {0.005f, 0.005f, 0.01f}, wrong = {-1.0f, 0.0f, 0.0f};
            good = good && done(omni4_estimator_reset(&estimating, &seen, &off));
            good = good && omni4_estimator_reset(&estimating, &seen, &wrong) == OMNI_STATUS_NOT_FINITE;
        }
        good = good && done(omni4_estimator_step(&OMNI_ESTIMATOR, &estimating, &input, &estimated)) && estimated.taken;
        hash = take_twist(hash, &follow.twist);
        hash = take_pose(take_pose(hash, &estimated.pose), &on_the_way.pose);
        hash = take_twist(take_twist(hash, &estimated.twist), &estimated.slip);
        hash = take(take(hash, estimated.gyro_bias_rad_s), estimated.nis);
        hash = take_byte(take_byte(hash, (uint8_t)estimated.readings), estimated.standing);
    }
    /* Back at the start, to what the wheels' lag and the slip leave. */
    good = good && on_the_way.done && estimated.standing;
    good = good && follow.error_m[0] < 0.02f && follow.error_m[0] > -0.02f && follow.error_m[1] < 0.02f && follow.error_m[1] > -0.02f;
    hash = take(take(take(hash, estimated.deviations.x_m), estimated.deviations.y_m), estimated.deviations.yaw_rad);

    print("the path of " OMNI_VEHICLE ", hash ");
    print_number(hash);
    print(good ? "\n" : ", not as expected\n");
    finish(good);
}
