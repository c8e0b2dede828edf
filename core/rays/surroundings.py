"""What rays from places on faces meet, and whether a place lies inside something.

     sky       sky       A ray ends in the sky, below the horizon, at the front of a face, or at a
       ↖ front ↗         back, which only what lies inside something sees. From a front it may go on:
 ┌──────┐←──┐            what it reaches without crossing a face is inside if the place is. In a
 │ back │   │ place      court it leaves; in a closed room, all of fronts, it never does.
 └──────┘───┴──────

Models are open shells: one ray proves nothing. So several are asked, and `lies_inside` judges what
they met. Four rules take theirs from here, each with the shares and the rays that its question
needs:

- Cover (`patches.find_covered`): rays from the front of a place go on from fronts; it is inside if
  more than half of them end at backs.
- Turning (`city.judge_turning`): first hits from both sides of a polygon, since what is met may
  itself be drawn inside out.
- Sheets (`city.find_sheets`): first hits from both sides, two fifths at backs enclose (of
  a vault 0.36 do), and light that comes from the sky by way of any side, since all may be sheets.
- Hanging floors (`city.find_ground`): straight down, since they lie close above what carries them.
"""

from typing import NamedTuple

import numpy as np

from ..settings.threads import map_in_order, usable_threads
from .faces import Fate
from .random_numbers import GOLDEN, mix, uniform_of
from .ray_scene import HitPlaces
from .sample_points import additive_recurrence, barycentric_of_square, cosine_direction

RAYS = 8  # from each place that may lie inside something
STRAY = 1 / 8  # of the rays may reach the sky, through a hole, from inside an open shell


class Met(NamedTuple):
    """What m rays meet."""

    places: HitPlaces
    fate: np.ndarray  # (m,) uint8: SKY, FAR_GROUND, FRONT or BACK
    behind: np.ndarray  # (m,) bool: the ray came to the side that its face does not face


def send(trace, faces, places, local, side=1.0, *, ahead=0.0):
    """What rays from places on faces meet.

    Parameters
    ----------
    trace : callable
        `trace_places` or `trace_as_drawn` of a RayScene.
    faces : Faces
        All triangles of that scene.
    places, local, side
        As of `Faces.leave`.
    ahead : (m, 3) float32 [m], optional
        From each place to where its ray starts.

    Returns
    -------
    Met
        m.
    """
    origins, directions = faces.leave(places, local, side)
    hits = trace(origins + np.float32(ahead), directions)
    return Met(hits, *faces.classify(hits.triangle, directions))


def _along_faces(u, v):
    """Directions along a face with an even logarithm of their cosine to its normal, of random
    numbers in [0, 1): three (m,) float32.

    By the cosine law a ray would leave a deep gap after as many turns as the square of its depth
    over its width. Whether rays can leave does not depend on the law of their directions; by this
    one a ray is as likely to go from one to two widths of the gap as from a hundred to two hundred.
    """
    # The flattest have a cosine of 0.001.
    height, angle = np.float32(1e-3) ** u, np.float32(2 * np.pi) * v
    along = np.sqrt(1 - height * height)
    return along * np.cos(angle), along * np.sin(angle), height


def follow(trace, faces, rays, ends, *, turns=32, as_light=False, ahead=0.0):
    """Rays go on from what they met, until they end at a back or outside, at most so many times.

    Parameters
    ----------
    trace, faces
        As of `send`.
    rays : tuple of HitPlaces, (r,) float or float, (r,) int and (r,) uint64
        Where they start, on which side, the point that each belongs to, and keys of random numbers.
    ends : (3, k) int
        For each point, how many end at backs, in the sky and below the horizon is added to the
        rows. From points that are known to be outside none is followed any more.
    turns : int
    as_light : bool
        Rays go on by the cosine law, from backs, too, on the side that they come to, and all are
        followed: else by `_along_faces`.
    ahead : (r, 3) float32 [m], optional
        From each place to where its ray starts at first.
    """
    law = cosine_direction if as_light else _along_faces
    places, side, point, keys = rays
    for turn in range(turns):
        local = law(*uniform_of(keys[:, None], np.arange(2 * turn + 1, 2 * turn + 3)).T)
        places, fate, behind = send(trace, faces, places, local, side, ahead=ahead)
        for number, kind in enumerate((Fate.BACK, Fate.SKY, Fate.FAR_GROUND)):
            ends[number] += np.bincount(point[fate == kind], minlength=ends.shape[1])
        # Ended at a back or outside; the others go on, but not for points in the open.
        closed = (fate == Fate.FRONT) & (ends[1] <= STRAY * RAYS)[point]
        on = np.flatnonzero(places.triangle >= 0 if as_light else closed)
        if not len(on):
            break
        places, point, keys, ahead = places.take(on), point[on], keys[on], 0.0
        side = np.where(behind[on], np.float32(-1), np.float32(1))


