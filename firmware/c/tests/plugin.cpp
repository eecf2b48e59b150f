// A controller in a shared library.
#include <omnistep.hpp>

#include "constants.h"

float other(omnistep::Drive<OMNI_WHEELS>& drive); // plugin_other.cpp
extern "C" bool plugin_c(void);                   // plugin_c.c

/// The torque of the first wheel after ten periods [N.m]; NaN where C says no.
extern "C" float plugin_run(void) {
    omnistep::Drive<OMNI_WHEELS> drive{OMNI_DRIVE};
    float torque_n_m = 0.0f;
    for (int k = 0; k < 10; k++) {
        torque_n_m = other(drive);
    }
    return plugin_c() ? torque_n_m : std::numeric_limits<float>::quiet_NaN();
}
