"""`specular`: mirrors, glossy faces, glass and water, which gather alone cannot follow."""

import numpy as np

from ..materials.brdf_lambertian import Lambertian
from ..materials.materials import describe_brdf
from ..materials.read_albedo import brdfs_of_triangles
from .effect import Effect

KEY = "specular"


def decide(inputs):
    """Called for when a material does not reflect by Lambert's law."""
    others = [one for one in inputs.materials if not isinstance(one.brdf, Lambertian)]
    none = "no pass of photons"
    if not others:
        return Effect(KEY, False, none, "every material reflects diffusely", 0.0)
    if inputs.request.estimator == "forward":
        return Effect(KEY, True, "in every photon's path", "the forward estimator reflects by any law", 0.0)
    if not inputs.decided["reflections"].on:
        return Effect(KEY, False, none, "nothing is reflected", 0.0)
    if not inputs.asked(KEY, True):
        return Effect(KEY, False, none, "switched off: such faces are black", None)
    brdfs, index = brdfs_of_triangles(inputs.scene, inputs.request, inputs.materials)
    area = float(inputs.patches.area[index >= 0].sum())
    laws = " and ".join(sorted({describe_brdf(one.brdf) for one in others}))
    extent = f"photons from {int(np.count_nonzero(index >= 0)):,} patches, {area:,.0f} m²"
    return Effect(KEY, True, extent, f"they reflect {laws}", 0.0, setting=(brdfs, index))
