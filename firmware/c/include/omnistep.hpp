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

#include "omnistep_types.hpp"

namespace omnistep {

/// Every signal of one step of a `Controller`, one value per wheel; none is ever NaN. Torques are the actuators' [N.m],
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
    /// The command [m/s, rad/s]; none if none arrived. If none does for the time-out, the vehicle is brought to rest.
    std::optional<Twist> command{};
    /// Actuator velocities [rad/s]; none if no reading arrived. A NaN is a fault of its wheel.
    std::array<std::optional<float>, Wheels> measured_rad_s{};
    /// The emergency stop is pressed: the vehicle comes to rest at the emergency deceleration, whatever is commanded, and stays there as
    /// long as this is true. The caller has to latch a momentary button.
    bool emergency = false;
    /// The wheel is in the air: it is controlled, but excluded from the vehicle's motion.
    std::array<bool, Wheels> lifted{};
    /// Torques that the motors shall keep within besides their own limits [N.m]: a hot motor, a low battery. 0 is always within.
    std::array<std::optional<TorqueRange>, Wheels> torque_ranges{};
    /// Path of each wheel over path of the body beneath it, 0.01 to 100; any other number counts as 1, flat ground.
    std::array<float, Wheels> path_factor{};
};

/// What the bodies of a vehicle under traction control are read to do. As constructed, nothing is read.
struct BodyReadings {
    /// Angle of each hinge [rad], in the order of the vehicle file; NaN where it was not read. Looked at where `hinges_received`.
    std::array<float, OMNI_MAX_HINGES> hinges_rad{};
    /// Their rates [rad/s].
    std::array<float, OMNI_MAX_HINGES> hinges_rad_s{};
    /// The hinges' readings arrived.
    bool hinges_received = false;
    /// The inertial measurement unit of the base; none if no reading arrived.
    std::optional<Imu> imu{};
    /// Height of the edge that a wheel has climbed in this period [m]; 0 if none has, or if nothing measures it.
    float climbed_m = 0.0f;
};

namespace detail {

template <std::size_t Wheels>
[[nodiscard]] inline typename C<Wheels>::drive_input to_c(const Input<Wheels>& input) noexcept {
    typename C<Wheels>::drive_input arrived{};
    arrived.commanded = input.command.has_value();
    arrived.emergency = input.emergency;
    if (input.command) {
        arrived.command = to_c(*input.command);
    }
    for (std::size_t i = 0; i < Wheels; i++) {
        arrived.received[i] = input.measured_rad_s[i].has_value();
        arrived.measured.rad_s[i] = input.measured_rad_s[i] ? *input.measured_rad_s[i] : 0.0f;
        arrived.lifted[i] = input.lifted[i];
        arrived.path_factor[i] = input.path_factor[i];
        arrived.limited[i] = input.torque_ranges[i].has_value();
        if (input.torque_ranges[i]) {
            arrived.torque_ranges.lower_n_m[i] = input.torque_ranges[i]->lower_n_m;
            arrived.torque_ranges.upper_n_m[i] = input.torque_ranges[i]->upper_n_m;
        }
    }
    return arrived;
}

[[nodiscard]] inline omni_body_readings to_c(const BodyReadings& bodies) noexcept {
    omni_body_readings read{};
    for (std::size_t i = 0; i < bodies.hinges_rad.size(); i++) {
        read.hinges_rad[i] = bodies.hinges_rad[i];
        read.hinges_rad_s[i] = bodies.hinges_rad_s[i];
    }
    read.hinges_received = bodies.hinges_received;
    read.imu_received = bodies.imu.has_value();
    if (bodies.imu) {
        read.imu = to_c(*bodies.imu);
    }
    read.climbed_m = bodies.climbed_m;
    return read;
}

} // namespace detail

