"""Weather of any place and years, asked of services: PVGIS, NASA POWER, ERA5 of the Climate Data
Store and Open-Meteo.

Each answer is in UTC, becomes a Record and passes the checks of every record. It is kept as a csv
with its source, licence and date, and asked for again only where that is missing. The place is
rounded to 0.0001°, some 10 m.
"""

import os
import re
import threading
import urllib.parse
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pandas as pd
import pvlib
import requests

from ..settings.errors import InputError
from .read_csv import read_weather_csv
from .read_pvgis import COLUMNS as PVGIS_COLUMNS
from .read_pvgis import TYPICAL_HOURS, convert_hourly, lay_intervals, place_of_inputs
from .read_services import convert_points, parse_open_meteo, parse_power
from .sources import Asked
from .weather import Record

OPEN_METEO_URL = "https://archive-api.open-meteo.com/v1/archive"
TIMEOUT = (5.0, 120.0)  # [s] to reach a server, and for its answer
LATER = "ask again later or for fewer years, give a file, or --weather climate"
# ERA5's names, and as its point series are asked for:
POINT = (
    "ssrd",
    "fdir",
    "t2m",
    "u10",
    "v10",
    "sp",
)
POWER_NAMES = ("ALLSKY_SFC_SW_DWN", "ALLSKY_SFC_SW_DIFF", "ALLSKY_SFC_SW_DNI", "T2M", "WS10M", "PS")


@dataclass(frozen=True)
class _Question:
    """What is asked, and of whom."""

    asked: Asked
    latitude: float  # [°] rounded
    longitude: float  # [°] from -180 to below 180

    @property
    def name(self):
        """Name of the file that keeps the answer."""
        years = "typical" if self.asked.typical else f"{self.asked.first}-{self.asked.last}"
        return f"{self.asked.service.key}_{self.latitude:.4f}_{self.longitude:.4f}_{years}.csv"


def build_question(asked, latitude, longitude):
    """Question for a place [°] in any writing of its longitude."""
    return _Question(asked, round(latitude, 4), round((longitude + 180.0) % 360.0 - 180.0, 4))


def address_of(question):
    """URL of a question to a weather service, with place, years and variables as its query: str.
    For ERA5 it is the URL alone, since these are sent in the body of the request.
    """
    asked, place = question.asked, (question.latitude, question.longitude)
    first, last = asked.first, asked.last
    # PVGIS: a typical year, or the hours of years on a level plane, by parts.
    if asked.service.key == "pvgis":
        words = {"lat": place[0], "lon": place[1], "outputformat": "json"}
        if not asked.typical:
            words |= {
                "angle": 0,
                "aspect": 0,
                "pvcalculation": 0,
                "pvtechchoice": "crystSi",
                "mountingplace": "free",
            }
            words |= {
                "trackingtype": 0,
                "components": 1,
                "usehorizon": 0,
                "optimalangles": 0,
                "optimalinclination": 0,
            }
            words |= {"loss": 0, "startyear": first, "endyear": last}
        base = pvlib.iotools.pvgis.URL + ("tmy" if asked.typical else "seriescalc")
    # NASA POWER: parameters by their names there, in UTC.
    elif asked.service.key == "nasa-power":
        words = {
            "latitude": place[0],
            "longitude": place[1],
            "start": f"{first}0101",
            "end": f"{last}1231",
        }
        words |= {
            "community": "re",
            "parameters": ",".join(POWER_NAMES),
            "format": "json",
            "header": True,
        }
        words |= {"time-standard": "utc"}
        base = pvlib.iotools.nasa_power.URL
    # Open-Meteo: hourly variables, metres per second, UTC.
    elif asked.service.key == "open-meteo":
        words = {"latitude": place[0], "longitude": place[1], "start_date": f"{first}-01-01"}
        words |= {
            "end_date": f"{last}-12-31",
            "hourly": "temperature_2m,wind_speed_10m,surface_pressure,"
            "shortwave_radiation,diffuse_radiation,direct_normal_irradiance",
            "wind_speed_unit": "ms",
            "timezone": "GMT",
        }
        base = OPEN_METEO_URL
    # ERA5 has one address for all places, at the Climate Data Store that the user's configuration
    # names, or at its usual one.
    else:
        process = "processes/reanalysis-era5-single-levels-timeseries/execution"
        return f"{_read_cds_configuration()[0]}/retrieve/v1/{process}"
    return f"{base}?{urllib.parse.urlencode(words)}"


def ask_weather(asked, latitude, longitude, altitude, keep=()):
    """Weather of a service, from a kept answer or from its server.

    Parameters
    ----------
    asked : Asked
    latitude, longitude : float
        [°]
    altitude : float
        [m], where the service tells none.
    keep : sequence of path-like
        Folders in which kept answers are looked for; a new one is written to the first, and an old
        one is copied there.

    Returns
    -------
    Record

    Raises
    ------
    InputError
        No network, a refusal, years out of range, half an answer, or one without the columns that
        were asked for.
    """
    question = build_question(asked, latitude, longitude)
    for folder in map(Path, keep):
        if (path := folder / question.name).is_file():
            record = _read_kept(path)
            break
    else:
        record = _ask(question, altitude)
        path = None
    if keep and path != Path(keep[0]) / question.name:
        _write_kept(Path(keep[0]) / question.name, record, question)
    return record


