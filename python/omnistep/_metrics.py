"""Metrics of a run and signals of its wheels in words: what each is, its unit, which way is better."""

from typing import NamedTuple

from omnistep._omnistep import metrics


class Quantity(NamedTuple):
    """A metric of an outcome or a signal of a wheel.

    Attributes:
        heading: name and unit.
        text: its meaning, in sentences.
        unit: empty if it has none.
        better: ``lower``, ``zero`` (nearer to zero), or empty if neither direction is better.
    """

    heading: str
    text: str
    unit: str
    better: str = ""

    @property
    def explained(self) -> str:
        """Sentence, unit and direction."""
        unit = f"Unit: {self.unit}." if self.unit else "No unit."
        better = {"lower": "Lower is better.", "zero": "Nearer to zero is better."}.get(self.better, "")
        return " ".join(part for part in (self.text, unit, better) if part)


#: Metrics of an outcome by key, in the order of tables; the command explains them with the same sentences.
METRICS = {
    "verdict": Quantity(
        "verdict",
        "How the run ended: climbed, completed and arrived are success, recorded is a log of a real vehicle.",
        "",
    ),
    **{key: Quantity(heading, text, unit, better) for key, heading, text, unit, better in metrics()},
}
#: Signals of wheels that plots show, by name.
SIGNALS = {
    "speed": Quantity(
        "wheel speed [rad/s]", "Measured speed of the wheel's actuator, and the reference speed.", "rad/s"
    ),
    "torque": Quantity(
        "torque [N.m]", "Torque of the actuator that acted, and its limits at the present speed.", "N.m"
    ),
    "slip": Quantity(
        "slip ratio",
        "Rim speed minus speed of the wheel's centre, over the larger of both; 0 where the wheel rolls.",
        "",
        "zero",
    ),
    "disturbed": Quantity(
        "disturbed ratio",
        "Reference speed minus measured speed, over the larger of both; 0 where the wheel follows.",
        "",
        "zero",
    ),
    "load": Quantity("load [N]", "Force of the ground along the normals of the wheel's contacts.", "N"),
}
