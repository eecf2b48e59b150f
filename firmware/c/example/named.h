/* Types and functions for the number of wheels of constants.h: C(step) is omni4_step for four. */
#ifndef NAMED_H
#define NAMED_H

#define JOINED(count, name) omni##count##_##name
#define NAMED(count, name) JOINED(count, name)
#define C(name) NAMED(OMNI_WHEELS, name)

#endif
