"""What a lab's CI can check without hardware: a shape is planned, sent on a modelled display, and ends as wanted."""

import sys
import tempfile

import curveline

with tempfile.TemporaryDirectory() as runs, curveline.connect("mock:fresh,loss=0.1", "single", runs=runs) as session:
    plan = session.plan("shapes/level-up-peak.toml")
    trials = curveline.monte_carlo(plan, curveline.TrialsRequest(runs=20))
    result = session.send(plan)
    print(f"{trials.share.count} of {trials.share.runs} runs with errors end as wanted")
    print(f"sent: {result.report.outcome}, the rod shows {', '.join(result.playback.states)}")
    session.home()
sys.exit(0 if result.is_wanted and trials.share.value > 0.9 else 1)
