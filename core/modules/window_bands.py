"""Windows that a file does not draw: bands of storeys, which leave the rest of a facade to modules.

  ╱╲            gable: blind, as what is above the eaves has no storeys
 ╱  ╲
│████│ window_band │ storey, from the lowest point of the building on
│    │             │
│████│
│    │
│▒▒▒▒│          the lowest storey carries no modules at all
└────┘
"""

import math

import numpy as np


def window_boxes(outline, lowest, storey, window_band, *, ground_floor=False):
    """What windows keep free of a facade: (b, 4) float64 [m], least x and y, largest x and y.

    Parameters
    ----------
    outline : array, (k, 2) float64 [m]
        Outer ring in the plane of the facade, y upwards, closed, counter-clockwise from outside.
    lowest : float [m]
        y of the lowest point of its building.
    storey, window_band : float [m]
        Along y. Windows fill the upper part of each storey.
    ground_floor : bool
        Whether the lowest storey carries modules between its windows; else none.
    """
    xs, ys = outline.T.tolist()
    left, right, top = min(xs), max(xs), max(ys)
    # Bands of all storeys that reach into the facade; the lowest one is kept free altogether.
    bands, first = [], math.floor((min(ys) - lowest) / storey)
    for level in range(first, math.ceil((top - lowest) / storey)):
        high = lowest + (level + 1) * storey
        low = high - (storey if level <= 0 and not ground_floor else window_band)
        if high > low:
            bands.append((left, low, right, high))
    # Gables are blind: above their eaves a band is left out, beside them it goes on.
    for begin, end, eaves in _find_gables(list(zip(xs, ys, strict=True))[:-1]):
        parts = []
        for x0, low, x1, high in bands:
            parts += [(x0, low, min(x1, begin), high), (max(x0, end), low, x1, high)]
            parts.append((max(x0, begin), low, min(x1, end), min(high, eaves)))
        bands = [box for box in parts if box[2] > box[0] and box[3] > box[1]]
    return np.array(bands, float).reshape(-1, 4)


def _find_gables(places, *, slope=0.1):
    """Gables of a wall with some corners: list of (left end, right end, height of the eaves) [m].

    A stretch of its upper edge that is not level, between upright edges. The eaves are the higher
    end of what rises between its ends, and the lower end of what rises from one to the other.
    """
    count = len(places)
    # Seen from outside the upper edge runs from right to left; it starts behind another edge.
    steps = [
        (places[(number + 1) % count][0] - x, places[(number + 1) % count][1] - y)
        for number, (x, y) in enumerate(places)
    ]
    upper = [x < 0 and abs(y) < 10 * abs(x) for x, y in steps]
    if all(upper) or not any(upper):
        return []
    start = next(number for number in range(count) if not upper[number - 1])
    gables, run = [], []
    for number in [(start + step) % count for step in range(count)] + [None]:
        if number is not None and upper[number]:
            run.append(number)
            continue
        if any(abs(steps[own][1]) > slope * abs(steps[own][0]) for own in run):
            corners = [places[own] for own in run] + [places[(run[-1] + 1) % count]]
            ends = corners[0][1], corners[-1][1]
            rises = max(y for _, y in corners) > max(ends) + 0.1
            gables.append((corners[-1][0], corners[0][0], max(ends) if rises else min(ends)))
        run = []
    return gables
