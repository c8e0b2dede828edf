"""Position of the sun over the year, and which positions were traced (paper, Fig. 2)."""

import numpy as np
import pandas as pd

from ..sun.solar_position import solar_position
from .picture import make_figure
from .words import say

HOUR, DAY = pd.Timedelta(hours=1), pd.Timedelta(days=1)


def hour_curves(times, interval, latitude, longitude, *, every=4):
    """Position of the sun at each hour of the day, over the year of a time axis.

    Parameters
    ----------
    times : pandas.DatetimeIndex, (T,)
        Start of the intervals, UTC; an hour of the day stands for the middle of the first interval
        in it.
    interval : pandas.Timedelta
    latitude, longitude : float [°]

    Returns
    -------
    dict of str to ((d,), (d,)) numpy.ndarray
        Hour of the day "11:30" → azimuth and apparent elevation [°], elevation NaN below the
        horizon.
    """
    phase = (times[0] - times[0].floor("D")) % HOUR
    first = pd.Timestamp(year=times[len(times) // 2].year, month=1, day=1, tz="UTC") + phase
    # `every`: [days] between the points of a curve of one hour.
    days = pd.date_range(first, periods=366 // every + 1, freq=every * DAY)
    curves = {}
    for hour in range(24):
        start = days + hour * HOUR
        curves[f"{start[0] + interval / 2:%H:%M}"] = _place_sun(
            start, interval, latitude, longitude
        )
    return {name: curve for name, curve in curves.items() if np.isfinite(curve[1]).any()}


def day_path(year, month, day, latitude, longitude):
    """Azimuth and apparent elevation of the sun through one day of local solar time: two (t,)
    arrays [°].
    """
    midnight = pd.Timestamp(year=year, month=month, day=day, tz="UTC") - pd.Timedelta(
        hours=longitude / 15
    )
    times = pd.date_range(midnight, midnight + DAY, freq=pd.Timedelta(minutes=5))
    return _place_sun(times, pd.Timedelta(0), latitude, longitude)


def _place_sun(times, interval, latitude, longitude):
    """Azimuth and apparent elevation in the middle of intervals [°], elevation NaN below the
    horizon.
    """
    position = solar_position(times, interval, latitude, longitude)
    elevation = 90 - position["apparent_zenith"].to_numpy()
    return position["solar_azimuth"].to_numpy(), np.where(elevation > 0, elevation, np.nan)


def draw_sun_path(times, interval, latitude, longitude, suns):
    """Draw the sun's elevation against its azimuth, with the suns that were traced.

    Parameters
    ----------
    times : pandas.DatetimeIndex, (T,)
        Start of the weather's intervals, UTC.
    interval : pandas.Timedelta
    latitude, longitude : float [°]
    suns : (s, 3) array
        Unit vectors towards the traced suns.

    Returns
    -------
    matplotlib.figure.Figure
    """
    low = 0 if latitude >= 0 else -180  # the middle of the picture looks to the equator
    figure = make_figure(10, 4.6)
    axes = figure.subplots()
    # Curves of each hour through the year, with its name at the top.
    for name, (azimuth, elevation) in hour_curves(times, interval, latitude, longitude).items():
        x, y = _break_at_edge((azimuth - low) % 360 + low, elevation)
        axes.plot(x, y, color="#b9c9dc", linewidth=1.2)
        top = np.nanargmax(y)
        # An hour is named where the sun stands above 5°.
        if y[top] > 5.0:
            # Beside the path of the longest day, which falls to both sides.
            aside = 16 * float(np.clip((x[top] - low - 180) / 90, -1, 1))
            axes.annotate(
                name,
                (x[top], y[top]),
                (aside, 6),
                textcoords="offset points",
                ha="center",
                fontsize=7,
            )
    # Paths of the longest, shortest and equal days.
    year = times[len(times) // 2].year
    # Month and day: name and colour of its path.
    days = {
        (6, 21): ("21 June", "#D55E00"),
        (3, 21): ("21 March (and 23 September)", "#8a8a86"),
        (12, 21): ("21 December", "#0072B2"),
    }
    for (month, day), (name, colour) in days.items():
        azimuth, elevation = day_path(year, month, day, latitude, longitude)
        x, y = _break_at_edge((azimuth - low) % 360 + low, elevation)
        axes.plot(x, y, color=colour, linewidth=1.6, label=say(name))
    # The traced suns as points on them.
    east, north, up = np.asarray(suns, float).T
    azimuth, elevation = (
        np.degrees(np.arctan2(east, north)),
        np.degrees(np.arcsin(np.clip(up, -1, 1))),
    )
    x = (azimuth - low) % 360 + low
    axes.plot(
        x,
        elevation,
        "o",
        color="#009E73",
        markersize=3.2,
        label=say("traced: {count:,} suns", count=len(suns)),
        zorder=3,
    )
    # Compass below, elevation beside.
    ticks, compass = np.arange(low, low + 361, 45), ("N", "NE", "E", "SE", "S", "SW", "W", "NW")
    axes.set_xticks(ticks, [f"{say(compass[tick // 45 % 8])}\n{tick % 360}°" for tick in ticks])
    axes.set(xlim=(low, low + 360), ylim=(0, min(axes.get_ylim()[1] + 4, 93)))
    axes.set(xlabel=say("Azimuth of the sun"), ylabel=say("Elevation of the sun [°]"))
    axes.legend(loc="lower left", bbox_to_anchor=(0, 1.01), ncols=4, fontsize=8.5)
    return figure


def _break_at_edge(azimuth, elevation):
    """The curve with a gap where it leaves the picture on one side and comes back on the other."""
    jump = np.flatnonzero(np.abs(np.diff(azimuth)) > 180) + 1
    return np.insert(azimuth, jump, np.nan), np.insert(elevation, jump, np.nan)
