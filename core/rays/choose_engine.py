"""Choose how Embree is called: packets of rays if a self-test passes, else single rays."""

import functools
import os

import numpy as np

from ..settings.errors import InputError
from .embree_library import LibraryError
from .embree_packets import PacketTree
from .embree_rays import RayTree

TREES = {"packets": PacketTree, "rays": RayTree}
VARIABLE = "CITYPV_ENGINE"  # environment variable that forces one engine
PROOF_RAYS = 1000


def choose_engine():
    """Choose the engine of this process.

    Returns
    -------
    engine : str
        A key of `TREES`.
    reason : str

    Raises
    ------
    InputError
        The environment variable names an unknown engine, or packets where they do not work.
    """
    asked = os.environ.get(VARIABLE)
    if asked and asked not in TREES:
        raise InputError(VARIABLE, f"{asked!r} is not an engine", f"set it to {' or '.join(TREES)}, or unset it")
    if asked == "rays":
        return "rays", f"requested by {VARIABLE}"
    fault = fault_of_packets()
    if fault and asked:
        raise InputError(VARIABLE, f"packets do not work here: {fault}", "set it to rays, or unset it")
    return ("rays", f"no packets: {fault}") if fault else ("packets", "they agree with single rays on a test scene")


@functools.cache
def fault_of_packets():
    """Why packets cannot be used in this process, "" if they agree with single rays on a small test scene."""
    vertices, triangles, origins, directions = scene_of_proof()
    try:
        packets, rays = PacketTree(vertices, triangles), RayTree(vertices, triangles)
    except LibraryError as error:
        return str(error)
    for name in ("trace_places", "trace_closest"):
        found, true = (np.array(getattr(tree, name)(origins, directions)) for tree in (packets, rays))
        met = true[0] >= 0 if found.ndim == 2 else slice(None)
        if not np.allclose(found[..., met], true[..., met], atol=1e-5):
            return f"{name} differs from single rays"
    wanted = np.ones((len(origins) // 10, 3), bool)
    position = origins.reshape(-1, 10, 3)
    found, true = (tree.trace_shadow_rays(position, wanted, directions[:3]) for tree in (packets, rays))
    blocked = [tree.trace_blocked(origins, directions[:1]) for tree in (packets, rays)]
    if (found != true).any() or (blocked[0] != blocked[1]).any():
        return "shadows differ from those of single rays"
    return ""


def scene_of_proof():
    """Test scene: a few hundred random triangles in a box, and rays through them.

    Returns
    -------
    vertices : (v, 3) float32
    triangles : (t, 3) int32
    origins, directions : (PROOF_RAYS, 3) float32
    """
    generator = np.random.default_rng(1)
    middles = generator.uniform(-10, 10, (300, 1, 3))
    vertices = (middles + generator.normal(size=(300, 3, 3))).reshape(-1, 3).astype(np.float32)
    triangles = np.arange(900, dtype=np.int32).reshape(-1, 3)
    origins, directions = generator.normal(size=(2, PROOF_RAYS, 3)).astype(np.float32)
    return vertices, triangles, 5 * origins, directions
