"""After the run: the bound of each effect against what was measured."""

from dataclasses import dataclass

import numpy as np


@dataclass
class Measured:
    """What a run tells on what it left out, as shares of light."""

    last_bounce: float  # share of the last reflection
    far_ground: float  # share of the far ground, reflected once
    passed_on: float = 0.0  # standard error from light that others pass on, in the mean of the worst group
    unseen: float = 0.0  # share of hits on patches that were left out
    beyond: float | None = None  # share of light that would be reflected more often; None: not known


def judge_effects(plan, measured):
    """Effects with their outcome.

    Parameters
    ----------
    plan : EffectPlan
    measured : Measured

    Returns
    -------
    list of dict
        Of `Effect.as_dict`. `outcome` has `left_out` (share of light) and `holds` (whether it is within the bound, None
        without one), or is None where nothing was measured; those of single effects that need the year's weather, or
        are switched by it, are added later (`commands.judge_light`, `results.share_of_sky`, `results.effect_shares`).
    """
    left_out = {
        "receivers": measured.passed_on,
        "reflectors": measured.unseen,
        "far-ground": measured.far_ground * edge_loss(plan),
    }
    if measured.beyond is not None:
        left_out["reflections"] = measured.beyond
    for effect in plan.effects:
        found = left_out.get(effect.key) if effect.on else None
        if found is None and effect.bound == 0:
            found = 0.0  # by construction, such as rays that would find the closed form
        effect.outcome = None if found is None else judge(found, effect.bound)
    return [effect.as_dict() for effect in plan.effects]


def judge(left_out, bound):
    """Outcome of one effect: dict."""
    return {"left_out": left_out, "holds": None if bound is None else bool(left_out <= bound)}


def edge_loss(plan):
    """Share of the sky that buildings hide from the far ground where it begins."""
    effect = plan["far-ground"]
    return 0.0 if effect.setting is None else float((1 - np.cos(np.arctan2(1.0, effect.setting))) / 2)
