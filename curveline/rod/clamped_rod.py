"""One rod between two clamps as the physics sees it, in SI: all that a scene says of a segment, in the plane and out.

rod = ClampedRod(pose, bearing)             # what the nodes impose, and what stays the same when they move
rod.moved_to(pose)                          # the same rod between nodes elsewhere
rod.scaled()                                # in the plane, in units of its length and EI, for the kernels
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from curveline.rod.natural_curvature import curvatures_at
from curveline.rod.problem import Array, Bearing, Pose, ScaledRod, scale_rod
from curveline.rod.section import LINE, Section

NEARLY = 1e-6
"""What points out of the plane, in rad and units of EI over powers of the length, that no more than rounds a scene."""


class DeadLoad(NamedTuple):
    """A force on the rod that keeps its size and direction."""

    at: float  # fraction of the length from pivot to pivot
    x: float  # [N]
    y: float  # [N]
    z: float = 0.0  # [N], towards the viewer


@dataclass(frozen=True)
class ClampedRod:
    """A uniform rod from clamp to clamp; x and y span the display's plane, z points to the viewer.

    `pose` and `bearing` are to hold floats, as kernels take them. The tangent turns by `winding` further full turns
    from clamp to clamp. Of what a planar rod leaves out, `yaw` turns the clamps' tangents out of the plane towards +z,
    then `roll` turns the clamps about their tangents; `weight_x` and `weight_z` are what of the weight does not point
    down; `lateral_curvature` is the free rod's towards +z. Kernels in the plane take nothing of that from it.
    """

    pose: Pose  # what the nodes impose
    bearing: Bearing  # what stays the same when the nodes move
    loads: tuple[DeadLoad, ...] = ()  # in order of their places
    winding: int = 0
    section: Section = LINE  # what the rod is made of
    yaw: tuple[float, float] = (0.0, 0.0)  # [rad]
    roll: tuple[float, float] = (0.0, 0.0)  # [rad]
    weight_x: float = 0.0  # [N/m]
    weight_z: float = 0.0  # [N/m]
    lateral_curvature: float = 0.0  # [1/m]

    @property
    def chord(self) -> tuple[float, float]:
        """The right pivot, seen from the left one [m]."""
        return self.pose.x, self.pose.y

    @property
    def start(self) -> float:
        """Angle of the first clamp [rad]."""
        return self.pose.start

    @property
    def end(self) -> float:
        """Angle of the last clamp [rad]; further turns are none of it."""
        return self.pose.end

    @property
    def length(self) -> float:
        """Length of the rod from pivot to pivot [m]."""
        return self.pose.length

    @property
    def clamp(self) -> float:
        """Length of rod that a bearing holds straight, centred on its pivot [m]."""
        return self.bearing.clamp

    @property
    def stiffness(self) -> float:
        """EI of bending in the plane [N m^2]."""
        return self.bearing.stiffness

    @property
    def weight(self) -> float:
        """What of the weight points down [N/m]."""
        return self.bearing.weight

    @property
    def natural_curvature(self) -> float:
        """Curvature of the free rod in the plane [1/m], but for what varies along it."""
        return self.bearing.natural

    @property
    def is_unevenly_curved(self) -> bool:
        """True if the free rod is not bent alike all along."""
        return len(self.bearing.profile) > 0

    @property
    def mouth_curvatures(self) -> tuple[float, float]:
        """Natural curvatures in the plane where the free rod begins and where it ends [1/m]."""
        half = 0.5 * self.bearing.clamp
        begin, end = self.pose.begin + half, self.pose.begin + self.pose.length - half
        if not self.is_unevenly_curved:
            return self.bearing.natural, self.bearing.natural
        first, last = curvatures_at(self.bearing.profile, np.array([begin, end])).tolist()
        return self.bearing.natural + first, self.bearing.natural + last

    @property
    def free_length(self) -> float:
        """Length of the rod outside the bearings [m]."""
        return self.pose.length - self.bearing.clamp

    @property
    def free_start(self) -> tuple[float, float]:
        """Where the free rod begins, seen from the left pivot [m]."""
        half, start = 0.5 * self.bearing.clamp, self.pose.start
        return half * math.cos(start), half * math.sin(start)

    @property
    def free_chord(self) -> tuple[float, float]:
        """From where the free rod begins to where it ends [m]."""
        half, (x, y, start, end, *_) = 0.5 * self.bearing.clamp, self.pose
        return x - half * (math.cos(start) + math.cos(end)), y - half * (math.sin(start) + math.sin(end))

    @property
    def turn(self) -> float:
        """How far the tangent turns from clamp to clamp [rad]."""
        return self.pose.end - self.pose.start + 2.0 * math.pi * self.winding

    @property
    def has_giving_clamps(self) -> bool:
        """True if the bearings tilt under the rod's moment."""
        return self.bearing.give > 0.0 or self.bearing.play > 0.0

    @property
    def is_extensible(self) -> bool:
        """True if the rod may stretch in the plane."""
        return self.bearing.compliance > 0.0

    @property
    def stretching_compliance(self) -> float:
        """EI / EA of the section [m^2], whether the rod may stretch or not."""
        return self.stiffness / self.section.stretching_stiffness

    @property
    def is_flat(self) -> bool:
        """True if nothing points out of the plane."""
        sideways = (*self.yaw, *self.roll, self.weight_z, self.lateral_curvature)
        return not any(sideways) and not any(load.z for load in self.loads)

    @property
    def is_nearly_flat(self) -> bool:
        """True if what points out of the plane is no more than changes of a billionth make of nothing."""
        forces = (self.weight_z * self.free_length, *(load.z for load in self.loads))
        turned = (*self.yaw, *self.roll, self.lateral_curvature * self.free_length)
        return max(map(abs, (*turned, *(force * self._unit for force in forces)))) < NEARLY

    @property
    def needs_space(self) -> bool:
        """True if a planar model, whose weight points straight down, leaves out more of the scene than rounding."""
        return not self.is_nearly_flat or abs(self.weight_x) * self.free_length * self._unit >= NEARLY

    @property
    def _unit(self) -> float:
        """One over the unit of force, EI / L^2."""
        return self.free_length**2 / self.stiffness

    def moved_to(self, pose: Pose) -> ClampedRod:
        """The same rod with its nodes elsewhere in the plane."""
        return replace(self, pose=pose)

    def weighing(self, weight: float) -> ClampedRod:
        """The same rod with a weight [N/m] that points straight down."""
        return replace(self, bearing=self.bearing._replace(weight=weight), weight_x=0.0, weight_z=0.0)

    def extensible(self) -> ClampedRod:
        """The same rod, which may stretch in the plane as its section lets it."""
        return replace(self, bearing=self.bearing._replace(compliance=self.stretching_compliance))

    def inextensible(self) -> ClampedRod:
        """The same rod, which may not stretch in the plane."""
        return replace(self, bearing=self.bearing._replace(compliance=0.0))

    def part(self, share: float) -> ClampedRod:
        """The same rod with a `share` of all that points out of the plane."""
        return replace(
            self,
            yaw=(share * self.yaw[0], share * self.yaw[1]),
            roll=(share * self.roll[0], share * self.roll[1]),
            weight_z=share * self.weight_z,
            loads=tuple(load._replace(z=share * load.z) for load in self.loads),
            lateral_curvature=share * self.lateral_curvature,
        )

    def dead_loads(self) -> tuple[Array, Array]:
        """What of the loads lies in the plane, for kernels: fractions of the length (m,) and forces (m, 2) [N]."""
        places = np.array([load.at for load in self.loads], dtype=float)
        return places, np.array([(load.x, load.y) for load in self.loads], dtype=float).reshape(-1, 2)

    def scaled(self) -> ScaledRod:
        """What of the free rod is in the plane, in units of its length and EI; its arrays are not to be written to."""
        return self._scaled

    @cached_property
    def _scaled(self) -> ScaledRod:
        turned = self.pose._replace(end=self.pose.end + 2.0 * math.pi * self.winding)
        rod: ScaledRod = scale_rod(turned, self.bearing, *self.dead_loads())
        return rod
