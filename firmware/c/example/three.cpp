#include <omnistep.hpp>

#include "constants.h" // omnistep export base.toml --format c > constants.h

// The board: these are yours.
extern "C" {
bool read_counter(int wheel, std::uint32_t* counter); // of a timer in encoder mode; false where it cannot be read
bool read_command(omni_twist* command);               // m/s, m/s, rad/s; false where none came since the last period
void set_duty(int wheel, float duty);                 // PWM and direction of a bridge: -1 to 1; 0 shorts the motor, which brakes
void open_bridge(int wheel);                          // the wheel rolls freely
}

struct Base {
    omnistep::Drive<3> drive{OMNI_DRIVE};
    std::array<omnistep::Encoder, 3> encoders{OMNI_ENCODER, OMNI_ENCODER, OMNI_ENCODER};
};
static std::optional<Base> base; // empty until at_start, so that no constructor runs before main

extern "C" void at_start() { base.emplace(); }

// To be called from a timer's interrupt, every OMNI_PERIOD_US.
extern "C" void every_period() {
    omnistep::Input<3> input;
    for (int i = 0; i < 3; i++) {
        std::uint32_t counter;
        if (read_counter(i, &counter)) {
            input.measured_rad_s[i] = base->encoders[i].step(counter);
        } else {
            base->encoders[i].missed(); // a period too: the next velocity is right
        }
    }
    omni_twist arrived;
    if (read_command(&arrived)) {
        input.command = omnistep::Twist{arrived.vx_m_s, arrived.vy_m_s, arrived.wz_rad_s};
    }
    const auto& output = base->drive.step(input);
    const auto torques_n_m = output.torques_n_m();
    const auto measured_rad_s = output.measured_rad_s();
    for (int i = 0; i < 3; i++) {
        if (output.brake()[i]) {
            set_duty(i, 0.0f);
        } else if (output.active()[i]) {
            set_duty(i, omnistep::duty(OMNI_MOTORS[i], torques_n_m[i], measured_rad_s[i]));
        } else {
            open_bridge(i);
        }
    }
}
