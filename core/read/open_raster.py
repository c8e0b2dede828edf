"""Open a height raster, plain or gzip-compressed: a GeoTIFF, or an ASC grid (Esri ASCII grid);
average its windows.
"""

import importlib.util
import io
import re
import struct
import warnings
import zlib
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyproj
from pyproj.exceptions import CRSError
from scipy import sparse

from ..city import transform_crs
from ..city.transform_crs import plane_of
from ..settings.errors import InputError
from .open_geotiff import GIVE, UNREADABLE, Raster, open_geotiff
from .open_input import FREE_BYTES, LARGEST_GAIN, open_input, open_text

# [m] all land lies between; values beyond mark gaps, or the floor of the sea
LOWEST, HIGHEST = (
    -500.0,
    12_000.0,
)
# Words in which rasters name the unit of their heights [m].
METRIC = {
    "": ("", 1.0),
    "k": ("kilo", 1000.0),
    "d": ("deci", 0.1),
    "c": ("centi", 0.01),
    "m": ("milli", 0.001),
}
UNIT_WORDS = {f"{short}m": factor for short, (_, factor) in METRIC.items()}
UNIT_WORDS |= {
    f"{long}{m}": f for long, f in METRIC.values() for m in ("metre", "metres", "meter", "meters")
}
UNIT_WORDS |= dict.fromkeys(("ft", "foot", "feet", "international foot"), 0.3048)
UNIT_WORDS |= dict.fromkeys(
    ("us survey foot", "us survey feet", "us-ft", "ftus", "foot_us"), 1200 / 3937
)
HEAD = re.compile(r"\s*([a-z_]+)\s+(\S+)", re.IGNORECASE)


def _read_ascii_grid(path):
    """Read an ASC grid; the `.prj` beside it names its reference system.

    Returns
    -------
    Raster

    Raises
    ------
    ValueError
        Not a grid, or a damaged one.
    """
    with open_text(path) as stream:
        # Head: words with values, until a line that has none.
        head, line = {}, stream.readline(1000)
        words = (
            "ncols",
            "nrows",
            "xllcorner",
            "xllcenter",
            "yllcorner",
            "yllcenter",
            "cellsize",
            "dx",
            "dy",
            "nodata_value",
        )
        while (match := HEAD.match(line)) and match[1].lower() in words:
            head[match[1].lower()] = match[2]
            line = stream.readline(1000)
        if not {"ncols", "nrows"} <= set(head):
            raise ValueError("its header has no ncols and nrows")
        columns, rows = int(head["ncols"]), int(head["nrows"])
        body = line + stream.read()
    # Body: as many numbers as rows times columns, the northern row first; the head's nodata_value
    # becomes NaN.
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)
        try:
            numbers = np.fromstring(body, dtype=float, sep=" ")
        except DeprecationWarning as error:
            raise ValueError("holds something that is no number") from error
    if len(numbers) != columns * rows:
        raise ValueError(
            f"has {len(numbers):,} heights, but its header announces {columns:,} x {rows:,}"
        )
    heights = numbers.reshape(rows, columns)
    gap = float(head.get("nodata_value", "nan"))
    heights[heights == gap] = np.nan

    def read_cells(top, bottom, left, right):
        return heights[top:bottom, left:right].copy()

    # The system stands in a file of the same name beside it; without this it is unknown.
    plain = Path(path).with_suffix("") if Path(path).suffix.lower() == ".gz" else Path(path)
    beside = next(
        (file for file in map(plain.with_suffix, (".prj", ".PRJ")) if file.is_file()), None
    )
    crs = (
        None
        if beside is None
        else pyproj.CRS.from_user_input(beside.read_text("utf-8").strip()).to_wkt()
    )
    return Raster(path, columns, rows, _matrix_of_head(head, rows), crs, "", 0, 1, read_cells)


def _matrix_of_head(head, rows):
    """Transformation from (column, row, 1) of cell corners: (2, 3) float64."""
    sizes, places = (
        ({"dx", "dy"}, {"cellsize"}),
        [({f"{axis}llcorner"}, {f"{axis}llcenter"}) for axis in "xy"],
    )
    if not all(any(names <= set(head) for names in choice) for choice in (sizes, *places)):
        raise ValueError("its header has no size or no corner of its cells")
    wide, high = (float(head[name] if name in head else head["cellsize"]) for name in ("dx", "dy"))
    west = float(head["xllcorner"]) if "xllcorner" in head else float(head["xllcenter"]) - wide / 2
    south = float(head["yllcorner"]) if "yllcorner" in head else float(head["yllcenter"]) - high / 2
    if not (wide > 0 and high > 0 and np.isfinite([wide, high, west, south]).all()):
        raise ValueError("has cells without size or place")
    return np.array([[wide, 0.0, west], [0.0, -high, south + rows * high]])


