"""Colour maps: stops, rounded ranges, ticks and interpolation."""

from dataclasses import dataclass, field

import numpy as np

from ..settings.errors import show_number

# Perceptually uniform maps, sRGB at 17 equal steps from low to high: viridis and inferno by S. van
# der Walt and N. Smith (CC0), cividis by Nuñez, Anderton and Renslow (2018),
# https://doi.org/10.1371/journal.pone.0199239.
MAPS = {
    "viridis": "440154 48186a 472d7b 424086 3b528b 33638d 2c728e 26828e 21918c 1fa088 28ae80 "
    "3fbc73 5ec962 84d44b "
    "addc30 d8e219 fde725",
    "cividis": "00224e 002e6a 1a386f 32436d 434e6c 535a6d 61656f 6f7073 7d7c78 8c8878 9b9476 "
    "aba072 bcae6c cdbb63 "
    "dec958 f0d846 fee838",
    "inferno": "000004 0b0724 210c4a 3d0965 57106e 71196e 8a226a a32c61 bc3754 d24644 e45a31 "
    "f1731d f98e09 fcac11 "
    "f9cb35 f2ea69 fcffa4",
}
# For differences, from below zero to above: in CIELAB lightness falls evenly from 93 to 40 and
# chroma grows evenly from 0 to 42 to both sides, at the hues 275° and 45°.
DIVERGING = (
    "1960a3 4270ac 5f80b5 7891be 90a2c7 a7b4d0 bec6d9 d4d8e2 "
    "ebebeb e3d6d1 d9c1b8 d0aca0 c59888 ba8371 ae705a a25c44 94492f"
)
MISSING = "8f8f8c"  # faces without this result
GROUND = "dededa"  # generated ground, and the sky of a picture
MODULES = "14213d"  # modules, as in web/viewer.js


def choose_range(values, areas):
    """Rounded range that covers 96 % of the area: 2nd to 98th percentile, widened to full ticks.

    Parameters
    ----------
    values : (f,) float
        NaN where missing.
    areas : (f,) float [m²]

    Returns
    -------
    low, high : float
        0 and 1 where no value is finite.
    """
    known = np.isfinite(values)
    if not known.any():
        return 0.0, 1.0
    values, areas = values[known].astype(float), areas[known].astype(float)
    order = np.argsort(values)
    share = (
        np.cumsum(areas[order]) / areas.sum() if areas.sum() > 0 else np.linspace(0, 1, len(values))
    )
    ends = np.minimum(np.searchsorted(share, [0.02, 0.98]), len(values) - 1)
    low, high = values[order][ends]
    step = tick_step(low, high)
    low, high = np.floor(low / step + 1e-6) * step, np.ceil(high / step - 1e-6) * step
    return float(low), float(high if high > low else low + step)


def tick_step(low, high):
    """Distance of ticks: 1, 2 or 5 times a power of ten, giving four to ten ticks."""
    span = high - low
    if not span > 1e-9 * max(abs(low), abs(high)):
        span = max(abs(high), 1e-3)
    power = 10.0 ** np.floor(np.log10(span / 4))
    return float(
        power * max(factor for factor in (1, 2, 5) if factor * power <= span / 4 * (1 + 1e-9))
    )


@dataclass
class ColourScale:
    """Mapping from values to colours, with what a legend writes beside it."""

    name: str  # of what is shown
    title: str
    unit: str  # "" if it has none
    low: float
    high: float
    stops: np.ndarray  # (k, 3) sRGB in 0–1, equally spaced from low to high, or one per class
    # names of the codes 0, 1, …; empty for a continuous scale
    classes: list = field(default_factory=list)

    @staticmethod
    def of_map(name, title, unit, ends, colour_map):
        """Scale from one value to another, by a name of `MAPS`; without, of differences."""
        stops = _read_stops((MAPS[colour_map] if colour_map else DIVERGING).split())
        return ColourScale(name, title, unit, *ends, stops)

    @staticmethod
    def of_classes(name, title, colours):
        """Scale of codes from 0 on, by the colour of each class: dict of str to str."""
        stops = _read_stops(colours.values())
        return ColourScale(name, title, "", -0.5, len(stops) - 0.5, stops, list(colours))

    def heading(self):
        """Title with its unit."""
        return f"{self.title} [{self.unit}]" if self.unit else self.title

    @property
    def ticks(self):
        """Values labelled beside the bar, (j,): multiples of the step within the range; none for
        classes.
        """
        step = tick_step(self.low, self.high)
        ends = np.ceil(self.low / step - 1e-6), np.floor(self.high / step + 1e-6) + 1
        return np.empty(0) if self.classes else np.arange(*ends) * step

    def labels(self):
        """What is written beside the bar, with its place as a share of the bar's length: list of
        (float, str).
        """
        if self.classes:
            return [
                ((code + 0.5) / len(self.classes), name) for code, name in enumerate(self.classes)
            ]
        shares = (self.ticks - self.low) / (self.high - self.low)
        decimals = max(0, int(-np.floor(np.log10(tick_step(self.low, self.high)) + 1e-9)))
        return [
            (share, show_number(tick, decimals))
            for share, tick in zip(shares, self.ticks, strict=True)
        ]

    def colours(self, values):
        """Colours of values: (f,) → (f, 3) sRGB in 0–1; `MISSING` if a value is NaN."""
        place = (np.asarray(values, dtype=float) - self.low) / (self.high - self.low)
        colours, count = np.tile(srgb_colour(MISSING), (len(place), 1)), len(self.stops)
        known = np.isfinite(place)
        place = np.clip(place[known], 0, 1)
        of_class = self.stops[np.minimum((place * count).astype(int), count - 1)]
        colours[known] = of_class if self.classes else srgb_light(mix_stops(self.stops, place))
        return colours


def _read_stops(texts):
    """Colours written as six hexadecimal digits: (k, 3) sRGB in 0–1."""
    return np.array([srgb_colour(text) for text in texts])


def mix_stops(stops, place):
    """Colours interpolated in linear RGB between stops at equal steps from 0 to 1.

    Parameters
    ----------
    stops : (k, 3) float
        sRGB in 0–1.
    place : (f,) float
        Clipped to 0–1.

    Returns
    -------
    (f, 3) float
        Linear light in 0–1.
    """
    position, linear = np.linspace(0, 1, len(stops)), linear_light(stops)
    return np.stack(
        [np.interp(place, position, linear[:, channel]) for channel in range(3)], axis=1
    )


def linear_light(srgb):
    """From sRGB in 0–1 to linear light (IEC 61966-2-1)."""
    srgb = np.asarray(srgb, dtype=float)
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def srgb_light(linear):
    """From linear light to sRGB in 0–1 (IEC 61966-2-1)."""
    linear = np.asarray(linear, dtype=float)
    return np.where(
        linear <= 0.0031308, linear * 12.92, 1.055 * np.maximum(linear, 1e-12) ** (1 / 2.4) - 0.055
    )


def srgb_colour(text):
    """Colour written as six hexadecimal digits → (3,) sRGB in 0–1."""
    return np.array([int(text[place : place + 2], 16) / 255 for place in (0, 2, 4)])
