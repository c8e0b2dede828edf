"""Coincident faces: a ray hits the one that faces it, and of several such the first.

  light                 Models draw thin objects, such as a roof or a canopy, as two faces in one
                        place, and
    ↘                   some faces twice. A ray may hit any of them. The hit is assigned to the face
                        whose
═══════↑═  front        front is towards the ray; the opposite one is the other side of the same sheet.
═══════↓═  back

Light does not reach the fronts of party walls, which face into a neighbour's house. To a ray, a
roof drawn from both sides and a party wall are the same: a back and a front in one place. They
differ in what is in front of the front. Rays from the middle of the overlap of the two faces find
out.
"""

import functools

import numpy as np
from numba import njit

from ..city.canopy import LeafyScene
from ..rays.find_coincident import find_coincident
from ..rays.random_numbers import mix
from ..rays.ray_scene import HitPlaces
from ..rays.surroundings import lie_inside
from ..settings.threads import map_in_order
from .blocking_faces import merge_pieces


class FacingScene(LeafyScene):
    """Triangles of a scene for tracing rays, with hits on coincident faces assigned to fronts.

    Parameters
    ----------
    scene : Scene
    patches : Patches
        Of this scene.
    threads : int
    """

    def __init__(self, scene, patches, threads=1):
        # Rays hit a sheet, not its back: triangles without area are hit by none.
        backs = np.zeros(len(patches), bool) if scene.back_of is None else scene.back_of >= 0
        # Backs of sheets are shrunk to a point.
        triangles = np.where(backs[:, None], scene.triangles[:, :1], scene.triangles)
        super().__init__(scene.vertices, triangles)
        # Of shadow rays nobody asks which piece of a face they meet.
        self._drawn = scene.vertices, triangles, scene.triangle_surface, patches.offset
        corners = np.asarray(scene.vertices, float)[triangles]
        # Pairs in one place, without fronts that light does not reach.
        self.coincident = find_coincident(corners, patches.offset, threads)
        self._other_side = patches.other_side if backs.any() else None
        self._kinds, self._none = (patches.facing, patches.receives), np.zeros(len(patches), bool)
        if len(self.coincident):
            self.coincident = _drop_hidden(self, patches, self.coincident, threads)

    @functools.cached_property
    def _shadow_tree(self):
        vertices, blockers = self._drawn[0], merge_pieces(*self._drawn)
        return type(self._tree)(vertices.astype(np.float32), blockers.astype(np.int32))

    def trace_places(self, ray_origins, ray_directions):
        """As of `RayScene`; a hit on the back of a face with a coincident front is assigned to the
        front.
        """
        ray_directions = np.asfortranarray(ray_directions, np.float32)
        # The tracer meets any of the faces in one place; the hit moves to the one that light
        # reaches.
        places = super().trace_places(ray_origins, ray_directions)
        if len(self.coincident):
            _turn_to_fronts(
                tuple(vars(self.coincident).values()), self._kinds, ray_directions.T, tuple(places)
            )
        if self._other_side is not None:
            _turn_sheets(self._other_side, self._kinds[0], ray_directions.T, tuple(places))
        return places

    def trace_as_drawn(self, ray_origins, ray_directions):
        """As of `RayScene`; of several coincident faces the first is hit, whichever way
        it faces.
        """
        ray_directions = np.asfortranarray(ray_directions, np.float32)
        places = super().trace_places(ray_origins, ray_directions)
        if len(self.coincident):
            kinds = self._kinds[0], self._none
            _turn_to_fronts(
                tuple(vars(self.coincident).values()), kinds, ray_directions.T, tuple(places)
            )
        return places

    def find_doubles(self, places):
        """Other faces that light reaches together with the front that it hit: coincident ones that
        face the same way.

        Parameters
        ----------
        places : HitPlaces
            m, on the faces that were hit.

        Returns
        -------
        row : (d,) int64
            Index into the m places.
        other : (d,) int32
            The face.
        """
        if not len(self.coincident):
            return np.zeros(0, np.int64), np.zeros(0, np.int32)
        return _list_doubles(tuple(vars(self.coincident).values()), self._kinds, tuple(places))

    def stop_in_crowns(self, patches, rays, places, wanted):
        """Rays stopped by the leaves or the trunks between their origin and what they hit.

        Parameters
        ----------
        patches : Patches
        rays : tuple of (c, r, 3) float32 and (c, r, 3) float32
            Origins and unit directions, in rows whose random numbers are evenly spread.
        places : HitPlaces
            (c, r), what the rays hit.
        wanted : (c, r) bool
            Rays in question.

        Returns
        -------
        (states, c, r) bool
        """
        stopped = np.zeros((self.canopy.states, *wanted.shape), bool)
        rows = np.flatnonzero(wanted.any(axis=1))
        if len(rows):
            origins, directions = (part[rows] for part in rays)
            reach = _measure_reach(patches, origins, directions, places.take(rows))
            stopped[:, rows] = self.canopy.stop_rays(origins, directions, reach) & wanted[rows]
        return stopped


@njit(nogil=True, cache=True, inline="always")
def _place_on(places, entry, b1, b2):
    """Whether a point of one face of a pair lies on the other, and its barycentric
    weights there.
    """
    # Affine in the weights: where the point lies in the other face's own.
    c1 = places[entry, 0, 0] + places[entry, 0, 1] * b1 + places[entry, 0, 2] * b2
    c2 = places[entry, 1, 0] + places[entry, 1, 1] * b1 + places[entry, 1, 2] * b2
    # A point may lie outside of a face by rounding of its barycentric weights.
    return min(c1, c2, 1 - c1 - c2) >= -1e-6, c1, c2


