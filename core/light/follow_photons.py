"""Trace photons from their source to their end: hits, deposits, and reflections by the BRDF of the
patch they hit.

Weights are shares of a photon's initial power, rounded to multiples of 2⁻²⁶. Sums of up to 10⁸ of
them are exact in float64 whatever their order: results are the same to the last bit on any number
of threads, and emitted power is accounted for without a remainder.
"""

from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np

from ..patches.cover_cells import unpack_cells
from ..patches.facing_scene import FacingScene
from ..patches.patches import Patches
from ..patches.read_albedo import TriangleBrdfs
from ..rays.hemisphere_rays import CELL_DIVISIONS
from ..rays.random_numbers import GOLDEN, mix, uniform
from ..rays.sample_points import Cells, cosine_direction
from ..sky.horizon import is_above
from .emit_photons import emit_photons
from .light_of_photons import Light

QUANTUM = 2.0**-26


@dataclass
class Target:
    """Scene as seen by photons."""

    ray_scene: FacingScene
    patches: Patches
    surface: np.ndarray  # (p,) int, of each patch; `surface_count` if it has none
    surface_count: int
    # (p, CELL_DIVISIONS²) bool, cells of patches that lie inside or under something
    covered: np.ndarray
    brdfs: TriangleBrdfs  # of the patches
    state: int = 0  # of trees: 0 in leaf, 1 bare
    left_out: np.ndarray | None = None  # (p,) uint64, as of `RayCity`

    def surface_at(self, places):
        """Surfaces on whose means photons at some places count: (m,) int, `surface_count` where on
        none.
        """
        surface = self.surface[places.triangle]
        if self.left_out is not None:
            row = np.flatnonzero(self.left_out[places.triangle])
            hit, b1, b2 = places.take(row)
            cell = Cells(CELL_DIVISIONS).of_point(b1, b2)[:, None].astype(np.intp)
            dark = np.take_along_axis(unpack_cells(self.left_out[hit]), cell, axis=1)[:, 0]
            surface[row[dark]] = self.surface_count
        return surface

    @cached_property
    def area(self):
        """Traced area of each surface: (n,) float64 [m²]."""
        return np.bincount(self.surface, self.patches.area, self.surface_count + 1)[:-1]


@dataclass
class Photons:
    """Photons in flight."""

    origins: np.ndarray  # (m, 3) float32
    directions: np.ndarray  # (m, 3) float32
    weight: np.ndarray  # (m,) float64, multiples of QUANTUM
    number: np.ndarray  # (m,) int64, index among all photons of the source
    row: np.ndarray  # (m,) int64, index of the replicate among those traced together

    def take(self, chosen):
        """Select photons."""
        return Photons(**{entry.name: getattr(self, entry.name)[chosen] for entry in fields(self)})


def follow_photons(target, source, numbers, per_replicate, max_bounces):
    """Emit photons and trace each until it escapes, ends (at a back side, in a crown or at a face
    that takes no light), is absorbed or was reflected `max_bounces` times.

    Parameters
    ----------
    target : Target
    source : Source
    numbers : range
        Indices of photons of the source, counted over all replicates.
    per_replicate : int
        Photons in each replicate.
    max_bounces : int

    Returns
    -------
    Light
        Weights of photons on each surface in each replicate, at their first and at later hits, with
        their energy balance.
    """
    # Photons by number, in the replicate that each belongs to.
    number = np.arange(numbers.start, numbers.stop)
    replicate, place = np.divmod(number, per_replicate)
    rows = int(replicate[-1] - replicate[0]) + 1
    photons = Photons(
        *emit_photons(source, replicate, place),
        np.ones(len(number)),
        number,
        replicate - replicate[0],
    )
    tallies = Light(*np.zeros((2, rows, target.surface_count)), begin=int(replicate[0]))
    tallies.tally.emitted = float(len(number))
    # Photons that would come from behind terrain, or from before it, are dropped.
    if source.terrain is not None:
        chosen = is_above(source.terrain, -photons.directions) != source.beyond
        tallies.tally.behind_terrain = float(len(number) - chosen.sum())
        photons = photons.take(chosen)
    # A photon flies on until it meets a front, is counted there, and is reflected with less weight.
    for bounce in range(max_bounces + 1):
        tallies.ray_count += len(photons.number)
        photons, places = meet_fronts(
            target, photons, tallies.tally, source if bounce == 0 else None
        )
        # A photon of a traced part of the sky counts with a weight of its own at its first hit.
        first = source.of is not None and bounce == 0
        received, photons = (
            _weigh_first(target, source.of, photons, places[0], tallies.tally)
            if first
            else [photons] * 2
        )
        sums = tallies.first if bounce == 0 else tallies.reflected
        deposit(received, target.surface_at(places), sums)
        # Coincident surfaces of the same orientation are all lit, but the photon is reflected once.
        row, double = target.ray_scene.find_doubles(places)
        if len(row):
            deposit(received.take(row), target.surface[double], sums)
        # Sums for the energy balance: what arrived, what was absorbed, what is cut off at the end.
        weight = float(photons.weight.sum())
        tallies.arrived, tallies.last = tallies.arrived + weight, weight if bounce else 0.0
        photons = reflect_photons(target, source.key, photons, places, bounce)
        tallies.tally.absorbed += weight - float(photons.weight.sum())
    tallies.tally.cut = float(photons.weight.sum())
    return tallies


