"""Decide which polygons to turn over, by rays from both of their sides.

A side of a polygon is *inside* as places are that are covered (`rays.surroundings`), but rays that
escape downwards do not count, since there is no ground yet, and none goes on, since what it meets
may be inside out itself. A polygon supports an orientation of its shell if by it the back is
inside, and the front is not and sees the sky.
"""

from dataclasses import dataclass

import numpy as np

from ..rays import surroundings
from ..rays.faces import Faces, Fate
from ..rays.ray_scene import RayScene
from ..settings.tolerances import GEOMETRY
from .orient_shells import SURE_SHARE
from .polygons import measure_polygons, triangulate


@dataclass
class _Views:
    """What is visible from the two sides of some polygons, (k, 2): the front as drawn first."""

    sky: np.ndarray  # share of the rays that reaches the sky
    down: np.ndarray  # share that escapes downwards
    backs_drawn: np.ndarray  # share that hits backs, with all polygons as drawn
    backs_turned: np.ndarray  # share that hits backs, with all candidates turned
    backs_opposite: np.ndarray  # the same with the shell of the tested polygon reversed

    @property
    def glimpses(self):
        """Sides that see enough of the sky for a front to be known to be outside: (k, 2) bool."""
        return self.sky >= 1 / 32


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
    sides = _trace_both_sides(shape, shell, tested, wanted)
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
    inward, into = (sides.backs_turned > 0.5 * (1 - sides.down)).T
    lit = (drawn >= turned) & (
        ((drawn > surroundings.STRAY) & ~inward) | (sides.glimpses[:, 0] & into)
    )
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
    inside = surroundings.lies_inside((backs, sides.sky, sides.down), 1, closed=False)
    rows = np.arange(len(front))
    return inside[rows, 1 - front] & ~inside[rows, front] & sides.glimpses[rows, front]


def _trace_both_sides(shape, shell, tested, wanted, *, rays=64):
    """What so many rays from each triangle, on both sides of the tested polygons, meet: _Views, as
    shares of the rays of each polygon, weighted by the area of its triangles.
    """
    # `shell` is the number of the shell of each polygon, `wanted` whether it is a candidate.
    # Triangles of all polygons near the origin, rounded to micrometres, so that the noise of large
    # coordinates has no effect.
    places = np.round(shape[0] - shape[0].min(axis=0), 6)
    triangles, owner = triangulate(places, *shape[1:])
    nothing = np.zeros(len(triangles), bool)
    faces, area = Faces.of_triangles(places[triangles], nothing, nothing - np.int32(1))
    # Rays start beyond a second face that is drawn in the same place.
    faces.offset = np.maximum(faces.offset, np.float32(GEOMETRY.corner))
    rows = np.flatnonzero(np.isin(owner, tested) & (area > 0))
    place = np.searchsorted(tested, owner[rows])
    whole = np.bincount(place, area[rows], len(tested))

    def tally(some, met):
        # Shares of sky, downwards, and backs as drawn, with all candidates turned, and with the own
        # shell the other way round.
        hit = met.places.triangle
        missed, own = hit < 0, shell[owner[hit]] == np.repeat(shell[owner[some]], rays)
        after = met.behind != wanted[owner[hit]]
        views = (
            met.fate == Fate.SKY,
            met.fate == Fate.FAR_GROUND,
            met.behind,
            ~missed & after,
            ~missed & (after != own),
        )
        return np.stack(views).reshape(len(views), -1, rays).mean(axis=2)

    scene, sides = RayScene(places, triangles), []
    for side in (1, -1):
        shares = surroundings.ask_sides(scene, faces, rows, side, rays, tally=tally)
        sums = [np.bincount(place, area[rows] * share, len(tested)) for share in shares]
        sides.append(np.divide(sums, whole, out=np.zeros((5, len(tested))), where=whole > 0))
    return _Views(*np.stack(sides, axis=-1))
