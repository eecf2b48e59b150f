/* The base with four mecanum wheels on computed motors, in QEMU's machine mps2-an386 or behind a debug probe. */
#include "base.h"
#include "startup.h"

int main(void) {
    bench_result result = bench_run();
    print("four mecanum wheels: hash ");
    print_number(result.hash);
    print(result.good ? ", as expected\n" : ", not as expected\n");
    finish(result.good);
}
