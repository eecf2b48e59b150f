/* omnistep for C++17: omnistep.h behind types. It only forwards: numbers, bits and guarantees are those of the C functions.
 *
 * No heap, no exception, no RTTI, no thread: fit for -fno-exceptions -fno-rtti on a microcontroller. Units are SI and in the
 * names: _m, _m_s, _rad_s, _n_m (N.m), _s. The vehicle's frame is x forward, y left, yaw counter-clockwise from above; a
 * wheel turns and pulls positively in its rolling direction, wheels are in the order of the vehicle file.
 *
 * Classes are values: copied, they go on separately. Each keeps the address of its constants (`constants.h`, written by
 * `omnistep export`), which must outlive it. None locks: call all functions of an object from one thread or interrupt. */
#ifndef OMNISTEP_HPP
#define OMNISTEP_HPP

#if __cplusplus < 201703L
#error "omnistep.hpp needs C++17: compile with -std=c++17 or newer"
#else // without it, nothing below would compile

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

#include "omnistep.h"

namespace omnistep {

/// Velocity of the vehicle in its own frame. A command beyond 1e6, or one that is no number, is refused where it is taken.
struct Twist {
    float vx_m_s = 0.0f;   ///< Forward velocity [m/s], forward is +.
    float vy_m_s = 0.0f;   ///< Sideways velocity [m/s], left is +.
    float wz_rad_s = 0.0f; ///< Yaw rate [rad/s], counter-clockwise from above is +.
};

/// Where the vehicle is in the world: the frame in which it stood at the start.
struct Pose {
    float x_m = 0.0f;     ///< World x [m].
    float y_m = 0.0f;     ///< World y [m].
    float yaw_rad = 0.0f; ///< Heading [rad], 0 along world x, counter-clockwise from above is +.
};

/// How far a pose may be off: standard deviations, >= 0. All 0 where the drive was given no noise (`[drive.noise]`).
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
    EmergencyStop = OMNI_COMMAND_STATUS_EMERGENCY_STOP, ///< The emergency stop is latched: rest, or on the way there.
};

/// What is wrong with a wheel.
enum class Fault : std::uint8_t {
    Nothing = 0,                           ///< Nothing.
    NotANumber = OMNI_FAULT_NOT_A_NUMBER,  ///< Its reading is NaN, infinite, or beyond 1e6 rad/s.
    Jump = OMNI_FAULT_JUMP,                ///< Its reading jumps further in one period than a wheel can.
    Stuck = OMNI_FAULT_STUCK,              ///< Its reading never changes although it should.
    Silent = OMNI_FAULT_SILENT,            ///< No reading has arrived for too long.
    Lost = OMNI_FAULT_LOST,                ///< It has been declared lost.
};