def _ask(question, altitude):
    """Record of a service's answer, complete; `altitude` [m] holds where the service tells none.

    Raises
    ------
    InputError
        No or another answer than weather, or one with gaps.
    """
    # Each service has its question; whatever fails is told with the option and the address.
    option, where = f"--weather {question.asked.text}", address_of(question).split("?")[0]
    ask = {
        "pvgis": _ask_pvgis,
        "nasa-power": _ask_power,
        "open-meteo": _ask_open_meteo,
        "era5": _ask_era5,
    }
    try:
        data, place, columns = ask[question.asked.service.key](question)
    # Failures become messages: a refusal by our own checks; no connection, no answer in time, or
    # the service's own refusal; an answer that is no weather.
    except InputError as error:
        raise InputError(option, f"{where}: {error.problem}", error.cure) from error
    except (
        OSError
    ) as error:  # what requests raises, from a missing network to a service's own refusal
        name = type(error).__name__
        if name in ("ConnectionError", "ConnectTimeout", "ProxyError", "SSLError"):
            raise InputError(
                option,
                f"cannot reach {where} ({name})",
                "give a file, or --weather climate, which needs no network",
            ) from error
        if isinstance(error, TimeoutError | requests.Timeout):
            raise InputError(option, f"{where} did not answer in time", LATER) from error
        raise InputError(option, f"{where} refused ({_words_of(error)})", LATER) from error
    except (ValueError, KeyError, TypeError, IndexError, AttributeError) as error:
        words = f"{type(error).__name__}: {_words_of(error)}"
        raise InputError(option, f"{where} sent no weather ({words})", LATER) from error
    # The answer must hold what was asked for.
    _check_answer(option, where, question.asked, data)
    place = (question.latitude, question.longitude, altitude if place is None else place)
    years = "typical year" if question.asked.typical else question.asked.years
    label = f"{question.asked.service.title} {place[0]:g}°, {place[1]:g}° ({years}, downloaded)"
    return Record(data.astype(float), *place, question.asked.text, label, columns=columns)


def _check_answer(option, where, asked, data):
    """Refuse half an answer: columns, hours or values that are missing."""
    light = [name for name in ("ghi", "dhi", "dni") if name in data]
    missing = [name for name in ("temp_air", "wind_speed") if name not in data]
    if missing or not light or (len(light) < 2 and asked.service.key != "era5"):
        got = ", ".join(data) or "nothing"
        raise InputError(option, f"{where} sent {got}: its columns may have changed", LATER)
    hours = TYPICAL_HOURS
    if not asked.typical:
        hours = int(
            (pd.Timestamp(asked.last + 1, 1, 1) - pd.Timestamp(asked.first, 1, 1))
            / pd.Timedelta(hours=1)
        )
    if len(data) != hours:
        raise InputError(option, f"{where} sent {len(data):,} of {hours:,} hours", LATER)
    gaps = data.isna().any(axis=1)
    if gaps.any():
        raise InputError(
            option,
            f"{where} has no values for {gaps.sum():,} hours, the first at {data.index[gaps][0]}",
            "ask for other years, or another service",
        )


def _ask_pvgis(question):
    """Table, altitude [m] and names of PVGIS: a typical year, or hourly series on the horizontal
    plane.
    """
    asked, place = question.asked, (question.latitude, question.longitude)
    url = pvlib.iotools.pvgis.URL
    if asked.typical:
        options = {"timeout": TIMEOUT, "coerce_year": None, "map_variables": True, "url": url}
        table, meta = pvlib.iotools.get_pvgis_tmy(*place, **options)
        _, _, altitude, offset = place_of_inputs("", meta["inputs"])
        return lay_intervals(table, offset), altitude, PVGIS_COLUMNS
    options = {"usehorizon": False, "url": url, "timeout": TIMEOUT}  # --horizon pvgis adds it
    table, meta = pvlib.iotools.get_pvgis_hourly(*place, asked.first, asked.last, **options)
    data, columns = convert_hourly(table)
    return data, place_of_inputs("", meta["inputs"])[2], columns


def _ask_power(question):
    """Ask NASA POWER for the hours of years; pvlib sets no time limit of its own."""
    asked, place = question.asked, (question.latitude, question.longitude)
    ends = f"{asked.first}-01-01", f"{asked.last}-12-31"
    options = {"map_variables": False, "url": pvlib.iotools.nasa_power.URL}
    table, meta = _within(
        sum(TIMEOUT),
        lambda: pvlib.iotools.get_nasa_power(*place, *ends, list(POWER_NAMES), **options),
    )
    units = {name: about["units"] for name, about in meta["parameters"].items()}
    data, columns = parse_power(question.asked.text, table, units)
    return data, float(meta["altitude"]), columns


