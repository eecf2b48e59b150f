#pragma once
#include <algorithm>
#include <omnistep.hpp>
#include <utility>

#include "constants.h" // of base.toml

/// What a controller of ros2_control does in update(), without ROS: velocities in, efforts out.
class BaseController {
public:
    // In the order of the vehicle file; a velocity that was not read in this period is none.
    using Velocities = std::array<std::optional<double>, OMNI_WHEELS>;
    using Efforts = std::array<double, OMNI_WHEELS>;

    /// A command arrived: forward, to the left [m/s], counter-clockwise [rad/s].
    void command(double x, double y, double yaw) {
        arrived = omnistep::Twist{float(x), float(y), float(yaw)};
    }

    /// Every OMNI_PERIOD_US: from velocities [rad/s] to efforts [N.m].
    Efforts update(const Velocities& velocities) {
        omnistep::Input<OMNI_WHEELS> input;
        input.emergency = emergency;
        input.command = std::exchange(arrived, std::nullopt); // the drive knows how old the last one is
        for (std::size_t i = 0; i < OMNI_WHEELS; i++) {
            if (velocities[i]) {
                input.measured_rad_s[i] = float(*velocities[i]);
            }
        }
        const auto torques_n_m = drive.step(input).torques_n_m();
        Efforts efforts{};
        std::copy(torques_n_m.begin(), torques_n_m.end(), efforts.begin());
        return efforts;
    }

    omnistep::Drive<OMNI_WHEELS> drive{OMNI_DRIVE};
    bool emergency = false; ///< the emergency stop is pressed

private:
    std::optional<omnistep::Twist> arrived;
};
