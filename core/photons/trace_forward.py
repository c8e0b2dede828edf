"""From a scene and its suns to the Transfer: the forward estimator.

Photons start at sun, sky and far ground and leave their light where they arrive (Bredemeier et al., Eq. 1 to 4). They
are reflected at the very place that they meet, and what they leave is counted for whole surfaces: nothing is taken for
even over a patch, so what comes out has noise but no bias. Every source is followed through all reflections; the cost
is (suns + 2) · samples · patches photons, of at most 1 + max_bounces rays each.

Which share of a surface is covered is no matter of light: a few hemisphere rays tell it, as in gather.
"""

from dataclasses import asdict, dataclass, field

import numpy as np

from ..materials.read_albedo import brdfs_of_triangles, materials_of_surfaces
from ..patches.facing_scene import FacingScene
from ..progress import SUN_STAGE, CancelledError, Clock
from ..radiosity.measure_cover import find_cover
from ..request import check_request
from ..scene.check_scene import check_scene
from ..sun.check_suns import check_suns
from ..sun.keep_suns import end_of_days, keep_suns
from ..threads import usable_threads
from ..transfer.incidence import projection_in_front
from ..transfer.kept_matrix import keep_columns, keep_matrix
from ..transfer.prepare_scene import prepare_scene
from ..transfer.surface_means import area_means
from ..transfer.trace_record import TraceRecord, note_interruption
from ..transfer.transfer import Transfer
from .emit_photons import box_of_scene, far_ground_source, sky_source, sun_source
from .follow_photons import Tally, Target
from .trace_sources import PHOTON_REPLICATES, Run, no_light, trace_sources

WHOLE = 1 - 1e-6  # share that rounding may leave of a surface that is covered as a whole


@dataclass
class Direct:
    """Under each sun, per DNI."""

    visible_share: np.ndarray  # (n, s) float32
    reflected: np.ndarray  # (n, s) float32, without what the far ground reflects at first bounce
    annual: np.ndarray  # (PHOTON_REPLICATES, n) float64, all light weighted with the suns' weights
    photons: np.ndarray  # (n,) float64, sum of squares of what single photons bring to it
    kept: int  # of the suns; fewer than all where somebody interrupted
    last: float = 0.0  # share of the last bounce in all light, the largest of all suns
    ray_count: int = 0
    tally: Tally = field(default_factory=Tally)


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
        Shares end at 1. Of what chance gives a surface beyond that nothing is lost: `diffuse_relative` keeps it, and
        `direct_reflected` takes it in, so that sums stay unbiased. `settings` say what was decided and traced, and
        under `photons` where the light of sky, far ground and suns went. Whoever cancels after some suns (see
        `core.progress`) gets those that were traced as `suns`, and is told so by `interrupted`.

    Raises
    ------
    CancelledError
        It was cancelled before any sun was of use.
    InputError
        If a number, an array or a setting cannot be used: no ray is traced with it.
    """
    check_scene(scene)
    check_suns(suns)
    check_request(request)
    clock = Clock()
    prepared = prepared or prepare_scene(scene, request)
    traced, patches, plan = prepared.scene, prepared.patches, prepared.plan
    merge = area_means(traced.triangle_surface, patches.area, len(scene.surfaces))
    run, covered_share = prepare_run(prepared, request, progress)
    run.begin("sky and far ground", 1 + plan.far_ground)
    clock.lap("plan, tree and cover")

    box = box_of_scene(traced)
    (sky,) = trace_sources(run, [sky_source(*box, request.seed)], plan.max_bounces)
    far = trace_far_ground(run, box, plan, request.seed)
    clock.lap("sky and far ground")
    run.begin(SUN_STAGE, len(suns))
    direct = trace_direct(run, (box, suns, request), far, plan.max_bounces, merge, folder=folder)
    clock.lap("suns")
    diffuse = sky.whole + request.ground_albedo * far.whole
    photons = sky.photon**2 + (request.ground_albedo * far.photon) ** 2
    covered_share = merge @ covered_share
    unreachable = (covered_share > WHOLE) | (run.area == 0)
    return Transfer(
        surfaces=scene.surfaces,
        site=scene.site,
        suns=suns if direct.kept == len(suns) else keep_suns(suns, direct.kept),
        covered_share=covered_share,
        sky_view_factor=np.minimum(sky.first.mean(axis=0), 1),
        far_ground_view_factor=np.minimum(far.first.mean(axis=0), 1),
        ground_albedo=request.ground_albedo if plan.far_ground else 0.0,
        diffuse_relative=diffuse.mean(axis=0),
        diffuse_relative_standard_error=standard_error(diffuse, photons, unreachable),
        visible_share=direct.visible_share,
        direct_reflected=direct.reflected,
        direct_annual_standard_error=standard_error(direct.annual, direct.photons, unreachable),
        record=TraceRecord(
            request=request.as_dict(),
            effects=[asdict(effect) for effect in plan.effects],
            max_bounces=plan.max_bounces,
            brightest_albedo=max(float(patches.albedo.max(initial=0)), request.ground_albedo),
            patches=len(patches),
            threads=run.threads,
            photons_per_source=run.per_replicate * PHOTON_REPLICATES,
            rays=sky.ray_count + far.ray_count + direct.ray_count,
            photons={name: asdict(light.tally) for name, light in zip(SOURCES, (sky, far, direct), strict=True)},
            seconds=clock.seconds,
            embree_thread_seconds=run.target.ray_scene.thread_seconds,
            last_bounce_share_diffuse=sky.last,
            last_bounce_share_direct=direct.last,
            interrupted=note_interruption(direct.kept, len(suns)),
        ),
        **materials_of_surfaces(scene, prepared.materials),
    )


SOURCES = ("sky", "far ground", "suns")


def prepare_run(prepared, request, progress):
    """What photons fall on, and the covered share of each patch.

    Returns
    -------
    Run
    covered_share : (p,) float32
    """
    scene, patches, threads = prepared.scene, prepared.patches, usable_threads(request.threads)
    ray_scene = FacingScene(scene, patches, threads)
    covered_share, covered = find_cover(ray_scene, patches, threads)
    count = len(scene.surfaces)
    surface = np.where(scene.triangle_surface < 0, count, scene.triangle_surface)
    area = np.bincount(surface, patches.area, count + 1)[:-1]
    per_replicate = -(-request.samples * int(patches.receives.sum()) // PHOTON_REPLICATES)
    target = Target(ray_scene, patches, surface, count, covered, brdfs_of_triangles(scene, request, prepared.materials))
    return Run(target, area, per_replicate, threads, progress), covered_share


def trace_far_ground(run, box, plan, seed):
    """Light of the open ground beyond the scene, per radiosity; its arrival is the first reflection already."""
    if not plan.far_ground:
        return no_light(len(run.area))
    (light,) = trace_sources(run, [far_ground_source(*box, seed)], plan.max_bounces - 1)
    return light


def trace_direct(run, lit, far, max_bounces, merge, *, folder):
    """Visible share and reflected irradiance of the surfaces for every sun. Whoever cancels keeps those that are done.

    Parameters
    ----------
    run : Run
    lit : tuple of box, Suns and Request
    far : Light
        Of the far ground, which shines by the suns' light.
    max_bounces : int
    merge : (n, p) sparse
        Averages patches over their surface.
    folder : path-like or None
        As of `keep_matrix`.

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
            add_sun(run, suns, index, light, (merge, height[index] * beyond_first), found=found)
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
        weight = suns.weight[:done].sum() or np.nan  # the sums hold no more than these
        found.annual /= weight
        found.photons /= weight**2
    return found


