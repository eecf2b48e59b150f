/* Instructions between two points, by SysTick: under QEMU's -icount every instruction takes the same emulated time. */
#ifndef COUNT_H
#define COUNT_H
#include "startup.h"

#define SYSTICK ((volatile uint32_t *)0xE000E010) /* control, reload, current */

static uint32_t ticks_per_nops, ticks_of_nothing;

static inline uint32_t ticks_since(uint32_t before) { return (before - SYSTICK[2]) & 0xffffffu; }

__attribute__((noinline)) static void nops(void) { __asm__ volatile(".rept 1024\nnop\n.endr"); }
__attribute__((noinline)) static void nothing(void) { __asm__ volatile(""); }

static inline void start_counting(void) {
    SYSTICK[1] = 0xffffffu;
    SYSTICK[2] = 0;
    SYSTICK[0] = 5; /* on, by the processor's clock */
    uint32_t before = SYSTICK[2];
    nothing();
    ticks_of_nothing = ticks_since(before);
    before = SYSTICK[2];
    nops();
    ticks_per_nops = ticks_since(before) - ticks_of_nothing;
}

/* Instructions since `before`, to about one. */
static inline uint32_t instructions_since(uint32_t before) {
    uint32_t ticks = ticks_since(before) - ticks_of_nothing;
    return (ticks * 1024u + ticks_per_nops / 2u) / ticks_per_nops;
}

static inline void say(const char *what, const char *which, uint32_t instructions) {
    print("instructions, C, " OMNI_VEHICLE ": ");
    print(what);
    print(which);
    print(": ");
    print_number(instructions);
    print("\n");
}
#endif
