"""Result folders piece by piece, in one frame: for a city of any size.

The frame lies in the tangent plane of the ellipsoid: x east, y north, z up, metres; its origin is
the place of the first folder, at height zero. Heights of the files are taken as heights above the
ellipsoid.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd
import pyproj

from ..city.polygons import triangulate
from ..city.site import Site
from ..city.transform_crs import plane_of
from ..settings.errors import InputError
from .read_results import FACE_NUMBERS, FACE_TEXTS, check_columns, count_faces, read_summary
from .surfaces_file import (
    AGAIN,
    GIVE_RESULTS,
    MONTHLY,
    NAME,
    check_names,
    open_surfaces,
    read_layout,
)

GLOBE = "EPSG:4978"  # x, y and z from the Earth's centre [m]


@dataclass
class Shapes:
    """Triangles of n features."""

    corners: np.ndarray  # (m, 3) float64 [m] in the map's frame
    feature: np.ndarray  # (m,) int, of each corner
    triangles: np.ndarray  # (t, 3) int into corners

    def take(self, rows, count):
        """The shapes of some of `count` features, numbered anew in the order of `rows`."""
        number = np.full(count, -1)
        number[rows] = np.arange(len(rows))
        feature = number[self.feature]
        corner = np.cumsum(feature >= 0) - 1
        triangles = self.triangles[feature[self.triangles[:, 0]] >= 0]
        return Shapes(self.corners[feature >= 0], feature[feature >= 0], corner[triangles])


@dataclass
class _Piece:
    """Some surfaces, with shapes."""

    faces: pd.DataFrame  # of `count_faces`
    months: np.ndarray  # (n, 12) [h]
    shapes: Shapes  # of these rows, the corners of a surface one after the other
    modules: Shapes  # of modules on them, four corners each; none where they are not known

    def take(self, mask):
        """The surfaces of a mask, (n,) bool."""
        rows = np.flatnonzero(mask), len(mask)
        shapes = self.shapes.take(*rows), self.modules.take(*rows)
        return _Piece(self.faces[mask], self.months[mask], *shapes)


def join_pieces(pieces):
    """One piece of several."""
    faces = pd.concat([piece.faces for piece in pieces], ignore_index=True)
    months = np.concatenate([piece.months for piece in pieces])
    rows = np.cumsum([0, *(len(piece.faces) for piece in pieces[:-1])])
    shapes = [piece.shapes for piece in pieces], [piece.modules for piece in pieces]
    return _Piece(faces, months, *(_join_shapes(own, rows) for own in shapes))


def _join_shapes(shapes, rows):
    """Shapes of pieces whose features begin at some rows, together."""
    first = np.cumsum([0, *(len(shape.corners) for shape in shapes[:-1])])
    corners = np.concatenate([shape.corners for shape in shapes])
    feature = np.concatenate([shape.feature + row for shape, row in zip(shapes, rows, strict=True)])
    triangles = np.concatenate(
        [shape.triangles + place for shape, place in zip(shapes, first, strict=True)]
    )
    return Shapes(corners, feature, triangles)


def frame_of(latitude, longitude):
    """East, north and up at a place [°] of height zero, and that place, from the Earth's centre:
    (4, 4), by rows.
    """
    globe = pyproj.Transformer.from_crs("EPSG:4979", GLOBE, always_xy=True)
    phi, lam = np.radians([latitude, longitude])
    east = [-np.sin(lam), np.cos(lam), 0.0]
    up = [np.cos(phi) * np.cos(lam), np.cos(phi) * np.sin(lam), np.sin(phi)]
    rows = [east, np.cross(up, east), up, globe.transform(longitude, latitude, 0.0)]
    return np.column_stack([np.array(rows), [0, 0, 0, 1]])


def read_pieces(folder, frame):
    """The surfaces of a result folder, some at a time.

    Parameters
    ----------
    folder : pathlib.Path
    frame : (4, 4) float64
        Of `frame_of`.

    Yields
    ------
    Piece

    Raises
    ------
    InputError
        A file is missing, cannot be read, or belongs to another run than the others.
    """
    if not (folder / "faces.csv").is_file():
        raise InputError(folder / "faces.csv", "there is no such file", GIVE_RESULTS)
    summary = read_summary(folder / "summary.json")
    site = summary["input"]["site"]
    site, path, first = Site(**site | {"origin": tuple(site["origin"])}), folder / "faces.csv", 0
    # Of faces.csv, 20,000 rows are read at a time.
    rows = {"dtype": dict.fromkeys(FACE_TEXTS, str), "keep_default_na": False, "chunksize": 20_000}
    try:
        # surfaces.nc has the shapes in the order of the rows: names and numbers of both files must
        # agree.
        with open_surfaces(folder) as file, pd.read_csv(path, **rows) as tables:
            if "outline_points" not in file:
                raise InputError(folder / NAME, "has no shapes of the surfaces", AGAIN)
            for table in tables:
                faces = check_columns(path, table, FACE_TEXTS, FACE_NUMBERS).reset_index(drop=True)
                faces = count_faces(path, faces, summary)
                check_names(
                    folder,
                    file["surface_id"][first : first + len(faces)],
                    faces["surface_id"].tolist(),
                )
                # A Piece has its shapes in the frame.
                yield _read_shapes(file, faces, first, site, frame)
                first += len(faces)
            if first != file["surface_id"].shape[0]:
                raise InputError(
                    folder / NAME, "does not belong to the faces.csv beside it", GIVE_RESULTS
                )
    except (pd.errors.ParserError, pd.errors.EmptyDataError, UnicodeDecodeError) as error:
        raise InputError(path, f"cannot be read as a table ({error})", GIVE_RESULTS) from error


def _read_shapes(file, faces, first, site, frame):
    """Piece of some rows of faces.csv, from row number `first` on."""
    rows = slice(first, first + len(faces))
    start = file["outline_surface_start"][first : rows.stop + 1].astype(np.int64)
    rings = file["outline_ring_start"][start[0] : start[-1] + 1].astype(np.int64)
    points = _bring_to_frame(
        file["outline_points"][rings[0] : rings[-1]].astype(float), site, frame
    )
    start, rings = start - start[0], rings - rings[0]
    shaped = np.flatnonzero(np.diff(start) > 0)
    triangles, _ = triangulate(points, rings, np.append(start[shaped], start[-1]))
    owner = np.repeat(np.arange(len(faces)), np.diff(rings[start]))
    months, shapes = file[MONTHLY][rows].astype(float), Shapes(points, owner, triangles)
    # Modules on them, where they are known.
    layout, modules = read_layout(file, first, rows.stop), Shapes(*np.zeros((3, 0, 3)))
    if layout is not None:
        corners = _bring_to_frame(layout.corners().reshape(-1, 3), site, frame)
        modules = Shapes(corners, layout.surface.repeat(4), layout.triangles())
    return _Piece(faces, months, shapes, modules)


def _bring_to_frame(points, site, frame):
    """Points of a scene's frame, (m, 3) float64 [m], in the map's frame.

    Without a reference system, or where it does not hold, the scene's frame is set up at its place.
    """
    there = np.full(points.shape, np.inf)
    if site.crs:
        globe = pyproj.Transformer.from_crs(
            plane_of(site.plane or site.crs)[0].to_3d(), GLOBE, always_xy=True
        )
        there = np.column_stack(globe.transform(*site.to_files(points).T))
    if not np.isfinite(there).all():
        own = frame_of(site.latitude, site.longitude)
        there = (points + np.array([0.0, 0.0, site.origin[2]])) @ own[:3, :3] + own[3, :3]
    return (there - frame[3, :3]) @ frame[:3, :3].T
