"""Crowns and trunks of a scene as triangles."""

from dataclasses import dataclass

import numpy as np


@dataclass
class Crowns:
    """Closed surfaces around the leaves of k trees, and surfaces of their trunks; axes and origin of the scene."""

    vertices: np.ndarray  # (v, 3) float64 [m]
    triangles: np.ndarray  # (t, 3) int32 into vertices; of crowns counter-clockwise seen from outside
    tree: np.ndarray  # (t,) int32
    trunk: np.ndarray  # (t,) bool: opaque
    names: list  # (k,) str
    height: np.ndarray  # (k,) float64 [m]
    evergreen: np.ndarray  # (k,) bool
    area_density: np.ndarray  # (k,) float64 [m²/m³] of leaves; NaN: not given

    def __len__(self):
        return len(self.names)


def volume_of_crowns(crowns):
    """Volume inside each crown: (k,) float64 [m³]."""
    corners = crowns.vertices[crowns.triangles[~crowns.trunk]]
    own = crowns.tree[~crowns.trunk]
    middle = np.zeros((len(crowns), 3))
    np.add.at(middle, own, corners.mean(axis=1))
    middle /= np.maximum(np.bincount(own, minlength=len(crowns)), 1)[:, None]
    corners = corners - middle[own][:, None]
    parts = np.einsum("ti,ti->t", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    return np.bincount(own, parts, minlength=len(crowns))
