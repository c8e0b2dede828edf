"""Light of photons on surfaces, as sums by replicate, and where the energy of their source went."""

from dataclasses import dataclass, field, fields

import numpy as np


@dataclass
class Tally:
    """Energy balance of a source, in photons: `emitted` is the sum of all others."""

    emitted: float = 0.0
    escaped: float = 0.0  # hit nothing
    # came from the other side of the horizon of distant terrain, and were not traced
    behind_terrain: float = 0.0
    absorbed: float = 0.0  # on front sides
    on_backs: float = 0.0  # hit a back side or a footprint
    closure: float = 0.0  # hit a closure surface or a surface that lies on the ground
    leaves: float = 0.0  # ended in crowns or at trunks
    covered: float = 0.0  # from the far ground, hit a covered cell below the ground
    cut: float = 0.0  # left after the last bounce
    # from a part of the sky, by which photons count less than one: `HorizonBand.weigh`
    unweighed: float = 0.0

    def add(self, other):
        """Add another tally to this one."""
        for entry in fields(self):
            setattr(self, entry.name, getattr(self, entry.name) + getattr(other, entry.name))


@dataclass
class Light:
    """Light of a source on n surfaces: photons that arrived there, or, divided by their density,
    irradiance.
    """

    first: np.ndarray  # (r, n) float64, at first hit, of r replicates
    reflected: np.ndarray  # (r, n) float64, at later hits
    begin: int = 0  # number of the first of these replicates
    photon: np.ndarray | float = 0.0  # (n,) float64, contribution of a single photon
    arrived: float = 0.0  # total of all hits, on all patches
    last: float = 0.0  # its part at the last reflection
    ray_count: int = 0
    tally: Tally = field(default_factory=Tally)

    def add(self, other, weight=1.0):
        """Add the light of other photons, of some or all of the replicates, with some weight."""
        rows = slice(other.begin, other.begin + len(other.first))
        self.first[rows] += weight * other.first
        self.reflected[rows] += weight * other.reflected
        self.photon = np.hypot(self.photon, weight * other.photon)
        self.arrived += weight * other.arrived
        self.last += weight * other.last
        self.ray_count += other.ray_count
        self.tally.add(other.tally)

    @property
    def whole(self):
        """Sum of first hits and reflections: (r, n) float64."""
        return self.first + self.reflected

    @property
    def last_share(self):
        """Share of the last reflection in the total."""
        return self.last / self.arrived if self.arrived else 0.0
