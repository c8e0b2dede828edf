"""What the rays of all patches of a city meet: all rays of receivers, a quarter of them of all
other patches.

Each patch sends rays, also where no other ray meets it in this round: later rounds meet it, and
take its light.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from ..city.scene import Surfaces
from ..effects.closed_form import ground_view_of_tilt, sky_view_of_tilt
from ..effects.effect import TracePlan
from ..effects.rays import fewer_rays
from ..modules.lay_modules import ModuleLayout
from ..patches.read_albedo import brdfs_of_triangles
from ..rays.sample_points import HEMISPHERE_REPLICATES
from ..settings.request import Request
from ..settings.threads import usable_threads
from .form_factors import FEWEST_RAYS, LARGEST_KEY
from .measure_cover import share_without_room
from .shadow_points import count_elements, points_above
from .solve_radiosity import element_factors
from .sun_matrix import area_means
from .trace_hemisphere import trace_rows
from .traced import SKY_DOME, RayCity, Traced

STAGE = "sky and reflections"


@dataclass(kw_only=True)
class GatherContext(RayCity):
    """What all stages of one run share; `patches` have the albedo of diffuse reflection only."""

    plan: TracePlan
    request: Request
    surfaces: Surfaces
    ground_albedo: float  # of the open ground around the scene
    owner: np.ndarray  # (p,) int, surface of each patch; -1: generated ground
    patch_to_surface: sparse.csr_matrix  # (n, p), averages patches over their surface
    eligible_area: np.ndarray  # (n,) float64 [m²], 0 for surfaces that are not eligible
    progress: Callable
    rounds: bool = False  # whether what further rounds need is kept
    editable: bool = False  # whether what an edit of the city needs is kept
    bounces: int = 0  # number of reflections, of all light
    taken: tuple | None = None  # of `taken_parts.find_taken`, where it is known already
    layout: ModuleLayout | None = None  # modules, where shade moves over their strings

    @property
    def keeps(self):
        """Whether what rays met is kept after the run."""
        return self.rounds or self.editable

    @property
    def knows_strings(self):
        """Whether it is known what strings lose at each sun."""
        return self.layout is not None or self.plan.string_shade is False

    @property
    def points(self):
        """Shadow points of each patch, a power of two."""
        return points_above(self.request.shadow_samples)

    @property
    def full(self):
        """Patches that send all rays: (p,) bool."""
        receives, wanted = self.patches.receives, self.plan.receivers
        return receives if wanted is None else receives & wanted

    def dark_share(self, traced):
        """Share of each patch on which no light counts, covered or left out: (p,) float32."""
        if self.left_out is None:
            return traced.covered_share
        return (
            traced.covered_share + share_without_room(self.left_out[:, None], traced.covered)[:, 0]
        )

    @property
    def known(self):
        """Patches that see the sky in closed form: (p,) bool."""
        return self.plan.unobstructed & self.patches.receives


def prepare_gather(prepared, request, progress):
    """What the stages of a run share.

    Parameters
    ----------
    prepared : PreparedScene
    request : Request
    progress : callable
        See `core.settings.progress`.

    Returns
    -------
    GatherContext
    """
    # Mirrors and glass reflect by photons, so they are black here.
    scene, patches, plan = prepared.scene, prepared.patches, prepared.plan
    # they reflect, but not by Lambert's law
    others = brdfs_of_triangles(scene, request, prepared.materials).index >= 0
    if others.any():
        patches = replace(patches, albedo=np.where(others, np.float32(0), patches.albedo))
    # Light of a patch is resolved by elements only where it is passed on.
    elements = count_elements(points_above(request.shadow_samples)) if plan.reflections else 1
    # Starts of rays are told apart where keys have room for them and enough rays start in each
    # element.
    resolved = len(patches) * elements**2 * HEMISPHERE_REPLICATES <= LARGEST_KEY + 1
    resolved = resolved and request.samples >= FEWEST_RAYS * elements
    # All else follows from the prepared scene, the plan and the request. Reflections are 0 where
    # their number is chosen later, too.
    return GatherContext(
        ray_scene=prepared.build_tree(request).plan.ray_scene,
        patches=patches,
        threads=usable_threads(request.threads),
        reflections=plan.reflections,
        elements=elements,
        start_elements=elements if resolved else 1,
        terrain=plan.terrain,
        sources=plan.sources,
        rays_share=plan.rays_share,
        plan=plan,
        request=request,
        surfaces=scene.surfaces,
        ground_albedo=scene.ground_albedo,
        owner=scene.triangle_surface,
        patch_to_surface=area_means(scene.triangle_surface, patches.area, len(scene.surfaces)),
        eligible_area=np.where(scene.surfaces.eligible, scene.surfaces.area, 0.0),
        progress=progress,
        rounds=prepared.rounds,
        editable=prepared.editable,
        bounces=plan.max_bounces or prepared.bounces or 0,
    )


def trace_all(context):
    """What all patches see of sky, far ground and each other, by as many rays as the plan gives to
    each.

    List of Traced, one for each state of trees.
    """
    # Counts of rays in multiples of the replicates, all of them or fewer.
    patches, plan, samples = context.patches, context.plan, context.request.samples
    every, fewer = (
        -(-count // HEMISPHERE_REPLICATES) * HEMISPHERE_REPLICATES
        for count in (samples, fewer_rays(samples))
    )
    # Patches that see the sky in closed form send no rays.
    sends = patches.receives & ~context.known
    traced_states = [Traced.empty(context) for _ in range(context.ray_scene.states)]
    full = sends & context.full
    # Patches that turn out to be covered are counted as if they were traced.
    most, done = every * int(full.sum()) + fewer * int((sends & ~full).sum()), 0

    def trace(chosen, count):
        nonlocal done
        for one in traced_states:
            one.samples[chosen] = count
        for parts in trace_rows(context, np.flatnonzero(chosen), count):
            for one, part in zip(traced_states, parts, strict=True):
                one.put(part)
            done += count * (len(parts[0].rows) + len(parts[0].enclosed_rows))
            context.progress(STAGE, done, most, "rays")

    # Patches that need all rays first, then those for which fewer are enough.
    if most:
        context.progress(STAGE, 0, most, "rays")
    trace(full, every)
    trace(sends & ~full, fewer)
    if done < most:
        context.progress(STAGE, most, most, "rays")
    # Patches in the open get their light by closed forms; then factors of reflection follow.
    for one in traced_states:
        fill_closed_forms(context, one)
        if plan.reflections:
            one.factor = element_factors(context, one)
        # What only further rounds and edits need is dropped.
        if not context.keeps:
            one.element_far_ground = one.open_share = None
    return traced_states


def ask_samples(context):
    """Hemisphere rays that the plan asks of each patch: (p,) int32; 0: none."""
    samples = context.request.samples
    every, fewer = (
        -(-count // HEMISPHERE_REPLICATES) * HEMISPHERE_REPLICATES
        for count in (samples, fewer_rays(samples))
    )
    sends = context.patches.receives & ~context.known
    return np.where(sends, np.where(context.full, every, fewer), 0).astype(np.int32)


def fill_closed_forms(context, traced):
    """Write what patches with nothing in front of them see; patches that receive nothing count as
    covered.
    """
    patches, plan, known = context.patches, context.plan, context.known
    normal = patches.normal[known]
    # Share of the sky, and of each source, above distant terrain.
    shares = {SKY_DOME: sky_view_of_tilt(normal, plan.terrain)}
    shares |= {
        source.name: source.unshaded(normal) * source.seen(normal, plan.terrain)
        for source in context.sources
    }
    for name, share in shares.items():
        traced.first[name].light[known] = traced.first[name].element[known] = share[:, None]
    # Share of the ground below it.
    far_ground = ground_view_of_tilt(normal, plan.terrain)[:, None]
    traced.far_ground[known] = far_ground
    traced.element_far_ground[known] = far_ground / context.elements
    traced.covered[~patches.receives] = True
    if not plan.far_ground:
        traced.far_ground[:] = traced.element_far_ground[:] = 0
