"""Light between the faces of a scene alone, without sky or sun: what closed forms of radiosity
know.
"""

from dataclasses import dataclass

import numpy as np

from ..patches.patches import Patches
from ..rays.hemisphere_rays import CELL_DIVISIONS
from ..rays.ray_scene import RayScene
from ..rays.sample_points import HEMISPHERE_REPLICATES
from .solve_radiosity import radiosity_factor, solve_radiosity
from .trace_hemisphere import trace_rows
from .traced import RayCity, Traced


@dataclass
class BareLight:
    """What the hemisphere rays of p patches met."""

    patches: Patches
    traced: Traced

    def reflect(self, bounces):
        """Irradiance where every patch starts with 1, after some reflections: (p,) float64."""
        first = np.ones((len(self.patches), 1), np.float32)
        factor = radiosity_factor(self.patches, self.traced.covered_share)
        none, factors = np.zeros_like(first), self.traced.form_factors
        reflected = solve_radiosity(factors, factor, first, none, bounces)
        return (first + reflected).astype(float).ravel()

    def view_of_others(self):
        """View factor of each patch to all others, by replicates, (p, r), and area of patches
        [m²].
        """
        shares = np.asarray(self.traced.form_factors.as_matrix().sum(axis=1))
        return shares.reshape(-1, HEMISPHERE_REPLICATES), self.patches.area


def trace_bare(scene, albedo, samples, *, lit_inside=False):
    """Trace hemisphere rays of all patches of a scene with one albedo: BareLight.

    Where it is `lit_inside`, nothing is covered.
    """
    patches = Patches.of_scene(scene, np.full(len(scene.triangles), float(albedo)), 0)
    covered = np.zeros((len(patches), CELL_DIVISIONS**2), bool) if lit_inside else None
    city = RayCity(
        ray_scene=RayScene(scene.vertices, scene.triangles), patches=patches, covered=covered
    )
    traced = Traced.empty(city)
    for part, *_ in trace_rows(city, np.arange(len(patches)), samples):
        traced.put(part)
    return BareLight(patches, traced)
