"""Which effects a scene calls for, decided before the first ray, each with a reason, and a bound
where one is known.

Rules of effects that are on where there is something for them stand here: `trees`, `specular`, and
three of the modules. What these change is measured, not estimated.
"""

from functools import partial

import numpy as np

from ..patches.read_albedo import brdfs_of_triangles
from ..settings.progress import silent
from ..settings.request import BEST_SKY
from .beyond_scene import decide_far_ground, decide_sky, decide_terrain
from .effect import Effect, Inputs
from .foliage import choose_foliage
from .rays import decide_rays, decide_receivers, decide_reflections
from .table import PLANNING, RETIRED, TABLE, check_effects

# key -> what is computed without the effect, how far it goes (aoi: one of LAWS), and why
OF_MODULES = {
    "aoi": ("as at normal incidence", "", "light that falls in at an angle is lost to reflection"),
    "spectrum": (
        "as under the standard spectrum",
        "Sandia's f₁ by air mass",
        "current depends on the colour of light",
    ),
    "temperature": (
        "cells always at 25 °C",
        "cells warmed by air and light",
        "power falls as cells get warm",
    ),
}
LAWS = {
    "module": "by the module's own law",
    "physical": "by Fresnel's equations",
    "ashrae": "by ASHRAE's law",
}


def _decide_trees(inputs):
    """On where the model has vegetation: crowns that let part of the light through, in leaf and
    bare.
    """
    crowns, request = inputs.scene.trees, inputs.request
    if crowns is None:
        return Effect("trees", False, "none", "there is no vegetation in the model", 0.0)
    if not inputs.asked("trees", True):
        return Effect("trees", False, f"none of {len(crowns):,} trees", "switched off", None)
    foliage = inputs.plan.foliage = choose_foliage(crowns, request, inputs.scene.site.latitude)
    months = (
        f"leaves in months {', '.join(map(str, foliage.months))}"
        if foliage.seasonal
        else "one state all year"
    )
    reason = "the model has vegetation; light that leaves scatter is left out"
    return Effect("trees", True, f"{len(crowns):,} trees, {months}", reason, None)


def _decide_specular(inputs):
    """Called for when a material, a mirror, glass or water, does not reflect by Lambert's law."""
    key, none = "specular", "no pass of photons"
    others = [material for material in inputs.materials if not material.is_diffuse]
    if not others:
        return Effect(key, False, none, "every material reflects diffusely", 0.0)
    if inputs.request.estimator == "forward":
        return Effect(
            key, True, "in every photon's path", "the forward estimator reflects by any law", 0.0
        )
    if not inputs.plan.reflections:
        return Effect(key, False, none, "nothing is reflected", 0.0)
    if not inputs.asked(key, True):
        return Effect(key, False, none, "switched off: such faces are black", None)
    inputs.plan.brdfs = brdfs_of_triangles(inputs.scene, inputs.request, inputs.materials)
    index = inputs.plan.brdfs.index
    area = float(inputs.patches.area[index >= 0].sum())
    laws = " and ".join(sorted({other.reflects for other in others}))
    extent = f"photons from {int(np.count_nonzero(index >= 0)):,} patches, {area:,.0f} m²"
    return Effect(key, True, extent, f"they reflect {laws}", 0.0)


STRINGS = "string-shade"


def _decide_strings(inputs):
    """Called for where something stands before surfaces that may carry modules."""
    plan, surfaces = inputs.plan, inputs.scene.surfaces
    if inputs.request.estimator == "forward":
        words = "photons do not tell which parts of a module they miss"
        return Effect(STRINGS, False, "unknown", words, None)
    if not inputs.asked(STRINGS, True):
        return Effect(STRINGS, False, "unknown", "switched off", None)
    if inputs.request.layout != "rows":
        return Effect(STRINGS, False, "unknown", "no modules are laid out (--layout)", None)
    # Patches with modules that a shadow may cross: those that send rays to the suns.
    eligible = np.append(surfaces.eligible, False)[inputs.scene.triangle_surface]
    shaded = eligible & inputs.patches.receives & ~plan.open_to_suns
    some = len(np.unique(inputs.scene.triangle_surface[shaded]))
    plan.string_shade = some > 0
    if not some:
        words = "nothing stands in front of any surface that carries modules"
        return Effect(STRINGS, False, "none", words, 0.0)
    counted = inputs.request.strings == "string"
    extent = f"strings on {some:,} of {int(surfaces.eligible.sum()):,} surfaces with modules"
    words = "shade moves over them" + ("" if counted else "; told, but not counted (--strings)")
    return Effect(STRINGS, True, extent, words, 0.0)


def _decide_of_modules(inputs, key):
    """Effects of the modules: on unless they are switched off."""
    off, extent, reason = OF_MODULES[key]
    if not inputs.asked(key, True):
        return Effect(key, False, off, "switched off", None)
    return Effect(key, True, extent or LAWS[inputs.request.iam], reason, 0.0)


RULES = {
    "trees": _decide_trees,
    "sky-rays": partial(decide_rays, key="sky-rays"),
    "shadow-rays": partial(decide_rays, key="shadow-rays"),
    "terrain-horizon": decide_terrain,
    "receivers": decide_receivers,
    "reflections": decide_reflections,
    "far-ground": decide_far_ground,
    BEST_SKY: decide_sky,
    "specular": _decide_specular,
    STRINGS: _decide_strings,
    **{key: partial(_decide_of_modules, key=key) for key in OF_MODULES},
}


def plan_effects(
    scene, patches, request, *, materials=(), weather=None, suns=None, progress=silent
):
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
        If `request.effects` names an effect that does not exist or that lacks what it needs, or an
        array of the scene cannot be used.
    """
    check_effects(request)
    inputs = Inputs(scene, patches, materials, request, weather, suns)
    retired = [key for key in request.effects if key in RETIRED]
    inputs.plan.notes = [
        f"--effects {key} is no more, and changes nothing: {RETIRED[key]}" for key in retired
    ]
    for done, key in enumerate(TABLE):
        progress(PLANNING, done, len(TABLE), "effects")
        inputs.plan.effects.append(RULES[key](inputs))
    return inputs.plan
