"""What the commands do, from Python: functions that take shapes and plans, or their files, and return data.

Shapes are files, the names of shapes that come with curveline, or scenes. Lengths are in m, angles in rad, forces in N
unless a name says otherwise. A `listener` hears how long work goes: see `curveline.listening`.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from curveline.errors import InvalidInput
from curveline.listening import SILENT, Listener
from curveline.system.arguments import expect

if TYPE_CHECKING:
    import numpy.typing as npt

    from curveline.calibrating.calibrated import RodCalibration
    from curveline.calibrating.request import CalibrationRequest
    from curveline.displays.check import DisplayCheck
    from curveline.driving.halting import Halting
    from curveline.driving.logbook import RunLog
    from curveline.driving.rod_now import RodNow
    from curveline.driving.runs import Run
    from curveline.driving.status import DisplayStatus
    from curveline.loading.falling import SnapFall
    from curveline.loading.load_map import LoadMap
    from curveline.loading.pushes import Push
    from curveline.loading.snap_through import Loading
    from curveline.material.drum_fit import SetFit
    from curveline.material.drum_readings import DrumReading
    from curveline.material.history import Dwell
    from curveline.plan_file import Plan
    from curveline.replay.trials import Trials, TrialsRequest
    from curveline.scene import Display, Scene
    from curveline.simulation.pose_batch import PoseStates
    from curveline.simulation.results import Settings, ShapeReport
    from curveline.simulation.sweep_report import SweepReport
    from curveline.system.files import AnyPath
    from curveline.trial import ShapeTrials


def _scene(shape: str | os.PathLike[str] | Scene, listener: Listener) -> Scene:
    """A scene, read if it is in a file, of which `listener` is told what is hardly meant."""
    if not isinstance(shape, str | os.PathLike):
        from curveline.scene import Scene

        expect(shape, Scene, "a shape, by file, name or Scene,")
        return shape
    from curveline.shapes.files import read_shape
    from curveline.shapes.radians import tell_of_radians

    scene = read_shape(shape)
    tell_of_radians([scene], listener)
    return scene


def simulate(
    shape: str | os.PathLike[str] | Scene,
    tolerance: float = 1e-4,
    windings: tuple[int, ...] = (0,),
    model: str = "auto",
    listener: Listener = SILENT,
) -> ShapeReport:
    """Every stable state of every segment of a shape, each curve to `tolerance` [m].

    The report is a sequence of segments from left to right. The `states` of each, the highest first, have `name`,
    `stable`, `energy` [J], `error` [m] and `curve(n)`, an array (n, 2) [m] from pivot to pivot in the frame of the left
    pivot; `wanted` is the one that the shape asks for, None if there is no such state. `windings` are the numbers of
    further full turns to look for, (0, 1, -1) for loops either way. `model` is "auto", "planar", "extensible" or
    "spatial". Raises InvalidInput for a file or a model that cannot be used.
    """
    from curveline.simulation.batch import report_on
    from curveline.simulation.results import Settings

    listener.computing()
    return report_on(_scene(shape, listener), Settings(tolerance, windings=windings, model=model))


def after(shape: str | os.PathLike[str] | Scene, history: str | Sequence[Dwell], listener: Listener = SILENT) -> Scene:
    """A shape whose rod has been through a history: the set of its law is in it, for whatever takes a shape.

    `history` is text such as "other.toml@8h,home@30min@40C", with paths or names of shapes on the same display, or a
    sequence of `Dwell`; "home" is the straight rod. If the display file does not say what set it takes, it is acetal.
    `past` of what comes back has the set, its error, and `flat_after` [s]; `curveline.simulate` of it has the states.
    Raises InvalidInput for a history that cannot be read, Infeasible for a shape that the rod would not stay in.
    """
    from curveline.shapes.files import read_shape
    from curveline.simulation.dwelling import scene_after

    listener.computing()
    return scene_after(_scene(shape, listener), history, read_shape)


def simulate_poses(
    shape: str | os.PathLike[str] | Scene,
    poses: npt.ArrayLike,
    tolerance: float = 1e-4,
    jobs: int | None = None,
    listener: Listener = SILENT,
) -> PoseStates:
    """Every stable planar state of a shape of one segment with its nodes elsewhere, at each of many `poses (m, 5)`.

    A row of `poses` says where the right pivot is, seen from the left one [m], the angles of both clamps [rad] and the
    length of rod [m]. What comes is arrays with a value per state, such as `pose`, `name`, `energy` [J]; `states(pose)`
    are the states themselves, `modelled(pose)` those with bounds on what the model leaves out. `jobs` threads share the
    work, one per core for None. Raises InvalidInput for a shape that is not planar or has more segments.
    """
    from curveline.simulation.pose_batch import states_at_poses

    return states_at_poses(_scene(shape, listener), poses, tolerance, jobs, listener)


def sweep(
    shape: str | os.PathLike[str],
    ranges: Mapping[str, tuple[float, float, int]],
    settings: Settings | None = None,
    jobs: int | None = None,
    listener: Listener = SILENT,
) -> SweepReport:
    """A shape file simulated at every combination of some ranges of its numbers.

    `ranges` are {key: (start, stop, count)}, such as {"nodes.1.angle_deg": (0, 40, 41)}, in the unit of the key; the
    last one runs fastest. `rows` of the report are plain values, ready for `pandas.DataFrame`; `points` have the
    curves, some 5 kB a state. `jobs` processes share the work, one per core for 0, as many as are fastest for None.
    Raises InvalidInput before anything is computed.
    """
    from curveline.simulation.results import Settings
    from curveline.simulation.sweep import Sweep
    from curveline.simulation.sweep_report import run_sweep

    # `str` gives numpy's numbers as plain ones, and all of their digits.
    axes = [f"{key}={':'.join(map(str, numbers))}" for key, numbers in ranges.items()]
    return run_sweep(Sweep(shape, axes), settings or Settings(), jobs, listener)


def plan(
    *shapes: str | os.PathLike[str] | Scene,
    begin: str | os.PathLike[str] | Scene | None = None,
    home: bool = False,
    listener: Listener = SILENT,
) -> Plan:
    """The steps through some shapes of one display, each proven: from home, or from where it shows `begin`.

    With `home` it goes home at the end; without any shape, from `begin` home. Raises Infeasible with the reason, and
    the nearest number that would do, where no safe plan exists; InvalidInput for shapes that no motors can make.
    """
    from curveline.driving.rod_plans import plan_for_later
    from curveline.driving.tours import Whereabouts, tour_of
    from curveline.planning.tours import start_at

    if not shapes and (begin is None or not home):
        raise InvalidInput("no shape to plan", "name shapes, or the one that is shown and home")
    scenes = [_scene(shape, listener) for shape in shapes]
    start = Whereabouts()
    if begin is not None:
        first = _scene(begin, listener)
        scenes, start = [*scenes, first], Whereabouts(*start_at(first))
    tour = tour_of(scenes, ends_home=home)
    if begin is not None:
        tour = tour.without_last()
    return plan_for_later(tour, start, listener)


def load(shape: str | os.PathLike[str] | Scene, push: Push | None = None, listener: Listener = SILENT) -> Loading:
    """Push at a point of a shape, harder and harder, until it snaps through.

    `push` says where, which way, in which steps and how far; the middle of the first segment, down, if it is None.
    `rows` of what comes back are (load [N], deflection [m]), `snap` is where it snaps and into what, None if it does
    not. Raises InvalidInput for a push that makes no sense, Infeasible if there is no such state.
    """
    from curveline.loading.pushes import Push
    from curveline.loading.snap_through import load

    listener.computing()
    with listener.progress("pushing", 100) as heard:
        return load(_scene(shape, listener), push or Push(), heard)


def fall(loading: Loading, listener: Listener = SILENT) -> SnapFall:
    """How a shape that `load` pushed until it snapped falls, with its inertia, into the state where it lands.

    `write` makes a film of it (.gif) or a strobe picture. Raises Infeasible where nothing snaps, or where the push
    could not be followed; InvalidInput for a rod without mass.
    """
    from curveline.loading.falling import PARTS, fall_of
    from curveline.loading.snap_through import Loading

    expect(loading, Loading, "what `load` gave")
    listener.computing()
    with listener.progress("falling, parts", PARTS) as heard:
        return fall_of(loading, heard)


def load_map(
    shape: str | os.PathLike[str] | Scene, push: Push | None = None, points: int = 41, listener: Listener = SILENT
) -> LoadMap:
    """What every point of a shape bears: as `load`, at `points` points of a segment's curve, one after another.

    Of what comes back `points` have their place, `at` and (`x`, `y`) [m], and the `force` [N] at which the shape snaps,
    None if it bears the most; `weakest` is the one with the least.
    """
    from curveline.loading.load_map import load_map
    from curveline.loading.pushes import Push

    listener.computing()
    with listener.progress("pushing", points) as heard:
        return load_map(_scene(shape, listener), push or Push(), points, heard)


def monte_carlo(
    plan: str | os.PathLike[str] | Plan, request: TrialsRequest | None = None, listener: Listener = SILENT
) -> Trials:
    """A plan played many times with errors of nodes and display: how often it ends in the wanted states.

    `request` says how often, from which seed on, with which errors; 1000 runs with the usual ones, and those of the
    display's file, if it is None. The `share` of what comes back has its 95 % interval; the `ranking`, if that was
    asked for, says what each error does to it and to the curve. Raises InvalidInput if the plan's display is of no use.
    """
    from curveline.displays.of_plan import display_of
    from curveline.plan_file import Plan, read_plan
    from curveline.replay.monte_carlo import Setup
    from curveline.replay.trials import TrialsRequest, play_trials

    made = read_plan(plan) if isinstance(plan, str | os.PathLike) else plan
    expect(made, Plan, "a plan, or its file,")
    asked = request or TrialsRequest()
    setup = Setup(display_of(made, listener), made, asked.errors, asked.display_errors)
    return play_trials(setup, asked, listener)


def check_display(display: str | os.PathLike[str] | Display, listener: Listener = SILENT) -> DisplayCheck:
    """What a display can do, and what looks odd in its file: `display` is a built-in name, a path, or a `Display`.

    `ability` of what comes back says which lengths of rod [m] are held between level nodes, which states leave the
    plane, and where plans lead from home; `warnings` what is legal but hardly meant; `document()` has also stiffness,
    rod budget and reach of the motors. Raises InvalidInput that lists every problem of a file.
    """
    from curveline.displays.check import check_of
    from curveline.scene import Display
    from curveline.shapes.files import given_display

    given = given_display(display) if isinstance(display, str | os.PathLike) else display
    expect(given, Display, "a display, by name, path or Display,")
    listener.computing()
    return check_of(given)


def calibrate_set(readings: str | os.PathLike[str] | Sequence[DrumReading], display: AnyPath | None = None) -> SetFit:
    """The set that a rod takes, from strips of it that were bent around a drum and let go.

    `readings` are those of a .csv file, or a sequence of `DrumReading`: bend on the drum [1/m], time there and time
    after it [s], curvature read [1/m], positive as on the drum. What comes back has `strength`, 1 being the estimate
    for acetal, and `exponent`, each with an interval at 95 %; `law`, `fitted` curvatures and `rms` [1/m]. With
    `display`, the path of a display file, both are written into its `[rod]`. Raises InvalidInput for a file that cannot
    be read or written, Infeasible for strips that took no set.
    """
    from curveline.material.drum_fit import fit_set
    from curveline.material.drum_readings import read_drum_readings
    from curveline.shapes.rod_keys import write_set

    fit = fit_set(read_drum_readings(readings) if isinstance(readings, str | os.PathLike) else readings)
    if display is not None:
        write_set(display, fit.keys)
    return fit


def calibrate_rod(
    trials: Sequence[ShapeTrials], request: CalibrationRequest | None = None, listener: Listener = SILENT
) -> RodCalibration:
    """What a display is really like, by trials of at least two of its shapes, as `read_trials` gives them.

    `request` has a droop test, whether the rod may bend harder to one side, and shapes to measure next. Of what comes
    back `estimates` are the numbers, with intervals at 95 % grouped by shape and whether they are told; `calibrated` is
    the display with them, which `write` keeps in a file; `rows` say how far trials were off before and after [m];
    `next_shape` what to measure next. Raises InvalidInput for trials that cannot be calibrated with, Infeasible if they
    show none of the shapes' states.
    """
    from curveline.calibrating.calibrate import calibrate_trials
    from curveline.trial import ShapeTrials

    for each in trials:
        expect(each, ShapeTrials, "trials, as `read_trials` gives them,")
    return calibrate_trials(trials, request, listener)


def status(
    radio: str, display: AnyPath | Display | Plan = "single", *, runs: Path | str | None = None
) -> DisplayStatus:
    """What every node of a display says now, or what the process knows that is sending to them. It disturbs no run.

    All as for `connect`. Raises LinkError where the radio fails; a node that does not answer is "silent".
    """
    from curveline.driving.session import connect

    with connect(radio, display, runs=runs) as session:
        return session.status()


def rod_now(
    radio: str, display: AnyPath | Display | Plan = "single", *, new: bool = False, runs: Path | str | None = None
) -> RodNow:
    """What the rod of a display went through by the runs on record, and what set that left in it now; no node is asked.

    With `new` it is put down that a new rod is in the display from now on. All else as for `connect`. `stays` of what
    comes back are the shapes it was held in, `past` the set and `past.flat_after` [s], `with_set` the display with its
    rod as it is. If the display file does not say what set its rod takes, that is acetal's, an estimate.
    """
    from curveline.driving.session import connect

    with connect(radio, display, runs=runs) as session:
        if new:
            session.new_rod()
        return session.rod()


def stop(radio: str, display: AnyPath | Display | Plan = "single", *, runs: Path | str | None = None) -> Halting:
    """Bring every node of a display to a hold, whoever drives it; all as for `connect`.

    `is_sure` of what comes back is True if every node stands for certain. Raises LinkError where the radio fails, or
    the process that sends does not react.
    """
    from curveline.driving.session import connect

    with connect(radio, display, runs=runs) as session:
        return session.stop()


def runs(folder: Path | str | None = None, display: str = "") -> Iterator[Run]:
    """The runs on record, the newest first: how each ended, and whether it can go on.

    `folder` is that of the records, by default the user's; `display` the name of the only display that is meant, ""
    for all.
    """
    from curveline.driving.runs import read_runs
    from curveline.radio.host.journal import runs_folder

    return read_runs(runs_folder() if folder is None else Path(folder), display)


def log(run: Run | Path | str, folder: Path | str | None = None) -> RunLog:
    """The log of a run: when which step was released and done, what stopped it, who went on with it.

    `run` is one of `runs`, the folder of one, its name, or "last", the one that was begun last; names are looked for in
    `folder`, by default the user's. What comes back is a sequence of entries, with the `run` and its raw `records`.
    Raises InvalidInput for a record that is not there or is damaged.
    """
    from curveline.driving.logbook import read_log, run_named
    from curveline.driving.runs import Run
    from curveline.radio.host.journal import runs_folder

    if isinstance(run, Run):
        return read_log(run.folder)
    return read_log(run_named(os.fspath(run), runs_folder() if folder is None else Path(folder)))
