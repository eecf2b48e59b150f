/* Every function of the library once, with null pointers: each says no. Linked, it proves that none can panic. */
#include "omnistep.h"
#include "startup.h"

int main(void) {
    bool any = omni3_init(0, 0) || omni4_init(0, 0) || omni7_init(0, 0);
    any = any || omni3_step(0, 0, 0, 0, 0) || omni4_step(0, 0, 0, 0, 0) || omni7_step(0, 0, 0, 0, 0);
    any = any || omni3_estimate(0, 0, 0) || omni4_estimate(0, 0, 0) || omni7_estimate(0, 0, 0);
    any = any || omni_limit(0, 0, 0, 0);
    print(any ? "a null pointer was taken\n" : "every function of the library refuses null pointers\n");
    finish(!any);
}
