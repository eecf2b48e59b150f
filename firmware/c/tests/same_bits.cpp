// The header and the C functions side by side, period by period: every field the same in every bit, through saturation, lost
// and broken readings, slip, a lifted wheel, a time-out, an emergency stop, a safe stop. For the wheel count of constants.h.
#include <cstdio>
#include <cstring>
#include <limits>
#include <type_traits>

#include <omnistep.hpp>

#include "constants.h"

namespace {

constexpr std::size_t N = OMNI_WHEELS;
constexpr float NAN_F = std::numeric_limits<float>::quiet_NaN();
#define JOINED(count, name) omni##count##_##name
#define NAMED(count, name) JOINED(count, name)
#define C(name) NAMED(OMNI_WHEELS, name) // omni7_step for C(step)

int wrong = 0;

void check(bool good, const char* what, int k) {
    if (!good && wrong++ < 5) {
        std::printf("period %d: %s\n", k, what);
    }
}

void check(omni_status status, const char* what, int k) { check(status == OMNI_STATUS_OK, what, k); }

bool same(float a, float b) { return std::memcmp(&a, &b, sizeof a) == 0; }
bool same(bool a, bool b) { return a == b; }
bool same(omnistep::Fault a, omni_fault b) { return static_cast<int>(a) == b; }
bool same(const omnistep::Twist& a, const omni_twist& b) {
    return same(a.vx_m_s, b.vx_m_s) && same(a.vy_m_s, b.vy_m_s) && same(a.wz_rad_s, b.wz_rad_s);
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

void samples(const omnistep::Sample<N>& a, const C(sample) & b, int k) {
    check(same(a.torques_n_m(), b.wheels.applied.n_m), "torques", k);
    check(same(a.requested_n_m(), b.wheels.requested.n_m), "requested", k);
    check(same(a.lower_n_m(), b.wheels.range.lower_n_m), "lower", k);
    check(same(a.upper_n_m(), b.wheels.range.upper_n_m), "upper", k);
    check(same(a.references_rad_s(), b.wheels.reference.rad_s), "references", k);
    check(same(a.measured_rad_s(), b.wheels.measured.rad_s), "measured", k);
    check(same(a.p_n_m(), b.wheels.p_n_m), "p", k);
    check(same(a.i_n_m(), b.wheels.i_n_m), "i", k);
    check(same(a.d_n_m(), b.wheels.d_n_m), "d", k);
    check(same(a.ff_n_m(), b.wheels.ff_n_m), "ff", k);
    check(same(a.active(), b.wheels.active), "active", k);
    check(same(a.saturated(), b.wheels.saturated), "saturated", k);
    check(same(a.common_factor(), b.wheels.common_factor), "common factor", k);
    check(same(a.command(), b.command), "command of the sample", k);
}

void loops() {
    omnistep::Limiter limiter{OMNI_LIMITER};
    omnistep::Controller<N> controller{OMNI_CONTROLLER};
    auto copy = controller;
    omni_limiter_state limiter_state{};
    C(state) state;
    C(sample) sample;
    check(C(init)(&state, &sample), "init", 0);
    bool saturated = false, reduced = false, released = false;
    for (int k = 0; k < 3000; k++) {
        const omnistep::Twist wanted{k == 2500 ? NAN_F : 1.3f, 0.1f, k < 1500 ? 0.2f : -0.2f};
        const omni_twist wanted_c = {wanted.vx_m_s, wanted.vy_m_s, wanted.wz_rad_s};
        std::array<float, N> measured{};
        C(velocities) measured_c{};
        for (std::size_t i = 0; i < N; i++) {
            const float part = i == 0 && within(k, 300, 900) ? 0.0f : 0.75f; // wheel 1 is held
            measured[i] = i == N - 1 && within(k, 1000, 1100) ? NAN_F : part * sample.wheels.reference.rad_s[i];
            measured_c.rad_s[i] = measured[i];
        }
        const auto limited = limiter.step(wanted);
        omni_twist limited_c;
        check(omni_limit(&OMNI_LIMITER, &limiter_state, &wanted_c, &limited_c), "limit", k);
        check(same(limited, limited_c), "limited", k);
        if (k == 2000) {
            copy = controller;
        }
        samples(controller.step(limited, measured), (C(step)(&OMNI_CONTROLLER, &state, &limited_c, &measured_c, &sample), sample), k);
        if (k >= 2000) { // a copy goes on as the original does
            samples(copy.step(limited, measured), sample, k);
        }
        omni_twist estimated;
        check(C(estimate)(&OMNI_CONTROLLER, &measured_c, &estimated), "estimate", k);
        check(same(controller.estimate(measured), estimated), "estimated", k);
        saturated = saturated || controller.sample().saturated()[0];
        reduced = reduced || controller.sample().common_factor() < 1.0f;
        released = released || !controller.sample().active()[N - 1];
    }
    check(saturated && reduced && released, "the loops were never saturated, reduced and released", 3000);
    controller.reset();
    check(C(init)(&state, &sample), "init", 3000);
    samples(controller.sample(), sample, 3000);
}

void outputs(const omnistep::Output<N>& a, const C(drive_output) & b, int k) {
    check(same(a.torques_n_m(), b.torques.n_m), "torques of the drive", k);
    check(same(a.requested_n_m(), b.requested.n_m), "requested of the drive", k);
    check(same(a.references_rad_s(), b.references.rad_s), "references of the drive", k);
    check(same(a.measured_rad_s(), b.measured.rad_s), "measured of the drive", k);
    check(same(a.twist(), b.twist) && same(a.estimated(), b.estimated), "twists", k);
    check(same(a.pose().x_m, b.pose.x_m) && same(a.pose().y_m, b.pose.y_m) && same(a.pose().yaw_rad, b.pose.yaw_rad), "pose", k);
    check(static_cast<int>(a.mode()) == b.mode && static_cast<int>(a.status()) == b.status, "mode and status", k);
    check(a.rejected() == b.rejected && a.motion_known() == b.motion_known, "rejected and motion known", k);
    check(same(a.faults(), b.faults), "faults", k);
    check(same(a.active(), b.active) && same(a.saturated(), b.saturated), "active and saturated", k);
    check(same(a.excluded(), b.excluded) && same(a.brake(), b.brake), "excluded and brake", k);
}

void whole_drive() {
    using omnistep::CommandStatus, omnistep::DriveMode, omnistep::Fault;
    omnistep::Drive<N> drive{OMNI_DRIVE};
    C(drive_state) state;
    C(drive_output) output;
    check(C(drive_init)(&OMNI_DRIVE, &state, &output), "init of the drive", 0);
    outputs(drive.output(), output, -1);
    std::array<float, N> wheels{};
    bool modes[4] = {}, statuses[5] = {}, faults[6] = {}, excluded = false, brake = false, unknown = false;
    for (int k = 0; k < 4400; k++) {
        omnistep::Input<N> input;
        C(drive_input) input_c{};
        if (k % 20 == 0 && !within(k, 1000, 1600)) {
            input.command = omnistep::Twist{k == 3900 ? NAN_F : 0.6f, 0.1f, 0.2f};
            input_c.commanded = true;
            input_c.command = {input.command->vx_m_s, 0.1f, 0.2f};
        }
        for (std::size_t i = 0; i < N; i++) {
            if (output.active[i]) { // wheels take 20 ms to follow; a released one rolls on
                wheels[i] += 0.05f * (output.references.rad_s[i] - wheels[i]);
            }
            // A reading that never changes is of an encoder that is stuck, so these ripple; wheel 2 slips for a while.
            const float ripple = 0.01f * static_cast<float>((k + 3 * static_cast<int>(i)) % 5);
            float reading = wheels[i] + ripple + (i == 1 && within(k, 2450, 2550) ? 5.0f : 0.0f);
            if (i == 0 && within(k, 700, 720)) {
                reading = NAN_F;
            }
            if (!within(k, 3200, 3300) && !(i == 2 && within(k, 2000, 2200))) { // silent
                input.measured_rad_s[i] = reading;
                input_c.received[i] = true;
                input_c.measured.rad_s[i] = reading;
            }
        }
        input.lifted[N - 1] = input_c.lifted[N - 1] = within(k, 2560, 2590);
        input.emergency = input_c.emergency = within(k, 2600, 3000);
        if (within(k, 100, 300)) { // a hot motor, and a wheel on an edge
            input.torque_ranges[1] = omnistep::TorqueRange{-0.05f, 0.05f};
            input_c.limited[1] = true;
            input_c.torque_ranges.lower_n_m[1] = -0.05f;
            input_c.torque_ranges.upper_n_m[1] = 0.05f;
            input.path_factor[0] = input_c.path_factor[0] = 1.1f;
        }
        if (k == 750 || k == 2250 || k == 3700) { // of three wheels each lost reading is a safe stop
            drive.release_safe_stop();
            check(C(drive_release_safe_stop)(&state), "release of the safe stop", k);
        } else if (k == 3800) {
            check(drive.reset_pose({1.0f, 2.0f, 0.5f}), "reset of the pose", k);
            check(C(drive_reset_pose)(&state, 1.0f, 2.0f, 0.5f), "reset of the pose in C", k);
            check(!drive.reset_pose({1.0f, NAN_F, 0.5f}), "a pose that is none", k);
        }
        const auto& reported = drive.step(input);
        check(C(drive_step)(&OMNI_DRIVE, &state, &input_c, &output), "step", k);
        outputs(reported, output, k);
        modes[static_cast<int>(reported.mode())] = true;
        statuses[static_cast<int>(reported.status())] = true;
        for (std::size_t i = 0; i < N; i++) {
            faults[static_cast<int>(reported.faults()[i])] = true;
            excluded = excluded || reported.excluded()[i];
            brake = brake || reported.brake()[i];
        }
        unknown = unknown || !reported.motion_known();
        check(reported.rejected() == (k == 3900), "the command that is no number, and no other, is refused", k);
    }
    // What a hash alone would not say: that it happened. Three wheels have none to spare, so they are never degraded.
    const auto mode = [&modes](DriveMode mode) { return modes[static_cast<int>(mode)]; };
    check(mode(DriveMode::Normal) && mode(DriveMode::SafeStop) && mode(DriveMode::EmergencyStop), "a mode never came", 4400);
    check(mode(DriveMode::Degraded) || N == 3, "never degraded", 4400);
    const auto status = [&statuses](CommandStatus status) { return statuses[static_cast<int>(status)]; };
    check(status(CommandStatus::TimedOut) && status(CommandStatus::EmergencyStop), "a status never came", 4400);
    // Six wheels in two rows cannot go sideways: there the command is always limited.
    check(status(CommandStatus::Following) || status(CommandStatus::Limited), "no command was followed", 4400);
    check(faults[static_cast<int>(Fault::NotANumber)] && faults[static_cast<int>(Fault::Silent)], "a fault never came", 4400);
    check(excluded && brake && unknown, "nothing was left out, shorted or unknown", 4400);
    check(drive.output().mode() == DriveMode::Normal && drive.output().estimated().vx_m_s > 0.2f, "it does not drive in the end", 4400);
    const auto off = drive.deviations();
    omni_deviations off_c;
    check(C(drive_deviations)(&state, &off_c), "deviations", 4400);
    check(off.x_m > 0.0f, "no deviation", 4400);
    check(same(off.x_m, off_c.x_m) && same(off.y_m, off_c.y_m) && same(off.yaw_rad, off_c.yaw_rad), "deviations differ", 4400);
    drive.reset();
    check(C(drive_init)(&OMNI_DRIVE, &state, &output), "init of the drive", 4400);
    outputs(drive.output(), output, 4400);
}

void motion() {
    omnistep::Encoder encoder = OMNI_ENCODER;
    omni_encoder_state state;
    check(omni_encoder_init(&state), "init of the encoder", 0);
    std::uint32_t counter = 65000; // wraps
    // Two of three readings are missed, and one comes half a period late.
    omnistep::Encoder seldom = OMNI_ENCODER;
    omni_encoder_state seldom_state;
    check(omni_encoder_init(&seldom_state), "init of the encoder", 0);
    for (int k = 0; k < 400; k++) {
        const auto now = static_cast<std::uint32_t>(10 * k);
        float rad_s = 0.0f;
        if (k % 3 != 0) {
            seldom.missed();
            check(omni_encoder_missed(&OMNI_ENCODER, &seldom_state), "missed reading", k);
        } else if (k == 300) {
            check(omni_encoder_step_after(&OMNI_ENCODER, &seldom_state, now + 5, 3.5e-6f * OMNI_PERIOD_US, NAN_F, &rad_s),
                  "late step of the encoder", k);
            check(same(seldom.step_after(now + 5, 3.5e-6f * OMNI_PERIOD_US), rad_s), "velocity of a late reading", k);
        } else {
            check(omni_encoder_step(&OMNI_ENCODER, &seldom_state, now, NAN_F, &rad_s), "step of the encoder", k);
            check(same(seldom.step(now), rad_s), "velocity", k);
        }
        if (k % 3 == 0 && k > 30 && (k < 300 || k > 340)) {
            // Always ten counts a period, whole: the rest is rounding. The windows after the late reading have it in them.
            const float counted = 10.0f * 6.2831853f / 1440.0f / (1e-6f * OMNI_PERIOD_US);
            check(rad_s > 0.999f * counted && rad_s < 1.001f * counted, "a missed reading is no step", k);
        }
    }
    omnistep::Attitude attitude;
    check(!attitude.step({0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.0f}, 0.001f), "a fall says where up is", 0);
    for (int k = 0; k < 400; k++) {
        // Nose up by 30 degrees, and up on.
        const auto read = attitude.step({0.0f, -0.1f, 0.0f}, {4.905f, 0.0f, 8.4957f}, 0.001f);
        const float pitch_rad = 0.5235988f + 0.0001f * static_cast<float>(k);
        check(read && read->pitch_rad > pitch_rad - 0.005f && read->pitch_rad < pitch_rad + 0.005f, "pitch", k);
        check(!attitude.step({0.0f, NAN_F, 0.0f}, {0.0f, 0.0f, 9.81f}, 0.001f), "what is no number is used", k);
    }
    for (int k = 0; k < 1000; k++) {
        counter = (counter + static_cast<std::uint32_t>(k / 10)) % 65536;
        const float since_s = k % 3 == 0 ? 0.0004f : NAN_F;
        float rad_s;
        check(omni_encoder_step(&OMNI_ENCODER, &state, counter, since_s, &rad_s), "step of the encoder", k);
        check(same(k % 3 == 0 ? encoder.step(counter, since_s) : encoder.step(counter), rad_s), "velocity", k);
        check((rad_s > 0.0f) == (k >= 10), "the encoder turns forward from the tenth period", k);
        const float torque_n_m = 0.004f * static_cast<float>(k - 500);
        float part;
        check(omni_duty(&OMNI_MOTORS[0], torque_n_m, rad_s, &part), "duty", k);
        check(same(omnistep::duty(OMNI_MOTORS[0], torque_n_m, rad_s), part), "duty differs", k);
        const float supply_part = 0.004f * static_cast<float>(k);
        check(omni_duty_at(&OMNI_MOTORS[0], torque_n_m, rad_s, supply_part, &part), "duty at a supply", k);
        check(same(omnistep::duty_at(OMNI_MOTORS[0], torque_n_m, rad_s, supply_part), part), "duty at a supply differs", k);
        check(k > 0 || part == 0.0f, "a duty without a supply", k);
    }
}

// Values that any memory can hold and that need no clean-up.
static_assert(std::is_trivially_copyable_v<omnistep::Drive<N>> && std::is_trivially_destructible_v<omnistep::Drive<N>>);
static_assert(std::is_trivially_copyable_v<omnistep::Controller<N>> && std::is_trivially_destructible_v<omnistep::Controller<N>>);

} // namespace

int main() {
    loops();
    whole_drive();
    motion();
    std::printf("%s, %zu wheels: %s\n", OMNI_VEHICLE, N, wrong == 0 ? "C++ and C agree in every bit" : "wrong");
    return wrong == 0 ? 0 : 1;
}
