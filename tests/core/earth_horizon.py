"""The horizon of a raster by brute force: every edge between posts, in Earth-centred
coordinates.
"""

import numpy as np
import pyproj
import rasterio
from scipy.interpolate import RegularGridInterpolator

RADIUS, REFRACTION = 6_371_000.0, 0.13  # light bends by k d/2R: Gauss' coefficient


class Edges:
    """Edges between neighbouring posts of a raster in degrees, as seen from the ground of one
    place.
    """

    def __init__(self, path, latitude, longitude, near):
        with rasterio.open(path) as dataset:
            heights, affine = dataset.read(1).astype(float), dataset.transform
        south = -affine.f - (np.arange(heights.shape[0]) + 0.5) * affine.e
        east = affine.c + (np.arange(heights.shape[1]) + 0.5) * affine.a
        ground = RegularGridInterpolator((south, east), heights)((-latitude, longitude))  # bilinear
        globe = pyproj.Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)
        posts = np.stack(globe.transform(*np.meshgrid(east, -south), heights), axis=-1)
        away = posts - globe.transform(longitude, latitude, float(ground))
        north, turn = np.radians(latitude), np.radians(longitude)
        up = np.array([np.cos(north) * np.cos(turn), np.cos(north) * np.sin(turn), np.sin(north)])
        to_east = np.array([-np.sin(turn), np.cos(turn), 0.0])
        self.x, self.y, self.z = away @ to_east, away @ np.cross(up, to_east), away @ up
        self.near = near

    def elevation(self, azimuth):
        """Greatest elevation [°] on a vertical plane at an azimuth [°], beyond the distance `near`
        [m].
        """
        turn = np.radians(azimuth)
        side = self.x * np.cos(turn) - self.y * np.sin(turn)  # to the right of the plane
        ahead = self.x * np.sin(turn) + self.y * np.cos(turn)
        places = []
        for one, other in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])):
            crossed = side[one] * side[other] <= 0
            width = side[one][crossed] - side[other][crossed]
            share = np.divide(side[one][crossed], width, out=np.zeros(len(width)), where=width != 0)
            places.append(
                [
                    part[one][crossed] * (1 - share) + part[other][crossed] * share
                    for part in (ahead, self.z)
                ]
            )
        distance, height = np.hstack(places)
        order = np.argsort(distance)
        distance, height = distance[order], height[order]
        first = np.interp(self.near, distance, height)
        far = distance > self.near
        distance, height = np.append(distance[far], self.near), np.append(height[far], first)
        angle = np.arctan2(height, distance) + REFRACTION * distance / (2 * RADIUS)
        return max(np.degrees(angle.max()), 0.0)
