/* omnistep: control of omni-directional vehicles, in single precision. C11 and C++11; neither heap nor C library needed.
 *
 * A controller is a constant that `omnistep export` writes from a vehicle file; what changes is in a state. Units are
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

// What is kept of a twist for which a wheel would have to turn faster than it can.
enum omni_desaturation
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // The direction: the whole twist is scaled by one factor, so that the path stays the same.
  OMNI_DESATURATION_UNIFORM,
  // The yaw rate, as far as it is possible alone; the rest goes to translation, in its direction.
  OMNI_DESATURATION_KEEPS_YAW,
  // Translation, as far as it is possible alone; the rest goes to yaw.
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
  // Too few wheels are left to determine how the vehicle moves: those that are left are brought to rest, at the emergency
  // deceleration. Latched until `DriveState::release_safe_stop`.
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
  // No command since the start or since the release of an emergency stop, or none of rest yet where `Restart::Neutral` wants one: rest, or
  // on the way there.
  OMNI_COMMAND_STATUS_IDLE,
  // The twist is the command.
  OMNI_COMMAND_STATUS_FOLLOWING,
  // The limits keep the twist from the command, or still do.
  OMNI_COMMAND_STATUS_LIMITED,
  // The last command is too old, or none of rest has come since where `Restart::Neutral` wants one: rest, or on the way there.
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

// What is wrong with a wheel.
enum omni_fault
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Its reading is NaN, infinite, or beyond 1e6 rad/s.
  OMNI_FAULT_NOT_A_NUMBER = 1,
  // Its reading jumps further in one period than a wheel can.
  OMNI_FAULT_JUMP = 2,
  // Its reading never changes although the vehicle moves, or although the motor pulls: an encoder that is dead, or a wheel that is
  // blocked.
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

// For how many periods in a row each wheel has asked for more than the same limit: anti-windup waits for 8. Wheel i is
// bit i; at most 32 wheels.
//
// One encoder count, or noise, can ask for more than a motor has in a single reading. If the integral reacted to each, it
// would drop what such readings say and keep the rest: a bias, and the vehicle runs away or creeps. Noise is beyond the
// same limit 8 times in a row in one period of 2^8.
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

// What a `RestRule` remembers.
typedef struct {
  // Tenths of the periods in which wheels were held while every reference was 0, less those that have come back.
  uint32_t held;
  // Integral of torque squared of that [N^2.m^2.s].
  omni_sum held_torque_squared_n2m2s;
  // Periods in which the torques fell since then.
  float bled_periods;
} omni_rest_state;

// What the loops remember between steps; `default` is a fresh start.
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
  // Which wheels are overloaded, and for how long the others have been beyond a limit.
  omni_overload overload;
  // How far the torque has ended while every reference was 0.
  omni_rest_state rest;
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
  // Measurement y; 0 for a released wheel.
  omni3_velocities measured;
  // The wheel was controlled. One without a usable measurement is released: no torque, its loop starts afresh. When the torque has
  // `ended` no wheel is controlled.
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
  // Torque the loops ask for with the whole reference: what would be applied had the actuators no limit.
  omni3_torques requested;
  // Torque to apply, always within the limits.
  omni3_torques applied;
  // Limits at the present velocities.
  omni3_torque_ranges range;
  // The requested torque is outside the limits.
  bool saturated[3];
  // What all torques (`Saturation::ScaleTorques`) or all references
  // (`Saturation::ScaleReferences`) were multiplied by, 0 to 1; 1 under
  // `Saturation::Clip`.
  float common_factor;
  // Every reference has been 0 for long enough that all torque has ended: see `Rest`. Bridges that are driven by
  // voltage are then opened or shorted, because the voltage for no torque follows from a velocity that may be measured wrongly.
  bool ended;
  // And the windings of all motors are to be shorted: `Rest::short_windings`.
  bool shorted;
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
// coordination law, changed the output. In a `WheelController` it counts from the eighth period
// in a row beyond the same limit (`Overload`), that of wheels scaled with it too, in a `Pid` at once. Under
// `Saturation::ScaleReferences` the law is `Conditioned` whatever is set here; `Clamp`
// limits the integrals there too.
enum omni_anti_windup_tag
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Nothing: the integral takes in every error. Overshoots after every saturation.
  OMNI_ANTI_WINDUP_NONE,
  // The integral is held within +-`limit_n_m` after each step. With `IntegrationOrder::BeforeOutput` the
  // term of a step may be larger by that step's `ki T e`.
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
  // Largest integral [N.m], 0 to 1e9.
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

// The integral zone and the limit of the proportional term, as a loop has them.
typedef struct {
  // One of the two is finite.
  bool any;
  // Errors up to this are taken in by the integral [rad/s].
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

// A PID loop's constants. What changes from step to step is in `PidState`.
//
// Formed once from a `PidConfig`; derivatives are backward differences, zero in the first step. With the reference r, the
// measurement y, the period T, the weights b and c and the filter time Td of the derivative:
typedef struct {
  float kp;
  // kp b.
  float kp_reference;
  // ki T.
  float ki_dt;
  // ki T where the integral takes in an error before the output; 0 otherwise.
  float ki_dt_output;
  // kd / (Td + T).
  float kd_discrete;
  // c.
  float derivative_weight;
  // Td / (Td + T).
  float derivative_memory;
  omni_feed_forward feed_forward;
  // Some term compares with the step before: a derivative or a feed-forward.
  bool remembers;
  bool feeds_forward;
  // 1 / (du/dr) [rad/s per N.m], 0 where du/dr is 0; in the first step.
  float inverse_slope;
  float inverse_first_slope;
  float conditioned_gain;
  float first_conditioned_gain;
  omni_anti_windup anti_windup;
  float tracking;
  omni_term_bounds bounds;
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
  // Ratios of torques are kept. The integrals react as `anti_windup` says; with `None` they do not.
  OMNI_SATURATION_SCALE_TORQUES,
  // All references are multiplied by one factor s, as large as keeps every wheel within its limit, and the loops see
  // the error against the reduced reference (a conditioned controller shared by the wheels). Ratios of velocities are
  // kept and nothing winds up.
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
  // The factor never falls below this, 0 to 1: a wheel may then saturate. 0 lets one blocked wheel stop all.
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
  // Which error the integrals take in.
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

// A vehicle's controller: kinematics and wheel loops. Immutable; what changes is in `ControlState`.
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

// Turns the commands that arrive into a twist every control period: refuses nonsense, lets commands expire, keeps to
// the limits and stops in an emergency. What changes from step to step is in `ShaperState`.
//
// A refused command counts as none: the last good one stays in force until it expires. A command that expires is
// followed by rest, within the limits. An emergency stop has its own deceleration and no jerk limit. After its release
// commands are followed from the velocity reached.
typedef struct {
  omni_limiter limiter;
  // The highest age at which a command counts.
  uint32_t oldest;
  // Linear and yaw speed that an emergency stop takes a period.
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
  // Control periods in a row below `leave_rad_s` before it is let in again, 1 to 65535.
  uint16_t leave_periods;
} omni_slip_config;

// Finds the wheel that slips and estimates the motion without it.
typedef struct {
  omni_slip_config config;
} omni_slip_detector;

// When a reading is rejected. An infinite velocity or torque, or a count of 65535 periods, switches its check off.
// Checked by `FaultMonitor::new`.
typedef struct {
  // Largest change [rad/s] of an actuator's velocity within one period, 1e-9 or more: a reading further from the last accepted one
  // is held back.
  float jump_rad_s;
  // Periods a jump is bridged with the last accepted reading; then the wheel is faulty. Good readings between jumps count
  // against jumps one by one. 1 to 65535.
  uint16_t jump_periods;
  // A reading that stays exactly the same while what the other wheels say of it moves by more than this [rad/s] is
  // stuck, 1e-9 or more. So is, after ten times as long, a reading that stays exactly 0 while the others say that the wheel turns by more
  // than this and its loop pulls in vain towards its reference. Also how well a faulty wheel must agree with the others to be accepted again.
  float stuck_rad_s;
  // A reading that stays exactly the same while the motor is commanded to give at least this torque [N.m] towards the reference, or with a
  // reference further away than `stuck_rad_s`, is stuck after ten times `stuck_periods`, 1e-9 or more. One of 0 that the others can check is
  // so once they say that the wheel has turned by `stuck_rad_s` in that time. Of three wheels, which cannot check each other, one of 0 or so
  // far away is stuck after `stuck_periods` if another wheel turns faster than `stuck_rad_s`. A wheel that is blocked while others turn looks
  // the same. If another wheel is pulled as hard and reads 0 too, the vehicle more probably stands before an obstacle: that is no evidence
  // but of three wheels, where either all encoders are dead or all motors push in vain.
  float stuck_torque_n_m;
  // Periods of evidence in a row that make a reading stuck, 2 to 65535.
  uint16_t stuck_periods;
  // Periods without a reading after which a wheel is faulty, 1 to 65535; until then its last reading stands.
  uint16_t silent_periods;
  // Good readings in a row after which a faulty wheel (never one declared lost) is accepted again, 1 to 65535: readings
  // without a jump that agree with the other wheels as far as these determine it, from a stuck wheel readings that change.
  uint16_t recovery_periods;
} omni_fault_config;

// Watches the readings of all wheels. Immutable; what changes is in `FaultState`.
typedef struct {
  omni_fault_config config;
} omni_fault_monitor;

// Dead reckoning of a vehicle with `N` wheels. Immutable; what changes is in `OdometryState`.
//
// The maps are handed to each call: a caller that distrusts a wheel may pass another forward map, or the displacement
// itself. In `f32` positions of 5000 rad come in steps of 5e-4 rad; that does not add up, because differences of
// positions are exact.
//
// Largest distance of `f32` from `f64` over 1,000,000 steps of 1 ms at 0.3 m/s, that is 300 m, by the seven wheels of
// `WheelLayout::chugo7`:
//
// | path | as here | plain sums (`PlanarPose::moved_by`) |
// |---|---|---|
// | winding and sideways, ending far away | 0.05 mm | 36 mm |
// | the same in circles of 6 m radius | 0.005 mm | 0.4 mm |
// | straight ahead | 0.06 mm | 2.6 m |
//
// From positions instead of velocities the first column is at most 0.14 mm.
typedef struct {
  float period_s;
} omni3_odometry;

// Speed limits of the actuators and what is kept within them: desaturation, or normalisation, of wheel speeds.
typedef struct {
  float limit_rad_s[3];
  omni_desaturation desaturation;
} omni3_speed_limits;

// Grows a `PoseCovariance` along with the pose. Immutable.
//
// `P' = F P F^T + G (J diag(q) J^T) G^T`, F and G being the derivatives of the exact step by the pose and by the
// displacement, and J the forward map.
//
// What it is not: it has no model of bias. A wrong wheel radius, a wrong layout, a bent axle or a wheel that always
// slips the same way give errors that grow with the way, not with its root, and are not in here. Wheels are taken as
// independent. To first order: beyond a yaw deviation of some 0.3 rad the true distribution is no longer an ellipse. It only
// grows; to take in a measurement is a filter's business.
//
// In `f32` the sums are plain: 100,000 steps at 0.3 m/s and 100 Hz leave it 0.5 % from `f64`, and what a step adds is lost
// once it is below 6e-8 of what is there, after some ten million. Step it every tenth period, with the increments
// summed, where that matters.
//
// The usual name: first-order propagation of errors, the prediction of an extended Kalman filter.
typedef struct {
  // k^2 [rad].
  float per_rad;
  // g.
  float per_residual;
} omni_covariance_growth;

// A vehicle's whole controller: readings and commands in, torques out. Immutable; what changes is in `DriveState`.
//
// In order: readings are judged, faulty wheels released, the motion estimated from the rest; the command is checked,
// limited, moved to the origin and brought within what the wheels can turn; the loops run; the pose is integrated.
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
  uint16_t blind_periods;
  bool limits_speed;
  bool grows_covariance;
  bool discretize;
} omni3_drive;

// What a drive remembers. Nothing in it is for anybody else.
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
  // Torques that the loops asked for [N.m].
  omni3_torques requested;
  // References of the loops [rad/s].
  omni3_velocities references;
  // Velocities that the loops went by [rad/s]; 0 for a wheel that is not `active`.
  omni3_velocities measured;
  // What the vehicle is to do: the command within all limits, of the origin.
  omni_twist twist;
  // What the vehicle does, by its wheels; 0 unless `motion_known`.
  omni_twist estimated;
  // Where the vehicle is, by its wheels.
  omni_pose pose;
  // How far the vehicle can be relied on.
  omni_drive_mode mode;
  // Why the twist is what it is.
  omni_command_status status;
  // A command arrived and was refused: it is no number, or beyond 1e6.
  bool rejected;
  // Enough wheels determine the motion; else the pose stands still.
  bool motion_known;
  // What is wrong with each wheel: an `omni_fault`, or 0 for nothing.
  uint8_t faults[3];
  // The wheel was controlled. One that is not has no torque, and its bridge is opened or shorted: it has a fault, or all torque has ended
  // at rest.
  bool active[3];
  // The requested torque is outside the limits.
  bool saturated[3];
  // The wheel is left out of the motion: faulty, lifted or slipping.
  bool excluded[3];
  // The motor's windings shall be shorted. In a safe stop and an emergency stop: the wheel has a fault, so that no torque can be asked of
  // it, or all torque has ended. At rest otherwise: all torque has ended, and the scenario asks for it (`control.rest.short_windings`).
  bool brake[3];
} omni3_drive_output;

// What arrived since the period before.
typedef struct {
  // The command; looked at only where `commanded`.
  omni_twist command;
  // Actuator velocities [rad/s]; each looked at only where it was `received`.
  omni3_velocities measured;
  // A command arrived. Where none does for the time-out, the vehicle is brought to rest.
  bool commanded;
  // The emergency stop is pressed: the vehicle comes to rest at the emergency deceleration, whatever is commanded, and stays there for as
  // long as this is said. A button that springs back has to be latched before.
  bool emergency;
  // The encoder's reading arrived.
  bool received[3];
  // The wheel is in the air: it is controlled, but says nothing of the vehicle's motion.
  bool lifted[3];
} omni3_drive_input;

// How far the pose may be off: standard deviations. All 0 where the drive was given no noise.
typedef struct {
  // Of x [m].
  float x_m;
  // Of y [m].
  float y_m;
  // Of the heading [rad].
  float yaw_rad;
} omni_deviations;

// What the loops remember between steps; `default` is a fresh start.
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
  // Which wheels are overloaded, and for how long the others have been beyond a limit.
  omni_overload overload;
  // How far the torque has ended while every reference was 0.
  omni_rest_state rest;
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
  // Measurement y; 0 for a released wheel.
  omni4_velocities measured;
  // The wheel was controlled. One without a usable measurement is released: no torque, its loop starts afresh. When the torque has
  // `ended` no wheel is controlled.
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
  // Torque the loops ask for with the whole reference: what would be applied had the actuators no limit.
  omni4_torques requested;
  // Torque to apply, always within the limits.
  omni4_torques applied;
  // Limits at the present velocities.
  omni4_torque_ranges range;
  // The requested torque is outside the limits.
  bool saturated[4];
  // What all torques (`Saturation::ScaleTorques`) or all references
  // (`Saturation::ScaleReferences`) were multiplied by, 0 to 1; 1 under
  // `Saturation::Clip`.
  float common_factor;
  // Every reference has been 0 for long enough that all torque has ended: see `Rest`. Bridges that are driven by
  // voltage are then opened or shorted, because the voltage for no torque follows from a velocity that may be measured wrongly.
  bool ended;
  // And the windings of all motors are to be shorted: `Rest::short_windings`.
  bool shorted;
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
// The bare loop. `Drive` puts shaping, faults, slip and odometry around it.
typedef struct {
  omni4_kinematics kinematics;
  omni4_loops wheels;
} omni4_controller;

// Dead reckoning of a vehicle with `N` wheels. Immutable; what changes is in `OdometryState`.
//
// The maps are handed to each call: a caller that distrusts a wheel may pass another forward map, or the displacement
// itself. In `f32` positions of 5000 rad come in steps of 5e-4 rad; that does not add up, because differences of
// positions are exact.
//
// Largest distance of `f32` from `f64` over 1,000,000 steps of 1 ms at 0.3 m/s, that is 300 m, by the seven wheels of
// `WheelLayout::chugo7`:
//
// | path | as here | plain sums (`PlanarPose::moved_by`) |
// |---|---|---|
// | winding and sideways, ending far away | 0.05 mm | 36 mm |
// | the same in circles of 6 m radius | 0.005 mm | 0.4 mm |
// | straight ahead | 0.06 mm | 2.6 m |
//
// From positions instead of velocities the first column is at most 0.14 mm.
typedef struct {
  float period_s;
} omni4_odometry;

// Speed limits of the actuators and what is kept within them: desaturation, or normalisation, of wheel speeds.
typedef struct {
  float limit_rad_s[4];
  omni_desaturation desaturation;
} omni4_speed_limits;

// A vehicle's whole controller: readings and commands in, torques out. Immutable; what changes is in `DriveState`.
//
// In order: readings are judged, faulty wheels released, the motion estimated from the rest; the command is checked,
// limited, moved to the origin and brought within what the wheels can turn; the loops run; the pose is integrated.
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
  uint16_t blind_periods;
  bool limits_speed;
  bool grows_covariance;
  bool discretize;
} omni4_drive;

// What a drive remembers. Nothing in it is for anybody else.
typedef struct {
  uint32_t ready;
  uint32_t memory[155];
} omni4_drive_state;

// What a step reports. Nothing in it is ever NaN.
typedef struct {
  // Torques to apply [N.m], always within the motors' limits.
  omni4_torques torques;
  // Torques that the loops asked for [N.m].
  omni4_torques requested;
  // References of the loops [rad/s].
  omni4_velocities references;
  // Velocities that the loops went by [rad/s]; 0 for a wheel that is not `active`.
  omni4_velocities measured;
  // What the vehicle is to do: the command within all limits, of the origin.
  omni_twist twist;
  // What the vehicle does, by its wheels; 0 unless `motion_known`.
  omni_twist estimated;
  // Where the vehicle is, by its wheels.
  omni_pose pose;
  // How far the vehicle can be relied on.
  omni_drive_mode mode;
  // Why the twist is what it is.
  omni_command_status status;
  // A command arrived and was refused: it is no number, or beyond 1e6.
  bool rejected;
  // Enough wheels determine the motion; else the pose stands still.
  bool motion_known;
  // What is wrong with each wheel: an `omni_fault`, or 0 for nothing.
  uint8_t faults[4];
  // The wheel was controlled. One that is not has no torque, and its bridge is opened or shorted: it has a fault, or all torque has ended
  // at rest.
  bool active[4];
  // The requested torque is outside the limits.
  bool saturated[4];
  // The wheel is left out of the motion: faulty, lifted or slipping.
  bool excluded[4];
  // The motor's windings shall be shorted. In a safe stop and an emergency stop: the wheel has a fault, so that no torque can be asked of
  // it, or all torque has ended. At rest otherwise: all torque has ended, and the scenario asks for it (`control.rest.short_windings`).
  bool brake[4];
} omni4_drive_output;

// What arrived since the period before.
typedef struct {
  // The command; looked at only where `commanded`.
  omni_twist command;
  // Actuator velocities [rad/s]; each looked at only where it was `received`.
  omni4_velocities measured;
  // A command arrived. Where none does for the time-out, the vehicle is brought to rest.
  bool commanded;
  // The emergency stop is pressed: the vehicle comes to rest at the emergency deceleration, whatever is commanded, and stays there for as
  // long as this is said. A button that springs back has to be latched before.
  bool emergency;
  // The encoder's reading arrived.
  bool received[4];
  // The wheel is in the air: it is controlled, but says nothing of the vehicle's motion.
  bool lifted[4];
} omni4_drive_input;

// What the loops remember between steps; `default` is a fresh start.
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
  // Which wheels are overloaded, and for how long the others have been beyond a limit.
  omni_overload overload;
  // How far the torque has ended while every reference was 0.
  omni_rest_state rest;
} omni6_state;

// Actuator velocities, one a wheel in the layout's order: what kinematics maps and loops control.
typedef struct {
  // Velocity of each actuator [rad/s] (positive as the wheel's rolling direction says), any finite number.
  float rad_s[6];
} omni6_velocities;

// Actuator torques, one a wheel in the layout's order: what a controller asks of motors. Not a wheel velocity.
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
  // The wheel was controlled. One without a usable measurement is released: no torque, its loop starts afresh. When the torque has
  // `ended` no wheel is controlled.
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
  // Torque the loops ask for with the whole reference: what would be applied had the actuators no limit.
  omni6_torques requested;
  // Torque to apply, always within the limits.
  omni6_torques applied;
  // Limits at the present velocities.
  omni6_torque_ranges range;
  // The requested torque is outside the limits.
  bool saturated[6];
  // What all torques (`Saturation::ScaleTorques`) or all references
  // (`Saturation::ScaleReferences`) were multiplied by, 0 to 1; 1 under
  // `Saturation::Clip`.
  float common_factor;
  // Every reference has been 0 for long enough that all torque has ended: see `Rest`. Bridges that are driven by
  // voltage are then opened or shorted, because the voltage for no torque follows from a velocity that may be measured wrongly.
  bool ended;
  // And the windings of all motors are to be shorted: `Rest::short_windings`.
  bool shorted;
} omni6_wheel_sample;

// Every signal of one step of a `Controller`.
typedef struct {
  // The command; rest where the one given was not finite, or beyond 1e6.
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

// The limits of `N` actuators, their numbers side by side: loops over them run several at a time where the processor can.
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

// A vehicle's controller: kinematics and wheel loops. Immutable; what changes is in `ControlState`.
//
// The bare loop. `Drive` puts shaping, faults, slip and odometry around it.
typedef struct {
  omni6_kinematics kinematics;
  omni6_loops wheels;
} omni6_controller;

// Dead reckoning of a vehicle with `N` wheels. Immutable; what changes is in `OdometryState`.
//
// The maps are handed to each call: a caller that distrusts a wheel may pass another forward map, or the displacement
// itself. In `f32` positions of 5000 rad come in steps of 5e-4 rad; that does not add up, because differences of
// positions are exact.
//
// Largest distance of `f32` from `f64` over 1,000,000 steps of 1 ms at 0.3 m/s, that is 300 m, by the seven wheels of
// `WheelLayout::chugo7`:
//
// | path | as here | plain sums (`PlanarPose::moved_by`) |
// |---|---|---|
// | winding and sideways, ending far away | 0.05 mm | 36 mm |
// | the same in circles of 6 m radius | 0.005 mm | 0.4 mm |
// | straight ahead | 0.06 mm | 2.6 m |
//
// From positions instead of velocities the first column is at most 0.14 mm.
typedef struct {
  float period_s;
} omni6_odometry;

// Speed limits of the actuators and what is kept within them: desaturation, or normalisation, of wheel speeds.
typedef struct {
  float limit_rad_s[6];
  omni_desaturation desaturation;
} omni6_speed_limits;

// A vehicle's whole controller: readings and commands in, torques out. Immutable; what changes is in `DriveState`.
//
// In order: readings are judged, faulty wheels released, the motion estimated from the rest; the command is checked,
// limited, moved to the origin and brought within what the wheels can turn; the loops run; the pose is integrated.
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
  uint16_t blind_periods;
  bool limits_speed;
  bool grows_covariance;
  bool discretize;
} omni6_drive;

// What a drive remembers. Nothing in it is for anybody else.
typedef struct {
  uint32_t ready;
  uint32_t memory[212];
} omni6_drive_state;

// What a step reports. Nothing in it is ever NaN.
typedef struct {
  // Torques to apply [N.m], always within the motors' limits.
  omni6_torques torques;
  // Torques that the loops asked for [N.m].
  omni6_torques requested;
  // References of the loops [rad/s].
  omni6_velocities references;
  // Velocities that the loops went by [rad/s]; 0 for a wheel that is not `active`.
  omni6_velocities measured;
  // What the vehicle is to do: the command within all limits, of the origin.
  omni_twist twist;
  // What the vehicle does, by its wheels; 0 unless `motion_known`.
  omni_twist estimated;
  // Where the vehicle is, by its wheels.
  omni_pose pose;
  // How far the vehicle can be relied on.
  omni_drive_mode mode;
  // Why the twist is what it is.
  omni_command_status status;
  // A command arrived and was refused: it is no number, or beyond 1e6.
  bool rejected;
  // Enough wheels determine the motion; else the pose stands still.
  bool motion_known;
  // What is wrong with each wheel: an `omni_fault`, or 0 for nothing.
  uint8_t faults[6];
  // The wheel was controlled. One that is not has no torque, and its bridge is opened or shorted: it has a fault, or all torque has ended
  // at rest.
  bool active[6];
  // The requested torque is outside the limits.
  bool saturated[6];
  // The wheel is left out of the motion: faulty, lifted or slipping.
  bool excluded[6];
  // The motor's windings shall be shorted. In a safe stop and an emergency stop: the wheel has a fault, so that no torque can be asked of
  // it, or all torque has ended. At rest otherwise: all torque has ended, and the scenario asks for it (`control.rest.short_windings`).
  bool brake[6];
} omni6_drive_output;

// What arrived since the period before.
typedef struct {
  // The command; looked at only where `commanded`.
  omni_twist command;
  // Actuator velocities [rad/s]; each looked at only where it was `received`.
  omni6_velocities measured;
  // A command arrived. Where none does for the time-out, the vehicle is brought to rest.
  bool commanded;
  // The emergency stop is pressed: the vehicle comes to rest at the emergency deceleration, whatever is commanded, and stays there for as
  // long as this is said. A button that springs back has to be latched before.
  bool emergency;
  // The encoder's reading arrived.
  bool received[6];
  // The wheel is in the air: it is controlled, but says nothing of the vehicle's motion.
  bool lifted[6];
} omni6_drive_input;

// What the loops remember between steps; `default` is a fresh start.
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
  // Which wheels are overloaded, and for how long the others have been beyond a limit.
  omni_overload overload;
  // How far the torque has ended while every reference was 0.
  omni_rest_state rest;
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
  // Measurement y; 0 for a released wheel.
  omni7_velocities measured;
  // The wheel was controlled. One without a usable measurement is released: no torque, its loop starts afresh. When the torque has
  // `ended` no wheel is controlled.
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
  // Torque the loops ask for with the whole reference: what would be applied had the actuators no limit.
  omni7_torques requested;
  // Torque to apply, always within the limits.
  omni7_torques applied;
  // Limits at the present velocities.
  omni7_torque_ranges range;
  // The requested torque is outside the limits.
  bool saturated[7];
  // What all torques (`Saturation::ScaleTorques`) or all references
  // (`Saturation::ScaleReferences`) were multiplied by, 0 to 1; 1 under
  // `Saturation::Clip`.
  float common_factor;
  // Every reference has been 0 for long enough that all torque has ended: see `Rest`. Bridges that are driven by
  // voltage are then opened or shorted, because the voltage for no torque follows from a velocity that may be measured wrongly.
  bool ended;
  // And the windings of all motors are to be shorted: `Rest::short_windings`.
  bool shorted;
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
// The bare loop. `Drive` puts shaping, faults, slip and odometry around it.
typedef struct {
  omni7_kinematics kinematics;
  omni7_loops wheels;
} omni7_controller;

// Dead reckoning of a vehicle with `N` wheels. Immutable; what changes is in `OdometryState`.
//
// The maps are handed to each call: a caller that distrusts a wheel may pass another forward map, or the displacement
// itself. In `f32` positions of 5000 rad come in steps of 5e-4 rad; that does not add up, because differences of
// positions are exact.
//
// Largest distance of `f32` from `f64` over 1,000,000 steps of 1 ms at 0.3 m/s, that is 300 m, by the seven wheels of
// `WheelLayout::chugo7`:
//
// | path | as here | plain sums (`PlanarPose::moved_by`) |
// |---|---|---|
// | winding and sideways, ending far away | 0.05 mm | 36 mm |
// | the same in circles of 6 m radius | 0.005 mm | 0.4 mm |
// | straight ahead | 0.06 mm | 2.6 m |
//
// From positions instead of velocities the first column is at most 0.14 mm.
typedef struct {
  float period_s;
} omni7_odometry;

// Speed limits of the actuators and what is kept within them: desaturation, or normalisation, of wheel speeds.
typedef struct {
  float limit_rad_s[7];
  omni_desaturation desaturation;
} omni7_speed_limits;

// A vehicle's whole controller: readings and commands in, torques out. Immutable; what changes is in `DriveState`.
//
// In order: readings are judged, faulty wheels released, the motion estimated from the rest; the command is checked,
// limited, moved to the origin and brought within what the wheels can turn; the loops run; the pose is integrated.
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
  uint16_t blind_periods;
  bool limits_speed;
  bool grows_covariance;
  bool discretize;
} omni7_drive;

// What a drive remembers. Nothing in it is for anybody else.
typedef struct {
  uint32_t ready;
  uint32_t memory[239];
} omni7_drive_state;

// What a step reports. Nothing in it is ever NaN.
typedef struct {
  // Torques to apply [N.m], always within the motors' limits.
  omni7_torques torques;
  // Torques that the loops asked for [N.m].
  omni7_torques requested;
  // References of the loops [rad/s].
  omni7_velocities references;
  // Velocities that the loops went by [rad/s]; 0 for a wheel that is not `active`.
  omni7_velocities measured;
  // What the vehicle is to do: the command within all limits, of the origin.
  omni_twist twist;
  // What the vehicle does, by its wheels; 0 unless `motion_known`.
  omni_twist estimated;
  // Where the vehicle is, by its wheels.
  omni_pose pose;
  // How far the vehicle can be relied on.
  omni_drive_mode mode;
  // Why the twist is what it is.
  omni_command_status status;
  // A command arrived and was refused: it is no number, or beyond 1e6.
  bool rejected;
  // Enough wheels determine the motion; else the pose stands still.
  bool motion_known;
  // What is wrong with each wheel: an `omni_fault`, or 0 for nothing.
  uint8_t faults[7];
  // The wheel was controlled. One that is not has no torque, and its bridge is opened or shorted: it has a fault, or all torque has ended
  // at rest.
  bool active[7];
  // The requested torque is outside the limits.
  bool saturated[7];
  // The wheel is left out of the motion: faulty, lifted or slipping.
  bool excluded[7];
  // The motor's windings shall be shorted. In a safe stop and an emergency stop: the wheel has a fault, so that no torque can be asked of
  // it, or all torque has ended. At rest otherwise: all torque has ended, and the scenario asks for it (`control.rest.short_windings`).
  bool brake[7];
} omni7_drive_output;

// What arrived since the period before.
typedef struct {
  // The command; looked at only where `commanded`.
  omni_twist command;
  // Actuator velocities [rad/s]; each looked at only where it was `received`.
  omni7_velocities measured;
  // A command arrived. Where none does for the time-out, the vehicle is brought to rest.
  bool commanded;
  // The emergency stop is pressed: the vehicle comes to rest at the emergency deceleration, whatever is commanded, and stays there for as
  // long as this is said. A button that springs back has to be latched before.
  bool emergency;
  // The encoder's reading arrived.
  bool received[7];
  // The wheel is in the air: it is controlled, but says nothing of the vehicle's motion.
  bool lifted[7];
} omni7_drive_input;

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

// What is remembered of a counter; `default` before the first reading.
typedef struct {
  // Counts since the first reading.
  int64_t counts;
  // The last reading, aligned to 32 bits, once there was one.
  uint32_t last;
  bool read;
} omni_counter_state;

// What is remembered of one wheel's counts; `default` at rest.
typedef struct {
  // Counts of the last readings, round and round, and by how much longer than a period each took [s].
  int32_t counts[32];
  float longer_s[32];
  // The place of the next, and how many until all took a period.
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

// What is remembered of one wheel's encoder; `default` before the first reading.
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
  // `VelocityMethod::Observer`: what an angle off by 1 rad corrects in a period.
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
// Once no count comes any more the velocity falls: the wheel turned less than a count since, so by every method it is at most one count
// over the time without. A counter that has stayed within two counts for `VelocityEstimator::standing_s` stands, or toggles about an
// edge: the velocity is exactly 0 by every method until it has left them. So an encoder whose wire is cut, which is a counter that stands
// or toggles, repeats one reading, and a `FaultMonitor` finds it. A wheel slower than three counts in that time
// reads 0 now and then; that is at most 0.25 rad/s of coarse encoders, and 30 counts a second of fine ones.
//
// Nothing divides by a time or by counts that can be zero, and every reading is finite.
//
// The state holds the counts of `WINDOW` readings, 1 unless given: an observer, edges and a window of one need no more.
typedef struct {
  omni_velocity_law law;
  float count_rad;
  float period_s;
  uint32_t standing_periods;
} omni_velocity_estimator;

// A wheel's encoder on a hardware counter: from its raw reading to a velocity, by an `EncoderCounter` and a `VelocityEstimator`.
// `WINDOW` is 1 unless the velocity is that of a longer window.
typedef struct {
  omni_counter counter;
  omni_velocity_estimator velocity;
} omni_encoder;

// Torque-speed line of a DC motor, in four quadrants: speed costs torque only while the motor drives.
//
// Driving (torque and velocity of one sign): `max(0, min(cap, stall - slope |v|))`. Braking: `min(cap, stall)`. As
// printed, eq. (13) turns negative above 114.5 rpm and would push a fast wheel backwards; here a limit is never negative.
typedef struct {
  // Where the line meets rest.
  float stall_n_m;
  float slope_n_m_s_rad;
  // Largest torque in any quadrant, at most the stall torque.
  float cap_n_m;
} omni_motor;

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
// A command that is no number stands for rest; a measurement that is none releases its wheel. `command` and `measured` must
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

// Makes the state and the output of a three-wheel vehicle ready for the first step: at rest at the origin, every wheel trusted.
//
// Returns false, and does nothing, where a pointer is null.
bool omni3_drive_init(const omni3_drive *drive,
                      omni3_drive_state *state,
                      omni3_drive_output *output);

// One control period of a three-wheel vehicle: from what arrived to torques [N.m], in `output->torques.n_m`. To be called once every
// period that the drive was made for, always with the same `drive`.
//
// Never fails: nonsense in the input is refused, or its wheel is released. `input` must not lie within `output`.
// Returns false, and does nothing, where a pointer is null or the state was not made ready.
bool omni3_drive_step(const omni3_drive *drive,
                      omni3_drive_state *state,
                      const omni3_drive_input *input,
                      omni3_drive_output *output);

// Ends a safe stop. Every reading is judged afresh, and commands that arrive from now on are followed.
// A safe stop whose cause lasts begins anew.
//
// Returns false, and does nothing, where the pointer is null or the state was not made ready.
bool omni3_drive_release_safe_stop(omni3_drive_state *state);

// The vehicle's pose is known from outside: the pose goes on from `x_m`, `y_m` [m] and `yaw_rad` [rad]. How far it may be off stays.
//
// Returns false, and does nothing, where the pointer is null, the state was not made ready or a number is not finite.
bool omni3_drive_reset_pose(omni3_drive_state *state,
                            float x_m,
                            float y_m,
                            float yaw_rad);

// How far the pose may be off.
//
// Returns false, and does nothing, where a pointer is null or the state was not made ready.
bool omni3_drive_deviations(omni3_drive_state *state, omni_deviations *deviations);

// Makes the state and the sample of a four-wheel vehicle ready for the first step.
//
// Returns false, and does nothing, where a pointer is null.
bool omni4_init(omni4_state *state, omni4_sample *sample);

// One control period of a four-wheel vehicle: from the command and the measured wheel velocities [rad/s] to torques [N.m], in
// `sample->wheels.applied.n_m`. To be called once every period that the controller was made for.
//
// A command that is no number stands for rest; a measurement that is none releases its wheel. `command` and `measured` must
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

// Makes the state and the output of a four-wheel vehicle ready for the first step: at rest at the origin, every wheel trusted.
//
// Returns false, and does nothing, where a pointer is null.
bool omni4_drive_init(const omni4_drive *drive,
                      omni4_drive_state *state,
                      omni4_drive_output *output);

// One control period of a four-wheel vehicle: from what arrived to torques [N.m], in `output->torques.n_m`. To be called once every
// period that the drive was made for, always with the same `drive`.
//
// Never fails: nonsense in the input is refused, or its wheel is released. `input` must not lie within `output`.
// Returns false, and does nothing, where a pointer is null or the state was not made ready.
bool omni4_drive_step(const omni4_drive *drive,
                      omni4_drive_state *state,
                      const omni4_drive_input *input,
                      omni4_drive_output *output);

// Ends a safe stop. Every reading is judged afresh, and commands that arrive from now on are followed.
// A safe stop whose cause lasts begins anew.
//
// Returns false, and does nothing, where the pointer is null or the state was not made ready.
bool omni4_drive_release_safe_stop(omni4_drive_state *state);

// The vehicle's pose is known from outside: the pose goes on from `x_m`, `y_m` [m] and `yaw_rad` [rad]. How far it may be off stays.
//
// Returns false, and does nothing, where the pointer is null, the state was not made ready or a number is not finite.
bool omni4_drive_reset_pose(omni4_drive_state *state,
                            float x_m,
                            float y_m,
                            float yaw_rad);

// How far the pose may be off.
//
// Returns false, and does nothing, where a pointer is null or the state was not made ready.
bool omni4_drive_deviations(omni4_drive_state *state, omni_deviations *deviations);

// Makes the state and the sample of a six-wheel vehicle ready for the first step.
//
// Returns false, and does nothing, where a pointer is null.
bool omni6_init(omni6_state *state, omni6_sample *sample);

// One control period of a six-wheel vehicle: from the command and the measured wheel velocities [rad/s] to torques [N.m], in
// `sample->wheels.applied.n_m`. To be called once every period that the controller was made for.
//
// A command that is no number stands for rest; a measurement that is none releases its wheel. `command` and `measured` must
// not lie within `sample` or `state`. Returns false, and does nothing, where a pointer is null.
bool omni6_step(const omni6_controller *controller,
                omni6_state *state,
                const omni_twist *command,
                const omni6_velocities *measured,
                omni6_sample *sample);

// The motion that the measured wheel velocities [rad/s] of a six-wheel vehicle amount to, by least squares.
//
// Returns false, and does nothing, where a pointer is null.
bool omni6_estimate(const omni6_controller *controller,
                    const omni6_velocities *measured,
                    omni_twist *twist);

// Makes the state and the output of a six-wheel vehicle ready for the first step: at rest at the origin, every wheel trusted.
//
// Returns false, and does nothing, where a pointer is null.
bool omni6_drive_init(const omni6_drive *drive,
                      omni6_drive_state *state,
                      omni6_drive_output *output);

// One control period of a six-wheel vehicle: from what arrived to torques [N.m], in `output->torques.n_m`. To be called once every
// period that the drive was made for, always with the same `drive`.
//
// Never fails: nonsense in the input is refused, or its wheel is released. `input` must not lie within `output`.
// Returns false, and does nothing, where a pointer is null or the state was not made ready.
bool omni6_drive_step(const omni6_drive *drive,
                      omni6_drive_state *state,
                      const omni6_drive_input *input,
                      omni6_drive_output *output);

// Ends a safe stop. Every reading is judged afresh, and commands that arrive from now on are followed.
// A safe stop whose cause lasts begins anew.
//
// Returns false, and does nothing, where the pointer is null or the state was not made ready.
bool omni6_drive_release_safe_stop(omni6_drive_state *state);

// The vehicle's pose is known from outside: the pose goes on from `x_m`, `y_m` [m] and `yaw_rad` [rad]. How far it may be off stays.
//
// Returns false, and does nothing, where the pointer is null, the state was not made ready or a number is not finite.
bool omni6_drive_reset_pose(omni6_drive_state *state,
                            float x_m,
                            float y_m,
                            float yaw_rad);

// How far the pose may be off.
//
// Returns false, and does nothing, where a pointer is null or the state was not made ready.
bool omni6_drive_deviations(omni6_drive_state *state, omni_deviations *deviations);

// Makes the state and the sample of a seven-wheel vehicle ready for the first step.
//
// Returns false, and does nothing, where a pointer is null.
bool omni7_init(omni7_state *state, omni7_sample *sample);

// One control period of a seven-wheel vehicle: from the command and the measured wheel velocities [rad/s] to torques [N.m], in
// `sample->wheels.applied.n_m`. To be called once every period that the controller was made for.
//
// A command that is no number stands for rest; a measurement that is none releases its wheel. `command` and `measured` must
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

// Makes the state and the output of a seven-wheel vehicle ready for the first step: at rest at the origin, every wheel trusted.
//
// Returns false, and does nothing, where a pointer is null.
bool omni7_drive_init(const omni7_drive *drive,
                      omni7_drive_state *state,
                      omni7_drive_output *output);

// One control period of a seven-wheel vehicle: from what arrived to torques [N.m], in `output->torques.n_m`. To be called once every
// period that the drive was made for, always with the same `drive`.
//
// Never fails: nonsense in the input is refused, or its wheel is released. `input` must not lie within `output`.
// Returns false, and does nothing, where a pointer is null or the state was not made ready.
bool omni7_drive_step(const omni7_drive *drive,
                      omni7_drive_state *state,
                      const omni7_drive_input *input,
                      omni7_drive_output *output);

// Ends a safe stop. Every reading is judged afresh, and commands that arrive from now on are followed.
// A safe stop whose cause lasts begins anew.
//
// Returns false, and does nothing, where the pointer is null or the state was not made ready.
bool omni7_drive_release_safe_stop(omni7_drive_state *state);

// The vehicle's pose is known from outside: the pose goes on from `x_m`, `y_m` [m] and `yaw_rad` [rad]. How far it may be off stays.
//
// Returns false, and does nothing, where the pointer is null, the state was not made ready or a number is not finite.
bool omni7_drive_reset_pose(omni7_drive_state *state,
                            float x_m,
                            float y_m,
                            float yaw_rad);

// How far the pose may be off.
//
// Returns false, and does nothing, where a pointer is null or the state was not made ready.
bool omni7_drive_deviations(omni7_drive_state *state, omni_deviations *deviations);

// Brings `command` within the vehicle's limits, for one control period; `limited` is what to give to the step. `state` is
// all zero at the start: `static omni_limiter_state state;`.
//
// Returns false, and does nothing, where a pointer is null.
bool omni_limit(const omni_limiter *limiter,
                omni_limiter_state *state,
                const omni_twist *command,
                omni_twist *limited);

// Makes the state of one wheel's encoder ready for the first reading.
//
// Returns false, and does nothing, where a pointer is null.
bool omni_encoder_init(omni_encoder_state *state);

// Takes in the counter of a wheel's encoder as it stands (16 bits, or more of which the lower 16 are used), once every control period, and
// gives the wheel's velocity [rad/s]; 0 at the first reading. The counter may wrap around; right while the wheel turns by less than 32768
// counts a period.
//
// `since_edge_s` is the time from the last edge to now [s], for encoders whose velocities come from edges; NaN where it is not known.
// Returns false, and does nothing, where a pointer is null.
bool omni_encoder_step(const omni_encoder *encoder,
                       omni_encoder_state *state,
                       uint32_t raw,
                       float since_edge_s,
                       float *rad_s);

// The duty, -1 to 1, of a bridge without a current loop that gives `torque_n_m` [N.m] at `velocity_rad_s` [rad/s], or the nearest there is:
// `OMNI_MOTORS[i]`. 0 shorts the motor, which brakes; to let a wheel go, open the bridge.
//
// Returns false, and does nothing, where a pointer is null.
bool omni_duty(const omni_motor *motor,
               float torque_n_m,
               float velocity_rad_s,
               float *duty);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* OMNISTEP_H */
