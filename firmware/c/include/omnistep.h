/* omnistep: control of omni-directional vehicles, in single precision. C11 and C++11; neither heap nor C library needed.
 *
 * A controller is a constant that `omnistep constants` writes from a vehicle file; what changes is in a state. Units are
 * SI: m, m/s, rad/s, N.m, s. Fill in constants by that command only: their flags and tags have to be valid. Comments that name
 * `Types` mean those of the Rust library, which has them documented in full. Generated from the Rust sources by cbindgen; not to be edited. */

#ifndef OMNISTEP_H
#define OMNISTEP_H

#include <stdbool.h>
#include <stdint.h>

// Which error the integrals take in.
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

// For how many periods in a row each wheel has asked for more than the same limit: what keeps integrals from winding up
// waits for 8. Wheel i is bit i; at most 32 wheels.
typedef struct {
  // Wheels that were beyond a limit in the step before.
  uint32_t beyond;
  // Those of them that asked for more than their upper limit.
  uint32_t above;
  // Periods in a row before that one, up to 7, a binary digit a number: the counts of all wheels go up at once.
  uint32_t count[3];
} omni_overload;

// A sum and what its rounding left out, carried into the next addition (after Neumaier, 1974).
typedef struct {
  // The sum, rounded.
  float total;
  // Exact sum less `total`: at most half a unit in its last place.
  float rest;
} omni_sum;

// What the loops remember between steps; `default` is a fresh start.
typedef struct {
  // Integral term of each wheel [N.m].
  float integral_n_m[3];
  // Derivative term of each wheel [N.m], after its filter.
  float derivative_n_m[3];
  // Reference of the step before, as realised [rad/s].
  float last_reference_rad_s[3];
  // Measurement of the step before [rad/s].
  float last_measured_rad_s[3];
  // There was a step before.
  bool started[3];
  // Which wheels are overloaded, and for how long the others have been beyond a limit.
  omni_overload overload;
  // Tenths of the periods that integrals were held while every reference was 0, less those that have come back.
  uint32_t held;
  // Heat of that [N^2.m^2.s].
  omni_sum held_heat_n2m2s;
  // Periods that they fell since then.
  float bled_periods;
} omni3_state;

// Velocity of the vehicle in its own frame: what the inverse kinematics takes. Not a world velocity.
typedef struct {
  // Forward velocity [m/s] (forward is +).
  float vx_m_s;
  // Sideways velocity [m/s] (left is +).
  float vy_m_s;
  // Yaw rate [rad/s] (counter-clockwise seen from above is +).
  float wz_rad_s;
} omni_twist;

// Actuator velocities, one a wheel in the layout's order: what kinematics maps and loops control.
typedef struct {
  // Velocity of each actuator [rad/s] (positive as the wheel's rolling direction says), any finite number.
  float rad_s[3];
} omni3_velocities;

// Actuator torques, one a wheel in the layout's order: what a controller asks of motors. Not a wheel velocity.
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
  // Measurement y; 0 for a wheel that is not `active`.
  omni3_velocities measured;
  // The wheel was controlled. One without a usable measurement is let go: no torque, its loop starts afresh.
  bool active[3];
  // Proportional term, formed with the reference as reduced by `common_factor` under
  // `Saturation::ScaleReference`.
  float p_n_m[3];
  // Integral term, likewise.
  float i_n_m[3];
  // Derivative term, likewise.
  float d_n_m[3];
  // Feed-forward, likewise.
  float ff_n_m[3];
  // Torque the loops ask for with the whole reference: what would be applied had the actuators no limit.
  omni3_torques requested;
  // Torque to apply, always within the limits.
  omni3_torques applied;
  // Limits at the present velocities.
  omni3_torque_ranges range;
  // The requested torque is outside the limits.
  bool saturated[3];
  // What all torques (`Saturation::ScaleTorques`) or all references
  // (`Saturation::ScaleReference`) were multiplied by, 0 to 1; 1 under
  // `Saturation::Clip`.
  float common_factor;
} omni3_wheel_sample;

