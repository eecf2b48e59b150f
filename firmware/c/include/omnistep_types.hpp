/* Types of omnistep.hpp: twists, poses, readings, and the names of the C library by wheel count. Included by it. */
#ifndef OMNISTEP_TYPES_HPP
#define OMNISTEP_TYPES_HPP

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

#include "omnistep.h"

namespace omnistep {

/// Velocity of the vehicle in its own frame. A command beyond 1e6, or one that is no number, is rejected.
struct Twist {
    float vx_m_s = 0.0f;   ///< Forward velocity [m/s], forward is +.
    float vy_m_s = 0.0f;   ///< Lateral velocity [m/s], left is +.
    float wz_rad_s = 0.0f; ///< Yaw rate [rad/s], counter-clockwise from above is +.
};

/// Pose of the vehicle in the world frame, which is its frame at the start.
struct Pose {
    float x_m = 0.0f;     ///< World x [m].
    float y_m = 0.0f;     ///< World y [m].
    float yaw_rad = 0.0f; ///< Heading [rad], 0 along world x, counter-clockwise from above is +.
};

/// Standard deviations of a pose, >= 0. All 0 if the drive has no noise (`[drive.noise]`).
struct Deviations {
    float x_m = 0.0f;     ///< Of x [m].
    float y_m = 0.0f;     ///< Of y [m].
    float yaw_rad = 0.0f; ///< Of the heading [rad].
};

/// How far the vehicle can be relied on.
enum class DriveMode : std::uint8_t {
    Normal = OMNI_DRIVE_MODE_NORMAL,                ///< Every wheel drives, and its readings are accepted.
    Degraded = OMNI_DRIVE_MODE_DEGRADED,            ///< A wheel is released, lifted or excluded; the others go on as commanded.
    SafeStop = OMNI_DRIVE_MODE_SAFE_STOP,           ///< Too few wheels determine the motion: brought to rest. `release_safe_stop` ends it.
    EmergencyStop = OMNI_DRIVE_MODE_EMERGENCY_STOP, ///< Requested, for as long as `Input::emergency` says so.
};

/// Why the twist is what it is.
enum class CommandStatus : std::uint8_t {
    Idle = OMNI_COMMAND_STATUS_IDLE,                    ///< No command yet: rest, or on the way there.
    Following = OMNI_COMMAND_STATUS_FOLLOWING,          ///< The twist is the command.
    Limited = OMNI_COMMAND_STATUS_LIMITED,              ///< The limits keep the twist from the command.
    TimedOut = OMNI_COMMAND_STATUS_TIMED_OUT,           ///< The last command is too old: rest, or on the way there.
    EmergencyStop = OMNI_COMMAND_STATUS_EMERGENCY_STOP, ///< The emergency stop is pressed: rest, or on the way there.
};

/// What is wrong with a wheel.
enum class Fault : std::uint8_t {
    Nothing = OMNI_FAULT_NONE,             ///< Nothing.
    NotANumber = OMNI_FAULT_NOT_A_NUMBER,  ///< Its reading is NaN, infinite, or beyond 1e6 rad/s.
    Jump = OMNI_FAULT_JUMP,                ///< Its reading jumps further in one period than a wheel can.
    Stuck = OMNI_FAULT_STUCK,              ///< Its reading never changes although it should.
    Silent = OMNI_FAULT_SILENT,            ///< No reading has arrived for too long.
    Lost = OMNI_FAULT_LOST,                ///< It has been declared lost.
};

/// What drives the wheels under traction control.
enum class TractionLoops : std::uint8_t {
    Plain = OMNI_TRACTION_LOOPS_PLAIN,       ///< Every wheel's own loop: nothing slips, climbs or is held up.
    Traction = OMNI_TRACTION_LOOPS_TRACTION, ///< One thrust, slip control of each wheel.
    Fallback = OMNI_TRACTION_LOOPS_FALLBACK, ///< Every wheel's own loop, because the measured speed is implausible: until the command rests.
};

/// What the choice of the target speed is at under traction control.
enum class SupervisorMode : std::uint8_t {
    Drive = OMNI_SUPERVISOR_MODE_DRIVE,      ///< It drives as commanded.
    BackOff = OMNI_SUPERVISOR_MODE_BACK_OFF, ///< It backs off from what it is stuck at.
    RunUp = OMNI_SUPERVISOR_MODE_RUN_UP,     ///< It runs up to it.
    GaveUp = OMNI_SUPERVISOR_MODE_GAVE_UP,   ///< No try is left: it rests until the command does, or goes another way.
};

/// Torques that a motor can give [N.m].
struct TorqueRange {
    float lower_n_m = 0.0f; ///< The lowest, <= 0.
    float upper_n_m = 0.0f; ///< The highest, >= 0.
};

/// What an inertial measurement unit on the base reads, in its axes: x forward, y left, z up. As constructed: level and at rest.
struct Imu {
    std::array<float, 3> rate_rad_s{};                               ///< Rates about x, y and z [rad/s]: a gyro.
    std::array<float, 3> specific_force_m_s2 = {0.0f, 0.0f, 9.81f}; ///< Acceleration less gravity [m/s^2]: an accelerometer.
    float roll_rad = 0.0f;                                           ///< Angle of the y axis above the horizon [rad]: left side up is +.
    float pitch_rad = 0.0f;                                          ///< Angle of the x axis above the horizon [rad]: nose up is +.
};

/// Not for use: names of the C library by wheel count, and copies between its types and these.
namespace detail {

template <std::size_t Wheels> struct Names;
template <std::size_t Wheels> struct LoopsDrive;
template <std::size_t Wheels> struct TractionControlDrive;

#define OMNISTEP_NAMES(n)                                                 \
    template <> struct Names<n> {                                         \
        using controller = omni##n##_controller;                          \
        using state = omni##n##_state;                                    \
        using sample = omni##n##_sample;                                  \
        using velocities = omni##n##_velocities;                          \
        using drive_input = omni##n##_drive_input;                        \
        using drive_output = omni##n##_drive_output;                      \
        using estimator = omni##n##_estimator;                            \
        using estimator_state = omni##n##_estimator_state;                \
        using estimator_input = omni##n##_estimator_input;                \
        static constexpr auto init = &omni##n##_init;                     \
        static constexpr auto step = &omni##n##_step;                     \
        static constexpr auto estimate = &omni##n##_estimate;             \
        static constexpr auto estimator_init = &omni##n##_estimator_init; \
        static constexpr auto estimator_step = &omni##n##_estimator_step; \
        static constexpr auto estimator_reset = &omni##n##_estimator_reset; \
    };                                                                    \
    OMNISTEP_DRIVE(n, LoopsDrive, drive);                                 \
    OMNISTEP_DRIVE(n, TractionControlDrive, traction_drive)
#define OMNISTEP_DRIVE(n, type, kind)                                                              \
    template <> struct type<n> {                                                                   \
        using constants = omni##n##_##kind;                                                        \
        using state = omni##n##_##kind##_state;                                                    \
        using output = omni##n##_##kind##_output;                                                  \
        static constexpr auto init = &omni##n##_##kind##_init;                                     \
        static constexpr auto step = &omni##n##_##kind##_step;                                     \
        static constexpr auto release_safe_stop = &omni##n##_##kind##_release_safe_stop;           \
        static constexpr auto reset_pose = &omni##n##_##kind##_reset_pose;                         \
        static constexpr auto deviations = &omni##n##_##kind##_deviations;                         \
    }
OMNISTEP_NAMES(3);
OMNISTEP_NAMES(4);
OMNISTEP_NAMES(5);
OMNISTEP_NAMES(6);
OMNISTEP_NAMES(7);
OMNISTEP_NAMES(8);
#undef OMNISTEP_DRIVE
#undef OMNISTEP_NAMES

/// Rejects other wheel counts, and stands in for them, so that this is the only error.
template <std::size_t Wheels>
struct Known {
    static constexpr bool is = Wheels >= 3 && Wheels <= 8;
    static constexpr std::size_t wheels = is ? Wheels : 8;
    using names = Names<wheels>;
    static_assert(is, "omnistep: the number of wheels has to be 3 to 8");
};

template <std::size_t Wheels>
using C = typename Known<Wheels>::names;

template <std::size_t Wheels, typename Value>
[[nodiscard]] inline std::array<Value, Wheels> each(const Value* values) noexcept {
    std::array<Value, Wheels> all{};
    for (std::size_t i = 0; i < Wheels; i++) {
        all[i] = values[i];
    }
    return all;
}

[[nodiscard]] inline omni_twist to_c(const Twist& twist) noexcept { return {twist.vx_m_s, twist.vy_m_s, twist.wz_rad_s}; }
[[nodiscard]] inline Twist of_c(const omni_twist& twist) noexcept { return {twist.vx_m_s, twist.vy_m_s, twist.wz_rad_s}; }
[[nodiscard]] inline omni_pose to_c(const Pose& pose) noexcept { return {pose.x_m, pose.y_m, pose.yaw_rad}; }
[[nodiscard]] inline Pose of_c(const omni_pose& pose) noexcept { return {pose.x_m, pose.y_m, pose.yaw_rad}; }
[[nodiscard]] inline Deviations of_c(const omni_deviations& off) noexcept { return {off.x_m, off.y_m, off.yaw_rad}; }
[[nodiscard]] inline omni_imu to_c(const Imu& imu) noexcept {
    const auto &rate = imu.rate_rad_s, &force = imu.specific_force_m_s2;
    return {{rate[0], rate[1], rate[2]}, {force[0], force[1], force[2]}, imu.roll_rad, imu.pitch_rad};
}

template <std::size_t Wheels>
[[nodiscard]] inline typename C<Wheels>::velocities to_c(const std::array<float, Wheels>& rad_s) noexcept {
    typename C<Wheels>::velocities velocities{};
    for (std::size_t i = 0; i < Wheels; i++) {
        velocities.rad_s[i] = rad_s[i];
    }
    return velocities;
}

} // namespace detail

} // namespace omnistep

#endif // OMNISTEP_TYPES_HPP
