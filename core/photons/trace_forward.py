"""Trace a scene with photons, to a Transfer: the forward estimator.

Photons start at sun, sky and far ground and are counted where they hit (Bredemeier et al., Eq. 1 to 4). They are
reflected at the exact hit point, and summed per surface: there is no assumption of constant radiosity per patch, so
results are noisy but unbiased. Every source is traced through all reflections; the cost is (suns + 3) · samples ·
patches photons, of at most 1 + max_bounces rays each.

The covered share of a surface is geometry, and the same as in gather. Sources are traced one after the other, on
several threads.
"""

from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from itertools import islice
from typing import NamedTuple

import numpy as np

from ..city.scene import check_scene
from ..effects.effect import Measured, judge_effects
from ..effects.rays import count_surely
from ..light.kept_matrix import area_means, cover_of_surfaces, keep_columns, keep_matrix
from ..light.measure_cover import find_cover
from ..light.measure_room import average_room, list_clearances, measure_room_of_patches
from ..light.prepare_scene import prepare_scene
from ..light.sun_visibility import projection_in_front
from ..light.transfer import SourceLight, TraceRecord, Transfer, note_interruption
from ..patches.facing_scene import FacingScene
from ..patches.read_albedo import brdfs_of_triangles, materials_of_surfaces
from ..settings.progress import SUN_STAGE, CancelledError, Clock
from ..settings.request import Request, check_request
from ..settings.threads import map_in_order, usable_threads
from ..sun.horizon import without_hidden
from ..sun.suns import Suns, check_suns, end_of_days, interrupted_suns
from .emit_photons import Box, box_of_scene, far_ground_source, part_of_sky, sky_source, sun_source, terrain_source
from .follow_photons import Tally, Target, follow_photons

WHOLE = 1 - 1e-6  # covered share from which a surface counts as completely covered


@dataclass
class Direct:
    """Results for each sun, per DNI."""

    visible_share: np.ndarray  # (n, s) float32
    reflected: np.ndarray  # (n, s) float32, without the first reflection from the far ground
    annual: np.ndarray  # (PHOTON_REPLICATES, n) float64, sum over suns by their weights
    photons: np.ndarray  # (n,) float64, sum of squares of the contribution of one photon per sun
    kept: int  # number of suns; fewer than all if interrupted
    last: float = 0.0  # share of the last bounce in the total, largest over all suns
    ray_count: int = 0
    tally: Tally = field(default_factory=Tally)


class SunsOnBox(NamedTuple):
    """Suns that light the box around a scene."""

    box: Box
    suns: Suns
    request: Request


