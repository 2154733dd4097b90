"""An atlas of a display: which states a segment has over a grid of two of its numbers, folds between them, forces.

found = atlas(display, AtlasRequest({"angle_deg": (0, 60, 31), "length_mm": None}, at={"rise_mm": 50}))
found.kinds, found.folds.places, found.over_grid("peak", found.force)
"""

from __future__ import annotations

import os
import time
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from curveline.atlases.curves import StableCurves, curves_of
from curveline.atlases.entries import Array, Entries, force_of, moment_of, segment_rod, share_of
from curveline.atlases.folds import Counts, Folds, located
from curveline.atlases.grid import AtlasAxis, AtlasRequest, grid_of
from curveline.atlases.sharing import Crew, at_work, found_at
from curveline.errors import InvalidInput
from curveline.listening import SILENT, Listener
from curveline.notebook import html_of, svg_of
from curveline.scene import PEAK, VALLEY, Display
from curveline.shapes.files import given_display
from curveline.system.arguments import expect
from curveline.system.files import AnyPath

NONE = "none"
JOINT = ", "


@dataclass(frozen=True)
class KindsTally:
    """What a kind of state, or several that are there together, comes to over a grid."""

    kinds: str  # such as "peak" or "peak, valley"
    points: int  # of the grid that have it


@dataclass(frozen=True)
class NameTally:
    """What the states of one name come to over a grid: the least and the most of their numbers."""

    name: str  # such as peak
    points: int  # of the grid that have it
    eigenvalue: tuple[float, float]  # lowest one, of the second variation [EI/L^2]
    force: tuple[float, float]  # largest that it asks of a motor [N]
    moment: tuple[float, float]  # largest that it asks of a motor [N m]
    too_much: float  # part of the points at which it asks for more than rod or motors can give


@dataclass(frozen=True, eq=False)
class Atlas:
    """The stable states of one segment of a display over a grid of two numbers, a row each, and where they end.

    Rows are by the points of the grid, the second axis running fastest, those of a point from the highest down.
    """

    display: Display  # whose segment it is
    request: AtlasRequest  # what was asked for
    axes: tuple[AtlasAxis, AtlasAxis]  # what runs
    fixed: dict[str, float]  # what the other keys are at, in their units
    poses: Array  # (n m, 6) of the points: x, y [m], angles [rad], length [m], where the rod begins [m]
    entries: Entries  # (s,), the states: see `entries.ENTRY`
    folds: Folds  # places where the number of states changes
    seconds: float  # that it took

    @property
    def shape(self) -> tuple[int, int]:
        """How many values each axis has."""
        return self.axes[0].count, self.axes[1].count

    @cached_property
    def counts(self) -> Counts:
        """How many stable states there are at every point, (n, m)."""
        return np.bincount(self.entries["pose"], minlength=len(self.poses)).reshape(self.shape)

    @cached_property
    def kinds(self) -> npt.NDArray[np.str_]:
        """Which kinds of states are there at every point, (n, m): such as "peak, valley", or "none"."""
        found: list[set[str]] = [set() for _ in self.poses]
        for point, name in zip(self.entries["pose"].tolist(), self.entries["name"].tolist(), strict=True):
            found[point].add(name.partition("-")[0])
        return np.array([_listed(each) for each in found], dtype=np.str_).reshape(self.shape)

    @cached_property
    def force(self) -> Array:
        """The largest force that each state asks of a motor, extruding or lifting, (s,) [N]."""
        return force_of(self.entries)

    @cached_property
    def moment(self) -> Array:
        """The largest moment that each state asks of a motor, (s,) [N m]."""
        return moment_of(self.entries)

    @cached_property
    def share(self) -> Array:
        """The largest share of what rod or motors can give that each state asks for, (s,); beyond 1 it is too much."""
        return share_of(self.entries, self.display)

    def over_grid(self, name: str, values: Array) -> Array:
        """The value of the state of a name at every point, (n, m), of `values (s,)`; NaN where there is none."""
        out = np.full(len(self.poses), np.nan)
        there = self.entries["name"] == name
        out[self.entries["pose"][there]] = values[there]
        return out.reshape(self.shape)

    def tallies(self) -> list[KindsTally]:
        """Which kinds of states are there together, and how often, the most frequent first."""
        names, counts = np.unique(self.kinds, return_counts=True)
        found = [KindsTally(str(name), int(count)) for name, count in zip(names, counts, strict=True)]
        return sorted(found, key=lambda each: (-each.points, each.kinds))

    def names(self) -> list[NameTally]:
        """What the states of each name come to, the most frequent first."""
        found = []
        for name in sorted(set(self.entries["name"].tolist())):
            there = self.entries["name"] == name
            eigenvalues, forces, moments = (
                (float(each[there].min()), float(each[there].max()))
                for each in (self.entries["lowest_eigenvalue"], self.force, self.moment)
            )
            too_much = float(np.mean(self.share[there] > 1.0))
            found.append(NameTally(name, int(there.sum()), eigenvalues, forces, moments, too_much))
        return sorted(found, key=lambda each: -each.points)

    def _repr_svg_(self) -> str | None:
        return svg_of("curveline.figures.atlases:draw", self)

    def _repr_html_(self) -> str:
        rows = [(each.kinds, each.points) for each in self.tallies()]
        title = f"{self.display.name}: {self.axes[0]}, {self.axes[1]}"
        return html_of(title, [("states", "points"), *rows], self._repr_svg_())


