"""The specular pass: light by paths that meet a face which does not reflect by Lambert's law,
beside gather.

Gather takes such faces as black, and so has all paths without them. The specular pass has all
others, split at their first reflection at such a face:

    sun ──────────────────────────► face ─► … ─► surface      photons from the faces' sunlit points,
    sun by sun sky, far ground ──────────────► face ─► … ─► surface  ⎫   photons from the faces, the
    same for all suns: a matrix S sky, sun ─► … ─► patch (gather) ► face ─► … ─► surface  ⎭   from
    the radiosity of patches to surfaces

After that reflection photons are reflected by any face. No path is counted twice, none is left out.
"""

from dataclasses import dataclass
from functools import partial
from itertools import chain

import numpy as np
from scipy import sparse

from ..rays.random_numbers import keys_of_names
from ..settings.threads import map_in_order
from ..sky.horizon import is_above
from .follow_photons import Target, deposit
from .prepare_scene import prepare_scene
from .specular_faces import (
    FAR_GROUND,
    SKY,
    Batch,
    follow_reflected,
    photons_of_sun,
    photons_of_surroundings,
)
from .trace_all import GatherContext
from .trace_gather import trace_gather
from .traced import SKY_DOME

REPLICATES = 8  # independent sets of photons; their variance gives the standard error
PHOTONS_PER_TASK = 1 << 16


@dataclass
class _SpecularLight:
    """What n surfaces receive by way of faces that do not reflect by Lambert's law: the hooks for
    gather.

    All but `of_suns` follows from the radiosity of the sky, the far ground and patches alone; r
    replicates.
    """

    context: GatherContext
    target: Target
    faces: np.ndarray  # (f,) int, patches
    skies: dict  # name of the sky or a traced part of it -> (r, n) float64, in its unit
    far_ground: np.ndarray  # (r, n) float64, per radiosity
    patches: sparse.csr_matrix  # (r · n, p), per radiosity; rows ordered by replicate
    mean: sparse.csr_matrix  # (n, p) float32, of the replicates

    def of_sky(self, name, radiosity):
        """Irradiance under the sky or a traced part of it, and by light of patches under it, (p,):
        (r, n) float64.
        """
        return self.skies[name] + self.from_patches(radiosity)

    def from_patches(self, radiosity):
        """Irradiance of surfaces by light of patches, (p,), by way of the faces: (r, n) float64."""
        return (self.patches @ radiosity.astype(float)).reshape(self.far_ground.shape)

    def of_suns(self, suns, first, radiosity):
        """Irradiance of surfaces under a block of suns by way of the faces, per DNI.

        Parameters
        ----------
        suns : SunBlock
            b suns.
        first : int
            Index of the first of them among all.
        radiosity : (p, b) float32
            Of patches under each, without the faces.

        Returns
        -------
        (n, b) float32
        (r, n) float64
            Weighted sum over the suns.
        """
        height = np.maximum(suns.directions[:, 2], 0).astype(float) * self.context.ground_albedo
        # Light of patches and of the far ground under these suns, by the matrix; then each sun
        # itself by photons.
        irradiance = (self.mean @ radiosity) + self.far_ground.mean(axis=0)[:, None] * height
        weighted = self.from_patches(radiosity @ suns.weights)
        weighted += self.far_ground * float(suns.weights @ height)
        traced = map_in_order(
            lambda index: _trace_sun(self, suns.directions[index], f"specular sun {first + index}"),
            range(len(suns.weights)),
            self.context.threads,
        )
        for index, arrived in enumerate(traced):
            irradiance[:, index] += arrived.mean(axis=0)
            weighted += suns.weights[index] * arrived
        return irradiance.astype(np.float32), weighted


