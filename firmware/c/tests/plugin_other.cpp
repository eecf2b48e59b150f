// The same header in a second file: nothing of it is defined twice.
#include <omnistep.hpp>

#include "constants.h"

float other(omnistep::Drive<OMNI_WHEELS>& drive) {
    omnistep::Input<OMNI_WHEELS> input;
    input.command = omnistep::Twist{0.3f, 0.0f, 0.0f};
    input.measured_rad_s.fill(0.0f);
    return drive.step(input).torques_n_m()[0];
}
