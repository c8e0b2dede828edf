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
    """Modules in each of n polygons, in the format that fits more of them; the first one if as many
    do.

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
    # Room for what the loops below find, in a polygon or a strip.
    largest = 0
    for polygon in range(polygons):
        shape = (
            edge_start[polygon],
            edge_start[polygon + 1],
            box_start[polygon],
            box_start[polygon + 1],
        )
        largest = max(largest, shape[1] - shape[0] + shape[3] - shape[2])
    taken, free = np.empty((largest, 2)), np.empty((largest + 1, 2))
    for polygon in range(polygons):
        shape = (
            edge_start[polygon],
            edge_start[polygon + 1],
            box_start[polygon],
            box_start[polygon + 1],
        )
        strips = edges, boxes, shape, taken, free
        # Rows of each format at their best places; the best format is kept.
        best, rows = np.empty(0), 0
        for number in range(len(formats)):
            width, height = formats[number, 0], formats[number, 1]
            starts = _list_starts(strips, height, gaps[polygon, 0])
            distances = gaps[polygon, 0], gaps[polygon, 1]
            found, total = _choose_rows(strips, starts, (width, height), distances)
            if total > count[polygon]:
                count[polygon], chosen[polygon], best, rows = total, number, starts, found
        # Modules side by side in the middle of each free stretch.
        width, height = formats[chosen[polygon], 0], formats[chosen[polygon], 1]
        place, gap = most[polygon], gaps[polygon, 0]
        for number in range(rows):
            stretches = _free_stretches(strips, best[number], best[number] + height, width)
            for stretch in range(stretches):
                begin, end = free[stretch, 0], free[stretch, 1]
                fits = _fit(begin, end, width, gap)
                start = 0.5 * (begin + end - fits * (width + gap) + gap)
                for step in range(fits):
                    left[place], low[place] = start + step * (width + gap), best[number]
                    row[place] = number
                    place += 1
    return count, chosen, left, low, row


@njit(nogil=True, cache=True)
def _fit(begin, end, width, gap):
    """Number of modules that fit side by side into a stretch."""
    return int((end - begin + gap + SLACK) / (width + gap))


@njit(nogil=True, cache=True)
def _choose_rows(strips, starts, size, distances):
    """Write into the first of `starts` the lower edges of the rows that hold most modules, from
    below; return how many rows they are, and how many modules.

    Of all places where a row may begin the best are chosen from above (dynamic programming).
    """
    (width, height), (gap, path), free, count = size, distances, strips[4], len(starts)
    fits = np.zeros(count, np.int64)
    for number in range(count):
        stretches = _free_stretches(strips, starts[number], starts[number] + height, width)
        for stretch in range(stretches):
            fits[number] += _fit(free[stretch, 0], free[stretch, 1], width, gap)
    # after[k, j]  the first place behind a row at the j-th, with a gap (k = 0) or a path (k = 1).
    after = np.empty((2, count), np.int64)
    for kind in range(2):
        behind, distance = count, gap if kind == 0 else path
        for number in range(count - 1, -1, -1):
            end = starts[number] + height + distance - SLACK
            while behind > 0 and starts[behind - 1] >= end:
                behind -= 1
            after[kind, number] = behind
    # most[k, j]  modules in rows that begin at the j-th place or above, the next of them the first
    # (k = 0) or the second (k = 1) behind a path.
    most = np.zeros((2, count + 1), np.int64)
    for number in range(count - 1, -1, -1):
        most[0, number], most[1, number] = most[0, number + 1], most[1, number + 1]
        if fits[number]:
            beyond_path = most[0, after[1, number]]
            beyond_gap = max(most[1, after[0, number]], beyond_path)
            most[0, number] = max(most[0, number], fits[number] + beyond_gap)
            most[1, number] = max(most[1, number], fits[number] + beyond_path)
    # From below: a row wherever it belongs to the most.
    rows, number, kind = 0, 0, 0
    while number < count:
        beyond_path = most[0, after[1, number]]
        beyond_gap = most[1, after[0, number]] if kind == 0 else -1
        if fits[number] and fits[number] + max(beyond_gap, beyond_path) == most[kind, number]:
            starts[rows] = starts[number]
            rows += 1
            kind = int(beyond_gap >= beyond_path)
            number = after[1 - kind, number]
        else:
            number += 1
    return rows, most[0, 0]


@njit(nogil=True, cache=True)
def _list_starts(strips, height, gap):
    """Where rows may begin, ascending: at eighths of row and gap from the bottom and from the top
    of a polygon, and up to four above and below each blocked box; none where a row is too high.
    """
    edges, boxes, (first_edge, last_edge, first_box, last_box) = strips[0], strips[1], strips[2]
    left, bottom, right, top = np.inf, np.inf, -np.inf, -np.inf
    for edge in range(first_edge, last_edge):
        left = min(left, edges[edge, 0], edges[edge, 2])
        right = max(right, edges[edge, 0], edges[edge, 2])
        bottom = min(bottom, edges[edge, 1], edges[edge, 3])
        top = max(top, edges[edge, 1], edges[edge, 3])
    # A row that is higher than the polygon fits nowhere.
    highest, pitch = top - height, height + gap
    if not highest + SLACK >= bottom:
        return np.empty(0)
    # Candidates up from the bottom and down from the top, an eighth of a row and its gap apart.
    eighths = int((highest - bottom + SLACK) / pitch * 8) + 1
    starts = np.empty(2 * eighths + 8 * (last_box - first_box))
    for number in range(eighths):
        starts[2 * number] = bottom + pitch / 8 * number
        starts[2 * number + 1] = highest - pitch / 8 * number
    # Rows that touch a blocked box from above or below, and the next three.
    count = 2 * eighths
    for box in range(first_box, last_box):
        for number in range(8):
            above, below = number * pitch, height + (number - 4) * pitch
            start = boxes[box, 3] + above if number < 4 else boxes[box, 1] - below
            if bottom <= start <= highest:
                starts[count] = start
                count += 1
    # Strips that a box takes in their whole width hold nothing.
    kept = np.int64(0)  # a plain 0 is a type of its own, for which numba compiles `_sort` again
    for number in range(count):
        blocked = False
        for box in range(first_box, last_box):
            if boxes[box, 0] <= left and boxes[box, 2] >= right:
                begins = boxes[box, 1] < starts[number] + height - SLACK
                blocked |= begins and boxes[box, 3] > starts[number] + SLACK
        starts[kept] = starts[number]
        kept += not blocked
    return _sort(starts, kept)


@njit(nogil=True, cache=True)
def _sort(values, count):
    """The first of some numbers, ascending (Shell's method, which compiles faster than NumPy's)."""
    found = np.empty(count)
    for number in range(count):
        found[number] = values[number]
    step = count // 2
    while step:
        for number in range(step, count):
            value, place = found[number], number
            while place >= step and found[place - step] > value:
                found[place] = found[place - step]
                place -= step
            found[place] = value
        step //= 2
    return found


@njit(nogil=True, cache=True)
def _free_stretches(strips, low, high, least):
    """Number of stretches of a strip that lie inside a polygon and outside of boxes in its whole
    height, and are at least as long as `least`.

    Parameters
    ----------
    strips : tuple
        `edges` and `boxes` of all polygons; first and last + 1 of both of this one; room for what
        is taken; (s, 2) float64, where left and right ends of the stretches are written [m].
    low, high, least : float [m]
    """
    edges, boxes, (first_edge, last_edge, first_box, last_box), taken, free = strips
    # What an edge or a box takes of the strip, from its leftmost to its rightmost point there.
    count = np.int64(0)
    for edge in range(first_edge, last_edge):
        x0, y0, x1, y1 = edges[edge, 0], edges[edge, 1], edges[edge, 2], edges[edge, 3]
        if max(y0, y1) <= low + SLACK or min(y0, y1) >= high - SLACK:
            continue
        begin = x0 if low <= y0 <= high else x0 + _share(y0, y1, low, high) * (x1 - x0)
        end = x1 if low <= y1 <= high else x1 + _share(y1, y0, low, high) * (x0 - x1)
        _insert(taken, count, min(begin, end), max(begin, end))
        count += 1
    for box in range(first_box, last_box):
        if boxes[box, 3] > low + SLACK and boxes[box, 1] < high - SLACK:
            _insert(taken, count, boxes[box, 0], boxes[box, 2])
            count += 1
    # Between these no edge passes: a stretch lies inside if its middle does.
    found, reach, middle = 0, -np.inf, 0.5 * (low + high)
    for number in range(count):
        begin = taken[number, 0]
        if begin - reach >= least - SLACK:
            inside, x = False, 0.5 * (reach + begin)
            for edge in range(first_edge, last_edge):
                x0, y0, x1, y1 = edges[edge, 0], edges[edge, 1], edges[edge, 2], edges[edge, 3]
                if (y0 <= middle) != (y1 <= middle):
                    inside ^= x0 + (middle - y0) / (y1 - y0) * (x1 - x0) < x
            if inside:
                free[found, 0], free[found, 1] = reach, begin
                found += 1
        reach = max(reach, taken[number, 1])
    return found


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
