/* startup.h for the computer that builds: what an example says here, it has to say on every processor. */
#include "startup.h"

#include <stdio.h>
#include <stdlib.h>

void print(const char *text) { fputs(text, stdout); }

void print_number(uint32_t number) { printf("%lu", (unsigned long)number); }

_Noreturn void finish(bool good) { exit(good ? 0 : 1); }
