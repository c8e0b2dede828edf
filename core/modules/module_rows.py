"""Rows of rectangles in polygons, as many as fit: exact free stretches of strips, and the best
places of rows.

      y      ╱╲                   A row is a strip as high as a module. What edges of the polygon and
      │     ╱  ╲                  blocked boxes take of it is known from where they enter and leave
      │    ╱▒▒▒▒╲     row 1       the strip; modules fill the stretches between, side by side. So no
      │   ╱ ▒▒▒▒ ╲                module leaves the polygon, and none overlaps another.
      │  ╱▒▒▒▒▒▒▒▒╲   row 0
      └──────────────── x
"""

import numpy as np
from numba import njit

from ..settings.tolerances import GEOMETRY

SLACK = GEOMETRY.computed  # [m] by which lengths may be too short


@njit(nogil=True, cache=True)
def fill_polygons(shapes, formats, gaps, most):
    """Modules in each of n polygons, in the format that fits more of them; the first one if as many do.

    Parameters
    ----------
    shapes : tuple
        edges (e, 4) float64 [m], x and y of both ends, of outlines and holes in any direction;
        edge_start (n + 1,) int64; boxes (b, 4) float64 [m] that are blocked, least x and y, largest
        x and y; box_start (n + 1,) int64.
    formats : (f, 2) float64 [m]
        Width along a row and height of a module.
    gaps : (n, 2) float64 [m]
        Least distance between modules; path behind every second row, no less than that.
    most : (n + 1,) int64
        Room in the results: sums of at least as many modules as the area of each polygon holds.

    Returns
    -------
    count : (n,) int64
    chosen : (n,) int64
        Into formats.
    left, low : (most[-1],) float64 [m]
        Lower left corners; of polygon k from most[k] on.
    row : (most[-1],) int64
        From below, 0 for the lowest one with modules.
    """
    edges, edge_start, boxes, box_start = shapes
    polygons = len(edge_start) - 1
    count, chosen = np.zeros(polygons, np.int64), np.zeros(polygons, np.int64)
    left, low = np.empty(most[-1]), np.empty(most[-1])
    row = np.empty(most[-1], np.int64)
    for polygon in range(polygons):
        own = edges[edge_start[polygon] : edge_start[polygon + 1]]
        taken = boxes[box_start[polygon] : box_start[polygon + 1]]
        # Rows of each format at their best places; the best format is kept.
        best = np.empty(0)
        for number in range(len(formats)):
            width, height = formats[number]
            rows, total = _choose_rows(own, taken, width, height, gaps[polygon])
            if total > count[polygon]:
                count[polygon], chosen[polygon], best = total, number, rows
        # Modules side by side in the middle of each free stretch.
        width, height = formats[chosen[polygon]]
        place, gap = most[polygon], gaps[polygon, 0]
        for number in range(len(best)):
            for stretch in _free_stretches(own, taken, best[number], best[number] + height, width):
                fits = _fit(stretch, width, gap)
                start = 0.5 * (stretch[0] + stretch[1] - fits * (width + gap) + gap)
                for step in range(fits):
                    left[place], low[place] = start + step * (width + gap), best[number]
                    row[place] = number
                    place += 1
    return count, chosen, left, low, row


@njit(nogil=True, cache=True)
def _fit(stretch, width, gap):
    """Number of modules that fit side by side into a stretch."""
    return int((stretch[1] - stretch[0] + gap + SLACK) / (width + gap))


@njit(nogil=True, cache=True)
def _choose_rows(edges, boxes, width, height, gaps):
    """Lower edges of rows, (r,) float64 from below, that hold most modules, and their number.

    Of all places where a row may begin the best are chosen from above (dynamic programming).
    """
    gap = gaps[0]
    starts = _list_starts(edges, boxes, height, gap)
    count = len(starts)
    fits = np.zeros(count, np.int64)
    for number in range(count):
        high = starts[number] + height
        for stretch in _free_stretches(edges, boxes, starts[number], high, width):
            fits[number] += _fit(stretch, width, gap)
    # after[k, j]  the first place behind a row at the j-th, with a gap (k = 0) or a path (k = 1).
    after = np.empty((2, count), np.int64)
    for kind in range(2):
        behind = count
        for number in range(count - 1, -1, -1):
            end = starts[number] + height + gaps[kind] - SLACK
            while behind > 0 and starts[behind - 1] >= end:
                behind -= 1
            after[kind, number] = behind
    # most[k, j]  modules in rows that begin at the j-th place or above, the next of them the first
    # (k = 0) or the second (k = 1) behind a path.
    most = np.zeros((2, count + 1), np.int64)
    for number in range(count - 1, -1, -1):
        beyond_path = most[0, after[1, number]]
        beyond_gap = max(most[1, after[0, number]], beyond_path)
        most[0, number] = max(most[0, number + 1], fits[number] + beyond_gap)
        most[1, number] = max(most[1, number + 1], fits[number] + beyond_path)
    # From below: a row wherever it belongs to the most.
    rows, found, number, kind = np.empty(count), 0, 0, 0
    while number < count:
        beyond_path = most[0, after[1, number]]
        beyond_gap = most[1, after[0, number]] if kind == 0 else -1
        if fits[number] and fits[number] + max(beyond_gap, beyond_path) == most[kind, number]:
            rows[found] = starts[number]
            found += 1
            kind = int(beyond_gap >= beyond_path)
            number = after[1 - kind, number]
        else:
            number += 1
    return rows[:found], most[0, 0]


