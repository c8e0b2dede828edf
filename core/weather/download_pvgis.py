"""The typical meteorological year of a place, from PVGIS' server (European Commission, Joint Research Centre)."""

import pvlib

from ..settings.errors import InputError
from .read_pvgis import lay_intervals
from .record import Record

TIMEOUT = (5.0, 60.0)  # [s] to reach the server, and for its answer
CURE = "give a file, or --weather climate, which needs no network"


def download_pvgis(latitude, longitude, url=None):
    """Download a typical year, with the same intervals as from a file.

    Parameters
    ----------
    latitude, longitude : float
        Place [°].
    url : str, optional
        URL of the server; by default that of pvlib.

    Returns
    -------
    Record
        Includes the horizon of distant terrain, from PVGIS.

    Raises
    ------
    InputError
        If there is no network, or PVGIS has no data for this place; with its message in one line.
    """
    longitude = (longitude + 180.0) % 360.0 - 180.0
    address = url or pvlib.iotools.pvgis.URL
    try:
        table, meta = pvlib.iotools.get_pvgis_tmy(
            latitude, longitude, timeout=TIMEOUT, coerce_year=None, map_variables=True, url=address
        )
        place = meta["inputs"]["location"]
        data = lay_intervals(table, float(place.get("irradiance_time_offset", 0.0)))
        altitude = float(place.get("elevation", 0.0))
    except OSError as error:  # what requests raises, from a missing network to PVGIS' own refusal
        raise InputError("--weather pvgis", describe_failure(error, address), CURE) from error
    except (ValueError, KeyError, TypeError, IndexError, AttributeError) as error:
        raise InputError("--weather pvgis", f"{address} sent no typical year ({type(error).__name__})", CURE) from error
    label = f"PVGIS {place['latitude']:g}°, {place['longitude']:g}° (typical year, downloaded)"
    return Record(data, place["latitude"], place["longitude"], altitude, "pvgis", label)


def describe_failure(error, address):
    """Reason of a failed download, in a few words."""
    if error.__class__.__name__ in ("ConnectionError", "ConnectTimeout", "ProxyError", "SSLError"):
        return f"cannot reach {address} ({error.__class__.__name__})"
    return f"{address} refused ({' '.join(str(error).split())[:160]})"