/// Not for use: names of the C library by wheel count, and copies between its types and these.
namespace detail {

template <std::size_t Wheels> struct Names;

#define OMNISTEP_NAMES(n)                                                                       \
    template <> struct Names<n> {                                                               \
        using controller = omni##n##_controller;                                                \
        using state = omni##n##_state;                                                          \
        using sample = omni##n##_sample;                                                        \
        using velocities = omni##n##_velocities;                                                \
        using drive = omni##n##_drive;                                                          \
        using drive_state = omni##n##_drive_state;                                              \
        using drive_input = omni##n##_drive_input;                                              \
        using drive_output = omni##n##_drive_output;                                            \
        static constexpr auto init = &omni##n##_init;                                           \
        static constexpr auto step = &omni##n##_step;                                           \
        static constexpr auto estimate = &omni##n##_estimate;                                   \
        static constexpr auto drive_init = &omni##n##_drive_init;                               \
        static constexpr auto drive_step = &omni##n##_drive_step;                               \
        static constexpr auto release_safe_stop = &omni##n##_drive_release_safe_stop;           \
        static constexpr auto reset_pose = &omni##n##_drive_reset_pose;                         \
        static constexpr auto deviations = &omni##n##_drive_deviations;                         \
    }
OMNISTEP_NAMES(3);
OMNISTEP_NAMES(4);
OMNISTEP_NAMES(6);
OMNISTEP_NAMES(7);
#undef OMNISTEP_NAMES

/// Refuses other wheel counts, and stands in for them, so that this is the only error.
template <std::size_t Wheels>
struct Known {
    static constexpr bool is = Wheels == 3 || Wheels == 4 || Wheels == 6 || Wheels == 7;
    using names = Names<is ? Wheels : 7>;
    static_assert(is, "omnistep: the number of wheels has to be 3, 4, 6 or 7");
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

template <std::size_t Wheels>
[[nodiscard]] inline typename C<Wheels>::velocities to_c(const std::array<float, Wheels>& rad_s) noexcept {
    typename C<Wheels>::velocities velocities{};
    for (std::size_t i = 0; i < Wheels; i++) {
        velocities.rad_s[i] = rad_s[i];
    }
    return velocities;
}

} // namespace detail

/// Every signal of one step of a `Controller`, one value a wheel; none is ever NaN. Torques are the actuators' [N.m],
/// velocities too [rad/s].
template <std::size_t Wheels>
class Sample {
    template <typename Value> using Each = std::array<Value, Wheels>;

public:
    /// Torques to apply [N.m], always within the motors' limits.
    [[nodiscard]] Each<float> torques_n_m() const noexcept { return detail::each<Wheels>(c_.wheels.applied.n_m); }
    /// Torques that the loops ask for with the whole reference [N.m]: what would be applied had the motors no limit.
    [[nodiscard]] Each<float> requested_n_m() const noexcept { return detail::each<Wheels>(c_.wheels.requested.n_m); }
    /// Lowest torques at the present velocities [N.m], <= 0.
    [[nodiscard]] Each<float> lower_n_m() const noexcept { return detail::each<Wheels>(c_.wheels.range.lower_n_m); }
    /// Highest torques at the present velocities [N.m], >= 0.
    [[nodiscard]] Each<float> upper_n_m() const noexcept { return detail::each<Wheels>(c_.wheels.range.upper_n_m); }
    /// References as commanded [rad/s], before any reduction.
    [[nodiscard]] Each<float> references_rad_s() const noexcept { return detail::each<Wheels>(c_.wheels.reference.rad_s); }
    /// Measurements [rad/s]; 0 for a released wheel.
    [[nodiscard]] Each<float> measured_rad_s() const noexcept { return detail::each<Wheels>(c_.wheels.measured.rad_s); }
    /// Proportional terms [N.m], with the references as reduced.
    [[nodiscard]] Each<float> p_n_m() const noexcept { return detail::each<Wheels>(c_.wheels.p_n_m); }
    /// Integral terms [N.m], likewise.
    [[nodiscard]] Each<float> i_n_m() const noexcept { return detail::each<Wheels>(c_.wheels.i_n_m); }
    /// Derivative terms [N.m], likewise.
    [[nodiscard]] Each<float> d_n_m() const noexcept { return detail::each<Wheels>(c_.wheels.d_n_m); }
    /// Feed-forward [N.m], likewise.
    [[nodiscard]] Each<float> ff_n_m() const noexcept { return detail::each<Wheels>(c_.wheels.ff_n_m); }
    /// The wheel was controlled. One without a usable measurement is released: no torque, its loop starts afresh. When the torque has
    /// `ended` no wheel is controlled.
    [[nodiscard]] Each<bool> active() const noexcept { return detail::each<Wheels>(c_.wheels.active); }
    /// The requested torque is outside the limits.
    [[nodiscard]] Each<bool> saturated() const noexcept { return detail::each<Wheels>(c_.wheels.saturated); }
    /// What all torques, or all references, were multiplied by to keep the wheels in step, 0 to 1.
    [[nodiscard]] float common_factor() const noexcept { return c_.wheels.common_factor; }
    /// Every reference has been 0 for so long that all torque has ended. Bridges are then opened or shorted, because the voltage for no torque
    /// follows from a velocity that may be measured wrongly.
    [[nodiscard]] bool ended() const noexcept { return c_.wheels.ended; }
    /// And the windings of all motors are to be shorted, where the scenario asks for it (`control.rest.short_windings`).
    [[nodiscard]] bool shorted() const noexcept { return c_.wheels.shorted; }
    /// The command; rest where the one given was no number, or beyond 1e6.
    [[nodiscard]] Twist command() const noexcept { return detail::of_c(c_.command); }

private:
    template <std::size_t> friend class Controller;
    typename detail::C<Wheels>::sample c_{};
};

/// The coordination law: from a command and measured wheel velocities to torques. The bare loops, without time-out, faults
/// or odometry: those are `Drive`'s.
template <std::size_t Wheels>
class Controller {
    using C = detail::C<Wheels>;

public:
    /// `OMNI_CONTROLLER` of constants.h, of as many wheels.
    using Constants = typename C::controller;

