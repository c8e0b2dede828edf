"""What clustering the suns costs: some patches looked at with the clustered suns and with every
hour's sun.
"""

from dataclasses import replace

import numpy as np

from ..city.canopy import LeafyScene
from ..settings.errors import InputError
from ..settings.threads import usable_threads
from .prepare_scene import prepare_scene
from .shadow_points import points_above
from .sun_blocks import block_of_suns
from .sun_visibility import SunWatch, sun_visibility


def trace_sun_samples(scene, transfer, ways, request, progress, *, prepared=None, count=500):
    """First light of patches of eligible surfaces under several choices of suns.

    Parameters
    ----------
    scene : Scene
    transfer : Transfer
        Traced from that scene.
    ways : list of Suns
    request : Request
    progress : callable
    prepared : PreparedScene, optional
        Of the scene, where it is known already.
    count : int
        Patches, at most.

    Returns
    -------
    list of Transfer
        For each choice: each patch as a surface, looked at from the same points, without
        reflections; the diffuse part is the surface's in `transfer`. Without rows where no surface
        is eligible.

    Raises
    ------
    InputError
        The scene, the suns or a setting cannot be used, or the Transfer belongs to another scene.
    """
    # Scene, settings and suns are checked before rays are sent.
    scene.check()
    request.check()
    for suns in ways:
        suns.check()
    if len(transfer.surfaces) != len(scene.surfaces):
        raise InputError(
            "transfer",
            f"{len(transfer.surfaces)} surfaces for a scene of {len(scene.surfaces)}",
            "give that of the same scene",
        )
    # Patches of eligible surfaces, drawn by area, are each taken as a surface of their own.
    prepared = prepared or prepare_scene(scene, request)
    patches = prepared.patches
    chosen = _draw_patches(prepared.scene, patches.area, request.seed, count)
    few = patches.take(chosen)
    # Their rays meet the whole city, with the crowns of its trees.
    if prepared.plan.ray_scene:  # with the crowns of this plan: another one may have used it last
        ray_scene = prepared.build_tree(request).plan.ray_scene
    else:
        ray_scene = LeafyScene(scene.vertices, scene.triangles, prepared.canopy)
    own = replace(transfer, error_parts=None, bare=None).take(
        prepared.scene.triangle_surface[chosen]
    )
    own = replace(own, surfaces=replace(own.surfaces, area=patches.area[chosen]))
    transfers = []
    # Equal points look at the suns of each choice; light is what reaches them without reflections.
    for number, suns in enumerate(ways, start=1):
        stage = f"error check {number} of {len(ways)}"
        if len(few):
            progress(stage, 0, 1, "rays")
        watch = SunWatch(
            ray_scene,
            few,
            few.receives,
            np.zeros(len(few), bool),
            np.zeros((len(few), 1), bool),
            points_above(request.shadow_samples),
            threads=usable_threads(request.threads),
        )

        def report(share, rays, stage=stage):
            progress(stage, rays, rays / share, "rays")

        light, *_ = sun_visibility(watch, block_of_suns(suns, slice(None)), report=report)
        dark = np.zeros_like(light.visible_share)
        seen = {"visible_share": light.visible_share, "direct_reflected": dark}
        transfers.append(replace(own, suns=suns, **seen, string_loss=None))
    return transfers


def _draw_patches(scene, area, seed, count):
    """Patches of eligible surfaces, drawn by area, or all where there are no more: (k,) int,
    ascending.
    """
    # The generated ground's -1 takes the last.
    eligible = np.append(scene.surfaces.eligible, False)[scene.triangle_surface]
    members = np.flatnonzero(eligible & (area > 0))
    if len(members) <= count:
        return members
    share = area[members] / area[members].sum()
    generator = np.random.default_rng(seed)
    return np.sort(generator.choice(members, count, replace=False, p=share))
