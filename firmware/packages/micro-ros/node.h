/* A micro-ROS node around base.h's control task: cmd_vel (geometry_msgs/Twist) in, odom (nav_msgs/Odometry) out. */
#ifndef NODE_H
#define NODE_H
#include "base.h"
#ifdef __cplusplus
extern "C" {
#endif

/* Yours: keep node_period() from running, as short as a copy takes. */
void interrupts_off(void);
void interrupts_on(void);

/* To be called from a timer's interrupt every millisecond, once base_start() was called. */
void node_period(void);

/* Connects, and then publishes at least 50 times a second. Returns false if a step of it fails: the agent cannot be reached. */
bool node_run(void);

#ifdef __cplusplus
}
#endif
#endif
