#include <cstdio>

#include "controller.hpp"

static_assert(OMNI_WHEELS >= 5, "this example breaks the cable of wheel 5");

int main() {
    BaseController controller;
    std::array<double, OMNI_WHEELS> velocities{}; // what the motors of this example do
    for (int k = 0; k < 3000; k++) { // 3 s
        if (k % 20 == 0) {
            controller.command(0.3, 0.0, 0.0);
        }
        controller.emergency = k >= 2000;
        BaseController::Velocities readings;
        std::copy(velocities.begin(), velocities.end(), readings.begin());
        if (k >= 1000) {
            readings[4].reset(); // the cable of wheel 5 breaks
        }
        const auto efforts = controller.update(readings);
        for (std::size_t i = 0; i < efforts.size(); i++) {
            velocities[i] += efforts[i] / 0.0196 * 0.001; // kg.m^2: a wheel and what it moves; s
        }
        if (k % 500 == 499) {
            const auto& now = controller.drive.output();
            std::printf("%.1f s: %6.3f m/s, at x = %.3f m, ", (k + 1) * 0.001,
                        double(now.estimated().vx_m_s), double(now.pose().x_m));
            std::printf("mode %d, fault of wheel 5: %d\n", int(now.mode()), int(now.faults()[4]));
        }
    }
}
