/* A base with four mecanum wheels on computed motors. Replace bench.c by functions for your board: see base.h. */
#include <inttypes.h>
#include <stdio.h>

#include "base.h"

void app_main(void) {
    const bench_result result = bench_run();
    const char *end = result.good ? ", as expected" : ", not as expected";
    printf("four mecanum wheels: hash %" PRIu32 "%s\n", result.hash, end);
}