    /// Ready for the first step. Cannot fail.
    explicit Controller(const Constants& constants) noexcept : constants_(&constants) { reset(); }
    explicit Controller(const Constants&&) = delete; // it would be gone before the first step

    /// Starts afresh, as after construction: the integrals are empty.
    void reset() noexcept { (void)C::init(&state_, &sample_.c_); }

    /// One control period: from `command` [m/s, rad/s] and `measured_rad_s` [rad/s] to `torques_n_m()` [N.m] of what it
    /// returns, which the next step overwrites. To be called once every OMNI_PERIOD_US.
    /// Cannot fail: a command that is no number, or beyond 1e6, stands for rest; such a measurement releases its wheel.
    [[nodiscard]] const Sample<Wheels>& step(const Twist& command, const std::array<float, Wheels>& measured_rad_s) noexcept {
        const auto twist = detail::to_c(command);
        const auto measured = detail::to_c<Wheels>(measured_rad_s);
        (void)C::step(constants_, &state_, &twist, &measured, &sample_.c_);
        return sample_;
    }

    /// The last step's signals; all 0 before the first.
    [[nodiscard]] const Sample<Wheels>& sample() const noexcept { return sample_; }

    /// The motion that measured wheel velocities [rad/s] amount to, by least squares.
    [[nodiscard]] Twist estimate(const std::array<float, Wheels>& measured_rad_s) const noexcept {
        const auto measured = detail::to_c<Wheels>(measured_rad_s);
        omni_twist twist{};
        (void)C::estimate(constants_, &measured, &twist);
        return detail::of_c(twist);
    }

private:
    const Constants* constants_;
    typename C::state state_{};
    Sample<Wheels> sample_{};
};

/// What arrived since the period before. As constructed, nothing did.
template <std::size_t Wheels>
struct Input {
    /// The command [m/s, rad/s]; none where none arrived. Where none does for the time-out, the vehicle is brought to rest.
    std::optional<Twist> command{};
    /// Actuator velocities [rad/s]; none where no reading arrived. A NaN is a fault of its wheel.
    std::array<std::optional<float>, Wheels> measured_rad_s{};
    /// The emergency stop is pressed: the vehicle comes to rest at the emergency deceleration, whatever is commanded, and stays there for as
    /// long as this is said. A button that springs back has to be latched before.
    bool emergency = false;
    /// The wheel is in the air: it is controlled, but says nothing of the vehicle's motion.
    std::array<bool, Wheels> lifted{};
};

/// What a step of a `Drive` reports, one value a wheel where it is of wheels; none is ever NaN.
template <std::size_t Wheels>
class Output {
    template <typename Value> using Each = std::array<Value, Wheels>;

public:
    /// Torques to apply [N.m], always within the motors' limits; 0 for a wheel that is not active.
    [[nodiscard]] Each<float> torques_n_m() const noexcept { return detail::each<Wheels>(c_.torques.n_m); }
    /// Torques that the loops asked for [N.m].
    [[nodiscard]] Each<float> requested_n_m() const noexcept { return detail::each<Wheels>(c_.requested.n_m); }
    /// References of the loops [rad/s].
    [[nodiscard]] Each<float> references_rad_s() const noexcept { return detail::each<Wheels>(c_.references.rad_s); }
    /// Velocities that the loops went by [rad/s]; 0 for a wheel that is not active.
    [[nodiscard]] Each<float> measured_rad_s() const noexcept { return detail::each<Wheels>(c_.measured.rad_s); }
    /// What the vehicle is to do: the command within all limits, of the origin.
    [[nodiscard]] Twist twist() const noexcept { return detail::of_c(c_.twist); }
    /// What the vehicle does, by its wheels; 0 unless `motion_known()`.
    [[nodiscard]] Twist estimated() const noexcept { return detail::of_c(c_.estimated); }
    /// Where the vehicle is, by its wheels.
    [[nodiscard]] Pose pose() const noexcept { return {c_.pose.x_m, c_.pose.y_m, c_.pose.yaw_rad}; }
    /// How far the vehicle can be relied on.
    [[nodiscard]] DriveMode mode() const noexcept { return static_cast<DriveMode>(c_.mode); }
    /// Why the twist is what it is.
    [[nodiscard]] CommandStatus status() const noexcept { return static_cast<CommandStatus>(c_.status); }
    /// A command arrived and was refused: it is no number, or beyond 1e6.
    [[nodiscard]] bool rejected() const noexcept { return c_.rejected; }
    /// Enough wheels determine the motion; else the pose stands still.
    [[nodiscard]] bool motion_known() const noexcept { return c_.motion_known; }
    /// What is wrong with each wheel.
    [[nodiscard]] Each<Fault> faults() const noexcept {
        Each<Fault> faults{};
        for (std::size_t i = 0; i < Wheels; i++) {
            faults[i] = static_cast<Fault>(c_.faults[i]);
        }
        return faults;
    }
    /// The wheel was controlled. One that is not has no torque, and its bridge is opened or shorted.
    [[nodiscard]] Each<bool> active() const noexcept { return detail::each<Wheels>(c_.active); }
    /// The requested torque is outside the limits.
    [[nodiscard]] Each<bool> saturated() const noexcept { return detail::each<Wheels>(c_.saturated); }
    /// The wheel is left out of the motion: faulty, lifted or slipping.
    [[nodiscard]] Each<bool> excluded() const noexcept { return detail::each<Wheels>(c_.excluded); }
    /// The motor's windings shall be shorted. In a safe stop and an emergency stop: the wheel has a fault, or all torque has ended. At rest
    /// otherwise: all torque has ended, and the scenario asks for it.
    [[nodiscard]] Each<bool> brake() const noexcept { return detail::each<Wheels>(c_.brake); }

private:
    template <std::size_t> friend class Drive;
    typename detail::C<Wheels>::drive_output c_{};
};

/// A whole vehicle: limits, time-out, the coordination law, faults, slip, odometry, safe stop and emergency stop.
template <std::size_t Wheels>
class Drive {
    using C = detail::C<Wheels>;

public:
    /// `OMNI_DRIVE` of constants.h, of as many wheels; the scenario needs a `[drive]`.
    using Constants = typename C::drive;

