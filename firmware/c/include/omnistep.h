/* omnistep: control of omni-directional vehicles, in single precision. C11 and C++11; no heap, no C library.
 *
 * A controller is a constant that `omnistep export` writes from a vehicle file; what changes is in a state. Units are
 * SI: m, m/s, rad/s, N.m, s. Fill in constants by that command only: their flags and tags have to be valid. Comments
 * that name `Types` mean those of the Rust library, which has them documented in full. Generated from the Rust sources
 * by cbindgen; not to be edited. */

#ifndef OMNISTEP_H
#define OMNISTEP_H

#include <stdbool.h>
#include <stdint.h>

#define OMNISTEP_VERSION "0.1.0"
/* 1000000 major + 1000 minor + patch; constants.h of another version is an error. */
#define OMNISTEP_VERSION_NUMBER 1000

/* Structures differ from version to version: a library of another one does not link. */
#define omni3_init omni3_init_0_1_0
#define omni3_drive_init omni3_drive_init_0_1_0
#define omni3_traction_drive_init omni3_traction_drive_init_0_1_0
#define omni3_estimator_init omni3_estimator_init_0_1_0
#define omni4_init omni4_init_0_1_0
#define omni4_drive_init omni4_drive_init_0_1_0
#define omni4_traction_drive_init omni4_traction_drive_init_0_1_0
#define omni4_estimator_init omni4_estimator_init_0_1_0
#define omni5_init omni5_init_0_1_0
#define omni5_drive_init omni5_drive_init_0_1_0
#define omni5_traction_drive_init omni5_traction_drive_init_0_1_0
#define omni5_estimator_init omni5_estimator_init_0_1_0
#define omni6_init omni6_init_0_1_0
#define omni6_drive_init omni6_drive_init_0_1_0
#define omni6_traction_drive_init omni6_traction_drive_init_0_1_0
#define omni6_estimator_init omni6_estimator_init_0_1_0
#define omni7_init omni7_init_0_1_0
#define omni7_drive_init omni7_drive_init_0_1_0
#define omni7_traction_drive_init omni7_traction_drive_init_0_1_0
#define omni7_estimator_init omni7_estimator_init_0_1_0
#define omni8_init omni8_init_0_1_0
#define omni8_drive_init omni8_drive_init_0_1_0
#define omni8_traction_drive_init omni8_traction_drive_init_0_1_0
#define omni8_estimator_init omni8_estimator_init_0_1_0

/* Hinges that a vehicle under traction control may have. */
#define OMNI_MAX_HINGES 8

/* Constants of another kind of drive or number of wheels are an error, as they are in C++ and to newer compilers. */
#if defined(__GNUC__) && !defined(__cplusplus)
#pragma GCC diagnostic error "-Wincompatible-pointer-types"
#endif

/* Infinity and NaN, without <math.h> where the compiler has them by itself. */
#ifdef __GNUC__
#define OMNI_INFINITY __builtin_inff()
#define OMNI_NAN __builtin_nanf("")
#else
#include <math.h>
#define OMNI_INFINITY INFINITY
#define OMNI_NAN NAN
#endif

// What became of a call. Nothing was done unless it is `OMNI_STATUS_OK`.
enum omni_status
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // It was done.
  OMNI_STATUS_OK = 0,
  // A pointer is null.
  OMNI_STATUS_NULL_POINTER = 1,
  // The state was not made ready by its `init`.
  OMNI_STATUS_NOT_READY = 2,
  // A number is not finite, it is a deviation below 0, or a force that says nothing of where up is.
  OMNI_STATUS_NOT_FINITE = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum omni_status omni_status;
#else
typedef uint8_t omni_status;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// The error that the integrals accumulate.
enum omni_integral
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Each wheel its own.
  OMNI_INTEGRAL_PER_WHEEL,
  // The part of the errors that a motion of the vehicle explains, so that redundant wheels cannot wind up against
  // each other. Needs a layout.
  OMNI_INTEGRAL_SHARED,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum omni_integral omni_integral;
#else
typedef uint8_t omni_integral;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// The part of a twist that is kept if a wheel would exceed its highest speed.
enum omni_desaturation
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // The direction: the whole twist is scaled by one factor, so that the path stays the same.
  OMNI_DESATURATION_UNIFORM,
  // The yaw rate, as far as it is possible alone; the remaining capacity is used for translation, in its direction.
  OMNI_DESATURATION_KEEPS_YAW,
  // Translation, as far as it is possible alone; the remaining capacity is used for yaw.
  OMNI_DESATURATION_KEEPS_TRANSLATION,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum omni_desaturation omni_desaturation;
#else
typedef uint8_t omni_desaturation;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// How far the vehicle can be relied on.
enum omni_drive_mode
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Every wheel drives, and its readings are accepted.
  OMNI_DRIVE_MODE_NORMAL = 0,
  // A wheel is released, lifted or excluded; the others move the vehicle as commanded.
  OMNI_DRIVE_MODE_DEGRADED = 1,
  // Too few wheels are left to determine how the vehicle moves: those that are left are brought
  // to rest, at the emergency deceleration. Latched until
  // `DriveState::release_safe_stop`.
  OMNI_DRIVE_MODE_SAFE_STOP = 2,
  // Requested: for as long as `DriveInput::emergency` says so.
  OMNI_DRIVE_MODE_EMERGENCY_STOP = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum omni_drive_mode omni_drive_mode;
#else
typedef uint8_t omni_drive_mode;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Why the twist is what it is.
enum omni_command_status
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // No command since the start or since the release of an emergency stop, or no command of rest yet if
  // `Restart::Neutral` requires one: at rest, or decelerating to rest.
  OMNI_COMMAND_STATUS_IDLE,
  // The twist is the command.
  OMNI_COMMAND_STATUS_FOLLOWING,
  // The limits keep the twist from the command, or still do.
  OMNI_COMMAND_STATUS_LIMITED,
  // The last command is too old, or none of rest has come since where `Restart::Neutral` wants
  // one: rest, or on the way there.
  OMNI_COMMAND_STATUS_TIMED_OUT,
  // The emergency stop is latched: rest, or on the way there.
  OMNI_COMMAND_STATUS_EMERGENCY_STOP,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum omni_command_status omni_command_status;
#else
typedef uint8_t omni_command_status;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// The fault of a wheel.
enum omni_fault
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Nothing.
  OMNI_FAULT_NONE = 0,
  // Its reading is NaN, infinite, or beyond 1e6 rad/s.
  OMNI_FAULT_NOT_A_NUMBER = 1,
  // Its reading jumps further in one period than a wheel can.
  OMNI_FAULT_JUMP = 2,
  // Its reading never changes although the vehicle moves, or although the motor pulls: an
  // encoder that is dead, or a wheel that is blocked.
  OMNI_FAULT_STUCK = 3,
  // No reading has arrived for too long.
  OMNI_FAULT_SILENT = 4,
  // It has been declared lost.
  OMNI_FAULT_LOST = 5,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum omni_fault omni_fault;
#else
typedef uint8_t omni_fault;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// The control mode of the wheels.
enum omni_traction_loops
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Every wheel's own loop: nothing slips, climbs or is held up.
  OMNI_TRACTION_LOOPS_PLAIN = 0,
  // One thrust, slip control of each wheel.
  OMNI_TRACTION_LOOPS_TRACTION = 1,
  // Every wheel's own loop, because the measured speed is implausible: until the command rests.
  OMNI_TRACTION_LOOPS_FALLBACK = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum omni_traction_loops omni_traction_loops;
#else
typedef uint8_t omni_traction_loops;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Phase of a `Supervisor`.
enum omni_supervisor_mode
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // It drives as commanded.
  OMNI_SUPERVISOR_MODE_DRIVE = 0,
  // It backs off from the obstacle.
  OMNI_SUPERVISOR_MODE_BACK_OFF = 1,
  // It runs up to it.
  OMNI_SUPERVISOR_MODE_RUN_UP = 2,
  // No retry is left: it rests until the command does, or puts other rows in front.
  OMNI_SUPERVISOR_MODE_GAVE_UP = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum omni_supervisor_mode omni_supervisor_mode;
#else
typedef uint8_t omni_supervisor_mode;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Number of consecutive periods in which each wheel has requested more than the same limit: anti-windup waits for 8.
// Wheel i is bit i; at most 32 wheels.
//
// One encoder count, or noise, can request more than a motor's torque in a single reading. If the integral reacted to
// each, it would discard these readings and keep the remaining ones: a bias, with which the vehicle runs away or
// creeps. Noise is beyond the same limit 8 times in a row in one period of 2^8.
typedef struct {
  // Wheels that were beyond a limit in the step before.
  uint32_t beyond;
  // Those of them that asked for more than their upper limit.
  uint32_t above;
  // Periods in a row before that one, 0 to 7: bit i of `count[k]` is binary digit k of wheel i's count.
  uint32_t count[3];
} omni_overload;

// A sum and what its rounding left out, carried into the next addition (after Neumaier, 1974).
typedef struct {
  // The sum, rounded.
  float total;
  // Exact sum less `total`: at most half a unit in its last place.
  float rest;
} omni_sum;

// The state of a `RestRule`.
typedef struct {
  // Tenths of the periods in which wheels were held while every reference was 0, less those that have come back.
  uint32_t held;
  // Integral of torque squared of that [N^2.m^2.s].
  omni_sum held_torque_squared_n2m2s;
  // Periods in which the torques fell since then.
  float bled_periods;
} omni_rest_state;

// The state of the loops between steps; `default` is a fresh start.
typedef struct {
  // Integral term of each wheel [N.m].
  float integral_n_m[3];
  // Derivative term of each wheel [N.m], after its filter.
  float derivative_n_m[3];
  // Reference of the step before, as realised [rad/s]; 0 without derivative and feed-forward.
  float last_reference_rad_s[3];
  // Measurement of the step before [rad/s]; 0 without derivative and feed-forward.
  float last_measured_rad_s[3];
  // The wheel has a step to compare with; only loops with a derivative or a feed-forward set it.
  bool started[3];
  // The overloaded wheels, and the time for which each other wheel has been beyond a limit.
  omni_overload overload;
  // Progress of the torque's end while every reference was 0.
  omni_rest_state rest;
} omni3_state;

// Velocity of the vehicle in its own frame: the input of the inverse kinematics. Not a world velocity.
typedef struct {
  // Forward velocity [m/s] (forward is +).
  float vx_m_s;
  // Sideways velocity [m/s] (left is +).
  float vy_m_s;
  // Yaw rate [rad/s] (counter-clockwise seen from above is +).
  float wz_rad_s;
} omni_twist;

// Actuator velocities, one per wheel in the layout's order, which kinematics maps and loops control.
typedef struct {
  // Velocity of each actuator [rad/s] (positive as the wheel's rolling direction says), any finite number.
  float rad_s[3];
} omni3_velocities;

// Actuator torques, one per wheel in the layout's order: a controller's request to the motors. Not a wheel velocity.
typedef struct {
  // Torque of each actuator [N.m] (positive drives the wheel in its rolling direction), any finite number.
  float n_m[3];
} omni3_torques;

// Torque limits of `N` wheels at their present velocities [N.m], in the layout's order.
typedef struct {
  // Lowest torque of each, <= 0.
  float lower_n_m[3];
  // Highest torque of each, >= 0.
  float upper_n_m[3];
} omni3_torque_ranges;

// Every signal of one control step, per wheel in the layout's order. Velocities [rad/s] and torques [N.m] are the
// actuators'. Nothing in it is ever NaN.
typedef struct {
  // Reference r as commanded, before any reduction.
  omni3_velocities reference;
  // Measurement y; 0 for a released wheel.
  omni3_velocities measured;
  // The wheel was controlled. One without a usable measurement is released: no torque, its loop
  // starts afresh. When the torque has `ended` no wheel is controlled.
  bool active[3];
  // Proportional term, formed with the reference as reduced by `common_factor` under
  // `Saturation::ScaleReferences`.
  float p_n_m[3];
  // Integral term, likewise.
  float i_n_m[3];
  // Derivative term, likewise.
  float d_n_m[3];
  // Feed-forward, likewise.
  float ff_n_m[3];
  // Torque that the loops request with the whole reference: the torque that actuators without limits would apply.
  omni3_torques requested;
  // Torque to apply, always within the limits.
  omni3_torques applied;
  // Limits at the present velocities.
  omni3_torque_ranges range;
  // The requested torque is outside the limits.
  bool saturated[3];
  // Factor on all torques (`Saturation::ScaleTorques`) or all references
  // (`Saturation::ScaleReferences`), 0 to 1; 1 under
  // `Saturation::Clip`.
  float common_factor;
  // Every reference has been 0 for long enough that all torque has ended: see
  // `Rest`. Bridges that are driven by voltage are then opened or shorted,
  // because the voltage for no torque follows from a velocity that may be measured wrongly.
  bool ended;
  // And the windings of all motors are to be shorted: `Rest::short_windings`.
  bool shorted;
} omni3_wheel_sample;

// Every signal of one step of a `Controller`.
typedef struct {
  // The command; rest if the one given was not finite, or beyond 1e6.
  omni_twist command;
  // The wheels' signals.
  omni3_wheel_sample wheels;
} omni3_sample;

// The two linear maps of one layout. Immutable, no allocation.
typedef struct {
  float inverse[3][3];
  float forward[3][3];
  float weights[3];
} omni3_kinematics;

// `FeedForward` for one period: `ks sgn(r) + gain (r - decay r_last)`.
typedef struct {
  float static_n_m;
  float gain;
  float decay;
} omni_feed_forward;

// Method that prevents windup of a saturated loop's integral.
//
// `excess` below is the output as applied minus the output as asked for: not zero only while something, a
// limit or a coordination law, changed the output. In a `WheelController`
// it counts from the eighth period in a row beyond the same limit (`Overload`),
// also for wheels scaled with it; in a `Pid` at once. Under
// `Saturation::ScaleReferences` the law is `Conditioned` whatever is set
// here; `Clamp` also limits the integrals there.
enum omni_anti_windup_tag
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Nothing: The integral accumulates every error. Overshoots after every saturation.
  OMNI_ANTI_WINDUP_NONE,
  // The integral is held within +-`limit_n_m` after each step. With
  // `IntegrationOrder::BeforeOutput` the term of a step may be
  // larger by that step's `ki T e`.
  OMNI_ANTI_WINDUP_CLAMP,
  // The integral rejects errors that would drive a saturated output further out (conditional integration).
  OMNI_ANTI_WINDUP_CONDITIONAL,
  // The integral follows the applied output: `I' = ki e + excess / T` (Fertik and Ross).
  OMNI_ANTI_WINDUP_BACK_CALCULATION,
  // The loop sees the reference with which its output would just have been the applied one, in every term (Hanus'
  // conditioned controller). No parameter. Acts as `AntiWindup::Conditional` if the reference affects no term.
  OMNI_ANTI_WINDUP_CONDITIONED,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum omni_anti_windup_tag omni_anti_windup_tag;
#else
typedef uint8_t omni_anti_windup_tag;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

typedef struct {
  // Largest integral [N.m], 0 to 1e9.
  float limit_n_m;
} omni_anti_windup_Clamp_body;

typedef struct {
  // Tracking time constant T [s], the control period to 1e6: smaller forgets faster. A
  // usual choice is kp / ki.
  float tracking_time_s;
} omni_anti_windup_BackCalculation_body;

typedef struct {
  omni_anti_windup_tag tag;
  union {
    omni_anti_windup_Clamp_body CLAMP;
    omni_anti_windup_BackCalculation_body BACK_CALCULATION;
  };
} omni_anti_windup;

// The integral zone and the limit of the proportional term of a loop.
typedef struct {
  // One of the two is finite.
  bool any;
  // The integral accumulates errors up to this [rad/s].
  float zone;
  // Largest proportional term [N.m].
  float proportional;
} omni_term_bounds;

// Torque limits of one wheel at its present velocity [N.m]; positive drives it in its rolling direction.
typedef struct {
  // Lowest torque, <= 0.
  float lower_n_m;
  // Highest torque, >= 0.
  float upper_n_m;
} omni_torque_range;

// A PID loop's constants. The changing state is in `PidState`.
//
// Formed once from a `PidConfig`; derivatives are backward differences, zero in the first step. With the
// reference r, the measurement y, the period T, the weights b and c and the filter time Td of the derivative:
typedef struct {
  float kp;
  // kp b.
  float kp_reference;
  // ki T.
  float ki_dt;
  // ki T if the integral includes an error before the output; 0 otherwise.
  float ki_dt_output;
  // kd / (Td + T).
  float kd_discrete;
  // c.
  float derivative_weight;
  // Td / (Td + T).
  float derivative_memory;
  omni_feed_forward feed_forward;
  // Some term compares with the step before: a derivative or a feed-forward.
  bool uses_last;
  bool feeds_forward;
  // 1 / (du/dr) [rad/s per N.m], 0 if du/dr is 0; in the first step.
  float inverse_slope;
  float inverse_first_slope;
  float conditioned_gain;
  float first_conditioned_gain;
  omni_anti_windup anti_windup;
  float tracking;
  omni_term_bounds bounds;
  omni_torque_range output;
} omni_pid;

// The limits of `N` actuators, their numbers side by side: loops over them run several at a time
// where the processor can.
typedef struct {
  float stall[3];
  float slope[3];
  float cap[3];
  // No limit depends on the velocity.
  bool constant;
} omni3_torque_limits;

// How requested torques are brought within the limits.
enum omni_saturation_tag
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Each wheel is cut to its own limit; the others do not notice.
  OMNI_SATURATION_CLIP,
  // Eqs. (11), (12) with |torque|: all torques are multiplied by the factor of the wheel
  // furthest over its limit. Ratios of torques are kept. The integrals react as `anti_windup`
  // says; with `None` they do not.
  OMNI_SATURATION_SCALE_TORQUES,
  // All references are multiplied by one factor s, as large as keeps every wheel within its
  // limit, and the loops see the error against the reduced reference (a conditioned controller
  // shared by the wheels). Ratios of velocities are kept and nothing winds up.
  OMNI_SATURATION_SCALE_REFERENCES,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum omni_saturation_tag omni_saturation_tag;
#else
typedef uint8_t omni_saturation_tag;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

typedef struct {
  // The factor never falls below this, 0 to 1: a wheel may then saturate. With 0, one blocked wheel stops all.
  float floor;
} omni_saturation_ScaleReferences_body;

typedef struct {
  omni_saturation_tag tag;
  union {
    omni_saturation_ScaleReferences_body SCALE_REFERENCES;
  };
} omni_saturation;

// A coordination policy: one choice of each.
typedef struct {
  // How torques are brought within limits.
  omni_saturation saturation;
  // The error that the integrals accumulate.
  omni_integral integral;
} omni_coordination;

// `Rest` in control periods.
typedef struct {
  float bleed_periods;
  // Time to hold, in periods times `RECOVERY`.
  uint32_t hold;
  float hold_torque_squared;
  // What comes back in a period.
  float torque_squared_back;
  float period_s;
  bool short_windings;
} omni_rest_rule;

// PID loops of `N` wheels with a coordination policy, without a vehicle around them.
typedef struct {
  omni_pid pid;
  omni3_torque_limits limits;
  omni_coordination coordination;
  omni_rest_rule rest;
} omni3_loops;

// A vehicle's controller: kinematics and wheel loops. Immutable; the changing state is in `ControlState`.
//
// The bare loop. `Drive` puts shaping, faults, slip and odometry around it.
typedef struct {
  omni3_kinematics kinematics;
  omni3_loops wheels;
} omni3_controller;

// Velocity steps of a motion in one direction.
typedef struct {
  // Speed that a period adds to a motion in this direction.
  float up;
  // Speed that a period removes from a motion in the opposite direction.
  float down;
} omni_steps;

// Rate limiter of one axis; see `AxisLimits`. The changing state is in `RateLimiterState`.
//
// With a jerk limit it looks ahead: it accelerates no more than it can reverse before the target, and brakes a
// reversal no harder than it can ease before the velocity changes sign. A target that stays is reached exactly, and
// overshot by rounding only (an ulp), except if the acceleration of an earlier target leaves no choice. The velocity
// limits hold in any case. Without a jerk limit, no square root is computed; a period in which the velocity changes
// sign is shared between deceleration and acceleration.
typedef struct {
  float min;
  float max;
  omni_steps forward;
  omni_steps backward;
  float jerk_step;
  // Velocity limits only: every target is reached in one period.
  bool at_once;
  // The jerk is limited.
  bool smooth;
} omni_rate_limiter;

// Limits of one group in velocity steps per period.
typedef struct {
  float speed;
  float up;
  float down;
  float jerk_step;
} omni_group;

// Limits of a twist, in velocity steps per period.
enum omni_law_tag
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // `TwistLimits::PerAxis`.
  OMNI_LAW_PER_AXIS,
  // `TwistLimits::AlongMotion`.
  OMNI_LAW_ALONG_MOTION,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum omni_law_tag omni_law_tag;
#else
typedef uint8_t omni_law_tag;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

typedef struct {
  // vx, vy, wz.
  omni_rate_limiter axes[3];
} omni_law_PerAxis_body;

typedef struct {
  // vx and vy.
  omni_group linear;
  // wz.
  omni_group yaw;
} omni_law_AlongMotion_body;

typedef struct {
  omni_law_tag tag;
  union {
    omni_law_PerAxis_body PER_AXIS;
    omni_law_AlongMotion_body ALONG_MOTION;
  };
} omni_law;

