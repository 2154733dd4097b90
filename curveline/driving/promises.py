"""What a plan promises of the rod at the step to which a run has come."""

from __future__ import annotations

from dataclasses import dataclass

from curveline.plan_file import Plan
from curveline.scene import STRAIGHT


@dataclass(frozen=True)
class Promise:
    """What a plan says of the rod after `step` of `steps` steps, 0 for the start: names joined by `|`, "" for any.

    `ahead` is what the step after leads to, if the nodes are in the midst of it.
    """

    step: int
    steps: int
    states: tuple[str, ...]  # left to right
    ahead: tuple[str, ...] = ()

    def verdict(self, segment: int, state: str) -> str:
        """Whether a segment (from 0) in `state` is as promised, as the end of a sentence; "" if nothing is."""
        wanted = self.states[segment]
        if not wanted:
            return ""
        if state in wanted.split("|"):
            return f", {self._fulfilled}"
        if self.ahead and state in self.ahead[segment].split("|"):
            return f", as step {self.step + 1} leads to"
        if self.step == self.steps:
            return f", not the wanted {wanted}"
        who = f"step {self.step} promises" if self.step else "the plan takes for granted"
        names = " or ".join("straight rod" if name == STRAIGHT else name for name in wanted.split("|"))
        return f", not the {names} that {who}"

    @property
    def _fulfilled(self) -> str:
        if self.step == self.steps:
            return "as wanted"
        return f"as step {self.step} leaves it" if self.step else "as the plan takes for granted"


def promise(plan: Plan, done: int, released: int) -> Promise:
    """What a plan says of the rod after `done` steps, when steps up to `released` may have been begun."""
    steps = len(plan.steps)
    states = plan.wanted if done == steps else plan.steps[done - 1].states if done else plan.granted
    return Promise(done, steps, states, plan.steps[done].states if done < released else ())