    /// Ready for the first step: at rest at the origin, every wheel trusted. Cannot fail.
    explicit Drive(const Constants& constants) noexcept : constants_(&constants) { reset(); }
    explicit Drive(const Constants&&) = delete; // it would be gone before the first step

    /// Starts afresh, as after construction. A safe stop is forgotten with all else.
    void reset() noexcept { (void)C::drive_init(constants_, &state_, &output_.c_); }

    /// One control period: from what arrived to `torques_n_m()` [N.m] of what it returns, which the next step overwrites.
    /// To be called once every OMNI_PERIOD_US.
    /// Cannot fail: nonsense in the input is refused, or its wheel is released.
    [[nodiscard]] const Output<Wheels>& step(const Input<Wheels>& input) noexcept {
        typename C::drive_input arrived{};
        arrived.commanded = input.command.has_value();
        arrived.emergency = input.emergency;
        if (input.command) {
            arrived.command = detail::to_c(*input.command);
        }
        for (std::size_t i = 0; i < Wheels; i++) {
            arrived.received[i] = input.measured_rad_s[i].has_value();
            arrived.measured.rad_s[i] = input.measured_rad_s[i] ? *input.measured_rad_s[i] : 0.0f;
            arrived.lifted[i] = input.lifted[i];
        }
        (void)C::drive_step(constants_, &state_, &arrived, &output_.c_);
        return output_;
    }

