/* A base with four mecanum wheels on computed motors. Replace bench.c by your board's functions, which base.h declares. */
#include <inttypes.h>
#include <stdio.h>

#include "base.h"

void app_main(void) {
    const bench_result result = bench_run();
    printf("four mecanum wheels: hash %" PRIu32 "%s\n", result.hash, result.good ? ", as expected" : ", not as expected");
}