// Rate limiter of a twist; see `TwistLimits`. The changing state is in `TwistLimiterState`.
//
// `TwistLimits::PerAxis` is three `RateLimiter`s. `TwistLimits::AlongMotion` first scales the target so that it
// obeys both speed limits. The change D of the twist that is left is then done in part: one factor for vx, vy and wz,
// the largest that both groups, linear and yaw, allow. A group decelerates while its part of D has a component against
// its velocity. A jerk limit looks ahead along D as `RateLimiter` does, and also limits the change of the
// acceleration by one factor. A target that stays is reached exactly; from rest, along a straight line and without
// overshoot. Only where a changed target finds an acceleration that points elsewhere and would carry a group out of
// its limits does that group first reduce its acceleration, separately.
typedef struct {
  omni_law law;
} omni_limiter;

// Turns the commands that arrive into a twist every control period: rejects invalid commands, expires old commands,
// keeps the limits and stops in an emergency. The changing state is in `ShaperState`.
//
// A rejected command counts as none: the last valid command stays in force until it expires. A command that expires is
// followed by rest, within the limits and no harder than an emergency stop, which has its own deceleration and no jerk
// limit. After its release commands are followed from the velocity reached.
typedef struct {
  omni_limiter limiter;
  // The highest age at which a command counts.
  uint32_t oldest;
  // Linear and yaw speed that an emergency stop removes per period.
  float emergency_steps[2];
  // Only a command of rest ends rest.
  bool neutral;
} omni_shaper;

// When a wheel counts as slipping. Hysteresis in size and time. Checked by `SlipDetector::new`.
typedef struct {
  // Slip [rad/s] of the actuator above which a wheel is suspected, 1e-9 or more; infinite never.
  float enter_rad_s;
  // Slip [rad/s] below which it is trusted again, 0 to `enter_rad_s`.
  float leave_rad_s;
  // Control periods in a row that a wheel must be suspected before it is left out, 1 to 65535.
  uint16_t enter_periods;
  // Consecutive control periods below `leave_rad_s` before it is included again, 1 to 65535.
  uint16_t leave_periods;
} omni_slip_config;

// Finds the wheel that slips and estimates the motion without it.
typedef struct {
  omni_slip_config config;
} omni_slip_detector;

// When a reading is rejected. An infinite velocity or torque, or a count of 65535 periods, switches its check off.
// Checked by `FaultMonitor::new`.
typedef struct {
  // Largest change [rad/s] of an actuator's velocity within one period, 1e-9 or more: a
  // reading further from the last accepted one is held back.
  float jump_rad_s;
  // Periods a jump is bridged with the last accepted reading; then the wheel is faulty. Good
  // readings between jumps count against jumps one by one. 1 to 65535.
  uint16_t jump_periods;
  // A reading that stays exactly the same while the velocity that the other wheels imply changes by more than this
  // [rad/s] is stuck, 1e-9 or more. After ten times as long, a reading is also stuck if it stays exactly 0 while
  // the other wheels imply a velocity above this and its loop applies torque without effect towards its reference.
  // Also how well a faulty wheel must agree with the others to be accepted again.
  float stuck_rad_s;
  // A reading that stays exactly the same while the motor is commanded to apply at least this torque [N.m] towards
  // the reference, or while the reference differs by more than `stuck_rad_s`, is stuck after ten times
  // `stuck_periods`, 1e-9 or more. A reading of 0 that the other wheels can check is stuck once they imply that the
  // wheel has turned by `stuck_rad_s` in that time. Of three wheels, which cannot check each other, one of 0 or so
  // far away is stuck after `stuck_periods` if another wheel turns faster than `stuck_rad_s`. A wheel that is
  // blocked while others turn looks the same. If another wheel is pulled as hard and reads 0 too, the vehicle may
  // stand before an obstacle, or encoders of one supply are dead: of more than three wheels both are then stuck
  // after twenty times `stuck_periods`.
  float stuck_torque_n_m;
  // Periods of evidence in a row that make a reading stuck, 2 to 65535.
  uint16_t stuck_periods;
  // Periods without a reading after which a wheel is faulty, 1 to 65535; until then its last reading stands.
  uint16_t silent_periods;
  // Good readings in a row after which a faulty wheel (never one declared lost) is accepted
  // again, 1 to 65535: readings without a jump that agree with the other wheels as far as these
  // determine it, from a stuck wheel readings that change.
  uint16_t recovery_periods;
} omni_fault_config;

// Watches the readings of all wheels. Immutable; the changing state is in `FaultState`.
typedef struct {
  omni_fault_config config;
} omni_fault_monitor;

// Dead reckoning of a vehicle with `N` wheels. Immutable; the changing state is in `OdometryState`.
//
// The maps are passed to each call: a caller that distrusts a wheel may pass another forward map, or the displacement
// itself. In `f32` positions of 5000 rad come in steps of 5e-4 rad; that does not add up, because differences of
// positions are exact.
//
// Largest distance of `f32` from `f64` over 1,000,000 steps of 1 ms at 0.3 m/s, that is 300 m, by the seven wheels of
// `WheelLayout::chugo7`:
//
// | path | as here | plain sums (`PlanarPose::moved_by`) |
// |---|---|---|
// | winding and lateral, ending far away | 0.05 mm | 36 mm |
// | the same in circles of 6 m radius | 0.005 mm | 0.4 mm |
// | straight forward | 0.06 mm | 2.6 m |
//
// From positions instead of velocities the first column is at most 0.14 mm.
typedef struct {
  float period_s;
} omni3_odometry;

// Speed limits of the actuators, and the part of a twist that is kept within them: desaturation, or normalisation, of
// wheel speeds.
typedef struct {
  float limit_rad_s[3];
  omni_desaturation desaturation;
} omni3_speed_limits;

// Grows a `PoseCovariance` along with the pose. Immutable.
//
// `P' = F P F^T + G (J diag(q) J^T) G^T`, F and G being the derivatives of the exact step by the pose and by the
// displacement, and J the forward map.
//
// Limits: it has no model of bias. A wrong wheel radius, a wrong layout, a bent axle or a wheel that always slips in
// one direction cause errors that grow with the distance, not with its root, and are not included. Wheels are assumed
// independent. To first order: beyond a yaw deviation of some 0.3 rad the true distribution is no longer an ellipse.
// It only grows; including a measurement is the task of a filter.
//
// In `f32` the sums are plain: 100,000 steps at 0.3 m/s and 100 Hz leave it 0.5 % from `f64`, and the increment of a
// step is lost once it is below 6e-8 of the sum, after some ten million steps. If that matters, step it every tenth
// period, with the increments summed.
//
// The usual name: first-order propagation of errors, the prediction of an extended Kalman filter.
typedef struct {
  // k^2 [rad].
  float per_rad;
  // g.
  float per_residual;
} omni_covariance_growth;

// A vehicle's whole controller: readings and commands in, torques out. Immutable; the changing state is in
// `DriveState`.
//
// In order: readings are judged, faulty wheels are released, and the motion is estimated from the remaining wheels;
// the command is checked, limited, moved to the origin and scaled to the wheels' speed limits; the loops run; the pose
// is integrated.
typedef struct {
  omni3_controller controller;
  omni_shaper shaper;
  omni_slip_detector slip;
  omni_fault_monitor faults;
  omni3_odometry odometry;
  // Without effect unless `limits_speed`.
  omni3_speed_limits speed_limits;
  // Without effect unless `grows_covariance`.
  omni_covariance_growth growth;
  float command_point_m[2];
  float period_s;
  uint16_t unobservable_periods;
  bool limits_speed;
  bool grows_covariance;
  bool discretize;
} omni3_drive;

// State of a drive. Private.
typedef struct {
  uint32_t ready;
  uint32_t memory[128];
} omni3_drive_state;

// Position and heading of the vehicle's origin in the world.
typedef struct {
  // World x [m].
  float x_m;
  // World y [m].
  float y_m;
  // Heading [rad], 0 along world x (counter-clockwise is +).
  float yaw_rad;
} omni_pose;

// What a step reports. Nothing in it is ever NaN.
typedef struct {
  // Torques to apply [N.m], always within the motors' limits.
  omni3_torques torques;
  // Torques that the loops requested [N.m].
  omni3_torques requested;
  // References of the loops [rad/s].
  omni3_velocities references;
  // Velocities that the loops used [rad/s]; 0 for a wheel that is not `active`.
  omni3_velocities measured;
  // Command within all limits, of the origin.
  omni_twist twist;
  // Twist of the vehicle, by its wheels; 0 unless `motion_known`.
  omni_twist estimated;
  // Pose of the vehicle, by its wheels.
  omni_pose pose;
  // How far the vehicle can be relied on.
  omni_drive_mode mode;
  // Why the twist is what it is.
  omni_command_status status;
  // A command arrived and was rejected: it is no number, or beyond 1e6.
  bool rejected;
  // Enough wheels determine the motion; otherwise the pose does not change.
  bool motion_known;
  // The fault of each wheel.
  omni_fault faults[3];
  // The wheel was controlled. One that is not has no torque, and its bridge is opened or
  // shorted: it has a fault, or all torque has ended at rest.
  bool active[3];
  // The requested torque is outside the limits.
  bool saturated[3];
  // The wheel is excluded from the motion: faulty, lifted or slipping.
  bool excluded[3];
  // The motor's windings shall be shorted. In a safe stop and an emergency stop: the wheel has a
  // fault, so that no torque can be asked of it, or all torque has ended. At rest otherwise: all
  // torque has ended, and the scenario asks for it (`control.rest.short_windings`).
  bool brake[3];
} omni3_drive_output;

// What arrived since the period before. All zero: nothing did, every wheel is on flat ground,
// motors have their own limits.
typedef struct {
  // The command; used only if `commanded`.
  omni_twist command;
  // Actuator velocities [rad/s]; each used only if it was `received`.
  omni3_velocities measured;
  // Torques [N.m] that the motors shall keep within besides their own limits: a hot motor, a low
  // battery. Each used only if `limited`. 0 is always within.
  omni3_torque_ranges torque_ranges;
  // Path of each wheel over path of the body beneath it, 0.01 to 100; any other number counts as 1, flat ground.
  float path_factor[3];
  // A command arrived. If none does for the time-out, the vehicle is brought to rest.
  bool commanded;
  // The emergency stop is pressed: the vehicle comes to rest at the emergency deceleration, whatever is
  // commanded, and stays there as long as this is true. The caller has to latch a momentary button.
  bool emergency;
  // The encoder's reading arrived.
  bool received[3];
  // The wheel is in the air: it is controlled, but excluded from the vehicle's motion.
  bool lifted[3];
  // `torque_ranges` holds for this motor.
  bool limited[3];
} omni3_drive_input;

// Sequence of retries if the vehicle is stuck.
typedef struct {
  // Retries a row at most, 0 to 100; 0: none.
  uint16_t retries;
  // Backs off so fast [m/s], 0.001 to 100, and so far [m], 0 to 100; further by so much each try, up to so far.
  float back_off_m_s;
  // Distance of the first retry [m].
  float back_off_m;
  // Increment of the distance per retry [m].
  float back_off_more_m;
  // No further than this [m].
  float back_off_max_m;
  // The same for the first row, which has nothing behind it that could fall off an edge: further
  // each time, and at most [m].
  float first_row_more_m;
  // No further than this for the first row [m].
  float first_row_max_m;
  // Slow retries: at `slow_retry_m_s`, without slip allowed and without spin.
  uint16_t slow_retries;
  // Speed of these [m/s], 0.001 to 100.
  float slow_retry_m_s;
  // Speed of the run-up of the first try after these [m/s], 0.001 to 100.
  float run_up_m_s;
  // Increment of the speed per retry [m/s], 0 to 100.
  float run_up_more_m_s;
  // A run-up lasts no longer [s], 0.001 to 100, unless its speed takes longer for the way that was backed off.
  float run_up_s;
  // No run-up is faster than so many times the command, 1 to 100.
  float run_up_times;
  // It ends where the vehicle is stuck again for this time [s]; 0: only with its time.
  float stuck_again_s;
  // Slip that the climbing row is allowed for each try [m/s], 0 to 100.
  float allowance_m_s;
  // Slip that it is spun up to in a run-up [m/s], 0 to 100; 0: not at all.
  float spin_m_s;
  // Increment per retry [m/s], 0 to 100.
  float spin_more_m_s;
  // Gain of that, in multiples of the thrust's, 0 to 100.
  float spin_gain;
  // Part of the speed of a try that succeeded with which later rows are approached, 0 to 1.
  float later_rows_part;
  // Part of the spin with which they are, 0 to 1.
  float later_rows_spin;
} omni_retry_schedule;

// Speeds, times and places of a `Supervisor`.
typedef struct {
  // Control period [s], 1e-6 to 10.
  float period_s;
  // The target speed changes no faster [m/s^2], 0.001 to 1e6.
  float acceleration_m_s2;
  // It is never above this, forward and lateral [m/s], each 0.001 to 100.
  float max_m_s[2];
  // Part of the commanded speed by which it is raised for the second row, and for those behind it, 0 to 10.
  float boost[2];
  // A row that stands higher than the next by this is up [m], 0.0001 to 99.
  float height_m;
  // At this height the speed is raised by the whole of `boost`, in proportion below [m]: `height_m` + 0.0001 to
  // 100.
  float boost_height_m;
  // The vehicle is stuck below this speed [m/s], or this part of its target, above this part
  // of the largest thrust, for this long [s].
  float stuck_m_s;
  // Part of the target below which it is stuck, 0 to 1.
  float stuck_part;
  // Part of the largest thrust above which it is, 0 to 1.
  float stuck_thrust;
  // Time for which it is [s], 0.001 to 100.
  float stuck_s;
  // Thrust that carries the vehicle's weight, as a multiple of the largest thrust, 0.01 to 1000. A vehicle that
  // pushes for seconds with a fifth of its weight, beyond what the slope takes, is stuck though its wheels turn.
  float weight_thrust;
  // Nothing counts as stuck so shortly after the vehicle was commanded to go [s], 0 to 100.
  float starting_s;
  // All rows level for this long: the obstacle is behind [s], 0 to 100.
  float level_s;
  // Highest edge that the vehicle climbs, by a climb chart [m], 0.001 to 100; 100 if no chart is known. Where a
  // wheel has climbed a higher one there is one retry at most.
  float climbs_m;
  // Action if it is stuck.
  omni_retry_schedule retry;
} omni_supervisor_config;

// Chooses the target speed of a `Traction`. Immutable.
//
// It knows which row of wheels climbs next from how high the rows stand. Rows behind the first need a run-up, because
// an impact absorbs most of the vehicle's energy. A vehicle that pushes with its full thrust and does not move backs
// off and retries.
typedef struct {
  omni_supervisor_config config;
  // Row of each wheel from the front, and from the left; how many rows there are.
  uint16_t rows[2][3];
  uint16_t counts[2];
} omni3_supervisor;

// A hinge on the way from the base outwards.
typedef struct {
  // Slot of the parent, and which of the readings is its angle.
  uint16_t parent;
  uint16_t reading;
  // What a radian of it adds to how the child's nose, and its left side, point up.
  float nose_up;
  float left_up;
  // From the parent's reference point to its own [m].
  float arm_m[3];
} omni_joint;

// The tree of a vehicle's bodies, and the wheels on it.
typedef struct {
  omni_joint joints[OMNI_MAX_HINGES];
  uint16_t count;
  // Slot of the carrier of each wheel: 0 the base, k + 1 the child of joint k.
  uint16_t carrier[3];
  // From the carrier's reference point to each wheel [m].
  float arm_m[3][3];
} omni3_linkage;

// Known properties of the sensors and motors of a traction control, which determine its time constants. Start from
// `TractionSensors::perfect`.
typedef struct {
  // Counts of an encoder in a turn of the actuator, where its reading is whole counts over the
  // period, fractions allowed; 0: it is not.
  float encoder_counts;
  // Standard deviation of a wheel's reading [rad/s], 0 to 100.
  float encoder_noise_rad_s;
  // Standard deviation of the gyro's reading [rad/s], 0 to 100.
  float gyro_noise_rad_s;
  // Age of the readings [s], 0 to 0.03.
  float delay_s;
  // Time constant of the motors' torque [s], 0 to 0.03.
  float lag_s;
} omni_traction_sensors;

// Gains and times of a traction control. Start from `TractionConfig::traction` or
// `TractionConfig::traction_runup`.
//
// Gains beside the thrust's own are in multiples of it, so that they fit another vehicle as soon as that one does.
typedef struct {
  // Control period [s], 1e-6 to 10.
  float period_s;
  // Known properties of sensors and motors. Times and dead zones below hold for perfect ones; these lengthen
  // them.
  omni_traction_sensors sensors;
  // Thrust of every driven wheel per lack of speed, as a rate of its actuator [N.m.s/rad], 0 to 1e6.
  float thrust_gain_n_m_s_rad;
  // The same per integral of it [N.m/rad], 0 to 1e6: what carries the vehicle up a ramp. It
  // does not wind up at the limit.
  float thrust_integral_n_m_rad;
  // Part of the gain that is left where next to no speed is lacking, 0 to 1; 1 leaves it whole.
  float soft_part;
  // Inverse of the lack at which the whole gain is there [s/rad], 0 to 1e6.
  float soft_s_rad;
  // Proportional gain of a wheel's own velocity loop [N.m.s/rad], 0 to 1e6: of wheels across
  // the direction of travel always, of all wheels without traction control.
  float free_gain_n_m_s_rad;
  // Integral gain of the same loop [N.m/rad], 0 to 1e6.
  float free_integral_n_m_rad;
  // Time constant of the measured speed [s], 0 to 10; one period or less follows at once.
  float speed_s;
  // The measured speed rises no faster [m/s^2], 0.001 to 1e6.
  float acceleration_m_s2;
  // Time constant of the rates of hinges and base [s], 0 to 10.
  float rates_s;
  // Time in which a wheel's slip is removed, by its own inertia [s], 1e-6 to 10.
  float slip_s;
  // Slip that is left alone, as a speed of the rim [m/s], 0 to 100.
  float slip_free_m_s;
  // Further slip at which a wheel applies only the torque that the ground transmits and none of the common thrust
  // [m/s], 1e-6 to 100.
  float slip_width_m_s;
  // Time constant of the estimated torque to the ground [s], 0 to 10.
  float contact_s;
  // Yaw rate that wheels are meant to have per heading error [1/s], 0 to 1000.
  float heading_per_s;
  // Thrust per heading error: this times the thrust's gain times the wheel's rate per yaw rate [1/s], 0 to 1000.
  float heading_thrust_per_s;
  // The same per error of the yaw rate, 0 to 100.
  float yaw_damping;
  // The higher wheel of a row pushes less: this times the thrust's gain, per angle of its
  // carrier [1/s], 0 to 1000.
  float levelling_per_s;
  // Part of the largest thrust from which on rows are levelled, 0 to 0.99.
  float levelling_from;
  // Time constant with which the heading error is given up while the vehicle leans on a riser to
  // square up [s], 0.001 to 1000.
  float squaring_s;
  // Longest memory of the gyro's zero [s], 0 to 3600; 0 leaves the zero as it is.
  float gyro_zero_s;
  // It is found only below this part of the largest thrust, 0 to 1.
  float gyro_zero_part;
  // Largest zero offset [rad/s], 0 to 100: from the gyro's datasheet.
  float gyro_zero_max_rad_s;
} omni_traction_config;

// Times and dead zones that fit sensors, motors and wheels.
typedef struct {
  // Angle of the actuator that one count of its encoder is [rad]; 0 if readings are not counts.
  float count_rad;
  // Time over which a rate is best read from them [s].
  float window_s;
  float slip_s;
  float contact_s;
  float speed_s;
  // Slip that is left alone, and its inverse [m/s, s/m].
  float free_m_s;
  float per_free_s_m;
  // Part of a speed that counts and noise mask [m/s]: counts of slow wheels are also late.
  float hidden_m_s;
  float width_m_s;
  float integral_n_m_rad;
  // Gain of the common thrust.
  float thrust_gain_n_m_s_rad;
  // Gains of a wheel's own loop.
  float own_gain_n_m_s_rad;
  float own_integral_n_m_rad;
  // Fraction of a gain that delay and lag alone leave.
  float late_part;
  // Of slower wheels counts come rarely [rad/s].
  float rare_rad_s;
} omni_traction_times;

// Traction control of one vehicle. Immutable; its state is a
// `TractionState`.
typedef struct {
  omni3_kinematics kinematics;
  omni3_linkage linkage;
  omni3_torque_limits limits;
  float inertia_kg_m2[3];
  float carrier[3][2];
  // Way along the push per turn of the actuator [m/rad].
  float way_m_rad[3];
  float place_m[3][2];
  omni_traction_config config;
  omni_traction_times times;
  // Largest rate of a wheel per yaw rate.
  float per_yaw;
  // Inverses of how far the outermost wheels are to the side, for travel along x and along y [1/m].
  float per_lever[2];
} omni3_traction;

// A `Drive` with traction control in place of the wheels' loops: everything around them is the drive's.
//
// Wheels that the fault monitor excludes, and wheels without a reading, get no torque and do not count for the speed.
// `torque_ranges` of the input also apply here. In a stop nothing is tried any more: no back-off, no run-up.
typedef struct {
  omni3_drive drive;
  omni3_supervisor supervisor;
  omni3_traction traction;
} omni3_traction_drive;

// State of a drive with traction control. Private.
typedef struct {
  uint32_t ready;
  uint32_t memory[399];
} omni3_traction_drive_state;

