"""What tracing, energy and files need to know of a source of light in the sky that is traced by itself."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class SkySource:
    """A part of the sky that is not as bright as the dome around it, and has rays and photons of its own.

    Its light on surfaces is stated per irradiance of that unshaded surface which gets most of it.
    """

    name: str  # of its values in a Transfer, of its variables in files, and of the stage in which it is traced
    title: str  # in messages: "the horizon"
    unit: str  # in descriptions of variables: that surface's light
    skies: tuple  # models of the sky that have it
    stream: np.uint64  # sets the random numbers of its rays apart
    incidence: str  # region of `pvlib.iam.marion_diffuse` whose incidence angle modifier its light gets
    unshaded: Callable  # normals (n, 3) -> (n,): its light on unshaded surfaces, 0 to 1
    sample: Callable  # normals (c, 3), two (c, m) of uniform numbers -> (c, m, 3): as dense as its light on the surface
    seen: Callable  # normals (n, 3), TerrainHorizon or None -> (n,): share of that light from above the terrain
    contains: Callable  # directions of the sky (m, 3) -> (m,) bool
    radiance: float  # π times its own
    low: float  # light lost with a cosine-weighted share of the sky that is less than 2° above the level
    sides: np.ndarray  # (6,) photons: power through lid, bottom and sides of a box, per area
    enter: Callable  # photons: axis and sign of sides' inward normals (m,), uniform numbers (m, 2) -> directions (m, 3)
    weigh: Callable  # photons: normals where they arrive and directions towards the source (m, 3) -> weights (m,)

    def variable(self, field):
        """Name of a field of its SourceLight in files and messages."""
        return f"{self.name}_{'relative_' if field == 'standard_error' else ''}{field}"