def _ask_open_meteo(question):
    """Ask Open-Meteo, which pvlib does not have, for the hours of years."""
    answer = requests.get(address_of(question), timeout=TIMEOUT)
    if not answer.ok:
        raise requests.HTTPError(_reason_of(answer))
    data, columns, head = parse_open_meteo(question.asked.text, answer.text)
    return data, float(head["elevation"]), columns


def _ask_era5(question):
    """Ask for ERA5's point series of whole years, radiation, temperature, wind and pressure, with
    the key of the user's own configuration.

    Returns the table by our names, None for the altitude, and the names of its columns there.
    """
    url, key = _read_cds_configuration()
    # Without a key the user is told how to get one, and nothing is asked.
    if not key:
        cure = (
            "put url: and key: of your account at the Climate Data Store into .cdsapirc in your "
            "home folder"
        )
        raise InputError("", "needs a key", f"{cure}, or ask pvgis, nasa-power or open-meteo")
    asked, place = question.asked, (question.latitude, question.longitude)
    ends = f"{asked.first}-01-01", f"{asked.last}-12-31"
    # ERA5 may wait in its queue for a quarter of an hour.
    options = {"map_variables": False, "timeout": 900.0, "url": f"{url}/retrieve/v1/"}
    try:
        point_names = (
            "surface_solar_radiation_downwards",
            "total_sky_direct_solar_radiation_at_surface",
            "2m_temperature",
            "10m_u_component_of_wind",
            "10m_v_component_of_wind",
            "surface_pressure",
        )
        table, _ = pvlib.iotools.get_era5(*place, *ends, list(point_names), key, **options)
    # Errors that `_ask` tells apart pass; any other is taken as a refusal by the service.
    except (OSError, ValueError, KeyError, TypeError, IndexError, AttributeError):
        raise
    except Exception as error:  # pvlib raises a plain one for a refusal
        raise requests.HTTPError(*error.args) from error
    data, columns = convert_points(table, pd.DatetimeIndex(table.index))
    return data, None, columns


def _read_cds_configuration():
    """Address and key of the Climate Data Store, as its own client finds them: environment, then
    .cdsapirc.
    """
    path = Path(os.environ.get("CDSAPI_RC", Path.home() / ".cdsapirc"))
    text = path.read_text("utf-8") if path.is_file() else ""
    lines = dict(re.findall(r"^\s*(url|key)\s*:\s*(\S+)\s*$", text, re.MULTILINE))
    url = os.environ.get("CDSAPI_URL", lines.get("url", "https://cds.climate.copernicus.eu/api"))
    return url.rstrip("/"), os.environ.get("CDSAPI_KEY", lines.get("key", ""))


def _within(seconds, call):
    """What a call returns, or TimeoutError: its thread is left to itself."""
    outcome = {}

    def run():
        try:
            outcome["answer"] = call()
        except Exception as error:  # raised where it is waited for
            outcome["error"] = error

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    thread.join(seconds)
    if thread.is_alive():
        raise TimeoutError
    if "error" in outcome:
        raise outcome["error"]
    return outcome["answer"]


def _reason_of(answer):
    """Why a server refused, in its own words where it gives any."""
    try:
        return answer.json()
    except ValueError:
        return f"{answer.status_code} {answer.reason}"


def _words_of(error):
    """One line of an error; of an answer in json what it says of it."""
    told = error.args[0] if error.args else error
    if isinstance(told, dict):
        names = ("reason", "messages", "message", "detail", "title")
        told = next((told[name] for name in names if told.get(name)), told)
    if isinstance(told, list | tuple):
        told = "; ".join(map(str, told))
    return " ".join(str(told).split())[:160]


def _write_kept(path, record, question):
    """Keep an answer as a csv that `--weather` reads, too."""
    service = question.asked.service
    head = {
        "source": f"{service.title}, {address_of(question)}",
        "licence": service.licence,
        "date": f"{datetime.now(UTC):%Y-%m-%d}",
        "label": record.label,
        "latitude": record.latitude,
        "longitude": record.longitude,
        "altitude": record.altitude,
        "columns": ", ".join(
            f"{ours}={theirs}" for ours, theirs in record.columns.items() if ours in record.data
        ),
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = "".join(f"# {name}: {value}\n" for name, value in head.items())
    path.write_text(lines + record.data.rename_axis("time").to_csv(), "utf-8")


def _read_kept(path):
    """Record of a kept answer."""
    record = read_weather_csv(path, (np.nan, np.nan, np.nan))
    text = path.read_text("utf-8")
    head = dict(re.findall(r"^# (label|columns|date): (.*)$", text, re.MULTILINE))
    columns = dict(
        part.split("=", 1) for part in head.get("columns", "").split(", ") if "=" in part
    )
    return replace(record, label=head.get("label", record.label), columns=record.columns | columns)