// What a step with traction control reports. Nothing in it is ever NaN.
typedef struct {
  // What a drive reports, torques to apply among it.
  omni3_drive_output drive;
  // Measured speed over the commanded, -1 to 1; 1 where none is commanded.
  float factor;
  // Measured speed along the direction of travel [m/s].
  float speed_m_s;
  // The target that it follows [m/s].
  float target_m_s;
  // Common thrust [N.m].
  float thrust_n_m;
  // Yaw rate [rad/s].
  float yaw_rad_s;
  // Speed across the direction of travel, to the left [m/s].
  float drift_m_s;
  // Heading error [rad], counter-clockwise positive.
  float heading_rad;
  // The gyro's zero [rad/s].
  float gyro_zero_rad_s;
  // Slip of each driven wheel along the direction of travel [rad/s]; 0 of the others.
  float slip_rad_s[3];
  // What the ground takes of each driven wheel's torque [N.m], by its own estimate; 0 of the others.
  float contact_n_m[3];
  // Retries so far.
  uint32_t retries;
  // Index of the wheel that the measured speed hangs on, the slowest that pushes, or the fastest
  // where all brake; -1 where there is none.
  int8_t speed_wheel;
  // The control mode of the wheels.
  omni_traction_loops loops;
  // What the choice of the target speed is at.
  omni_supervisor_mode supervisor;
} omni3_traction_drive_output;

// Readings of an inertial measurement unit on the base, in the base's axes: x forward, y left, z up.
typedef struct {
  // Turning rates about x, y and z [rad/s]: a gyro.
  float rate_rad_s[3];
  // Acceleration less gravity [m/s^2]: an accelerometer. At rest it is 9.81 upwards.
  float specific_force_m_s2[3];
  // Angle of the base's y axis above the horizon [rad]: left side up is positive.
  float roll_rad;
  // Angle of the base's x axis above the horizon [rad]: nose up is positive.
  float pitch_rad;
} omni_imu;

// What the vehicle's bodies are read to do. All zero: nothing is read, and traction control does
// with the wheels' encoders.
typedef struct {
  // Angle of each hinge [rad], in the order of the vehicle file; NaN if it was not read.
  // Used only if `hinges_received`.
  float hinges_rad[OMNI_MAX_HINGES];
  // Their rates [rad/s].
  float hinges_rad_s[OMNI_MAX_HINGES];
  // Inertial measurement unit of the base; used only if `imu_received`.
  omni_imu imu;
  // Height of the edge that a wheel has climbed in this period [m]; 0 if none has, or if nothing measures it.
  float climbed_m;
  // The hinges' readings arrived.
  bool hinges_received;
  // The unit's reading arrived.
  bool imu_received;
} omni_body_readings;

// Assumptions of an `Estimator` about its sensors and its ground; checked by
// `Estimator::new`. Every standard deviation applies to one reading.
typedef struct {
  // Time between steps [s], 1e-6 to 10.
  float period_s;
  // Noise of a wheel's velocity [rad/s], 1e-6 to 1000; 0.1. For what a counter counts in a period, a count over
  // `sqrt(6 * period_s * 0.05 s)`: errors of neighbours cancel.
  float wheel_rad_s;
  // Noise of the gyro [rad/s], 1e-6 to 1000; 0.01.
  float gyro_rad_s;
  // Noise of the accelerometer [m/s^2], 1e-6 to 1000; 0.05.
  float accelerometer_m_s2;
  // Random walk of the velocity without an accelerometer reading [m/s per root of s], 1e-6 to 1000; 0.3: by 1
  // m/s^2 for a tenth of a second, repeatedly.
  float wander_m_s_per_sqrt_s;
  // Deviation of the gyro's bias at the start [rad/s], 1e-6 to 1000; 0.02.
  float bias_rad_s;
  // Random walk of the bias [rad/s per root of s], 1e-9 to 1000; 1e-4.
  float bias_walk_rad_s_per_sqrt_s;
  // Deviation of the accelerometer's bias at the start, or of what a lean adds that is not measured [m/s^2], 1e-6
  // to 1000; 0.05.
  float accelerometer_bias_m_s2;
  // Random walk of it [m/s^2 per root of s], 1e-9 to 1000; 0.01: an attitude that levels the readings and
  // wanders by 1 mrad per root of s.
  float accelerometer_bias_walk_m_s2_per_sqrt_s;
  // Slip of the whole vehicle that goes unnoticed while its wheels agree [m/s], 1e-6 to 1000; 0.001.
  float slip_m_s;
  // Time in which a slip comes and goes [s], 1e-3 to 100; 0.2. At least the period.
  float slip_s;
  // Averages over 50 ms up to which a vehicle whose command is rest stands: of the wheels beyond their
  // noise [rad/s], 0 to 1000; 0.05.
  float still_wheel_rad_s;
  // Root mean square of the gyro about its own average, beyond its noise [rad/s], 0 to 1000;
  // 0.05. The average itself has to be within four deviations of the estimated bias: initially four times
  // `bias_rad_s`.
  float still_gyro_rad_s;
  // Of each acceleration, beyond four deviations of its bias [m/s^2], 0 to 1000; 0.1.
  float still_m_s2;
} omni_estimator_config;

// The filter for a vehicle with `N` wheels. Immutable; the changing state is in `EstimatorState`.
//
// A reading of a wheel or of the gyro that differs from what is expected by more than it can change in a period is a
// jump of the sensor, and left out: for 10 ms or two periods, because what lasts is no jump, and for a seventh of the
// time.
//
// State: place and yaw in the world; velocity of the origin along the vehicle's heading; the gyro's bias;
// and the slip of all wheels together, as a twist that they show beyond the vehicle's own. Each period
//
// 1. gyro and accelerometer move the state (without accelerometer the velocity follows a random walk, without gyro the
//    wheels' yaw rate is used);
// 2. the slip is held against none, by as little as a slip says that lasts for `slip_s` and is
//    `slip_m_s`, as much as it is itself in any direction (wheels that slide hold in none) and as the
//    wheels disagree. It changes by as much, but in a period by no more than 400 times what the velocity
//    does (variances), which is little with an accelerometer. A body innovation beyond three deviations
//    widens it at once, by its excess (after Jazwinski, *Adaptive filtering*, Automatica 5, 1969);
// 3. every valid wheel reading is processed separately, its noise increased by its own residual (as variance
//    components are estimated from redundancy: Baarda, 1968). No matrix is inverted, and the covariance is updated in
//    Joseph's form. Its variances are never below 0.
//
// A vehicle that is commanded to rest and is quiet (wheels, gyro and accelerometer for 50 ms) has nearly no velocity.
// It may still glide or turn on free rollers, so that only after a second of quiet its pose is held, and the gyro's
// difference from the wheels' yaw rate is its bias: the vehicle trembles because its loops respond to encoder noise.
// What the accelerometer reads then is its bias, or a lean that is not measured. The gyro's bias is estimated only at
// rest: a wheel's slip in a turn is one-sided, and would be mistaken for it.
//
// The accelerometer's bias walks, because attitudes wander. It is followed while driving by a filter of two states
// for each direction, which takes the wheels for the vehicle with a slip of 2 cm/s, or as much as there is, that
// lasts half a second: a slip comes and goes, a bias stays. As far as it is unknown it adds to the noise of the
// velocity, with four of its deviations, so that none is taken for a slip that lasts. Friction takes a vehicle
// that slides towards the velocity of its wheels, or wheels that hold it disagree with the others; if neither is
// so for half a second, nothing is known of the bias any more.
//
// Limits: a bias that is off by b m/s^2 is b t m/s of error while all wheels slip for t seconds. A vehicle that slides
// down a slope with braked wheels, or is pushed, is taken for one that rolls.
typedef struct {
  omni_estimator_config config;
  omni3_kinematics kinematics;
  // Squares of the forward map: contribution of a wheel's variance to the variance of each axis.
  float shares[3][3];
  float redundancy[3];
  // Mean squared lever of the wheels [m^2]: turning by 1 rad/s is as much as its root in m/s.
  float lever_m2;
  // Change of a wheel's velocity in a period that is a jump of its encoder [rad/s].
  float jump_rad_s;
} omni3_estimator;

// State of an estimator. Private.
typedef struct {
  uint32_t ready;
  uint32_t memory[114];
} omni3_estimator_state;

// Standard deviations of the pose. All 0 if the drive has no noise.
typedef struct {
  // Of x [m].
  float x_m;
  // Of y [m].
  float y_m;
  // Of the heading [rad].
  float yaw_rad;
} omni_deviations;

// Pose and velocity of the vehicle, by an estimator. Nothing in it is ever NaN.
typedef struct {
  // Pose.
  omni_pose pose;
  // Its standard deviations.
  omni_deviations deviations;
  // Velocity.
  omni_twist twist;
  // Common slip of the wheels: their velocity less that.
  omni_twist slip;
  // Zero of the gyro [rad/s].
  float gyro_bias_rad_s;
  // Its standard deviation [rad/s].
  float gyro_bias_deviation_rad_s;
  // Covariance of the pose: x, y, yaw, in m and rad.
  float covariance[3][3];
  // Covariance of the forward and lateral velocity [m^2/s^2].
  float velocity_covariance[2][2];
  // Normalised innovation squared of the readings, summed
  // over all `readings`.
  float nis;
  // Number of these readings.
  uint32_t readings;
  // The vehicle stands.
  bool standing;
  // The step was taken; false if the state would be no number; it then stays.
  bool taken;
} omni_estimator_output;

// Readings of an estimator in a period. All zero: nothing is read.
typedef struct {
  // Actuator velocities [rad/s]; each used only if it was `received`.
  omni3_velocities measured;
  // Inertial measurement unit of the base; used only if `imu_received`.
  omni_imu imu;
  // The encoder's reading arrived.
  bool received[3];
  // The unit's reading arrived.
  bool imu_received;
  // The vehicle is commanded to stand.
  bool commanded_rest;
} omni3_estimator_input;

// The state of the loops between steps; `default` is a fresh start.
typedef struct {
  // Integral term of each wheel [N.m].
  float integral_n_m[4];
  // Derivative term of each wheel [N.m], after its filter.
  float derivative_n_m[4];
  // Reference of the step before, as realised [rad/s]; 0 without derivative and feed-forward.
  float last_reference_rad_s[4];
  // Measurement of the step before [rad/s]; 0 without derivative and feed-forward.
  float last_measured_rad_s[4];
  // The wheel has a step to compare with; only loops with a derivative or a feed-forward set it.
  bool started[4];
  // The overloaded wheels, and the time for which each other wheel has been beyond a limit.
  omni_overload overload;
  // Progress of the torque's end while every reference was 0.
  omni_rest_state rest;
} omni4_state;

// Actuator velocities, one per wheel in the layout's order, which kinematics maps and loops control.
typedef struct {
  // Velocity of each actuator [rad/s] (positive as the wheel's rolling direction says), any finite number.
  float rad_s[4];
} omni4_velocities;

// Actuator torques, one per wheel in the layout's order: a controller's request to the motors. Not a wheel velocity.
typedef struct {
  // Torque of each actuator [N.m] (positive drives the wheel in its rolling direction), any finite number.
  float n_m[4];
} omni4_torques;

// Torque limits of `N` wheels at their present velocities [N.m], in the layout's order.
typedef struct {
  // Lowest torque of each, <= 0.
  float lower_n_m[4];
  // Highest torque of each, >= 0.
  float upper_n_m[4];
} omni4_torque_ranges;

// Every signal of one control step, per wheel in the layout's order. Velocities [rad/s] and torques [N.m] are the
// actuators'. Nothing in it is ever NaN.
typedef struct {
  // Reference r as commanded, before any reduction.
  omni4_velocities reference;
  // Measurement y; 0 for a released wheel.
  omni4_velocities measured;
  // The wheel was controlled. One without a usable measurement is released: no torque, its loop
  // starts afresh. When the torque has `ended` no wheel is controlled.
  bool active[4];
  // Proportional term, formed with the reference as reduced by `common_factor` under
  // `Saturation::ScaleReferences`.
  float p_n_m[4];
  // Integral term, likewise.
  float i_n_m[4];
  // Derivative term, likewise.
  float d_n_m[4];
  // Feed-forward, likewise.
  float ff_n_m[4];
  // Torque that the loops request with the whole reference: the torque that actuators without limits would apply.
  omni4_torques requested;
  // Torque to apply, always within the limits.
  omni4_torques applied;
  // Limits at the present velocities.
  omni4_torque_ranges range;
  // The requested torque is outside the limits.
  bool saturated[4];
  // Factor on all torques (`Saturation::ScaleTorques`) or all references
  // (`Saturation::ScaleReferences`), 0 to 1; 1 under
  // `Saturation::Clip`.
  float common_factor;
  // Every reference has been 0 for long enough that all torque has ended: see
  // `Rest`. Bridges that are driven by voltage are then opened or shorted,
  // because the voltage for no torque follows from a velocity that may be measured wrongly.
  bool ended;
  // And the windings of all motors are to be shorted: `Rest::short_windings`.
  bool shorted;
} omni4_wheel_sample;

// Every signal of one step of a `Controller`.
typedef struct {
  // The command; rest if the one given was not finite, or beyond 1e6.
  omni_twist command;
  // The wheels' signals.
  omni4_wheel_sample wheels;
} omni4_sample;

// The two linear maps of one layout. Immutable, no allocation.
typedef struct {
  float inverse[4][3];
  float forward[3][4];
  float weights[4];
} omni4_kinematics;

// The limits of `N` actuators, their numbers side by side: loops over them run several at a time
// where the processor can.
typedef struct {
  float stall[4];
  float slope[4];
  float cap[4];
  // No limit depends on the velocity.
  bool constant;
} omni4_torque_limits;

// PID loops of `N` wheels with a coordination policy, without a vehicle around them.
typedef struct {
  omni_pid pid;
  omni4_torque_limits limits;
  omni_coordination coordination;
  omni_rest_rule rest;
} omni4_loops;

// A vehicle's controller: kinematics and wheel loops. Immutable; the changing state is in `ControlState`.
//
// The bare loop. `Drive` puts shaping, faults, slip and odometry around it.
typedef struct {
  omni4_kinematics kinematics;
  omni4_loops wheels;
} omni4_controller;

// Dead reckoning of a vehicle with `N` wheels. Immutable; the changing state is in `OdometryState`.
//
// The maps are passed to each call: a caller that distrusts a wheel may pass another forward map, or the displacement
// itself. In `f32` positions of 5000 rad come in steps of 5e-4 rad; that does not add up, because differences of
// positions are exact.
//
// Largest distance of `f32` from `f64` over 1,000,000 steps of 1 ms at 0.3 m/s, that is 300 m, by the seven wheels of
// `WheelLayout::chugo7`:
//
// | path | as here | plain sums (`PlanarPose::moved_by`) |
// |---|---|---|
// | winding and lateral, ending far away | 0.05 mm | 36 mm |
// | the same in circles of 6 m radius | 0.005 mm | 0.4 mm |
// | straight forward | 0.06 mm | 2.6 m |
//
// From positions instead of velocities the first column is at most 0.14 mm.
typedef struct {
  float period_s;
} omni4_odometry;

// Speed limits of the actuators, and the part of a twist that is kept within them: desaturation, or normalisation, of
// wheel speeds.
typedef struct {
  float limit_rad_s[4];
  omni_desaturation desaturation;
} omni4_speed_limits;

// A vehicle's whole controller: readings and commands in, torques out. Immutable; the changing state is in
// `DriveState`.
//
// In order: readings are judged, faulty wheels are released, and the motion is estimated from the remaining wheels;
// the command is checked, limited, moved to the origin and scaled to the wheels' speed limits; the loops run; the pose
// is integrated.
typedef struct {
  omni4_controller controller;
  omni_shaper shaper;
  omni_slip_detector slip;
  omni_fault_monitor faults;
  omni4_odometry odometry;
  // Without effect unless `limits_speed`.
  omni4_speed_limits speed_limits;
  // Without effect unless `grows_covariance`.
  omni_covariance_growth growth;
  float command_point_m[2];
  float period_s;
  uint16_t unobservable_periods;
  bool limits_speed;
  bool grows_covariance;
  bool discretize;
} omni4_drive;

// State of a drive. Private.
typedef struct {
  uint32_t ready;
  uint32_t memory[155];
} omni4_drive_state;

// What a step reports. Nothing in it is ever NaN.
typedef struct {
  // Torques to apply [N.m], always within the motors' limits.
  omni4_torques torques;
  // Torques that the loops requested [N.m].
  omni4_torques requested;
  // References of the loops [rad/s].
  omni4_velocities references;
  // Velocities that the loops used [rad/s]; 0 for a wheel that is not `active`.
  omni4_velocities measured;
  // Command within all limits, of the origin.
  omni_twist twist;
  // Twist of the vehicle, by its wheels; 0 unless `motion_known`.
  omni_twist estimated;
  // Pose of the vehicle, by its wheels.
  omni_pose pose;
  // How far the vehicle can be relied on.
  omni_drive_mode mode;
  // Why the twist is what it is.
  omni_command_status status;
  // A command arrived and was rejected: it is no number, or beyond 1e6.
  bool rejected;
  // Enough wheels determine the motion; otherwise the pose does not change.
  bool motion_known;
  // The fault of each wheel.
  omni_fault faults[4];
  // The wheel was controlled. One that is not has no torque, and its bridge is opened or
  // shorted: it has a fault, or all torque has ended at rest.
  bool active[4];
  // The requested torque is outside the limits.
  bool saturated[4];
  // The wheel is excluded from the motion: faulty, lifted or slipping.
  bool excluded[4];
  // The motor's windings shall be shorted. In a safe stop and an emergency stop: the wheel has a
  // fault, so that no torque can be asked of it, or all torque has ended. At rest otherwise: all
  // torque has ended, and the scenario asks for it (`control.rest.short_windings`).
  bool brake[4];
} omni4_drive_output;

// What arrived since the period before. All zero: nothing did, every wheel is on flat ground,
// motors have their own limits.
typedef struct {
  // The command; used only if `commanded`.
  omni_twist command;
  // Actuator velocities [rad/s]; each used only if it was `received`.
  omni4_velocities measured;
  // Torques [N.m] that the motors shall keep within besides their own limits: a hot motor, a low
  // battery. Each used only if `limited`. 0 is always within.
  omni4_torque_ranges torque_ranges;
  // Path of each wheel over path of the body beneath it, 0.01 to 100; any other number counts as 1, flat ground.
  float path_factor[4];
  // A command arrived. If none does for the time-out, the vehicle is brought to rest.
  bool commanded;
  // The emergency stop is pressed: the vehicle comes to rest at the emergency deceleration, whatever is
  // commanded, and stays there as long as this is true. The caller has to latch a momentary button.
  bool emergency;
  // The encoder's reading arrived.
  bool received[4];
  // The wheel is in the air: it is controlled, but excluded from the vehicle's motion.
  bool lifted[4];
  // `torque_ranges` holds for this motor.
  bool limited[4];
} omni4_drive_input;

// Chooses the target speed of a `Traction`. Immutable.
//
// It knows which row of wheels climbs next from how high the rows stand. Rows behind the first need a run-up, because
// an impact absorbs most of the vehicle's energy. A vehicle that pushes with its full thrust and does not move backs
// off and retries.
typedef struct {
  omni_supervisor_config config;
  // Row of each wheel from the front, and from the left; how many rows there are.
  uint16_t rows[2][4];
  uint16_t counts[2];
} omni4_supervisor;

// The tree of a vehicle's bodies, and the wheels on it.
typedef struct {
  omni_joint joints[OMNI_MAX_HINGES];
  uint16_t count;
  // Slot of the carrier of each wheel: 0 the base, k + 1 the child of joint k.
  uint16_t carrier[4];
  // From the carrier's reference point to each wheel [m].
  float arm_m[4][3];
} omni4_linkage;

// Traction control of one vehicle. Immutable; its state is a
// `TractionState`.
typedef struct {
  omni4_kinematics kinematics;
  omni4_linkage linkage;
  omni4_torque_limits limits;
  float inertia_kg_m2[4];
  float carrier[4][2];
  // Way along the push per turn of the actuator [m/rad].
  float way_m_rad[4];
  float place_m[4][2];
  omni_traction_config config;
  omni_traction_times times;
  // Largest rate of a wheel per yaw rate.
  float per_yaw;
  // Inverses of how far the outermost wheels are to the side, for travel along x and along y [1/m].
  float per_lever[2];
} omni4_traction;

// A `Drive` with traction control in place of the wheels' loops: everything around them is the drive's.
//
// Wheels that the fault monitor excludes, and wheels without a reading, get no torque and do not count for the speed.
// `torque_ranges` of the input also apply here. In a stop nothing is tried any more: no back-off, no run-up.
typedef struct {
  omni4_drive drive;
  omni4_supervisor supervisor;
  omni4_traction traction;
} omni4_traction_drive;

// State of a drive with traction control. Private.
typedef struct {
  uint32_t ready;
  uint32_t memory[451];
} omni4_traction_drive_state;

// What a step with traction control reports. Nothing in it is ever NaN.
typedef struct {
  // What a drive reports, torques to apply among it.
  omni4_drive_output drive;
  // Measured speed over the commanded, -1 to 1; 1 where none is commanded.
  float factor;
  // Measured speed along the direction of travel [m/s].
  float speed_m_s;
  // The target that it follows [m/s].
  float target_m_s;
  // Common thrust [N.m].
  float thrust_n_m;
  // Yaw rate [rad/s].
  float yaw_rad_s;
  // Speed across the direction of travel, to the left [m/s].
  float drift_m_s;
  // Heading error [rad], counter-clockwise positive.
  float heading_rad;
  // The gyro's zero [rad/s].
  float gyro_zero_rad_s;
  // Slip of each driven wheel along the direction of travel [rad/s]; 0 of the others.
  float slip_rad_s[4];
  // What the ground takes of each driven wheel's torque [N.m], by its own estimate; 0 of the others.
  float contact_n_m[4];
  // Retries so far.
  uint32_t retries;
  // Index of the wheel that the measured speed hangs on, the slowest that pushes, or the fastest
  // where all brake; -1 where there is none.
  int8_t speed_wheel;
  // The control mode of the wheels.
  omni_traction_loops loops;
  // What the choice of the target speed is at.
  omni_supervisor_mode supervisor;
} omni4_traction_drive_output;