// Every signal of one step of a `Controller`.
typedef struct {
  // The command; rest where the one given was not finite, or beyond 1e6.
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

// How the integral of a saturated loop is kept from winding up.
//
// `excess` below is the output as applied minus the output as asked for: not zero only while something, a limit or a
// coordination law, changed the output.
enum omni_anti_windup_tag
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Nothing: the integral takes in every error. Overshoots after every saturation.
  OMNI_ANTI_WINDUP_NONE,
  // The integral term itself is held within +-`limit_n_m`.
  OMNI_ANTI_WINDUP_CLAMP,
  // No error is taken in that would drive a saturated output further out (conditional integration).
  OMNI_ANTI_WINDUP_CONDITIONAL,
  // The integral follows the applied output: `I' = ki e + excess / T` (Fertik and Ross).
  OMNI_ANTI_WINDUP_BACK_CALCULATION,
  // The loop sees the reference with which its output would just have been the applied one, in every term (Hanus'
  // conditioned controller). No parameter. Acts as `AntiWindup::Conditional` where the reference moves no term.
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
  // Largest integral term [N.m], 0 to 1e9.
  float limit_n_m;
} omni_anti_windup_Clamp_body;

typedef struct {
  // Tracking time constant T [s], the control period to 1e6: smaller forgets faster. A usual choice is kp / ki.
  float tracking_time_s;
} omni_anti_windup_BackCalculation_body;

typedef struct {
  omni_anti_windup_tag tag;
  union {
    omni_anti_windup_Clamp_body CLAMP;
    omni_anti_windup_BackCalculation_body BACK_CALCULATION;
  };
} omni_anti_windup;

// Torque limits of one wheel at its present velocity [N.m]; positive drives it in its rolling direction.
typedef struct {
  // Lowest torque, <= 0.
  float lower_n_m;
  // Highest torque, >= 0.
  float upper_n_m;
} omni_torque_range;

// A PID loop's constants. What changes from step to step is in `PidState`.
//
// Formed once from a `PidConfig`; derivatives are backward differences, zero in the first step.
typedef struct {
  float kp;
  float kp_reference;
  float ki_dt;
  float ki_dt_output;
  float kd_per_dt;
  float derivative_weight;
  float derivative_memory;
  omni_feed_forward feed_forward;
  // Some term compares with the step before: a derivative or a feed-forward.
  bool remembers;
  bool feeds_forward;
  // Change of the reference with the output (0 where there is none), later and in the first step.
  float per_slope;
  float per_first_slope;
  float conditioned_gain;
  float first_conditioned_gain;
  omni_anti_windup anti_windup;
  float tracking;
  omni_torque_range output;
} omni_pid;

// The limits of `N` actuators, their numbers side by side: loops over them run several at a time where the processor can.
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
  // Eqs. (11), (12) with |torque|: all torques are multiplied by the factor of the wheel furthest over its limit.
  // Ratios of torques are kept. The integrals are not told.
  OMNI_SATURATION_SCALE_TORQUES,
  // All references are multiplied by one factor s, as large as keeps every wheel within its limit, and the loops see
  // the error against the reduced reference (a conditioned controller shared by the wheels). Ratios of velocities are
  // kept and nothing winds up.
  OMNI_SATURATION_SCALE_REFERENCE,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum omni_saturation_tag omni_saturation_tag;
#else
typedef uint8_t omni_saturation_tag;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

typedef struct {
  // The factor never falls below this, 0 to 1: a wheel may then saturate. 0 lets one blocked wheel stop all.
  float floor;
} omni_saturation_ScaleReference_body;

typedef struct {
  omni_saturation_tag tag;
  union {
    omni_saturation_ScaleReference_body SCALE_REFERENCE;
  };
} omni_saturation;

// A coordination policy: one choice of each.
typedef struct {
  // How torques are brought within limits.
  omni_saturation saturation;
  // Which error the integrals take in.
  omni_integral integral;
} omni_coordination;