def trace_forward(scene, suns, request, progress, folder=None, *, prepared=None):
    """Trace a scene with photons.

    Parameters
    ----------
    scene : Scene
    suns : Suns
    request : Request
        `samples` is the number of photons per patch from each source: the sky, the far ground and every sun.
    progress : callable
        See `core.progress`.
    folder : path-like, optional
        Where matrices of surfaces × suns lie that are too large for the memory.
    prepared : PreparedScene, optional
        Of the scene, where it is known already.

    Returns
    -------
    Transfer
        Shares are clipped at 1. Noise above that is kept, so that sums stay unbiased: it remains in `diffuse_relative`,
        and is added to `direct_reflected`. `record` has what was decided and traced, and under `photons` the energy
        balance of sky, far ground and suns. If cancelled after some suns (see `core.progress`), `suns` are those that
        were traced, and `record.interrupted` says so.

    Raises
    ------
    CancelledError
        Cancelled before any sun could be used.
    InputError
        If a number, an array or a setting is invalid; raised before any ray is traced.
    """
    check_scene(scene)
    check_suns(suns)
    check_request(request)
    clock = Clock()
    prepared = prepared or prepare_scene(scene, request, suns=suns)
    traced, patches, plan = prepared.scene, prepared.patches, prepared.plan
    patch_to_surface = area_means(traced.triangle_surface, patches.area, len(scene.surfaces))
    traced_before = prepared.plan.ray_scene.thread_seconds if prepared.plan.ray_scene else 0.0  # by earlier rounds
    run, covered_share = prepare_run(prepared, request, progress)
    run.begin("sky and far ground", 1 + plan.far_ground * (1 + (plan.terrain is not None)) + len(plan.sources))
    clock.lap("plan, tree and cover")

    brightest = max(float(patches.albedo.max(initial=0)), request.ground_albedo if plan.far_ground else 0.0)
    bounces = count_surely(brightest) if plan.max_bounces is None else plan.max_bounces
    box = box_of_scene(traced, run.target.ray_scene.canopy)
    (sky,) = trace_sources(run, [sky_source(box, request.seed, plan.terrain)], bounces)
    far = trace_far_ground(run, box, plan, request.seed, bounces)
    parts = {}
    for source in plan.sources:  # parts of the sky that are traced by themselves, in their units
        (parts[source.name],) = trace_sources(run, [part_of_sky(source, box, request.seed, plan.terrain)], bounces)
    clock.lap("sky and far ground")
    run.begin(SUN_STAGE, len(suns))
    weighed = without_hidden(suns, plan.terrain)
    direct = trace_direct(run, SunsOnBox(box, weighed, request), far, bounces, patch_to_surface, folder=folder)
    clock.lap("suns")
    diffuse = sky.whole + request.ground_albedo * far.whole
    photons = sky.photon**2 + (request.ground_albedo * far.photon) ** 2
    covered_share = cover_of_surfaces(patch_to_surface, covered_share)
    traced = dict(zip(SOURCES, (sky, far, direct), strict=True)) | parts
    last = max(sky.last, direct.last)
    beyond = last * brightest / (1 - brightest) if brightest < 1 else None
    by_ground, whole = request.ground_albedo * float(far.whole.sum()), float(diffuse.sum())
    measured = Measured(last, by_ground / whole if whole > 0 else 0.0, beyond=beyond)
    lengths, target = list_clearances(request), run.target
    how = {"clearances": lengths, "threads": run.threads}
    room = measure_room_of_patches(target.ray_scene, patches, prepared.scene, target.covered, **how)
    unreachable = (covered_share > WHOLE) | (run.area == 0)
    return Transfer(
        surfaces=scene.surfaces,
        site=scene.site,
        suns=suns if direct.kept == len(suns) else interrupted_suns(suns, direct.kept),
        covered_share=covered_share,
        no_room=average_room(patch_to_surface, room),
        clearances=lengths,
        sky_view_factor=np.minimum(sky.first.mean(axis=0), 1),
        far_ground_view_factor=np.minimum(far.first.mean(axis=0), 1),
        ground_albedo=request.ground_albedo if plan.far_ground else 0.0,
        diffuse_relative=diffuse.mean(axis=0),
        diffuse_relative_standard_error=standard_error(diffuse, photons, unreachable),
        visible_share=direct.visible_share,
        direct_reflected=direct.reflected,
        terrain=plan.terrain,
        direct_annual_standard_error=standard_error(direct.annual, direct.photons, unreachable),
        sources={
            name: SourceLight(
                view_factor=np.minimum(light.first.mean(axis=0), 1),
                relative=light.whole.mean(axis=0),
                standard_error=standard_error(light.whole, light.photon**2, unreachable),
            )
            for name, light in parts.items()
        },
        record=TraceRecord(
            request=request.as_dict(),
            effects=judge_effects(plan, measured),
            max_bounces=bounces,
            brightest_albedo=max(float(patches.albedo.max(initial=0)), request.ground_albedo),
            patches=len(patches),
            threads=run.threads,
            photons_per_source=run.per_replicate * PHOTON_REPLICATES,
            rays=sum(light.ray_count for light in traced.values()),
            photons={name: asdict(light.tally) for name, light in traced.items()},
            seconds=clock.seconds,
            processor_seconds=clock.processor_seconds,
            embree_thread_seconds=run.target.ray_scene.thread_seconds - traced_before,
            last_bounce_share_diffuse=sky.last,
            last_bounce_share_direct=direct.last,
            interrupted=note_interruption(direct.kept, len(suns)),
        ),
        **materials_of_surfaces(scene, prepared.materials),
    )


SOURCES = ("sky", "far ground", "suns")  # beside the traced parts of the sky