/// What a step of a `Drive` reports, one value per wheel if it is of wheels; none is ever NaN.
template <std::size_t Wheels>
class Output {
    template <typename Value> using Each = std::array<Value, Wheels>;

public:
    /// Before a first step: all 0.
    Output() noexcept = default;
    /// Torques to apply [N.m], always within the motors' limits; 0 for a wheel that is not active.
    [[nodiscard]] Each<float> torques_n_m() const noexcept { return detail::each<Wheels>(c_.torques.n_m); }
    /// Torques that the loops requested [N.m].
    [[nodiscard]] Each<float> requested_n_m() const noexcept { return detail::each<Wheels>(c_.requested.n_m); }
    /// References of the loops [rad/s].
    [[nodiscard]] Each<float> references_rad_s() const noexcept { return detail::each<Wheels>(c_.references.rad_s); }
    /// Velocities that the loops used [rad/s]; 0 for a wheel that is not active.
    [[nodiscard]] Each<float> measured_rad_s() const noexcept { return detail::each<Wheels>(c_.measured.rad_s); }
    /// Command within all limits, of the origin.
    [[nodiscard]] Twist twist() const noexcept { return detail::of_c(c_.twist); }
    /// Twist of the vehicle, by its wheels; 0 unless `motion_known()`.
    [[nodiscard]] Twist estimated() const noexcept { return detail::of_c(c_.estimated); }
    /// Pose of the vehicle, by its wheels.
    [[nodiscard]] Pose pose() const noexcept { return detail::of_c(c_.pose); }
    /// How far the vehicle can be relied on.
    [[nodiscard]] DriveMode mode() const noexcept { return static_cast<DriveMode>(c_.mode); }
    /// Why the twist is what it is.
    [[nodiscard]] CommandStatus status() const noexcept { return static_cast<CommandStatus>(c_.status); }
    /// A command arrived and was rejected: it is no number, or beyond 1e6.
    [[nodiscard]] bool rejected() const noexcept { return c_.rejected; }
    /// Enough wheels determine the motion; otherwise the pose does not change.
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
    /// The wheel is excluded from the motion: faulty, lifted or slipping.
    [[nodiscard]] Each<bool> excluded() const noexcept { return detail::each<Wheels>(c_.excluded); }
    /// The motor's windings shall be shorted. In a safe stop and an emergency stop: the wheel has a fault, or all torque has ended. At rest
    /// otherwise: all torque has ended, and the scenario asks for it.
    [[nodiscard]] Each<bool> brake() const noexcept { return detail::each<Wheels>(c_.brake); }

private:
    template <std::size_t> friend class Drive;
    template <std::size_t> friend class TractionOutput;
    using C = typename detail::C<Wheels>::drive_output;
    explicit Output(const C& c) noexcept : c_(c) {}
    C c_{};
};

/// What a step of a `TractionDrive` reports; none is ever NaN.
template <std::size_t Wheels>
class TractionOutput {
    template <typename Value> using Each = std::array<Value, Wheels>;

public:
    /// What every drive reports, torques to apply among it.
    [[nodiscard]] Output<Wheels> drive() const noexcept { return Output<Wheels>(c_.drive); }
    /// Torques to apply [N.m], always within the motors' limits; 0 for a wheel that is not active.
    [[nodiscard]] Each<float> torques_n_m() const noexcept { return detail::each<Wheels>(c_.drive.torques.n_m); }
    /// What drives the wheels.
    [[nodiscard]] TractionLoops loops() const noexcept { return static_cast<TractionLoops>(c_.loops); }
    /// What the choice of the target speed is at.
    [[nodiscard]] SupervisorMode supervisor() const noexcept { return static_cast<SupervisorMode>(c_.supervisor); }
    /// Retries so far.
    [[nodiscard]] std::uint32_t retries() const noexcept { return c_.retries; }
    /// Measured speed over the commanded, -1 to 1; 1 where none is commanded.
    [[nodiscard]] float factor() const noexcept { return c_.factor; }
    /// Measured speed along the direction of travel [m/s].
    [[nodiscard]] float speed_m_s() const noexcept { return c_.speed_m_s; }
    /// The target that it follows [m/s].
    [[nodiscard]] float target_m_s() const noexcept { return c_.target_m_s; }
    /// Common thrust [N.m].
    [[nodiscard]] float thrust_n_m() const noexcept { return c_.thrust_n_m; }
    /// The wheel that the measured speed hangs on, if there is one.
    [[nodiscard]] std::optional<std::size_t> speed_wheel() const noexcept {
        return c_.speed_wheel < 0 ? std::nullopt : std::optional<std::size_t>(static_cast<std::size_t>(c_.speed_wheel));
    }
    /// Yaw rate [rad/s].
    [[nodiscard]] float yaw_rad_s() const noexcept { return c_.yaw_rad_s; }
    /// Speed across the direction of travel, to the left [m/s].
    [[nodiscard]] float drift_m_s() const noexcept { return c_.drift_m_s; }
    /// Heading error [rad], counter-clockwise positive.
    [[nodiscard]] float heading_rad() const noexcept { return c_.heading_rad; }
    /// The gyro's zero [rad/s].
    [[nodiscard]] float gyro_zero_rad_s() const noexcept { return c_.gyro_zero_rad_s; }
    /// Slip of each driven wheel along the direction of travel [rad/s]; 0 of the others.
    [[nodiscard]] Each<float> slip_rad_s() const noexcept { return detail::each<Wheels>(c_.slip_rad_s); }
    /// What the ground takes of each driven wheel's torque [N.m], by its own estimate; 0 of the others.
    [[nodiscard]] Each<float> contact_n_m() const noexcept { return detail::each<Wheels>(c_.contact_n_m); }

private:
    template <std::size_t> friend class TractionDrive;
    typename detail::TractionControlDrive<detail::Known<Wheels>::wheels>::output c_{};
};

