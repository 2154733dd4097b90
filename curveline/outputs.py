"""Files of results: the one table from the kind of a result and the suffix of a file to what makes its content."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING

from curveline.errors import InvalidInput
from curveline.system.files import AnyPath, NewFile, check_writable, write_file

if TYPE_CHECKING:
    from curveline.simulation.results import Settings
    from curveline.simulation.sweep import Sweep
    from curveline.simulation.sweep_files import SweepFile
    from curveline.simulation.sweep_report import SweepReport

Encoder = Callable[..., bytes]
PICTURES = (".svg", ".png", ".pdf")
FILM = ".gif"
PLAN_FILE = ".json"
SHAPE_FILE = ".toml"


@dataclass(frozen=True)
class ResultKind:
    """A kind of result: for each suffix the function, as MODULE:NAME, that encodes it; a figure is told its format."""

    encoders: Mapping[str, str]
    advice: str = "name a file that ends in"

    @property
    def suffixes(self) -> tuple[str, ...]:
        """The suffixes of files in which such a result can be kept."""
        return tuple(self.encoders)

    def suffix_of(self, path: AnyPath) -> str:
        """The suffix of a file; InvalidInput if it is none of ours."""
        name = os.fspath(path)
        suffix = os.path.splitext(name)[1].lower()
        if suffix not in self.encoders:
            hint = f"{self.advice} {', '.join(self.encoders)}"
            raise InvalidInput(f"{name}: cannot tell the format from the suffix {suffix!r}", hint)
        return suffix

    def encoder(self, suffix: str) -> Encoder:
        """What makes the content; it is loaded when first used."""
        module, _, name = self.encoders[suffix].partition(":")
        encode: Encoder = getattr(import_module(module), name)
        if suffix not in PICTURES:
            return encode
        return partial(encode, kind=suffix.removeprefix("."))


def _with_pictures(encoders: Mapping[str, str], drawn_by: str) -> dict[str, str]:
    return {**encoders, **dict.fromkeys(PICTURES, drawn_by)}


SIMULATION = ResultKind(
    _with_pictures(
        {
            ".json": "curveline.simulation.results:to_json",
            ".npz": "curveline.simulation.results:to_npz",
            ".csv": "curveline.simulation.results:to_csv",
        },
        "curveline.figures.shapes:draw",
    )
)
"""Of a sequence of reports of shapes."""

SWEEP = ResultKind(
    _with_pictures(
        {
            ".json": "curveline.simulation.sweep_files:JsonFile",
            ".csv": "curveline.simulation.sweep_files:CsvFile",
            ".npz": "curveline.simulation.sweep_files:NpzFile",
        },
        "curveline.figures.sweeps:SweepPicture",
    )
)
"""Of a sweep; written by `open_sweep` while its points come in."""

ATLAS = ResultKind(
    _with_pictures(
        {".json": "curveline.atlases.results:to_json", ".npz": "curveline.atlases.results:to_npz"},
        "curveline.figures.atlases:draw",
    )
)
"""Of an atlas of a display; of .json and .npz also the command as typed."""

LOADING = ResultKind(
    _with_pictures({".json": "curveline.loading.results:to_json"}, "curveline.figures.loads:draw"),
    advice="a fall is filmed with --film; name a file that ends in",
)
"""Of what pushing a shape showed."""

FIT = ResultKind(
    _with_pictures(
        {SHAPE_FILE: "curveline.fitting.results:to_shape", ".json": "curveline.fitting.results:to_json"},
        "curveline.figures.fits:draw",
    ),
    advice="a fitted shape is .toml, its figure .svg, .png or .pdf; name a file that ends in",
)
"""Of a fit; also the path of the file, and the command as typed."""

SURFACE = ResultKind(
    _with_pictures({".json": "curveline.surfaces.results:to_json"}, "curveline.figures.surfaces:draw"),
    advice="a folder has no suffix, a figure of a surface .svg, .png or .pdf; name a file that ends in",
)
"""Of a surface, but for its folder; also the path of the file, and the command as typed."""

COMPARISON = ResultKind(
    _with_pictures(
        {".json": "curveline.comparing.results:to_json", ".csv": "curveline.comparing.results:to_csv"},
        "curveline.figures.comparisons:draw",
    )
)
"""Of trials beside the model; also the command as typed."""

CALIBRATION = ResultKind(
    _with_pictures(
        {SHAPE_FILE: "curveline.calibrating.display_file:to_display", ".json": "curveline.calibrating.results:to_json"},
        "curveline.figures.calibrations:draw",
    ),
    advice="a calibrated display is .toml, its figure .svg, .png or .pdf; name a file that ends in",
)
"""Of a calibrated display; also the path of the file, and the command as typed."""

FALL = ResultKind(
    _with_pictures({FILM: "curveline.figures.falls:animate"}, "curveline.figures.falls:draw"),
    advice="a fall is filmed in a file that ends in .gif, or shown in a strobe picture:",
)
"""Of how a pushed shape falls when it snaps; also who is told how far the film has come."""

PLAN = ResultKind(
    {
        **_with_pictures({PLAN_FILE: "curveline.plan_file:encoded"}, "curveline.figures.plans:draw"),
        FILM: "curveline.figures.planfilms:animate",
    },
    advice="a plan to be sent is .json, its figure or film ends in",
)
"""Of a plan; of pictures also its display, and who is told how far they have come."""

TUNING = ResultKind(
    _with_pictures({".json": "curveline.calibrating.step_response:to_json"}, "curveline.figures.tunings:draw")
)
"""Of how a motor answers to its duty."""

CHANNELS = ResultKind(
    _with_pictures(
        {".json": "curveline.radio.measuring.channels:to_json", ".csv": "curveline.driving.channels:to_csv"},
        "curveline.figures.channels:draw",
    )
)
"""Of how busy the channels of the radio are."""

RANGE = ResultKind(
    _with_pictures(
        {".json": "curveline.radio.measuring.reach:to_json", ".csv": "curveline.radio.measuring.reach:to_csv"},
        "curveline.figures.reach:draw",
    )
)
"""Of how well a node is heard."""

TRADE = ResultKind(_with_pictures({".json": "curveline.bench.report:to_json"}, "curveline.bench.trade_figure:draw"))
"""Of what a benchmark measured."""


def check_output(kind: ResultKind, path: AnyPath, *, force: bool = False) -> None:
    """Refuse, before anything is computed, what `write_output` would refuse; InvalidInput or MissingExtra."""
    suffix = kind.suffix_of(path)
    if suffix in (*PICTURES, FILM):
        from curveline.figures.common import require_matplotlib

        require_matplotlib()
    check_writable(path, force=force)


def write_output(kind: ResultKind, path: AnyPath, content: Sequence[object], *, force: bool = False) -> None:
    """Write a result in the format that the suffix names, whole or not at all."""
    write_file(path, kind.encoder(kind.suffix_of(path))(*content), force=force)


@contextmanager
def open_sweep(
    path: AnyPath, sweep: Sweep, settings: Settings, *, plot: str = "", force: bool = False
) -> Iterator[SweepFile]:
    """A file for what a sweep shows; it appears when the context is left without an exception.

    `plot` is what a figure shows over one key, as in `figures.sweeps.SweepView`.
    """
    suffix = SWEEP.suffix_of(path)
    make: Callable[..., SweepFile] = SWEEP.encoder(suffix)  # type: ignore[assignment]
    if suffix in PICTURES:
        make = partial(make, plot=plot)
    with NewFile(path, force=force) as file:
        sweep_file = make(file, sweep, settings)
        yield sweep_file
        sweep_file.finish()


def write_sweep(
    path: AnyPath, report: SweepReport, *, points: int | None = None, plot: str = "", force: bool = False
) -> None:
    """Write a sweep that is done, as `open_sweep` does while its points come in; `points` of a curve if it is given."""
    if plot and SWEEP.suffix_of(path) not in PICTURES:
        raise InvalidInput(f"{plot}: what is plotted is chosen for the figure of a sweep only", "leave plot out")
    settings = report.settings if points is None else replace(report.settings, points=points)
    with open_sweep(path, report.sweep, settings, plot=plot, force=force) as file:
        for point in report.points:
            file.take(file.make(point.task, point.report.with_points(points)))