    /// What the last step reported; before the first all 0, in `DriveMode::Normal`.
    [[nodiscard]] const Output<Wheels>& output() const noexcept { return output_; }

    /// Ends a safe stop. Every reading is judged afresh: one whose cause lasts begins anew.
    void release_safe_stop() noexcept { (void)C::release_safe_stop(&state_); }

    /// The vehicle's pose is known from outside: the pose goes on from there. How far it may be off stays.
    /// False, and nothing is done, where a number is not finite.
    [[nodiscard]] bool reset_pose(const Pose& pose) noexcept { return C::reset_pose(&state_, pose.x_m, pose.y_m, pose.yaw_rad); }

    /// How far the pose may be off.
    [[nodiscard]] Deviations deviations() noexcept {
        omni_deviations off{};
        (void)C::deviations(&state_, &off);
        return {off.x_m, off.y_m, off.yaw_rad};
    }

private:
    const Constants* constants_;
    typename C::drive_state state_{};
    Output<Wheels> output_{};
};

/// Brings commands within the vehicle's limits, for a `Controller`; a `Drive` does it by itself.
class Limiter {
public:
    /// Of `OMNI_LIMITER`; at rest.
    explicit Limiter(const omni_limiter& constants) noexcept : constants_(&constants) {}
    explicit Limiter(const omni_limiter&&) = delete; // it would be gone before the first step

    /// What to give to the controller in this control period [m/s, rad/s].
    [[nodiscard]] Twist step(const Twist& command) noexcept {
        const auto wanted = detail::to_c(command);
        omni_twist limited{};
        (void)omni_limit(constants_, &state_, &wanted, &limited);
        return detail::of_c(limited);
    }

private:
    const omni_limiter* constants_;
    omni_limiter_state state_{};
};

/// From the counter of one wheel's encoder to its velocity.
class Encoder {
public:
    /// Of `OMNI_ENCODER`, which constants.h has where the scenario has `sensors.encoder_counts`; ready for the first reading.
    Encoder(const omni_encoder& constants) noexcept : constants_(&constants) { (void)omni_encoder_init(&state_); }
    Encoder(const omni_encoder&&) = delete; // it would be gone before the first step

    /// Takes in the counter as it stands (the lower 16 bits are used), once every control period; the velocity [rad/s], 0 at
    /// the first reading. The counter may wrap; right while the wheel turns by less than 32768 counts a period.
    /// `since_edge_s` is the time from the last edge to now [s], for encoders whose velocities come from edges; NaN: not known.
    [[nodiscard]] float step(std::uint32_t counter, float since_edge_s = std::numeric_limits<float>::quiet_NaN()) noexcept {
        float rad_s = 0.0f;
        (void)omni_encoder_step(constants_, &state_, counter, since_edge_s, &rad_s);
        return rad_s;
    }

private:
    const omni_encoder* constants_;
    omni_encoder_state state_{};
};

/// The duty, -1 to 1, of a bridge without a current loop that gives `torque_n_m` [N.m] at `velocity_rad_s` [rad/s], or the
/// nearest there is; `motor` is `OMNI_MOTORS[i]`. 0 shorts the motor, which brakes; to let a wheel go, open the bridge.
[[nodiscard]] inline float duty(const omni_motor& motor, float torque_n_m, float velocity_rad_s) noexcept {
    float part = 0.0f;
    (void)omni_duty(&motor, torque_n_m, velocity_rad_s, &part);
    return part;
}

} // namespace omnistep

#endif // C++17
#endif // OMNISTEP_HPP