namespace detail {

/// Stops and pose, which both kinds of drive have.
template <typename Kind>
class Stops {
public:
    /// Ends a safe stop. Every reading is judged afresh: one whose cause lasts begins anew.
    void release_safe_stop() noexcept { (void)Kind::release_safe_stop(&state_); }

    /// The vehicle's pose is known from outside: the pose goes on from there. Its deviations stay.
    /// False, and nothing is done, if a number is not finite.
    [[nodiscard]] bool reset_pose(const Pose& pose) noexcept {
        return Kind::reset_pose(&state_, pose.x_m, pose.y_m, pose.yaw_rad) == OMNI_STATUS_OK;
    }

    /// Standard deviations of the pose.
    [[nodiscard]] Deviations deviations() const noexcept {
        omni_deviations off{};
        (void)Kind::deviations(&state_, &off);
        return of_c(off);
    }

protected:
    Stops() noexcept = default;
    typename Kind::state state_{};
};

} // namespace detail

/// A whole vehicle: limits, time-out, the coordination law, faults, slip, odometry, safe stop and emergency stop.
template <std::size_t Wheels>
class Drive : public detail::Stops<detail::LoopsDrive<detail::Known<Wheels>::wheels>> {
    using C = detail::LoopsDrive<detail::Known<Wheels>::wheels>;

public:
    /// `OMNI_DRIVE` of constants.h, of as many wheels; the scenario needs a `[drive]`.
    using Constants = typename C::constants;

    /// Ready for the first step: at rest at the origin, every wheel trusted. Cannot fail.
    explicit Drive(const Constants& constants) noexcept : constants_(&constants) { reset(); }
    explicit Drive(const Constants&&) = delete; // it would be gone before the first step

    /// Starts afresh, as after construction. A safe stop is forgotten with all else.
    void reset() noexcept { (void)C::init(constants_, &this->state_, &output_.c_); }

    /// One control period: from what arrived to `torques_n_m()` [N.m] of what it returns, which the next step overwrites.
    /// To be called once every OMNI_PERIOD_US.
    /// Cannot fail: nonsense in the input is rejected, or its wheel is released.
    [[nodiscard]] const Output<Wheels>& step(const Input<Wheels>& input) noexcept {
        const auto arrived = detail::to_c(input);
        (void)C::step(constants_, &this->state_, &arrived, &output_.c_);
        return output_;
    }

    /// What the last step reported; before the first all 0, in `DriveMode::Normal`.
    [[nodiscard]] const Output<Wheels>& output() const noexcept { return output_; }

private:
    const Constants* constants_;
    Output<Wheels> output_{};
};

/// A `Drive` around traction control, of a scenario with the policy `traction` or `traction_runup`.
template <std::size_t Wheels>
class TractionDrive : public detail::Stops<detail::TractionControlDrive<detail::Known<Wheels>::wheels>> {
    using C = detail::TractionControlDrive<detail::Known<Wheels>::wheels>;

public:
    /// `OMNI_DRIVE` of constants.h, of as many wheels.
    using Constants = typename C::constants;

    /// Ready for the first step: at rest at the origin, every wheel trusted. Cannot fail.
    explicit TractionDrive(const Constants& constants) noexcept : constants_(&constants) { reset(); }
    explicit TractionDrive(const Constants&&) = delete; // it would be gone before the first step

