/* startup.h for QEMU's machine virt with a 32-bit RISC-V: the least that runs main(), and a console by semihosting. */
#include "startup.h"

extern uint32_t bss_start, bss_end;
int main(void);

/* Semihosting on RISC-V: these three instructions, uncompressed and in one page. */
__attribute__((noinline, aligned(16))) static int request(int number, const void *argument) {
    register int a0 __asm__("a0") = number;
    register const void *a1 __asm__("a1") = argument;
    __asm__ volatile(".option push\n.option norvc\nslli x0, x0, 0x1f\nebreak\nsrai x0, x0, 7\n.option pop"
                     : "+r"(a0)
                     : "r"(a1)
                     : "memory");
    return a0;
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

__attribute__((used)) static void stop(void) { finish(false); }

__attribute__((used)) static void begin(void) {
    for (uint32_t *to = &bss_start; to < &bss_end;) {
        *to++ = 0;
    }
    finish(main() == 0);
}

/* The stack, and where a trap goes. */
__attribute__((naked, used, section(".start"))) void reset(void) {
    __asm__ volatile(".option arch, +zicsr\nla sp, stack_top\nla t0, trap\ncsrw mtvec, t0\ncall begin\n"
                     ".align 2\ntrap:\ncall stop");
}
