/* Pose and reference pose of a vehicle: estimator, planned path, follower. Included by omnistep.hpp. */
#ifndef OMNISTEP_POSE_HPP
#define OMNISTEP_POSE_HPP

#include "omnistep_types.hpp"

namespace omnistep {

/// What an `Estimator` reads in a period. As constructed, nothing is read.
template <std::size_t Wheels>
struct EstimatorInput {
    /// Actuator velocities [rad/s]; none if no reading arrived.
    std::array<std::optional<float>, Wheels> measured_rad_s{};
    /// The inertial measurement unit of the base; none if no reading arrived.
    std::optional<Imu> imu{};
    /// The vehicle is commanded to stand.
    bool commanded_rest = false;
};

/// Pose and velocity of the vehicle, by an `Estimator`; none is ever NaN.
class Estimated {
public:
    /// Pose.
    [[nodiscard]] Pose pose() const noexcept { return detail::of_c(c_.pose); }
    /// Its standard deviations.
    [[nodiscard]] Deviations deviations() const noexcept { return detail::of_c(c_.deviations); }
    /// Velocity.
    [[nodiscard]] Twist twist() const noexcept { return detail::of_c(c_.twist); }
    /// Common slip of the wheels: their velocity less that.
    [[nodiscard]] Twist slip() const noexcept { return detail::of_c(c_.slip); }
    /// Zero of the gyro [rad/s], and its standard deviation [rad/s].
    [[nodiscard]] float gyro_bias_rad_s() const noexcept { return c_.gyro_bias_rad_s; }
    /// Its standard deviation [rad/s].
    [[nodiscard]] float gyro_bias_deviation_rad_s() const noexcept { return c_.gyro_bias_deviation_rad_s; }
    /// Covariance of the pose: x, y, yaw, in m and rad.
    [[nodiscard]] std::array<std::array<float, 3>, 3> covariance() const noexcept {
        const auto& p = c_.covariance;
        return {detail::each<3>(p[0]), detail::each<3>(p[1]), detail::each<3>(p[2])};
    }
    /// Covariance of the forward and lateral velocity [m^2/s^2].
    [[nodiscard]] std::array<std::array<float, 2>, 2> velocity_covariance() const noexcept {
        return {detail::each<2>(c_.velocity_covariance[0]), detail::each<2>(c_.velocity_covariance[1])};
    }
    /// Normalised innovation squared of the readings, summed over all `readings()`.
    [[nodiscard]] float nis() const noexcept { return c_.nis; }
    /// Number of these readings.
    [[nodiscard]] std::uint32_t readings() const noexcept { return c_.readings; }
    /// The vehicle stands.
    [[nodiscard]] bool standing() const noexcept { return c_.standing; }
    /// The step was taken; false if the state would be no number; it then stays.
    [[nodiscard]] bool taken() const noexcept { return c_.taken; }

private:
    template <std::size_t> friend class Estimator;
    omni_estimator_output c_{};
};

/// Pose and velocity from wheels, gyro and accelerometer, with wheel slip as a state.
template <std::size_t Wheels>
class Estimator {
    using C = detail::C<Wheels>;

public:
    /// `OMNI_ESTIMATOR` of constants.h, of as many wheels.
    using Constants = typename C::estimator;

    /// Ready for the first step, at the origin. Cannot fail.
    explicit Estimator(const Constants& constants) noexcept : constants_(&constants) { reset(); }
    explicit Estimator(const Constants&&) = delete; // it would be gone before the first step

    /// Starts afresh, as after construction.
    void reset() noexcept { (void)C::estimator_init(constants_, &state_, &estimated_.c_); }

    /// Takes in the readings of one control period. To be called once every OMNI_PERIOD_US.
    /// Cannot fail: a reading that is no number counts as one that did not arrive.
    [[nodiscard]] const Estimated& step(const EstimatorInput<Wheels>& input) noexcept {
        typename C::estimator_input read{};
        for (std::size_t i = 0; i < Wheels; i++) {
            read.received[i] = input.measured_rad_s[i].has_value();
            read.measured.rad_s[i] = input.measured_rad_s[i] ? *input.measured_rad_s[i] : 0.0f;
        }
        read.imu_received = input.imu.has_value();
        if (input.imu) {
            read.imu = detail::to_c(*input.imu);
        }
        read.commanded_rest = input.commanded_rest;
        (void)C::estimator_step(constants_, &state_, &read, &estimated_.c_);
        return estimated_;
    }

    /// What the last step came to; before the first the start.
    [[nodiscard]] const Estimated& estimated() const noexcept { return estimated_; }

    /// The vehicle's pose is known from outside, to `deviations`: the pose goes on from there with the next step.
    /// False, and nothing is done, where a number is not finite or a deviation is below 0.
    [[nodiscard]] bool reset_pose(const Pose& pose, const Deviations& deviations) noexcept {
        const auto known = detail::to_c(pose);
        const omni_deviations off = {deviations.x_m, deviations.y_m, deviations.yaw_rad};
        return C::estimator_reset(&state_, &known, &off) == OMNI_STATUS_OK;
    }

private:
    const Constants* constants_;
    typename C::estimator_state state_{};
    Estimated estimated_{};
};

/// Reference pose of a path at a time.
class Waypoint {
public:
    /// Time that was asked for [s].
    [[nodiscard]] float time_s() const noexcept { return c_.time_s; }
    /// Reference pose.
    [[nodiscard]] Pose pose() const noexcept { return detail::of_c(c_.pose); }
    /// Speed along the path [m/s].
    [[nodiscard]] float speed_m_s() const noexcept { return c_.speed_m_s; }
    /// The path is over.
    [[nodiscard]] bool done() const noexcept { return c_.done; }
    /// Time since then [s].
    [[nodiscard]] float over_s() const noexcept { return c_.over_s; }

private:
    friend class Trajectory;
    friend class Follower;
    omni_trajectory_sample c_{};
};

/// A planned path with its times. It has no state.
class Trajectory {
public:
    /// Of `OMNI_TRAJECTORY`, which constants.h has where the scenario's command is a path.
    explicit Trajectory(const omni_trajectory& constants) noexcept : constants_(&constants) {}
    explicit Trajectory(const omni_trajectory&&) = delete; // it would be gone before it is asked

    /// Reference pose `time_s` [s] after the start of the path. Before the start it is the start, after the end it is the end, at rest.
    [[nodiscard]] Waypoint at(float time_s) const noexcept {
        Waypoint waypoint;
        (void)omni_trajectory_at(constants_, time_s, &waypoint.c_);
        return waypoint;
    }

    /// Duration of the path [s].
    [[nodiscard]] float duration_s() const noexcept {
        float duration_s = 0.0f;
        (void)omni_trajectory_duration(constants_, &duration_s);
        return duration_s;
    }

private:
    const omni_trajectory* constants_;
};

/// Brings a vehicle to the reference pose of its path. It has no state.
class Follower {
public:
    /// Of `OMNI_FOLLOWER`.
    explicit Follower(const omni_follower& constants) noexcept : constants_(&constants) {}
    explicit Follower(const omni_follower&&) = delete; // it would be gone before the first step

    /// The command for a vehicle at `pose` [m/s, rad/s].
    [[nodiscard]] Twist step(const Waypoint& waypoint, const Pose& pose) const noexcept {
        const auto now = detail::to_c(pose);
        omni_follow_sample follow{};
        (void)omni_follow(constants_, &waypoint.c_, &now, &follow);
        return detail::of_c(follow.twist);
    }

private:
    const omni_follower* constants_;
};

} // namespace omnistep

#endif // OMNISTEP_POSE_HPP