@njit(nogil=True, cache=True, inline="always")
def _runs_along(facing, face, x, y, z):
    """Whether a ray in a direction hits the back of a face, as in `rays.surroundings`."""
    along = x * facing[face, 0] + y * facing[face, 1] + z * facing[face, 2]
    return along + facing[face, 3] > 0


@njit(nogil=True, cache=True)
def _turn_to_fronts(pairs, kinds, directions, hits):
    """Change hits on coincident faces to the first of the fronts that receive light; without any
    such, to the first of all. Which of them the tracer meets depends on the rest of the city.

    Parameters
    ----------
    pairs : tuple
        Of `Coincident`.
    kinds : tuple of (p, 4) float32 and (p,) bool
        `facing` and `receives` of `Patches`.
    directions : (3, m) float32
    hits : tuple of (m,) int32, (m,) float32 and (m,) float32
        Changed in place.
    """
    (start, other, places), (facing, receives), (hit, b1, b2) = pairs, kinds, hits
    for ray in range(len(hit)):
        met = hit[ray]
        if met < 0 or start[met] == start[met + 1]:
            continue
        east, north, up = directions[0, ray], directions[1, ray], directions[2, ray]
        # A front that receives light keeps the hit, unless an earlier one does so too; a back gives
        # it to the first front, or else to the first face of all.
        front = receives[met] and not _runs_along(facing, met, east, north, up)
        chosen, x, y = met, b1[ray], b2[ray]
        for entry in range(start[met], start[met + 1]):  # in ascending order
            face = other[entry]
            if front and face >= chosen:
                break
            lit = receives[face] and not _runs_along(facing, face, east, north, up)
            if lit or (not front and face < chosen):
                lies_there, c1, c2 = _place_on(places, entry, b1[ray], b2[ray])
                if lies_there:
                    chosen, x, y, front = face, c1, c2, lit
                    if lit:
                        break
        hit[ray], b1[ray], b2[ray] = chosen, x, y


@njit(nogil=True, cache=True)
def _turn_sheets(other_side, facing, directions, hits):
    """Change hits on the backs of sheets to hits on their other sides: the same triangles,
    reversed.

    Parameters
    ----------
    other_side : (p,) int32
        Of `Patches`.
    facing : (p, 4) float32
    directions : (3, m) float32
    hits : tuple of (m,) int32, (m,) float32 and (m,) float32
        Changed in place.
    """
    hit, b1, b2 = hits
    for ray in range(len(hit)):
        met = hit[ray]
        if met >= 0 and other_side[met] >= 0:
            x, y, z = directions[0, ray], directions[1, ray], directions[2, ray]
            if _runs_along(facing, met, x, y, z):
                # The other side has the same corners in reverse order: weights change places.
                hit[ray], b1[ray], b2[ray] = other_side[met], b2[ray], b1[ray]


@njit(nogil=True, cache=True)
def _list_doubles(pairs, kinds, hits):
    """Indices of places, and further faces that coincide there, receive light and face the same
    way.
    """
    (start, other, places), (facing, receives), (hit, b1, b2) = pairs, kinds, hits
    row, doubles = [np.int64(0) for _ in range(0)], [np.int32(0) for _ in range(0)]
    for ray in range(len(hit)):
        # Faces in one place with the one that was hit, that face its way and hold the point.
        met = hit[ray]
        x, y, z = facing[met, 0], facing[met, 1], facing[met, 2]
        for entry in range(start[met], start[met + 1]):
            face = other[entry]
            lit = receives[face] and facing[face, 3] == 0 and _runs_along(facing, face, x, y, z)
            if lit and _place_on(places, entry, b1[ray], b2[ray])[0]:
                row.append(ray)
                doubles.append(face)
    return np.array(row, np.int64), np.array(doubles, np.int32)


def _drop_hidden(ray_scene, patches, coincident, threads=1, *, pairs_per_task=1 << 13):
    """Coincident faces without the fronts that light does not reach; only pairs that face opposite
    ways are tested.

    Parameters
    ----------
    ray_scene : RayScene
    patches : Patches
    coincident : Coincident
    threads : int

    Returns
    -------
    Coincident
    """
    # Pairs of faces that look away from each other, where the other may receive light: from the
    # middle of their overlap rays ask whether its front is inside something.
    one = np.repeat(np.arange(len(patches)), np.diff(coincident.start))
    other = coincident.other
    opposite = np.einsum("ex,ex->e", patches.normal[one], patches.normal[other]) < 0
    doubtful = np.flatnonzero(opposite & patches.receives[other])
    tasks = [
        doubtful[begin : begin + pairs_per_task]
        for begin in range(0, len(doubtful), pairs_per_task)
    ]

    def vote(entries):
        faces, (middle, _) = other[entries], coincident.measure_overlaps(entries)
        keys = mix(patches.place_key[faces] ^ np.uint64(0x51DE))
        return lie_inside(ray_scene, patches, HitPlaces(faces, *middle.T), keys)

    kept = ~opposite
    for entries, hidden in zip(tasks, map_in_order(vote, tasks, threads), strict=True):
        kept[entries] = ~hidden
    # Without the pairs whose front is hidden.
    return coincident.take(kept)


def _measure_reach(patches, origins, directions, places):
    """Distance from origins to hits, (c, r) float64 [m]; practically infinite where nothing
    is hit.
    """
    hit, b1, b2 = places
    reach = np.full(hit.shape, 1e30)
    row, ray = np.nonzero(hit >= 0)
    met = hit[row, ray]
    weights = np.stack([b1[row, ray], b2[row, ray]], axis=1)[:, :, None]
    place = patches.corner[met].astype(float) + (weights * patches.edges[met]).sum(axis=1)
    reach[row, ray] = np.einsum("ki,ki->k", place - origins[row, ray], directions[row, ray])
    return reach
