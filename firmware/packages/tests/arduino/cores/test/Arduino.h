// As much of Arduino as the example uses, with semihosting as the serial port.
#pragma once
#include <stdint.h>

extern "C" { // of startup.c
void print(const char *text);
void print_number(uint32_t number);
void finish(bool good);
}

struct Port {
    void begin(unsigned long) {}
    void print(const char *text) { ::print(text); }
    void print(unsigned long number) { ::print_number(number); }
    void println(const char *text) {
        ::print(text);
        ::print("\n");
    }
};
extern Port Serial;
inline void delay(unsigned long) {}
void setup();
void loop();
