// The header and the C functions side by side under traction control, with an estimator and a path: every field the same in every bit,
// through slip, a climb, silent sensors, a time-out, an emergency stop. For the wheel count of constants.h.
#include <cstdio>
#include <cstring>
#include <limits>
#include <type_traits>
#include <utility>

#include <omnistep.hpp>

#include "constants.h"

namespace {

constexpr std::size_t N = OMNI_WHEELS;
constexpr float NAN_F = std::numeric_limits<float>::quiet_NaN();
#define JOINED(count, name) omni##count##_##name
#define NAMED(count, name) JOINED(count, name)
#define C(name) NAMED(OMNI_WHEELS, name) // omni7_traction_drive_step for C(traction_drive_step)

int wrong = 0;

void check(bool good, const char* what, int k) {
    if (!good && wrong++ < 5) {
        std::printf("period %d: %s\n", k, what);
    }
}
void check(omni_status status, const char* what, int k) { check(status == OMNI_STATUS_OK, what, k); }

bool same(float a, float b) { return std::memcmp(&a, &b, sizeof a) == 0; }
bool same(const omnistep::Twist& a, const omni_twist& b) {
    return same(a.vx_m_s, b.vx_m_s) && same(a.vy_m_s, b.vy_m_s) && same(a.wz_rad_s, b.wz_rad_s);
}
bool same(const omnistep::Pose& a, const omni_pose& b) { return same(a.x_m, b.x_m) && same(a.y_m, b.y_m) && same(a.yaw_rad, b.yaw_rad); }
bool same(const omnistep::Deviations& a, const omni_deviations& b) {
    return same(a.x_m, b.x_m) && same(a.y_m, b.y_m) && same(a.yaw_rad, b.yaw_rad);
}
template <typename A, typename B>
bool same(const std::array<A, N>& a, const B (&b)[N]) {
    bool good = true;
    for (std::size_t i = 0; i < N; i++) {
        good = good && same(a[i], b[i]);
    }
    return good;
}

bool within(int k, int from, int to) { return k >= from && k < to; }

void outputs(const omnistep::TractionOutput<N>& a, const C(traction_drive_output) & b, int k) {
    check(same(a.torques_n_m(), b.drive.torques.n_m) && same(a.drive().torques_n_m(), b.drive.torques.n_m), "torques", k);
    check(same(a.drive().references_rad_s(), b.drive.references.rad_s), "references", k);
    check(same(a.drive().pose(), b.drive.pose) && same(a.drive().twist(), b.drive.twist), "pose and twist", k);
    check(static_cast<int>(a.drive().mode()) == b.drive.mode && static_cast<int>(a.drive().status()) == b.drive.status, "mode and status", k);
    check(static_cast<int>(a.loops()) == b.loops && static_cast<int>(a.supervisor()) == b.supervisor, "loops and supervisor", k);
    check(a.retries() == b.retries && a.speed_wheel().has_value() == (b.speed_wheel >= 0), "retries and the wheel of the speed", k);
    check(static_cast<int>(a.speed_wheel().value_or(0)) == (b.speed_wheel < 0 ? 0 : b.speed_wheel), "the wheel of the speed", k);
    check(same(a.factor(), b.factor) && same(a.speed_m_s(), b.speed_m_s) && same(a.target_m_s(), b.target_m_s), "speeds", k);
    check(same(a.thrust_n_m(), b.thrust_n_m) && same(a.yaw_rad_s(), b.yaw_rad_s) && same(a.drift_m_s(), b.drift_m_s), "thrust and rates", k);
    check(same(a.heading_rad(), b.heading_rad) && same(a.gyro_zero_rad_s(), b.gyro_zero_rad_s), "heading", k);
    check(same(a.slip_rad_s(), b.slip_rad_s) && same(a.contact_n_m(), b.contact_n_m), "slip and contact", k);
}

void traction() {
    using omnistep::DriveMode, omnistep::TractionLoops;
    omnistep::TractionDrive<N> drive{OMNI_DRIVE};
    C(traction_drive_state) state{};
    C(traction_drive_output) output;
    C(drive_input) nothing{};
    omni_body_readings bodies_c{};
    check(C(traction_drive_step)(&OMNI_DRIVE, &state, &nothing, &bodies_c, &output) == OMNI_STATUS_NOT_READY, "taken before its init", 0);
    check(C(traction_drive_init)(&OMNI_DRIVE, &state, &output), "init", 0);
    outputs(drive.output(), output, -1);
    std::array<float, N> wheels{};
    bool modes[4] = {}, loops[3] = {}, pushed = false;
    for (int k = 0; k < 5000; k++) {
        omnistep::Input<N> input;
        C(drive_input) input_c{};
        if (k % 20 == 0 && !within(k, 1000, 1600)) {
            input.command = omnistep::Twist{0.3f, 0.0f, 0.0f};
            input_c.commanded = true;
            input_c.command = {0.3f, 0.0f, 0.0f};
        }
        for (std::size_t i = 0; i < N; i++) {
            if (output.drive.active[i]) { // wheels take 20 ms to follow; a released one rolls on
                wheels[i] += 0.05f * (output.drive.references.rad_s[i] - wheels[i]);
            }
            const float ripple = 0.01f * static_cast<float>((k + 3 * static_cast<int>(i)) % 5);
            const float slips = i == 0 && within(k, 500, 700) ? 0.02f * static_cast<float>(k - 500) : 0.0f;
            if (!(i == 2 && within(k, 2000, 2200))) { // silent
                input.measured_rad_s[i] = wheels[i] + ripple + slips;
                input_c.received[i] = true;
                input_c.measured.rad_s[i] = wheels[i] + ripple + slips;
            }
        }
        if (within(k, 300, 400)) {
            input.torque_ranges[1] = omnistep::TorqueRange{-0.05f, 0.05f};
            input_c.limited[1] = true;
            input_c.torque_ranges.lower_n_m[1] = -0.05f;
            input_c.torque_ranges.upper_n_m[1] = 0.05f;
        }
        omnistep::BodyReadings bodies;
        bodies_c = {};
        if (!within(k, 2500, 3000)) {
            bodies.hinges_received = bodies_c.hinges_received = true;
            bodies.hinges_rad[0] = bodies_c.hinges_rad[0] = within(k, 1700, 1900) ? -0.05f : 0.0f;
            bodies.hinges_rad_s[0] = bodies_c.hinges_rad_s[0] = within(k, 1700, 1720) ? -2.5f : 0.0f;
            bodies.imu = omnistep::Imu{};
            bodies.imu->rate_rad_s[2] = 0.002f;
            bodies.imu->pitch_rad = 0.02f;
            bodies_c.imu_received = true;
            bodies_c.imu = {{0.0f, 0.0f, 0.002f}, {0.0f, 0.0f, 9.81f}, 0.0f, 0.02f};
        }
        input.emergency = input_c.emergency = within(k, 3200, 4000);
        if (k == 2300) { // of three wheels each lost reading is a safe stop
            drive.release_safe_stop();
            check(C(traction_drive_release_safe_stop)(&state), "release of the safe stop", k);
        } else if (k == 4000) {
            check(drive.reset_pose({1.0f, 2.0f, 0.5f}) && !drive.reset_pose({1.0f, NAN_F, 0.5f}), "reset of the pose", k);
            check(C(traction_drive_reset_pose)(&state, 1.0f, 2.0f, 0.5f), "reset of the pose in C", k);
        }
        const auto& reported = drive.step(input, bodies);
        check(C(traction_drive_step)(&OMNI_DRIVE, &state, &input_c, &bodies_c, &output), "step", k);
        outputs(reported, output, k);
        modes[static_cast<int>(reported.drive().mode())] = true;
        loops[static_cast<int>(reported.loops())] = true;
        pushed = pushed || reported.thrust_n_m() > 0.0f;
    }
    check(modes[static_cast<int>(DriveMode::Normal)] && modes[static_cast<int>(DriveMode::EmergencyStop)], "a mode never came", 5000);
    check(loops[static_cast<int>(TractionLoops::Plain)] && pushed, "it never drove", 5000);
    check(loops[static_cast<int>(TractionLoops::Traction)] || N != 7, "slip was never controlled", 5000);
    check(drive.output().drive().mode() == DriveMode::Normal && drive.output().speed_m_s() > 0.2f, "it does not drive in the end", 5000);
    omni_deviations off;
    check(std::as_const(drive).deviations().x_m >= 0.0f, "deviations", 5000);
    check(C(traction_drive_deviations)(&state, &off), "deviations in C", 5000);
    check(same(drive.deviations(), off), "deviations differ", 5000);
    drive.reset();
    check(C(traction_drive_init)(&OMNI_DRIVE, &state, &output), "init", 5000);
    outputs(drive.output(), output, 5000);
}

void estimates(const omnistep::Estimated& a, const omni_estimator_output& b, int k) {
    check(same(a.pose(), b.pose) && same(a.deviations(), b.deviations) && same(a.twist(), b.twist), "pose, deviations and twist", k);
    check(same(a.slip(), b.slip) && same(a.gyro_bias_rad_s(), b.gyro_bias_rad_s) && same(a.nis(), b.nis), "slip, bias and nis", k);
    check(same(a.covariance()[0][1], b.covariance[0][1]) && same(a.velocity_covariance()[1][1], b.velocity_covariance[1][1]), "covariances", k);
    check(same(a.gyro_bias_deviation_rad_s(), b.gyro_bias_deviation_rad_s), "deviation of the bias", k);
    check(a.readings() == b.readings && a.standing() == b.standing && a.taken() == b.taken, "readings, standing and taken", k);
}

void path() {
    const omnistep::Trajectory trajectory{OMNI_TRAJECTORY};
    const omnistep::Follower follower{OMNI_FOLLOWER};
    omnistep::Estimator<N> estimator{OMNI_ESTIMATOR};
    omnistep::Controller<N> controller{OMNI_CONTROLLER};
    C(estimator_state) state;
    omni_estimator_output output;
    check(C(estimator_init)(&OMNI_ESTIMATOR, &state, &output), "init of the estimator", 0);
    float duration_s;
    check(omni_trajectory_duration(&OMNI_TRAJECTORY, &duration_s), "duration", 0);
    check(same(trajectory.duration_s(), duration_s) && duration_s > 2.0f, "duration differs", 0);
    std::array<float, N> wheels{};
    float furthest_m = 0.0f;
    for (int k = 0; k < 3000; k++) {
        omni_trajectory_sample sample;
        omni_follow_sample follow;
        const auto waypoint = trajectory.at(0.001f * static_cast<float>(k));
        check(omni_trajectory_at(&OMNI_TRAJECTORY, 0.001f * static_cast<float>(k), &sample), "trajectory", k);
        check(same(waypoint.pose(), sample.pose) && same(waypoint.speed_m_s(), sample.speed_m_s) && waypoint.done() == sample.done, "waypoint", k);
        const auto twist = follower.step(waypoint, estimator.estimated().pose());
        check(omni_follow(&OMNI_FOLLOWER, &sample, &output.pose, &follow), "follow", k);
        check(same(twist, follow.twist), "twist of the follower", k);
        const auto references = controller.step(twist, wheels).references_rad_s();
        omnistep::EstimatorInput<N> input;
        C(estimator_input) input_c{};
        for (std::size_t i = 0; i < N; i++) {
            wheels[i] += 0.05f * (references[i] - wheels[i]);
            if (!(i == 1 && within(k, 1000, 1200))) {
                input.measured_rad_s[i] = input_c.measured.rad_s[i] = wheels[i];
                input_c.received[i] = true;
            }
        }
        if (k % 2 == 0) {
            input.imu = omnistep::Imu{};
            input_c.imu_received = true;
            input_c.imu.specific_force_m_s2[2] = 9.81f;
        }
        if (k == 2000) {
            const omni_pose seen = {0.5f, 0.1f, 0.2f};
            const omni_deviations off = {0.01f, 0.01f, 0.02f};
            check(estimator.reset_pose({0.5f, 0.1f, 0.2f}, {0.01f, 0.01f, 0.02f}), "reset", k);
            check(!estimator.reset_pose({NAN_F, 0.1f, 0.2f}, {}) && !estimator.reset_pose({}, {-1.0f, 0.0f, 0.0f}), "a pose that is none", k);
            check(C(estimator_reset)(&state, &seen, &off), "reset in C", k);
        }
        const auto& estimated = estimator.step(input);
        check(C(estimator_step)(&OMNI_ESTIMATOR, &state, &input_c, &output), "step of the estimator", k);
        estimates(estimated, output, k);
        furthest_m = waypoint.pose().x_m > furthest_m ? waypoint.pose().x_m : furthest_m;
    }
    check(furthest_m > 0.1f, "the path leads nowhere", 3000);
}

static_assert(std::is_trivially_copyable_v<omnistep::TractionDrive<N>> && std::is_trivially_destructible_v<omnistep::TractionDrive<N>>);
static_assert(std::is_trivially_copyable_v<omnistep::Estimator<N>> && std::is_trivially_destructible_v<omnistep::Estimator<N>>);

} // namespace

int main() {
    traction();
    path();
    std::printf("%s, %zu wheels, traction control: %s\n", OMNI_VEHICLE, N, wrong == 0 ? "C++ and C agree in every bit" : "wrong");
    return wrong == 0 ? 0 : 1;
}
