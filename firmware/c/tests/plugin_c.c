/* The same library from C, in the same program. */
#include "constants.h"
#include "omnistep.h"

bool plugin_c(void);

bool plugin_c(void) {
    omni7_state state;
    omni7_sample sample;
    return omni7_init(&state, &sample) == OMNI_STATUS_OK && omni7_init(0, &sample) == OMNI_STATUS_NULL_POINTER;
}
