"""`specular`: mirrors, glossy faces, glass and water, which gather cannot follow alone, and how a pilot does."""

from dataclasses import dataclass

import numpy as np

from ..patches.brdfs import Lambertian
from ..patches.fates_of_rays import meets_back
from ..patches.materials import describe_brdf
from ..patches.read_albedo import TriangleBrdfs, brdfs_of_triangles
from ..rays.hemisphere_rays import points_of_patches
from ..sun.horizon import is_above
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


FLATTEST = 1e-6  # smallest cosine of incidence, against rounding
ALIKE = 1e-5  # by which the cosine between normals of the same plane differs from 1


@dataclass
class Mirrors:
    """Faces at which the paths of a pilot turn as light does, and the planes in which they see images of the sun.

    For the sun a glossy face counts as a mirror of the same reflectance.
    """

    laws: TriangleBrdfs
    planes: np.ndarray  # (k, 3) float32, distinct normals
    chance: np.ndarray  # (k,) float64, with which each is looked at: its share of the area

    def turned(self, paths):
        """Paths that have arrived at such faces: (m,) bool. Those that start there have come from nowhere."""
        return (self.laws.index[paths.patch] >= 0) & paths.arriving.any(axis=1)

    def turn(self, patches, paths, local, generator):
        """Directions in which paths go on, in the local frames of their patches, and their weights.

        Parameters
        ----------
        patches : Patches
        paths : Paths
            m.
        local : (3, m, 1) float32
            Where they go on from faces that reflect by Lambert's law.
        generator : numpy.random.Generator

        Returns
        -------
        (3, m, 1) float32
        (m,) float32
        """
        local, weight, turned = np.array(local), np.array(paths.weight), self.turned(paths)
        draws = generator.random((len(weight), 3), np.float32)
        for law, brdf in enumerate(self.laws.brdfs):
            some = np.flatnonzero(turned & (self.laws.index[paths.patch] == law))
            patch = paths.patch[some]
            axes = np.concatenate([patches.tangents[patch], patches.normal[patch, None]], axis=1).astype(float)
            arriving = -np.einsum("mij,mj->mi", axes, paths.arriving[some].astype(float))
            arriving[:, 2] = np.maximum(arriving[:, 2], FLATTEST)
            leaving, share = brdf.sample(arriving / np.linalg.norm(arriving, axis=1, keepdims=True), draws[some])
            local[:, some, 0] = leaving.T
            weight[some] *= share
        return local, weight

    def images(self, ray_scene, patches, rays, around, generator):
        """Light of suns by way of one such face, at places of patches.

        Parameters
        ----------
        ray_scene : FacingScene
        patches : Patches
        rays : tuple of three (m, 3) float32
            Places, normals there, and directions towards a sun.
        around : Surroundings
        generator : numpy.random.Generator

        Returns
        -------
        (m,) float64
            Per normal irradiance.
        """
        origins, normal, sun = rays
        plane = generator.choice(len(self.planes), len(sun), p=self.chance)
        up = self.planes[plane]
        incident = np.einsum("ij,ij->i", sun, up)
        towards = (sun - 2 * incident[:, None] * up).astype(np.float32)
        cosine = np.einsum("ij,ij->i", towards, normal)
        found, some = np.zeros(len(sun)), np.flatnonzero((incident > FLATTEST) & (cosine > 0))
        hit, b1, b2 = ray_scene.trace_places(origins[some], towards[some])
        seen = (hit >= 0) & (self.laws.index[hit] >= 0) & ~meets_back(patches, hit, towards[some])
        seen &= np.einsum("ij,ij->i", patches.normal[hit], up[some]) > 1 - ALIKE
        some, hit = some[seen], hit[seen]
        mirrored = points_of_patches(patches, hit, b1[seen, None], b2[seen, None])[:, 0]
        free = (ray_scene.trace_closest(mirrored, sun[some]) < 0) & is_above(around.terrain, sun[some])
        passed = free.astype(float)
        if around.canopy is not None:
            reach = np.linalg.norm(mirrored - origins[some], axis=1)
            passed *= around.canopy.transmittance(mirrored, sun[some])
            passed *= around.canopy.transmittance(origins[some], towards[some], reach)
        flat = np.sqrt(np.maximum(1 - incident[some] ** 2, 0))
        arriving = np.stack([flat, 0 * flat, incident[some]], axis=1).astype(float)
        for law, brdf in enumerate(self.laws.brdfs):
            own = self.laws.index[hit] == law
            passed[own] *= brdf.sample(arriving[own], generator.random((own.sum(), 3)))[1]
        found[some] = passed * cosine[some] / self.chance[plane[some]]
        return found


def find_mirrors(inputs):
    """Faces that do not reflect by Lambert's law: Mirrors, or None without any."""
    laws = brdfs_of_triangles(inputs.scene, inputs.request, inputs.materials)
    faces = (laws.index >= 0) & inputs.patches.receives
    if not faces.any():
        return None
    planes, which = np.unique(np.round(inputs.patches.normal[faces].astype(float), 5), axis=0, return_inverse=True)
    area = np.bincount(which.ravel(), np.maximum(inputs.patches.area[faces], 1e-9))
    planes /= np.linalg.norm(planes, axis=1, keepdims=True)
    return Mirrors(laws, planes.astype(np.float32), area / area.sum())