// The filter for a vehicle with `N` wheels. Immutable; the changing state is in `EstimatorState`.
//
// A reading of a wheel or of the gyro that differs from what is expected by more than it can change in a period is a
// jump of the sensor, and left out: for 10 ms or two periods, because what lasts is no jump, and for a seventh of the
// time.
//
// State: place and yaw in the world; velocity of the origin along the vehicle's heading; the gyro's bias;
// and the slip of all wheels together, as a twist that they show beyond the vehicle's own. Each period
//
// 1. gyro and accelerometer move the state (without accelerometer the velocity follows a random walk, without gyro the
//    wheels' yaw rate is used);
// 2. the slip is held against none, by as little as a slip says that lasts for `slip_s` and is
//    `slip_m_s`, as much as it is itself in any direction (wheels that slide hold in none) and as the
//    wheels disagree. It changes by as much, but in a period by no more than 400 times what the velocity
//    does (variances), which is little with an accelerometer. A body innovation beyond three deviations
//    widens it at once, by its excess (after Jazwinski, *Adaptive filtering*, Automatica 5, 1969);
// 3. every valid wheel reading is processed separately, its noise increased by its own residual (as variance
//    components are estimated from redundancy: Baarda, 1968). No matrix is inverted, and the covariance is updated in
//    Joseph's form. Its variances are never below 0.
//
// A vehicle that is commanded to rest and is quiet (wheels, gyro and accelerometer for 50 ms) has nearly no velocity.
// It may still glide or turn on free rollers, so that only after a second of quiet its pose is held, and the gyro's
// difference from the wheels' yaw rate is its bias: the vehicle trembles because its loops respond to encoder noise.
// What the accelerometer reads then is its bias, or a lean that is not measured. The gyro's bias is estimated only at
// rest: a wheel's slip in a turn is one-sided, and would be mistaken for it.
//
// The accelerometer's bias walks, because attitudes wander. It is followed while driving by a filter of two states
// for each direction, which takes the wheels for the vehicle with a slip of 2 cm/s, or as much as there is, that
// lasts half a second: a slip comes and goes, a bias stays. As far as it is unknown it adds to the noise of the
// velocity, with four of its deviations, so that none is taken for a slip that lasts. Friction takes a vehicle
// that slides towards the velocity of its wheels, or wheels that hold it disagree with the others; if neither is
// so for half a second, nothing is known of the bias any more.
//
// Limits: a bias that is off by b m/s^2 is b t m/s of error while all wheels slip for t seconds. A vehicle that slides
// down a slope with braked wheels, or is pushed, is taken for one that rolls.
typedef struct {
  omni_estimator_config config;
  omni4_kinematics kinematics;
  // Squares of the forward map: contribution of a wheel's variance to the variance of each axis.
  float shares[3][4];
  float redundancy[4];
  // Mean squared lever of the wheels [m^2]: turning by 1 rad/s is as much as its root in m/s.
  float lever_m2;
  // Change of a wheel's velocity in a period that is a jump of its encoder [rad/s].
  float jump_rad_s;
} omni4_estimator;

// State of an estimator. Private.
typedef struct {
  uint32_t ready;
  uint32_t memory[115];
} omni4_estimator_state;

// Readings of an estimator in a period. All zero: nothing is read.
typedef struct {
  // Actuator velocities [rad/s]; each used only if it was `received`.
  omni4_velocities measured;
  // Inertial measurement unit of the base; used only if `imu_received`.
  omni_imu imu;
  // The encoder's reading arrived.
  bool received[4];
  // The unit's reading arrived.
  bool imu_received;
  // The vehicle is commanded to stand.
  bool commanded_rest;
} omni4_estimator_input;

// The state of the loops between steps; `default` is a fresh start.
typedef struct {
  // Integral term of each wheel [N.m].
  float integral_n_m[5];
  // Derivative term of each wheel [N.m], after its filter.
  float derivative_n_m[5];
  // Reference of the step before, as realised [rad/s]; 0 without derivative and feed-forward.
  float last_reference_rad_s[5];
  // Measurement of the step before [rad/s]; 0 without derivative and feed-forward.
  float last_measured_rad_s[5];
  // The wheel has a step to compare with; only loops with a derivative or a feed-forward set it.
  bool started[5];
  // The overloaded wheels, and the time for which each other wheel has been beyond a limit.
  omni_overload overload;
  // Progress of the torque's end while every reference was 0.
  omni_rest_state rest;
} omni5_state;

// Actuator velocities, one per wheel in the layout's order, which kinematics maps and loops control.
typedef struct {
  // Velocity of each actuator [rad/s] (positive as the wheel's rolling direction says), any finite number.
  float rad_s[5];
} omni5_velocities;

// Actuator torques, one per wheel in the layout's order: a controller's request to the motors. Not a wheel velocity.
typedef struct {
  // Torque of each actuator [N.m] (positive drives the wheel in its rolling direction), any finite number.
  float n_m[5];
} omni5_torques;

// Torque limits of `N` wheels at their present velocities [N.m], in the layout's order.
typedef struct {
  // Lowest torque of each, <= 0.
  float lower_n_m[5];
  // Highest torque of each, >= 0.
  float upper_n_m[5];
} omni5_torque_ranges;

// Every signal of one control step, per wheel in the layout's order. Velocities [rad/s] and torques [N.m] are the
// actuators'. Nothing in it is ever NaN.
typedef struct {
  // Reference r as commanded, before any reduction.
  omni5_velocities reference;
  // Measurement y; 0 for a released wheel.
  omni5_velocities measured;
  // The wheel was controlled. One without a usable measurement is released: no torque, its loop
  // starts afresh. When the torque has `ended` no wheel is controlled.
  bool active[5];
  // Proportional term, formed with the reference as reduced by `common_factor` under
  // `Saturation::ScaleReferences`.
  float p_n_m[5];
  // Integral term, likewise.
  float i_n_m[5];
  // Derivative term, likewise.
  float d_n_m[5];
  // Feed-forward, likewise.
  float ff_n_m[5];
  // Torque that the loops request with the whole reference: the torque that actuators without limits would apply.
  omni5_torques requested;
  // Torque to apply, always within the limits.
  omni5_torques applied;
  // Limits at the present velocities.
  omni5_torque_ranges range;
  // The requested torque is outside the limits.
  bool saturated[5];
  // Factor on all torques (`Saturation::ScaleTorques`) or all references
  // (`Saturation::ScaleReferences`), 0 to 1; 1 under
  // `Saturation::Clip`.
  float common_factor;
  // Every reference has been 0 for long enough that all torque has ended: see
  // `Rest`. Bridges that are driven by voltage are then opened or shorted,
  // because the voltage for no torque follows from a velocity that may be measured wrongly.
  bool ended;
  // And the windings of all motors are to be shorted: `Rest::short_windings`.
  bool shorted;
} omni5_wheel_sample;

// Every signal of one step of a `Controller`.
typedef struct {
  // The command; rest if the one given was not finite, or beyond 1e6.
  omni_twist command;
  // The wheels' signals.
  omni5_wheel_sample wheels;
} omni5_sample;

// The two linear maps of one layout. Immutable, no allocation.
typedef struct {
  float inverse[5][3];
  float forward[3][5];
  float weights[5];
} omni5_kinematics;

// The limits of `N` actuators, their numbers side by side: loops over them run several at a time
// where the processor can.
typedef struct {
  float stall[5];
  float slope[5];
  float cap[5];
  // No limit depends on the velocity.
  bool constant;
} omni5_torque_limits;

// PID loops of `N` wheels with a coordination policy, without a vehicle around them.
typedef struct {
  omni_pid pid;
  omni5_torque_limits limits;
  omni_coordination coordination;
  omni_rest_rule rest;
} omni5_loops;

// A vehicle's controller: kinematics and wheel loops. Immutable; the changing state is in `ControlState`.
//
// The bare loop. `Drive` puts shaping, faults, slip and odometry around it.
typedef struct {
  omni5_kinematics kinematics;
  omni5_loops wheels;
} omni5_controller;

// Dead reckoning of a vehicle with `N` wheels. Immutable; the changing state is in `OdometryState`.
//
// The maps are passed to each call: a caller that distrusts a wheel may pass another forward map, or the displacement
// itself. In `f32` positions of 5000 rad come in steps of 5e-4 rad; that does not add up, because differences of
// positions are exact.
//
// Largest distance of `f32` from `f64` over 1,000,000 steps of 1 ms at 0.3 m/s, that is 300 m, by the seven wheels of
// `WheelLayout::chugo7`:
//
// | path | as here | plain sums (`PlanarPose::moved_by`) |
// |---|---|---|
// | winding and lateral, ending far away | 0.05 mm | 36 mm |
// | the same in circles of 6 m radius | 0.005 mm | 0.4 mm |
// | straight forward | 0.06 mm | 2.6 m |
//
// From positions instead of velocities the first column is at most 0.14 mm.
typedef struct {
  float period_s;
} omni5_odometry;

// Speed limits of the actuators, and the part of a twist that is kept within them: desaturation, or normalisation, of
// wheel speeds.
typedef struct {
  float limit_rad_s[5];
  omni_desaturation desaturation;
} omni5_speed_limits;

// A vehicle's whole controller: readings and commands in, torques out. Immutable; the changing state is in
// `DriveState`.
//
// In order: readings are judged, faulty wheels are released, and the motion is estimated from the remaining wheels;
// the command is checked, limited, moved to the origin and scaled to the wheels' speed limits; the loops run; the pose
// is integrated.
typedef struct {
  omni5_controller controller;
  omni_shaper shaper;
  omni_slip_detector slip;
  omni_fault_monitor faults;
  omni5_odometry odometry;
  // Without effect unless `limits_speed`.
  omni5_speed_limits speed_limits;
  // Without effect unless `grows_covariance`.
  omni_covariance_growth growth;
  float command_point_m[2];
  float period_s;
  uint16_t unobservable_periods;
  bool limits_speed;
  bool grows_covariance;
  bool discretize;
} omni5_drive;

// State of a drive. Private.
typedef struct {
  uint32_t ready;
  uint32_t memory[184];
} omni5_drive_state;

// What a step reports. Nothing in it is ever NaN.
typedef struct {
  // Torques to apply [N.m], always within the motors' limits.
  omni5_torques torques;
  // Torques that the loops requested [N.m].
  omni5_torques requested;
  // References of the loops [rad/s].
  omni5_velocities references;
  // Velocities that the loops used [rad/s]; 0 for a wheel that is not `active`.
  omni5_velocities measured;
  // Command within all limits, of the origin.
  omni_twist twist;
  // Twist of the vehicle, by its wheels; 0 unless `motion_known`.
  omni_twist estimated;
  // Pose of the vehicle, by its wheels.
  omni_pose pose;
  // How far the vehicle can be relied on.
  omni_drive_mode mode;
  // Why the twist is what it is.
  omni_command_status status;
  // A command arrived and was rejected: it is no number, or beyond 1e6.
  bool rejected;
  // Enough wheels determine the motion; otherwise the pose does not change.
  bool motion_known;
  // The fault of each wheel.
  omni_fault faults[5];
  // The wheel was controlled. One that is not has no torque, and its bridge is opened or
  // shorted: it has a fault, or all torque has ended at rest.
  bool active[5];
  // The requested torque is outside the limits.
  bool saturated[5];
  // The wheel is excluded from the motion: faulty, lifted or slipping.
  bool excluded[5];
  // The motor's windings shall be shorted. In a safe stop and an emergency stop: the wheel has a
  // fault, so that no torque can be asked of it, or all torque has ended. At rest otherwise: all
  // torque has ended, and the scenario asks for it (`control.rest.short_windings`).
  bool brake[5];
} omni5_drive_output;

// What arrived since the period before. All zero: nothing did, every wheel is on flat ground,
// motors have their own limits.
typedef struct {
  // The command; used only if `commanded`.
  omni_twist command;
  // Actuator velocities [rad/s]; each used only if it was `received`.
  omni5_velocities measured;
  // Torques [N.m] that the motors shall keep within besides their own limits: a hot motor, a low
  // battery. Each used only if `limited`. 0 is always within.
  omni5_torque_ranges torque_ranges;
  // Path of each wheel over path of the body beneath it, 0.01 to 100; any other number counts as 1, flat ground.
  float path_factor[5];
  // A command arrived. If none does for the time-out, the vehicle is brought to rest.
  bool commanded;
  // The emergency stop is pressed: the vehicle comes to rest at the emergency deceleration, whatever is
  // commanded, and stays there as long as this is true. The caller has to latch a momentary button.
  bool emergency;
  // The encoder's reading arrived.
  bool received[5];
  // The wheel is in the air: it is controlled, but excluded from the vehicle's motion.
  bool lifted[5];
  // `torque_ranges` holds for this motor.
  bool limited[5];
} omni5_drive_input;

// Chooses the target speed of a `Traction`. Immutable.
//
// It knows which row of wheels climbs next from how high the rows stand. Rows behind the first need a run-up, because
// an impact absorbs most of the vehicle's energy. A vehicle that pushes with its full thrust and does not move backs
// off and retries.
typedef struct {
  omni_supervisor_config config;
  // Row of each wheel from the front, and from the left; how many rows there are.
  uint16_t rows[2][5];
  uint16_t counts[2];
} omni5_supervisor;

// The tree of a vehicle's bodies, and the wheels on it.
typedef struct {
  omni_joint joints[OMNI_MAX_HINGES];
  uint16_t count;
  // Slot of the carrier of each wheel: 0 the base, k + 1 the child of joint k.
  uint16_t carrier[5];
  // From the carrier's reference point to each wheel [m].
  float arm_m[5][3];
} omni5_linkage;

// Traction control of one vehicle. Immutable; its state is a
// `TractionState`.
typedef struct {
  omni5_kinematics kinematics;
  omni5_linkage linkage;
  omni5_torque_limits limits;
  float inertia_kg_m2[5];
  float carrier[5][2];
  // Way along the push per turn of the actuator [m/rad].
  float way_m_rad[5];
  float place_m[5][2];
  omni_traction_config config;
  omni_traction_times times;
  // Largest rate of a wheel per yaw rate.
  float per_yaw;
  // Inverses of how far the outermost wheels are to the side, for travel along x and along y [1/m].
  float per_lever[2];
} omni5_traction;

// A `Drive` with traction control in place of the wheels' loops: everything around them is the drive's.
//
// Wheels that the fault monitor excludes, and wheels without a reading, get no torque and do not count for the speed.
// `torque_ranges` of the input also apply here. In a stop nothing is tried any more: no back-off, no run-up.
typedef struct {
  omni5_drive drive;
  omni5_supervisor supervisor;
  omni5_traction traction;
} omni5_traction_drive;

// State of a drive with traction control. Private.
typedef struct {
  uint32_t ready;
  uint32_t memory[505];
} omni5_traction_drive_state;

// What a step with traction control reports. Nothing in it is ever NaN.
typedef struct {
  // What a drive reports, torques to apply among it.
  omni5_drive_output drive;
  // Measured speed over the commanded, -1 to 1; 1 where none is commanded.
  float factor;
  // Measured speed along the direction of travel [m/s].
  float speed_m_s;
  // The target that it follows [m/s].
  float target_m_s;
  // Common thrust [N.m].
  float thrust_n_m;
  // Yaw rate [rad/s].
  float yaw_rad_s;
  // Speed across the direction of travel, to the left [m/s].
  float drift_m_s;
  // Heading error [rad], counter-clockwise positive.
  float heading_rad;
  // The gyro's zero [rad/s].
  float gyro_zero_rad_s;
  // Slip of each driven wheel along the direction of travel [rad/s]; 0 of the others.
  float slip_rad_s[5];
  // What the ground takes of each driven wheel's torque [N.m], by its own estimate; 0 of the others.
  float contact_n_m[5];
  // Retries so far.
  uint32_t retries;
  // Index of the wheel that the measured speed hangs on, the slowest that pushes, or the fastest
  // where all brake; -1 where there is none.
  int8_t speed_wheel;
  // The control mode of the wheels.
  omni_traction_loops loops;
  // What the choice of the target speed is at.
  omni_supervisor_mode supervisor;
} omni5_traction_drive_output;

// The filter for a vehicle with `N` wheels. Immutable; the changing state is in `EstimatorState`.
//
// A reading of a wheel or of the gyro that differs from what is expected by more than it can change in a period is a
// jump of the sensor, and left out: for 10 ms or two periods, because what lasts is no jump, and for a seventh of the
// time.
//
// State: place and yaw in the world; velocity of the origin along the vehicle's heading; the gyro's bias;
// and the slip of all wheels together, as a twist that they show beyond the vehicle's own. Each period
//
// 1. gyro and accelerometer move the state (without accelerometer the velocity follows a random walk, without gyro the
//    wheels' yaw rate is used);
// 2. the slip is held against none, by as little as a slip says that lasts for `slip_s` and is
//    `slip_m_s`, as much as it is itself in any direction (wheels that slide hold in none) and as the
//    wheels disagree. It changes by as much, but in a period by no more than 400 times what the velocity
//    does (variances), which is little with an accelerometer. A body innovation beyond three deviations
//    widens it at once, by its excess (after Jazwinski, *Adaptive filtering*, Automatica 5, 1969);
// 3. every valid wheel reading is processed separately, its noise increased by its own residual (as variance
//    components are estimated from redundancy: Baarda, 1968). No matrix is inverted, and the covariance is updated in
//    Joseph's form. Its variances are never below 0.
//
// A vehicle that is commanded to rest and is quiet (wheels, gyro and accelerometer for 50 ms) has nearly no velocity.
// It may still glide or turn on free rollers, so that only after a second of quiet its pose is held, and the gyro's
// difference from the wheels' yaw rate is its bias: the vehicle trembles because its loops respond to encoder noise.
// What the accelerometer reads then is its bias, or a lean that is not measured. The gyro's bias is estimated only at
// rest: a wheel's slip in a turn is one-sided, and would be mistaken for it.
//
// The accelerometer's bias walks, because attitudes wander. It is followed while driving by a filter of two states
// for each direction, which takes the wheels for the vehicle with a slip of 2 cm/s, or as much as there is, that
// lasts half a second: a slip comes and goes, a bias stays. As far as it is unknown it adds to the noise of the
// velocity, with four of its deviations, so that none is taken for a slip that lasts. Friction takes a vehicle
// that slides towards the velocity of its wheels, or wheels that hold it disagree with the others; if neither is
// so for half a second, nothing is known of the bias any more.
//
// Limits: a bias that is off by b m/s^2 is b t m/s of error while all wheels slip for t seconds. A vehicle that slides
// down a slope with braked wheels, or is pushed, is taken for one that rolls.
typedef struct {
  omni_estimator_config config;
  omni5_kinematics kinematics;
  // Squares of the forward map: contribution of a wheel's variance to the variance of each axis.
  float shares[3][5];
  float redundancy[5];
  // Mean squared lever of the wheels [m^2]: turning by 1 rad/s is as much as its root in m/s.
  float lever_m2;
  // Change of a wheel's velocity in a period that is a jump of its encoder [rad/s].
  float jump_rad_s;
} omni5_estimator;

// State of an estimator. Private.
typedef struct {
  uint32_t ready;
  uint32_t memory[116];
} omni5_estimator_state;

// Readings of an estimator in a period. All zero: nothing is read.
typedef struct {
  // Actuator velocities [rad/s]; each used only if it was `received`.
  omni5_velocities measured;
  // Inertial measurement unit of the base; used only if `imu_received`.
  omni_imu imu;
  // The encoder's reading arrived.
  bool received[5];
  // The unit's reading arrived.
  bool imu_received;
  // The vehicle is commanded to stand.
  bool commanded_rest;
} omni5_estimator_input;

// The state of the loops between steps; `default` is a fresh start.
typedef struct {
  // Integral term of each wheel [N.m].
  float integral_n_m[6];
  // Derivative term of each wheel [N.m], after its filter.
  float derivative_n_m[6];
  // Reference of the step before, as realised [rad/s]; 0 without derivative and feed-forward.
  float last_reference_rad_s[6];
  // Measurement of the step before [rad/s]; 0 without derivative and feed-forward.
  float last_measured_rad_s[6];
  // The wheel has a step to compare with; only loops with a derivative or a feed-forward set it.
  bool started[6];
  // The overloaded wheels, and the time for which each other wheel has been beyond a limit.
  omni_overload overload;
  // Progress of the torque's end while every reference was 0.
  omni_rest_state rest;
} omni6_state;

// Actuator velocities, one per wheel in the layout's order, which kinematics maps and loops control.
typedef struct {
  // Velocity of each actuator [rad/s] (positive as the wheel's rolling direction says), any finite number.
  float rad_s[6];
} omni6_velocities;

// Actuator torques, one per wheel in the layout's order: a controller's request to the motors. Not a wheel velocity.
typedef struct {
  // Torque of each actuator [N.m] (positive drives the wheel in its rolling direction), any finite number.
  float n_m[6];
} omni6_torques;

// Torque limits of `N` wheels at their present velocities [N.m], in the layout's order.
typedef struct {
  // Lowest torque of each, <= 0.
  float lower_n_m[6];
  // Highest torque of each, >= 0.
  float upper_n_m[6];
} omni6_torque_ranges;