def lies_inside(ends, rays=RAYS, *, least=0.5, closed=True):
    """Whether places, or the sides of faces, lie inside something.

    Parameters
    ----------
    ends : (3, k) float
        How many of the rays end at backs, in the sky and below the horizon.
    rays : float
        All of each place.
    least : float
        Of those that do not leave below the horizon, more end at backs.
    closed : bool
        A place from which none leaves is inside, whatever its rays met: so for rays that went on.

    Returns
    -------
    (k,) bool
    """
    backs, skies, below = ends
    inside = (backs > least * (rays - below)) & (skies <= STRAY * rays)
    return inside | (skies + below == 0) if closed else inside


def lie_inside(ray_scene, faces, places, keys, ahead=0.0, *, turns=32):
    """Whether some places on faces lie inside something, by rays from each that go on from fronts:
    (k,) bool.

    Parameters
    ----------
    ray_scene : RayScene
    faces : Faces
    places : HitPlaces
        k.
    keys : (k,) uint64
        Of random numbers.
    ahead : float [m]
        Along the normal from the places to where their rays begin.
    turns : int
        As of `follow`.
    """
    point, ends = np.repeat(np.arange(len(keys)), RAYS), np.zeros((3, len(keys)), np.int64)
    step = (ahead * faces.normal[places.triangle[point]]).astype(np.float32)
    rays = places.take(point), np.float32(1), point, number_rays(keys).ravel()
    follow(ray_scene.trace_places, faces, rays, ends, ahead=step, turns=turns)
    return lies_inside(ends)


def number_rays(keys, count=RAYS):
    """Keys of random numbers of the rays of some points, (k,) uint64: (k, count) uint64."""
    return mix(keys[:, None] + np.arange(1, count + 1).astype(np.uint64) * GOLDEN)


def ask_sides(ray_scene, faces, rows, side, count, *, tally, report_share=None):
    """What rays by the cosine law from one side of some faces meet.

    Every face sends the same rays in its own frame, so that the answer does not depend on its name
    or index, and more rays begin with the same ones as fewer.

    Parameters
    ----------
    ray_scene : RayScene
    faces : Faces
    rows : (r,) int
    side : {-1, 1}
    count : int
        Rays from each face.
    tally : callable
        Called as tally(rows, met) with some rows, s, and Met of s · count, face by face; returns
        (..., s).
    report_share : callable, optional
        Called as report_share(share) with the share that is done, 0 to 1.

    Returns
    -------
    (..., r)
        Of all tallies.
    """
    u, v, *angles = additive_recurrence(count, 4).T
    weights, local = barycentric_of_square(u, v), cosine_direction(*angles)
    # Faces in portions small enough for the cache, spread over the threads.
    threads = usable_threads()
    step = max(1, min((1 << 13) // count, -(-len(rows) // threads)))
    tasks = [rows[first : first + step] for first in range(0, max(len(rows), 1), step)]

    def ask(some):
        same = [np.tile(part, len(some)) for part in (*weights, *local)]
        places = HitPlaces(np.repeat(some, count), *same[:2])
        return tally(some, send(ray_scene.trace_places, faces, places, same[2:], side))

    answers = []
    for answer in map_in_order(ask, tasks, threads):
        answers.append(answer)
        if report_share:
            report_share(len(answers) / len(tasks))
    return np.concatenate(answers, axis=-1)