def meet_fronts(target, photons, tally, source=None):
    """Trace photons to their next hit, and keep those on the front side of a receiving patch.

    Parameters
    ----------
    target : Target
    photons : Photons
    tally : Tally
        Balance of photons that end here; changed in place.
    source : Source, optional
        Given at first hit only: the source of the photons.

    Returns
    -------
    Photons
    places : HitPlaces
        m, which they hit.
    """
    patches = target.patches
    places = target.ray_scene.trace_places(photons.origins, photons.directions)
    # Leaves of trees stop some.
    stopped = end_in_crowns(target, photons.origins, photons.directions, places)
    if stopped.any():
        tally.leaves += float(photons.weight[stopped].sum())
        photons, places = photons.take(~stopped), places.take(~stopped)
    hit, b1, b2 = places
    missed = hit < 0
    back = patches.meets_back(hit, photons.directions)
    # At the first hit some slip past an edge by rounding, and count as hits of the back.
    if source is not None:
        back |= _slip_past_edges(target, places, photons.directions, ~missed & ~back)
    closure = ~missed & ~back & ~patches.receives[hit]
    covered = np.zeros(len(hit), bool)
    if source is not None and source.rising:
        # The ground has no thickness: photons that rise from below it may hit walls that extend
        # below ground, and end where the place that they hit is covered.
        fronts = np.flatnonzero(~missed & ~back & ~closure)
        covered[fronts] = target.covered[hit, Cells(CELL_DIVISIONS).of_point(b1, b2)][fronts]
        # In cells that the line of the ground crosses each place is asked, as gather asks the start
        # of each ray.
        doubtful = fronts[target.covered[hit[fronts]].any(axis=1) & ~covered[fronts]]
        starts = patches.points(hit[doubtful], b1[doubtful, None], b2[doubtful, None])
        covered[doubtful] = patches.lie_in_earth(target.ray_scene, starts)[:, 0]
    # What ends here is added to the balance by its reason: escaped, at a back, at a face that takes
    # no light (closure), or at a covered place.
    for name, chosen in (
        ("escaped", missed),
        ("on_backs", back),
        ("closure", closure),
        ("covered", covered),
    ):
        setattr(tally, name, getattr(tally, name) + float(photons.weight[chosen].sum()))
    lit = ~(missed | back | closure | covered)
    return photons.take(lit), places.take(lit)


def end_in_crowns(target, origins, directions, places):
    """Rays that end in crowns before what they hit, `places` as of `trace_places`: (m,) bool."""
    if target.ray_scene.canopy is None:
        return np.zeros(len(origins), bool)
    rays, wanted = (origins[:, None], directions[:, None]), np.ones((len(origins), 1), bool)
    stopped = target.ray_scene.stop_in_crowns(
        target.patches, rays, places.take(np.s_[:, None]), wanted
    )
    return stopped[target.state, :, 0]