// Every signal of one control step, per wheel in the layout's order. Velocities [rad/s] and torques [N.m] are the
// actuators'. Nothing in it is ever NaN.
typedef struct {
  // Reference r as commanded, before any reduction.
  omni6_velocities reference;
  // Measurement y; 0 for a released wheel.
  omni6_velocities measured;
  // The wheel was controlled. One without a usable measurement is released: no torque, its loop
  // starts afresh. When the torque has `ended` no wheel is controlled.
  bool active[6];
  // Proportional term, formed with the reference as reduced by `common_factor` under
  // `Saturation::ScaleReferences`.
  float p_n_m[6];
  // Integral term, likewise.
  float i_n_m[6];
  // Derivative term, likewise.
  float d_n_m[6];
  // Feed-forward, likewise.
  float ff_n_m[6];
  // Torque that the loops request with the whole reference: the torque that actuators without limits would apply.
  omni6_torques requested;
  // Torque to apply, always within the limits.
  omni6_torques applied;
  // Limits at the present velocities.
  omni6_torque_ranges range;
  // The requested torque is outside the limits.
  bool saturated[6];
  // Factor on all torques (`Saturation::ScaleTorques`) or all references
  // (`Saturation::ScaleReferences`), 0 to 1; 1 under
  // `Saturation::Clip`.
  float common_factor;
  // Every reference has been 0 for long enough that all torque has ended: see
  // `Rest`. Bridges that are driven by voltage are then opened or shorted,
  // because the voltage for no torque follows from a velocity that may be measured wrongly.
  bool ended;
  // And the windings of all motors are to be shorted: `Rest::short_windings`.
  bool shorted;
} omni6_wheel_sample;

// Every signal of one step of a `Controller`.
typedef struct {
  // The command; rest if the one given was not finite, or beyond 1e6.
  omni_twist command;
  // The wheels' signals.
  omni6_wheel_sample wheels;
} omni6_sample;

// The two linear maps of one layout. Immutable, no allocation.
typedef struct {
  float inverse[6][3];
  float forward[3][6];
  float weights[6];
} omni6_kinematics;

// The limits of `N` actuators, their numbers side by side: loops over them run several at a time
// where the processor can.
typedef struct {
  float stall[6];
  float slope[6];
  float cap[6];
  // No limit depends on the velocity.
  bool constant;
} omni6_torque_limits;

// PID loops of `N` wheels with a coordination policy, without a vehicle around them.
typedef struct {
  omni_pid pid;
  omni6_torque_limits limits;
  omni_coordination coordination;
  omni_rest_rule rest;
} omni6_loops;

// A vehicle's controller: kinematics and wheel loops. Immutable; the changing state is in `ControlState`.
//
// The bare loop. `Drive` puts shaping, faults, slip and odometry around it.
typedef struct {
  omni6_kinematics kinematics;
  omni6_loops wheels;
} omni6_controller;

// Dead reckoning of a vehicle with `N` wheels. Immutable; the changing state is in `OdometryState`.
//
// The maps are passed to each call: a caller that distrusts a wheel may pass another forward map, or the displacement
// itself. In `f32` positions of 5000 rad come in steps of 5e-4 rad; that does not add up, because differences of
// positions are exact.
//
// Largest distance of `f32` from `f64` over 1,000,000 steps of 1 ms at 0.3 m/s, that is 300 m, by the seven wheels of
// `WheelLayout::chugo7`:
//
// | path | as here | plain sums (`PlanarPose::moved_by`) |
// |---|---|---|
// | winding and lateral, ending far away | 0.05 mm | 36 mm |
// | the same in circles of 6 m radius | 0.005 mm | 0.4 mm |
// | straight forward | 0.06 mm | 2.6 m |
//
// From positions instead of velocities the first column is at most 0.14 mm.
typedef struct {
  float period_s;
} omni6_odometry;

// Speed limits of the actuators, and the part of a twist that is kept within them: desaturation, or normalisation, of
// wheel speeds.
typedef struct {
  float limit_rad_s[6];
  omni_desaturation desaturation;
} omni6_speed_limits;

// A vehicle's whole controller: readings and commands in, torques out. Immutable; the changing state is in
// `DriveState`.
//
// In order: readings are judged, faulty wheels are released, and the motion is estimated from the remaining wheels;
// the command is checked, limited, moved to the origin and scaled to the wheels' speed limits; the loops run; the pose
// is integrated.
typedef struct {
  omni6_controller controller;
  omni_shaper shaper;
  omni_slip_detector slip;
  omni_fault_monitor faults;
  omni6_odometry odometry;
  // Without effect unless `limits_speed`.
  omni6_speed_limits speed_limits;
  // Without effect unless `grows_covariance`.
  omni_covariance_growth growth;
  float command_point_m[2];
  float period_s;
  uint16_t unobservable_periods;
  bool limits_speed;
  bool grows_covariance;
  bool discretize;
} omni6_drive;

// State of a drive. Private.
typedef struct {
  uint32_t ready;
  uint32_t memory[212];
} omni6_drive_state;

// What a step reports. Nothing in it is ever NaN.
typedef struct {
  // Torques to apply [N.m], always within the motors' limits.
  omni6_torques torques;
  // Torques that the loops requested [N.m].
  omni6_torques requested;
  // References of the loops [rad/s].
  omni6_velocities references;
  // Velocities that the loops used [rad/s]; 0 for a wheel that is not `active`.
  omni6_velocities measured;
  // Command within all limits, of the origin.
  omni_twist twist;
  // Twist of the vehicle, by its wheels; 0 unless `motion_known`.
  omni_twist estimated;
  // Pose of the vehicle, by its wheels.
  omni_pose pose;
  // How far the vehicle can be relied on.
  omni_drive_mode mode;
  // Why the twist is what it is.
  omni_command_status status;
  // A command arrived and was rejected: it is no number, or beyond 1e6.
  bool rejected;
  // Enough wheels determine the motion; otherwise the pose does not change.
  bool motion_known;
  // The fault of each wheel.
  omni_fault faults[6];
  // The wheel was controlled. One that is not has no torque, and its bridge is opened or
  // shorted: it has a fault, or all torque has ended at rest.
  bool active[6];
  // The requested torque is outside the limits.
  bool saturated[6];
  // The wheel is excluded from the motion: faulty, lifted or slipping.
  bool excluded[6];
  // The motor's windings shall be shorted. In a safe stop and an emergency stop: the wheel has a
  // fault, so that no torque can be asked of it, or all torque has ended. At rest otherwise: all
  // torque has ended, and the scenario asks for it (`control.rest.short_windings`).
  bool brake[6];
} omni6_drive_output;

// What arrived since the period before. All zero: nothing did, every wheel is on flat ground,
// motors have their own limits.
typedef struct {
  // The command; used only if `commanded`.
  omni_twist command;
  // Actuator velocities [rad/s]; each used only if it was `received`.
  omni6_velocities measured;
  // Torques [N.m] that the motors shall keep within besides their own limits: a hot motor, a low
  // battery. Each used only if `limited`. 0 is always within.
  omni6_torque_ranges torque_ranges;
  // Path of each wheel over path of the body beneath it, 0.01 to 100; any other number counts as 1, flat ground.
  float path_factor[6];
  // A command arrived. If none does for the time-out, the vehicle is brought to rest.
  bool commanded;
  // The emergency stop is pressed: the vehicle comes to rest at the emergency deceleration, whatever is
  // commanded, and stays there as long as this is true. The caller has to latch a momentary button.
  bool emergency;
  // The encoder's reading arrived.
  bool received[6];
  // The wheel is in the air: it is controlled, but excluded from the vehicle's motion.
  bool lifted[6];
  // `torque_ranges` holds for this motor.
  bool limited[6];
} omni6_drive_input;

// Chooses the target speed of a `Traction`. Immutable.
//
// It knows which row of wheels climbs next from how high the rows stand. Rows behind the first need a run-up, because
// an impact absorbs most of the vehicle's energy. A vehicle that pushes with its full thrust and does not move backs
// off and retries.
typedef struct {
  omni_supervisor_config config;
  // Row of each wheel from the front, and from the left; how many rows there are.
  uint16_t rows[2][6];
  uint16_t counts[2];
} omni6_supervisor;

// The tree of a vehicle's bodies, and the wheels on it.
typedef struct {
  omni_joint joints[OMNI_MAX_HINGES];
  uint16_t count;
  // Slot of the carrier of each wheel: 0 the base, k + 1 the child of joint k.
  uint16_t carrier[6];
  // From the carrier's reference point to each wheel [m].
  float arm_m[6][3];
} omni6_linkage;

// Traction control of one vehicle. Immutable; its state is a
// `TractionState`.
typedef struct {
  omni6_kinematics kinematics;
  omni6_linkage linkage;
  omni6_torque_limits limits;
  float inertia_kg_m2[6];
  float carrier[6][2];
  // Way along the push per turn of the actuator [m/rad].
  float way_m_rad[6];
  float place_m[6][2];
  omni_traction_config config;
  omni_traction_times times;
  // Largest rate of a wheel per yaw rate.
  float per_yaw;
  // Inverses of how far the outermost wheels are to the side, for travel along x and along y [1/m].
  float per_lever[2];
} omni6_traction;

// A `Drive` with traction control in place of the wheels' loops: everything around them is the drive's.
//
// Wheels that the fault monitor excludes, and wheels without a reading, get no torque and do not count for the speed.
// `torque_ranges` of the input also apply here. In a stop nothing is tried any more: no back-off, no run-up.
typedef struct {
  omni6_drive drive;
  omni6_supervisor supervisor;
  omni6_traction traction;
} omni6_traction_drive;

// State of a drive with traction control. Private.
typedef struct {
  uint32_t ready;
  uint32_t memory[558];
} omni6_traction_drive_state;

// What a step with traction control reports. Nothing in it is ever NaN.
typedef struct {
  // What a drive reports, torques to apply among it.
  omni6_drive_output drive;
  // Measured speed over the commanded, -1 to 1; 1 where none is commanded.
  float factor;
  // Measured speed along the direction of travel [m/s].
  float speed_m_s;
  // The target that it follows [m/s].
  float target_m_s;
  // Common thrust [N.m].
  float thrust_n_m;
  // Yaw rate [rad/s].
  float yaw_rad_s;
  // Speed across the direction of travel, to the left [m/s].
  float drift_m_s;
  // Heading error [rad], counter-clockwise positive.
  float heading_rad;
  // The gyro's zero [rad/s].
  float gyro_zero_rad_s;
  // Slip of each driven wheel along the direction of travel [rad/s]; 0 of the others.
  float slip_rad_s[6];
  // What the ground takes of each driven wheel's torque [N.m], by its own estimate; 0 of the others.
  float contact_n_m[6];
  // Retries so far.
  uint32_t retries;
  // Index of the wheel that the measured speed hangs on, the slowest that pushes, or the fastest
  // where all brake; -1 where there is none.
  int8_t speed_wheel;
  // The control mode of the wheels.
  omni_traction_loops loops;
  // What the choice of the target speed is at.
  omni_supervisor_mode supervisor;
} omni6_traction_drive_output;

// The filter for a vehicle with `N` wheels. Immutable; the changing state is in `EstimatorState`.
//
// A reading of a wheel or of the gyro that differs from what is expected by more than it can change in a period is a
// jump of the sensor, and left out: for 10 ms or two periods, because what lasts is no jump, and for a seventh of the
// time.
//
// State: place and yaw in the world; velocity of the origin along the vehicle's heading; the gyro's bias;
// and the slip of all wheels together, as a twist that they show beyond the vehicle's own. Each period
//
// 1. gyro and accelerometer move the state (without accelerometer the velocity follows a random walk, without gyro the
//    wheels' yaw rate is used);
// 2. the slip is held against none, by as little as a slip says that lasts for `slip_s` and is
//    `slip_m_s`, as much as it is itself in any direction (wheels that slide hold in none) and as the
//    wheels disagree. It changes by as much, but in a period by no more than 400 times what the velocity
//    does (variances), which is little with an accelerometer. A body innovation beyond three deviations
//    widens it at once, by its excess (after Jazwinski, *Adaptive filtering*, Automatica 5, 1969);
// 3. every valid wheel reading is processed separately, its noise increased by its own residual (as variance
//    components are estimated from redundancy: Baarda, 1968). No matrix is inverted, and the covariance is updated in
//    Joseph's form. Its variances are never below 0.
//
// A vehicle that is commanded to rest and is quiet (wheels, gyro and accelerometer for 50 ms) has nearly no velocity.
// It may still glide or turn on free rollers, so that only after a second of quiet its pose is held, and the gyro's
// difference from the wheels' yaw rate is its bias: the vehicle trembles because its loops respond to encoder noise.
// What the accelerometer reads then is its bias, or a lean that is not measured. The gyro's bias is estimated only at
// rest: a wheel's slip in a turn is one-sided, and would be mistaken for it.
//
// The accelerometer's bias walks, because attitudes wander. It is followed while driving by a filter of two states
// for each direction, which takes the wheels for the vehicle with a slip of 2 cm/s, or as much as there is, that
// lasts half a second: a slip comes and goes, a bias stays. As far as it is unknown it adds to the noise of the
// velocity, with four of its deviations, so that none is taken for a slip that lasts. Friction takes a vehicle
// that slides towards the velocity of its wheels, or wheels that hold it disagree with the others; if neither is
// so for half a second, nothing is known of the bias any more.
//
// Limits: a bias that is off by b m/s^2 is b t m/s of error while all wheels slip for t seconds. A vehicle that slides
// down a slope with braked wheels, or is pushed, is taken for one that rolls.
typedef struct {
  omni_estimator_config config;
  omni6_kinematics kinematics;
  // Squares of the forward map: contribution of a wheel's variance to the variance of each axis.
  float shares[3][6];
  float redundancy[6];
  // Mean squared lever of the wheels [m^2]: turning by 1 rad/s is as much as its root in m/s.
  float lever_m2;
  // Change of a wheel's velocity in a period that is a jump of its encoder [rad/s].
  float jump_rad_s;
} omni6_estimator;

// State of an estimator. Private.
typedef struct {
  uint32_t ready;
  uint32_t memory[117];
} omni6_estimator_state;

// Readings of an estimator in a period. All zero: nothing is read.
typedef struct {
  // Actuator velocities [rad/s]; each used only if it was `received`.
  omni6_velocities measured;
  // Inertial measurement unit of the base; used only if `imu_received`.
  omni_imu imu;
  // The encoder's reading arrived.
  bool received[6];
  // The unit's reading arrived.
  bool imu_received;
  // The vehicle is commanded to stand.
  bool commanded_rest;
} omni6_estimator_input;

// The state of the loops between steps; `default` is a fresh start.
typedef struct {
  // Integral term of each wheel [N.m].
  float integral_n_m[7];
  // Derivative term of each wheel [N.m], after its filter.
  float derivative_n_m[7];
  // Reference of the step before, as realised [rad/s]; 0 without derivative and feed-forward.
  float last_reference_rad_s[7];
  // Measurement of the step before [rad/s]; 0 without derivative and feed-forward.
  float last_measured_rad_s[7];
  // The wheel has a step to compare with; only loops with a derivative or a feed-forward set it.
  bool started[7];
  // The overloaded wheels, and the time for which each other wheel has been beyond a limit.
  omni_overload overload;
  // Progress of the torque's end while every reference was 0.
  omni_rest_state rest;
} omni7_state;

// Actuator velocities, one per wheel in the layout's order, which kinematics maps and loops control.
typedef struct {
  // Velocity of each actuator [rad/s] (positive as the wheel's rolling direction says), any finite number.
  float rad_s[7];
} omni7_velocities;

// Actuator torques, one per wheel in the layout's order: a controller's request to the motors. Not a wheel velocity.
typedef struct {
  // Torque of each actuator [N.m] (positive drives the wheel in its rolling direction), any finite number.
  float n_m[7];
} omni7_torques;

// Torque limits of `N` wheels at their present velocities [N.m], in the layout's order.
typedef struct {
  // Lowest torque of each, <= 0.
  float lower_n_m[7];
  // Highest torque of each, >= 0.
  float upper_n_m[7];
} omni7_torque_ranges;

// Every signal of one control step, per wheel in the layout's order. Velocities [rad/s] and torques [N.m] are the
// actuators'. Nothing in it is ever NaN.
typedef struct {
  // Reference r as commanded, before any reduction.
  omni7_velocities reference;
  // Measurement y; 0 for a released wheel.
  omni7_velocities measured;
  // The wheel was controlled. One without a usable measurement is released: no torque, its loop
  // starts afresh. When the torque has `ended` no wheel is controlled.
  bool active[7];
  // Proportional term, formed with the reference as reduced by `common_factor` under
  // `Saturation::ScaleReferences`.
  float p_n_m[7];
  // Integral term, likewise.
  float i_n_m[7];
  // Derivative term, likewise.
  float d_n_m[7];
  // Feed-forward, likewise.
  float ff_n_m[7];
  // Torque that the loops request with the whole reference: the torque that actuators without limits would apply.
  omni7_torques requested;
  // Torque to apply, always within the limits.
  omni7_torques applied;
  // Limits at the present velocities.
  omni7_torque_ranges range;
  // The requested torque is outside the limits.
  bool saturated[7];
  // Factor on all torques (`Saturation::ScaleTorques`) or all references
  // (`Saturation::ScaleReferences`), 0 to 1; 1 under
  // `Saturation::Clip`.
  float common_factor;
  // Every reference has been 0 for long enough that all torque has ended: see
  // `Rest`. Bridges that are driven by voltage are then opened or shorted,
  // because the voltage for no torque follows from a velocity that may be measured wrongly.
  bool ended;
  // And the windings of all motors are to be shorted: `Rest::short_windings`.
  bool shorted;
} omni7_wheel_sample;

// Every signal of one step of a `Controller`.
typedef struct {
  // The command; rest if the one given was not finite, or beyond 1e6.
  omni_twist command;
  // The wheels' signals.
  omni7_wheel_sample wheels;
} omni7_sample;

// The two linear maps of one layout. Immutable, no allocation.
typedef struct {
  float inverse[7][3];
  float forward[3][7];
  float weights[7];
} omni7_kinematics;

// The limits of `N` actuators, their numbers side by side: loops over them run several at a time
// where the processor can.
typedef struct {
  float stall[7];
  float slope[7];
  float cap[7];
  // No limit depends on the velocity.
  bool constant;
} omni7_torque_limits;

// PID loops of `N` wheels with a coordination policy, without a vehicle around them.
typedef struct {
  omni_pid pid;
  omni7_torque_limits limits;
  omni_coordination coordination;
  omni_rest_rule rest;
} omni7_loops;

// A vehicle's controller: kinematics and wheel loops. Immutable; the changing state is in `ControlState`.
//
// The bare loop. `Drive` puts shaping, faults, slip and odometry around it.
typedef struct {
  omni7_kinematics kinematics;
  omni7_loops wheels;
} omni7_controller;

// Dead reckoning of a vehicle with `N` wheels. Immutable; the changing state is in `OdometryState`.
//
// The maps are passed to each call: a caller that distrusts a wheel may pass another forward map, or the displacement
// itself. In `f32` positions of 5000 rad come in steps of 5e-4 rad; that does not add up, because differences of
// positions are exact.
//
// Largest distance of `f32` from `f64` over 1,000,000 steps of 1 ms at 0.3 m/s, that is 300 m, by the seven wheels of
// `WheelLayout::chugo7`:
//
// | path | as here | plain sums (`PlanarPose::moved_by`) |
// |---|---|---|
// | winding and lateral, ending far away | 0.05 mm | 36 mm |
// | the same in circles of 6 m radius | 0.005 mm | 0.4 mm |
// | straight forward | 0.06 mm | 2.6 m |
//
// From positions instead of velocities the first column is at most 0.14 mm.
typedef struct {
  float period_s;
} omni7_odometry;

// Speed limits of the actuators, and the part of a twist that is kept within them: desaturation, or normalisation, of
// wheel speeds.
typedef struct {
  float limit_rad_s[7];
  omni_desaturation desaturation;
} omni7_speed_limits;

// A vehicle's whole controller: readings and commands in, torques out. Immutable; the changing state is in
// `DriveState`.
//
// In order: readings are judged, faulty wheels are released, and the motion is estimated from the remaining wheels;
// the command is checked, limited, moved to the origin and scaled to the wheels' speed limits; the loops run; the pose
// is integrated.
typedef struct {
  omni7_controller controller;
  omni_shaper shaper;
  omni_slip_detector slip;
  omni_fault_monitor faults;
  omni7_odometry odometry;
  // Without effect unless `limits_speed`.
  omni7_speed_limits speed_limits;
  // Without effect unless `grows_covariance`.
  omni_covariance_growth growth;
  float command_point_m[2];
  float period_s;
  uint16_t unobservable_periods;
  bool limits_speed;
  bool grows_covariance;
  bool discretize;
} omni7_drive;

// State of a drive. Private.
typedef struct {
  uint32_t ready;
  uint32_t memory[239];
} omni7_drive_state;