@njit(nogil=True, cache=True)
def _list_starts(edges, boxes, height, gap):
    """Where rows may begin, ascending: at eighths of their height from the bottom and from the top
    of a polygon, and up to four above and below each blocked box; none where a row is too high.
    """
    left, bottom, right, top = np.inf, np.inf, -np.inf, -np.inf
    for x0, y0, x1, y1 in edges:
        left, right = min(left, x0, x1), max(right, x0, x1)
        bottom, top = min(bottom, y0, y1), max(top, y0, y1)
    # Bounds of the polygon; a row that is higher than it fits nowhere.
    highest, pitch = top - height, height + gap
    if not highest + SLACK >= bottom:
        return np.empty(0)
    # Candidates up from the bottom and down from the top, an eighth of a row apart.
    count = 2 * (int((highest - bottom + SLACK) / pitch * 8) + 1)
    starts = np.empty(count + 8 * len(boxes))
    starts[:count:2] = bottom + pitch / 8 * np.arange(count // 2)
    starts[1:count:2] = highest - pitch / 8 * np.arange(count // 2)
    # Rows that touch a blocked box from above or below, and the next three.
    for box in boxes:
        for number in range(4):
            for start in (box[3] + number * pitch, box[1] - height - number * pitch):
                if bottom <= start <= highest:
                    starts[count] = start
                    count += 1
    # Strips that a box takes in their whole width hold nothing.
    starts = np.sort(starts[:count])
    free = np.ones(count, np.bool_)
    for number in range(count):
        for box in boxes:
            if box[0] <= left and box[2] >= right:
                begins = box[1] < starts[number] + height - SLACK
                free[number] &= not (begins and box[3] > starts[number] + SLACK)
    return starts[free]


@njit(nogil=True, cache=True)
def _free_stretches(edges, boxes, low, high, least):
    """Stretches of a strip that lie inside a polygon and outside of boxes in its whole height, and
    are at least as long as `least`: (s, 2) float64, left and right end [m].
    """
    # What an edge or a box takes of the strip, from its leftmost to its rightmost point there.
    taken, count = np.empty((len(edges) + len(boxes), 2)), 0
    for x0, y0, x1, y1 in edges:
        if max(y0, y1) <= low + SLACK or min(y0, y1) >= high - SLACK:
            continue
        begin = x0 if low <= y0 <= high else x0 + _share(y0, y1, low, high) * (x1 - x0)
        end = x1 if low <= y1 <= high else x1 + _share(y1, y0, low, high) * (x0 - x1)
        _insert(taken, count, min(begin, end), max(begin, end))
        count += 1
    for x0, y0, x1, y1 in boxes:
        if y1 > low + SLACK and y0 < high - SLACK:
            _insert(taken, count, x0, x1)
            count += 1
    # Between these no edge passes: a stretch lies inside if its middle does.
    free, found, reach = np.empty((count + 1, 2)), 0, -np.inf
    for number in range(count):
        begin = taken[number, 0]
        if begin - reach >= least - SLACK and _lies_inside(
            edges, 0.5 * (reach + begin), 0.5 * (low + high)
        ):
            free[found, 0], free[found, 1] = reach, begin
            found += 1
        reach = max(reach, taken[number, 1])
    return free[:found]


@njit(nogil=True, cache=True)
def _insert(taken, count, begin, end):
    """Put a stretch among the first `count` of some, which ascend."""
    place = count
    while place > 0 and taken[place - 1, 0] > begin:
        taken[place, 0], taken[place, 1] = taken[place - 1, 0], taken[place - 1, 1]
        place -= 1
    taken[place, 0], taken[place, 1] = begin, end


@njit(nogil=True, cache=True)
def _share(height, other, low, high):
    """Share of an edge's length, from an end that lies outside a strip, where it enters it."""
    return ((low if height < low else high) - height) / (other - height)


@njit(nogil=True, cache=True)
def _lies_inside(edges, x, y):
    """Whether a place lies inside a polygon: an odd number of edges passes to the left of it."""
    inside = False
    for x0, y0, x1, y1 in edges:
        if (y0 <= y) != (y1 <= y) and x0 + (y - y0) / (y1 - y0) * (x1 - x0) < x:
            inside = not inside
    return inside