def add_sun(run, suns, index, light, merge_and_beyond, *, found):
    """Add one sun to what was found.

    Parameters
    ----------
    run : Run
    suns : Suns
    index : int
        Which of them.
    light : Light
        Of it.
    merge_and_beyond : tuple of (n, p) sparse and (n,) float64
        Averages patches over their surface; what the sun's light on the far ground brings after its first arrival.
    found : Direct
        Written.
    """
    merge, beyond = merge_and_beyond
    aoi_projection = projection_in_front(run.target.patches.normal, suns.direction[index : index + 1].astype("f4"))
    unshaded = merge @ aoi_projection[:, 0].astype(float)
    first = np.minimum(light.first.mean(axis=0), unshaded)
    column = slice(index, index + 1)
    share = np.divide(first, unshaded, out=np.zeros(len(first)), where=unshaded > 0)
    found.visible_share[:, column] = share[:, None]
    found.reflected[:, column] = (light.whole.mean(axis=0) - first + beyond)[:, None]
    found.annual += suns.weight[index] * light.whole
    found.photons += np.where(unshaded > 0, suns.weight[index] * light.photon, 0) ** 2
    found.last = max(found.last, light.last)
    found.ray_count += light.ray_count
    found.tally.add(light.tally)


def standard_error(replicates, photons, unreachable):
    """Standard error of the mean of independent replicates.

    Where a few photons arrive, or none, their spread tells little: one more might have come. Its light counts as well,
    which takes √(k + 1) for √k photons.

    Parameters
    ----------
    replicates : (PHOTON_REPLICATES, n) float64
    photons : (n,) float64
        Square of what one photon brings.
    unreachable : (n,) bool
        Where none can arrive.

    Returns
    -------
    (n,) float64
    """
    return np.sqrt(replicates.var(axis=0, ddof=1) / len(replicates) + np.where(unreachable, 0, photons))