// What a step reports. Nothing in it is ever NaN.
typedef struct {
  // Torques to apply [N.m], always within the motors' limits.
  omni7_torques torques;
  // Torques that the loops requested [N.m].
  omni7_torques requested;
  // References of the loops [rad/s].
  omni7_velocities references;
  // Velocities that the loops used [rad/s]; 0 for a wheel that is not `active`.
  omni7_velocities measured;
  // Command within all limits, of the origin.
  omni_twist twist;
  // Twist of the vehicle, by its wheels; 0 unless `motion_known`.
  omni_twist estimated;
  // Pose of the vehicle, by its wheels.
  omni_pose pose;
  // How far the vehicle can be relied on.
  omni_drive_mode mode;
  // Why the twist is what it is.
  omni_command_status status;
  // A command arrived and was rejected: it is no number, or beyond 1e6.
  bool rejected;
  // Enough wheels determine the motion; otherwise the pose does not change.
  bool motion_known;
  // The fault of each wheel.
  omni_fault faults[7];
  // The wheel was controlled. One that is not has no torque, and its bridge is opened or
  // shorted: it has a fault, or all torque has ended at rest.
  bool active[7];
  // The requested torque is outside the limits.
  bool saturated[7];
  // The wheel is excluded from the motion: faulty, lifted or slipping.
  bool excluded[7];
  // The motor's windings shall be shorted. In a safe stop and an emergency stop: the wheel has a
  // fault, so that no torque can be asked of it, or all torque has ended. At rest otherwise: all
  // torque has ended, and the scenario asks for it (`control.rest.short_windings`).
  bool brake[7];
} omni7_drive_output;

// What arrived since the period before. All zero: nothing did, every wheel is on flat ground,
// motors have their own limits.
typedef struct {
  // The command; used only if `commanded`.
  omni_twist command;
  // Actuator velocities [rad/s]; each used only if it was `received`.
  omni7_velocities measured;
  // Torques [N.m] that the motors shall keep within besides their own limits: a hot motor, a low
  // battery. Each used only if `limited`. 0 is always within.
  omni7_torque_ranges torque_ranges;
  // Path of each wheel over path of the body beneath it, 0.01 to 100; any other number counts as 1, flat ground.
  float path_factor[7];
  // A command arrived. If none does for the time-out, the vehicle is brought to rest.
  bool commanded;
  // The emergency stop is pressed: the vehicle comes to rest at the emergency deceleration, whatever is
  // commanded, and stays there as long as this is true. The caller has to latch a momentary button.
  bool emergency;
  // The encoder's reading arrived.
  bool received[7];
  // The wheel is in the air: it is controlled, but excluded from the vehicle's motion.
  bool lifted[7];
  // `torque_ranges` holds for this motor.
  bool limited[7];
} omni7_drive_input;

// Chooses the target speed of a `Traction`. Immutable.
//
// It knows which row of wheels climbs next from how high the rows stand. Rows behind the first need a run-up, because
// an impact absorbs most of the vehicle's energy. A vehicle that pushes with its full thrust and does not move backs
// off and retries.
typedef struct {
  omni_supervisor_config config;
  // Row of each wheel from the front, and from the left; how many rows there are.
  uint16_t rows[2][7];
  uint16_t counts[2];
} omni7_supervisor;

// The tree of a vehicle's bodies, and the wheels on it.
typedef struct {
  omni_joint joints[OMNI_MAX_HINGES];
  uint16_t count;
  // Slot of the carrier of each wheel: 0 the base, k + 1 the child of joint k.
  uint16_t carrier[7];
  // From the carrier's reference point to each wheel [m].
  float arm_m[7][3];
} omni7_linkage;

// Traction control of one vehicle. Immutable; its state is a
// `TractionState`.
typedef struct {
  omni7_kinematics kinematics;
  omni7_linkage linkage;
  omni7_torque_limits limits;
  float inertia_kg_m2[7];
  float carrier[7][2];
  // Way along the push per turn of the actuator [m/rad].
  float way_m_rad[7];
  float place_m[7][2];
  omni_traction_config config;
  omni_traction_times times;
  // Largest rate of a wheel per yaw rate.
  float per_yaw;
  // Inverses of how far the outermost wheels are to the side, for travel along x and along y [1/m].
  float per_lever[2];
} omni7_traction;

// A `Drive` with traction control in place of the wheels' loops: everything around them is the drive's.
//
// Wheels that the fault monitor excludes, and wheels without a reading, get no torque and do not count for the speed.
// `torque_ranges` of the input also apply here. In a stop nothing is tried any more: no back-off, no run-up.
typedef struct {
  omni7_drive drive;
  omni7_supervisor supervisor;
  omni7_traction traction;
} omni7_traction_drive;

// State of a drive with traction control. Private.
typedef struct {
  uint32_t ready;
  uint32_t memory[610];
} omni7_traction_drive_state;

// What a step with traction control reports. Nothing in it is ever NaN.
typedef struct {
  // What a drive reports, torques to apply among it.
  omni7_drive_output drive;
  // Measured speed over the commanded, -1 to 1; 1 where none is commanded.
  float factor;
  // Measured speed along the direction of travel [m/s].
  float speed_m_s;
  // The target that it follows [m/s].
  float target_m_s;
  // Common thrust [N.m].
  float thrust_n_m;
  // Yaw rate [rad/s].
  float yaw_rad_s;
  // Speed across the direction of travel, to the left [m/s].
  float drift_m_s;
  // Heading error [rad], counter-clockwise positive.
  float heading_rad;
  // The gyro's zero [rad/s].
  float gyro_zero_rad_s;
  // Slip of each driven wheel along the direction of travel [rad/s]; 0 of the others.
  float slip_rad_s[7];
  // What the ground takes of each driven wheel's torque [N.m], by its own estimate; 0 of the others.
  float contact_n_m[7];
  // Retries so far.
  uint32_t retries;
  // Index of the wheel that the measured speed hangs on, the slowest that pushes, or the fastest
  // where all brake; -1 where there is none.
  int8_t speed_wheel;
  // The control mode of the wheels.
  omni_traction_loops loops;
  // What the choice of the target speed is at.
  omni_supervisor_mode supervisor;
} omni7_traction_drive_output;

// The filter for a vehicle with `N` wheels. Immutable; the changing state is in `EstimatorState`.
//
// A reading of a wheel or of the gyro that differs from what is expected by more than it can change in a period is a
// jump of the sensor, and left out: for 10 ms or two periods, because what lasts is no jump, and for a seventh of the
// time.
//
// State: place and yaw in the world; velocity of the origin along the vehicle's heading; the gyro's bias;
// and the slip of all wheels together, as a twist that they show beyond the vehicle's own. Each period
//
// 1. gyro and accelerometer move the state (without accelerometer the velocity follows a random walk, without gyro the
//    wheels' yaw rate is used);
// 2. the slip is held against none, by as little as a slip says that lasts for `slip_s` and is
//    `slip_m_s`, as much as it is itself in any direction (wheels that slide hold in none) and as the
//    wheels disagree. It changes by as much, but in a period by no more than 400 times what the velocity
//    does (variances), which is little with an accelerometer. A body innovation beyond three deviations
//    widens it at once, by its excess (after Jazwinski, *Adaptive filtering*, Automatica 5, 1969);
// 3. every valid wheel reading is processed separately, its noise increased by its own residual (as variance
//    components are estimated from redundancy: Baarda, 1968). No matrix is inverted, and the covariance is updated in
//    Joseph's form. Its variances are never below 0.
//
// A vehicle that is commanded to rest and is quiet (wheels, gyro and accelerometer for 50 ms) has nearly no velocity.
// It may still glide or turn on free rollers, so that only after a second of quiet its pose is held, and the gyro's
// difference from the wheels' yaw rate is its bias: the vehicle trembles because its loops respond to encoder noise.
// What the accelerometer reads then is its bias, or a lean that is not measured. The gyro's bias is estimated only at
// rest: a wheel's slip in a turn is one-sided, and would be mistaken for it.
//
// The accelerometer's bias walks, because attitudes wander. It is followed while driving by a filter of two states
// for each direction, which takes the wheels for the vehicle with a slip of 2 cm/s, or as much as there is, that
// lasts half a second: a slip comes and goes, a bias stays. As far as it is unknown it adds to the noise of the
// velocity, with four of its deviations, so that none is taken for a slip that lasts. Friction takes a vehicle
// that slides towards the velocity of its wheels, or wheels that hold it disagree with the others; if neither is
// so for half a second, nothing is known of the bias any more.
//
// Limits: a bias that is off by b m/s^2 is b t m/s of error while all wheels slip for t seconds. A vehicle that slides
// down a slope with braked wheels, or is pushed, is taken for one that rolls.
typedef struct {
  omni_estimator_config config;
  omni7_kinematics kinematics;
  // Squares of the forward map: contribution of a wheel's variance to the variance of each axis.
  float shares[3][7];
  float redundancy[7];
  // Mean squared lever of the wheels [m^2]: turning by 1 rad/s is as much as its root in m/s.
  float lever_m2;
  // Change of a wheel's velocity in a period that is a jump of its encoder [rad/s].
  float jump_rad_s;
} omni7_estimator;

// State of an estimator. Private.
typedef struct {
  uint32_t ready;
  uint32_t memory[118];
} omni7_estimator_state;

// Readings of an estimator in a period. All zero: nothing is read.
typedef struct {
  // Actuator velocities [rad/s]; each used only if it was `received`.
  omni7_velocities measured;
  // Inertial measurement unit of the base; used only if `imu_received`.
  omni_imu imu;
  // The encoder's reading arrived.
  bool received[7];
  // The unit's reading arrived.
  bool imu_received;
  // The vehicle is commanded to stand.
  bool commanded_rest;
} omni7_estimator_input;

// The state of the loops between steps; `default` is a fresh start.
typedef struct {
  // Integral term of each wheel [N.m].
  float integral_n_m[8];
  // Derivative term of each wheel [N.m], after its filter.
  float derivative_n_m[8];
  // Reference of the step before, as realised [rad/s]; 0 without derivative and feed-forward.
  float last_reference_rad_s[8];
  // Measurement of the step before [rad/s]; 0 without derivative and feed-forward.
  float last_measured_rad_s[8];
  // The wheel has a step to compare with; only loops with a derivative or a feed-forward set it.
  bool started[8];
  // The overloaded wheels, and the time for which each other wheel has been beyond a limit.
  omni_overload overload;
  // Progress of the torque's end while every reference was 0.
  omni_rest_state rest;
} omni8_state;

// Actuator velocities, one per wheel in the layout's order, which kinematics maps and loops control.
typedef struct {
  // Velocity of each actuator [rad/s] (positive as the wheel's rolling direction says), any finite number.
  float rad_s[8];
} omni8_velocities;

// Actuator torques, one per wheel in the layout's order: a controller's request to the motors. Not a wheel velocity.
typedef struct {
  // Torque of each actuator [N.m] (positive drives the wheel in its rolling direction), any finite number.
  float n_m[8];
} omni8_torques;

// Torque limits of `N` wheels at their present velocities [N.m], in the layout's order.
typedef struct {
  // Lowest torque of each, <= 0.
  float lower_n_m[8];
  // Highest torque of each, >= 0.
  float upper_n_m[8];
} omni8_torque_ranges;

// Every signal of one control step, per wheel in the layout's order. Velocities [rad/s] and torques [N.m] are the
// actuators'. Nothing in it is ever NaN.
typedef struct {
  // Reference r as commanded, before any reduction.
  omni8_velocities reference;
  // Measurement y; 0 for a released wheel.
  omni8_velocities measured;
  // The wheel was controlled. One without a usable measurement is released: no torque, its loop
  // starts afresh. When the torque has `ended` no wheel is controlled.
  bool active[8];
  // Proportional term, formed with the reference as reduced by `common_factor` under
  // `Saturation::ScaleReferences`.
  float p_n_m[8];
  // Integral term, likewise.
  float i_n_m[8];
  // Derivative term, likewise.
  float d_n_m[8];
  // Feed-forward, likewise.
  float ff_n_m[8];
  // Torque that the loops request with the whole reference: the torque that actuators without limits would apply.
  omni8_torques requested;
  // Torque to apply, always within the limits.
  omni8_torques applied;
  // Limits at the present velocities.
  omni8_torque_ranges range;
  // The requested torque is outside the limits.
  bool saturated[8];
  // Factor on all torques (`Saturation::ScaleTorques`) or all references
  // (`Saturation::ScaleReferences`), 0 to 1; 1 under
  // `Saturation::Clip`.
  float common_factor;
  // Every reference has been 0 for long enough that all torque has ended: see
  // `Rest`. Bridges that are driven by voltage are then opened or shorted,
  // because the voltage for no torque follows from a velocity that may be measured wrongly.
  bool ended;
  // And the windings of all motors are to be shorted: `Rest::short_windings`.
  bool shorted;
} omni8_wheel_sample;

// Every signal of one step of a `Controller`.
typedef struct {
  // The command; rest if the one given was not finite, or beyond 1e6.
  omni_twist command;
  // The wheels' signals.
  omni8_wheel_sample wheels;
} omni8_sample;

// The two linear maps of one layout. Immutable, no allocation.
typedef struct {
  float inverse[8][3];
  float forward[3][8];
  float weights[8];
} omni8_kinematics;

// The limits of `N` actuators, their numbers side by side: loops over them run several at a time
// where the processor can.
typedef struct {
  float stall[8];
  float slope[8];
  float cap[8];
  // No limit depends on the velocity.
  bool constant;
} omni8_torque_limits;

// PID loops of `N` wheels with a coordination policy, without a vehicle around them.
typedef struct {
  omni_pid pid;
  omni8_torque_limits limits;
  omni_coordination coordination;
  omni_rest_rule rest;
} omni8_loops;

// A vehicle's controller: kinematics and wheel loops. Immutable; the changing state is in `ControlState`.
//
// The bare loop. `Drive` puts shaping, faults, slip and odometry around it.
typedef struct {
  omni8_kinematics kinematics;
  omni8_loops wheels;
} omni8_controller;

// Dead reckoning of a vehicle with `N` wheels. Immutable; the changing state is in `OdometryState`.
//
// The maps are passed to each call: a caller that distrusts a wheel may pass another forward map, or the displacement
// itself. In `f32` positions of 5000 rad come in steps of 5e-4 rad; that does not add up, because differences of
// positions are exact.
//
// Largest distance of `f32` from `f64` over 1,000,000 steps of 1 ms at 0.3 m/s, that is 300 m, by the seven wheels of
// `WheelLayout::chugo7`:
//
// | path | as here | plain sums (`PlanarPose::moved_by`) |
// |---|---|---|
// | winding and lateral, ending far away | 0.05 mm | 36 mm |
// | the same in circles of 6 m radius | 0.005 mm | 0.4 mm |
// | straight forward | 0.06 mm | 2.6 m |
//
// From positions instead of velocities the first column is at most 0.14 mm.
typedef struct {
  float period_s;
} omni8_odometry;

// Speed limits of the actuators, and the part of a twist that is kept within them: desaturation, or normalisation, of
// wheel speeds.
typedef struct {
  float limit_rad_s[8];
  omni_desaturation desaturation;
} omni8_speed_limits;

// A vehicle's whole controller: readings and commands in, torques out. Immutable; the changing state is in
// `DriveState`.
//
// In order: readings are judged, faulty wheels are released, and the motion is estimated from the remaining wheels;
// the command is checked, limited, moved to the origin and scaled to the wheels' speed limits; the loops run; the pose
// is integrated.
typedef struct {
  omni8_controller controller;
  omni_shaper shaper;
  omni_slip_detector slip;
  omni_fault_monitor faults;
  omni8_odometry odometry;
  // Without effect unless `limits_speed`.
  omni8_speed_limits speed_limits;
  // Without effect unless `grows_covariance`.
  omni_covariance_growth growth;
  float command_point_m[2];
  float period_s;
  uint16_t unobservable_periods;
  bool limits_speed;
  bool grows_covariance;
  bool discretize;
} omni8_drive;

// State of a drive. Private.
typedef struct {
  uint32_t ready;
  uint32_t memory[266];
} omni8_drive_state;

// What a step reports. Nothing in it is ever NaN.
typedef struct {
  // Torques to apply [N.m], always within the motors' limits.
  omni8_torques torques;
  // Torques that the loops requested [N.m].
  omni8_torques requested;
  // References of the loops [rad/s].
  omni8_velocities references;
  // Velocities that the loops used [rad/s]; 0 for a wheel that is not `active`.
  omni8_velocities measured;
  // Command within all limits, of the origin.
  omni_twist twist;
  // Twist of the vehicle, by its wheels; 0 unless `motion_known`.
  omni_twist estimated;
  // Pose of the vehicle, by its wheels.
  omni_pose pose;
  // How far the vehicle can be relied on.
  omni_drive_mode mode;
  // Why the twist is what it is.
  omni_command_status status;
  // A command arrived and was rejected: it is no number, or beyond 1e6.
  bool rejected;
  // Enough wheels determine the motion; otherwise the pose does not change.
  bool motion_known;
  // The fault of each wheel.
  omni_fault faults[8];
  // The wheel was controlled. One that is not has no torque, and its bridge is opened or
  // shorted: it has a fault, or all torque has ended at rest.
  bool active[8];
  // The requested torque is outside the limits.
  bool saturated[8];
  // The wheel is excluded from the motion: faulty, lifted or slipping.
  bool excluded[8];
  // The motor's windings shall be shorted. In a safe stop and an emergency stop: the wheel has a
  // fault, so that no torque can be asked of it, or all torque has ended. At rest otherwise: all
  // torque has ended, and the scenario asks for it (`control.rest.short_windings`).
  bool brake[8];
} omni8_drive_output;

// What arrived since the period before. All zero: nothing did, every wheel is on flat ground,
// motors have their own limits.
typedef struct {
  // The command; used only if `commanded`.
  omni_twist command;
  // Actuator velocities [rad/s]; each used only if it was `received`.
  omni8_velocities measured;
  // Torques [N.m] that the motors shall keep within besides their own limits: a hot motor, a low
  // battery. Each used only if `limited`. 0 is always within.
  omni8_torque_ranges torque_ranges;
  // Path of each wheel over path of the body beneath it, 0.01 to 100; any other number counts as 1, flat ground.
  float path_factor[8];
  // A command arrived. If none does for the time-out, the vehicle is brought to rest.
  bool commanded;
  // The emergency stop is pressed: the vehicle comes to rest at the emergency deceleration, whatever is
  // commanded, and stays there as long as this is true. The caller has to latch a momentary button.
  bool emergency;
  // The encoder's reading arrived.
  bool received[8];
  // The wheel is in the air: it is controlled, but excluded from the vehicle's motion.
  bool lifted[8];
  // `torque_ranges` holds for this motor.
  bool limited[8];
} omni8_drive_input;

// Chooses the target speed of a `Traction`. Immutable.
//
// It knows which row of wheels climbs next from how high the rows stand. Rows behind the first need a run-up, because
// an impact absorbs most of the vehicle's energy. A vehicle that pushes with its full thrust and does not move backs
// off and retries.
typedef struct {
  omni_supervisor_config config;
  // Row of each wheel from the front, and from the left; how many rows there are.
  uint16_t rows[2][8];
  uint16_t counts[2];
} omni8_supervisor;

// The tree of a vehicle's bodies, and the wheels on it.
typedef struct {
  omni_joint joints[OMNI_MAX_HINGES];
  uint16_t count;
  // Slot of the carrier of each wheel: 0 the base, k + 1 the child of joint k.
  uint16_t carrier[8];
  // From the carrier's reference point to each wheel [m].
  float arm_m[8][3];
} omni8_linkage;

// Traction control of one vehicle. Immutable; its state is a
// `TractionState`.
typedef struct {
  omni8_kinematics kinematics;
  omni8_linkage linkage;
  omni8_torque_limits limits;
  float inertia_kg_m2[8];
  float carrier[8][2];
  // Way along the push per turn of the actuator [m/rad].
  float way_m_rad[8];
  float place_m[8][2];
  omni_traction_config config;
  omni_traction_times times;
  // Largest rate of a wheel per yaw rate.
  float per_yaw;
  // Inverses of how far the outermost wheels are to the side, for travel along x and along y [1/m].
  float per_lever[2];
} omni8_traction;

// A `Drive` with traction control in place of the wheels' loops: everything around them is the drive's.
//
// Wheels that the fault monitor excludes, and wheels without a reading, get no torque and do not count for the speed.
// `torque_ranges` of the input also apply here. In a stop nothing is tried any more: no back-off, no run-up.
typedef struct {
  omni8_drive drive;
  omni8_supervisor supervisor;
  omni8_traction traction;
} omni8_traction_drive;

// State of a drive with traction control. Private.
typedef struct {
  uint32_t ready;
  uint32_t memory[662];
} omni8_traction_drive_state;

// What a step with traction control reports. Nothing in it is ever NaN.
typedef struct {
  // What a drive reports, torques to apply among it.
  omni8_drive_output drive;
  // Measured speed over the commanded, -1 to 1; 1 where none is commanded.
  float factor;
  // Measured speed along the direction of travel [m/s].
  float speed_m_s;
  // The target that it follows [m/s].
  float target_m_s;
  // Common thrust [N.m].
  float thrust_n_m;
  // Yaw rate [rad/s].
  float yaw_rad_s;
  // Speed across the direction of travel, to the left [m/s].
  float drift_m_s;
  // Heading error [rad], counter-clockwise positive.
  float heading_rad;
  // The gyro's zero [rad/s].
  float gyro_zero_rad_s;
  // Slip of each driven wheel along the direction of travel [rad/s]; 0 of the others.
  float slip_rad_s[8];
  // What the ground takes of each driven wheel's torque [N.m], by its own estimate; 0 of the others.
  float contact_n_m[8];
  // Retries so far.
  uint32_t retries;
  // Index of the wheel that the measured speed hangs on, the slowest that pushes, or the fastest
  // where all brake; -1 where there is none.
  int8_t speed_wheel;
  // The control mode of the wheels.
  omni_traction_loops loops;
  // What the choice of the target speed is at.
  omni_supervisor_mode supervisor;
} omni8_traction_drive_output;

