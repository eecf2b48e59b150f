/* The least that a Cortex-M4F needs to run main(), and a console through the emulator or debug probe. */
#ifndef STARTUP_H
#define STARTUP_H
#include <stdbool.h>
#include <stdint.h>

void print(const char *text);
void print_number(uint32_t number);
_Noreturn void finish(bool good);
#endif