def _trace_specular(prepared, context, traced, state=0):
    """Specular light of a scene, for `trace_gather`.

    Parameters
    ----------
    prepared : PreparedScene
    context : GatherContext
    traced : Traced
    state : int
        Of the trees: 0 in leaf, 1 bare.

    Returns
    -------
    SpecularLight
    """
    # Light that comes by way of mirrors, glossy faces and glass, which gather takes as black.
    # Photons start on faces that do not reflect by Lambert's law; a ray backwards tells what each
    # brings light from. For each of these faces they are as many as the rays of another patch.
    patches, plan, count = context.patches, context.plan, len(prepared.scene.surfaces)
    surface = np.where(prepared.scene.triangle_surface < 0, count, prepared.scene.triangle_surface)
    scene = context.ray_scene, patches, surface, count, traced.covered, plan.brdfs
    target = Target(*scene, state, context.left_out)
    faces = np.flatnonzero((plan.brdfs[1] >= 0) & patches.receives & ~traced.covered.all(axis=1))
    per_replicate = -(-context.request.samples * len(faces) // REPLICATES)
    batches = _batches_of(
        keys_of_names(["specular surroundings"], context.request.seed)[0][0], per_replicate
    )
    # The last columns are the far ground, the sky and its parts that are traced.
    matrix, pending, done = (
        sparse.csr_matrix((REPLICATES * count, len(patches) + 2 + len(plan.sources))),
        [],
        0,
    )
    # Hits of all batches go into a matrix: surface that receives, patch or sky that it comes from.
    arrivals = map_in_order(
        lambda batch: _arrivals_from(context, target, faces, batch), batches, context.threads
    )
    for batch, entries in zip(batches, arrivals, strict=True):
        pending.append(entries)
        done += len(batch.numbers)
        # So many pieces of the matrix are added at once.
        if len(pending) == 128 or done == per_replicate * REPLICATES:
            rows, sources, weights = (np.concatenate(parts) for parts in zip(*pending, strict=True))
            matrix, pending = (
                matrix + sparse.csr_matrix((weights, (rows, sources)), shape=matrix.shape),
                [],
            )
        context.progress("specular light", done, per_replicate * REPLICATES, "photons")
    # Weights become irradiance; columns of sky and far ground are light of the whole sky.
    factor = _per_area(target, float(patches.area[faces].sum()), per_replicate)
    matrix = sparse.diags_array(np.tile(factor, REPLICATES)) @ matrix
    far_ground, sky, *parts = matrix[:, len(patches) :].toarray().T.reshape(-1, REPLICATES, count)
    skies = {SKY_DOME: sky + context.ground_albedo * far_ground}
    skies |= {
        source.name: source.radiance * part
        for source, part in zip(plan.sources, parts, strict=True)
    }
    # Light that comes from patches is kept by replicate, and as the mean over replicates.
    mean = sparse.hstack([sparse.eye_array(count)] * REPLICATES).tocsr() / REPLICATES
    of_patches = matrix[:, : len(patches)].tocsr()
    return _SpecularLight(
        context, target, faces, skies, far_ground, of_patches, (mean @ of_patches).tocsr()
    )


def _batches_of(key, per_replicate):
    """Photons of all replicates in pieces: list of Batch."""
    count = per_replicate * REPLICATES
    starts = range(0, count, PHOTONS_PER_TASK)
    return [
        Batch(key, range(first, min(first + PHOTONS_PER_TASK, count)), per_replicate)
        for first in starts
    ]


def _per_area(target, power, per_replicate):
    """Irradiance of each surface by one photon of a replicate: (n,) float64."""
    return power / max(per_replicate, 1) / np.where(target.area > 0, target.area, np.inf)


def _arrivals_from(context, target, faces, batch):
    """Where photons of the surroundings arrive, as entries of a sparse matrix.

    Returns
    -------
    rows : (e,) int
        Replicate times number of surfaces plus surface.
    sources : (e,) int
        Patch the light comes from, or the number of patches for the far ground, one more for the
        sky, and two or more for that part of the sky that is a traced source.
    weights : (e,) float64
    """
    # Light that reaches mirrors from sky, patches and ground, and where each photon came from.
    plan, patches = context.plan, len(context.patches)
    photons, origin, towards = photons_of_surroundings(
        target,
        faces,
        batch,
        lambda directions: (directions[:, 2] > 0) & is_above(plan.terrain, directions),
    )
    # Where the far ground is left out, what comes from it is dropped.
    if not plan.far_ground:
        photons = photons.take(origin[photons.number - batch.numbers.start] != FAR_GROUND)
    # Light of the sky has one reflection behind it here, light of ground and patches two.
    of_sky = origin[photons.number - batch.numbers.start] == SKY
    followed = (
        follow_reflected(target, batch.key, photons.take(chosen), last)
        for chosen, last in ((of_sky, context.bounces - 1), (~of_sky, context.bounces - 2))
    )
    entries = [(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0))]
    # An entry for each arrival at a surface; light of the sky counts for a traced part too where it
    # comes from there.
    for arrived, surface in chain.from_iterable(followed):
        own = surface < target.surface_count
        source = origin[arrived.number[own] - batch.numbers.start]
        rows = arrived.row[own] * target.surface_count + surface[own]
        entries.append(
            (rows, np.where(source >= 0, source, patches + (source == SKY)), arrived.weight[own])
        )
        for place, part in enumerate(plan.sources, patches + 2):
            inside = (source == SKY) & part.contains(
                towards[arrived.number[own] - batch.numbers.start]
            )
            entries.append(
                (rows[inside], np.full(int(inside.sum()), place), arrived.weight[own][inside])
            )
    return tuple(np.concatenate(parts) for parts in zip(*entries, strict=True))


def _trace_sun(light, direction, name):
    """Irradiance of surfaces by light of a sun that the faces reflect: (r, n) float64 of a
    SpecularLight, per DNI.

    `direction`, (3,) float32, is that towards the sun, `name` tells its random numbers from those
    of others.
    """
    context, target, faces = light.context, light.target, light.faces
    power = context.patches.area[faces] * np.maximum(context.patches.normal[faces] @ direction, 0)
    per_replicate = -(-context.request.shadow_samples * int((power > 0).sum()) // REPLICATES)
    arrived = np.zeros((REPLICATES, target.surface_count))
    for batch in _batches_of(keys_of_names([name], context.request.seed)[0][0], per_replicate):
        photons = photons_of_sun(target, faces, power, direction, batch)
        for some, surface in follow_reflected(target, batch.key, photons, context.bounces - 1):
            deposit(some, surface, arrived)
    return arrived * _per_area(target, float(power.sum()), per_replicate)


def trace_hybrid(scene, suns, request, progress, folder=None, *, prepared=None):
    """Trace a scene by gather, and by photons what its mirrors, glossy faces and glass add.

    Parameters, result and errors as of `trace_gather`.
    """
    prepared = prepared or prepare_scene(scene, request, suns=suns)
    return trace_gather(
        scene, suns, request, progress, folder, prepared=prepared, specular=specular_of(prepared)
    )


def specular_of(prepared):
    """The hook for gather where a material does not reflect by Lambert's law, else None."""
    return partial(_trace_specular, prepared) if prepared.plan["specular"].on else None
