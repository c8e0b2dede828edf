"""Which effects a scene calls for, decided before the first ray, each with a reason, and a bound where one is known."""

from functools import partial

from ..settings.progress import describe_duration, silent
from .beyond_scene import decide_far_ground, decide_perez, decide_terrain
from .effect import Inputs
from .plain_rules import OF_MODULES, decide_of_modules, decide_specular, decide_trees
from .rays import decide_receivers, decide_reflections, decide_reflectors, decide_shadow, decide_sky
from .table import PLANNING, TABLE, check_effects, check_needs

RULES = {
    "trees": decide_trees,
    "sky-rays": decide_sky,
    "shadow-rays": decide_shadow,
    "terrain-horizon": decide_terrain,
    "receivers": decide_receivers,
    "reflections": decide_reflections,
    "reflectors": decide_reflectors,
    "far-ground": decide_far_ground,
    "perez": decide_perez,
    "specular": decide_specular,
    **{key: partial(decide_of_modules, key=key) for key in OF_MODULES},
}


def plan_effects(scene, patches, request, *, materials=(), weather=None, suns=None, progress=silent):
    """Decide what to trace.

    Parameters
    ----------
    scene : Scene
    patches : Patches
    request : Request
    materials : list, optional
        Of `patches.read_albedo.Found`.
    weather : Weather, optional
    suns : Suns, optional
    progress : callable, optional
        See `settings.progress`: effects decided.

    Returns
    -------
    TracePlan

    Raises
    ------
    InputError
        If `request.effects` names an effect that does not exist or that lacks what it needs, or an array of the scene
        cannot be used.
    """
    check_effects(request)
    check_needs(request)
    inputs = Inputs(scene, patches, materials, request, weather, suns)
    for done, key in enumerate(TABLE):
        progress(PLANNING, done, len(TABLE), "effects")
        inputs.plan.effects.append(RULES[key](inputs))
    return inputs.plan


def describe_plan(plan):
    """The plan in lines of text."""
    lines = []
    for effect in plan.effects:
        words = [describe_bound(effect.bound, effect.on)]
        if effect.share is not None:
            doubt = f" ± {100 * effect.share_standard_error:.2f}" if effect.share_standard_error else ""
            words.append(f"contributes {100 * effect.share:+.2f}{doubt} % of full load hours")
        if effect.seconds is not None:
            verb = "takes" if effect.seconds >= 0 else "saves"
            words.append(f"{verb} {describe_duration(abs(effect.seconds))}")
        state = "on " if effect.on else "off"
        lines.append(f"{effect.key:<15} {state}  {effect.extent}: {effect.reason} ({'; '.join(words)})")
    return lines


def describe_bound(bound, on):
    """What is left out at most, a share of light or None, in words."""
    if bound is None:
        return f"{'its error' if on else 'how much light this changes'} is not known before the run"
    return f"leaves out at most {100 * bound:.2f} %" if bound else "leaves out nothing"
