"""Warnings of an identification: numbers far from the file, noise beyond the log's noise, sampling."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from omnistep._estimates import Estimate, Floats, refutes
from omnistep._measurement_noise import implied_rad_s, shown_rad_s
from omnistep._motion_model import Motion
from omnistep._speed_simulation import SpeedSimulation

#: With fewer rows than this in a wheel's time constant, counts blur how it follows its motor.
FEW = 10.0
#: A number is doubted that is so many times the file's, or as many times smaller.
FAR = 3.0
#: Delays of vehicles are shorter than this [s].
LATE_S = 0.1
#: Noise below this part of the wheels' speeds refutes nothing, however fine the encoders are.
SMALL = 0.01
#: Simulated speeds that are off by this part refute the model.
OFF = 0.25
#: Bridges that coast within each PWM period explain the speeds if they reduce the error by this factor.
BENT = 1.5
NO_DUTY = (
    "this log cannot tell slope_n_m_s_rad and stall_torque_n_m: its torques are commanded ones, which do not show"
    " the motor's line; log wheel_NAME_duty (-1 to 1) instead of torques and drive up to the fastest speed"
)


def too_fast(motions: Sequence[Motion], p: Mapping[str, float]) -> tuple[str, ...]:
    """Report motion that follows the motors within few periods of the log, which encoder counts mask."""
    for motion in motions:
        constant_s = motion.time_constant_s(p)
        if constant_s < FEW * motion.period:
            what = (
                "a wheel in the air follows its motor" if motion.stretches.lifted else "the vehicle follows its motors"
            )
            return (
                f"results may be off by several of their intervals, delay_s, lag_s and inertias most: {what} within"
                f" {constant_s:.2g} s, and the log has a row every {motion.period:.2g} s; log every"
                f" {constant_s / FEW:.1g} s, or torques instead of duty cycles",
            )
    return ()


def far_off(estimates: Sequence[Estimate]) -> tuple[str, ...]:
    """Report results that are far from the file's values, and implausible delays."""
    said = []
    for each in estimates:
        if each.note == "fixed" or not each.before or not each.value or each.name in ("delay_s", "lag_s"):
            continue
        times = each.value / each.before
        if not 1.0 / FAR <= times <= FAR:
            factor = f"{times:.2g} times" if times > 1.0 else f"1/{1.0 / times:.2g} of"
            said.append(
                f"doubtful: {each.name} is {each.value:.3g} {each.unit}, {factor} the file's {each.before:.3g}: check"
                " the units and signs of the log, and the file"
            )
    delay = next(each for each in estimates if each.name == "delay_s")
    if delay.value > LATE_S:
        said.append(
            f"doubtful: delay_s is {delay.value:.2g} s, beyond {LATE_S:g} s: check that readings and commands have the"
            " same clock"
        )
    return tuple(said)


@dataclass(frozen=True)
class Noises:
    """Noise of the wheels' speeds, standard deviation of a row [rad/s]: of the log that fits worst.

    Attributes:
        fit_rad_s: noise that the fit needs.
        shown_rad_s: noise of the readings at nearly constant speed.
        speed_rad_s: root mean square of the speeds.
    """

    fit_rad_s: float
    shown_rad_s: float
    speed_rad_s: float

    def __str__(self) -> str:
        return (
            f"noise of the wheels' speeds: {self.fit_rad_s:.2g} rad/s by the fit, {self.shown_rad_s:.2g} rad/s in the"
            " readings at constant speed"
        )


def noises(motions: Sequence[Motion], residual: Floats) -> Noises:
    """Noise that the residuals need beside what the readings show, of the log where they differ most."""
    of_logs, end = [], 0
    for motion in motions:
        begin, end = end, end + motion.measured.size
        left = residual[begin:end]
        sd = float(np.sqrt(left @ left / max(1, len(left) - motion.redundant())))
        rows = motion.stretches.rows
        ratio = 0.0 if motion.noise is None else motion.noise.ratio
        shown = shown_rad_s(motion.speeds, motion.period) * np.sqrt(motion.map.shape[0] / motion.map.shape[1])
        speed = float(np.sqrt(np.nanmean(motion.speeds**2)))
        of_logs.append(Noises(implied_rad_s(sd, ratio, rows, motion.period), float(shown), speed))
    return max(of_logs, key=lambda noise: noise.fit_rad_s / max(noise.shown_rad_s, SMALL * noise.speed_rad_s))


def bent_line(lines: Sequence[float], chopped: float) -> str:
    """Reason why no motor line fits: speeds match bridges that coast within each PWM period.

    These brake a motor only while they drive it, so that a small duty cycle produces nearly the speed of full duty.
    ``lines`` are parts by which speeds are off with bridges that brake or coast at zero duty, ``chopped`` that of such
    bridges.
    """
    if not chopped * BENT < min(lines):
        return ""
    return (
        "no line of the motor fits, as speed is not linear in the duty cycle: the log's speeds are off by"
        f" {100 * min(lines):.2g} %, and by {100 * chopped:.2g} % with bridges that coast within each PWM period; let"
        " the bridges brake there (slow decay: PWM on the inputs, enable high), or log torques"
    )


def refuting(noise: Noises, simulation: SpeedSimulation) -> str:
    """Why intervals would be wrong: the model does not describe these logs."""
    if noise.fit_rad_s > SMALL * noise.speed_rad_s and refutes(noise.fit_rad_s, noise.shown_rad_s):
        return (
            f"the fit needs noise of {noise.fit_rad_s:.2g} rad/s, the readings show {noise.shown_rad_s:.2g} at constant"
            " speed; something is not as the model has it: bridges at zero duty, slip, a slope, or the log"
        )
    if simulation.off > OFF:
        return f"{simulation}; something is not as the model has it: bridges at zero duty, slip, a slope, or the log"
    return ""
