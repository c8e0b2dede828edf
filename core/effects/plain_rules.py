"""Effects that are on where there is something for them: `trees`, `specular`, and three of the modules.

Nothing but the photons of `specular` costs much, and what each of them changes is measured, not estimated.
"""

import numpy as np

from ..city.foliage import choose_foliage
from ..patches.brdfs import Lambertian
from ..patches.materials import describe_brdf
from ..patches.read_albedo import brdfs_of_triangles
from .effect import Effect

OF_MODULES = {  # key -> what is computed without the effect, how far it goes (aoi: one of LAWS), and why
    "aoi": ("as at normal incidence", "", "light that falls in at an angle is lost to reflection"),
    "spectrum": (
        "as under the standard spectrum",
        "Sandia's f₁ by air mass",
        "the current depends on the colour of the light",
    ),
    "temperature": ("cells always at 25 °C", "cells warmed by air and light", "power falls as cells get warm"),
}
LAWS = {"module": "by the module's own law", "physical": "by Fresnel's equations", "ashrae": "by ASHRAE's law"}


def decide_trees(inputs):
    """On where the model has vegetation: crowns that let part of the light through, in leaf and bare."""
    crowns, request = inputs.scene.trees, inputs.request
    if crowns is None:
        return Effect("trees", False, "none", "there is no vegetation in the model", 0.0)
    if not inputs.asked("trees", True):
        return Effect("trees", False, f"none of {len(crowns):,} trees", "switched off", None)
    foliage = inputs.plan.foliage = choose_foliage(crowns, request, inputs.scene.site.latitude)
    months = f"leaves in months {', '.join(map(str, foliage.months))}" if foliage.seasonal else "one state all year"
    reason = "the model has vegetation; light that leaves scatter is left out"
    return Effect("trees", True, f"{len(crowns):,} trees, {months}", reason, None)


def decide_specular(inputs):
    """Called for when a material, a mirror, glass or water, does not reflect by Lambert's law."""
    key, none = "specular", "no pass of photons"
    others = [one for one in inputs.materials if not isinstance(one.brdf, Lambertian)]
    if not others:
        return Effect(key, False, none, "every material reflects diffusely", 0.0)
    if inputs.request.estimator == "forward":
        return Effect(key, True, "in every photon's path", "the forward estimator reflects by any law", 0.0)
    if not inputs.plan.reflections:
        return Effect(key, False, none, "nothing is reflected", 0.0)
    if not inputs.asked(key, True):
        return Effect(key, False, none, "switched off: such faces are black", None)
    inputs.plan.brdfs = brdfs_of_triangles(inputs.scene, inputs.request, inputs.materials)
    index = inputs.plan.brdfs.index
    area = float(inputs.patches.area[index >= 0].sum())
    laws = " and ".join(sorted({describe_brdf(one.brdf) for one in others}))
    extent = f"photons from {int(np.count_nonzero(index >= 0)):,} patches, {area:,.0f} m²"
    return Effect(key, True, extent, f"they reflect {laws}", 0.0)


def decide_of_modules(inputs, key):
    """Effects of the modules: on unless they are switched off."""
    off, extent, reason = OF_MODULES[key]
    if not inputs.asked(key, True):
        return Effect(key, False, off, "switched off", None)
    return Effect(key, True, extent or LAWS[inputs.request.iam], reason, 0.0)
