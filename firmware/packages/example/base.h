/* The control task of a base with four mecanum wheels, and what it needs of a board. */
#ifndef BASE_H
#define BASE_H
#include "omnistep.h"
#ifdef __cplusplus
extern "C" {
#endif

/* base.c: call base_start() once, and base_period() exactly every OMNI_PERIOD_US, 1 ms. */
extern omni4_drive_output base_output;
void base_start(void);
void base_period(void);

/* The board. bench.c has computed motors instead: replace it by a file of yours with these four functions. */
bool read_counter(int wheel, uint32_t *counter); /* of a timer in encoder mode; false where it cannot be read */
bool read_command(omni_twist *command);          /* m/s, m/s, rad/s; false where none came since the last period */
void set_duty(int wheel, float duty);            /* PWM and direction of a bridge: -1 to 1; 0 shorts the motor */
void open_bridge(int wheel);                     /* the wheel rolls freely */

/* bench.c: drives for four seconds of computed time. `hash` is the same on every processor. */
typedef struct {
    uint32_t hash;
    bool good; /* the base reached its commanded velocity, and rested at the end */
} bench_result;
bench_result bench_run(void);

#ifdef __cplusplus
}
#endif
#endif