def _slip_past_edges(target, places, directions, front):
    """Photons that slip through a shared edge by rounding: past the back of one patch onto the
    front of the next.

    For hits closer to an edge than the ray offset, a ray is traced back from the offset point: it
    is free only if the photon came from outside.

    Parameters
    ----------
    target : Target
    places : HitPlaces
    directions : (m, 3) float32
    front : (m,) bool
        Photons that hit a front side.

    Returns
    -------
    (m,) bool
    """
    hit, b1, b2 = places
    edges = target.patches.edges[hit]
    longest = np.linalg.norm(
        np.concatenate([edges, edges[:, 1:] - edges[:, :1]], axis=1), axis=2
    ).max(axis=1)
    # inside  distance of the hit from the nearest edge, at least [m]: weight times height over the
    # longest edge.
    height = 2 * target.patches.area[hit] / np.maximum(longest, np.finfo(np.float32).tiny)
    inside = np.minimum(np.minimum(b1, b2), 1 - b1 - b2) * height
    near = np.flatnonzero(front & (inside < target.patches.offset[hit]))
    slipped = np.zeros(len(hit), bool)
    if len(near):
        origins, _ = target.patches.leave(places.take(near), np.zeros((3, len(near))))
        slipped[near] = target.ray_scene.trace_closest(origins, -directions[near]) >= 0
    return slipped


def _weigh_first(target, source, photons, hit, tally):
    """Photons of a part of the sky with the weight that they have on the patches that they hit
    first.

    Faces that reflect as mirrors do show that part of the sky as it is: photons go on from there
    with all their weight.

    Parameters
    ----------
    target : Target
    source : HorizonBand
    photons : Photons
    hit : (m,) int32
    tally : Tally
        Changed in place.

    Returns
    -------
    received, going : Photons
    """
    share = source.weigh(target.patches.normal[hit], -photons.directions)
    weight = np.rint(photons.weight * share / QUANTUM) * QUANTUM
    going = np.where(target.brdfs[1][hit] >= 0, photons.weight, weight)
    tally.unweighed += float((photons.weight - going).sum())
    return replace(photons, weight=weight), replace(photons, weight=going)


def deposit(photons, surface, sums):
    """Add the weights of photons to the sums of their surfaces.

    Parameters
    ----------
    photons : Photons
    surface : (m,) int
        Surface hit by each photon.
    sums : (r, n) float64
        By replicate and surface; changed in place. Hits on surface n are dropped.
    """
    replicates, count = sums.shape
    place = photons.row * (count + 1) + surface
    sums += np.bincount(place, photons.weight, replicates * (count + 1)).reshape(replicates, -1)[
        :, :-1
    ]


def reflect_photons(target, key, photons, places, bounce, *, numbers=3):
    """Reflect photons by the BRDF of the patch that each hits; the absorbed part is removed from
    their weight.

    Parameters
    ----------
    target : Target
    key : uint64
        Of the source.
    photons : Photons
        With their directions of travel on arrival.
    places : HitPlaces
        As in `meet_fronts`.
    bounce : int

    Returns
    -------
    Photons
        Without those that are absorbed wholly.
    """
    patches, (others, brdf_index), hit = target.patches, target.brdfs, places[0]
    own = mix(key + mix(photons.number.astype(np.uint64) ^ np.uint64(0x5CA77E4)))
    # `numbers`: random numbers per reflection: two for the direction, one for a choice.
    draws = uniform(own + np.uint64(bounce * numbers * int(GOLDEN) % 2**64), numbers)
    share = patches.albedo[hit].astype(float)
    local = np.stack(cosine_direction(draws[:, 0], draws[:, 1]))
    for index, brdf in enumerate(others):
        chosen = np.flatnonzero(brdf_index[hit] == index)
        # Towards the origin of light, in the local frames of the patches.
        axes = np.concatenate(
            [patches.tangents[hit[chosen]], patches.normal[hit[chosen], None]], axis=1
        )
        arriving = -np.einsum(
            "mij,mj->mi", axes.astype(float), photons.directions[chosen].astype(float)
        )
        # At grazing incidence rounding may make the cosine 0.
        arriving[:, 2] = np.maximum(arriving[:, 2], 1e-7)
        arriving /= np.linalg.norm(arriving, axis=1, keepdims=True)
        leaving, share[chosen] = brdf.sample(arriving, draws[chosen])
        local[:, chosen] = leaving.T
    weight = np.rint(photons.weight * share / QUANTUM) * QUANTUM
    reflected = Photons(*patches.leave(places, local), weight, photons.number, photons.row)
    return reflected.take(weight > 0)
