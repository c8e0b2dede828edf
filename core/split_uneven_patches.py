"""Split the patches whose uneven light matters, until reflections are as exact as is asked; pilots tell which.

A patch hands on its light from 16 cells a quarter as long. The pilots, with 4 cells half as long, measure for each
patch what the step from it to its cells changes in the light of all eligible surfaces. The error of such steps is at
most in proportion to the length of a cell: half of this change is left with 16 cells, and half of that when the patch
is split into four.

Halved h times, a patch makes 4^h of itself and keeps e/2^h of its error e. Another halving takes off e/2^(h+1) and
costs 3·4^h patches. The error is least for so many patches where this ratio is the same for all: 8^h goes with e.
"""

from dataclasses import replace

import numpy as np

from .radiosity.measure_unevenness import measure_unevenness
from .scene.refine import refine_triangles

COARSEST = 25.0  # [m] longest edge of patches that are not split
FINEST = 2.0  # [m] patches with shorter edges stay whole
SUNS_WORSE = 1.25  # how much more uneven the light of suns is than that of the sky
NO_HALVINGS = 0, 0
STEPS = 20  # of halving the range in which the threshold is sought
WIDE = 1e-4  # the smallest threshold, as a share of the largest error of a patch


def split_uneven_patches(scene, request, progress):
    """A scene whose reflected light is changed by no more than asked by light that is uneven within its patches.

    Parameters
    ----------
    scene : Scene
        With patches of at most COARSEST.
    request : Request
        `patch_error` is what is asked for, in percent of the reflected light of all eligible surfaces.
    progress : callable
        See `core.progress`.

    Returns
    -------
    scene : Scene
        The same with more triangles.
    account : dict
        What was done: error in percent that is `asked`, `before` and `expected`; patches `given`, `split` and
        `made`; `shortest` [m].
    """
    left = 100 * SUNS_WORSE / 2 * measure_unevenness(scene, request, progress)
    longest = measure_edges(scene)
    halvings, expected = choose_halvings(left, longest, request.patch_error)
    finer = refine_patches(scene, np.maximum(longest / 2.0**halvings, FINEST))
    account = {
        "asked": request.patch_error,
        "before": judge_choice(left, NO_HALVINGS),
        "expected": expected,
        "given": len(scene.triangles),
        "split": int((halvings > 0).sum()),
        "made": len(finer.triangles),
        "shortest": FINEST,
    }
    return finer, account


def choose_halvings(left, longest, asked):
    """How often the edges of each patch are halved: as little as leaves no more than the error that is asked.

    Parameters
    ----------
    left : (t, 2) float
        Error of each patch, measured by two independent pilots.
    longest : (t,) float [m]
        Longest edges.
    asked : float
        All errors together, in the unit of `left`.

    Returns
    -------
    halvings : (t,) int
    expected : float
        Error that is left. More than was asked where patches become too small, or are too many for the pilots' rays.
    """
    most = np.floor(np.log2(np.maximum(longest / FINEST, 1))).astype(int)
    expected = judge_choice(left, NO_HALVINGS)
    if expected <= asked:
        return np.zeros_like(most), expected
    largest = max(float(np.abs(left).max(initial=0)), np.finfo(float).tiny)
    low, high = np.log(largest * WIDE), np.log(largest)
    for _ in range(STEPS):
        middle = (low + high) / 2
        meets = judge_choice(left, [halve_above(one, np.exp(middle), most) for one in left.T]) <= asked
        low, high = (middle, high) if meets else (low, middle)
    expected = judge_choice(left, [halve_above(one, np.exp(low), most) for one in left.T])
    return halve_above(left.mean(axis=1), np.exp(low), most), expected


def judge_choice(left, chosen):
    """Error that is left by the choice of the one pilot, measured by the other; the mean of both ways.

    Errors of opposite sign may cancel in the sum of all surfaces, but not where each is received. So the sum of their
    sizes counts, where the pilots agree about the sign; noise does not agree with itself and drops out. Where signs of
    small errors are lost in noise the plain sum is larger, and counts.

    Parameters
    ----------
    left : (t, 2) float
    chosen : two of int or (t,) int
        Halvings by each pilot.

    Returns
    -------
    float
    """
    found = []
    for one, other, halvings in ((0, 1, chosen[0]), (1, 0, chosen[1])):
        remains = left[:, other] / 2.0**halvings
        found.append(max(abs(remains.sum()), (np.sign(left[:, one]) * remains).sum()))
    return float(np.mean(found))


def halve_above(errors, threshold, most):
    """Halvings of each patch so that 8^h reaches the size of its error over the threshold: (t,) int."""
    wanted = np.ceil(np.log2(np.maximum(np.abs(errors) / threshold, 1)) / 3)
    return np.minimum(wanted, most).astype(int)


def measure_edges(scene):
    """Longest edge of each triangle: (t,) float64 [m]."""
    corners = np.asarray(scene.vertices, float)[scene.triangles]
    return np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1, initial=0)


def refine_patches(scene, patch_size):
    """The scene with edges no longer than each triangle's own size.

    Parameters
    ----------
    scene : Scene
    patch_size : (t,) float [m]

    Returns
    -------
    Scene
    """
    vertices, triangles, parent = refine_triangles(scene.vertices, scene.triangles, patch_size)
    carried = {name: getattr(scene, name)[parent] for name in ("triangle_surface", "footprint", "closure")}
    return replace(scene, vertices=vertices, triangles=triangles.astype(np.int32), **carried)
