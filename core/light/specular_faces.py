"""Light from faces that do not reflect by Lambert's law: photons that start there, with their first
such reflection.

       sun
         ↘  shadow ray      Every path with a reflection at a mirror, a glossy face or glass has a
         first one. Photons
    ●     ↘                 start there: at points of these faces that see the sun, or with a ray
    that looks for what
  ↗ wall   ▌ mirror         the face receives from the sky, the far ground and other faces. From the
  reflection on they
↗    ↙ ↙ ↙ ▌                are followed as any photons are.
"""

from dataclasses import dataclass

import numpy as np

from ..rays import sample_points
from ..rays.hemisphere_rays import CELL_DIVISIONS
from ..rays.ray_scene import HitPlaces
from .emit_photons import choose_by_power, low_discrepancy
from .follow_photons import Photons, end_in_crowns, meet_fronts, reflect_photons
from .light_of_photons import Tally

NOTHING, SKY, FAR_GROUND = -3, -2, -1  # what a ray from a face meets, if not a patch


@dataclass
class Batch:
    """Photons of one set of random numbers."""

    key: np.uint64
    numbers: range  # indices of photons, counted over all replicates
    per_replicate: int

    @property
    def number(self):
        """Indices: (m,) int64."""
        return np.arange(self.numbers.start, self.numbers.stop)


def _place_on_faces(faces, power, batch, dimensions):
    """Points of faces with a density in proportion to their power.

    Parameters
    ----------
    faces : (f,) int
        Patches.
    power : (f,) float64
    batch : Batch
    dimensions : int
        Random numbers per photon, at least 2.

    Returns
    -------
    places : HitPlaces
    numbers : (m, dimensions - 2) float64
        Numbers that were not used.
    """
    replicate, place = np.divmod(batch.number, batch.per_replicate)
    numbers = low_discrepancy(batch.key, replicate, place, dimensions)
    row, along = choose_by_power(power, numbers[:, 0])
    return HitPlaces(
        faces[row], *sample_points.barycentric_of_square(along, numbers[:, 1])
    ), numbers[:, 2:]


def photons_of_sun(target, faces, power, direction, batch):
    """Photons of a sun, reflected at faces that see it.

    Parameters
    ----------
    target : Target
    faces : (f,) int
        Patches that do not reflect by Lambert's law.
    power : (f,) float64 [m²]
        Of each, area times the cosine of incidence.
    direction : (3,) float32
        Towards the sun.
    batch : Batch

    Returns
    -------
    Photons
        Their weight is the reflected share; those in the dark are left out.
    """
    # Places on the faces by the light that falls there; those that see the sun reflect it.
    places, _ = _place_on_faces(faces, power, batch, 2)
    origins, _ = target.patches.leave(places, np.zeros((3, len(places[0]))))
    direction = np.asarray(direction, np.float32)
    seen = np.flatnonzero(
        ~target.covered[places[0], sample_points.Cells(CELL_DIVISIONS).of_point(*places[1:])]
    )
    seen = seen[~target.ray_scene.trace_blocked(origins[seen], direction)]
    towards, nothing = np.broadcast_to(direction, (len(seen), 3)), np.zeros(len(seen))
    seen = seen[
        ~end_in_crowns(
            target, origins[seen], towards, HitPlaces(nothing.astype(int) - 1, nothing, nothing)
        )
    ]
    return _reflect_first(
        target, batch, places.take(seen), np.broadcast_to(-direction, (len(seen), 3)), seen
    )


def photons_of_surroundings(target, faces, batch, is_sky):
    """Photons that bring light of everything around to faces and are reflected there; per
    radiosity.

    Parameters
    ----------
    target, faces, batch
        As in `photons_of_sun`.
    is_sky : callable
        Which directions, (m, 3), belong to the sky rather than to the ground.

    Returns
    -------
    Photons
    origin : (m,) int
        Of all photons of the batch: the patch from which the light comes, SKY, FAR_GROUND or
        NOTHING.
    directions : (m, 3) float32
        From which it comes.
    """
    patches = target.patches
    # A place on a face and a direction by the cosine law: from what it meets the light comes.
    places, numbers = _place_on_faces(faces, patches.area[faces], batch, 4)
    towards = np.stack(sample_points.cosine_direction(numbers[:, 0], numbers[:, 1]))
    origins, directions = patches.leave(places, towards)
    hits = target.ray_scene.trace_places(origins, directions)
    met = hits.triangle
    origin = np.where(met >= 0, met, np.where(is_sky(directions), SKY, FAR_GROUND))
    origin[(met >= 0) & (patches.meets_back(met, directions) | ~patches.receives[met])] = NOTHING
    origin[target.covered[places[0], sample_points.Cells(CELL_DIVISIONS).of_point(*places[1:])]] = (
        NOTHING
    )
    origin[end_in_crowns(target, origins, directions, hits)] = NOTHING
    # Light that comes the other way is reflected at the face.
    some = np.flatnonzero(origin != NOTHING)
    photons = _reflect_first(target, batch, places.take(some), -directions[some], some)
    return photons, origin, directions


def _reflect_first(target, batch, places, travel, chosen):
    """Photons after their reflection at places of faces, on which they arrived in directions
    `travel`.
    """
    number = batch.number[chosen]
    photons = Photons(travel, travel, np.ones(len(number)), number, number // batch.per_replicate)
    return reflect_photons(target, batch.key, photons, places, 0)


def follow_reflected(target, key, photons, last):
    """Follow photons that were reflected once, and tell where they arrive.

    Parameters
    ----------
    target : Target
    key : uint64
        Of their random numbers.
    photons : Photons
    last : int
        How often they may be reflected further; none arrives if negative.

    Yields
    ------
    photons : Photons
    surface : (k,) int
        At which each of them arrives; `surface_count` for patches without surface.
    """
    for bounce in range(last + 1):
        photons, places = meet_fronts(target, photons, Tally())
        yield photons, target.surface_at(places)
        row, double = target.ray_scene.find_doubles(places)
        if len(row):
            yield photons.take(row), target.surface[double]
        if bounce < last:
            photons = reflect_photons(target, key, photons, places, bounce + 1)
