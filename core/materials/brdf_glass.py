"""Clear glass panes: unpolarised light is reflected by Fresnel's equations, the rest is transmitted and lost.

See `brdf_lambertian` for the three functions.
"""

from dataclasses import dataclass

import numpy as np

from .brdf_mirror import MIRRORED


@dataclass(frozen=True)
class Glass:
    """Specular reflection that increases towards grazing incidence."""

    refractive_index: float = 1.52  # of soda-lime glass in visible light
    interfaces: int = 2  # between glass and air: 1 for a solid block, 2 for a pane, 4 for double glazing
    albedo: float = 1.0  # at grazing incidence

    def sample(self, arriving, draws):
        """Specular direction with Fresnel reflectance: leaving (n, 3) and share (n,) float64."""
        return arriving * MIRRORED, reflect_interfaces(arriving[:, 2], self.refractive_index, self.interfaces)

    def pdf(self, arriving, leaving):
        """Zero, as the distribution is a delta function: (n,)."""
        return np.zeros(len(leaving))

    def evaluate(self, arriving, leaving):
        """Zero in all other directions: (n,)."""
        return np.zeros(len(leaving))


def reflect_interfaces(cosine, refractive_index, interfaces):
    """Reflectance of parallel interfaces between air and clear glass for unpolarised light.

    Multiple reflections between them add up without interference, for each polarisation: R_k = k R / (1 + (k - 1) R).

    Parameters
    ----------
    cosine : (n,) float
        Of the angle of incidence.
    refractive_index : float
    interfaces : int

    Returns
    -------
    (n,) float64

    References
    ----------
    G. G. Stokes (1862), On the intensity of the light reflected from or transmitted through a pile of plates,
    Proceedings of the Royal Society of London 11.
    """
    single = fresnel(cosine, refractive_index)
    return (interfaces * single / (1 + (interfaces - 1) * single)).mean(axis=0)


def fresnel(cosine, refractive_index):
    """Reflectance of one interface, for polarisation perpendicular and parallel to the plane of incidence.

    Returns
    -------
    (2, n) float64
    """
    outside = np.clip(np.asarray(cosine, float), 0, 1)
    inside = np.sqrt(1 - (1 - outside**2) / refractive_index**2)  # Snell's law
    perpendicular = (outside - refractive_index * inside) / (outside + refractive_index * inside)
    parallel = (refractive_index * outside - inside) / (refractive_index * outside + inside)
    return np.stack([perpendicular**2, parallel**2])
