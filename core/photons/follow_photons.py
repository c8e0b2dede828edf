"""Photons from their source to where they end: what they meet, what they leave there, where they go on.

Weights are shares of the power a photon started with, rounded to multiples of 2⁻²⁶. Sums of up to 10⁸ of them are exact
in float64, whatever their order: they come out the same to the last bit on any number of threads, and what was emitted
is found again without a remainder.
"""

from dataclasses import dataclass, field, fields

import numpy as np

from ..patches.facing_scene import FacingScene
from ..patches.find_covered import meets_back
from ..patches.patches import Patches
from ..sampling.hemisphere_rays import CELL_DIVISIONS
from ..sampling.sample_points import cell_of_point
from .emit_photons import emit_photons
from .scatter import draw_for_photons, leave_patches, scatter

QUANTUM = 2.0**-26


@dataclass
class Tally:
    """Where the light of a source went, in photons: `emitted` is the sum of all others."""

    emitted: float = 0.0
    escaped: float = 0.0  # past everything
    absorbed: float = 0.0  # at fronts
    on_backs: float = 0.0  # backs of faces and footprints
    closed: float = 0.0  # faces that close a building or lie on the ground
    buried: float = 0.0  # below the ground, where no far ground shines
    cut: float = 0.0  # reflected at the last bounce that is followed

    def add(self, other):
        """Add another tally to this one."""
        for entry in fields(self):
            setattr(self, entry.name, getattr(self, entry.name) + getattr(other, entry.name))

    def remainder(self):
        """What is missing from the sum: 0."""
        return self.emitted - sum(getattr(self, entry.name) for entry in fields(self)[1:])


@dataclass
class Target:
    """What photons fall on."""

    ray_scene: FacingScene
    patches: Patches
    surface: np.ndarray  # (p,) int, of each patch; `surface_count` where it has none
    surface_count: int
    buried: np.ndarray  # (p, CELL_DIVISIONS²) bool, cells of patches that lie inside or under something
    finishes: tuple  # laws of reflection other than Lambert's, and (p,) int, which of them patches follow; -1 for none


@dataclass
class Photons:
    """Light under way."""

    origins: np.ndarray  # (m, 3) float32
    directions: np.ndarray  # (m, 3) float32
    weight: np.ndarray  # (m,) float64, multiples of QUANTUM
    number: np.ndarray  # (m,) int64, among all photons of the source
    row: np.ndarray  # (m,) int64, of the replicate among those that are followed together

    def take(self, chosen):
        """Some of them."""
        return Photons(**{entry.name: getattr(self, entry.name)[chosen] for entry in fields(self)})


@dataclass
class Deposits:
    """What photons left on n surfaces, in photons."""

    first_replicate: int
    first: np.ndarray  # (r, n) float64, at first hit, for r replicates from the first on
    reflected: np.ndarray  # (r, n) float64, at later hits
    arrived: float = 0.0  # at all hits, on all patches
    last: float = 0.0  # of it at the last bounce
    ray_count: int = 0
    tally: Tally = field(default_factory=Tally)


def follow_photons(target, source, numbers, per_replicate, max_bounces):
    """Emit photons and follow each until it escapes, ends on a back or has been reflected `max_bounces` times.

    Parameters
    ----------
    target : Target
    source : Source
    numbers : range
        Which photons of the source, counted through all replicates.
    per_replicate : int
        Photons in each replicate.
    max_bounces : int

    Returns
    -------
    Deposits
    """
    number = np.arange(numbers.start, numbers.stop)
    replicate, place = np.divmod(number, per_replicate)
    rows = int(replicate[-1] - replicate[0]) + 1
    photons = Photons(*emit_photons(source, replicate, place), np.ones(len(number)), number, replicate - replicate[0])
    found = Deposits(int(replicate[0]), *np.zeros((2, rows, target.surface_count)))
    found.tally.emitted = float(len(number))
    for bounce in range(max_bounces + 1):
        found.ray_count += len(photons.number)
        photons, places = meet_fronts(target, photons, found.tally, source if bounce == 0 else None)
        sums = found.first if bounce == 0 else found.reflected
        deposit(photons, target.surface[places[0]], sums)
        # Where faces coincide and look the same way, all of them are lit; the light goes on once.
        row, double = target.ray_scene.find_doubles(places)
        if len(row):
            deposit(photons.take(row), target.surface[double], sums)
        found.last = float(photons.weight.sum())
        found.arrived += found.last
        photons = reflect_photons(target, source.key, photons, places, bounce)
        found.tally.absorbed += found.last - float(photons.weight.sum())
    found.tally.cut = float(photons.weight.sum())
    return found


