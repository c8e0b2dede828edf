"""The built-in climate as weather of one place; clear sky at sea."""

import pandas as pd

from ..climate.climate_grid import look_up_normals
from ..climate.make_climates import look_up_altitude, make_climates
from .clear_sky import clear_sky
from .record import Record

NAMES = ["ghi", "dhi", "dni", "temp_air", "wind_speed", "pressure"]
LABEL = "built-in climate (climatology: long-term monthly means, synthetic days)"


def climate(latitude, longitude, year=2021, seed=0):
    """One typical year of a place.

    Parameters
    ----------
    latitude, longitude : float
        Place [°].
    year : int
        Calendar year, in UTC: determines sun positions and dates, not the weather.
    seed : int
        Seed of the random days and hours.

    Returns
    -------
    Record
        Hourly; the altitude is that of pvlib's table. At sea a clear sky, as noted in the label.
    """
    altitude = look_up_altitude(latitude, longitude)
    if look_up_normals(latitude, longitude) is None:
        record = clear_sky(latitude, longitude, altitude, year)
        record.label += f"; no land near {latitude:.2f}°, {longitude:.2f}°, so there is no built-in climate"
        return record
    year_of_place = make_climates([latitude], [longitude], year, seed)
    data = pd.DataFrame({name: year_of_place[name][0] for name in NAMES}, index=year_of_place["times"])
    return Record(data, latitude, longitude, altitude, "climate", LABEL)
