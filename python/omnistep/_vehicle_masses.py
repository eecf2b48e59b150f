"""Masses and inertias of a vehicle's file, as identification needs them."""

from __future__ import annotations

import numpy as np

from omnistep._estimates import Floats
from omnistep._omnistep import Kinematics, Vehicle


class Masses:
    """Masses of a vehicle's file, and the mass matrix for other numbers."""

    def __init__(self, vehicle: Vehicle) -> None:
        self.vehicle = vehicle
        keys = vehicle.to_dict()
        bodies, wheels = keys["body"], keys["wheel"]
        self.gear = np.array([wheel["gear"] for wheel in wheels])
        self.radius = np.array([wheel["radius_m"] for wheel in wheels])
        self.wheel_mass = np.array([wheel["mass_kg"] for wheel in wheels])
        self.body_mass = np.array([body["mass_kg"] for body in bodies])
        self.wheel_inertias = np.array([wheel["inertia_kg_m2"] for wheel in wheels])
        self.wheel_inertia = float(self.wheel_inertias.mean())
        self.wheel_places = np.array([wheel["position_m"] for wheel in wheels])
        self.body_places = np.array([body["com_m"][:2] for body in bodies])
        self.mass = float(self.wheel_mass.sum() + self.body_mass.sum())
        self.centre = (self.wheel_mass @ self.wheel_places + self.body_mass @ self.body_places) / self.mass
        edges = np.array([body["inertia_box_m"] for body in bodies])
        self.own = float((self.body_mass * (edges[:, 0] ** 2 + edges[:, 1] ** 2)).sum() / 12.0)
        self.away = float(
            self.wheel_mass @ (self.wheel_places**2).sum(axis=1) + self.body_mass @ (self.body_places**2).sum(axis=1)
        )
        # A wheel is a disc: its moment of inertia about the vertical is half the moment about its axle.
        self.discs = 0.5 * float(self.wheel_inertias.sum())
        self.yaw_inertia = self.own + self.away + self.discs
        self.map = Kinematics(layout=vehicle.layout).inverse_matrix
        #: From wheels back to the twist.
        self.back = np.linalg.pinv(self.map)
        loads = vehicle.static_loads_n()
        count = len(wheels)
        # As parts of the weight.
        self.share = np.full(count, 1.0 / count) if loads is None else loads / loads.sum()

    def turning(self, wheel_inertia: float) -> Floats:
        """Inertias of the wheels at their actuators [kg.m^2], in the proportions of the file."""
        return np.asarray(self.wheel_inertias * (wheel_inertia / self.wheel_inertia) * self.gear**2)

    def matrix(self, mass: float, yaw_inertia: float, wheel_inertia: float) -> Floats:
        """Mass matrix about the origin, turning wheels included."""
        x, y = self.centre
        rigid = np.array([[mass, 0.0, -mass * y], [0.0, mass, mass * x], [-mass * y, mass * x, yaw_inertia]])
        return np.asarray(rigid + self.map.T @ (self.turning(wheel_inertia)[:, None] * self.map))