def atlas(
    display: AnyPath | Display = "single",
    request: AtlasRequest | None = None,
    jobs: int | None = None,
    scheduler: str = "",
    listener: Listener = SILENT,
) -> Atlas:
    """Which stable states one segment of a display has over a grid of two numbers, the folds between, the forces.

    `display` is a built-in name, a path, or a `Display`; `request` says which numbers, by default the angle of both
    nodes and the length. `jobs` processes share the work, or the workers of the Dask scheduler at an address such as
    tcp://host:8786; the answer is the same, to the byte. Raises InvalidInput for a display whose rod leaves its plane,
    and for keys, ranges and values that it has not; MissingExtra without dask; CurvelineError for a cluster that does
    not answer, has another curveline, or whose workers are gone.
    """
    begin, request = time.monotonic(), request or AtlasRequest()
    if scheduler and jobs is not None:
        raise InvalidInput(
            "jobs are processes of this machine, and a scheduler has its own", "leave one of the two out"
        )
    given = _given(display)
    grid, rod = grid_of(given, request), segment_rod(given)
    poses = grid.all_poses()
    listener.computing()
    with at_work(_crew(jobs, scheduler), len(poses)) as doer:
        with listener.progress("atlas", len(poses)) as heard:
            entries = found_at(doer, rod, poses, request.tolerance, heard)
        with listener.progress("folds", None) as heard:
            folds = located(grid, rod, entries, doer, heard)
    return Atlas(given, request, grid.axes, grid.fixed, poses, entries, folds, time.monotonic() - begin)


def stable_curves(
    display: AnyPath | Display = "single", jobs: int | None = None, scheduler: str = "", listener: Listener = SILENT
) -> StableCurves:
    """Some thousand stable curves of one segment of a display, spread over all that its limits allow.

    They are made once, within seconds, and kept in the user's cache folder. Of what comes back `entries` is a table
    with a row per curve and named columns: `name`, `curve (33, 2)` [m] from the left pivot on, `lowest_eigenvalue`
    [EI/L^2], `loads (6,)` of both nodes, ...; `where (s, 6)` has the pose of each. All else as of `atlas`.
    """
    return curves_of(_given(display), _crew(jobs, scheduler), listener)


def _crew(jobs: int | None, scheduler: str) -> Crew:
    if scheduler and jobs is not None:
        raise InvalidInput(
            "jobs are processes of this machine, and a scheduler has workers", "leave one of the two out"
        )
    return Crew(jobs, scheduler)


def _given(display: AnyPath | Display) -> Display:
    given = given_display(display) if isinstance(display, str | os.PathLike) else display
    expect(given, Display, "a display, by name, path or Display,")
    return given


def _listed(kinds: set[str]) -> str:
    """Kinds of states as one text: peak, valley, then by the alphabet."""
    return JOINT.join(sorted(kinds, key=lambda kind: (kind not in (PEAK, VALLEY), kind))) or NONE