    /// Starts afresh, as after construction. A safe stop is forgotten with all else.
    void reset() noexcept { (void)C::init(constants_, &this->state_, &output_.c_); }

    /// One control period, as `Drive::step`; `bodies` is what hinges and inertial measurement unit read.
    [[nodiscard]] const TractionOutput<Wheels>& step(const Input<Wheels>& input, const BodyReadings& bodies) noexcept {
        const auto arrived = detail::to_c(input);
        const auto read = detail::to_c(bodies);
        (void)C::step(constants_, &this->state_, &arrived, &read, &output_.c_);
        return output_;
    }

    /// What the last step reported; before the first all 0, in `DriveMode::Normal`.
    [[nodiscard]] const TractionOutput<Wheels>& output() const noexcept { return output_; }

private:
    const Constants* constants_;
    TractionOutput<Wheels> output_{};
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
    /// the first reading. The counter may wrap; right while the wheel turns by less than 32768 counts per period.
    /// `since_edge_s` is the time from the last edge to now [s], for encoders whose velocities come from edges; NaN: not known.
    [[nodiscard]] float step(std::uint32_t counter, float since_edge_s = std::numeric_limits<float>::quiet_NaN()) noexcept {
        float rad_s = 0.0f;
        (void)omni_encoder_step(constants_, &state_, counter, since_edge_s, &rad_s);
        return rad_s;
    }

    /// The same for a counter that was read `since_reading_s` [s] after the last time, where that was measured.
    [[nodiscard]] float step_after(std::uint32_t counter, float since_reading_s,
                                   float since_edge_s = std::numeric_limits<float>::quiet_NaN()) noexcept {
        float rad_s = 0.0f;
        (void)omni_encoder_step_after(constants_, &state_, counter, since_reading_s, since_edge_s, &rad_s);
        return rad_s;
    }

    /// A period in which the counter could not be read, instead of `step`: the next reading is right about the time.
    void missed() noexcept { (void)omni_encoder_missed(constants_, &state_); }

private:
    const omni_encoder* constants_;
    omni_encoder_state state_{};
};

/// Pitch and roll of an inertial measurement unit that computes no angles itself.
class Attitude {
public:
    /// Ready for the first reading.
    Attitude() noexcept { (void)omni_imu_init(&imu_); }

    /// Takes in what gyro and accelerometer read `since_reading_s` [s] after the last time: the readings for a drive or an
    /// estimator. None if one is no number, or the first force is far from 1 g: the unit then counts as not read.
    [[nodiscard]] std::optional<Imu> step(const std::array<float, 3>& rate_rad_s, const std::array<float, 3>& specific_force_m_s2,
                                          float since_reading_s) noexcept {
        for (std::size_t i = 0; i < 3; i++) {
            imu_.rate_rad_s[i] = rate_rad_s[i];
            imu_.specific_force_m_s2[i] = specific_force_m_s2[i];
        }
        if (omni_imu_update_angles(&imu_, since_reading_s) != OMNI_STATUS_OK) {
            return std::nullopt;
        }
        return Imu{rate_rad_s, specific_force_m_s2, imu_.roll_rad, imu_.pitch_rad};
    }

private:
    omni_imu imu_{};
};

/// The duty, -1 to 1, of a bridge without a current loop that gives `torque_n_m` [N.m] at `velocity_rad_s` [rad/s], or the
/// nearest there is; `motor` is `OMNI_MOTORS[i]`. 0 shorts the motor, which brakes; to let a wheel go, open the bridge.
[[nodiscard]] inline float duty(const omni_motor& motor, float torque_n_m, float velocity_rad_s) noexcept {
    float part = 0.0f;
    (void)omni_duty(&motor, torque_n_m, velocity_rad_s, &part);
    return part;
}

/// `duty` where the supply has `supply_part` > 0 of the voltage that `motor` is of: a battery that runs down. 0 for a part that is not
/// above 0.
[[nodiscard]] inline float duty_at(const omni_motor& motor, float torque_n_m, float velocity_rad_s, float supply_part) noexcept {
    float part = 0.0f;
    (void)omni_duty_at(&motor, torque_n_m, velocity_rad_s, supply_part, &part);
    return part;
}

} // namespace omnistep

#include "omnistep_pose.hpp"

#endif // C++17
#endif // OMNISTEP_HPP