// `Rest` in control periods.
typedef struct {
  float bleed_periods;
  // Time to hold, in periods times `RECOVERY`.
  uint32_t hold;
  float hold_heat;
  // What comes back in a period.
  float heat_back;
  float period_s;
} omni_rest_rule;

// PID loops of `N` wheels with a coordination policy, without a vehicle around them.
typedef struct {
  omni_pid pid;
  omni3_torque_limits limits;
  omni_coordination coordination;
  omni_rest_rule rest;
} omni3_loops;

// A vehicle's controller: kinematics and wheel loops. Immutable; what changes is in `ControlState`.
//
// The bare loop. `crate::Drive` puts shaping, faults, slip and odometry around it.
typedef struct {
  omni3_kinematics kinematics;
  omni3_loops wheels;
} omni3_controller;

// What the loops remember between steps; `default` is a fresh start.
typedef struct {
  // Integral term of each wheel [N.m].
  float integral_n_m[4];
  // Derivative term of each wheel [N.m], after its filter.
  float derivative_n_m[4];
  // Reference of the step before, as realised [rad/s].
  float last_reference_rad_s[4];
  // Measurement of the step before [rad/s].
  float last_measured_rad_s[4];
  // There was a step before.
  bool started[4];
  // Which wheels are overloaded, and for how long the others have been beyond a limit.
  omni_overload overload;
  // Tenths of the periods that integrals were held while every reference was 0, less those that have come back.
  uint32_t held;
  // Heat of that [N^2.m^2.s].
  omni_sum held_heat_n2m2s;
  // Periods that they fell since then.
  float bled_periods;
} omni4_state;

// Actuator velocities, one a wheel in the layout's order: what kinematics maps and loops control.
typedef struct {
  // Velocity of each actuator [rad/s] (positive as the wheel's rolling direction says), any finite number.
  float rad_s[4];
} omni4_velocities;

// Actuator torques, one a wheel in the layout's order: what a controller asks of motors. Not a wheel velocity.
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
  // Measurement y; 0 for a wheel that is not `active`.
  omni4_velocities measured;
  // The wheel was controlled. One without a usable measurement is let go: no torque, its loop starts afresh.
  bool active[4];
  // Proportional term, formed with the reference as reduced by `common_factor` under
  // `Saturation::ScaleReference`.
  float p_n_m[4];
  // Integral term, likewise.
  float i_n_m[4];
  // Derivative term, likewise.
  float d_n_m[4];
  // Feed-forward, likewise.
  float ff_n_m[4];
  // Torque the loops ask for with the whole reference: what would be applied had the actuators no limit.
  omni4_torques requested;
  // Torque to apply, always within the limits.
  omni4_torques applied;
  // Limits at the present velocities.
  omni4_torque_ranges range;
  // The requested torque is outside the limits.
  bool saturated[4];
  // What all torques (`Saturation::ScaleTorques`) or all references
  // (`Saturation::ScaleReference`) were multiplied by, 0 to 1; 1 under
  // `Saturation::Clip`.
  float common_factor;
} omni4_wheel_sample;

