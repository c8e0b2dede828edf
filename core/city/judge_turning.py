"""Decide which polygons to turn over, by rays from both of their sides.

A side of a polygon is *inside* if more than half of its rays hit backs of faces and at most one in
eight reaches the sky, the tracer's rule for covered points. Rays that escape downwards do not
count, since there is no ground yet. A polygon supports an orientation of its shell if by it the
back is inside, and the front is not and sees the sky.
"""

from dataclasses import dataclass

import numpy as np

from ..rays.ray_scene import RayScene
from ..rays.sample_points import additive_recurrence, cosine_direction
from .orient_shells import SURE_SHARE
from .polygons import measure_polygons, normals_of, plane_axes, triangulate

RAYS = 64  # from each side of a polygon
INSIDE = 0.5  # of the rays that do not escape downwards hit backs
SKY = 0.125  # of the rays reach the sky
GLIMPSE = 1 / 32  # of the rays must reach the sky for a front to be known to be outside


@dataclass
class _Views:
    """What is visible from the two sides of some polygons, (k, 2): the front as drawn first."""

    sky: np.ndarray  # share of the rays that reaches the sky
    down: np.ndarray  # share that escapes downwards
    backs_drawn: np.ndarray  # share that hits backs, with all polygons as drawn
    backs_turned: np.ndarray  # share that hits backs, with all candidates turned
    backs_opposite: np.ndarray  # the same with the shell of the tested polygon reversed


def judge_turning(shape, found, allowed):
    """Which of the polygons that their shells propose are to be turned over.

    - An open shell that faces up only, by at least two thirds of its area, is not turned because of
      its volume: a valley or a bowl has one, too.
    - A shell is turned as a whole only if rays support it, and hardly any support the way it is
      drawn.
    - In a shell that is drawn inconsistently, a polygon is turned if its own rays or its shell's
      support it; if nothing is inside, towards the sky.
    - A polygon is not turned if its front as drawn is outside and its back is inside; nor if it
      sees more of the sky as drawn, unless the rest of what it sees are the backs of its building;
      nor so that it would face inside.

    Parameters
    ----------
    shape : tuple
        points (m, 3) float64 [m], ring_start (r + 1,), polygon_start (n + 1,).
    found : Orientation
        Proposal of the shells.
    allowed : array, (n,) bool
        Polygons that may be turned at all.

    Returns
    -------
    proposed, turned : array, (n,) bool
    """
    # Upward sheets are spared first; without proposals there is nothing to trace.
    agree, wanted = _spare_upward_sheets(
        shape, found, found.flip & allowed, found.agree & ~found.doubtful & allowed
    )
    turned = np.zeros(len(wanted), bool)
    if not wanted.any():
        return wanted, turned
    shell = found.shell
    area, _ = measure_polygons(*shape)
    # Faces that may be turned, and the largest ones of their shells.
    members = np.flatnonzero(np.isin(shell, np.unique(shell[wanted])))
    order = members[np.lexsort((members, -area[members], shell[members]))]
    place = np.arange(len(order)) - np.searchsorted(shell[order], shell[order])
    # The 16 largest polygons of a shell are tested besides those that may be turned.
    tested = np.union1d(order[place < 16], np.flatnonzero(wanted))
    sides = trace_both_sides(shape, shell, tested, wanted)
    whole = np.bincount(shell, ~wanted)[shell[tested]] == 0  # every polygon of the shell would turn
    chosen = _decide(sides, (shell[tested], area[tested]), agree[tested], wanted[tested], whole)
    turned[tested[chosen]] = True
    return wanted, turned


def _spare_upward_sheets(shape, found, wanted, others, *, downward=-0.02):
    """Proposals that do not turn upward open sheets down: polygons that agree with them, and those
    that would turn.

    If the opposite of a proposal faces up only, and most of the sheet is drawn so, that is proposed
    instead: the `others` turn.
    """
    shell = found.shell
    # Which open shells face up only, against the proposal, and are mostly drawn so.
    area, normal = measure_polygons(*shape)
    count = shell.max(initial=-1) + 1
    height = np.where(found.agree, 1.0, -1.0) * normal[:, 2]  # of the normal as proposed
    # `downward`: vertical component of the normal, below which a polygon faces down.
    only_up = np.bincount(shell, -height < downward, count) == 0
    only_up &= np.bincount(shell, height < downward, count) > 0
    mostly = np.bincount(
        shell, np.where(found.agree, 0.0, area), count
    ) >= SURE_SHARE * np.bincount(shell, area, count)
    spared = (
        (only_up & mostly)[shell] & ~found.watertight & np.isin(shell, np.unique(shell[wanted]))
    )
    return np.where(spared, ~found.agree, found.agree), np.where(spared, others, wanted)


