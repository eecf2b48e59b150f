/* A base with four mecanum wheels on computed motors. Replace bench.c by functions for your board: see base.h. */
#include <zephyr/sys/printk.h>

#include "base.h"

int main(void) {
    const bench_result result = bench_run();
    const char *end = result.good ? ", as expected" : ", not as expected";
    printk("four mecanum wheels: hash %u%s\n", (unsigned)result.hash, end);
    return 0;
}
