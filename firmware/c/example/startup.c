#include "startup.h"

extern uint32_t stack_top, data_start, data_end, data_load, bss_start, bss_end;
int main(void);

/* Semihosting: a request and its argument, answered by the emulator or the probe. */
static int request(int number, const void *argument) {
    register int r0 __asm__("r0") = number;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

void print(const char *text) { request(0x04, text); }

void print_number(uint32_t number) {
    char digits[11];
    int i = 10;
    digits[i] = 0;
    do {
        digits[--i] = (char)('0' + number % 10);
        number /= 10;
    } while (number);
    print(digits + i);
}

_Noreturn void finish(bool good) {
    const uint32_t block[2] = {0x20026, good ? 0 : 1}; /* ADP_Stopped_ApplicationExit, exit code */
    request(0x20, block);
    for (;;) {
    }
}

static void stop(void) { finish(false); }

void reset(void) {
    *(volatile uint32_t *)0xE000ED88 |= 0xFu << 20; /* the floating-point unit on, before it is used */
    __asm__ volatile("dsb\nisb");
    for (uint32_t *to = &data_start, *from = &data_load; to < &data_end;) {
        *to++ = *from++;
    }
    for (uint32_t *to = &bss_start; to < &bss_end;) {
        *to++ = 0;
    }
    finish(main() == 0);
}

typedef union {
    uint32_t *stack;
    void (*run)(void);
} vector;

__attribute__((section(".vectors"), used)) static const vector vectors[16] = {
    {.stack = &stack_top}, {.run = reset}, {.run = stop}, {.run = stop},
    {.run = stop},         {.run = stop},  {.run = stop},
};