def _decide(sides, shells, agree, wanted, whole):
    """Which of the tested polygons are turned, (k,) bool."""
    # The proposed front, whether rays support it, and whether they support the drawing as it is.
    shell, area = shells
    proposed = np.where(agree, 0, 1)  # side of each polygon that is its front by the proposal
    support = _supports(sides, sides.backs_turned, proposed)
    right = _supports(sides, sides.backs_drawn, np.zeros(len(shell), int))
    drawn, turned = sides.sky.T
    # lit  drawn front sees more sky, and is not inside: it stays, as does what rays deny.
    inward, into = (sides.backs_turned > INSIDE * (1 - sides.down)).T
    lit = (drawn >= turned) & (((drawn > SKY) & ~inward) | ((drawn >= GLIMPSE) & into))
    contrary = _supports(sides, sides.backs_opposite, 1 - proposed) | (wanted & lit)
    count = shell.max() + 1
    # Votes of the shell for and against the proposal, by area and by its root.
    votes = [
        (np.bincount(shell, support * w, count), np.bincount(shell, contrary * w, count))
        for w in (area, area**0.5)
    ]
    # A quarter of the support, by area and by extent, may be for the opposite orientation.
    sure = np.all([(yes > 0) & (no <= 0.25 * yes) for yes, no in votes], axis=0)[shell]
    silent = (votes[0][0] + votes[0][1] == 0)[shell]
    mixed = ~whole & (support | (silent & (turned > drawn)))
    return wanted & ~right & ~lit & (sure | mixed)


def _supports(sides, backs, front):
    """Polygons whose back is inside and whose front, the side given by index, is outside: (k,)
    bool.
    """
    # A side is inside if more than half of what does not go down is backs and little is sky.
    inside = (backs > INSIDE * (1 - sides.down)) & (sides.sky <= SKY)
    rows = np.arange(len(front))
    return inside[rows, 1 - front] & ~inside[rows, front] & (sides.sky[rows, front] >= GLIMPSE)


def trace_both_sides(shape, shell, tested, wanted):
    """Trace rays from both sides of the tested polygons.

    Returns
    -------
    Views
    """
    # Triangles of all polygons near the origin, rounded to micrometres, so that the noise of large
    # coordinates has no effect; rays start from the triangles of tested polygons.
    places = np.round(shape[0] - shape[0].min(axis=0), 6)  # near zero
    triangles, owner = triangulate(places, *shape[1:])
    # (t, 3, 3) [m] and (t, 3) [m²]
    corners, doubled = (
        places[triangles],
        normals_of(places, triangles),
    )
    size = np.linalg.norm(doubled, axis=1)
    normal = doubled / size[:, None]
    start, point, direction = _start_rays((corners, normal, size), owner, tested)
    # Rays start 1 mm off their face, or 16 spacings of float32 if that is more.
    offset = max(1e-3, 16 * float(np.spacing(np.float32(np.abs(places).max()))))
    scene = RayScene(places, triangles)
    turn = np.where(wanted, -1.0, 1.0)[owner]
    # From the front as drawn and from the back: shares of sky, downwards, and backs as drawn, with
    # all candidates turned, and with the own shell the other way round.
    found_shares = np.empty((2, 5, len(tested)))
    for side, sign in enumerate((1.0, -1.0)):
        towards = sign * direction
        hit = scene.trace_closest(
            (point + sign * offset * normal[start]).astype(np.float32), towards.astype(np.float32)
        ).reshape(len(tested), RAYS)
        along = np.einsum("kd,kd->k", towards, normal[hit.reshape(-1)]).reshape(hit.shape)
        missed, own = hit < 0, shell[owner[hit]] == shell[tested][:, None]
        rises = (towards[:, 2] > 0).reshape(hit.shape)
        after = along * turn[hit]
        views = missed & rises, missed & ~rises, ~missed & (along > 0), ~missed & (after > 0)
        found_shares[side] = [
            view.mean(axis=1) for view in (*views, ~missed & (np.where(own, -after, after) > 0))
        ]
    return _Views(*found_shares.transpose(1, 2, 0))


def _start_rays(faces, owner, tested):
    """RAYS rays from each polygon tested: triangle (k·RAYS,), point (k·RAYS, 3) [m], direction
    (k·RAYS, 3) in front.
    """
    corners, normal, size = faces
    # Four numbers of a sequence for each ray: two for its place, two for its direction.
    one, other, height, turn = np.mod(additive_recurrence(RAYS, 4).T + 0.5, 1)
    # Choose triangles by area; the remainder of the same random number gives the place along one
    # edge.
    ends = np.cumsum(size)
    first, last = np.searchsorted(owner, tested), np.searchsorted(owner, tested, "right") - 1
    low = ends[first] - size[first]
    target = low[:, None] + one * (ends[last] - low)[:, None]  # (k, RAYS)
    start = np.clip(np.searchsorted(ends, target, "right"), first[:, None], last[:, None])
    # Evenly over the triangle: the root makes places as dense near a corner as elsewhere.
    along = np.sqrt(np.clip((target - ends[start] + size[start]) / size[start], 0, 1))
    weights = np.stack([1 - along, along * (1 - other), along * other], axis=-1)
    point = np.einsum("krc,krcd->krd", weights, corners[start]).reshape(-1, 3)
    # Directions by the cosine, in the frame of the triangle.
    axes = np.stack([*plane_axes(normal), normal], axis=1)  # (t, 3, 3)
    direction = np.einsum(
        "ar,krad->krd", np.stack(cosine_direction(height, turn)), axes[start]
    ).reshape(-1, 3)
    return start.reshape(-1), point, direction