// The filter for a vehicle with `N` wheels. Immutable; the changing state is in `EstimatorState`.
//
// A reading of a wheel or of the gyro that differs from what is expected by more than it can change in a period is a
// jump of the sensor, and left out: for 10 ms or two periods, because what lasts is no jump, and for a seventh of the
// time.
//
// State: place and yaw in the world; velocity of the origin along the vehicle's heading; the gyro's bias;
// and the slip of all wheels together, as a twist that they show beyond the vehicle's own. Each period
//
// 1. gyro and accelerometer move the state (without accelerometer the velocity follows a random walk, without gyro the
//    wheels' yaw rate is used);
// 2. the slip is held against none, by as little as a slip says that lasts for `slip_s` and is
//    `slip_m_s`, as much as it is itself in any direction (wheels that slide hold in none) and as the
//    wheels disagree. It changes by as much, but in a period by no more than 400 times what the velocity
//    does (variances), which is little with an accelerometer. A body innovation beyond three deviations
//    widens it at once, by its excess (after Jazwinski, *Adaptive filtering*, Automatica 5, 1969);
// 3. every valid wheel reading is processed separately, its noise increased by its own residual (as variance
//    components are estimated from redundancy: Baarda, 1968). No matrix is inverted, and the covariance is updated in
//    Joseph's form. Its variances are never below 0.
//
// A vehicle that is commanded to rest and is quiet (wheels, gyro and accelerometer for 50 ms) has nearly no velocity.
// It may still glide or turn on free rollers, so that only after a second of quiet its pose is held, and the gyro's
// difference from the wheels' yaw rate is its bias: the vehicle trembles because its loops respond to encoder noise.
// What the accelerometer reads then is its bias, or a lean that is not measured. The gyro's bias is estimated only at
// rest: a wheel's slip in a turn is one-sided, and would be mistaken for it.
//
// The accelerometer's bias walks, because attitudes wander. It is followed while driving by a filter of two states
// for each direction, which takes the wheels for the vehicle with a slip of 2 cm/s, or as much as there is, that
// lasts half a second: a slip comes and goes, a bias stays. As far as it is unknown it adds to the noise of the
// velocity, with four of its deviations, so that none is taken for a slip that lasts. Friction takes a vehicle
// that slides towards the velocity of its wheels, or wheels that hold it disagree with the others; if neither is
// so for half a second, nothing is known of the bias any more.
//
// Limits: a bias that is off by b m/s^2 is b t m/s of error while all wheels slip for t seconds. A vehicle that slides
// down a slope with braked wheels, or is pushed, is taken for one that rolls.
typedef struct {
  omni_estimator_config config;
  omni8_kinematics kinematics;
  // Squares of the forward map: contribution of a wheel's variance to the variance of each axis.
  float shares[3][8];
  float redundancy[8];
  // Mean squared lever of the wheels [m^2]: turning by 1 rad/s is as much as its root in m/s.
  float lever_m2;
  // Change of a wheel's velocity in a period that is a jump of its encoder [rad/s].
  float jump_rad_s;
} omni8_estimator;

// State of an estimator. Private.
typedef struct {
  uint32_t ready;
  uint32_t memory[119];
} omni8_estimator_state;

// Readings of an estimator in a period. All zero: nothing is read.
typedef struct {
  // Actuator velocities [rad/s]; each used only if it was `received`.
  omni8_velocities measured;
  // Inertial measurement unit of the base; used only if `imu_received`.
  omni_imu imu;
  // The encoder's reading arrived.
  bool received[8];
  // The unit's reading arrived.
  bool imu_received;
  // The vehicle is commanded to stand.
  bool commanded_rest;
} omni8_estimator_input;

// Velocity and acceleration of a limited axis; `default` is at rest.
typedef struct {
  omni_sum velocity;
  // The last velocity step that a jerk limit has to continue from.
  omni_sum step;
} omni_rate_limiter_state;

// The state of a `TwistLimiter` between steps; `default` is at rest.
typedef struct {
  omni_rate_limiter_state axes[3];
} omni_limiter_state;

// The state of a counter; `default` before the first reading.
typedef struct {
  // Counts since the first reading.
  int64_t counts;
  // The last reading, aligned to 32 bits, once there was one.
  uint32_t last;
  bool read;
} omni_counter_state;

// The state of one wheel's counts; `default` at rest.
typedef struct {
  // Ring buffer of the counts of the last readings, and the time by which each exceeded a period [s].
  int32_t counts[32];
  float longer_s[32];
  // The index of the next, and the number until all lasted one period.
  uint8_t next;
  uint8_t uneven;
  int64_t sum;
  // Time since the last reading beyond the present period [s], and what is left over of whole periods.
  float waited_s;
  float left_s;
  // Which way the last edge went: 0 before the first.
  int8_t way;
  // Age of the last edge when its period ended [s], and periods since without one.
  float aged_s;
  uint32_t quiet;
  // Lowest and highest count since the counter last left two counts, from the present one, and the periods since.
  int32_t lowest;
  int32_t highest;
  uint32_t stood;
  // Angle estimated beyond the counted one [rad].
  float beyond_rad;
  float rate_rad_s;
} omni_velocity_state;

// The state of one wheel's encoder; `default` before the first reading.
typedef struct {
  omni_counter_state counter;
  omni_velocity_state velocity;
} omni_encoder_state;

// An incremental encoder on a hardware counter that wraps around, whatever its width.
typedef struct {
  float count_rad;
  // Bits of 32 that the counter has not.
  uint32_t unused;
} omni_counter;

// How velocities are made of counts.
enum omni_velocity_law_tag
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // `VelocityMethod::Window`.
  OMNI_VELOCITY_LAW_WINDOW,
  // `VelocityMethod::Edges`.
  OMNI_VELOCITY_LAW_EDGES,
  // `VelocityMethod::Observer`: correction for an angle error of 1 rad in a period.
  OMNI_VELOCITY_LAW_OBSERVER,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum omni_velocity_law_tag omni_velocity_law_tag;
#else
typedef uint8_t omni_velocity_law_tag;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

typedef struct {
  // Control periods, 1 to 32.
  uint16_t periods;
  // Velocity of one count in the window [rad/s].
  float rad_s_per_count;
} omni_velocity_law_Window_body;

typedef struct {
  // Bandwidth [rad/s].
  float bandwidth_rad_s;
  // Part of the angle.
  float angle;
  // Velocity [rad/s].
  float rate_per_s;
} omni_velocity_law_Observer_body;

typedef struct {
  omni_velocity_law_tag tag;
  union {
    omni_velocity_law_Window_body WINDOW;
    omni_velocity_law_Observer_body OBSERVER;
  };
} omni_velocity_law;

// Velocity out of counts, by the method that its configuration chooses.
//
// Once no count comes any more the velocity falls: the wheel turned less than a count since, so by every method
// it is at most one count over the time without. A counter that has stayed within two counts for
// `VelocityEstimator::standing_s` stands, or toggles about an edge: the velocity is exactly 0 by every method
// until it has left them. Therefore an encoder with a cut wire, whose counter stands or toggles, repeats one reading,
// and a `FaultMonitor` detects it. A wheel slower than three counts in that time
// occasionally reads 0; that is at most 0.25 rad/s for coarse encoders, and 30 counts per second for fine ones.
//
// Nothing divides by a time or by counts that can be zero, and every reading is finite.
//
// The state holds the counts of `WINDOW` readings, 1 unless given: an observer, edges and a window
// of one need no more.
typedef struct {
  omni_velocity_law law;
  float count_rad;
  float period_s;
  uint32_t standing_periods;
} omni_velocity_estimator;

// A wheel's encoder on a hardware counter: from its raw reading to a velocity, by an `EncoderCounter`
// and a `VelocityEstimator`. `WINDOW` is 1 unless the velocity uses a longer window.
typedef struct {
  omni_counter counter;
  omni_velocity_estimator velocity;
} omni_encoder;

// Torque-speed line of a DC motor, in four quadrants: speed costs torque only while the motor drives.
//
// Driving (torque and velocity of one sign): `max(0, min(cap, stall - slope |v|))`. Braking:
// `min(cap, stall)`. As printed, eq. (13) turns negative above 114.5 rpm and would push a fast
// wheel backwards; here a limit is never negative.
typedef struct {
  // The line's value at rest.
  float stall_n_m;
  float slope_n_m_s_rad;
  // Largest torque in any quadrant, at most the stall torque.
  float cap_n_m;
} omni_motor;

// Limits of a motion that are the same in every direction. The unit of velocity is the user's, [m/s] or [rad/s].
//
// Infinity means no limit. Checked by `TwistLimiter::new`.
typedef struct {
  // Highest speed [m/s or rad/s], >= 0.
  float velocity;
  // Change of velocity while the speed grows [m/s^2 or rad/s^2], > 0.
  float acceleration;
  // Change of velocity while the speed shrinks [m/s^2 or rad/s^2], > 0.
  float deceleration;
  // Change of the acceleration [m/s^3 or rad/s^3], > 0.
  float jerk;
} omni_motion_limits;

// Constant jerk for a while; the last one of a segment goes on for ever.
typedef struct {
  // When it begins [s] and where [m], from the start of its segment.
  float start_s;
  float start_m;
  // Speed, acceleration then, and jerk [m/s, m/s^2, m/s^3].
  float speed;
  float acceleration;
  float jerk;
} omni_path_phase;

// The segment from one waypoint to the next: its pieces, and the distance along them over time. Made by
// `TrajectoryPlanner`.
typedef struct {
  float start_s;
  float duration_s;
  float length_m;
  // Its pieces: the first and how many.
  uint16_t first;
  uint16_t count;
  bool on_the_spot;
  // Its limits, and its speeds at both ends.
  omni_motion_limits allowed;
  float ends[2];
  omni_path_phase phases[7];
} omni_path_segment;

// A piece of a path: x, y and heading as polynomials of the fifth degree of the way along it. Made by
// `TrajectoryPlanner`.
typedef struct {
  // Its start on its segment [m, or rad of a turn on the spot].
  float start_m;
  // One over its length; 0 of a place.
  float per_length;
  // Coefficients of x [m], y [m] and heading [rad], of the part of the piece that is behind, 0 to 1.
  float x[6];
  float y[6];
  float yaw[6];
} omni_path_piece;

// A path with its times: `OMNI_TRAJECTORY`.
typedef struct {
  const omni_path_segment *segments;
  const omni_path_piece *pieces;
  uint32_t segment_count;
  uint32_t piece_count;
} omni_trajectory;

// Velocity of the vehicle's origin along the world's axes.
typedef struct {
  // Velocity along world x [m/s].
  float vx_m_s;
  // Velocity along world y [m/s].
  float vy_m_s;
  // Yaw rate [rad/s] (counter-clockwise is +), the same in both frames.
  float wz_rad_s;
} omni_world_twist;

// A `Trajectory` at one time.
typedef struct {
  // The time asked for [s].
  float time_s;
  // Reference pose [m, m, rad], the heading in (-pi, pi].
  omni_pose pose;
  // How to move [m/s, m/s, rad/s], along the world's axes.
  omni_world_twist velocity;
  // How that changes [m/s^2, m/s^2, rad/s^2], along the world's axes.
  float acceleration[3];
  // Speed along the path [m/s], rad/s in a turn on the spot; >= 0.
  float speed_m_s;
  // The end is reached: the pose is the last one, and everything rests.
  bool done;
  // Time since the end was reached [s]; 0 before.
  float over_s;
} omni_trajectory_sample;

// Gains and limits of a `HolonomicFollower`.
typedef struct {
  // Velocity asked for per distance [m/s per m], 0 to 1000. Its inverse is the time constant
  // of the return: it should be several times the time constant of the wheels' loops.
  float gain_per_s;
  // Yaw rate asked for per heading error [rad/s per rad], 0 to 1000; as above.
  float heading_gain_per_s;
  // Largest correction of the velocity, as a vector [m/s], 0 to 1000.
  float limit_m_s;
  // Largest correction of the yaw rate [rad/s], 0 to 1000.
  float limit_rad_s;
} omni_follower_config;

// Follows a trajectory: its velocity in the vehicle frame, and a correction proportional to the pose error. Goes
// before the limits of the twist. It has no state.
//
// The correction of the velocity is limited as a vector, so that its direction stays; the yaw rate correction follows
// the shorter turn.
//
// After the end of the trajectory the command is exactly 0, so that the torque ends, while the vehicle is
// within 5 mm and 0.01 rad of the last pose, from 2 s after the end on within 15 mm and 0.03 rad. Farther
// away it is brought back. A pose that is not finite corrects nothing: the trajectory's own twist is driven.
typedef struct {
  omni_follower_config config;
} omni_follower;

// Result of a `HolonomicFollower`: the errors and the command.
typedef struct {
  // The twist to command [m/s, m/s, rad/s].
  omni_twist twist;
  // Position error in the vehicle frame: forward, left [m]. 0 if the pose is not known.
  float error_m[2];
  // Heading error, by the shorter turn [rad], in (-pi, pi]. 0 if the pose is not known.
  float error_rad;
} omni_follow_sample;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Makes the state and the sample of a three-wheel vehicle ready for the first step.
omni_status omni3_init(omni3_state *state, omni3_sample *sample);

// One control period of a three-wheel vehicle: from the command and the measured wheel velocities [rad/s] to
// torques [N.m], in `sample->wheels.applied.n_m`. To be called once every period that the controller was made for.
//
// A command that is no number stands for rest; a measurement that is none releases its wheel.
// `command` and `measured` must not lie within `sample` or `state`.
omni_status omni3_step(const omni3_controller *controller,
                       omni3_state *state,
                       const omni_twist *command,
                       const omni3_velocities *measured,
                       omni3_sample *sample);

// The motion that the measured wheel velocities [rad/s] of a three-wheel vehicle amount to, by least squares.
omni_status omni3_estimate(const omni3_controller *controller,
                           const omni3_velocities *measured,
                           omni_twist *twist);

// Makes the state and the output of a three-wheel vehicle ready for the first step: at rest at the
// origin, every wheel trusted.
omni_status omni3_drive_init(const omni3_drive *drive,
                                   omni3_drive_state *state,
                                   omni3_drive_output *output);

// One control period of a three-wheel vehicle: from what arrived to torques [N.m], in `output->torques.n_m`.
// To be called once every period that the drive was made for, always with the same `drive`.
//
// Nonsense in the input is rejected, or its wheel is released. `input` must not lie within `output`.
omni_status omni3_drive_step(const omni3_drive *drive,
                             omni3_drive_state *state,
                             const omni3_drive_input *input,
                             omni3_drive_output *output);

// Makes the state and the output of a three-wheel vehicle under traction control ready for the
// first step: at rest at the origin, every wheel trusted.
omni_status omni3_traction_drive_init(const omni3_traction_drive *drive,
                                            omni3_traction_drive_state *state,
                                            omni3_traction_drive_output *output);

// One control period of a three-wheel vehicle under traction control: from what arrived to torques
// [N.m], in `output->drive.torques.n_m`. To be called once every period that the drive was made
// for, always with the same `drive`.
//
// Nonsense in the input is rejected, or its wheel is released. `input` and `bodies` must not lie within `output`.
omni_status omni3_traction_drive_step(const omni3_traction_drive *drive,
                                      omni3_traction_drive_state *state,
                                      const omni3_drive_input *input,
                                      const omni_body_readings *bodies,
                                      omni3_traction_drive_output *output);

// Makes the state of an estimator of a three-wheel vehicle ready for the first step, at the
// origin; `output` is what it starts with.
omni_status omni3_estimator_init(const omni3_estimator *estimator,
                                       omni3_estimator_state *state,
                                       omni_estimator_output *output);

// Pose and velocity of a three-wheel vehicle from the readings of one control period. To be called
// once every period that the estimator was made for, always with the same `estimator`.
//
// A reading that is no number counts as one that did not arrive.
omni_status omni3_estimator_step(const omni3_estimator *estimator,
                                 omni3_estimator_state *state,
                                 const omni3_estimator_input *input,
                                 omni_estimator_output *output);

// The vehicle's pose is known from outside, to `deviations`: the pose goes on from there.
omni_status omni3_estimator_reset(omni3_estimator_state *state,
                                  const omni_pose *pose,
                                  const omni_deviations *deviations);

// Ends a safe stop. Every reading is judged afresh, and commands that arrive from now on are followed.
// A safe stop whose cause lasts begins anew.
omni_status omni3_drive_release_safe_stop(omni3_drive_state *state);

// The vehicle's pose is known from outside: the pose goes on from `x_m`, `y_m` [m] and `yaw_rad`
// [rad]. Its deviations stay.
omni_status omni3_drive_reset_pose(omni3_drive_state *state, float x_m, float y_m, float yaw_rad);

// Standard deviations of the pose.
omni_status omni3_drive_deviations(const omni3_drive_state *state, omni_deviations *deviations);

// Ends a safe stop. Every reading is judged afresh, and commands that arrive from now on are followed.
// A safe stop whose cause lasts begins anew.
omni_status omni3_traction_drive_release_safe_stop(omni3_traction_drive_state *state);

// The vehicle's pose is known from outside: the pose goes on from `x_m`, `y_m` [m] and `yaw_rad`
// [rad]. Its deviations stay.
omni_status omni3_traction_drive_reset_pose(omni3_traction_drive_state *state,
                                            float x_m,
                                            float y_m,
                                            float yaw_rad);

// Standard deviations of the pose.
omni_status omni3_traction_drive_deviations(const omni3_traction_drive_state *state,
                                            omni_deviations *deviations);

// Makes the state and the sample of a four-wheel vehicle ready for the first step.
omni_status omni4_init(omni4_state *state, omni4_sample *sample);

// One control period of a four-wheel vehicle: from the command and the measured wheel velocities [rad/s] to
// torques [N.m], in `sample->wheels.applied.n_m`. To be called once every period that the controller was made for.
//
// A command that is no number stands for rest; a measurement that is none releases its wheel.
// `command` and `measured` must not lie within `sample` or `state`.
omni_status omni4_step(const omni4_controller *controller,
                       omni4_state *state,
                       const omni_twist *command,
                       const omni4_velocities *measured,
                       omni4_sample *sample);

// The motion that the measured wheel velocities [rad/s] of a four-wheel vehicle amount to, by least squares.
omni_status omni4_estimate(const omni4_controller *controller,
                           const omni4_velocities *measured,
                           omni_twist *twist);

// Makes the state and the output of a four-wheel vehicle ready for the first step: at rest at the
// origin, every wheel trusted.
omni_status omni4_drive_init(const omni4_drive *drive,
                                   omni4_drive_state *state,
                                   omni4_drive_output *output);

// One control period of a four-wheel vehicle: from what arrived to torques [N.m], in `output->torques.n_m`.
// To be called once every period that the drive was made for, always with the same `drive`.
//
// Nonsense in the input is rejected, or its wheel is released. `input` must not lie within `output`.
omni_status omni4_drive_step(const omni4_drive *drive,
                             omni4_drive_state *state,
                             const omni4_drive_input *input,
                             omni4_drive_output *output);

// Makes the state and the output of a four-wheel vehicle under traction control ready for the
// first step: at rest at the origin, every wheel trusted.
omni_status omni4_traction_drive_init(const omni4_traction_drive *drive,
                                            omni4_traction_drive_state *state,
                                            omni4_traction_drive_output *output);

// One control period of a four-wheel vehicle under traction control: from what arrived to torques
// [N.m], in `output->drive.torques.n_m`. To be called once every period that the drive was made
// for, always with the same `drive`.
//
// Nonsense in the input is rejected, or its wheel is released. `input` and `bodies` must not lie within `output`.
omni_status omni4_traction_drive_step(const omni4_traction_drive *drive,
                                      omni4_traction_drive_state *state,
                                      const omni4_drive_input *input,
                                      const omni_body_readings *bodies,
                                      omni4_traction_drive_output *output);

// Makes the state of an estimator of a four-wheel vehicle ready for the first step, at the
// origin; `output` is what it starts with.
omni_status omni4_estimator_init(const omni4_estimator *estimator,
                                       omni4_estimator_state *state,
                                       omni_estimator_output *output);

// Pose and velocity of a four-wheel vehicle from the readings of one control period. To be called
// once every period that the estimator was made for, always with the same `estimator`.
//
// A reading that is no number counts as one that did not arrive.
omni_status omni4_estimator_step(const omni4_estimator *estimator,
                                 omni4_estimator_state *state,
                                 const omni4_estimator_input *input,
                                 omni_estimator_output *output);

// The vehicle's pose is known from outside, to `deviations`: the pose goes on from there.
omni_status omni4_estimator_reset(omni4_estimator_state *state,
                                  const omni_pose *pose,
                                  const omni_deviations *deviations);

// Ends a safe stop. Every reading is judged afresh, and commands that arrive from now on are followed.
// A safe stop whose cause lasts begins anew.
omni_status omni4_drive_release_safe_stop(omni4_drive_state *state);

// The vehicle's pose is known from outside: the pose goes on from `x_m`, `y_m` [m] and `yaw_rad`
// [rad]. Its deviations stay.
omni_status omni4_drive_reset_pose(omni4_drive_state *state, float x_m, float y_m, float yaw_rad);

// Standard deviations of the pose.
omni_status omni4_drive_deviations(const omni4_drive_state *state, omni_deviations *deviations);

// Ends a safe stop. Every reading is judged afresh, and commands that arrive from now on are followed.
// A safe stop whose cause lasts begins anew.
omni_status omni4_traction_drive_release_safe_stop(omni4_traction_drive_state *state);

// The vehicle's pose is known from outside: the pose goes on from `x_m`, `y_m` [m] and `yaw_rad`
// [rad]. Its deviations stay.
omni_status omni4_traction_drive_reset_pose(omni4_traction_drive_state *state,
                                            float x_m,
                                            float y_m,
                                            float yaw_rad);

