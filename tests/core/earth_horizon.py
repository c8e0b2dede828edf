"""The horizon of a raster by brute force: every edge between posts, in Earth-centred coordinates."""

import numpy as np
import pyproj
import rasterio

RADIUS, REFRACTION = 6_371_000.0, 0.13  # light bends by k d/2R: Gauss' coefficient


class Edges:
    """Edges between neighbouring posts of a raster in degrees, as seen from the ground of one place."""

    def __init__(self, path, latitude, longitude, near):
        with rasterio.open(path) as dataset:
            heights, affine = dataset.read(1).astype(float), dataset.transform
        row, column = np.indices(heights.shape)
        self.longitude, self.latitude = affine.c + (column + 0.5) * affine.a, affine.f + (row + 0.5) * affine.e
        self.globe = pyproj.Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)
        posts = np.stack(self.globe.transform(self.longitude, self.latitude, heights), axis=-1)
        east, north, up, here = self.frame(latitude, longitude, heights, affine)
        away = posts - here
        self.x, self.y, self.z = away @ east, away @ north, away @ up
        self.near = near

    def frame(self, latitude, longitude, heights, affine):
        """Directions east, north and up, and the ground at the place: bilinear between four posts."""
        column, row = (longitude - affine.c) / affine.a - 0.5, (latitude - affine.f) / affine.e - 0.5
        j, i = int(column), int(row)
        s, t = column - j, row - i
        height = (1 - t) * ((1 - s) * heights[i, j] + s * heights[i, j + 1])
        height += t * ((1 - s) * heights[i + 1, j] + s * heights[i + 1, j + 1])
        north, turn = np.radians(latitude), np.radians(longitude)
        up = np.array([np.cos(north) * np.cos(turn), np.cos(north) * np.sin(turn), np.sin(north)])
        east = np.array([-np.sin(turn), np.cos(turn), 0.0])
        here = np.array(self.globe.transform(longitude, latitude, height))
        return east, np.cross(up, east), up, here

    def elevation(self, azimuth):
        """Greatest elevation [°] on a vertical plane at an azimuth [°], beyond the distance `near` [m]."""
        turn = np.radians(azimuth)
        side = self.x * np.cos(turn) - self.y * np.sin(turn)  # to the right of the plane
        ahead = self.x * np.sin(turn) + self.y * np.cos(turn)
        distances, heights = [], []
        for one, other in (((slice(None), slice(None, -1)), (slice(None), slice(1, None))),
                           ((slice(None, -1), slice(None)), (slice(1, None), slice(None)))):  # fmt: skip
            crossed = side[one] * side[other] <= 0
            width = side[one][crossed] - side[other][crossed]
            share = np.divide(side[one][crossed], width, out=np.zeros(len(width)), where=width != 0)
            distances.append(ahead[one][crossed] * (1 - share) + ahead[other][crossed] * share)
            heights.append(self.z[one][crossed] * (1 - share) + self.z[other][crossed] * share)
        distance, height = np.concatenate(distances), np.concatenate(heights)
        order = np.argsort(distance)
        distance, height = distance[order], height[order]
        first = np.interp(self.near, distance, height)
        far = distance > self.near
        distance, height = np.append(distance[far], self.near), np.append(height[far], first)
        angle = np.arctan2(height, distance) + REFRACTION * distance / (2 * RADIUS)
        return max(np.degrees(angle.max()), 0.0)