// Every signal of one step of a `Controller`.
typedef struct {
  // The command; rest where the one given was not finite, or beyond 1e6.
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

// The limits of `N` actuators, their numbers side by side: loops over them run several at a time where the processor can.
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

// A vehicle's controller: kinematics and wheel loops. Immutable; what changes is in `ControlState`.
//
// The bare loop. `crate::Drive` puts shaping, faults, slip and odometry around it.
typedef struct {
  omni4_kinematics kinematics;
  omni4_loops wheels;
} omni4_controller;

// What the loops remember between steps; `default` is a fresh start.
typedef struct {
  // Integral term of each wheel [N.m].
  float integral_n_m[7];
  // Derivative term of each wheel [N.m], after its filter.
  float derivative_n_m[7];
  // Reference of the step before, as realised [rad/s].
  float last_reference_rad_s[7];
  // Measurement of the step before [rad/s].
  float last_measured_rad_s[7];
  // There was a step before.
  bool started[7];
  // Which wheels are overloaded, and for how long the others have been beyond a limit.
  omni_overload overload;
  // Tenths of the periods that integrals were held while every reference was 0, less those that have come back.
  uint32_t held;
  // Heat of that [N^2.m^2.s].
  omni_sum held_heat_n2m2s;
  // Periods that they fell since then.
  float bled_periods;
} omni7_state;

// Actuator velocities, one a wheel in the layout's order: what kinematics maps and loops control.
typedef struct {
  // Velocity of each actuator [rad/s] (positive as the wheel's rolling direction says), any finite number.
  float rad_s[7];
} omni7_velocities;

// Actuator torques, one a wheel in the layout's order: what a controller asks of motors. Not a wheel velocity.
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
  // Measurement y; 0 for a wheel that is not `active`.
  omni7_velocities measured;
  // The wheel was controlled. One without a usable measurement is let go: no torque, its loop starts afresh.
  bool active[7];
  // Proportional term, formed with the reference as reduced by `common_factor` under
  // `Saturation::ScaleReference`.
  float p_n_m[7];
  // Integral term, likewise.
  float i_n_m[7];
  // Derivative term, likewise.
  float d_n_m[7];
  // Feed-forward, likewise.
  float ff_n_m[7];
  // Torque the loops ask for with the whole reference: what would be applied had the actuators no limit.
  omni7_torques requested;
  // Torque to apply, always within the limits.
  omni7_torques applied;
  // Limits at the present velocities.
  omni7_torque_ranges range;
  // The requested torque is outside the limits.
  bool saturated[7];
  // What all torques (`Saturation::ScaleTorques`) or all references
  // (`Saturation::ScaleReference`) were multiplied by, 0 to 1; 1 under
  // `Saturation::Clip`.
  float common_factor;
} omni7_wheel_sample;

