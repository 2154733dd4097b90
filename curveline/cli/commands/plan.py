"""`curveline plan`: the steps that bring a display into a shape."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from curveline.cli import monte_carlo as trials
from curveline.cli.options import RESULTS, BriefOption, ForceOption, runs_folder
from curveline.cli.printing import screen
from curveline.cli.written_plans import write_outputs
from curveline.errors import InvalidInput
from curveline.outputs import PLAN, check_output

if TYPE_CHECKING:
    from curveline.plan_file import Plan
    from curveline.scene import Display

WAY = "The way"


def plan(
    shapes: Annotated[
        list[str] | None,
        typer.Argument(metavar="SHAPE", help="Shape files (.toml), or one plan (.json) to look at."),
    ] = None,
    begin: Annotated[
        str | None,
        typer.Option(
            "--from",
            metavar="SHAPE",
            rich_help_panel=WAY,
            help="Begin where the display shows this shape, and not at home.",
        ),
    ] = None,
    after: Annotated[
        str | None,
        typer.Option(
            metavar="SHAPE@TIME,...",
            rich_help_panel=WAY,
            help="What the rod went through: shapes and how long it was in each, such as other.toml@8h,home@30min.",
        ),
    ] = None,
    as_is: Annotated[
        str | None,
        typer.Option(
            "--as-is",
            metavar="RADIO",
            rich_help_panel=WAY,
            help="The rod is as the runs on record over this radio left it, such as mock; no node is asked.",
        ),
    ] = None,
    home: Annotated[
        bool,
        typer.Option("--home", rich_help_panel=WAY, help="End at home: nodes level and upright, the rod straight."),
    ] = False,
    output: Annotated[
        list[str] | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            rich_help_panel=RESULTS,
            help="Write the plan (.json), its steps as a figure (.svg, .png, .pdf) or a film (.gif); - is JSON on "
            "stdout.",
        ),
    ] = None,
    force: ForceOption = False,
    json: Annotated[
        bool, typer.Option("--json", rich_help_panel=RESULTS, help="The plan's JSON on stdout; errors, too.")
    ] = False,
    brief: BriefOption = False,
    monte_carlo: trials.Runs = None,
    seed: trials.Seed = 1,
    feed_error_mm: trials.FeedError = None,
    feed_scale_percent: trials.FeedScale = None,
    angle_error_deg: trials.AngleError = None,
    height_error_mm: trials.HeightError = None,
    bow_mm: trials.Bow = None,
    unevenness: trials.Unevenness = None,
    stiffness_percent: trials.StiffnessPercent = None,
    mass_percent: trials.MassPercent = None,
    clamp_stiffness: trials.ClampStiffness = None,
    clamp_play_deg: trials.ClampPlay = None,
    clamp_mm: trials.Clamp = None,
    span_error_mm: trials.SpanError = None,
    friction_mm: trials.Friction = None,
    set_percent: trials.SetPercent = None,
    rank: trials.Ranks = False,
    least_share: trials.LeastShare = 0.0,
    jobs: trials.Jobs = None,
) -> None:
    """Work out the steps from home to a shape, or through several, or look at a plan that was worked out before.

    From one shape to the next the nodes go directly where the rod keeps its states on the way, and through a funnel,
    in which only the wanted state exists, where it does not. Every step is followed in every mixture of uneven
    progress of the nodes and refused, with the reason, if the rod could end in another state than the wanted one, would
    bend too tightly or need more than the motors give.

    With --after the rod is as it comes out of other shapes, or of itself straight, at home: plastic keeps part of a
    curve that it was held in. With --as-is it is as the runs on record left it. A shape that is not safe then says what
    to do first.

    With --monte-carlo the plan is played many times with errors of the nodes, and of the display as far as its file or
    options tell what it may be in truth, and the share of runs that end in the wanted states is reported; with --rank
    also what each error does to that and to the curve. --json then prints one object with `plan` and `monte_carlo`,
    --brief that share alone; -o always writes the plan.
    """
    from curveline.cli.printing.reports.plan_text import describe
    from curveline.plan_file import to_json

    files = [path for path in output or () if path != "-"]
    for path in files:
        check_output(PLAN, path, force=force)
    sizes = (feed_error_mm, feed_scale_percent, angle_error_deg, height_error_mm, bow_mm, unevenness)
    ranges = {
        "stiffness_percent": stiffness_percent,
        "mass_percent": mass_percent,
        "clamp_stiffness_Nmm_per_deg": clamp_stiffness,
        "clamp_play_deg": clamp_play_deg,
        "clamp_mm": clamp_mm,
        "span_error_mm": span_error_mm,
        "friction_mm": friction_mm,
        "set_percent": set_percent,
    }
    request = trials.requested(monte_carlo, (seed, least_share, jobs), sizes, ranges, rank=rank)
    if after is not None and as_is is not None:
        raise InvalidInput("--after and --as-is both say what the rod went through", "leave one of the two out")
    made, display = _made(shapes or [], begin, (after, as_is), goes_home=home)
    # Before anything is printed: whoever reads it may stop listening.
    write_outputs(made, files, force=force)
    is_piped = len(files) < len(output or ())
    if is_piped or (json and request is None):
        screen.result(to_json(made).rstrip("\n"))
    elif not json and (request is None or not brief):
        screen.result("\n".join(describe(made)))
    if request is not None:
        share = trials.perturb(made, request, display, as_json=json and not is_piped, aside=is_piped)
        raise typer.Exit(trials.exit_code_of(share, least_share))


def _made(
    paths: Sequence[str], begin: str | None, history: tuple[str | None, str | None], *, goes_home: bool
) -> tuple[Plan, Display | None]:
    """A plan that was worked out before, or one through some shapes, and home, after a history of the rod.

    The history is told, or is that of the runs on record over a radio. With it the display whose rod has that; None for
    one that is as its file says.
    """
    from curveline.api import after as past_history
    from curveline.cli.terminal import TERMINAL
    from curveline.driving.rod_plans import as_on_record, plan_for_later
    from curveline.driving.rod_record import RodRecord
    from curveline.driving.tours import Whereabouts, tour_of
    from curveline.plan_file import Plan
    from curveline.radio.interface import check_radio
    from curveline.shapes.inputs import read_inputs
    from curveline.shapes.radians import tell_of_radians

    if not paths and (begin is None or not goes_home):
        raise InvalidInput("no shape to plan", "name shapes, or the one that is shown: --from SHAPE --home")
    hint = "look at a plan with `curveline plan PLAN`, and plan with shapes"
    named = [*paths, *([] if begin is None else [begin])]
    given = read_inputs(named, hint, takes_plan=begin is None and not goes_home)
    if isinstance(given, Plan):
        return given, None
    after, as_is = history
    if after is not None:
        given = [past_history(scene, after) for scene in given]
    tour = tour_of(given, ends_home=goes_home)
    tell_of_radians(given, TERMINAL)
    if as_is is not None:
        check_radio(as_is)
        tour = as_on_record(tour, RodRecord(as_is, runs_folder(None)), TERMINAL)
        given = list(tour.scenes)
    display = None if after is None and as_is is None else tour.display
    start = Whereabouts()
    if begin is not None:
        from curveline.planning.tours import start_at

        tour, start = tour.without_last(), Whereabouts(*start_at(given[-1]))
    return plan_for_later(tour, start, TERMINAL), display
