"""Folders of lines: displays that are alike but for their names and addresses, and plans that are made once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

from curveline.drive_settings import drive_settings
from curveline.driving.tours import Whereabouts, plan_tour, tour_of
from curveline.plan_file import NodeTarget, Plan, Step, sealed, write_plan
from curveline.shapes.files import read_display, read_shape
from curveline.shapes.new_files import new_display

CHANNEL = "channel = "


def display_file(folder: Path, line: int, nodes: int = 5) -> Path:
    """The display of a line (from 1), with addresses of its own."""
    path = folder / f"display-{line}.toml"
    if not path.exists():
        text = new_display(None, nodes, name=f"line-{line}")
        path.write_text(text.replace("C1C1C1C1", f"C1C1C1{line:02X}"))
    return path


def shape_text(display: str, heights: Sequence[float]) -> str:
    """A shape with level nodes at some heights, a peak in each of its gaps."""
    nodes = "".join(f"[[nodes]]\nheight_mm = {height}\nangle_deg = 0\n" for height in heights)
    segments = '[[segments]]\nlength_mm = 600\nstate = "peak"\n' * (len(heights) - 1)
    return f'name = "hill"\ndisplay = "{display}"\n{nodes}{segments}'


@cache
def hill_plan(nodes: int = 5, rise: float = 10.0) -> Plan:
    """A plan for a display of so many nodes, whose middle is higher."""
    folder = Path(mkdtemp())
    display = display_file(folder, 0, nodes)
    heights = [100.0 + rise * min(node, nodes - 1 - node) for node in range(nodes)]
    (folder / "hill.toml").write_text(shape_text(display.name, heights))
    return plan_tour(tour_of([read_shape(folder / "hill.toml")]), Whereabouts())


def line_plan(folder: Path, line: int, nodes: int = 5, rise: float = 10.0) -> Plan:
    """The plan of a line, in whose folder its display file is."""
    plan, path = hill_plan(nodes, rise), display_file(folder, line, nodes)
    provenance = {**plan.provenance, "display": str(path)}
    return sealed(replace(plan, name=f"hill-{line}", drive=drive_settings(read_display(path)), provenance=provenance))


def quick_plan(folder: Path, line: int, steps: int = 2, seconds: float = 0.1, nodes: int = 2) -> Plan:
    """A few small moves of a line, of which nothing is promised."""
    path = display_file(folder, line, nodes)
    drive = drive_settings(read_display(path))

    def at(extrude_mm: float) -> NodeTarget:
        return NodeTarget(extrude_mm, 0.0, 0.0, (drive.axes[0].counts(extrude_mm), 0, 0))

    rods, states = (500.0,) * (nodes - 1), ("peak",) * (nodes - 1)
    moves = tuple(
        Step(number, "extrude", seconds, (at(number),) * nodes, rods, states, 1.0, 1.0, "nothing", 0.01, 1.0, 1.0)
        for number in range(1, steps + 1)
    )
    # Without a display file that is there nothing of the rod is played back.
    provenance = {"display": f"{path}.gone.toml"}
    wanted = ("peak",) * (nodes - 1)
    return sealed(Plan(f"quick-{line}", drive, (at(0.0),) * nodes, moves, wanted, rods, provenance=provenance))


def quick_lines(folder: Path, radios: Sequence[str], steps: Sequence[int] = (), **how: Any) -> Path:
    """A folder of lines with quick plans, of two steps each or of so many; see `lines_folder` for the rest."""
    counts, seconds, nodes = steps or (2,) * len(radios), how.pop("seconds", 0.1), how.pop("nodes", 2)
    plans = [quick_plan(made(folder), line, count, seconds, nodes) for line, count in enumerate(counts, start=1)]
    return lines_folder(folder, radios, plans=plans, **how)


def made(folder: Path) -> Path:
    """A folder, which is there."""
    folder.mkdir(exist_ok=True)
    return folder


def lines_folder(
    folder: Path,
    radios: Sequence[str],
    *,
    plans: Sequence[Plan] | int = 5,
    currents: Sequence[float] = (),
    limit: float | None = None,
) -> Path:
    """A folder of lines, one for each of some radios, with plans of their own or for displays of so many nodes."""
    made(folder)
    text = "" if limit is None else f"current_limit_A = {limit}\n"
    for line, radio in enumerate(radios, start=1):
        plan = line_plan(folder, line, plans) if isinstance(plans, int) else plans[line - 1]
        write_plan(plan, folder / f"line-{line}.json", force=True)
        text += f'[[lines]]\nname = "L{line}"\nplan = "line-{line}.json"\n'
        text += f'radio = "{radio}"\n' if radio else ""
        text += f"current_A = {currents[line - 1]}\n" if currents else ""
    (folder / "lines.toml").write_text(text)
    return folder