// Every signal of one step of a `Controller`.
typedef struct {
  // The command; rest where the one given was not finite, or beyond 1e6.
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

// The limits of `N` actuators, their numbers side by side: loops over them run several at a time where the processor can.
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

// A vehicle's controller: kinematics and wheel loops. Immutable; what changes is in `ControlState`.
//
// The bare loop. `crate::Drive` puts shaping, faults, slip and odometry around it.
typedef struct {
  omni7_kinematics kinematics;
  omni7_loops wheels;
} omni7_controller;

// Velocity steps of a motion in one direction.
typedef struct {
  // Speed that a period adds to a motion in this direction.
  float up;
  // Speed that a period takes from a motion in the opposite direction.
  float down;
} omni_steps;

// Rate limiter of one axis; see `AxisLimits`. What changes from step to step is in `RateLimiterState`.
//
// With a jerk limit it looks ahead: it accelerates no more than it can take back before the target, and brakes a
// reversal no harder than it can ease before it turns. A target that stays is reached exactly, and overshot by rounding
// only (an ulp), except where the acceleration of an earlier target leaves no choice. The velocity limits hold in any
// case. Without a jerk limit no square root is taken; a period in which the velocity changes sign is shared between
// deceleration and acceleration.
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

// Limits of one group in velocity steps a period.
typedef struct {
  float speed;
  float up;
  float down;
  float jerk_step;
} omni_group;

// How a twist is limited, in velocity steps a period.
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

// Rate limiter of a twist; see `TwistLimits`. What changes from step to step is in `TwistLimiterState`.
//
// `TwistLimits::PerAxis` is three `RateLimiter`s. `TwistLimits::AlongMotion` first scales the target so that it
// obeys both speed limits. The change D of the twist that is left is then done in part: one factor for vx, vy and wz,
// the largest that both groups, linear and yaw, allow. A group decelerates while its part of D has a component against
// its velocity. A jerk limit looks ahead along D as `RateLimiter` does, and limits the change of the acceleration by
// one factor too. A target that stays is reached exactly; from rest, along a straight line and without overshoot. Only
// where a changed target finds an acceleration that points elsewhere and would carry a group out of its limits does
// that group first take its acceleration back, by itself.
typedef struct {
  omni_law law;
} omni_limiter;

// Velocity and acceleration of a limited axis; `default` is at rest.
typedef struct {
  omni_sum velocity;
  // The last velocity step that a jerk limit has to continue from.
  omni_sum step;
} omni_rate_limiter_state;

// What a `TwistLimiter` remembers between steps; `default` is at rest.
typedef struct {
  omni_rate_limiter_state axes[3];
} omni_limiter_state;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Makes the state and the sample of a three-wheel vehicle ready for the first step.
//
// Returns false, and does nothing, where a pointer is null.
bool omni3_init(omni3_state *state, omni3_sample *sample);

// One control period of a three-wheel vehicle: from the command and the measured wheel velocities [rad/s] to torques [N.m], in
// `sample->wheels.applied.n_m`. To be called once every period that the controller was made for.
//
// A command that is no number stands for rest; a measurement that is none lets its wheel go. `command` and `measured` must
// not lie within `sample` or `state`. Returns false, and does nothing, where a pointer is null.
bool omni3_step(const omni3_controller *controller,
                omni3_state *state,
                const omni_twist *command,
                const omni3_velocities *measured,
                omni3_sample *sample);

// The motion that the measured wheel velocities [rad/s] of a three-wheel vehicle amount to, by least squares.
//
// Returns false, and does nothing, where a pointer is null.
bool omni3_estimate(const omni3_controller *controller,
                    const omni3_velocities *measured,
                    omni_twist *twist);

// Makes the state and the sample of a four-wheel vehicle ready for the first step.
//
// Returns false, and does nothing, where a pointer is null.
bool omni4_init(omni4_state *state, omni4_sample *sample);

// One control period of a four-wheel vehicle: from the command and the measured wheel velocities [rad/s] to torques [N.m], in
// `sample->wheels.applied.n_m`. To be called once every period that the controller was made for.
//
// A command that is no number stands for rest; a measurement that is none lets its wheel go. `command` and `measured` must
// not lie within `sample` or `state`. Returns false, and does nothing, where a pointer is null.
bool omni4_step(const omni4_controller *controller,
                omni4_state *state,
                const omni_twist *command,
                const omni4_velocities *measured,
                omni4_sample *sample);

// The motion that the measured wheel velocities [rad/s] of a four-wheel vehicle amount to, by least squares.
//
// Returns false, and does nothing, where a pointer is null.
bool omni4_estimate(const omni4_controller *controller,
                    const omni4_velocities *measured,
                    omni_twist *twist);

// Makes the state and the sample of a seven-wheel vehicle ready for the first step.
//
// Returns false, and does nothing, where a pointer is null.
bool omni7_init(omni7_state *state, omni7_sample *sample);

// One control period of a seven-wheel vehicle: from the command and the measured wheel velocities [rad/s] to torques [N.m], in
// `sample->wheels.applied.n_m`. To be called once every period that the controller was made for.
//
// A command that is no number stands for rest; a measurement that is none lets its wheel go. `command` and `measured` must
// not lie within `sample` or `state`. Returns false, and does nothing, where a pointer is null.
bool omni7_step(const omni7_controller *controller,
                omni7_state *state,
                const omni_twist *command,
                const omni7_velocities *measured,
                omni7_sample *sample);

// The motion that the measured wheel velocities [rad/s] of a seven-wheel vehicle amount to, by least squares.
//
// Returns false, and does nothing, where a pointer is null.
bool omni7_estimate(const omni7_controller *controller,
                    const omni7_velocities *measured,
                    omni_twist *twist);

// Brings `command` within the vehicle's limits, for one control period; `limited` is what to give to the step. `state` is
// all zero at the start: `static omni_limiter_state state;`.
//
// Returns false, and does nothing, where a pointer is null.
bool omni_limit(const omni_limiter *limiter,
                omni_limiter_state *state,
                const omni_twist *command,
                omni_twist *limited);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* OMNISTEP_H */