@contextmanager
def open_raster(path):
    """Open a raster.

    Yields
    ------
    Raster

    Raises
    ------
    InputError
        Not a raster, or a damaged one, also while it is read.
    """
    open_input(path).close()
    with ExitStack() as stack:
        with _tell_damage(path):
            raster = _open(path, stack)
        # A block may unpack to 256 MB.
        if raster.block_bytes > 2**28:
            raise InputError(
                path, "has blocks of more than 256 MiB", "rewrite it as a tiled GeoTIFF"
            )
        yield replace(raster, read_cells=_tell_damage(path)(raster.read_cells))


@contextmanager
def _tell_damage(path):
    """Errors on damaged bytes become InputErrors, in a block or, as a decorator, in a function."""
    try:
        yield
    except InputError:
        raise
    # What damaged bytes and words raise where they are unpacked and read as numbers.
    except (OSError, ValueError, IndexError, ArithmeticError, struct.error, zlib.error) as error:
        raise InputError.blame(path, UNREADABLE, error, GIVE) from error


def _open(path, stack):
    with open_input(path) as stream:
        start = stream.read(4)
        if start not in (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"):
            return _read_ascii_grid(path)
        with Path(path).open("rb") as plain:
            packed = plain.read(4) != start
        content = io.BytesIO(start + stream.read()) if packed else path
    import tifffile  # imported late: few runs need it

    with InputError.parsing(path, UNREADABLE, GIVE):
        file = stack.enter_context(tifffile.TiffFile(content))
    try:
        return open_geotiff(path, file)
    except (NotImplementedError, CRSError) as reason:
        if importlib.util.find_spec("rasterio") is None:
            raise InputError(
                path,
                " ".join(str(reason).split()),
                (
                    "type: gdalwarp -t_srs EPSG:4326 -co COMPRESS=DEFLATE old.tif "
                    "new.tif (or: pip install rasterio)"
                ),
            ) from reason
        return _open_with_rasterio(path, content, stack)


def _open_with_rasterio(path, content, stack):
    """Open a raster of a rarer kind by GDAL, where rasterio is installed.

    Parameters
    ----------
    path : path-like
    content : path-like or io.BytesIO
    stack : contextlib.ExitStack
        Closes it.

    Returns
    -------
    Raster
    """
    import rasterio
    from rasterio.windows import Window

    dataset = stack.enter_context(rasterio.open(content))

    def read_cells(top, bottom, left, right):
        cells = dataset.read(1, window=Window(left, top, right - left, bottom - top), masked=True)
        return cells.astype(float).filled(np.nan) * dataset.scales[0] + dataset.offsets[0]

    rows, columns = dataset.block_shapes[0]
    size = rows * columns * np.dtype(dataset.dtypes[0]).itemsize
    matrix = np.array(dataset.transform[:6], float).reshape(2, 3)
    crs = dataset.crs.to_wkt() if dataset.crs else None
    return Raster(
        path,
        dataset.width,
        dataset.height,
        matrix,
        crs,
        dataset.units[0] or "",
        size,
        rows,
        read_cells,
    )


def average_window(raster, window, shape):
    """Heights of a window: means over its cells, weighted by the shared area, gaps left out.

    Parameters
    ----------
    raster : Raster
    window : (column, row, width, height)
    shape : (int, int)
        Rows and columns wanted, at most as many as the window has; if equal, the cells themselves.

    Returns
    -------
    (rows, columns) float64
        As stored; NaN where all cells are gaps.
    """
    column, row, width, height = (int(value) for value in window)
    if shape == (height, width):
        return raster.read_cells(row, row + height, column, column + width)
    across, down = _share_cells(width, shape[1]), _share_cells(height, shape[0]).tocsc()
    total, weight = np.zeros(shape), np.zeros(shape)
    # Eight million cells are averaged at a time.
    most = max(2**23 // width, 1)
    step = most // raster.block_rows * raster.block_rows or most  # parts of blocks that are larger
    first = row
    while first < row + height:
        last = min(first // step * step + step, row + height)
        cells = raster.read_cells(first, last, column, column + width)
        known = np.isfinite(cells)
        rows = down[:, first - row : last - row]
        total += rows @ (across @ np.where(known, cells, 0.0).T).T
        weight += rows @ (across @ known.astype(float).T).T
        first = last
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(weight > 0, total / weight, np.nan)


def read_posts(raster, window, most, unit=1.0):
    """Heights of a window at posts in the middle of equal parts of it, means over their cells.

    Parameters
    ----------
    raster : Raster
    window : (column, row, width, height)
    most : int
        Posts on a side at most; a finer raster is averaged.
    unit : float
        Metres per unit of a raster without a coordinate reference system.

    Returns
    -------
    heights : (rows, columns) float64 [m]
        NaN in gaps, which are also where no land can be that low or high.
    matrix : (2, 3) float64
        From (column, row, 1) of posts to the raster's system.
    """
    column, row, width, height = (int(value) for value in window)
    if width * height > FREE_BYTES + LARGEST_GAIN * Path(raster.path).stat().st_size:
        raise InputError(
            raster.path,
            f"has {width:,} x {height:,} cells around the city, an implausible number for the size "
            "of the file",
            "give a coarser raster, or a window of it",
        )
    shape, factor = (min(height, most), min(width, most)), _height_factor(raster, unit)

    def read_land(*cells):
        heights = raster.read_cells(*cells) * factor
        with np.errstate(invalid="ignore"):
            return np.where((heights >= LOWEST) & (heights <= HIGHEST), heights, np.nan)

    heights = average_window(replace(raster, read_cells=read_land), window, shape)
    wide, high = width / shape[1], height / shape[0]
    turn, first = raster.matrix[:, :2], (column + wide / 2, row + high / 2)
    return heights, np.column_stack([turn * (wide, high), turn @ first + raster.matrix[:, 2]])


def _share_cells(count, wanted):
    """Overlap of so many cells with so many equal intervals over all of them: (wanted, count)
    sparse array.
    """
    edges = np.arange(wanted + 1) * (count / wanted)
    first = np.floor(edges[:-1]).astype(int)
    reach = int(np.ceil(count / wanted)) + 1
    cells = first[:, None] + np.arange(reach)  # (wanted, reach) those that an interval can touch
    overlap = np.minimum(edges[1:, None], cells + 1) - np.maximum(edges[:-1, None], cells)
    touched = (overlap > 1e-9) & (cells < count)
    interval = np.broadcast_to(np.arange(wanted)[:, None], cells.shape)
    return sparse.csr_array(
        (overlap[touched], (interval[touched], cells[touched])), shape=(wanted, count)
    )


def windows_around(raster, places):
    """Parts of a raster around places, (k, 2) in its system: list of (column, row, width, height)
    and middle longitude.

    One for each turn around the Earth in which longitudes may be written: two where a map of the
    globe begins and ends. The middle belongs to the last place, None without longitudes.
    """
    turn, windows = raster.crs and full_turn(raster.crs), []
    for count in (-1, 0, 1) if turn else (0,):
        own, middle = places.copy(), None
        if turn:
            middle = places[-1, 0] + count * turn
            own[:, 0] = turn_towards(own[:, 0], middle, turn)
        (west, south), (east, north) = own.min(axis=0), own.max(axis=0)
        corners = np.array([(west, south), (west, north), (east, south), (east, north)])
        cells = np.linalg.solve(raster.matrix[:, :2], corners.T - raster.matrix[:, 2:]).T
        first = np.maximum(np.floor(cells.min(axis=0)).astype(np.int64) - 1, 0)
        last = np.minimum(
            np.ceil(cells.max(axis=0)).astype(np.int64) + 1, (raster.width, raster.height)
        )
        if (last - first > 1).all():
            windows.append(((*first, *(last - first)), middle))
    return windows


def _height_factor(raster, unit=1.0):
    """Metres per unit of the heights: as given by the band, else by the coordinate reference
    system.
    """
    word = raster.unit.strip().lower()
    if word in UNIT_WORDS:
        return UNIT_WORDS[word]
    return unit if raster.crs is None else transform_crs.plane_of(raster.crs)[1]


def full_turn(crs):
    """What longitudes of a system in degrees grow by around the Earth; None for any other
    system.
    """
    plane, _ = plane_of(crs)
    return 2 * np.pi / plane.axis_info[0].unit_conversion_factor if plane.is_geographic else None


def turn_towards(longitude, middle, turn):
    """Turn longitudes by whole turns to within half a turn of a middle one: a map may go on beyond
    180°.
    """
    return middle + (longitude - middle + turn / 2) % turn - turn / 2