def meet_fronts(target, photons, tally, source=None):
    """Trace photons to what they meet, and keep those that arrive on the front of a face that receives.

    Parameters
    ----------
    target : Target
    photons : Photons
    tally : Tally
        Of what ends here; changed in place.
    source : Source, optional
        Where the photons come from straight away.

    Returns
    -------
    Photons
    places : tuple of (m,) int32, (m,) float32 and (m,) float32
        Patch, and barycentric weights of its second and third corner.
    """
    patches = target.patches
    places = target.ray_scene.trace_places(photons.origins, photons.directions)
    hit, b1, b2 = places
    missed = hit < 0
    back = meets_back(patches, hit, photons.directions)
    if source is not None:
        back |= slip_past_edges(target, places, photons.directions, ~missed & ~back)
    closed = ~missed & ~back & ~patches.receives[hit]
    buried = np.zeros(len(hit), bool)
    if source is not None and source.rising:
        # The ground has no thickness: what rises below it meets walls that go on down there.
        buried = ~missed & ~back & ~closed & target.buried[hit, cell_of_point(b1, b2, CELL_DIVISIONS)]
    ends = (("escaped", missed), ("on_backs", back), ("closed", closed), ("buried", buried))
    for name, chosen in ends:
        setattr(tally, name, getattr(tally, name) + float(photons.weight[chosen].sum()))
    lit = ~(missed | back | closed | buried)
    return photons.take(lit), tuple(part[lit] for part in places)


def slip_past_edges(target, places, directions, front):
    """Photons that only rounding let past the back of one face onto the front of the next, where both meet in an edge.

    Who arrives nearer to an edge than rays start from it looks back from where they do: a photon that came from
    outside finds the way free.

    Parameters
    ----------
    target : Target
    places : tuple
        As of `meet_fronts`.
    directions : (m, 3) float32
    front : (m,) bool
        Photons that met a front.

    Returns
    -------
    (m,) bool
    """
    hit, b1, b2 = places
    edges = target.patches.edges[hit]
    longest = np.linalg.norm(np.concatenate([edges, edges[:, 1:] - edges[:, :1]], axis=1), axis=2).max(axis=1)
    height = 2 * target.patches.area[hit] / np.maximum(longest, np.finfo(np.float32).tiny)
    inside = np.minimum(np.minimum(b1, b2), 1 - b1 - b2) * height
    near = np.flatnonzero(front & (inside < target.patches.offset[hit]))
    slipped = np.zeros(len(hit), bool)
    if len(near):
        level = np.zeros((3, len(near)))
        origins, _ = leave_patches(target.patches, tuple(part[near] for part in places), level)
        slipped[near] = target.ray_scene.trace_closest(origins, -directions[near]) >= 0
    return slipped


def deposit(photons, surface, sums):
    """Add the weights of photons to the sums of their surfaces.

    Parameters
    ----------
    photons : Photons
    surface : (m,) int
        Where each has arrived.
    sums : (r, n) float64
        By replicate and surface; changed in place. Surface n is left out.
    """
    replicates, count = sums.shape
    place = photons.row * (count + 1) + surface
    sums += np.bincount(place, photons.weight, replicates * (count + 1)).reshape(replicates, -1)[:, :-1]


def reflect_photons(target, key, photons, places, bounce):
    """Photons that go on from the places where they arrived; what the faces absorb leaves their weight.

    Parameters
    ----------
    target : Target
    key : uint64
        Of the source.
    photons : Photons
    places : tuple
        As of `meet_fronts`.
    bounce : int
    """
    draws = draw_for_photons(key, photons.number, bounce)
    origins, directions, share = scatter(target.patches, places, photons.directions, draws, target.finishes)
    weight = np.rint(photons.weight * share / QUANTUM) * QUANTUM
    going = weight > 0
    return Photons(origins, directions, weight, photons.number, photons.row).take(going)
