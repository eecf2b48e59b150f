/* A base with four mecanum wheels on computed motors. Replace bench.c by your board's functions, which base.h declares. */
#include <zephyr/sys/printk.h>

#include "base.h"

int main(void) {
    const bench_result result = bench_run();
    printk("four mecanum wheels: hash %u%s\n", (unsigned)result.hash, result.good ? ", as expected" : ", not as expected");
    return 0;
}