def prepare_run(prepared, request, progress):
    """What photons fall on, and the covered share of each patch.

    Returns
    -------
    Run
    covered_share : (p,) float32
    """
    scene, patches, threads = prepared.scene, prepared.patches, usable_threads(request.threads)
    ray_scene = prepared.plan.ray_scene or FacingScene(scene, patches, threads)
    ray_scene.canopy = prepared.canopy
    covered = find_cover(ray_scene, patches, patches.receives, threads)
    count = len(scene.surfaces)
    surface = np.where(scene.triangle_surface < 0, count, scene.triangle_surface)
    area = np.bincount(surface, patches.area, count + 1)[:-1]
    per_replicate = -(-request.samples * int(patches.receives.sum()) // PHOTON_REPLICATES)
    target = Target(ray_scene, patches, surface, count, covered, brdfs_of_triangles(scene, request, prepared.materials))
    return Run(target, area, per_replicate, threads, progress), covered.mean(axis=1, dtype=np.float32)


def trace_far_ground(run, box, plan, seed, bounces):
    """Light from the far ground, per radiosity; its arrival already counts as the first reflection."""
    if not plan.far_ground:
        return no_light(len(run.area))
    sources = [far_ground_source(box, seed)]
    if plan.terrain is not None:
        sources.append(terrain_source(box, seed, plan.terrain))
    light, *others = trace_sources(run, sources, bounces - 1)
    for other in others:
        light.add(other)
    return light


def trace_direct(run, lit, far, max_bounces, patch_to_surface, *, folder):
    """Visible share and reflected irradiance of the surfaces for every sun; if cancelled, for those that are done.

    Parameters
    ----------
    run : Run
    lit : SunsOnBox
    far : Light
        Of the far ground, which reflects the suns' light.
    max_bounces : int
    patch_to_surface : (n, p) sparse
        Averages patches over surfaces.
    folder : path-like or None
        As in `keep_matrix`.

    Returns
    -------
    Direct
    """
    box, suns, request = lit
    count, height = len(run.area), np.maximum(suns.direction[:, 2], 0) * request.ground_albedo
    sources = [sun_source(box, direction, index, request.seed) for index, direction in enumerate(suns.direction)]
    found = Direct(
        *(keep_matrix((count, len(suns)), folder) for _ in range(2)),
        annual=np.zeros((PHOTON_REPLICATES, count)),
        photons=np.zeros(count),
        kept=len(suns),
    )
    beyond_first = far.whole.mean(axis=0) - np.minimum(far.first.mean(axis=0), 1)
    done = 0
    try:
        for index, light in enumerate(trace_sources(run, sources, max_bounces)):
            towards = suns.direction[index : index + 1].astype(np.float32)
            unshaded = patch_to_surface @ projection_in_front(run.target.patches.normal, towards)[:, 0].astype(float)
            first = np.minimum(light.first.mean(axis=0), unshaded)
            column = slice(index, index + 1)
            share = np.divide(first, unshaded, out=np.zeros(len(first)), where=unshaded > 0)
            found.visible_share[:, column] = share[:, None]
            beyond = height[index] * beyond_first  # of the far ground, after its first arrival
            found.reflected[:, column] = (light.whole.mean(axis=0) - first + beyond)[:, None]
            found.annual += suns.weight[index] * light.whole
            found.photons += np.where(unshaded > 0, suns.weight[index] * light.photon, 0) ** 2
            found.last = max(found.last, light.last)
            found.ray_count += light.ray_count
            found.tally.add(light.tally)
            done = index + 1
    except CancelledError:
        found.kept = max((end for end in end_of_days(suns) if end <= done), default=0)
        if not found.kept:
            raise
        found.visible_share, found.reflected = (
            keep_columns(matrix, found.kept) for matrix in (found.visible_share, found.reflected)
        )
    found.annual += far.whole * (suns.weight[:done] @ height[:done])
    found.photons += (far.photon * (suns.weight[:done] @ height[:done])) ** 2
    if found.kept < len(suns):
        weight = suns.weight[:done].sum() or np.nan  # the sums have only these suns
        found.annual /= weight
        found.photons /= weight**2
    return found


PHOTON_REPLICATES = 16  # independent sets of photons of each source; their variance gives the standard error
PHOTONS_PER_TASK = 1 << 16


@dataclass
class Run:
    """Data shared by all sources."""

    target: Target
    area: np.ndarray  # (n,) float64 [m²], traced area of each surface
    per_replicate: int  # photons
    threads: int
    progress: Callable
    stage: str = "sky and far ground"
    total: int = 0  # photons of all sources of the stage
    done: int = 0

    def begin(self, stage, sources):
        """Start a stage with a number of sources."""
        self.stage, self.total, self.done = stage, sources * self.per_replicate * PHOTON_REPLICATES, 0
        if self.total:
            self.progress(self.stage, 0, self.total, "photons")


@dataclass
class Light:
    """Irradiance of n surfaces from one source."""

    first: np.ndarray  # (PHOTON_REPLICATES, n) float64
    reflected: np.ndarray  # (PHOTON_REPLICATES, n) float64
    photon: np.ndarray  # (n,) float64, contribution of a single photon
    last: float = 0.0  # share of the last bounce in the total
    ray_count: int = 0
    tally: Tally = field(default_factory=Tally)

    def add(self, other):
        """Add the light of an independent source."""
        self.first, self.reflected = self.first + other.first, self.reflected + other.reflected
        self.photon = np.hypot(self.photon, other.photon)
        self.ray_count += other.ray_count
        self.tally.add(other.tally)

    @property
    def whole(self):
        """Sum of first hits and reflections: (PHOTON_REPLICATES, n) float64."""
        return self.first + self.reflected


def trace_sources(run, sources, max_bounces):
    """Trace sources, each with the same number of photons.

    Parameters
    ----------
    run : Run
    sources : list of Source
    max_bounces : int

    Yields
    ------
    Light
        Of each source, in order.
    """
    count = run.per_replicate * PHOTON_REPLICATES
    ranges = [range(first, min(first + PHOTONS_PER_TASK, count)) for first in range(0, count, PHOTONS_PER_TASK)]
    tasks = ((source, numbers) for source in sources if source.power.any() for numbers in ranges)

    def follow(task):
        return follow_photons(run.target, *task, run.per_replicate, max_bounces)

    found = map_in_order(follow, tasks, run.threads)
    for source in sources:
        yield add_deposits(run, source, islice(found, len(ranges) if source.power.any() else 0), max_bounces)


def no_light(count):
    """Zero irradiance."""
    return Light(*np.zeros((2, PHOTON_REPLICATES, count)), np.zeros(count))


def add_deposits(run, source, found, max_bounces):
    """Irradiance from one source, from the deposits of its photons.

    Parameters
    ----------
    run : Run
    source : Source
    found : iterable of Deposits
    max_bounces : int

    Returns
    -------
    Light
    """
    light = no_light(len(run.area))
    arrived = last = 0.0
    for part in found:
        rows = slice(part.first_replicate, part.first_replicate + len(part.first))
        light.first[rows] += part.first
        light.reflected[rows] += part.reflected
        light.ray_count += part.ray_count
        light.tally.add(part.tally)
        arrived += part.arrived
        last += part.last
        run.done += int(part.tally.emitted)
        run.progress(run.stage, run.done, run.total, "photons")
    light.last = last / arrived if max_bounces and arrived else 0.0
    # Hits per area, relative to the photon density on an unshaded surface facing the source (Eq. 1 to 4).
    per_photon = source.power.sum() / max(run.per_replicate, 1) / np.where(run.area > 0, run.area, np.inf)
    light.first *= per_photon
    light.reflected *= per_photon
    light.photon = per_photon / PHOTON_REPLICATES
    return light


def standard_error(replicates, photons, unreachable):
    """Standard error of the mean of independent replicates.

    With few or no photons their variance is not reliable. The contribution of one more photon is added, which gives
    √(k + 1) instead of √k for k photons.

    Parameters
    ----------
    replicates : (PHOTON_REPLICATES, n) float64
    photons : (n,) float64
        Square of the contribution of one photon.
    unreachable : (n,) bool
        Surfaces that no photon can reach.

    Returns
    -------
    (n,) float64
    """
    return np.sqrt(replicates.var(axis=0, ddof=1) / len(replicates) + np.where(unreachable, 0, photons))