// Standard deviations of the pose.
omni_status omni4_traction_drive_deviations(const omni4_traction_drive_state *state,
                                            omni_deviations *deviations);

// Makes the state and the sample of a five-wheel vehicle ready for the first step.
omni_status omni5_init(omni5_state *state, omni5_sample *sample);

// One control period of a five-wheel vehicle: from the command and the measured wheel velocities [rad/s] to
// torques [N.m], in `sample->wheels.applied.n_m`. To be called once every period that the controller was made for.
//
// A command that is no number stands for rest; a measurement that is none releases its wheel.
// `command` and `measured` must not lie within `sample` or `state`.
omni_status omni5_step(const omni5_controller *controller,
                       omni5_state *state,
                       const omni_twist *command,
                       const omni5_velocities *measured,
                       omni5_sample *sample);

// The motion that the measured wheel velocities [rad/s] of a five-wheel vehicle amount to, by least squares.
omni_status omni5_estimate(const omni5_controller *controller,
                           const omni5_velocities *measured,
                           omni_twist *twist);

// Makes the state and the output of a five-wheel vehicle ready for the first step: at rest at the
// origin, every wheel trusted.
omni_status omni5_drive_init(const omni5_drive *drive,
                                   omni5_drive_state *state,
                                   omni5_drive_output *output);

// One control period of a five-wheel vehicle: from what arrived to torques [N.m], in `output->torques.n_m`.
// To be called once every period that the drive was made for, always with the same `drive`.
//
// Nonsense in the input is rejected, or its wheel is released. `input` must not lie within `output`.
omni_status omni5_drive_step(const omni5_drive *drive,
                             omni5_drive_state *state,
                             const omni5_drive_input *input,
                             omni5_drive_output *output);

// Makes the state and the output of a five-wheel vehicle under traction control ready for the
// first step: at rest at the origin, every wheel trusted.
omni_status omni5_traction_drive_init(const omni5_traction_drive *drive,
                                            omni5_traction_drive_state *state,
                                            omni5_traction_drive_output *output);

// One control period of a five-wheel vehicle under traction control: from what arrived to torques
// [N.m], in `output->drive.torques.n_m`. To be called once every period that the drive was made
// for, always with the same `drive`.
//
// Nonsense in the input is rejected, or its wheel is released. `input` and `bodies` must not lie within `output`.
omni_status omni5_traction_drive_step(const omni5_traction_drive *drive,
                                      omni5_traction_drive_state *state,
                                      const omni5_drive_input *input,
                                      const omni_body_readings *bodies,
                                      omni5_traction_drive_output *output);

// Makes the state of an estimator of a five-wheel vehicle ready for the first step, at the
// origin; `output` is what it starts with.
omni_status omni5_estimator_init(const omni5_estimator *estimator,
                                       omni5_estimator_state *state,
                                       omni_estimator_output *output);

// Pose and velocity of a five-wheel vehicle from the readings of one control period. To be called
// once every period that the estimator was made for, always with the same `estimator`.
//
// A reading that is no number counts as one that did not arrive.
omni_status omni5_estimator_step(const omni5_estimator *estimator,
                                 omni5_estimator_state *state,
                                 const omni5_estimator_input *input,
                                 omni_estimator_output *output);

// The vehicle's pose is known from outside, to `deviations`: the pose goes on from there.
omni_status omni5_estimator_reset(omni5_estimator_state *state,
                                  const omni_pose *pose,
                                  const omni_deviations *deviations);

// Ends a safe stop. Every reading is judged afresh, and commands that arrive from now on are followed.
// A safe stop whose cause lasts begins anew.
omni_status omni5_drive_release_safe_stop(omni5_drive_state *state);

// The vehicle's pose is known from outside: the pose goes on from `x_m`, `y_m` [m] and `yaw_rad`
// [rad]. Its deviations stay.
omni_status omni5_drive_reset_pose(omni5_drive_state *state, float x_m, float y_m, float yaw_rad);

// Standard deviations of the pose.
omni_status omni5_drive_deviations(const omni5_drive_state *state, omni_deviations *deviations);

// Ends a safe stop. Every reading is judged afresh, and commands that arrive from now on are followed.
// A safe stop whose cause lasts begins anew.
omni_status omni5_traction_drive_release_safe_stop(omni5_traction_drive_state *state);

// The vehicle's pose is known from outside: the pose goes on from `x_m`, `y_m` [m] and `yaw_rad`
// [rad]. Its deviations stay.
omni_status omni5_traction_drive_reset_pose(omni5_traction_drive_state *state,
                                            float x_m,
                                            float y_m,
                                            float yaw_rad);

// Standard deviations of the pose.
omni_status omni5_traction_drive_deviations(const omni5_traction_drive_state *state,
                                            omni_deviations *deviations);

// Makes the state and the sample of a six-wheel vehicle ready for the first step.
omni_status omni6_init(omni6_state *state, omni6_sample *sample);

// One control period of a six-wheel vehicle: from the command and the measured wheel velocities [rad/s] to
// torques [N.m], in `sample->wheels.applied.n_m`. To be called once every period that the controller was made for.
//
// A command that is no number stands for rest; a measurement that is none releases its wheel.
// `command` and `measured` must not lie within `sample` or `state`.
omni_status omni6_step(const omni6_controller *controller,
                       omni6_state *state,
                       const omni_twist *command,
                       const omni6_velocities *measured,
                       omni6_sample *sample);

// The motion that the measured wheel velocities [rad/s] of a six-wheel vehicle amount to, by least squares.
omni_status omni6_estimate(const omni6_controller *controller,
                           const omni6_velocities *measured,
                           omni_twist *twist);

// Makes the state and the output of a six-wheel vehicle ready for the first step: at rest at the
// origin, every wheel trusted.
omni_status omni6_drive_init(const omni6_drive *drive,
                                   omni6_drive_state *state,
                                   omni6_drive_output *output);

// One control period of a six-wheel vehicle: from what arrived to torques [N.m], in `output->torques.n_m`.
// To be called once every period that the drive was made for, always with the same `drive`.
//
// Nonsense in the input is rejected, or its wheel is released. `input` must not lie within `output`.
omni_status omni6_drive_step(const omni6_drive *drive,
                             omni6_drive_state *state,
                             const omni6_drive_input *input,
                             omni6_drive_output *output);

// Makes the state and the output of a six-wheel vehicle under traction control ready for the
// first step: at rest at the origin, every wheel trusted.
omni_status omni6_traction_drive_init(const omni6_traction_drive *drive,
                                            omni6_traction_drive_state *state,
                                            omni6_traction_drive_output *output);

// One control period of a six-wheel vehicle under traction control: from what arrived to torques
// [N.m], in `output->drive.torques.n_m`. To be called once every period that the drive was made
// for, always with the same `drive`.
//
// Nonsense in the input is rejected, or its wheel is released. `input` and `bodies` must not lie within `output`.
omni_status omni6_traction_drive_step(const omni6_traction_drive *drive,
                                      omni6_traction_drive_state *state,
                                      const omni6_drive_input *input,
                                      const omni_body_readings *bodies,
                                      omni6_traction_drive_output *output);

// Makes the state of an estimator of a six-wheel vehicle ready for the first step, at the
// origin; `output` is what it starts with.
omni_status omni6_estimator_init(const omni6_estimator *estimator,
                                       omni6_estimator_state *state,
                                       omni_estimator_output *output);

// Pose and velocity of a six-wheel vehicle from the readings of one control period. To be called
// once every period that the estimator was made for, always with the same `estimator`.
//
// A reading that is no number counts as one that did not arrive.
omni_status omni6_estimator_step(const omni6_estimator *estimator,
                                 omni6_estimator_state *state,
                                 const omni6_estimator_input *input,
                                 omni_estimator_output *output);

// The vehicle's pose is known from outside, to `deviations`: the pose goes on from there.
omni_status omni6_estimator_reset(omni6_estimator_state *state,
                                  const omni_pose *pose,
                                  const omni_deviations *deviations);

// Ends a safe stop. Every reading is judged afresh, and commands that arrive from now on are followed.
// A safe stop whose cause lasts begins anew.
omni_status omni6_drive_release_safe_stop(omni6_drive_state *state);

// The vehicle's pose is known from outside: the pose goes on from `x_m`, `y_m` [m] and `yaw_rad`
// [rad]. Its deviations stay.
omni_status omni6_drive_reset_pose(omni6_drive_state *state, float x_m, float y_m, float yaw_rad);

// Standard deviations of the pose.
omni_status omni6_drive_deviations(const omni6_drive_state *state, omni_deviations *deviations);

// Ends a safe stop. Every reading is judged afresh, and commands that arrive from now on are followed.
// A safe stop whose cause lasts begins anew.
omni_status omni6_traction_drive_release_safe_stop(omni6_traction_drive_state *state);

// The vehicle's pose is known from outside: the pose goes on from `x_m`, `y_m` [m] and `yaw_rad`
// [rad]. Its deviations stay.
omni_status omni6_traction_drive_reset_pose(omni6_traction_drive_state *state,
                                            float x_m,
                                            float y_m,
                                            float yaw_rad);

// Standard deviations of the pose.
omni_status omni6_traction_drive_deviations(const omni6_traction_drive_state *state,
                                            omni_deviations *deviations);

// Makes the state and the sample of a seven-wheel vehicle ready for the first step.
omni_status omni7_init(omni7_state *state, omni7_sample *sample);

// One control period of a seven-wheel vehicle: from the command and the measured wheel velocities [rad/s] to
// torques [N.m], in `sample->wheels.applied.n_m`. To be called once every period that the controller was made for.
//
// A command that is no number stands for rest; a measurement that is none releases its wheel.
// `command` and `measured` must not lie within `sample` or `state`.
omni_status omni7_step(const omni7_controller *controller,
                       omni7_state *state,
                       const omni_twist *command,
                       const omni7_velocities *measured,
                       omni7_sample *sample);

// The motion that the measured wheel velocities [rad/s] of a seven-wheel vehicle amount to, by least squares.
omni_status omni7_estimate(const omni7_controller *controller,
                           const omni7_velocities *measured,
                           omni_twist *twist);

// Makes the state and the output of a seven-wheel vehicle ready for the first step: at rest at the
// origin, every wheel trusted.
omni_status omni7_drive_init(const omni7_drive *drive,
                                   omni7_drive_state *state,
                                   omni7_drive_output *output);

// One control period of a seven-wheel vehicle: from what arrived to torques [N.m], in `output->torques.n_m`.
// To be called once every period that the drive was made for, always with the same `drive`.
//
// Nonsense in the input is rejected, or its wheel is released. `input` must not lie within `output`.
omni_status omni7_drive_step(const omni7_drive *drive,
                             omni7_drive_state *state,
                             const omni7_drive_input *input,
                             omni7_drive_output *output);

// Makes the state and the output of a seven-wheel vehicle under traction control ready for the
// first step: at rest at the origin, every wheel trusted.
omni_status omni7_traction_drive_init(const omni7_traction_drive *drive,
                                            omni7_traction_drive_state *state,
                                            omni7_traction_drive_output *output);

// One control period of a seven-wheel vehicle under traction control: from what arrived to torques
// [N.m], in `output->drive.torques.n_m`. To be called once every period that the drive was made
// for, always with the same `drive`.
//
// Nonsense in the input is rejected, or its wheel is released. `input` and `bodies` must not lie within `output`.
omni_status omni7_traction_drive_step(const omni7_traction_drive *drive,
                                      omni7_traction_drive_state *state,
                                      const omni7_drive_input *input,
                                      const omni_body_readings *bodies,
                                      omni7_traction_drive_output *output);

// Makes the state of an estimator of a seven-wheel vehicle ready for the first step, at the
// origin; `output` is what it starts with.
omni_status omni7_estimator_init(const omni7_estimator *estimator,
                                       omni7_estimator_state *state,
                                       omni_estimator_output *output);

// Pose and velocity of a seven-wheel vehicle from the readings of one control period. To be called
// once every period that the estimator was made for, always with the same `estimator`.
//
// A reading that is no number counts as one that did not arrive.
omni_status omni7_estimator_step(const omni7_estimator *estimator,
                                 omni7_estimator_state *state,
                                 const omni7_estimator_input *input,
                                 omni_estimator_output *output);

// The vehicle's pose is known from outside, to `deviations`: the pose goes on from there.
omni_status omni7_estimator_reset(omni7_estimator_state *state,
                                  const omni_pose *pose,
                                  const omni_deviations *deviations);

// Ends a safe stop. Every reading is judged afresh, and commands that arrive from now on are followed.
// A safe stop whose cause lasts begins anew.
omni_status omni7_drive_release_safe_stop(omni7_drive_state *state);

// The vehicle's pose is known from outside: the pose goes on from `x_m`, `y_m` [m] and `yaw_rad`
// [rad]. Its deviations stay.
omni_status omni7_drive_reset_pose(omni7_drive_state *state, float x_m, float y_m, float yaw_rad);

// Standard deviations of the pose.
omni_status omni7_drive_deviations(const omni7_drive_state *state, omni_deviations *deviations);

// Ends a safe stop. Every reading is judged afresh, and commands that arrive from now on are followed.
// A safe stop whose cause lasts begins anew.
omni_status omni7_traction_drive_release_safe_stop(omni7_traction_drive_state *state);

// The vehicle's pose is known from outside: the pose goes on from `x_m`, `y_m` [m] and `yaw_rad`
// [rad]. Its deviations stay.
omni_status omni7_traction_drive_reset_pose(omni7_traction_drive_state *state,
                                            float x_m,
                                            float y_m,
                                            float yaw_rad);

// Standard deviations of the pose.
omni_status omni7_traction_drive_deviations(const omni7_traction_drive_state *state,
                                            omni_deviations *deviations);

// Makes the state and the sample of a eight-wheel vehicle ready for the first step.
omni_status omni8_init(omni8_state *state, omni8_sample *sample);

// One control period of a eight-wheel vehicle: from the command and the measured wheel velocities [rad/s] to
// torques [N.m], in `sample->wheels.applied.n_m`. To be called once every period that the controller was made for.
//
// A command that is no number stands for rest; a measurement that is none releases its wheel.
// `command` and `measured` must not lie within `sample` or `state`.
omni_status omni8_step(const omni8_controller *controller,
                       omni8_state *state,
                       const omni_twist *command,
                       const omni8_velocities *measured,
                       omni8_sample *sample);

// The motion that the measured wheel velocities [rad/s] of a eight-wheel vehicle amount to, by least squares.
omni_status omni8_estimate(const omni8_controller *controller,
                           const omni8_velocities *measured,
                           omni_twist *twist);

// Makes the state and the output of a eight-wheel vehicle ready for the first step: at rest at the
// origin, every wheel trusted.
omni_status omni8_drive_init(const omni8_drive *drive,
                                   omni8_drive_state *state,
                                   omni8_drive_output *output);

// One control period of a eight-wheel vehicle: from what arrived to torques [N.m], in `output->torques.n_m`.
// To be called once every period that the drive was made for, always with the same `drive`.
//
// Nonsense in the input is rejected, or its wheel is released. `input` must not lie within `output`.
omni_status omni8_drive_step(const omni8_drive *drive,
                             omni8_drive_state *state,
                             const omni8_drive_input *input,
                             omni8_drive_output *output);

// Makes the state and the output of a eight-wheel vehicle under traction control ready for the
// first step: at rest at the origin, every wheel trusted.
omni_status omni8_traction_drive_init(const omni8_traction_drive *drive,
                                            omni8_traction_drive_state *state,
                                            omni8_traction_drive_output *output);

// One control period of a eight-wheel vehicle under traction control: from what arrived to torques
// [N.m], in `output->drive.torques.n_m`. To be called once every period that the drive was made
// for, always with the same `drive`.
//
// Nonsense in the input is rejected, or its wheel is released. `input` and `bodies` must not lie within `output`.
omni_status omni8_traction_drive_step(const omni8_traction_drive *drive,
                                      omni8_traction_drive_state *state,
                                      const omni8_drive_input *input,
                                      const omni_body_readings *bodies,
                                      omni8_traction_drive_output *output);

// Makes the state of an estimator of a eight-wheel vehicle ready for the first step, at the
// origin; `output` is what it starts with.
omni_status omni8_estimator_init(const omni8_estimator *estimator,
                                       omni8_estimator_state *state,
                                       omni_estimator_output *output);

// Pose and velocity of a eight-wheel vehicle from the readings of one control period. To be called
// once every period that the estimator was made for, always with the same `estimator`.
//
// A reading that is no number counts as one that did not arrive.
omni_status omni8_estimator_step(const omni8_estimator *estimator,
                                 omni8_estimator_state *state,
                                 const omni8_estimator_input *input,
                                 omni_estimator_output *output);

// The vehicle's pose is known from outside, to `deviations`: the pose goes on from there.
omni_status omni8_estimator_reset(omni8_estimator_state *state,
                                  const omni_pose *pose,
                                  const omni_deviations *deviations);

// Ends a safe stop. Every reading is judged afresh, and commands that arrive from now on are followed.
// A safe stop whose cause lasts begins anew.
omni_status omni8_drive_release_safe_stop(omni8_drive_state *state);

// The vehicle's pose is known from outside: the pose goes on from `x_m`, `y_m` [m] and `yaw_rad`
// [rad]. Its deviations stay.
omni_status omni8_drive_reset_pose(omni8_drive_state *state, float x_m, float y_m, float yaw_rad);

// Standard deviations of the pose.
omni_status omni8_drive_deviations(const omni8_drive_state *state, omni_deviations *deviations);

// Ends a safe stop. Every reading is judged afresh, and commands that arrive from now on are followed.
// A safe stop whose cause lasts begins anew.
omni_status omni8_traction_drive_release_safe_stop(omni8_traction_drive_state *state);

// The vehicle's pose is known from outside: the pose goes on from `x_m`, `y_m` [m] and `yaw_rad`
// [rad]. Its deviations stay.
omni_status omni8_traction_drive_reset_pose(omni8_traction_drive_state *state,
                                            float x_m,
                                            float y_m,
                                            float yaw_rad);

// Standard deviations of the pose.
omni_status omni8_traction_drive_deviations(const omni8_traction_drive_state *state,
                                            omni_deviations *deviations);

// Brings `command` within the vehicle's limits, for one control period; `limited` is what to give
// to the step. `state` is all zero at the start: `static omni_limiter_state state;`.
omni_status omni_limit(const omni_limiter *limiter,
                       omni_limiter_state *state,
                       const omni_twist *command,
                       omni_twist *limited);

// Makes the state of one wheel's encoder ready for the first reading.
omni_status omni_encoder_init(omni_encoder_state *state);

// Takes in the counter of a wheel's encoder as it stands (16 bits, or more of which the lower 16 are
// used), once every control period, and gives the wheel's velocity [rad/s]; 0 at the first reading.
// The counter may wrap around; right while the wheel turns by less than 32768 counts per period.
//
// `since_edge_s` is the time from the last edge to now [s], for encoders whose velocities come
// from edges; NaN if it is not known.
omni_status omni_encoder_step(const omni_encoder *encoder,
                              omni_encoder_state *state,
                              uint32_t raw,
                              float since_edge_s,
                              float *rad_s);

// The same for a counter that was read `since_reading_s` [s] after the last time, if that was
// measured: a period that came late or is not constant.
omni_status omni_encoder_step_after(const omni_encoder *encoder,
                                    omni_encoder_state *state,
                                    uint32_t raw,
                                    float since_reading_s,
                                    float since_edge_s,
                                    float *rad_s);

// A control period in which the counter could not be read, instead of `omni_encoder_step`: the
// next reading is right about the time.
omni_status omni_encoder_missed(const omni_encoder *encoder, omni_encoder_state *state);

// Makes the readings of an inertial measurement unit ready for the first one, if it computes no angles itself.
omni_status omni_imu_init(omni_imu *imu);

// Follows `roll_rad` and `pitch_rad` by `rate_rad_s` and `specific_force_m_s2`, which were read `period_s` [s] after
// the last time. `OMNI_STATUS_NOT_FINITE` if one of them is no number, or the first force is far from 1 g: the angles
// stay, and the unit counts as not received.
omni_status omni_imu_update_angles(omni_imu *imu,
                                   float period_s);

// The duty, -1 to 1, of a bridge without a current loop that applies `torque_n_m` [N.m] at `velocity_rad_s` [rad/s],
// or the nearest there is: `OMNI_MOTORS[i]`. 0 shorts the motor, which brakes; to let a wheel go, open the bridge.
omni_status omni_duty(const omni_motor *motor,
                      float torque_n_m,
                      float velocity_rad_s,
                      float *duty);

// `omni_duty` if the supply has `supply_part` of the voltage of `OMNI_MOTORS`, above 0:
// a battery that runs down. 0 for a part that is not above 0.
omni_status omni_duty_at(const omni_motor *motor,
                         float torque_n_m,
                         float velocity_rad_s,
                         float supply_part,
                         float *duty);

// Reference pose `time_s` [s] after the start of the path. Before the start it is the start, after the
// end it is the end, at rest.
omni_status omni_trajectory_at(const omni_trajectory *trajectory,
                               float time_s,
                               omni_trajectory_sample *sample);

// Duration of the path [s].
omni_status omni_trajectory_duration(const omni_trajectory *trajectory, float *duration_s);

// The twist that brings a vehicle at `pose` to the reference pose and keeps it there: a command for the drive.
omni_status omni_follow(const omni_follower *follower,
                        const omni_trajectory_sample *sample,
                        const omni_pose *pose,
                        omni_follow_sample *follow);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* OMNISTEP_H */
